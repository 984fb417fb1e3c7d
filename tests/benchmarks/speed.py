"""Processor times, as ratios within one run: works take turns, and the fastest of several rounds counts."""

from __future__ import annotations

import ctypes
import math
import os
import sys
import tempfile
from _ctypes import dlclose
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tables import IMPORT, ROOT, in_turns, processor_time, show

from mounted_examples import COMPRESSION, GRAVITY, box, unit
from springs import MOUNT
from strandspring import Record, Spring, SpringParameters, examples, identify, isolate
from strandspring.compiled import zig
from strandspring.compiled.images import FMU, image
from strandspring.compiled.sources import FMI_HEADERS, fmi_header
from strandspring.compiled.targets import host_target
from strandspring.fmu.native.block import filled
from strandspring.model.modelfile import ModelFile
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.simulation import run_case
from strandspring.vibration.one_mass.options import Excitation, Mount
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import IsolatedMass
from strandspring.vibration.signals.level_table import LevelTable
from strandspring.vibration.signals.pulses import HalfSine
from strandspring.vibration.signals.random_signal import RandomVibration
from synthetic import AMPLITUDE, MEAN, spring_of

SPRING = SpringParameters((5.0, 3000.0, 2e4, 1e6), (1.0, 10.0, 100.0), 25.0, 400.0, 1.0, 0.5, 0.05, 0.03, 0.07)
GUID = b"{00000000-0000-0000-0000-000000000000}"
MODEL = ROOT / "models/rubber_hinge.json"


def sine(cycles: float, samples: int) -> np.ndarray:
    return MEAN + AMPLITUDE * np.sin(2.0 * np.pi * cycles * np.linspace(0.0, 1.0, samples))


def turning(samples: int) -> np.ndarray:
    """A path of random strokes, each to the other side of the one before: every sample turns."""
    return MEAN + np.random.default_rng(1).uniform(0.0, AMPLITUDE, samples) * (-1.0) ** np.arange(samples)


def sample(p: SpringParameters) -> float:
    """Time of a sample of a smooth response [s]."""
    middle, half = 0.5 * (p.displacement_min + p.displacement_max), 0.475 * (p.displacement_max - p.displacement_min)
    path = middle + half * (sine(200, 1_000_000) - MEAN) / AMPLITUDE
    return in_turns({"": lambda: Spring(p).response(path)})[""] / path.size


def kernel() -> None:
    """Force, stiffness and energy along a path, beside a loop of `pow` in C over as many numbers."""
    spring, rows = Spring(SPRING), []
    with tempfile.TemporaryDirectory() as folder:
        powers = driver(Path(folder)).powers
        for name, path in (("smooth", sine(20, 1_000_000)), ("every sample turns", turning(100_000))):
            numbers, results = np.random.default_rng(0).uniform(0.0, 1.0, path.size), np.empty(path.size)
            pointers = [ctypes.c_void_p(each.ctypes.data) for each in (numbers, results)]
            works = {
                "pow in C": partial(powers, path.size, *pointers),
                "response": partial(spring.response, path),
                "stiffness": partial(spring.stiffness, path),
                "absorbed energy": partial(spring.absorbed_energy, path),
            }
            times = in_turns(works, 9)
            rows += [{"path": name, "what": key, "ns a sample": 1e9 * taken / path.size,
                      "times pow": taken / times["pow in C"]} for key, taken in times.items()]  # fmt: skip
    show("Along a path", rows)


