"""The exported Modelica package, compiled and simulated by a program of its own, against the model.

rumoca, a Modelica compiler and simulator, takes the package together with ``modelica_stub.mo``, which has the few
classes of the Modelica Standard Library that the package needs.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rumoca
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fmu_tools import OTHER, SPRING
from springs import TABLE, force_by_definition, force_scale, spring
from strandspring import Spring, SpringParameters
from strandspring.core.parameters import ARRAYS, SCALARS
from strandspring.core.variables import variables
from strandspring.export.modelica import modelica_package, package_name
from strandspring.modelfile import ModelFile, load_model

TESTS = Path(__file__).resolve().parents[1]
HINGE = load_model(TESTS.parent / "models/rubber_hinge.json").parameters
CONSTANT = SpringParameters((2.0,), (1.0,), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)
LONGEST = SpringParameters((0.0, 1e4, *[1e5] * 19), (1.0, *[1.0] * 20), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)

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


def compiled(folder: Path, model: ModelFile, system: str) -> rumoca.Model:
    """`system` around the exported package, read from files as a Modelica tool reads them."""
    package = package_name(model.name)
    (folder / "Modelica.mo").write_bytes((TESTS / "helpers" / "modelica_stub.mo").read_bytes())
    (folder / f"{package}.mo").write_text(modelica_package(model), encoding="utf-8", newline="\n")
    bench = folder / "Bench.mo"
    bench.write_text(BENCH.format(system=system), encoding="utf-8", newline="\n")
    return rumoca.Session().load(bench, model="Bench.System")


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
    mount.Spring spring(data(omega_start={omega_start!r}));
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


def turning_points(times: np.ndarray) -> list[float]:
    """When `swing` turns back."""

    def rate(t: Any) -> Any:
        return 6.0 * np.cos(6.0 * t) * (1.0 + 0.3 * np.cos(17.0 * t)) - 5.1 * np.sin(6.0 * t) * np.sin(17.0 * t)

    crossings = np.flatnonzero(rate(times[:-1]) * rate(times[1:]) < 0.0)
    return [float(brentq(rate, times[k], times[k + 1], xtol=1e-15)) for k in crossings]


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
    mount.Spring spring;
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
    mount.Spring spring(data(kE={1.0, 500.0}, rho=50.0, displacement_max=0.2), s_rel0=0.01);
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
    """As the package says: s_rel0 = -(distance at displacement 0), and the force pushes the flanges apart."""
    low, high = SPRING.displacement_min, SPRING.displacement_max
    system = f"""
    mount.Spring spring(s_rel0=-0.3);
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
    mount.FMUFlanges flanges(s_rel0=0.1);
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
    {package}.Spring spring;
    Mover mover;
  equation
    connect(ground.flange, spring.flange_a);
    connect(mover.flange, spring.flange_b);"""


@pytest.mark.parametrize(
    "parameters", [SPRING, HINGE, CONSTANT, LONGEST, TABLE], ids=["spring", "hinge", "constant", "longest", "table"]
)
def test_the_record_holds_every_parameter_of_the_fmu(parameters: SpringParameters, tmp_path: Path) -> None:
    model = ModelFile("mount", parameters)
    found = compiled(tmp_path, model, ALONE.format(package="mount")).parameters
    table = {v.name: v for v in variables(*parameters.counts) if v.causality == "parameter"}
    for name in (*SCALARS, "omega_start"):
        variable, of_record = table.pop(name), found[f"spring.data.{name}"]
        assert of_record.value == getattr(parameters, name, 0.0)  # every bit
        assert (of_record.unit, of_record.min, of_record.max) == (variable.unit, variable.minimum, variable.maximum)
        assert of_record.description == variable.description
    # The compiler does not tell units and values of an array.
    text = modelica_package(model)
    for name, values in ((name, getattr(parameters, name)) for name in ARRAYS if getattr(parameters, name)):
        declared = re.search(rf"{name}\[(\d+)\]\(\s*final unit=\{{(.*?)\}}\)=\{{(.*?)\}}", text, re.DOTALL)
        assert declared
        assert int(declared[1]) == len(values)
        assert tuple(map(float, declared[3].split(","))) == values
        units = [str(table.pop(f"{name}_{i}").unit) for i in range(len(values))]
        # An exponent follows its symbol in Modelica.
        assert declared[2].replace('"', "").split(", ") == [unit.replace("^", "") for unit in units]
    assert not table


@pytest.mark.parametrize(
    ("name", "package"),
    [
        *((word, f"{word}_spring") for word in ("model", "end", "der", "Modelica", "Real", "abs", "smooth", "time")),
        *((name, name) for name in ("Spring", "Parameters", "FMUFlanges", "data", "f", "lambda", "s_rel", "Model")),
    ],
)  # fmt: skip
def test_whatever_a_model_is_called_it_is_modelica(name: str, package: str, tmp_path: Path) -> None:
    assert package_name(name) == package
    assert compiled(tmp_path, ModelFile(name, SPRING), ALONE.format(package=package)).states.names
    assert [d for d in rumoca.validate(tmp_path / f"{package}.mo") if d.level != "warning"] == []


def test_no_text_leaves_its_string(tmp_path: Path) -> None:
    awkward = (
        "\"quoted\" 'single' <b>bold</b> </html> & \\ \\n \nnew line\ttab\rreturn äöü 弹簧 %s "
        '"; end mount; << 7*7 >> <% x %> {{ y }} // /* \\'
    )
    model = ModelFile("mount", SPRING, awkward)
    text = modelica_package(model)
    literal = re.search(r"^package mount (\".*\")$", text, re.MULTILINE)
    (page,) = re.findall(r"^<p>(.*quoted.*)</p>$", text, re.MULTILINE)
    assert literal
    system = f"""
    parameter Real a=1 {literal[1]};
    parameter Real b=1 "{page}";
    {ALONE.format(package="mount")}"""
    found = compiled(tmp_path, model, system).parameters
    assert found["a"].description == awkward
    assert "<b>" not in found["b"].description
    assert "</html>" not in found["b"].description
    assert found["b"].description.startswith(
        "&quot;quoted&quot; &#x27;single&#x27; &lt;b&gt;bold&lt;/b&gt; &lt;/html&gt;"
    )
