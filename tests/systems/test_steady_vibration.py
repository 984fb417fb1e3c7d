"""Steady vibration by harmonic balance: `isolate` of a mass on springs and of bodies on mounts, against textbooks,
ODE solvers and motion in time; folds, figures and refusals.
"""

from __future__ import annotations

import csv
import json
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from bodies_oracle import sine
from mounted_examples import UP, inclined_box, kernel_motion, one_mass, two_stages
from shaken import shaken
from springs import MOUNT
from strandspring import Spring, SpringParameters, SystemIsolation, isolate_system
from strandspring.api.vibration.system_isolation_plot import fill, size_of
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.errors import MountedSystemError
from strandspring.examples.system_models import SYSTEMS
from strandspring.kernel.balance import BalancedSystem
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel
from strandspring.vibration.bodies.modes import modes
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MountAxis, Stops
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.shaking import Shaking
from strandspring.vibration.bodies.six_response import system_response
from strandspring.vibration.bodies.small_motion import SmallMotion
from strandspring.vibration.description.system_file import load_system_file
from strandspring.vibration.one_mass.harmonic_balance import largest_of_period
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, IsolationError, static_equilibrium
from terminal import Terminal
from tools import slow_but

pytestmark = pytest.mark.long

BASE, ACCELERATION, FORCE = Excitation.BASE_DISPLACEMENT, Excitation.BASE_ACCELERATION, Excitation.FORCE
BOX, GUN = "electronics_box.toml", "gun_cradle.toml"

# ---- a mass on springs ----------------------------------------------------------------------------


@pytest.mark.parametrize(("excitation", "level"), [(BASE, 1e-3), (ACCELERATION, 2.0), (FORCE, 3.0)])
def test_a_linear_spring_is_the_textbook(excitation: Excitation, level: float) -> None:
    spring = SpringParameters((0.0, 2000.0), (1.0,), 1e-9, 100.0, 1.0, 1.0, 0.0, -1.0, 1.0)
    system, stiffness = IsolatedMass(spring, 2.0, load=0.0, parallel=3, series=2, damping=12.0), 3000.0
    band = np.geomspace(0.5, 40.0, 40)
    found = frequency_response(system, excitation, level, band)
    assert found.column("frequency")[found.column("requested") > 0.0] == pytest.approx(band, rel=1e-12)
    circular = 2.0 * np.pi * found.column("frequency")
    dynamic = stiffness - 2.0 * circular**2 + 12.0j * circular
    transmissibility = (stiffness + 12.0j * circular) / dynamic
    relative = 1.0 / dynamic if excitation is FORCE else 2.0 * circular**2 / dynamic
    assert found.column("transmissibility") == pytest.approx(np.abs(transmissibility), rel=1e-6)
    assert found.column("relative") == pytest.approx(np.abs(relative), rel=1e-6)
    for name, expected in (("phase", transmissibility), ("relative_phase", relative)):
        off = (found.column(name) - np.degrees(np.angle(expected)) + 180.0) % 360.0 - 180.0
        assert np.abs(off).max() < 1e-4, name  # degrees; 1e-6 of a radian
    resonance = found.resonance
    assert resonance.stiffness == pytest.approx(stiffness, rel=1e-6)
    assert resonance.loss_factor == pytest.approx(12.0 * 2.0 * np.pi * resonance.frequency / stiffness, rel=1e-6)
    # At sqrt(2) of the undamped natural frequency; between points that are 12 % apart damping makes the difference.
    assert resonance.isolation_frequency == pytest.approx(np.sqrt(stiffness) / (2.0 * np.pi), rel=3e-4)


