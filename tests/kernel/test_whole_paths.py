"""Whole paths as `Spring` takes them: warnings, and reversals below the resolution of a sensor."""

from __future__ import annotations

import warnings

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from branched_springs import BRANCHED
from kernel_tools import FloatArray
from springs import EXAMPLES, along, spring
from strandspring import Spring, SpringParameters
from strandspring.core import resolution
from strandspring.kernel.arrays import address
from strandspring.kernel.library import library
from strandspring.kernel.steady import steady_start

SPRING = Spring(EXAMPLES["stranded_wire"])


def test_ends_of_the_world() -> None:
    assert SPRING.omega([0.05, 1e9, -1e9]).tolist() == [0.0, 1.0, -1.0]
    # omega is that of the first mechanism.
    assert Spring(BRANCHED["second"]).omega([0.05, 0.06]).tolist() == SPRING.omega([0.05, 0.06]).tolist()


def test_a_path_that_leaves_the_range_is_warned_of_and_the_noise_of_a_record_is_not() -> None:
    p = spring(n=1.0, sigma=1.0, saturations=40.0, amplifier=())
    inside, outside = along(p, [0.0, 1.01, -1.01]), along(p, [0.0, 0.5, 1.1, -1.1, 0.0])
    for method in ("response", "stiffness", "absorbed_energy", "responses"):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            getattr(Spring(p), method)(inside)
            Spring(p).omega(outside)  # which has no range
        with pytest.warns(UserWarning, match="at index 2: in 2 of 5 rows the force is extrapolated") as caught:
            getattr(Spring(p), method)(outside)
        assert [each.filename for each in caught] == [__file__]


@pytest.mark.parametrize("p", [SPRING.parameters, BRANCHED["second"]], ids=["plain", "second"])
def test_a_steady_loop_repeats(p: SpringParameters) -> None:
    low, high = along(p, [-0.4, 0.3]).tolist()
    path = np.tile([*np.linspace(low, high, 40), *np.linspace(high, low, 40)], 2)
    force = Spring(p).response(path, steady_start(p, high - low))
    assert force[80:] == pytest.approx(force[:80], abs=1e-12 * np.ptp(force))


# Resolution of the input

LOW, HIGH = SPRING.parameters.displacement_min, SPRING.parameters.displacement_max
RESOLUTION = 0.01 * (HIGH - LOW)
PATHS = arrays.arrays(np.float64, st.integers(2, 40), elements=st.floats(LOW, HIGH))
# One part in 1e9 of the force over the range: rounding of places between samples.
CLOSE = 1e-9 * float(np.ptp(SPRING.response([LOW, HIGH, LOW])))
few = settings(max_examples=40)


def resolved(path: FloatArray) -> FloatArray:
    found = np.empty_like(path)
    library().spring_resolved_path(path.size, address(path), RESOLUTION, address(found))
    return found


@few
@given(PATHS, arrays.arrays(np.float64, 30, elements=st.floats(-0.499, 0.499)))
def test_friction_keeps_within_the_resolution_and_turns_for_nothing_smaller(
    path: FloatArray, shares: FloatArray
) -> None:
    """Wherever the path has come to: on a stroke, behind a turning point, or catching up."""
    path = np.append(path, path[-1] + shares * RESOLUTION)
    found = resolved(path)
    assert np.abs(found - path).max() <= RESOLUTION * (1.0 + 1e-12)
    steps = np.diff(found[-shares.size - 1 :])
    assert (steps >= 0.0).all() or (steps <= 0.0).all()
    at, followed = resolution.start(float(path[0]), 0), []
    for displacement in path.tolist():
        at = resolution.resolve(at, displacement, RESOLUTION)
        followed.append(at.followed)
    assert followed == found.tolist()  # Python's, bit for bit


@pytest.mark.parametrize("p", [SPRING.parameters, *BRANCHED.values()], ids=["plain", *BRANCHED])
def test_monotone_motion_and_no_resolution_change_nothing(p: SpringParameters) -> None:
    one, path, time = Spring(p), np.linspace(LOW, HIGH, 50), np.linspace(0.0, 1.0, 50)
    assert one.response(path, 0.3, time, RESOLUTION) == pytest.approx(one.response(path, 0.3, time), rel=1e-12)
    back, times = np.append(path, path[::-1]), np.append(time, 1.0 + time)
    exact = one.response(back, 0.3, times)
    np.testing.assert_array_equal(one.response(back, 0.3, times, 0.0), exact)
    # From twice the resolution behind the turning point on, too.
    far = np.abs(back - HIGH) > 2.0 * RESOLUTION
    assert one.response(back, 0.3, times, RESOLUTION)[far] == pytest.approx(exact[far], abs=CLOSE)


@few
@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(-0.999, 0.999)), min_size=2, max_size=30))
def test_small_reversals_change_nothing_at_all(strokes: list[tuple[float, float]]) -> None:
    """At each turning point the displacement goes back by less than the resolution, and returns."""
    places, shares = np.array(strokes).T
    sides = (-1.0) ** np.arange(places.size)
    turns = 0.5 * (LOW + HIGH) + sides * (2.0 * RESOLUTION + places * (0.5 * (HIGH - LOW) - 2.0 * RESOLUTION))
    wiggles = -sides * np.abs(shares) * RESOLUTION
    wiggles[0] = 0.0  # which would be the first motion of all
    found = SPRING.response(np.stack([turns, turns + wiggles, turns], axis=1).ravel(), input_resolution=RESOLUTION)
    np.testing.assert_array_equal(found[::3], SPRING.response(turns, input_resolution=RESOLUTION))


@few
@given(PATHS, st.integers(2, 7))
def test_dividing_a_straight_motion_changes_nothing_and_the_force_does_not_jump(path: FloatArray, parts: int) -> None:
    fine = np.append(path[:1], path[:-1, None] + np.diff(path)[:, None] * np.linspace(0.0, 1.0, parts + 1)[1:])
    fine[::parts] = path  # to the bit
    found = SPRING.response(fine, input_resolution=RESOLUTION)
    assert found[::parts] == pytest.approx(SPRING.response(path, input_resolution=RESOLUTION), abs=1e3 * CLOSE)
    p = SPRING.parameters
    # FE' and twice the slope of friction just behind a turning point, generously.
    steepest = 3.0 * np.abs(SPRING.stiffness(np.linspace(LOW, HIGH, 400))).max() + 8.0 * p.sigma * p.rho * p.kappa_omega
    assert np.all(np.abs(np.diff(found)) <= steepest * np.abs(np.diff(fine)) + steepest * 1e-12 + CLOSE)
