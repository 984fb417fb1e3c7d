"""What `strandspring export` writes, in programs of others: SSP systems, a Modelica library, and C for little targets.

rumoca, a Modelica compiler and simulator, takes the library together with ``modelica_stub.mo``, which has the few
classes of the Modelica Standard Library that the library needs. FMUs for real time are measured in test_hosts.py.
"""

from __future__ import annotations

import math
import re
import subprocess
import zipfile
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv
from fmpy.validation import validate_fmu

from branched_springs import BRANCHED, uneven_motion
from fmu_tools import AWKWARD, CONSTANT, LONGEST, OTHER, SPRING, wandering_path
from forms import FORMS
from oracles import OracleSpring, maxwell, rate_of_omega
from pages import ROOT, TEXTS, blocks
from portable_host import run
from springs import TABLE, force_by_definition, force_scale, spring
from strandspring import Spring, SpringParameters, export
from strandspring.core.parameters import ARRAYS, N_RANGE, SCALARS
from strandspring.core.variables import spring_parameters, start_values, variables
from strandspring.cosimulation import FmuSpring, Jacobi, Motion, one_mass, simulate
from strandspring.errors import StrandspringError
from strandspring.exchange.c_sources import STEP_SOURCES, law_path, write_c_sources
from strandspring.exchange.modelica import EXAMPLE, LIBRARY, record_name, record_path, record_text, write_library
from strandspring.exchange.shaken_mass_slave import ShakenMass
from strandspring.exchange.ssp import ShakenMassValues
from strandspring.fmu.description.ssv import parameter_values
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import ModelFile, load_model
from terminal import Terminal
from tools import program, slow_but, tool, ziglang

pytestmark = pytest.mark.long
HINGE = ROOT / "models" / "rubber_hinge.json"
RECORD = "StrandSpring/Records/mount.mo"


# SSP parameter values


@pytest.mark.parametrize("parameters", [SPRING, CONSTANT, LONGEST], ids=["spring", "constant", "longest"])
def test_ssv_holds_all_that_can_be_set_with_every_bit(parameters: SpringParameters, tmp_path: Path) -> None:
    exact = replace(parameters, kE=(0.1 + 0.2, *parameters.kE[1:]), rho=100.0 + 1e-13)
    path = tmp_path / "spring.ssv"
    path.write_text(parameter_values(ModelFile("spring", exact, AWKWARD)), encoding="utf-8", newline="\n")
    read, root = read_ssv(str(path)), ElementTree.parse(path).getroot()  # by the schema of SSP 1.0
    table = [v for v in variables(len(exact.kE), len(exact.kA)) if v.causality in ("input", "parameter")]
    assert (read.name, root.get("description")) == ("spring", AWKWARD)
    assert [(p.name, p.type, p.unit) for p in read.parameters] == [(v.name, "Real", v.unit) for v in table]
    values = {p.name: float(p.value) for p in read.parameters}
    assert values == start_values(exact)
    assert spring_parameters(values, len(exact.kE), len(exact.kA)) == exact
    described = fmpy.read_model_description(str(build_native_fmu(ModelFile("spring", exact), tmp_path)))
    of_fmu = {unit.name: unit.baseUnit for unit in described.unitDefinitions}
    for unit in root.iterfind("{*}Units/{*}Unit"):
        powers = {symbol: int(power) for symbol, power in unit[0].attrib.items()}
        base = of_fmu[str(unit.get("name"))]
        assert [powers.get(s, 0) for s in ("kg", "m", "s")] == [getattr(base, s) for s in ("kg", "m", "s")]
        assert (base.factor, base.offset) == (1.0, 0.0)


def test_ssv_applied_to_the_fmu_of_another_spring_makes_it_this_one() -> None:
    other = SpringParameters((1.0, 2.0, 3.0, 4.0), (1.0, 0.0, 0.0), 1.0, 2.0, 0.6, 3.0, 0.0, -1.0, 1.0)
    root, path = ElementTree.fromstring(parameter_values(ModelFile("s", SPRING))), wandering_path(SPRING, 200, seed=4)
    given = {str(p.get("name")): float(str(p[0].get("value"))) for p in root.iterfind("{*}Parameters/{*}Parameter")}
    with FORMS["co-simulation"].instance(other) as one:
        one.begin(**{**given, "displacement": path[0]})
        force = [*one.get("force"), *(row[0] for row in one.along(path, 1e-3 * np.arange(path.size), "force"))]
    assert force == pytest.approx(Spring(SPRING).response(path), abs=1e-12 * force_scale(SPRING, path))


# The SSP system

MASS, STOP, STEP = 0.01, 0.68, 5e-5  # 10 periods


