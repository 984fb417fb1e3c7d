"""What a plan knows, against the formulas written out: derivatives, forces of a wider class, and covariances."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from branched_springs import BRANCHED
from springs import EXAMPLES
from strandspring import Spring
from strandspring.campaigns.planning.blocks import Range
from strandspring.campaigns.planning.forces import _RELAXATION, _THRESHOLDS, force_along
from strandspring.campaigns.planning.knowledge import Knowledge, Noise
from strandspring.campaigns.planning.limits import Limits
from strandspring.campaigns.planning.motion import Leg, Motion, Pace
from strandspring.model.joint import JointCovariance

SPAN = Range(0.05, 0.02)  # of the springs of EXAMPLES
PERIOD = 4.0
LIMITS = Limits(1.0)


def motion(*shares: float, duration: float = 1.0) -> Motion:
    legs = [Leg(SPAN.at(a), SPAN.at(b), duration, 0.2) for a, b in pairwise(shares)]
    return Motion.along(legs, 0.01)


@pytest.mark.parametrize("name", ["stranded_wire", "exponential", "table", "second", "branches", "both"])
def test_own_columns_are_derivatives_of_the_force(name: str) -> None:
    spring = (EXAMPLES | BRANCHED)[name]
    path = motion(0.0, 0.9, -0.7, 0.3, -0.2, 0.8)
    force = force_along(spring, path, SPAN, PERIOD)
    assert force.value == pytest.approx(Spring(spring).response(path.displacement, time=path.time), rel=1e-12)
    elastic = [0.02**-k for k in range(len(spring.kE))] or [1.0] * len(spring.FE_forces)
    of_second = [0.1 * 0.02**-k for k in range(1, len(spring.second.kA))] + [0.1] * 4 if spring.second else []
    further = [*of_second, *[0.1, 0.1] * len(spring.branches)]
    sizes = [*elastic, *further, *[0.1 * 0.02**-k for k in range(1, len(spring.kA))], *[0.1] * 4]
    count = force.own.shape[1]
    joint = JointCovariance(tuple(tuple(float(j == k) * sizes[k] for j in range(k + 1)) for k in range(count)))
    for k in range(count):
        step = 1e-4 * np.eye(count)[k]
        moved = [Spring(joint.moved(spring, (side * step).tolist())) for side in (1.0, -1.0)]
        ends = [end.response(path.displacement, time=path.time) for end in moved]
        difference = (ends[0] - ends[1]) / (2e-4 * sizes[k])
        # Differences of steps of 1e-5 of a logarithm: rounding of 1e-11 of the force, which is 100 times some columns.
        assert force.own[:, k] == pytest.approx(difference, rel=1e-5, abs=1e-6 * np.abs(force.own[:, k]).max())


def test_stops_yield_where_they_say() -> None:
    path = motion(0.0, 1.0, -1.0, 0.2)
    force = force_along(EXAMPLES["stranded_wire"], path, SPAN, PERIOD)
    for k, share in enumerate(_THRESHOLDS):
        state = 0.0
        for step, column in zip(np.diff(path.displacement) / (SPAN.half * share), force.wider[1:, k], strict=True):
            state = min(max(state + step, -1.0), 1.0)
            assert column == pytest.approx(state, abs=1e-12)


def test_branches_relax_as_their_differential_equation() -> None:
    legs = [Leg(SPAN.at(0.0), SPAN.at(1.0), 1.0, 0.2), Leg(SPAN.at(1.0), SPAN.at(1.0), 2.0)]
    path = Motion.along(legs, 0.01)
    force = force_along(EXAMPLES["stranded_wire"], path, SPAN, PERIOD)
    for k, share in enumerate(_RELAXATION, start=-len(_RELAXATION)):
        slopes = np.diff(path.displacement / SPAN.half) / np.diff(path.time)

        def relax(t: float, r: np.ndarray, slopes: np.ndarray = slopes, share: float = share) -> np.ndarray:
            return slopes[min(np.searchsorted(path.time[1:], t), slopes.size - 1)] - r / (share * PERIOD)

        found = solve_ivp(relax, (0.0, 3.0), [0.0], t_eval=path.time, max_step=0.002, rtol=1e-8, atol=1e-10)
        # Steps of the solver go over the kinks of the path: 0.002 s times a change of the slope.
        assert force.wider[:, k] == pytest.approx(found.y[0], abs=2e-3)


def test_what_recorded_loops_tell_is_the_bayesian_posterior() -> None:
    """With the errors that a fit along the same loops states, and next to no prior of the own coefficients."""
    spring = EXAMPLES["exponential"]
    path = motion(0.0, *[1.0, -1.0] * 4, duration=2.0)
    noise = Noise(0.1)
    force = force_along(spring, path, SPAN, PERIOD)
    weights = noise.weights(path, force)[:, None]
    own, wider = weights * force.own, weights * force.wider
    root = np.linalg.cholesky(np.linalg.inv(own.T @ own))
    known = Knowledge.before(spring, noise, root, force, path, is_recorded=True, rates=False)
    unseen = Knowledge.before(spring, noise, root, force, path, is_recorded=False, rates=False)
    p = len(root)
    # The prior is wider where records have narrowed it, by one factor but for the branches.
    deviations = np.diag(unseen.root[p:, p:]).copy()
    deviations[: -force.relaxing] *= 0.5 / 0.15
    columns = np.hstack([own, wider])
    information = columns.T @ columns + np.diag(np.concatenate([np.zeros(p), deviations**-2.0]))
    scale = np.sqrt(np.diag(information))
    expected = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    found = known.root @ known.root.T
    sizes = np.sqrt(np.diag(expected))
    # Both sides lose digits by the condition of the columns, some 1e8.
    assert found / np.outer(sizes, sizes) == pytest.approx(expected / np.outer(sizes, sizes), abs=1e-5)


def test_information_narrows_as_the_formula_says() -> None:
    spring = EXAMPLES["exponential"]
    path = motion(0.0, 1.0, -1.0, 0.0)
    noise = Noise(0.5, relative=0.01, correlated=3.0)
    force = force_along(spring, path, SPAN, PERIOD)
    root = np.diag([1.0, 100.0, 1e3, 1e5, *[0.1 / 0.02**k for k in (1, 2, 3)], 0.3, 0.3, 0.3, 0.3])
    known = Knowledge.before(spring, noise, root, force, path, is_recorded=False, rates=True)
    after = known.after(*known.gained(path, force))
    gradient = np.eye(len(root))[-4:]
    _, deviations = after.deviations(np.zeros((1, len(known.root))), gradient)
    weighted = noise.weights(path, force, is_own=True)[:, None] * force.own
    covariance = np.linalg.inv(np.linalg.inv(root @ root) + weighted.T @ weighted)
    assert deviations == pytest.approx(np.sqrt(np.diag(covariance))[-4:], rel=1e-6)
    # Points stand for samples: at most one independent one each, of three that are alike.
    assert np.sum(noise.weights(path, force, is_own=True) ** 2 * (0.25 + (0.01 * force.value) ** 2)) == pytest.approx(
        np.minimum(path.samples / 3.0, 1.0).sum()
    )


def test_strokes_keep_the_pace() -> None:
    pace = Pace.over(0.04, 0.1, LIMITS)
    assert pace.leg(0.03, 0.07).velocity == pytest.approx(0.1, rel=0.01)  # whole samples of 5 ms
    slow = pace.times(0.1)
    assert slow.leg(0.03, 0.07).velocity == pytest.approx(0.01, rel=0.01)
    assert slow.leg(0.03, 0.07).ramp == pytest.approx(pace.leg(0.03, 0.07).ramp, rel=0.02)