def identify_time(largest: int = 1_000_000) -> None:
    """`identify` by number of records, cycles and samples, up to `largest` samples, with exponents between sizes."""
    spring, numpy, rows = Spring(spring_of(1.0, 1.2)), processor_time(IMPORT, ROOT), []

    def record(cycles: int, samples: int, share: float = 1.0, seed: int = 0) -> Record:
        path = MEAN + share * (sine(cycles, samples) - MEAN)
        noise = 0.3 * np.random.default_rng(seed).standard_normal(path.size)
        return Record(path, spring.response(path) + noise, np.arange(path.size) * cycles / path.size)

    def amplitudes(count: int) -> list[Record]:
        return [record(3, 900, share, seed) for seed, share in enumerate(np.linspace(0.4, 1.0, count).tolist())]

    identify(record(3, 900))  # what is done once
    kinds: dict[str, tuple[tuple[int, ...], int, Callable[[int], list[Record]]]] = {
        "records of 900 samples": ((1, 16, 64, 256), 900, amplitudes),
        "cycles of 100 samples": ((10, 1000, 10_000), 100, lambda count: [record(count, 100 * count)]),
        "cycles of 30 samples": ((1000, 33_000), 30, lambda count: [record(count, 30 * count)]),
        "samples of each of 9 cycles": ((1000, 100_000, 1_000_000), 9, lambda count: [record(9, 9 * count)]),
    }
    for name, (sizes, each, records_of) in kinds.items():
        before = None
        for size in [size for size in sizes if size * each <= largest]:
            records = records_of(size)
            taken = in_turns({"": lambda r=records: identify(r)}, 1)[""]
            exponent = math.log(taken / before[1]) / math.log(size / before[0]) if before else "-"
            rows.append(
                {"what": f"{size} {name}", "s": taken, "times import numpy": taken / numpy, "exponent": exponent}
            )
            before = size, taken
    show("Processor time of identify", rows)


def isolation() -> None:
    """Transmissibility at 200 frequencies by harmonic balance; tests/systems compare it with SciPy."""
    # Without some viscous damping small free vibrations take thousands of periods to die out.
    system, band, rows = IsolatedMass(MOUNT, 5.0, Mount(50.0, damping=15.0)), np.geomspace(2.5, 40.0, 200), []
    base = Excitation.BASE_DISPLACEMENT
    frequency_response(system, base, 2e-4, band[:2])  # imports and tables
    for level in (2e-4, 6e-4, 1.2e-3):
        taken = in_turns({"": lambda level=level: frequency_response(system, base, level, band)})[""]
        rows.append({"level [mm]": 1e3 * level, "time [ms]": 1e3 * taken, "samples of response": taken / sample(MOUNT)})
    show("Transmissibility at 200 frequencies", rows)


def bodies(draws: int = 100) -> None:
    """Bodies in six degrees of freedom: a shock, `draws` shocks with drawn springs, 60 s at random, `isolate`."""
    system = box()
    start = rest(system)

    def case(duration: float, signal: Signal) -> LoadCase:
        channel = LoadChannel(ChannelKind.BASE_ACCELERATION, signal, unit(1.0, 2.0, 3.0))
        return LoadCase("case", "pulse", duration, (channel,))

    shock = case(1.0, HalfSine(15.0 * GRAVITY, 0.011))
    level = LevelTable(((10.0, 0.01 * GRAVITY**2), (200.0, 0.01 * GRAVITY**2)))
    shaking = case(60.0, RandomVibration(level, 60.0, 1))

    def drawn() -> None:
        """Each with springs of its own: tables of their laws, rest and motion."""
        for factor in np.random.default_rng(1).lognormal(0.0, 0.1, draws).tolist():
            one = system.with_springs(
                lambda p, f=factor: replace(p, kE=tuple(f * k for k in p.kE), kappa_omega=f * p.kappa_omega)
            )
            run_case(one, shock, rest(one), 1e-4)

    file = Path(examples.__file__).parent / "systems" / "electronics_box.toml"
    works = {
        "1 s shock": (10_000, lambda: run_case(system, shock, start, 1e-4)),
        "60 s random at 20 kHz": (1_200_000, lambda: run_case(system, shaking, start, 5e-5)),
        f"{draws} drawn shocks": (10_000 * draws, drawn),
        "isolate, electronics box": (1, lambda: isolate(file)),
    }
    times, one = in_turns({name: work for name, (_, work) in works.items()}, 2), sample(COMPRESSION)
    rows = [{"what": name, "s": taken, "us a step": 1e6 * taken / works[name][0],
             "samples a step": taken / works[name][0] / one} for name, taken in times.items()]  # fmt: skip
    show("A body on twelve springs; samples are of `response`; isolate is one step", rows)


class Calls(ctypes.Structure):
    """As in calls.c."""

    _fields_ = [*((name, ctypes.c_void_p) for name in ("set", "step", "get", "input", "outputs")),
                ("output_count", ctypes.c_size_t)]  # fmt: skip