@pytest.fixture
def ssp(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    path = tmp_path / "system.ssp"
    said = Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(path))
    assert said.endswith(f"SSP system: {path}\n")
    return path


def test_the_system_holds_what_its_structure_names(ssp: Path, tmp_path: Path, capsys: Any) -> None:
    system = read_ssd(str(ssp)).system  # checked by the schema of SSP 1.0
    with zipfile.ZipFile(ssp) as archive:
        names, structure = set(archive.namelist()), archive.read("SystemStructure.ssd")
        spring_values = archive.read("resources/spring.ssv").decode()
        archive.extractall(tmp_path / "system")
    sources = {component.source for component in system.elements}
    assert names == {"SystemStructure.ssd", *sources, *(f"resources/{c.name}.ssv" for c in system.elements)}
    assert spring_values == parameter_values(placed(load_model(HINGE), None)[0])
    values = {p.name: float(p.value) for p in read_ssv(str(ssp), "resources/plant.ssv").parameters}
    # Without it OMSimulator 3 aborts.
    place = ".//{*}Annotation[@type='org.openmodelica']//{*}FixedStepMaster"
    (master,) = ElementTree.fromstring(structure).iterfind(place)
    assert 3000.0 < 1.0 / (values["frequency"] * float(master.attrib["stepSize"])) < 10000.0
    assert (master.attrib["description"], values["mass"]) == ("oms-ma", MASS)
    for name in ("spring", "plant"):
        assert validate_fmu(str(tmp_path / f"system/resources/{name}.fmu")) == []
    described = fmpy.read_model_description(str(tmp_path / "system/resources/plant.fmu")).modelVariables
    assert {v.name: float(v.start) for v in described if v.causality == "parameter"} == values
    registered = ShakenMass(instance_name="plant", resources="").vars
    assert {v.valueReference: (v.name, v.causality) for v in described} == {
        reference: (v.name, v.causality.name) for reference, v in registered.items()
    }
    with pytest.raises(FMICallException, match="fatal"):
        simulate_ssp(str(ssp))  # steps of 10 ms by FMPy's default: 7 in a period
    assert "Steps of 10 ms are too long for forces that are held over them; take 1.187 ms" in capsys.readouterr().err
    Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(tmp_path / "again.ssp"))
    assert (tmp_path / "again.ssp").read_bytes() == ssp.read_bytes()


def own_motion(folder: Path, stop: float, master: Any) -> Motion:
    """Of the same mass by our own master."""
    plant = ShakenMassValues.suited(placed(load_model(HINGE), None)[0], MASS)

    def base(t: float) -> float:
        return plant.amplitude * math.sin(2.0 * math.pi * plant.frequency * t)

    with FmuSpring(build_native_fmu(load_model(HINGE), folder)) as one:
        return simulate(one_mass(MASS, plant.load, base), [one], stop, STEP, master)


def difference(run: np.ndarray, motion: Motion) -> float:
    """Of position and force, in units of their ranges."""
    times, position, force = run
    np.testing.assert_allclose(times, motion.times, rtol=0.0, atol=1e-12)
    pairs = ((position, motion.q[:, 0]), (force[1:], motion.force[1:, 0]))
    return max(float(np.max(np.abs(a - b)) / np.ptp(b)) for a, b in pairs)


def test_fmpy_moves_the_system_as_our_own_master(ssp: Path, tmp_path: Path) -> None:
    from strandspring.examples import ssp_system

    # Rounding of 400 steps of the same arithmetic.
    assert difference(ssp_system.run(ssp, STEP, 0.02), own_motion(tmp_path, 0.02, Jacobi())) < 1e-9


BENCH = """within ;
package Bench
  model Ground
    Modelica.Mechanics.Translational.Interfaces.Flange_b flange;
  equation
    flange.s = 0;
  end Ground;

  model Mover
    parameter Real middle=0, reach=1;
    Modelica.Mechanics.Translational.Interfaces.Flange_b flange;
  equation
    flange.s = middle + reach*sin(6*time)*(1 + 0.3*cos(17*time));
  end Mover;

  block Law "Stands for an imported FMU"
    input Real displacement;
    output Real force;
  equation
    force = 5 + 200*displacement;
  end Law;

  model System
    Ground ground;
    {system}
  end System;
end Bench;
"""
DRIVEN = """
    StrandSpring.Components.Spring spring({options}data=StrandSpring.Records.{record}({changes}));
    Mover mover(middle={middle!r}, reach={reach!r});
  equation
    connect(ground.flange, spring.flange_a);
    connect(mover.flange, spring.flange_b);"""


def swing(t: Any) -> Any:
    """What `Bench.Mover` does about its middle, in units of its reach."""
    return np.sin(6.0 * t) * (1.0 + 0.3 * np.cos(17.0 * t))


