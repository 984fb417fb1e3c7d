"""The exported Modelica library, compiled and simulated by a program of its own, against the model and the FMU.

rumoca, a Modelica compiler and simulator, takes the library together with ``modelica_stub.mo``, which has the few
classes of the Modelica Standard Library that the library needs.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from branched_springs import BRANCHED
from fmu_tools import OTHER, SPRING
from pages import blocks
from springs import TABLE, force_by_definition, force_scale, spring
from strandspring import Spring, SpringParameters
from strandspring.core.parameters import ARRAYS, SCALARS
from strandspring.core.variables import variables
from strandspring.cosimulation import FmuSpring, Motion, Plant, one_mass, simulate
from strandspring.errors import StrandspringError
from strandspring.exchange.modelica import EXAMPLE, LIBRARY, record_name, record_path, record_text, write_library
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import ModelFile, load_model
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass
from tools import tool

rumoca = tool("rumoca")

TESTS = Path(__file__).resolve().parents[1]
HINGE = load_model(TESTS.parent / "models/rubber_hinge.json").parameters
CONSTANT = SpringParameters((2.0,), (1.0,), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)
LONGEST = SpringParameters((0.0, 1e4, *[1e5] * 19), (1.0, *[1.0] * 8), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)

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

  model Mass
    parameter Real m=1, load=0, start=0;
    Modelica.Mechanics.Translational.Interfaces.Flange_a flange;
    Real s(start=start, fixed=true);
    Real v(start=0, fixed=true);
  equation
    s = flange.s;
    v = der(s);
    m*der(v) = flange.f + load*sin(30*time);
  end Mass;

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


def swing(t: Any) -> Any:
    """What `Bench.Mover` does about its middle, in units of its reach."""
    return np.sin(6.0 * t) * (1.0 + 0.3 * np.cos(17.0 * t))


def library(folder: Path, model: ModelFile) -> rumoca.Session:
    """A session with the exported library and the stub, read from files as a Modelica tool reads them."""
    return rumoca.Session(roots=[str(write_library(folder, model, 0.0)), str(standard_library(folder))])


def standard_library(folder: Path) -> Path:
    stub = folder / "Modelica.mo"
    stub.write_bytes((TESTS / "helpers" / "modelica_stub.mo").read_bytes())
    return stub


def compiled(folder: Path, model: ModelFile, system: str) -> rumoca.Model:
    """`system` around the exported spring."""
    bench = folder / "Bench.mo"
    bench.write_text(BENCH.format(system=system), encoding="utf-8", newline="\n")
    return library(folder, model).load(bench, model="Bench.System")


def simulated(
    folder: Path, model: ModelFile, system: str, stop: float, tolerance: float = 1e-10, solver: str = "bdf"
) -> rumoca.Result:
    """`compiled`, then simulated, by default with an implicit method and so with the Jacobian."""
    config = rumoca.SimConfig(solver=solver, rtol=tolerance, atol=1e-3 * tolerance)
    return compiled(folder, model, system).simulate((0.0, stop), dt=1e-3, config=config)


def driven(
    folder: Path, parameters: SpringParameters, omega_start: float, share: float, tolerance: float
) -> tuple[float, float]:
    """Largest errors of force, in units of the largest force, and of omega on a path with ten reversals.

    Parameters
    ----------
    share : float       Reach of the path in units of half the identified range; it goes 30 % beyond that.
    tolerance : float   Relative tolerance of the simulator.
    """
    middle = 0.5 * (parameters.displacement_min + parameters.displacement_max)
    reach = 0.5 * share * (parameters.displacement_max - parameters.displacement_min)
    system = f"""
    StrandSpring.Components.Spring spring(data=StrandSpring.Records.mount(omega_start={omega_start!r}));
    Mover mover(middle={middle!r}, reach={reach!r});
  equation
    connect(ground.flange, spring.flange_a);
    connect(mover.flange, spring.flange_b);"""
    found = simulated(folder, ModelFile("mount", parameters), system, 1.5, tolerance)
    times = np.asarray(found.time)
    # The turning points belong to the path, wherever the samples fall.
    turns = turning_points(times)
    every = np.union1d(times, turns)
    path = middle + reach * swing(every)
    sampled = np.searchsorted(every, times)
    assert found["spring.displacement"] == pytest.approx(path[sampled], rel=1e-12)  # rounding of the sine
    outside = (path < parameters.displacement_min) | (path > parameters.displacement_max)
    assert np.array_equal(np.asarray(found["spring.extrapolating"]) > 0.5, outside[sampled])
    exact = Spring(parameters)
    force_error = np.max(np.abs(found["spring.f"] - exact.response(path, omega_start)[sampled]))
    omega_error = np.max(np.abs(found["spring.omega"] - exact.omega(path, omega_start)[sampled]))
    return float(force_error / force_scale(parameters, path)), float(omega_error)


def swing_rate(t: Any) -> Any:
    return 6.0 * np.cos(6.0 * t) * (1.0 + 0.3 * np.cos(17.0 * t)) - 5.1 * np.sin(6.0 * t) * np.sin(17.0 * t)


def turning_points(times: np.ndarray) -> list[float]:
    """When `swing` turns back."""
    crossings = np.flatnonzero(swing_rate(times[:-1]) * swing_rate(times[1:]) < 0.0)
    return [float(brentq(swing_rate, times[k], times[k + 1], xtol=1e-15)) for k in crossings]


@pytest.mark.parametrize(
    ("parameters", "omega_start", "share"),
    [
        (SPRING, 0.0, 1.0),
        (OTHER, -0.4, 1.0),
        (HINGE, 0.7, 0.7),
        (CONSTANT, 0.0, 0.7),
        (LONGEST, 0.0, 0.9),
        (spring(n=0.05, sigma=30.0, saturations=5.0), 0.3, 1.0),
        (spring(n=20.0, sigma=0.5, saturations=5.0), 1.0, 1.0),
        (TABLE, 0.2, 1.0),
    ],
    ids=["n 0.2", "n 1.6", "hinge", "constant", "longest", "sharp", "square", "table"],
)
def test_the_modelica_spring_has_the_force_of_the_model(
    parameters: SpringParameters, omega_start: float, share: float, tmp_path: Path
) -> None:
    force_error, omega_error = driven(tmp_path, parameters, omega_start, share, tolerance=1e-10)
    # The simulator's error adds up over its steps. Measured: 2e-10 to 3e-9 and 2e-9 to 4e-9.
    assert force_error < 1e-8
    assert omega_error < 2e-8


@pytest.mark.parametrize("name", BRANCHED)
def test_second_mechanisms_and_branches_follow_their_equations(name: str, tmp_path: Path) -> None:
    """Against their differential equations as they stand, solved by LSODA between the turning points."""
    p = BRANCHED[name]
    middle = 0.5 * (p.displacement_min + p.displacement_max)
    reach = 0.4 * (p.displacement_max - p.displacement_min)
    system = f"""
    StrandSpring.Components.Spring spring(data=StrandSpring.Records.mount(omega_start=0.2, second_omega_start=-0.4));
    Mover mover(middle={middle!r}, reach={reach!r});
  equation
    connect(ground.flange, spring.flange_a);
    connect(mover.flange, spring.flange_b);"""
    found = simulated(tmp_path, ModelFile("mount", p), system, 1.5)
    times = np.asarray(found.time)

    def rates(t: float, state: np.ndarray) -> list[float]:
        v = reach * float(swing_rate(t))
        slips = [
            m.rho * v * (1.0 - (m.sigma * np.sign(v) * np.sign(omega) - m.sigma + 1.0) * abs(omega) ** m.n)
            for m, omega in zip(p.mechanisms, state, strict=False)
        ]
        elongations = state[len(slips) :]
        return [*slips, *(v - e / b.time_constant for e, b in zip(elongations, p.branches, strict=True))]

    state = np.array([0.2, -0.4][: len(p.mechanisms)] + [0.0] * len(p.branches))
    states = np.empty((state.size, times.size))
    ends = [0.0, *turning_points(times), 1.5]
    for begin, end in pairwise(ends):
        inside = (times >= begin) & (times <= end)
        every = np.union1d(times[inside], [begin, end])
        solved = solve_ivp(rates, (begin, end), state, "LSODA", every, rtol=1e-11, atol=1e-13).y
        states[:, inside], state = solved[:, np.isin(every, times)], solved[:, -1]
    path = middle + reach * swing(times)
    force = np.zeros(times.size)
    for mechanism, omega in zip(p.mechanisms, states, strict=False):
        force += [force_by_definition(mechanism, np.array([x]), w)[0] for x, w in zip(path, omega, strict=True)]
    force += sum(b.stiffness * e for b, e in zip(p.branches, states[len(p.mechanisms) :], strict=True))
    # Both solvers at a relative tolerance of 1e-10 or less.
    assert found["spring.f"] == pytest.approx(force, abs=1e-8 * float(np.abs(force).max()))


def test_the_difference_from_the_model_is_the_tolerance_of_the_simulator(tmp_path: Path) -> None:
    """Within the range, where a relative tolerance of 1e-6 promises the force to 1e-6 of its largest value."""
    errors = {tolerance: driven(tmp_path, SPRING, 0.0, 0.7, tolerance)[0] for tolerance in (1e-6, 1e-8, 1e-10)}
    for tolerance, error in errors.items():
        assert error < 10.0 * tolerance, errors  # measured: 1 to 3 times
    assert errors[1e-6] > 100.0 * errors[1e-10], errors


def test_a_mass_on_the_spring_moves_as_the_monolithic_solution(tmp_path: Path) -> None:
    """m*a + force = load with eqs. (10) and (11) written out and integrated by another solver."""
    p, m, load, start, stop = SPRING, 2.0, 40.0, 0.025, 1.0
    system = f"""
    StrandSpring.Components.Spring spring(data=StrandSpring.Records.mount());
    Mass mass(m={m!r}, load={load!r}, start={start!r});
  equation
    connect(ground.flange, spring.flange_a);
    connect(mass.flange, spring.flange_b);"""
    # rumoca 0.10's implicit method gives up at this tolerance over events that two of its interpolants place apart.
    found = simulated(tmp_path, ModelFile("mount", p), system, stop, solver="rk-like")

    def rate(t: float, state: np.ndarray) -> list[float]:
        s, v, omega = state
        force = float(force_by_definition(p, np.array([s]), omega)[0])
        bracket = p.sigma * np.sign(v) * np.sign(omega) - p.sigma + 1.0
        return [v, (load * np.sin(30.0 * t) - force) / m, p.rho * v * (1.0 - bracket * abs(omega) ** p.n)]

    solved = solve_ivp(rate, (0.0, stop), [start, 0.0, 0.0], "LSODA", found.time, rtol=1e-10, atol=1e-13)
    s, v, omega = solved.y
    assert np.ptp(s) > 0.002  # the mass does move
    assert np.count_nonzero(np.diff(np.sign(v))) > 5  # and turns back
    # Both solvers at a relative tolerance of 1e-10. Measured: 5e-10 and 3e-9.
    assert found["mass.s"] == pytest.approx(s, abs=1e-8 * np.ptp(s))
    assert found["spring.omega"] == pytest.approx(omega, abs=5e-8)


def test_other_parameters_can_be_given_in_modelica(tmp_path: Path) -> None:
    system = """
    StrandSpring.Components.Spring spring(
      data=StrandSpring.Records.mount(kE={1.0, 500.0}, rho=50.0, displacement_max=0.2), s_rel0=0.01);
    Mover mover(middle=0.01, reach=0.02);
  equation
    connect(ground.flange, spring.flange_a);
    connect(mover.flange, spring.flange_b);"""
    found = simulated(tmp_path, ModelFile("mount", OTHER), system, 0.2)
    x = 0.02 * swing(np.asarray(found.time))
    changed = SpringParameters(
        (1.0, 500.0), OTHER.kA, OTHER.kappa_omega, 50.0, OTHER.sigma, OTHER.n, OTHER.displacement_offset,
        OTHER.displacement_min, 0.2,
    )  # fmt: skip
    assert found["spring.f"] == pytest.approx(Spring(changed).response(x), abs=1e-7 * force_scale(changed, x))


def test_flanges_turned_round_make_a_spring_of_compression(tmp_path: Path) -> None:
    """As the user's guide says: s_rel0 = -(distance at displacement 0), and the force pushes the flanges apart."""
    low, high = SPRING.displacement_min, SPRING.displacement_max
    system = f"""
    StrandSpring.Components.Spring spring(data=StrandSpring.Records.mount(), s_rel0=-0.3);
    Mover mover(middle={0.3 - 0.5 * (low + high)!r}, reach={0.3 * (high - low)!r});
  equation
    connect(mover.flange, spring.flange_a);
    connect(ground.flange, spring.flange_b);"""
    found = simulated(tmp_path, ModelFile("mount", SPRING), system, 0.2)
    distance = np.asarray(found["mover.flange.s"])
    compression = 0.3 - distance
    assert found["spring.displacement"] == pytest.approx(compression, abs=1e-15)
    times = np.asarray(found.time)
    every = np.union1d(times, turning_points(times))
    path = 0.5 * (low + high) - 0.3 * (high - low) * swing(every)
    force = Spring(SPRING).response(path)[np.searchsorted(every, times)]
    # What moves the flange away from the ground is the force on what holds it, with the sign turned.
    assert found["mover.flange.f"] == pytest.approx(force, abs=1e-7 * np.abs(force).max())