@pytest.mark.parametrize(
    ("system", "excitation", "level", "frequencies"),
    [
        (IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0), BASE, 1e-3, (4.0, 10.4)),
        (IsolatedMass(MOUNT, 30.0, None, 4, 2, 60.0), ACCELERATION, 1.0, (5.0, 6.0)),
        (IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0), FORCE, 20.0, (11.0, 11.5)),
    ],
    ids=["base displacement", "base acceleration, 4 x 2 springs", "force"],
)
def test_time_integration_gives_the_same_steady_motion(
    system: IsolatedMass, excitation: Excitation, level: float, frequencies: tuple[float, ...]
) -> None:
    """Both err by some 1e-5, what the solver's tolerance and the end of the transient leave; a tenfold margin."""
    found = frequency_response(system, excitation, level, frequencies)
    for point in (one for one in found.points if one.requested):
        exact = shaken(system, excitation, level, point.frequency)
        base = -level / (2.0 * np.pi * point.frequency) ** 2 if excitation is ACCELERATION else level
        assert point.amplitude == pytest.approx(exact.amplitude, rel=2e-4)
        off = np.degrees(np.angle(exact.relative / base)) - point.relative_phase
        assert abs((off + 180.0) % 360.0 - 180.0) < 0.02
        assert point.relative == pytest.approx(abs(exact.relative / base), rel=2e-4)
        # Its peak lies at a reversal, up to half of 256 samples of a period from the nearest of them.
        assert point.acceleration == pytest.approx(exact.acceleration, rel=5e-3)


def test_the_curve_is_followed_through_folds() -> None:
    """A hardening mount shaken so hard that its resonance leans over: rising, back between the folds, rising again."""
    folded = frequency_response(
        IsolatedMass(MOUNT, 5.1, damping=20.0), BASE, 2e-3, np.geomspace(5.0, 25.0, 100), extrapolate=True
    )
    frequency, unstable = folded.column("frequency"), folded.column("stable") == 0.0
    assert np.count_nonzero(np.diff(np.sign(np.diff(frequency)))) == 2
    inside = (frequency > frequency[unstable].min()) & (frequency < frequency[unstable].max())
    values, counts = np.unique(frequency[inside & (folded.column("requested") > 0.0)], return_counts=True)
    assert values.size >= 3
    assert (counts == 3).mean() > 0.6  # next to a fold one of the three may be missed
    assert np.abs(np.diff(np.log(folded.column("amplitude")))).max() < 0.6  # neighbours are near each other
    assert folded.resonance.frequency == pytest.approx(frequency[unstable].max(), rel=0.01)


def test_the_rest_carries_the_load() -> None:
    rest_of_six = static_equilibrium(IsolatedMass(MOUNT, 6.0, parallel=2, series=3))
    each, x = 6.0 * 9.80665 / 2, rest_of_six.displacement - MOUNT.displacement_offset
    assert 50.0 + 20_000.0 * x + 1e5 * x**2 + 2e7 * x**3 == pytest.approx(each, abs=1e-3)  # between grid points
    # Loaded slowly up to the load and down to it from above, the spring stays within the band: omega starts at 0 and is
    # within 1e-3 of saturation, which is 15 N.
    for begin, stop in ((0.02, rest_of_six.min), (0.08, rest_of_six.max)):
        assert Spring(MOUNT).response([begin, stop])[-1] == pytest.approx(each, abs=0.05)
    # A backbone that falls between its humps: from above the spring stays on the other side of them.
    humps = SpringParameters((0.0, -1500.0, 0.0, 1e7), (1.0,), 2.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)
    both = static_equilibrium(IsolatedMass(humps, 1.0, load=0.0))
    for omega, stop in ((1.0, both.min), (-1.0, both.max)):
        force = Spring(humps).response(np.linspace(-omega * 0.02, stop, 2001), omega)
        assert (np.sign(force[:-1]) == -omega).all()
        assert force[-1] == pytest.approx(0.0, abs=1e-2)
    soft = static_equilibrium(IsolatedMass(MOUNT, 6.0, parallel=2))
    assert (rest_of_six.sag, rest_of_six.frequency) == pytest.approx((3.0 * soft.sag, soft.frequency / np.sqrt(3.0)))


@pytest.mark.parametrize("order", [1, 5])
def test_peaks_between_samples_of_a_period(order: int) -> None:
    """Of 256 samples the largest misses up to (pi*order/256)^2/2, 8e-5 and 2e-3; a parabola its fourth power."""
    phases = np.linspace(0.0, 0.1, 7)[:, None]
    samples = np.abs(np.cos(order * (2.0 * np.pi * np.arange(256) / 256 + phases)))
    assert largest_of_period(samples) == pytest.approx(np.ones(7), abs=(np.pi * order / 256) ** 4)