def swing_rate(t: Any) -> Any:
    return 6.0 * np.cos(6.0 * t) * (1.0 + 0.3 * np.cos(17.0 * t)) - 5.1 * np.sin(6.0 * t) * np.sin(17.0 * t)


def turning_points(times: np.ndarray) -> list[float]:
    """When `swing` turns back."""
    from scipy.optimize import brentq

    crossings = np.flatnonzero(swing_rate(times[:-1]) * swing_rate(times[1:]) < 0.0)
    return [float(brentq(swing_rate, times[k], times[k + 1], xtol=1e-15)) for k in crossings]


def session(folder: Path, model: ModelFile) -> Any:
    """With the exported library and the stub, read from files as a Modelica tool reads them."""
    stub = folder / "Modelica.mo"
    stub.write_bytes((ROOT / "tests" / "helpers" / "modelica_stub.mo").read_bytes())
    return tool("rumoca").Session(roots=[str(write_library(folder, model, 0.0)), str(stub)])


def compiled(folder: Path, model: ModelFile, system: str = "", **fields: Any) -> Any:
    """`system` around the exported spring; the usual one is driven by `Mover`."""
    fields = {"options": "", "changes": "", "record": "mount", "middle": 0.0, "reach": 1.0} | fields
    folder.mkdir(exist_ok=True)
    (folder / "Bench.mo").write_text(BENCH.format(system=system or DRIVEN.format(**fields)), encoding="utf-8")
    return session(folder, model).load(folder / "Bench.mo", model="Bench.System")


def simulated(model: Any, stop: float, tolerance: float = 1e-10, solver: str = "bdf") -> Any:
    config = tool("rumoca").SimConfig(solver=solver, rtol=tolerance, atol=1e-3 * tolerance)
    return model.simulate((0.0, stop), dt=1e-3, config=config)


def errors_of(folder: Path, p: SpringParameters, omega: float, share: float, tolerance: float) -> tuple[float, float]:
    """Of force, in units of the largest, and of omega on a path with ten reversals over a share of the range."""
    middle, reach = (
        0.5 * (p.displacement_min + p.displacement_max),
        0.5 * share * (p.displacement_max - p.displacement_min),
    )
    model = compiled(folder, ModelFile("mount", p), changes=f"omega_start={omega!r}", middle=middle, reach=reach)
    found = simulated(model, 1.5, tolerance)
    times = np.asarray(found.time)
    # The turning points belong to the path, wherever the samples fall.
    every = np.union1d(times, turning_points(times))
    path, sampled = middle + reach * swing(every), np.searchsorted(every, times)
    assert found["spring.displacement"] == pytest.approx(path[sampled], rel=1e-12)  # rounding of the sine
    outside = (path < p.displacement_min) | (path > p.displacement_max)
    assert np.array_equal(np.asarray(found["spring.extrapolating"]) > 0.5, outside[sampled])
    force = np.max(np.abs(found["spring.f"] - Spring(p).response(path, omega)[sampled]))
    omegas = np.max(np.abs(found["spring.omega"] - Spring(p).omega(path, omega)[sampled]))
    return float(force / force_scale(p, path)), float(omegas)


