"""Records of hard numbers end in a spring or in words; `fuzz/targets/identify.py` makes more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from strandspring import IdentificationError, Outcome, Record, RecordError, RefinedOptions, TwoStageOptions, identify
from strandspring.errors import ModelError
from strandspring.model.joint import JointCovariance, joint_names
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of

OWN = record_of(spring_of(1.0, 1.0), sine())


@pytest.mark.parametrize(("strokes", "samples"), [(3, 7), (3, 8), (4, 5), (3, 13)])
def test_few_samples_make_a_spring(strokes: int, samples: int) -> None:
    corners = np.interp(
        np.linspace(0.0, strokes, strokes * samples + 1), range(strokes + 1), np.resize([-1.0, 1.0], strokes + 1)
    )
    found = identify(record_of(spring_of(1.0, 1.0), MEAN + AMPLITUDE * corners, 0.01))
    assert found.rnl > 0.9


@pytest.mark.parametrize("options", [RefinedOptions(), TwoStageOptions((1, 0))])
@pytest.mark.parametrize("samples", [200, 2000])
@pytest.mark.parametrize(("stiffness", "friction"), [(10.0, 0.5), (1e4, 5e3), (1.0, 20.0)])
def test_dry_friction_that_switches_between_two_samples_is_found(
    stiffness: float, friction: float, samples: int, options: RefinedOptions | TwoStageOptions
) -> None:
    """In the search it switches within a hundredth of the amplitude at least."""
    phase = np.linspace(0.0, 20.0, samples)
    record = Record(0.004 * np.sin(phase), stiffness * np.sin(phase) + friction * np.sign(np.cos(phase)))
    # It is missed altogether in the sample after each of the 6 reversals, and in no other.
    assert identify(record, options).rmse <= max(2.0 * friction * np.sqrt(6.0 / samples), 0.2 * friction)


@pytest.mark.parametrize("scale", [1e-200, 1e-100, 1e-31, 1e31, 1e100, 1e200])
def test_absurd_sizes_and_times_are_refused(scale: float) -> None:
    with pytest.raises(RecordError, match="check its unit"):
        identify(Record(scale * OWN.displacement, scale * OWN.force))
    with pytest.raises(RecordError, match="`time` must be within"):
        replace(OWN, time=1e300 ** np.sign(np.log(scale)) * np.arange(len(OWN)))


@pytest.mark.parametrize("scale", [1e-6, 1e5])
def test_the_unit_of_length_and_force_changes_nothing_else(scale: float) -> None:
    found, usual = (identify(Record(s * OWN.displacement, s**2 * OWN.force)).parameters for s in (scale, 1.0))
    # Sums are rounded otherwise.
    assert (scale * found.rho, found.sigma, found.n) == pytest.approx((usual.rho, usual.sigma, usual.n), rel=1e-4)
    assert found.kappa_omega == pytest.approx(scale**2 * usual.kappa_omega, rel=1e-4)


@pytest.mark.parametrize(("length", "force", "shift"), [(1e-14, 1, 0), (1, 1e-20, 0), (1, 1e20, 0), (1, 1, 1e14)])
def test_a_spring_beyond_the_limits_is_refused_in_words(length: float, force: float, shift: float) -> None:
    far = Record(length * OWN.displacement + shift * np.ptp(OWN.displacement), force * OWN.force)
    with pytest.raises(IdentificationError) as refused:
        identify(far, RefinedOptions(degrees=(1, 0)))
    assert refused.value.outcome in (Outcome.BEYOND_LIMITS, Outcome.UNDERSAMPLED)


@pytest.mark.parametrize("place", [0, 2, 3])
def test_absurd_standard_deviations_are_refused(place: int) -> None:
    p = replace(spring_of(1.0, 1.0), kE=(0.0, 1000.0), kA=(1.0, 0.0))
    deviations = np.full(7, 0.1)
    deviations[place] = 1e200
    root = [[*[0.0] * k, float(deviation)] for k, deviation in enumerate(deviations)]
    with pytest.raises(ModelError, match="standard deviations of at most 1e"):
        JointCovariance.from_uncertainty(p, {"joint": {"parameters": joint_names("kE", 2, 1), "root": root}})
