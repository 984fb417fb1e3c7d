"""Steady vibration by harmonic balance: `isolate` of a mass on springs and of bodies on mounts, against textbooks,
ODE solvers and motion in time; folds, renderings and refusals.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mounted_examples import UP, inclined_box, kernel_motion, one_mass, two_stages
from oracles import shaken, sine
from springs import MOUNT
from strandspring import Spring, SpringParameters
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel
from strandspring.vibration.bodies.parts import MountAxis, Stops
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.shaking import Shaking
from strandspring.vibration.bodies.six_response import system_response
from strandspring.vibration.bodies.small_motion import SmallMotion
from strandspring.vibration.one_mass.options import Excitation, Mount
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import IsolatedMass, static_equilibrium
from tools import slow_but

pytestmark = pytest.mark.long

BASE, ACCELERATION, FORCE = Excitation.BASE_DISPLACEMENT, Excitation.BASE_ACCELERATION, Excitation.FORCE

# ---- a mass on springs ----------------------------------------------------------------------------


@pytest.mark.parametrize(("excitation", "level"), [(BASE, 1e-3), (ACCELERATION, 2.0), (FORCE, 3.0)])
def test_a_linear_spring_is_the_textbook(excitation: Excitation, level: float) -> None:
    spring = SpringParameters((0.0, 2000.0), (1.0,), 1e-9, 100.0, 1.0, 1.0, 0.0, -1.0, 1.0)
    system, stiffness = IsolatedMass(spring, 2.0, Mount(0.0, 3, 2, 12.0)), 3000.0
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


STRAIGHT = SpringParameters((0.0, 9000.0), (1.0,), 20.0, 500.0, 1.0, 1.0, 0.0, -0.03, 0.03)
ADDED = replace(STRAIGHT, second=Mechanism((1.0, 5.0), 8.0, 1500.0, 0.9, 1.4),
                branches=(MaxwellBranch(2e3, 0.01), MaxwellBranch(1e6, 2e-6)))  # fmt: skip
ALONE = IsolatedMass(MOUNT, 5.0, Mount(50.0, damping=15.0))
SHAKEN = {
    "base displacement": (ALONE, BASE, 1e-3, (4.0, 10.4)),
    "base acceleration, 4 x 2 springs": (
        IsolatedMass(MOUNT, 30.0, Mount(None, 4, 2, 60.0)),
        ACCELERATION,
        1.0,
        (5.0, 6.0),
    ),
    "force": (ALONE, FORCE, 20.0, (11.0, 11.5)),
    "second mechanism, branches": (IsolatedMass(ADDED, 2.5, Mount(0.0)), BASE, 5e-4, (9.0, 10.5)),
}


@pytest.mark.parametrize("name", SHAKEN)
def test_time_integration_gives_the_same_steady_motion(name: str) -> None:
    """Both err by some 1e-5, what the solver's tolerance and the end of the transient leave; a tenfold margin."""
    system, excitation, level, frequencies = SHAKEN[name]
    found = frequency_response(system, excitation, level, frequencies)
    for point in (one for one in found.points if one.requested):
        exact = shaken(system, excitation, level, point.frequency)
        base = -level / (2.0 * np.pi * point.frequency) ** 2 if excitation is ACCELERATION else level
        assert point.amplitude == pytest.approx(exact.amplitude, rel=2e-4)
        off = np.degrees(np.angle(exact.relative / base)) - point.relative_phase
        assert abs((off + 180.0) % 360.0 - 180.0) < 0.02
        assert point.relative == pytest.approx(abs(exact.relative / base), rel=2e-4)
        # Its peak lies at a reversal, up to half of 512 samples of a period from the nearest of them.
        assert point.acceleration == pytest.approx(exact.acceleration, rel=5e-3)


def test_the_curve_is_followed_through_folds() -> None:
    """A hardening mount shaken so hard that its resonance leans over: rising, back between the folds, rising again."""
    folded = frequency_response(
        IsolatedMass(MOUNT, 5.1, Mount(damping=20.0)), BASE, 2e-3, np.geomspace(5.0, 25.0, 100), extrapolate=True
    )
    frequency, unstable = folded.column("frequency"), folded.column("stable") == 0.0
    assert np.count_nonzero(np.diff(np.sign(np.diff(frequency)))) == 2
    inside = (frequency > frequency[unstable].min()) & (frequency < frequency[unstable].max())
    values, counts = np.unique(frequency[inside & (folded.column("requested") > 0.0)], return_counts=True)
    assert values.size >= 3
    assert (counts == 3).mean() > 0.6  # next to a fold one of the three may be missed
    assert np.abs(np.diff(np.log(folded.column("amplitude")))).max() < 0.6  # neighbours are near each other
    assert folded.resonance.frequency == pytest.approx(frequency[unstable].max(), rel=0.01)