def test_curves_that_were_hard_to_follow(monkeypatch: pytest.MonkeyPatch) -> None:
    """A draw of the hinge with a polynomial FE, where near 7.15 Hz arclength steps land on a closed superharmonic curve
    beside the followed one; and almost pure dry friction, where each crossing was a part of what remained.
    """
    hinge = Spring.load(Path(__file__).parents[1] / "golden" / "rubber_hinge.json").parameters
    drawn = replace(hinge, kappa_omega=0.06395164797191956, rho=1766.9740459124064, sigma=0.8874243050051873,
                    n=3.421727778814006)  # fmt: skip
    band = np.array([3.29255384, 6.09510679, 11.28313418, 20.88710195, 38.66576617, 71.57725745])
    response = frequency_response(IsolatedMass(drawn, 0.02), BASE, 8.538063896930848e-05, band)
    assert response.column("frequency")[response.column("requested") > 0.0] == pytest.approx(band, rel=1e-12)
    assert response.resonance.frequency == pytest.approx(13.56, rel=5e-3)  # 64th parts of the way between two points
    spring = SpringParameters(
        (2121.4871911254922, 1.2246346645083803), (1.0, -0.19150558578713112), 999900000000000.0, 669822208639.3677,
        0.5, 0.010001, -4.734543938765586, -5.410907358589241, -3.9179738799705883,
    )  # fmt: skip
    sweeps, sweep = [], BalancedSystem.sweep

    def counted(*arguments: Any) -> Any:
        sweeps.append(arguments)
        assert len(sweeps) < 100, "no end"
        return sweep(*arguments)

    monkeypatch.setattr(BalancedSystem, "sweep", counted)
    system = IsolatedMass(spring, 216.34024280265245, 2121.5730420806317)
    band = np.geomspace(0.23, 0.24, 20) * static_equilibrium(system).frequency
    found = frequency_response(system, BASE, 0.0074646673930932606, band, True)
    assert found.column("requested").sum() == 20


PLAIN, FEW = {"mass": 5.0, "load": 50.0}, [1.0, 2.0]
FALLING, PULLED = replace(MOUNT, kE=(50.0, -20_000.0)), replace(MOUNT, kE=(-2000.0, 20_000.0))


@pytest.mark.parametrize(
    ("mass", "level", "band", "refusal"),
    [
        ({"mass": 0.0}, 1.0, FEW, r"`mass` must be within \[1e-09, 1e\+09\] kg, got 0.0; check its unit"),
        ({"mass": float("nan")}, 1.0, FEW, "`mass` must be within .* got nan"),
        ({"mass": 1e200}, 1.0, FEW, "`mass` must be within .* got 1e.200"),
        ({"mass": 5.0, "load": float("inf")}, 1.0, FEW, "`load` must be finite"),
        (PLAIN | {"parallel": 0}, 1.0, FEW, "`parallel` must be a whole number from 1 to"),
        (PLAIN | {"parallel": 1.5}, 1.0, FEW, "`parallel` must be a whole number from 1 to"),
        (PLAIN | {"series": 0}, 1.0, FEW, "`series` must be a whole number"),
        (PLAIN | {"damping": -1.0}, 1.0, FEW, "`damping` must be finite and >= 0"),
        ({"mass": 1000.0}, 1.0, FEW, "must lie within the forces of the identified range"),
        ({"mass": 5.0, "spring": PULLED}, 1.0, FEW, "where no mass can rest; use another mass"),
        (PLAIN | {"spring": FALLING}, 1.0, FEW, "is not stable"),
        (PLAIN, 20.0, np.geomspace(3.0, 30.0, 50), r"outside the identified range of 20 to 80 mm; use a lower"),
        (PLAIN, 1.0, [0.0, 1.0], "Every frequency must be finite and > 0"),
        (PLAIN, 1.0, [1.0, float("nan")], "Every frequency must be finite and > 0"),
        (PLAIN, 1.0, [2.0, 1.0], "`frequencies` must rise"),
        (PLAIN, 1.0, [1.0], "must be at least two"),
        *((PLAIN, level, FEW, "`level` must be finite and > 0") for level in (0.0, -1.0, float("nan"))),
    ],
)
def test_what_does_not_vibrate_is_refused(mass: dict[str, Any], level: float, band: Any, refusal: str) -> None:
    with pytest.raises(IsolationError, match=refusal):
        frequency_response(IsolatedMass(**{"spring": MOUNT, **mass}), FORCE, level, band)