CASES = {
    "n 0.2": (SPRING, 0.0, 1.0), "n 1.6": (OTHER, -0.4, 1.0), "constant": (CONSTANT, 0.0, 0.7),
    "longest": (LONGEST, 0.0, 0.9), "square": (spring(n=20.0, sigma=0.5, saturations=5.0), 1.0, 1.0),
    "table": (TABLE, 0.2, 1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_the_modelica_spring_has_the_force_of_the_model(name: str, tmp_path: Path) -> None:
    parameters, omega_start, share = CASES[name]
    force, omega = errors_of(tmp_path, parameters, omega_start, share, tolerance=1e-10)
    # The simulator's error adds up over its steps. Measured: 2e-10 to 3e-9 and 2e-9 to 4e-9.
    assert (force < 1e-8, omega < 2e-8) == (True, True), (force, omega)
    model = ModelFile("mount", parameters)
    found = compiled(tmp_path, model).parameters
    table = {v.name: v for v in variables(*parameters.counts) if v.causality == "parameter"}
    for scalar in (*SCALARS, "omega_start"):  # all parameters of the FMU, with every bit
        variable, of_record = table[scalar], found[f"spring.data.{scalar}"]
        assert of_record.value == getattr(parameters, scalar, 0.0)
        assert (of_record.unit, of_record.min, of_record.max) == (variable.unit, variable.minimum, variable.maximum)
        assert of_record.description == variable.description
    for array in ARRAYS:  # the compiler does not tell their values
        declared = re.search(
            rf"^    {array}=(?:\{{(.*?)\}}|fill\(0\.0, 0\))", record_text(model, "mount", ""), re.DOTALL | re.MULTILINE
        )
        assert declared, array
        assert tuple(map(float, declared[1].split(",") if declared[1] else ())) == getattr(parameters, array)


@pytest.mark.parametrize("name", slow_but(BRANCHED, ("both",)))
def test_second_mechanisms_and_branches_follow_their_equations(name: str, tmp_path: Path) -> None:
    """Against their differential equations as they stand, solved by LSODA between the turning points."""
    from scipy.integrate import solve_ivp

    p = BRANCHED[name]
    middle, reach = 0.5 * (p.displacement_min + p.displacement_max), 0.4 * (p.displacement_max - p.displacement_min)
    starts = "omega_start=0.2, second_omega_start=-0.4"
    found = simulated(compiled(tmp_path, ModelFile("mount", p), changes=starts, middle=middle, reach=reach), 1.5)
    times, parts = np.asarray(found.time), p.mechanisms

    def rates(t: float, state: np.ndarray) -> list[float]:
        v = reach * float(swing_rate(t))
        slips = [rate_of_omega(m, v, w) for m, w in zip(parts, state.tolist(), strict=False)]
        return [*slips, *(v - e / b.time_constant for e, b in zip(state[len(parts) :], p.branches, strict=True))]

    state = np.array([0.2, -0.4][: len(parts)] + [0.0] * len(p.branches))
    states = np.empty((state.size, times.size))
    for begin, end in pairwise([0.0, *turning_points(times), 1.5]):
        inside = (times >= begin) & (times <= end)
        every = np.union1d(times[inside], [begin, end])
        solved = solve_ivp(rates, (begin, end), state, "LSODA", every, rtol=1e-11, atol=1e-13).y
        states[:, inside], state = solved[:, np.isin(every, times)], solved[:, -1]
    path = middle + reach * swing(times)
    force = sum(b.stiffness * e for b, e in zip(p.branches, states[len(parts) :], strict=True))
    force += sum(force_by_definition(mechanism, path, omega) for mechanism, omega in zip(parts, states, strict=False))
    # Both solvers at a relative tolerance of 1e-10 or less.
    assert found["spring.f"] == pytest.approx(force, abs=1e-8 * float(np.abs(force).max()))


def test_flanges_of_an_fmu_pass_displacement_and_force_on(tmp_path: Path) -> None:
    """What is at flange_b is pulled back."""
    system = """
    StrandSpring.Components.FMUFlanges flanges(s_rel0=0.1);
    Mover mover(middle=0.12, reach=0.02);
    Law fmu;
  equation
    connect(ground.flange, flanges.flange_a);
    connect(mover.flange, flanges.flange_b);
    connect(flanges.displacement, fmu.displacement);
    connect(fmu.force, flanges.force);"""
    found = simulated(compiled(tmp_path / "fmu", ModelFile("mount", SPRING), system), 0.5)
    pull = 5.0 + 200.0 * (0.02 + 0.02 * swing(np.asarray(found.time)))
    for flange, sign in (("mover", -1.0), ("ground", 1.0)):
        assert found[f"{flange}.flange.f"] == pytest.approx(sign * pull, rel=1e-12)


NAMES = [
    ("model", "_model"),
    ("Real", "_Real"),
    ("SpringData", "_SpringData"),
    ("strandedwiremount", "_strandedwiremount"),
]
NAMES += [(name, name) for name in ("Spring", "Components", "data", "s_rel", "Model")]


def test_whatever_a_model_is_called_it_is_modelica(tmp_path: Path) -> None:
    for name, record in NAMES:
        assert record_name(name) == record
        assert compiled(tmp_path / name, ModelFile(name, SPRING), record=record).states.names
        assert [d for d in tool("rumoca").validate(record_path(tmp_path / name, name)) if d.level != "warning"] == []


def test_no_text_leaves_its_string(tmp_path: Path) -> None:
    model = ModelFile("mount", SPRING, AWKWARD)
    text = record_text(model, "mount", "")
    literal = re.search(r"^record mount (\".*\")$", text, re.MULTILINE)
    page = re.search(r"^<p>\n(.*quoted.*)\n</p>$", text, re.MULTILINE)
    assert literal
    assert page
    fields = {"options": "", "changes": "", "record": "mount", "middle": 0.0, "reach": 1.0}
    system = f'parameter Real a=1 {literal[1]};\n    parameter Real b=1 "{page[1]}";{DRIVEN.format(**fields)}'
    found = compiled(tmp_path, model, system.replace("{{", "{ {")).parameters
    assert found["a"].description.replace("{ {", "{{") == AWKWARD
    assert not re.search("<b>|</html>", found["b"].description)
    assert found["b"].description.startswith(
        "&quot;quoted&quot; &#x27;single&#x27; &lt;b&gt;bold&lt;/b&gt; &lt;/html&gt;"
    )


def test_springs_share_one_library_whose_folders_list_their_classes(tmp_path: Path) -> None:
    first, second = ModelFile("first", SPRING), ModelFile("second", TABLE)

    def contents(folder: Path) -> dict[str, bytes]:
        root = folder / LIBRARY
        return {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()}

    for folder, models in (("one", [second, first]), ("two", [first, second, first]), ("alone", [first])):
        for model in models:
            root = write_library(tmp_path / folder, model, 0.0)
    found = contents(tmp_path / "one")
    assert found == contents(tmp_path / "two")
    assert found["Records/package.order"].decode() == "SpringData\nStrandedWireMount\nfirst\nsecond\n"
    assert found.keys() - contents(tmp_path / "alone").keys() == {"Records/second.mo"}
    for order in root.rglob("package.order"):
        classes = {p.stem for p in order.parent.iterdir() if p.suffix == ".mo" and p.name != "package.mo"}
        classes |= {p.name for p in order.parent.iterdir() if p.is_dir()}
        assert sorted(order.read_text(encoding="utf-8").split()) == sorted(classes), order
    (tmp_path / "mine" / LIBRARY).mkdir(parents=True)
    (tmp_path / "mine" / LIBRARY / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(StrandspringError, match="is not a library that strandspring has written"):
        write_library(tmp_path / "mine", first, 0.0)
    with pytest.raises(StrandspringError, match=r"First\.mo would take the place of first\.mo where file names ignore"):
        write_library(tmp_path / "alone", ModelFile("First", SPRING), 0.0)


def test_the_loop_and_the_model_of_the_documentation(tmp_path: Path) -> None:
    library = session(tmp_path, EXAMPLE)
    text = (tmp_path / LIBRARY / "Examples" / "QuasiStaticLoop.mo").read_text(encoding="utf-8")
    given = re.search(r"experiment\(StopTime=(\S+), Interval=(\S+), Tolerance=(\S+)\)", text)
    assert given
    stop, interval, tolerance = map(float, given.groups())
    # Without a parameter of it, rumoca does not look for the library Modelica.
    unused = "  parameter Modelica.Units.SI.Mass unused=1;\nend"
    source = f"within ;\nmodel Run\n  extends StrandSpring.Examples.QuasiStaticLoop;\n{unused} Run;\n"
    config = tool("rumoca").SimConfig(solver="rk-like", rtol=tolerance, atol=1e-3 * tolerance)
    found = library.loads(source, model="Run").simulate((0.0, stop), dt=interval, config=config)
    # Events are among the results twice.
    times = interval * np.arange(round(stop / interval) + 1)
    rows = np.searchsorted(found.time, times - 1e-6 * interval)
    np.testing.assert_allclose(np.asarray(found.time)[rows], times, rtol=0.0, atol=1e-9)
    frequency, decay = 0.2 * np.pi, 0.02
    every = np.union1d(times, (np.arctan(frequency / decay) + np.pi * np.arange(8)) / frequency)
    path = 0.025 * np.exp(-decay * every) * np.sin(frequency * every)
    force = Spring(EXAMPLE.parameters).response(path)[np.searchsorted(every, times)]
    # Of the simulator; measured: 1e-8.
    assert np.asarray(found["spring.f"])[rows] == pytest.approx(force, abs=1e-7 * np.ptp(force))
    (block,) = blocks("export", "modelica")
    hinge = placed(load_model(HINGE), None)[0]
    moved = session(tmp_path, hinge).loads(block.replace("\nend", f"\n{unused}"), model="DecayOfMine")
    found = moved.simulate((0.0, 0.5), dt=1e-3)
    s = np.asarray(found["mass.s"])
    assert s[0] == 0.005
    assert np.ptp(s[-100:]) < 0.5 * np.ptp(s)
    assert not np.any(found["spring.extrapolating"])


HERE = Path(__file__).with_name("targets")
# FA as wild as a polynomial of degree 8 can be: a Chebyshev polynomial.
WILD = spring(
    n=0.22, sigma=3.0, saturations=20.0,
    amplifier=(0.0, -288.0 / 19.0, 0.0, 1440.0 / 19.0, 0.0, -2304.0 / 19.0, 0.0, 1152.0 / 19.0),
)  # fmt: skip
SPRINGS = {"usual": SPRING, "wild": WILD, "table": TABLE}
MOST_STACK = 512  # of a step, as strandspring.h says [B]
FLAGS = ("-std=c11", "-ffp-contract=off")
# Compilers call these by themselves; those of Arm's ABI are the same.
MEMORY = {"memcpy", "memmove", "memset"} | {
    f"__aeabi_mem{what}{width}" for what in ("cpy", "set", "clr", "move") for width in ("", "4", "8")
}


def cc(output: Path, *arguments: str | Path, compiler: tuple[str, ...] = ("cc",)) -> Path:
    """Run a C compiler; a warning is an error."""
    compiler = program(compiler[0], package="gcc libc6-dev"), *compiler[1:]
    warnings = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
    run([*compiler, *warnings, *arguments, "-o", output])
    return output


def exported(folder: Path, parameters: SpringParameters, name: str = "mount") -> Path:
    """The C file of a spring, with what it needs beside it."""
    write_c_sources(folder, ModelFile(name, parameters), 0.0)
    return law_path(folder, name)


def steps(sources: Path) -> list[Path]:
    """What steps are compiled of."""
    return [sources.parent / name for name in STEP_SOURCES]


def test_the_example_in_the_header_runs_as_it_stands_there(tmp_path: Path) -> None:
    """In C and in C++; without a description of the model, and in the same bytes beside other springs."""
    (law,) = export(Spring(SPRING, "mount", "*/ #error planted /* äöü"), tmp_path, c=True, zero=0.0)
    header = (law.parent / "strandspring.h").read_text(encoding="utf-8")
    block = re.findall(r"(?:^ \*(?:     .*)?\n)+", header, re.MULTILINE)[0]
    text = "".join(f"{line[7:]}\n" for line in block.splitlines()[1:-1])
    example = law.parent / "mount_example.c"
    assert example.read_text() == text == blocks("real-time", "c")[0]
    assert len([line for line in text.splitlines() if line.startswith("    ")]) == 5
    for standard in ("-std=c11", "-std=gnu17", "-std=c2x"):
        run([cc(tmp_path / "example", standard, example, law, *steps(law))])
    c, cpp = ziglang("cc"), ziglang("c++")
    objects = [cc(tmp_path / f"{p.stem}.o", "-O1", *FLAGS, "-c", p, compiler=c) for p in (law, *steps(law))]
    main = cc(tmp_path / "main.o", "-O1", "-std=c++17", "-x", "c++", "-c", example, compiler=cpp)
    # Linked as C: ziglang would compile the whole library of C++, of which the example uses nothing.
    run([cc(tmp_path / "cpp", "-O1", main, *objects, compiler=c)])
    before = {path.name: path.read_bytes() for path in law.parent.iterdir()}
    assert not any(b"planted" in content for content in before.values())
    exported(tmp_path, TABLE, "two")
    write_c_sources(tmp_path, ModelFile("mount", SPRING), 0.0)
    after = {path.name: path.read_bytes() for path in law.parent.iterdir()}
    assert {name: content for name, content in after.items() if not name.startswith("two")} == before
    local = law.parent / "spring_local.h"
    local.write_text(re.sub(r"SPRING_KERNEL 0x\w{8}", "SPRING_KERNEL 0x0", local.read_text()))
    with pytest.raises(AssertionError, match="export the spring again"):
        cc(tmp_path / "law.o", *FLAGS, "-c", law)


def test_any_name_compiles_and_takes_the_place_of_no_other_file(tmp_path: Path) -> None:
    for name in ("int", "SPRING", "memcpy", "NULL"):
        law = exported(tmp_path / name, SPRING, name)
        cc(tmp_path / "none", "-std=gnu11", "-fsyntax-only", law.parent / f"{name}_example.c", law)
        others = {path.name.lower() for path in law.parent.iterdir()}
        assert len(others) == len(list(exported(tmp_path / "other", SPRING, "mount").parent.iterdir()))


PLAIN_HOST = """#include "mount_law.h"
#include <stdio.h>
static const double motion[][2] = {ROWS};
static SpringTable table;
static SpringLaw made;
int main(void)
{
    spring_tabulate(&table, mount_law.parameters.n, mount_law.parameters.sigma, SPRING_WITH_ENERGIES);
    spring_prepare(&made, &mount_law.parameters, &table);
    SpringMemory memory = spring_start(motion[0][1], 0.2), other = memory;
    for (int i = 0; i < COUNT; i++) {
        spring_commit(&mount_law, &memory, NULL, motion[i][1]);
        spring_commit(&made, &other, NULL, motion[i][1]);
        printf("%a %a %a %a\\n", spring_force(&mount_law, &memory), spring_absorbed_energy(&mount_law, &memory),
               spring_stiffness(&mount_law, &memory), spring_force(&made, &other));
    }
}
"""
ADDED_HOST = """#include "mount_law.h"
#include "plain_law.h"
#include <stdio.h>
static const double motion[][2] = {ROWS};
int main(void)
{
    const SpringAdded *has = &mount_law_added;
    SpringMemory first = spring_start(motion[0][1], 0.2);
    SpringAddedMemory added = spring_added_start(motion[0][1], -0.4);
    for (int i = 0; i < COUNT; i++) {
        SpringDecay decays[SPRING_MAXWELLS];
        for (int j = 0; j < has->branches; j++)
            decays[j] = spring_decay(motion[i][0] / has->time_constant[j]);
        spring_added_commit(has, &mount_law_second, &added, 0, first.displacement, motion[i][1], motion[i][0], decays);
        spring_commit(&mount_law_first, &first, NULL, motion[i][1]);
        printf("%a %a %a 0\\n", spring_force(&mount_law_first, &first)
               + spring_added_force(has, &mount_law_second, &added),
               spring_absorbed_energy(&mount_law_first, &first) + spring_added_energy(has, &mount_law_second, &added),
               spring_added_stored(has, &added));
    }
    return plain_law.parameters.n > 0.0 ? 0 : 1;
}
"""


@pytest.mark.parametrize("name", slow_but(["plain", "plain table", *BRANCHED], ("plain", "both")))
def test_the_exported_spring_answers_as_the_ode_and_the_package(name: str, tmp_path: Path) -> None:
    """One with a second mechanism and branches beside a plain one; a target with a mathematics library makes tables."""
    p = {"plain": SPRING, "plain table": TABLE, **BRANCHED}[name]
    time, path = uneven_motion()
    path = p.displacement_min + (path - path.min()) / np.ptp(path) * (p.displacement_max - p.displacement_min)
    law = exported(tmp_path, p)
    plain, kernel = exported(tmp_path, SPRING, "plain"), [*steps(law)]
    local = law.parent / "spring_local.h"
    if p.is_plain:
        assert local.read_text().count("#define SPRING_STEPS_ONLY\n") == 1
        local.write_text(local.read_text().replace("#define SPRING_STEPS_ONLY\n", ""))
        kernel.append(law.parent / "saturation_table.c")
        assert N_RANGE == (0.01, 100.0)  # as the header says
    else:
        kernel += [law.with_name("branches.c"), plain]
        run([cc(tmp_path / "example", "-O2", *FLAGS, law.with_name("mount_example.c"), law, *kernel)])
        declared = re.findall(r"\bextern const \w+ (\w+);", law.with_suffix(".h").read_text())
        assert declared == ["mount_law_first", "mount_law_second", "mount_law_added"]  # none leaves a part out
    pairs = zip(np.diff(time, prepend=0.0).tolist(), path.tolist(), strict=True)
    text = ", ".join(f"{{{h.hex()}, {x.hex()}}}" for h, x in pairs)
    host = tmp_path / "host.c"
    source = (PLAIN_HOST if p.is_plain else ADDED_HOST).replace("ROWS", text).replace("COUNT", str(path.size))
    host.write_text(source)
    host_program = cc(tmp_path / "host", "-O2", *FLAGS, f"-I{law.parent}", host, law, *kernel, "-lm")
    rows = [[float.fromhex(word) for word in line.split()] for line in run([host_program]).splitlines()]
    force, energy, third, made = np.array(rows).T
    spring, starts = Spring(p), (0.2, -0.4) if p.second else 0.2
    size = np.abs(force).max()
    assert force == pytest.approx(spring.response(path, starts, time), abs=1e-12 * size)
    oracle = sum(OracleSpring(m.as_dict()).force(path, w) for m, w in zip(p.mechanisms, (0.2, -0.4), strict=False))
    assert force == pytest.approx(oracle + branch_forces(p, path, time), abs=1e-6 * size)  # of the solver
    work = spring.absorbed_energy(path, starts, time=time)
    assert energy == pytest.approx(work, abs=1e-11 * np.abs(work).max())  # rounding of sums
    if p.is_plain:
        assert third == pytest.approx(spring.stiffness(path, 0.2), rel=1e-11)
        assert made == pytest.approx(force, abs=1e-12 * size)
    else:
        assert third == pytest.approx(spring.stored_energy(path, time=time), rel=1e-10, abs=1e-15)


def branch_forces(p: SpringParameters, path: np.ndarray, time: np.ndarray) -> np.ndarray:
    return np.asarray(sum((maxwell(b.stiffness, b.time_constant, path, time) for b in p.branches), np.zeros(path.size)))


# Targets without an operating system


@dataclass(frozen=True)
class Machine:
    """A target, its processor by the page's name, and the machine of QEMU that has it, without the image."""

    flags: tuple[str, ...]
    processor: str
    emulator: tuple[str, ...]

    def compiled(self, output: Path, *arguments: str | Path) -> Path:
        """Compile without a C library and an operating system."""
        freestanding = ("-ffreestanding", "-nostdlib", "-fno-unwind-tables")
        return cc(output, *self.flags, *FLAGS, *freestanding, *arguments, compiler=ziglang("cc"))


MACHINES = {
    "cortex_m7": Machine(  # with the unit for double precision that this processor may have
        ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m7+fp_armv8d16", "-Os"), "Cortex-M7",
        ("qemu-system-arm", "-M", "mps2-an500"),
    ),
    "cortex_a53": Machine(
        ("-target", "aarch64-freestanding-none", "-mcpu=cortex_a53", "-O2"), "Cortex-A53",
        (),
    ),
}  # fmt: skip


def sizes(*paths: Path) -> tuple[set[str], dict[str, int]]:
    """Names that object files in ELF lack, and bytes of code, constants and variables."""
    import lief

    lacks, sizes = set[str](), {".text": 0, ".rodata": 0, ".data": 0, ".bss": 0}
    for path in paths:
        parsed = lief.parse(path)
        assert isinstance(parsed, lief.ELF.Binary)
        for section, kind in ((one, kind) for one in parsed.sections for kind in sizes):
            sizes[kind] += section.size if str(section.name).startswith(kind) else 0
        local = lief.ELF.Symbol.BINDING.LOCAL
        lacks |= {str(one.name) for one in parsed.symbols if one.name and one.shndx == 0 and one.binding != local}
    return {name for name in lacks if not name.startswith("spring_")} - MEMORY, sizes


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("name", slow_but(SPRINGS, ("wild",)))
def test_targets_need_no_library_and_give_the_bits_of_the_host(name: str, machine: str, tmp_path: Path) -> None:
    law, target = exported(tmp_path, SPRINGS[name]), MACHINES[machine]
    files, include = [*steps(law), law.parent / "saturation_table.c"], f"-I{law.parent}"
    objects = [target.compiled(tmp_path / f"{path.stem}.o", include, "-c", path) for path in files]
    lacks, code = sizes(*objects)
    constant = sizes(target.compiled(tmp_path / "law.o", "-c", law))[1]
    # The table is constant and needs no start code; a pointer to it is not relocated before main.
    assert (lacks, code[".data"] + code[".bss"]) == (set(), 0)
    assert constant[".text"] == constant[".data"] == constant[".bss"] == 0
    said = re.findall(rf"\| {target.processor}\b.*? \| (\d+) kB \| (\d+) kB \|", TEXTS["real-time"])
    ((whole, constants),) = said  # as the documentation says
    assert 0.8 < (code[".text"] + code[".rodata"]) / (1000.0 * int(whole)) <= 1.0
    assert 0.8 < constant[".rodata"] / (1000.0 * int(constants)) <= 1.0
    if machine == "cortex_a53":
        return  # the other is emulated
    here = run([cc(tmp_path / "steps", "-O2", *FLAGS, include, HERE / "steps.c", law, *steps(law))])
    image = target.compiled(
        tmp_path / "image.elf", include, "-T", HERE / f"{machine}.ld", HERE / "semihosting.c", HERE / "steps.c", law,
        *steps(law), "-lcompiler_rt",
    )  # fmt: skip
    command = [program(target.emulator[0], package="qemu-system-arm"), *target.emulator[1:], "-nographic"]
    command += ["-semihosting-config", "enable=on,target=native", "-kernel", str(image)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, stdin=subprocess.DEVNULL)
    there = done.stdout + done.stderr  # semihosting writes where errors go
    *digests, _ = here.split()
    assert (len(digests), len(set(digests))) == (48, 48)
    assert there.split()[:-1] == digests, there[:2000]
    assert all(0 < int(text.split()[-1], 16) < MOST_STACK for text in (here, there))


def test_a_planted_library_is_found(tmp_path: Path) -> None:
    source = exported(tmp_path, SPRING).parent / "spring.c"
    line, text, machine = "double force = elastic_inside(law, inside);", source.read_text(), MACHINES["cortex_m7"]
    assert line in text, "the fault cannot be planted: the source has changed"
    source.write_text(f"double log(double);\n{text.replace(line, f'{line} force += log(inside);')}")
    planted = machine.compiled(tmp_path / "o.o", "-Wno-incompatible-library-redeclaration", "-c", source)
    assert sizes(planted)[0] == {"log"}