def test_flanges_of_the_fmu_pass_displacement_and_force_on(tmp_path: Path) -> None:
    system = """
    StrandSpring.Components.FMUFlanges flanges(s_rel0=0.1);
    Mover mover(middle=0.12, reach=0.02);
    Law fmu;
  equation
    connect(ground.flange, flanges.flange_a);
    connect(mover.flange, flanges.flange_b);
    connect(flanges.displacement, fmu.displacement);
    connect(fmu.force, flanges.force);"""
    found = simulated(tmp_path, ModelFile("mount", SPRING), system, 0.5)
    displacement = 0.02 + 0.02 * swing(np.asarray(found.time))
    assert found["fmu.displacement"] == pytest.approx(displacement, abs=1e-15)
    force = 5.0 + 200.0 * displacement
    assert found["flanges.f"] == pytest.approx(force, rel=1e-12)
    # The force on a flange is that on the component: what is at flange_b is pulled back.
    assert found["mover.flange.f"] == pytest.approx(-force, rel=1e-12)
    assert found["ground.flange.f"] == pytest.approx(force, rel=1e-12)


ALONE = """
    StrandSpring.Components.Spring spring(data=StrandSpring.Records.{record}());
    Mover mover;
  equation
    connect(ground.flange, spring.flange_a);
    connect(mover.flange, spring.flange_b);"""


