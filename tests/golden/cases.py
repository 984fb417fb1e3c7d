"""What is computed, case by case, through interfaces that stay: `Spring`, the command line with `--json`, FMUs by fmpy.

Every case gives a dictionary of numbers, lists of numbers, and words or truth values, which have to be the same.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache, partial
from itertools import count, product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from numpy.typing import NDArray

from strandspring import Spring, SpringParameters
from strandspring.cli.main import main

HERE = Path(__file__).parent
ROOT = next(folder for folder in HERE.absolute().parents if (folder / "pyproject.toml").is_file())
INPUTS = json.loads((HERE / "inputs.json").read_text(encoding="utf-8"))
KEPT = 60  # samples of a path whose outputs are kept

Outputs = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """One computation; `kind` says which tolerances hold, `spring` on which spring, `slow` that it takes a second."""

    kind: str
    name: str
    run: Callable[[Workshop], Outputs]
    slow: bool = False
    spring: SpringParameters | None = None


# Springs: those drawn (inputs.json), and some to make records of and to put masses on.

SPRINGS = {name: SpringParameters(**numbers) for name, numbers in INPUTS["springs"].items()}
STARTS = (0.0, -1.0, 0.3, 1.0)  # of omega, in turn


def _record_spring(n: float, sigma: float, rho: float) -> SpringParameters:
    return SpringParameters((5.0, 3e3, 2e4, 1e6), (1.0, 10.0, 100.0), 25.0, rho, sigma, n, 0.05, 0.03, 0.07)


MODELS = {
    "smooth": _record_spring(1.0, 1.0, 287.8),
    "cusp": _record_spring(0.3, 3.0, 594.0),
    "sharp": _record_spring(4.0, 0.7, 123.5),
    "fat": _record_spring(0.6, 1.5, 493.9),
    "mount": SpringParameters(
        (50.0, 2e4, 1e5, 2e7), (1.0, 10.0, 100.0), 15.0, 400.0, 1.0, 0.5, 0.05, 0.02, 0.08
    ),
    "rope": SpringParameters(
        (3.0, 1.1e4, -2e4, 1e6), (1.0, 2.0, 30.0), 21.7, 310.0, 1.3, 0.22, 0.02, 0.001, 0.05
    ),
    "friction": SpringParameters((0.0, 4e3), (1.0,), 150.0, 900.0, 10.0, 8.0, -0.01, -0.1, 0.1),
    "skew": SpringParameters(
        (0.0, 9e3, 0.0, 3e6, 0.0, 2e9), (1.0, -8.0, 200.0, 9e3, -1e5, 3e6), 40.0, 150.0, 0.5, 1.7, 0.0, -0.02, 0.03
    ),
}  # fmt: skip
HINGE = "rubber_hinge"  # a model file of that version, kept beside this file for its standard errors


class Workshop:
    """A folder in which model files, records and FMUs are made when they are first asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._numbers = count()
        self.model = cache(self._model)
        self.record = cache(self._record)

    def new(self, name: str = "") -> Path:
        """A path that is not there yet."""
        return self.folder / f"{next(self._numbers)}{name}"

    def _model(self, name: str) -> Path:
        if name == HINGE:
            return HERE / f"{HINGE}.json"
        path = self.folder / f"{name}.json"
        Spring(MODELS[name], name).save(path)
        return path

    def _record(self, name: str) -> Path:
        path = self.folder / f"{name}.csv"
        kind, *options = RECORDS[name]
        source = [self.model(options.pop(0))] if kind == "spring" else []
        finished("synthesize", kind, *source, *options, "-o", path)
        return path


def command(*arguments: object) -> tuple[int, str]:
    """Exit status and standard output of `strandspring`, run in this process for speed."""
    out, status = io.StringIO(), 0
    with redirect_stdout(out), redirect_stderr(io.StringIO()):
        try:
            main(list(map(str, arguments)))
        except SystemExit as leaving:
            status = int(leaving.code or 0)
    return status, out.getvalue()


def finished(*arguments: object) -> str:
    """Standard output of a command that must succeed."""
    status, out = command(*arguments)
    assert status == 0, f"exit status {status} of {' '.join(map(str, arguments))}"
    return out


# Responses

OUTPUTS = ("force", "stiffness", "absorbed_energy", "omega")