def driver(folder: Path) -> ctypes.CDLL:
    """The loops of calls.c."""
    sources = {name: fmi_header(name) for name in FMI_HEADERS[3]}
    sources["calls.c"] = Path(__file__).with_name("calls.c").read_bytes()
    flags = ("-O2", "-D_GNU_SOURCE", "-Wno-strict-prototypes")
    library = folder / "calls.so"
    library.write_bytes(zig.shared_library(host_target(), sources, ("calls.c",), "calls", flags))
    loaded = ctypes.CDLL(str(library))
    loaded.in_turn.restype = ctypes.c_double
    return loaded


@contextmanager
def instances(
    folder: Path, parameters: SpringParameters, start: float, count: int, outputs: int
) -> Iterator[tuple[Calls, Any]]:
    """Instances of one FMU in step mode, and its calls."""
    binary = folder / "spring.so"
    model = ModelFile("spring", parameters)
    binary.write_bytes(filled(image(FMU, host_target()).read_bytes(), model, GUID.decode()))
    fmu = ctypes.CDLL(str(binary))
    fmu.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
    begin = [ctypes.c_char_p(b"one"), ctypes.c_char_p(GUID), None, False, False, False, False, None]
    made = (ctypes.c_void_p * count)(
        *(fmu.fmi3InstantiateCoSimulation(*begin, ctypes.c_size_t(0), None, None, None) for _ in range(count))
    )
    references, zero, one = (ctypes.c_uint32 * 5)(1, 2, 3, 6, 4), ctypes.c_double(), ctypes.c_size_t(1)
    for each in map(ctypes.c_void_p, made):
        status = fmu.fmi3EnterInitializationMode(each, False, zero, zero, False, zero)
        status |= fmu.fmi3SetFloat64(each, references, one, ctypes.byref(ctypes.c_double(start)), one)
        assert status | fmu.fmi3ExitInitializationMode(each) == 0
    first, names = ctypes.addressof(references), ("SetFloat64", "DoStep", "GetFloat64")
    pointers = (ctypes.cast(getattr(fmu, f"fmi3{name}"), ctypes.c_void_p) for name in names)
    yield Calls(*pointers, first, first + 4, outputs), made
    for each in map(ctypes.c_void_p, made):
        fmu.fmi3FreeInstance(each)
    dlclose(fmu._handle)


def native(rounds: int = 21) -> None:
    """A step of the native FMU in C, of one and of many instances."""
    p, rows = Spring.load(MODEL).parameters, []
    middle, half = 0.5 * (p.displacement_min + p.displacement_max), 0.475 * (p.displacement_max - p.displacement_min)
    wave = middle + half * np.sin(np.linspace(0.0, 200.0 * np.pi, 20_000))
    turns = middle + half * (turning(20_000) - MEAN) / AMPLITUDE
    base = 1e9 * sample(p)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        loops = driver(folder)
        for title, path, count in (("sine", wave, 1), ("every step turns", turns, 1), ("sine", wave[:200], 10_000)):
            with instances(folder, p, path[0], count, 1) as (calls, made):
                arguments = ctypes.byref(calls), made, count, path.size, ctypes.c_void_p(path.ctypes.data)
                taken = min(loops.in_turn(*arguments) for _ in range(rounds if count == 1 else 3))
            rows.append({"step": f"{title}, {count} instances", "ns": taken, "samples": taken / base})
    show("One exchange: displacement set, step done, force read; and samples of a response", rows)


def startup(rounds: int = 5) -> None:
    """Processor time of short commands against that of `python -c "import numpy"`."""
    record, program = str(ROOT / "models/records/rubber_stretch.csv"), [sys.executable, "-m", "strandspring"]
    commands = {
        "import numpy": IMPORT, "import strandspring": [sys.executable, "-c", "import strandspring"],
        "--help": [*program, "--help"],
        "identify": [*program, "identify", record, "--reverse", "displacement", "-o", "m.json"],
        "predict": [*program, "predict", str(MODEL), record, "--reverse", "displacement"],
        "build": [*program, "build", str(MODEL), "--platform", "host"],
        "isolate": [*program, "isolate", str(MODEL), "--mass", "0.05"],
    }  # fmt: skip
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # without NumPy's bytecode its import takes twice as long
    with tempfile.TemporaryDirectory() as folder:
        times = {name: processor_time(command, Path(folder), rounds) for name, command in commands.items()}
    show("Processor time, medians", [{"command": name, "s": taken, "times import numpy": taken / times["import numpy"]}
                                     for name, taken in times.items()])  # fmt: skip