def test_the_work_done_on_the_spring_is_that_of_the_fmu(tmp_path: Path) -> None:
    found = simulated(tmp_path, ModelFile("mount", OTHER), ALONE.format(record="mount"), 0.5)
    path = swing(np.asarray(found.time))
    force = Spring(OTHER).response(path)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(path))])
    # Trapezoidal rule with 500 samples.
    assert found["spring.absorbed_energy"] == pytest.approx(work, abs=1e-4 * np.abs(work).max())


@pytest.mark.parametrize(
    "parameters", [SPRING, HINGE, CONSTANT, LONGEST, TABLE], ids=["spring", "hinge", "constant", "longest", "table"]
)
def test_the_record_holds_every_parameter_of_the_fmu(parameters: SpringParameters, tmp_path: Path) -> None:
    model = ModelFile("mount", parameters)
    found = compiled(tmp_path, model, ALONE.format(record="mount")).parameters
    table = {v.name: v for v in variables(*parameters.counts) if v.causality == "parameter"}
    del table["input_resolution"]  # the simulator integrates omega along what it is given
    for name in (*SCALARS, "omega_start"):
        variable, of_record = table.pop(name), found[f"spring.data.{name}"]
        assert of_record.value == getattr(parameters, name, 0.0)  # every bit
        assert (of_record.unit, of_record.min, of_record.max) == (variable.unit, variable.minimum, variable.maximum)
        assert of_record.description == variable.description
    # The compiler does not tell the values of an array.
    text = record_text(model, "mount", "")
    for name in ARRAYS:
        values = getattr(parameters, name)
        declared = re.search(rf"^    {name}=(?:\{{(.*?)\}}|fill\(0\.0, 0\))", text, re.DOTALL | re.MULTILINE)
        assert declared, name
        assert tuple(map(float, declared[1].split(",") if declared[1] else ())) == values
        for i in range(len(values)):
            del table[f"{name}_{i}"]
    assert not table