def response(name: str, path: str, omega_start: float, _workshop: Workshop) -> Outputs:
    """All outputs of a spring at some samples of a path."""
    p = SPRINGS[name]
    middle = 0.5 * (p.displacement_min + p.displacement_max)
    half = 0.5 * (p.displacement_max - p.displacement_min)
    displacement = middle + half * 1e-6 * np.array(INPUTS["paths"][path], dtype=np.float64)
    kept = np.unique(np.linspace(0.0, displacement.size - 1.0, KEPT).round().astype(int))
    spring = Spring(p)
    quantities = zip(OUTPUTS, (spring.response, spring.stiffness, spring.absorbed_energy, spring.omega), strict=True)
    found = {name: of(displacement, omega_start)[kept].tolist() for name, of in quantities}
    travel = float(np.sum(np.abs(np.diff(displacement))))
    return {**found, "farthest": float(np.abs(displacement).max()), "travel": travel}


# FMUs


def simulation(name: str, backend: str, omega_start: float, workshop: Workshop) -> Outputs:
    """`_simulation` in a process of its own, so that what the FMU leaves behind in it does not matter."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        folder = workshop.new()
        return process.submit(_simulation, name, workshop.model(name), folder, backend, omega_start).result()


def _simulation(name: str, model: Path, folder: Path, backend: str, omega_start: float) -> Outputs:
    """An FMU built, and run over uneven steps; before each step two displacements are tried, outputs read, and left."""
    platform = ("--platform", "host") if backend == "native" else ()
    finished("build", model, "-o", folder, "--backend", backend, "--zero", "rig", *platform)
    (fmu,) = folder.glob("*.fmu")
    with redirect_stdout(io.StringIO()):  # fmpy prints the warnings of the FMU
        rows = _run(fmu, name, omega_start)
    travel = float(np.sum(np.abs(np.diff(rows[2::3, 0]))))
    found = dict(zip(("displacement", *OUTPUTS), rows.T.tolist(), strict=True))
    return {**found, "farthest": float(np.abs(rows[:, 0]).max()), "travel": travel}


def _run(fmu: Path, name: str, omega_start: float) -> NDArray[np.float64]:
    """Displacement and outputs of two trials and the step after them, for each step in turn."""
    description = fmpy.read_model_description(fmu)
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(fmu, fmu.parent / "unpacked"),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName=name,
    )

    def tried(displacement: float) -> list[float]:
        slave.setReal([reference["displacement"]], [displacement])
        return [displacement, *slave.getReal([reference[output] for output in OUTPUTS])]

    p = parameters(name)
    low, high = p.displacement_min, p.displacement_max
    # Some of the path lies outside the range.
    path = [low + (high - low) * (0.5 + 0.55e-6 * k) for k in INPUTS["paths"]["wander"][::2]]
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.setReal([reference["displacement"], reference["omega_start"]], [path[0], omega_start])
    slave.exitInitializationMode()
    rows, time = [], 0.0
    for k, displacement in enumerate(path):
        rows += [tried(path[(7 * k) % len(path)]), tried(path[(11 * k + 5) % len(path)])]
        tried(displacement)
        size = 1e-3 * (1 + k % 5)
        slave.doStep(time, size)
        time += size
        rows.append([displacement, *slave.getReal([reference[output] for output in OUTPUTS])])
    slave.terminate()
    slave.freeInstance()
    return np.array(rows)


def parameters(name: str) -> SpringParameters:
    """Parameters of a model by its name."""
    return Spring.load(HERE / f"{HINGE}.json").parameters if name == HINGE else MODELS[name]


# Masses on mounts

ISOLATED: dict[str, tuple[str, ...]] = {
    "hinge at its default levels": (HINGE, "--mass", "0.02"),
    "hinge with superharmonics": (HINGE, "--mass", "0.025", "--base-displacement", "0.05"),
    "hinge, light, damped": (HINGE, "--mass", "0.012", "--damping", "0.02", "--base-displacement", "0.1"),
    "hinge under a force": (HINGE, "--mass", "0.02", "--force", "0.005", "--force", "0.02"),
    "mount that folds": (
        "mount", "--mass", "5.1", "--damping", "20", "--base-displacement", "2", "--band", "5", "25", "--extrapolate"
    ),
    "mount shaken hard": (
        "mount", "--mass", "5.1", "--damping", "20", "--base-displacement", "5", "--band", "5", "25", "--extrapolate"
    ),
    "two mounts by acceleration": (
        "mount", "--mass", "12", "--parallel", "2", "--damping", "40", "--load", "100", "--base-acceleration", "1",
        "--base-acceleration", "3", "--band", "4", "30"
    ),
    "three in series, two rows": (
        "skew", "--mass", "4", "--parallel", "2", "--series", "3", "--base-displacement", "1"
    ),
    "friction without load": ("friction", "--mass", "10", "--load", "0", "--force", "40", "--force", "200"),
    "refused: beyond the range": ("mount", "--mass", "5", "--base-displacement", "5"),
    "refused: too heavy": ("mount", "--mass", "1000"),
}  # fmt: skip


# Headings of the table by which its columns are kept.
_KEPT_NAMES = {
    "static equilibrium [m]": "rest [m]",
    "relative motion over base motion [1]": "relative [1]",
    "relative motion over force [m/N]": "relative [m/N]",
    "amplitude of the mount [m]": "amplitude [m]",
    "mean displacement of a spring [m]": "mean [m]",
    "lowest displacement of a spring [m]": "least [m]",
    "highest displacement of a spring [m]": "greatest [m]",
    "displacement of the mount at the crest [m]": "displacement at the crest [m]",
    "speed of the mount at the crest [m/s]": "speed at the crest [m/s]",
    "outside the identified range": "extrapolating",
}


# Likewise of JSON.
_KEPT_KEYS = {"static_equilibrium": "rest", "min": "least", "max": "greatest", "requested": "wanted"}


def _by_kept_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    return {_KEPT_KEYS.get(key, key): value for key, value in pairs}


def isolated(workshop: Workshop, model: str, *options: str) -> Outputs:
    """The curves of a mass, at the frequencies asked for; where more are computed between them is left open."""
    table = workshop.new(".csv")
    status, out = command(
        "isolate", workshop.model(model), *options, "--zero", "rig", "--points", "24", "-o", table, "--json"
    )
    if status:
        return {"status": status}
    told = json.loads(out, object_pairs_hook=_by_kept_keys)
    found = flat({"rest": told["rest"], "system": told["system"], "excitation": told["excitation"]})
    for k, level in enumerate(told["levels"]):
        wanted = [point for point in level.pop("points") if point.pop("wanted")]
        found |= flat(level, f"{k}.") | columns(wanted, f"{k}.points.")
    rows = [row for row in read_table(table) if row.pop("requested frequency") == "True"]
    kept = [{_KEPT_NAMES.get(name, name): value for name, value in row.items()} for row in rows]
    return {"status": 0, **found, **columns(kept, "csv.")}


STUDIES: dict[str, tuple[str, ...]] = {
    "grid": (
        "mount", "--mass", "4:6:3", "--mass", "400", "--base-displacement", "0.1", "--stiffness", "0.9:1.1:2",
        "--draws", "0", "--band", "5", "20", "--points", "8"
    ),
    "draws": (HINGE, "--mass", "0.02", "--draws", "6", "--seed", "7", "--damping", "0.02", "--points", "12"),
}  # fmt: skip


def studied(workshop: Workshop, model: str, *options: str) -> Outputs:
    """The lines of a study, and its summary."""
    table = workshop.new(".csv")
    out = finished("study", workshop.model(model), *options, "--zero", "rig", "--workers", "1", "-o", table, "--json")
    rows = read_table(table)
    for row in rows:
        row["outcome"] = row["outcome"] if row["outcome"] == "done" else "refused"
    rows = [{_KEPT_NAMES.get(name, name): value for name, value in row.items()} for row in rows]
    points = json.loads(out, object_pairs_hook=_by_kept_keys)["points"]
    return {**flat(points, "summary."), **columns(rows, "csv.")}


# Records

HINGE_RECORD = ("models/records/rubber_stretch.csv", "--reverse", "displacement")
ACTUATOR = ("tests/data/actuator/circle_3bar.csv", "--displacement", "5", "--force", "7")
PLASTIC = ("tests/data/hinge/plastic_compress.csv",)

RECORDS: dict[str, tuple[str, ...]] = {
    "clean": ("spring", "smooth", "--samples", "400"),
    "noisy": ("spring", "smooth", "--samples", "500", "--noise", "0.03", "--seed", "1"),
    "campaign": (
        "spring", "fat", "--amplitude", "12", "--amplitude", "20", "--samples", "300", "--noise", "0.02", "--seed", "2",
        "--frequency", "0.2"
    ),
    "small": ("spring", "fat", "--amplitude", "14", "--samples", "333", "--noise", "0.01", "--seed", "3"),
    "fast": ("spring", "fat", "--samples", "300", "--noise", "0.01", "--seed", "4", "--frequency", "2"),
    "quantised": (
        "spring", "cusp", "--samples", "600", "--displacement-resolution", "0.01", "--force-resolution", "0.05"
    ),
    "drifting": ("spring", "sharp", "--samples", "400", "--drift", "0.02", "--noise", "0.005", "--cycles", "5"),
    "coarse": ("spring", "sharp", "--samples", "90", "--cycles", "2", "--mean", "49"),
    "paper": ("ni", "--noise", "0.03", "--seed", "0"),
    "drowned": ("ni", "--amplitude", "5.45", "--exponent", "1", "--seed", "7"),
    "paper, clean": ("ni", "--noise", "0", "--cycles", "2", "--samples", "400"),
    "paper, small": ("ni", "--amplitude", "3", "--exponent", "0.5", "--seed", "3", "--cycles", "3"),
}  # fmt: skip


def synthesized(workshop: Workshop, name: str) -> Outputs:
    """Some samples of a synthesized record, and the mean square of all forces."""
    rows = read_table(workshop.record(name))
    kept = np.unique(np.linspace(0.0, len(rows) - 1.0, KEPT).round().astype(int))
    square = float(np.mean([row["force [N]"] ** 2 for row in rows]))
    return {**columns([rows[k] for k in kept], ""), "samples": len(rows), "mean square": square}


IDENTIFIED: dict[str, tuple[str, ...]] = {
    **{
        f"{name}, {method}": (*record, "--method", method)
        for (name, record), method in product(
            {"hinge": HINGE_RECORD, "actuator": ACTUATOR, "plastic": PLASTIC}.items(),
            ("refined", "two-stage"),
        )
    },
    "hinge, robust": (*HINGE_RECORD, "--robust"),
    "hinge, cubic": (*HINGE_RECORD, "--degrees", "3,2"),
    "hinge, paper": (*HINGE_RECORD, "--method", "paper"),
    "actuator, robust": (*ACTUATOR, "--robust"),
    "actuator, cubic": (*ACTUATOR, "--degrees", "3,2"),
    **{f"{name}, refined": (name,) for name in RECORDS},
    "clean, two-stage": ("clean", "--method", "two-stage", "--degrees", "3,2"),
    "clean, paper": ("clean", "--method", "paper", "--degrees", "3,2"),
    "noisy, two-stage": ("noisy", "--method", "two-stage"),
    "noisy, smoothed": ("noisy", "--method", "paper", "--smoothing", "4", "--degrees", "3,2"),
    "noisy, cubic": ("noisy", "--degrees", "3,2"),
    "noisy, robust": ("noisy", "--robust"),
    "several": ("small", "fast", "--degrees", "3,2"),
    "several, two-stage": ("small", "fast", "--method", "two-stage"),
    "paper, ni": ("paper", "--method", "ni"),
    "paper, clean, ni": ("paper, clean", "--method", "ni"),
    "drowned, ni": ("drowned", "--method", "ni"),
    "paper, paper": ("paper", "--method", "paper"),
    "paper, unloading": ("paper", "--method", "paper", "--branch", "unloading"),
}


def identified(workshop: Workshop, *arguments: str) -> Outputs:
    """Parameters, standard errors, figures and cautions of an identification."""
    model = workshop.new(".json")
    status, out = command("identify", *_found(workshop, arguments), "-o", model, "--json")
    if status:
        return {"status": status}
    told = json.loads(out)
    told["outcomes"] = sorted(outcome["name"] for outcome in told["outcomes"])
    told.pop("name")
    return {"status": 0, **flat(told)}


def _found(workshop: Workshop, arguments: tuple[str, ...]) -> list[object]:
    """Arguments with the paths of records in the place of their names."""
    return [
        workshop.record(word) if word in RECORDS else ROOT / word if word.endswith(".csv") else word
        for word in arguments
    ]


COMPARED: dict[str, tuple[str, ...]] = {
    "hinge": (HINGE, *HINGE_RECORD),
    "several": ("fat", "small", "fast", "campaign"),
    "another spring": ("smooth", "quantised"),
}


def predicted(workshop: Workshop, model: str, *arguments: str) -> Outputs:
    """Figures of a prediction and some of its samples."""
    table = workshop.new(".csv")
    out = finished("predict", workshop.model(model), *_found(workshop, arguments), "-o", table, "--json")
    rows = read_table(table)
    kept = np.unique(np.linspace(0.0, len(rows) - 1.0, KEPT).round().astype(int))
    return {**flat(json.loads(out)), **columns([rows[k] for k in kept], "csv.")}


def described(workshop: Workshop, model: str, *arguments: str) -> Outputs:
    """What `info` says of a model, and of records beside it."""
    out = finished("info", workshop.model(model), *_found(workshop, arguments), "--zero", "rig", "--json")
    told = json.loads(out)
    for loop in told["loops"]:
        loop["source"] = "model" if loop["source"] == "model" else "record"
        loop |= {before: loop.pop(now) for now, before in RENAMED.items() if now in loop}
    return flat(told)


# Flat tables of numbers and words

RENAMED = {"min_force": "least_force", "max_force": "greatest_force"}
LEFT_OUT = {
    "sentence", "path", "model", "output", "plot", "report", "meaning", "compared", "reason", "indistinct", "seed"
}  # sentences may change, paths do  # fmt: skip


def flat(content: Any, prefix: str = "") -> Outputs:
    """Leaves of nested JSON by their place; lists of numbers are leaves."""
    if isinstance(content, dict):
        items = [(name, value) for name, value in content.items() if name not in LEFT_OUT]
    elif isinstance(content, list) and not all(value is None or isinstance(value, float | int) for value in content):
        items = [(str(k), value) for k, value in enumerate(content)]
    else:
        return {prefix.rstrip("."): content}
    return {place: leaf for name, value in items for place, leaf in flat(value, f"{prefix}{name}.").items()}


def columns(rows: list[dict[str, Any]], prefix: str) -> Outputs:
    """A list of rows as lists of columns."""
    return {f"{prefix}{name}": [row[name] for row in rows] for name in (rows[0] if rows else {})}


def read_table(path: Path) -> list[dict[str, Any]]:
    """Rows of a CSV file, with numbers where they are numbers, and None where there is none."""
    with path.open(encoding="utf-8", newline="") as file:
        return [{name: _number(text) for name, text in row.items()} for row in csv.DictReader(file)]


def _number(text: str) -> float | str | None:
    try:
        value = float(text or "nan")
    except ValueError:
        return text
    return value if np.isfinite(value) else None


# All cases


TABLES: tuple[tuple[str, Callable[..., Outputs], dict[str, tuple[str, ...]]], ...] = (
    ("isolate", isolated, ISOLATED),
    ("study", studied, STUDIES),
    ("synthesize", synthesized, {name: (name,) for name in RECORDS}),
    ("identify", identified, IDENTIFIED),
    ("predict", predicted, COMPARED),
    ("info", described, {name: (name,) for name in (HINGE, *MODELS)}),
    ("info", described, {f"{name}, records": arguments for name, arguments in COMPARED.items()}),
)


def _cases() -> Iterator[tuple[str, Case]]:
    for (j, path), (k, name) in product(enumerate(INPUTS["paths"]), enumerate(SPRINGS)):
        run = partial(response, name, path, STARTS[(j + k) % len(STARTS)])
        yield f"response/{name}/{path}", Case("path", f"{name}/{path}", run, spring=SPRINGS[name])
    for (k, name), backend in product(enumerate((HINGE, "rope", "friction", "skew")), ("python", "native")):
        run = partial(simulation, name, backend, STARTS[k])
        yield f"fmu/{name}/{backend}", Case("path", name, run, backend == "native", parameters(name))
    for kind, compute, members in TABLES:
        for name, arguments in members.items():
            slow = kind == "study" or "hinge" in name
            yield f"{kind}/{name}", Case(kind, name, partial(_with_workshop, compute, arguments), slow)


def _with_workshop(compute: Callable[..., Outputs], arguments: tuple[str, ...], workshop: Workshop) -> Outputs:
    return compute(workshop, *arguments)


CASES = dict(_cases())
