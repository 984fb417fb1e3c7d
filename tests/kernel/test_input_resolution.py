"""Reversals below the resolution of a sensor: friction does not follow them, and nothing else changes."""

from __future__ import annotations

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from branched_springs import BRANCHED
from springs import EXAMPLES
from strandspring import Spring
from strandspring.kernel.arrays import address
from strandspring.kernel.library import library

FloatArray = NDArray[np.float64]

SPRING = Spring(EXAMPLES["stranded_wire"])
LOW, HIGH = SPRING.parameters.displacement_min, SPRING.parameters.displacement_max
RESOLUTION = 0.01 * (HIGH - LOW)
PATHS = arrays.arrays(np.float64, st.integers(2, 40), elements=st.floats(LOW, HIGH))
# One part in 1e9 of the force over the range: rounding of places between samples.
CLOSE = 1e-9 * float(np.ptp(SPRING.response([LOW, HIGH, LOW])))


def resolved(path: FloatArray, resolution: float = RESOLUTION) -> FloatArray:
    found = np.empty_like(path)
    library().spring_resolved_path(path.size, address(path), resolution, address(found))
    return found


@given(PATHS)
def test_friction_is_that_of_a_displacement_within_the_resolution(path: FloatArray) -> None:
    assert np.abs(resolved(path) - path).max() <= RESOLUTION * (1.0 + 1e-12)


@pytest.mark.parametrize("spring", [SPRING.parameters, *BRANCHED.values()], ids=["plain", *BRANCHED])
def test_monotone_motion_and_no_resolution_change_nothing(spring: object) -> None:
    one, path, time = Spring(spring), np.linspace(LOW, HIGH, 50), np.linspace(0.0, 1.0, 50)  # type: ignore[arg-type]
    expected = one.response(path, 0.3, time)
    np.testing.assert_allclose(one.response(path, 0.3, time, RESOLUTION), expected, rtol=1e-12)
    back = np.append(path, path[::-1])
    times = np.append(time, 1.0 + time)
    np.testing.assert_array_equal(one.response(back, 0.3, times, 0.0), one.response(back, 0.3, times))
    # From twice the resolution behind the turning point on, too.
    far = np.abs(back - HIGH) > 2.0 * RESOLUTION
    found, exact = one.response(back, 0.3, times, RESOLUTION)[far], one.response(back, 0.3, times)[far]
    np.testing.assert_allclose(found, exact, atol=CLOSE)


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(-0.999, 0.999)), min_size=2, max_size=30))
def test_small_reversals_change_nothing_at_all(strokes: list[tuple[float, float]]) -> None:
    """At each turning point the displacement goes back by less than the resolution, and returns."""
    places, shares = np.array(strokes).T
    sides = (-1.0) ** np.arange(places.size)
    middle, half = 0.5 * (LOW + HIGH), 0.5 * (HIGH - LOW)
    turns = middle + sides * (2.0 * RESOLUTION + places * (half - 2.0 * RESOLUTION))
    wiggles = -sides * np.abs(shares) * RESOLUTION
    wiggles[0] = 0.0  # which would be the first motion of all
    found = SPRING.response(np.stack([turns, turns + wiggles, turns], axis=1).ravel(), input_resolution=RESOLUTION)
    np.testing.assert_array_equal(found[::3], SPRING.response(turns, input_resolution=RESOLUTION))


@given(PATHS, arrays.arrays(np.float64, 30, elements=st.floats(-0.499, 0.499)))
def test_friction_never_turns_within_the_resolution(path: FloatArray, shares: FloatArray) -> None:
    """Wherever the path has come to: on a stroke, behind a turning point, or catching up."""
    found = resolved(np.append(path, path[-1] + shares * RESOLUTION))
    steps = np.diff(found[path.size - 1 :])
    assert (steps >= 0.0).all() or (steps <= 0.0).all()


@given(PATHS, st.integers(2, 7))
def test_it_does_not_matter_how_a_straight_motion_is_divided(path: FloatArray, parts: int) -> None:
    shares = np.linspace(0.0, 1.0, parts + 1)[1:]
    between = (path[:-1, None] + np.diff(path)[:, None] * shares).ravel()
    fine = np.append(path[:1], between)
    fine[::parts] = path  # to the bit
    found = SPRING.response(fine, input_resolution=RESOLUTION)[::parts]
    np.testing.assert_allclose(found, SPRING.response(path, input_resolution=RESOLUTION), atol=1e3 * CLOSE)


@settings(max_examples=30)
@given(PATHS)
def test_the_force_does_not_jump(path: FloatArray) -> None:
    fine = np.interp(np.linspace(0.0, path.size - 1.0, 200 * path.size), np.arange(path.size), path)
    found = SPRING.response(fine, input_resolution=RESOLUTION)
    p = SPRING.parameters
    # FE' and twice the slope of friction just behind a turning point, generously.
    steepest = 3.0 * np.abs(SPRING.stiffness(np.linspace(LOW, HIGH, 400))).max() + 8.0 * p.sigma * p.rho * p.kappa_omega
    assert np.abs(np.diff(found)).max() <= steepest * np.abs(np.diff(fine)).max() + CLOSE


def test_noise_of_a_sensor_is_not_taken_for_friction() -> None:
    """A slow sine with the last digit of a sensor: without the option its steps drive small loops."""
    middle, amplitude = 0.5 * (LOW + HIGH), 0.4 * (HIGH - LOW)
    smooth = middle + amplitude * np.sin(np.linspace(0.0, 6.0 * np.pi, 30_000))
    digit = 0.1 * RESOLUTION
    noisy = smooth + digit * np.random.default_rng(3).uniform(-0.5, 0.5, smooth.size)
    exact = SPRING.response(smooth)
    errors = [np.std(SPRING.response(noisy, input_resolution=d) - exact) for d in (0.0, digit)]
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize("value", [-1e-6, np.nan, np.inf])
def test_what_is_none_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="`input_resolution` must be finite and >= 0"):
        SPRING.response([0.0, 0.001], input_resolution=value)
