"""The exported Modelica library, compiled and simulated by a program of its own, against the model and the FMU.

rumoca, a Modelica compiler and simulator, takes the library together with ``modelica_stub.mo``, which has the few
classes of the Modelica Standard Library that the library needs.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from branched_springs import BRANCHED
from fmu_tools import AWKWARD, CONSTANT, LONGEST, OTHER, SPRING
from oracles import rate_of_omega
from pages import ROOT, blocks
from springs import TABLE, force_by_definition, force_scale, spring
from strandspring import Spring, SpringParameters
from strandspring.core.parameters import ARRAYS, SCALARS
from strandspring.core.variables import variables
from strandspring.errors import StrandspringError
from strandspring.exchange.modelica import EXAMPLE, LIBRARY, record_name, record_path, record_text, write_library
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import ModelFile, load_model
from tools import slow_but, tool

pytestmark = pytest.mark.long
HINGE = ROOT / "models" / "rubber_hinge.json"


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