@pytest.mark.parametrize(
    ("name", "record"),
    [
        *(
            (word, f"_{word}")
            for word in ("model", "end", "Modelica", "Real", "size", "StrandSpring", "SpringData", "strandedwiremount",
                         "Package")
        ),
        *((name, name) for name in ("Spring", "Components", "Records", "data", "f", "lambda", "s_rel", "Model")),
    ],
)  # fmt: skip
def test_whatever_a_model_is_called_it_is_modelica(name: str, record: str, tmp_path: Path) -> None:
    assert record_name(name) == record
    assert compiled(tmp_path, ModelFile(name, SPRING), ALONE.format(record=record)).states.names
    assert [d for d in rumoca.validate(record_path(tmp_path, name)) if d.level != "warning"] == []


def test_no_text_leaves_its_string(tmp_path: Path) -> None:
    awkward = (
        "\"quoted\" 'single' <b>bold</b> </html> & \\ \\n \nnew line\ttab\rreturn äöü 弹簧 %s "
        '"; end mount; << 7*7 >> <% x %> {{ y }} // /* \\'
    )
    model = ModelFile("mount", SPRING, awkward)
    text = record_text(model, "mount", "")
    literal = re.search(r"^record mount (\".*\")$", text, re.MULTILINE)
    page = re.search(r"^<p>\n(.*quoted.*)\n</p>$", text, re.MULTILINE)
    assert literal
    assert page
    system = f"""
    parameter Real a=1 {literal[1]};
    parameter Real b=1 "{page[1]}";
    {ALONE.format(record="mount")}"""
    found = compiled(tmp_path, model, system).parameters
    assert found["a"].description == awkward
    assert "<b>" not in found["b"].description
    assert "</html>" not in found["b"].description
    assert found["b"].description.startswith(
        "&quot;quoted&quot; &#x27;single&#x27; &lt;b&gt;bold&lt;/b&gt; &lt;/html&gt;"
    )


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of the library below `folder`."""
    root = folder / LIBRARY
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def test_springs_share_one_library(tmp_path: Path) -> None:
    first, second = ModelFile("first", SPRING), ModelFile("second", TABLE)
    for folder, models in (("one", [second, first]), ("two", [first, second, first])):
        for model in models:
            write_library(tmp_path / folder, model, 0.0)
    found = contents(tmp_path / "one")
    assert found == contents(tmp_path / "two")
    order = found["Records/package.order"].decode()
    assert order == "SpringData\nStrandedWireMount\nfirst\nsecond\n"
    alone = tmp_path / "alone"
    write_library(alone, first, 0.0)
    assert set(found) - set(contents(alone)) == {"Records/second.mo"}
    system = """
    StrandSpring.Components.Spring spring(data=StrandSpring.Records.first());
    StrandSpring.Components.Spring other(data=StrandSpring.Records.second());
    Mover mover;
  equation
    connect(ground.flange, spring.flange_a);
    connect(ground.flange, other.flange_a);
    connect(mover.flange, spring.flange_b);
    connect(mover.flange, other.flange_b);"""
    assert compiled(tmp_path / "one", first, system).states.names


def test_every_class_of_a_folder_is_in_its_order(tmp_path: Path) -> None:
    root = write_library(tmp_path, ModelFile("mount", SPRING), 0.0)
    orders = list(root.rglob("package.order"))
    assert len(orders) == 4
    for order in orders:
        classes = {p.stem for p in order.parent.iterdir() if p.suffix == ".mo" and p.name != "package.mo"}
        classes |= {p.name for p in order.parent.iterdir() if p.is_dir()}
        assert sorted(order.read_text(encoding="utf-8").split()) == sorted(classes), order


@pytest.mark.parametrize("name", ["Documentation(info=", "within StrandSpring", "extends Modelica.Icons."])
def test_every_file_has_documentation_an_icon_and_its_place(name: str, tmp_path: Path) -> None:
    root = write_library(tmp_path, ModelFile("mount", SPRING), 0.0)
    lacking = {p.relative_to(root).as_posix() for p in root.rglob("*.mo") if name not in p.read_text(encoding="utf-8")}
    allowed = {
        "Documentation(info=": set(),
        "within StrandSpring": {"package.mo"},
        # These have icons of their own, or their base's.
        "extends Modelica.Icons.": {
            "Components/Spring.mo", "Components/FMUFlanges.mo", "Records/mount.mo", "Records/StrandedWireMount.mo"
        },
    }  # fmt: skip
    assert lacking == allowed[name]


def test_what_is_not_our_library_is_left_alone(tmp_path: Path) -> None:
    model = ModelFile("mount", SPRING)
    for name, text in (("package.mo", "within ;\npackage Other\nend Other;\n"), ("notes.txt", "mine")):
        folder = tmp_path / name
        (folder / LIBRARY).mkdir(parents=True)
        (folder / LIBRARY / name).write_text(text, encoding="utf-8")
        with pytest.raises(StrandspringError, match="is not a library that strandspring has written"):
            write_library(folder, model, 0.0)
        assert set(contents(folder)) == {name}
    write_library(tmp_path, model, 0.0)
    with pytest.raises(StrandspringError, match=r"Mount\.mo would take the place of mount\.mo where file names ignore"):
        write_library(tmp_path, ModelFile("Mount", SPRING), 0.0)
    assert "Records/Mount.mo" not in contents(tmp_path)


Samples = Callable[[str], np.ndarray]


def example(folder: Path, name: str, model: ModelFile, **changes: float) -> tuple[np.ndarray, Samples]:
    """An example simulated as its annotation says, with the spring of a model and other parameters.

    Returns
    -------
    ndarray, shape (K,)     Times of the annotation's intervals.
    callable                The samples of a variable at these times, shape (K,).
    """
    session = library(folder, model)
    text = (folder / LIBRARY / "Examples" / f"{name}.mo").read_text(encoding="utf-8")
    experiment = re.search(r"experiment\(StopTime=(\S+), Interval=(\S+), Tolerance=(\S+)\)", text)
    assert experiment
    stop, interval, tolerance = map(float, experiment.groups())
    modifications = [f"{parameter}={value!r}" for parameter, value in changes.items()]
    if model is not EXAMPLE:
        modifications.append(f"data=StrandSpring.Records.{model.name}()")
    source = f"""within ;