# ---- bodies on mounts -----------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "level"), [(BASE, 5e-4), (ACCELERATION, 1.0), (FORCE, 5.0)])
def test_one_axis_is_an_isolated_mass(kind: Excitation, level: float) -> None:
    mass = IsolatedMass(MOUNT, 5.0, 50.0, parallel=3, series=2, damping=20.0)
    axis = MountAxis(MOUNT, (0.0, 0.0, -1.0), 0.05, parallel=3, series=2, damping=20.0)
    system = one_mass(axis, 5.0, (0.0, 0.0, -10.0))
    pose = (np.array([[0.0, 0.0, -2.0 * (static_equilibrium(mass).displacement - 0.05)]]), np.eye(3)[None])
    band = np.geomspace(2.0, 40.0, 40)
    one = frequency_response(mass, kind, level, band, samples=128)
    found = system_response(SmallMotion(system, pose), Shaking(kind, (0.0, 0.0, -1.0)), level, band)
    wanted = one.column("requested") > 0.0
    ratio = -(found.base_force / found.level if kind is FORCE else found.gain[:, 0])[found.requested, 2]
    expected = one.column("transmissibility") * np.exp(1j * np.radians(one.column("phase")))
    # Both stop where the equations are solved to 1e-10 of their largest term; a resonance magnifies that.
    assert ratio == pytest.approx(expected[wanted], rel=3e-7)
    assert np.abs(found.base_force[found.requested, 2]) == pytest.approx(one.column("force")[wanted], rel=3e-7)
    for name, values, within in (
        ("min", found.low[:, 0], 3e-7), ("max", found.high[:, 0], 3e-7),
        # The parabola's largest value against the largest of 128 samples, of a harmonic k off by (k*pi/128)^2/2.
        ("acceleration", found.acceleration[:, 0, 2], 4e-3),
    ):  # fmt: skip
        assert values[found.requested] == pytest.approx(one.column(name)[wanted], rel=within), name
    (resonance,) = found.resonances
    if kind is not FORCE:
        assert resonance.frequency == pytest.approx(one.resonance.frequency, rel=2e-3)  # spacing of the points there
        assert resonance.gain == pytest.approx(one.resonance.transmissibility, rel=1e-4)
        assert resonance.isolation_frequency == pytest.approx(one.resonance.isolation_frequency, rel=1e-3)
    # Where nothing is amplified, no isolation begins.
    (above,) = system_response(
        SmallMotion(system, pose), Shaking(kind, (0.0, 0.0, -1.0)), level, [25.0, 40.0]
    ).resonances
    assert math.isnan(above.isolation_frequency)


STRAIGHT = SpringParameters((0.0, 9000.0), (1.0,), 20.0, 500.0, 1.0, 1.0, 0.0, -0.03, 0.03)
ADDED = replace(STRAIGHT, second=Mechanism((1.0, 5.0), 8.0, 1500.0, 0.9, 1.4),
                branches=(MaxwellBranch(2e3, 0.01), MaxwellBranch(1e6, 2e-6)))  # fmt: skip
SOFT = inclined_box().with_springs(lambda _: STRAIGHT)
PLACE = (0.05, -0.1, 0.1)
STOPPED = one_mass(MountAxis(STRAIGHT, UP, 0.0, damping=15.0, stops=Stops(-0.002, 0.02, 4e4)), 2.5, (0.0, 0.0, -9.8))