def test_curves_that_were_hard_to_follow() -> None:
    """A draw of the hinge with a polynomial FE, where near 7.15 Hz arclength steps land on a closed superharmonic curve
    beside the followed one; and almost pure dry friction, where each crossing was a part of what remained.
    """
    for row in json.loads(Path(__file__).with_name("hard_curves.json").read_text(encoding="utf-8")):
        system, band = (
            IsolatedMass(SpringParameters(**row["spring"]), row["mass"], Mount(row["load"])),
            np.array(row["band"]),
        )
        found = frequency_response(system, BASE, row["level"], band, True)
        assert found.column("frequency")[found.column("requested") > 0.0] == pytest.approx(band, rel=1e-12)


def test_the_rest_carries_the_load() -> None:
    rest_of_six = static_equilibrium(IsolatedMass(MOUNT, 6.0, Mount(parallel=2, series=3)))
    each, x = 6.0 * 9.80665 / 2, rest_of_six.displacement - MOUNT.displacement_offset
    assert 50.0 + 20_000.0 * x + 1e5 * x**2 + 2e7 * x**3 == pytest.approx(each, abs=1e-3)  # between grid points
    # Loaded slowly up to the load and down to it from above, the spring stays within the band: omega starts at 0 and is
    # within 1e-3 of saturation, which is 15 N.
    for begin, stop in ((0.02, rest_of_six.min), (0.08, rest_of_six.max)):
        assert Spring(MOUNT).response([begin, stop])[-1] == pytest.approx(each, abs=0.05)
    # A backbone that falls between its humps: from above the spring stays on the other side of them.
    humps = SpringParameters((0.0, -1500.0, 0.0, 1e7), (1.0,), 2.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)
    both = static_equilibrium(IsolatedMass(humps, 1.0, Mount(0.0)))
    for omega, stop in ((1.0, both.min), (-1.0, both.max)):
        force = Spring(humps).response(np.linspace(-omega * 0.02, stop, 2001), omega)
        assert (np.sign(force[:-1]) == -omega).all()
        assert force[-1] == pytest.approx(0.0, abs=1e-2)


# ---- bodies on mounts -----------------------------------------------------------------------------


PLACE, LEANING = (0.05, -0.1, 0.1), (0.6, 0.0, 0.8)
SOFT, STAGES, BRANCHED = (
    system.with_springs(lambda _, spring=spring: spring)
    for system, spring in ((inclined_box(), STRAIGHT), (two_stages(), STRAIGHT), (inclined_box(), ADDED))
)
STOPPED = MountAxis(STRAIGHT, UP, 0.0, damping=15.0, stops=Stops(-0.002, 0.02, 4e4))
SYSTEMS = {
    "acceleration": (SOFT, Shaking(ACCELERATION, LEANING), 1.5),
    "rotation": (SOFT, Shaking(BASE, LEANING, (0.0, 0.0, 0.0)), 1e-3),
    "force": (SOFT, Shaking(FORCE, LEANING, place=PLACE), 25.0),
    "stages": (STAGES, Shaking(ACCELERATION, LEANING), 1.0),
    "stops": (one_mass(STOPPED, 2.5, (0.0, 0.0, -9.8)), Shaking(ACCELERATION, UP), 1.5),
    "branches": (BRANCHED, Shaking(ACCELERATION, LEANING), 1.5),
}


@pytest.mark.parametrize("frequency", slow_but([8.0, 13.0], [13.0]))
@pytest.mark.parametrize("name", SYSTEMS)
def test_motion_in_time(name: str, frequency: float) -> None:
    """Bodies with finite rotations, from rest until steady, in the compiled integrator."""
    system, shaking, level = SYSTEMS[name]
    circular = 2.0 * np.pi * frequency
    of_rate, of_force = shaking.about is not None, shaking.kind is FORCE
    of_base = ChannelKind.BASE_ANGULAR_VELOCITY if of_rate else ChannelKind.BASE_ACCELERATION
    # Of an angle cos, the rate is -sin.
    course = sine(level * (circular if of_rate else 1.0), frequency, np.pi if of_rate else 0.5 * np.pi)
    place = PLACE if of_force else (0.0, 0.0, 0.0)
    channel = LoadChannel(ChannelKind.FORCE if of_force else of_base, course, shaking.direction, place=place)
    motion = SmallMotion(system, rest(system).pose)
    found = system_response(motion, shaking, level, [0.99 * frequency, frequency, 1.01 * frequency])
    at = int(np.flatnonzero(np.isclose(found.frequency, frequency))[0])
    # Acceleration over displacement is -Omega^2, and the base's acceleration is what excites.
    expected = level * found.gain[at, -1] * (-(circular**2) if of_rate or of_force else 1.0)
    case, step = LoadCase("c", "sine", 100.0 / frequency, (channel,)), 1.0 / frequency / 2000
    last = kernel_motion(system, case, step).histories.acceleration[-8000:, -1]
    phases = np.exp(-2j * np.pi * (np.arange(8000) + 1) / 2000)
    assert np.abs(phases @ last / 4000 - expected).max() < 2e-4 * np.abs(expected).max()
    if name == "stops":
        assert found.low[at].min() < -0.002