model Run
  extends StrandSpring.Examples.{name}({", ".join(modifications)});
  parameter Modelica.Units.SI.Mass unused=1 "Without it, rumoca does not look for the library Modelica";
end Run;
"""
    config = rumoca.SimConfig(solver="rk-like", rtol=tolerance, atol=1e-3 * tolerance)
    found = session.loads(source, model="Run").simulate((0.0, stop), dt=interval, config=config)
    # Events are among the results twice.
    times = interval * np.arange(round(stop / interval) + 1)
    rows = np.searchsorted(found.time, times - 1e-6 * interval)
    np.testing.assert_allclose(np.asarray(found.time)[rows], times, rtol=0.0, atol=1e-9)
    return times, lambda variable: np.asarray(found[variable])[rows]


def check_motion(
    samples: Samples, folder: Path, model: ModelFile, plant: Plant, times: np.ndarray, start: float
) -> Motion:
    """The example moves as the native FMU on a plant, simulated with ten steps for each sample; returns that motion."""
    with FmuSpring(build_native_fmu(model, folder)) as spring:
        motion = simulate(plant, [spring], times[-1], 0.1 * times[1], q=[start])
    assert spring.displacement_min <= motion.displacement.min()
    assert motion.displacement.max() <= spring.displacement_max
    for name, expected in (
        ("mass.s", motion.q),
        ("mass.v", motion.velocity),
        ("spring.f", motion.force),
        ("spring.absorbed_energy", motion.absorbed_energy),
    ):
        # The error of the co-simulation's steps, of second order. Measured: 2e-5 to 1e-4; 1e-6 with a quarter step.
        np.testing.assert_allclose(
            samples(name), expected[::10, 0], rtol=0.0, atol=2e-4 * np.ptp(expected), err_msg=name
        )
    return motion


# Its range does not contain the rig's zero: the FMU counts from the middle of the range, and so does the library.
FAR = ModelFile("far", TABLE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "mass", "load", "start"),
    [(EXAMPLE, 5.0, 50.0, 0.01), (FAR, 0.5, 30.0, 0.004)],
    ids=["polynomial", "table"],
)
def test_free_decay_is_that_of_the_fmu(
    model: ModelFile, mass: float, load: float, start: float, tmp_path: Path
) -> None:
    counted = model if model is EXAMPLE else placed(model, None)[0]
    times, samples = example(tmp_path, "FreeDecay", counted, m=mass, load=load, s_start=start)
    motion = check_motion(samples, tmp_path, model, one_mass(mass, load), times, start)
    assert np.ptp(motion.q[-2000:]) < 0.2 * np.ptp(motion.q)  # it does decay


@pytest.mark.slow
def test_transmissibility_is_that_of_the_fmu(tmp_path: Path) -> None:
    times, samples = example(tmp_path, "Transmissibility", EXAMPLE)
    frequency, amplitude, settling, measured = 20.0, 0.001, 40, 10

    def base(t: float) -> float:
        return float(amplitude * np.sin(2.0 * np.pi * frequency * t))

    motion = check_motion(samples, tmp_path, EXAMPLE, one_mass(5.0, 50.0, base), times, 0.0)
    within = (motion.times >= (settling - 1e-6) / frequency) & (motion.times < (settling + measured - 1e-6) / frequency)
    wave = np.exp(-2j * np.pi * frequency * motion.times[within])
    expected = 2.0 * abs(np.mean(motion.q[within, 0] * wave)) / amplitude
    assert samples("transmissibility")[-1] == pytest.approx(expected, rel=1e-4)  # of the co-simulation's steps
    # The steady motion by harmonic balance. Measured: 4e-5, what is left of the transient.
    system = IsolatedMass(EXAMPLE.parameters, 5.0, 50.0)
    steady = frequency_response(system, Excitation.BASE_DISPLACEMENT, amplitude, [frequency, 1.001 * frequency])
    assert samples("transmissibility")[-1] == pytest.approx(steady.points[0].transmissibility, rel=2e-4)


def test_quasi_static_loop_is_that_of_the_spring(tmp_path: Path) -> None:
    times, samples = example(tmp_path, "QuasiStaticLoop", EXAMPLE)
    frequency, decay = 0.2 * np.pi, 0.02
    turns = (np.arctan(frequency / decay) + np.pi * np.arange(8)) / frequency
    every = np.union1d(times, turns)
    path = 0.025 * np.exp(-decay * every) * np.sin(frequency * every)
    force = Spring(EXAMPLE.parameters).response(path)[np.searchsorted(every, times)]
    # The simulator's error. Measured: 1e-8.
    assert samples("spring.f") == pytest.approx(force, abs=1e-7 * np.ptp(force))


def test_the_model_of_the_documentation_moves(tmp_path: Path) -> None:
    (block,) = blocks("export", "modelica")
    hinge = placed(load_model(TESTS.parent / "models/rubber_hinge.json"), None)[0]
    source = block.replace("\nend", '\n  parameter Modelica.Units.SI.Mass unused=1 "As above";\nend')
    found = library(tmp_path, hinge).loads(source, model="DecayOfMine").simulate((0.0, 0.5), dt=1e-3)
    s = np.asarray(found["mass.s"])
    assert s[0] == 0.005
    assert np.ptp(s[-100:]) < 0.5 * np.ptp(s)
    assert not np.any(found["spring.extrapolating"])