@pytest.mark.parametrize("frequency", slow_but([8.0, 13.0], [13.0]))
@pytest.mark.parametrize(
    ("system", "shaking", "level"),
    [
        (SOFT, Shaking(ACCELERATION, (0.6, 0.0, 0.8)), 1.5),
        (SOFT, Shaking(BASE, (0.6, 0.0, 0.8), (0.0, 0.0, 0.0)), 1e-3),
        (SOFT, Shaking(FORCE, (0.6, 0.0, 0.8), place=PLACE), 25.0),
        (two_stages().with_springs(lambda _: STRAIGHT), Shaking(ACCELERATION, (0.6, 0.0, 0.8)), 1.0),
        (STOPPED, Shaking(ACCELERATION, UP), 1.5),
        (inclined_box().with_springs(lambda _: ADDED), Shaking(ACCELERATION, (0.6, 0.0, 0.8)), 1.5),
    ],
    ids=["acceleration", "rotation", "force", "stages", "stops", "branches"],
)
def test_motion_in_time(system: MountedSystem, shaking: Shaking, level: float, frequency: float) -> None:
    """Bodies with finite rotations, from rest until steady, in the compiled integrator."""
    circular, of_rate, of_force = 2.0 * np.pi * frequency, shaking.about is not None, shaking.kind is FORCE
    kind = (
        ChannelKind.BASE_ANGULAR_VELOCITY
        if of_rate
        else ChannelKind.FORCE
        if of_force
        else ChannelKind.BASE_ACCELERATION
    )
    # Of an angle cos, the rate is -sin.
    course = sine(level * (circular if of_rate else 1.0), frequency, np.pi if of_rate else 0.5 * np.pi)
    channel = LoadChannel(kind, course, shaking.direction, place=PLACE if of_force else (0.0, 0.0, 0.0))
    motion = SmallMotion(system, rest(system).pose)
    found = system_response(motion, shaking, level, [0.99 * frequency, frequency, 1.01 * frequency])
    at = int(np.flatnonzero(np.isclose(found.frequency, frequency))[0])
    # Acceleration over displacement is -Omega^2, and the base's acceleration is what excites.
    expected = level * found.gain[at, -1] * (-(circular**2) if of_rate or of_force else 1.0)
    case, step = LoadCase("c", "sine", 100.0 / frequency, (channel,)), 1.0 / frequency / 2000
    last = kernel_motion(system, case, step).histories.acceleration[-8000:, -1]
    phases = np.exp(-2j * np.pi * (np.arange(8000) + 1) / 2000)
    assert np.abs(phases @ last / 4000 - expected).max() < 2e-4 * np.abs(expected).max()
    if system is STOPPED:
        assert found.low[at].min() < -0.002


def test_what_moves_nothing_and_too_far_is_refused() -> None:
    box, across = SmallMotion(SOFT, rest(SOFT).pose), Shaking(BASE, (1.0, 0.0, 0.0))
    guided = replace(STOPPED, bodies=(replace(STOPPED.bodies[0], direction=(0.6, 0.0, 0.8)),))
    for motion, shaking, level, message in (
        (box, across, 0.01, r"the springs of corner \d .* move from .* use a lower level"),
        (box, across, 0.0, r"`level` must be finite and > 0 \[m\], got 0.0"),
        (SmallMotion.about_nominal(STOPPED), across, 1e-3, "along x moves nothing, because no body is free"),
        (SmallMotion.about_nominal(guided), replace(across, direction=(0.8, 0.0, -0.6)), 1e-3,
         r"along \(0.8, 0, -0.6\) moves nothing"),
    ):  # fmt: skip
        with pytest.raises(MountedSystemError, match=message):
            system_response(motion, shaking, level, np.geomspace(3.0, 40.0, 40))
    with pytest.raises(MountedSystemError, match="must be a unit vector, got length 2"):
        Shaking(FORCE, (0.0, 2.0, 0.0))
    with pytest.raises(MountedSystemError, match="not about an axis"):
        Shaking(FORCE, (0.0, 1.0, 0.0), (0.0, 0.0, 0.0))


# ---- the command ----------------------------------------------------------------------------------


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    shutil.copytree(SYSTEMS, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    return Terminal(capsys)


@pytest.fixture(scope="module")
def of_box() -> SystemIsolation:
    directions = ["x", (0.0, 0.0, -2.0)]
    return isolate_system(SYSTEMS / BOX, base_displacement=2e-4, directions=directions, points=6, band=(6.0, 30.0))


def test_text_json_csv_plot_and_python_say_the_same(terminal: Terminal, of_box: SystemIsolation) -> None:
    command = ["isolate", BOX, "--points", "6", "--band", "6", "30", "--base-displacement", "0.2"]
    command += ["--direction", "x", "--direction", "0,0,-2"]
    text = terminal(*command, "--verbose")
    for words in (
        "Electronics box (electronics_box.toml)", "standard:", "base displacement along x", "circuit board",
        "box, 20 kg, rests at x 0, y 0, z -2.189 mm, tilted 0 degrees", "viscous damping %", "y 74 %, rx 26 %",
        "isolates from Hz",
    ):  # fmt: skip
        assert words in text, words
    told = json.loads(terminal(*command, "-o", "out.csv", "--plot", "out.svg", "--json"))
    assert set(told) == {"system", "name", "levels_chosen", "candidates", "output", "plot", "report"}
    with Path("out.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert len(table) == len(of_box.to_frame())
    assert {row["excitation"] for row in table} == {"base displacement along x", "base displacement along -z"}
    for candidate, one in zip(told["candidates"], of_box.candidates, strict=True):
        frequencies = [mode.frequency for mode in modes(SmallMotion(one.system, rest(one.system).pose))]
        assert [mode["frequency"] for mode in candidate["modes"]] == frequencies
        for given, response in zip(candidate["responses"], one.responses, strict=True):
            assert (given["excitation"], given["points"][1]["name"]) == (response.shaking.name, "circuit board")
            assert given["points"][1]["gain"] == np.abs(response.gain[:, 1]).tolist()
            rows = [row for row in table if (row["candidate"], row["excitation"]) == (one.label, response.shaking.name)]
            column = [float(row["circuit board x: motion over excitation [1]"]) for row in rows]
            assert column == np.abs(response.gain[:, 1, 0]).tolist()
            assert [float(row["frequency [Hz]"]) for row in rows] == given["frequency"]
    of_box.save_plot("again.svg")
    drawn = [Path(name).read_text(encoding="utf-8").count("<path") for name in ("out.svg", "again.svg")]
    assert drawn[0] == drawn[1] > 10
    rows = of_box.resonances()
    (row,) = rows[
        (rows.candidate == "standard") & (rows.point == "circuit board") & (rows.direction == "x")
        & (rows.excitation == "base displacement along x")
    ].to_dict("records")  # fmt: skip
    # The box rocks, and the board lies above its centre of gravity.
    assert row["frequency"] == pytest.approx(9.8, rel=0.03)
    assert row["gain"] > 8.0
    assert row["frequency"] < row["isolation_frequency"] < 30.0
    # A legend of long names is whole, and below the curves.
    longer = {f"{label} {'w' * 60}": responses for label, responses in of_box.curves.items()}
    for curves, most in ((of_box.curves, 4), (longer, 1)):
        figure = Figure(figsize=size_of(curves), layout="constrained")
        fill(figure, curves, "title")
        FigureCanvasAgg(figure).draw()
        (legend,) = figure.legends
        box, page = legend.get_window_extent(), figure.bbox
        assert page.x0 <= box.x0 < box.x1 <= page.x1
        assert page.y0 <= box.y0 < box.y1 < 0.5 * page.y1
        assert legend._ncols <= most  # type: ignore[attr-defined]


def test_levels_a_force_and_a_rotation(terminal: Terminal) -> None:
    few = ("--points", "6", "--direction", "x")
    text = " ".join(terminal("isolate", BOX, *few, "--verbose").split())
    assert "Levels: 0.5, 1 and 2 % of the free travel of 23.4 mm of the mounts of softer, the smallest" in text
    text = terminal("isolate", GUN, "--points", "6", "--force", "500", "--at", "breech")
    assert "force along x" in text
    assert "mm/N" in text
    assert "along y" not in text  # where it cannot move
    text = terminal("isolate", BOX, *few, "--base-rotation", "0.1")
    assert "base rotation about x" in text
    assert "mm/rad" in text


DIRECTION = "must be x, y, z, -x, -y, -z or three numbers"
SHEAR = ("corner_shear.json", "--mass", "3")


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        ((BOX, "--mass", "3"), 2, "--mass does not apply to electronics_box.toml, which describes masses"),
        ((BOX, "--verify"), 2, "--verify does not apply to electronics_box.toml"),
        ((BOX, "--zero", "rig"), 2, "--zero does not apply to"),
        ((BOX, GUN), 2, "electronics_box.toml describes a whole system and its candidates; give it alone"),
        ((BOX, "corner_shear.json"), 2, "give it alone"),
        (("corner_shear.json",), 2, "Missing option '--mass'"),
        ((*SHEAR, "--direction", "x"), 2, "--direction applies to a SYSTEM.toml only"),
        ((*SHEAR, "--at", "x"), 2, "--at applies to a SYSTEM.toml only"),
        ((BOX, "--at", "box"), 2, "--at says where a force acts; give --force"),
        *(((BOX, "--direction", wrong), 2, DIRECTION) for wrong in ("up", "0,0,0", "1,nan,0")),
        ((BOX, "--force", "1", "--base-rotation", "1"), 2, "--base-rotation and --force exclude each other"),
        ((BOX, "-o", BOX), 2, "would overwrite the input"),
        ((BOX, "--force", "1", "--at", "lid"), 1, "must be one of the points box, circuit board, connector, got 'lid'"),
        ((GUN, "--direction", "y"), 1, "base displacement along y moves nothing, because no body is free to follow it"),
        ((BOX, "--base-displacement", "8", "--band", "4", "20"), 1, "outside their identified range"),
        (("no.toml",), 1, "no.toml"),
    ],
)
def test_refusals(terminal: Terminal, arguments: tuple[str, ...], status: int, message: str) -> None:
    terminal("isolate", *arguments, "--points", "60", status=status)
    assert message in " ".join(terminal.err.split())
    assert status == 2 or terminal.err.count("\n") == 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"base_rotation": -1.0}, "base rotation must be finite and > 0"),
        ({"base_rotation": 1.0, "force": 1.0}, "exclude each other"),
        ({"band": (3.0, 2.0)}, "The band must rise"),
    ],
)
def test_refusals_in_python(given: dict[str, Any], message: str) -> None:
    with pytest.raises(IsolationError, match=message):
        isolate_system(load_system_file(SYSTEMS / GUN), **given)


def largest_error(response: Any) -> float:
    return max((error.largest for error in response.errors), default=0.0)


def test_motions_in_which_bodies_turn_or_friction_slides_are_told() -> None:
    """By up to 0.4, 1.8 and 7.8 degrees; first-order rotations err by 7 % and more in acceleration from 1 degree on."""
    levels = [0.2, 2.0, 6.0]
    found = isolate_system(SYSTEMS / BOX, candidates="softer", base_acceleration=levels, directions="y", points=20,
                           extrapolate=True)  # fmt: skip
    weak, middle, strong = found.candidates[0].responses
    assert weak.errors == ()
    assert 0.0 < largest_error(middle) < 2e-3
    assert largest_error(strong) < 0.04
    assert [any("time integration" in s for s in one.cautions) for one in (weak, middle, strong)] == [
        False,
        False,
        True,
    ]
    for direction, slides in (((0.0, 0.0, 1.0), False), ((1.0, 1.0, 1.0), True)):
        told = isolate_system(SYSTEMS / BOX, candidates="standard", base_displacement=1.5e-3, directions=[direction],
                              points=6, band=(6.0, 20.0))  # fmt: skip
        (response,) = told.candidates[0].responses
        assert any("slide at once" in sentence for sentence in response.cautions) == slides
