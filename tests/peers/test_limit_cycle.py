"""Limit-cycle identification of the plain normalized Bouc-Wen model on data of known models."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring import NormalizedBoucWen
from strandspring.errors import RecordError
from strandspring.kernel.path import PathSolver
from strandspring.model.outcomes import IdentificationError, Outcome
from strandspring.peers.limit_cycle import limit_cycle

pytestmark = pytest.mark.slow

AMPLITUDE = 0.02  # [m]


def steady(model: NormalizedBoucWen, cycles: int = 1, samples: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [m] and force [N] of whole steady cycles, after three cycles that are left out."""
    path = AMPLITUDE * np.sin(2.0 * np.pi * np.arange((3 + cycles) * samples) / samples)
    force = PathSolver(model.to_parameters(-AMPLITUDE, AMPLITUDE)).force(path)
    return path[3 * samples :], force[3 * samples :]


def model_of(n: float = 1.0, sigma: float = 1.0, saturations: float = 8.0) -> NormalizedBoucWen:
    return NormalizedBoucWen(kappa_x=3e3, kappa_omega=40.0, rho=saturations / AMPLITUDE, sigma=sigma, n=n)


def errors(found: NormalizedBoucWen, model: NormalizedBoucWen) -> dict[str, float]:
    return {
        name: abs(getattr(found, name) / getattr(model, name) - 1.0)
        for name in ("kappa_x", "kappa_omega", "rho", "sigma", "n")
    }


@pytest.mark.parametrize("n", [0.5, 0.8, 1.0, 2.0, 5.0])
@pytest.mark.parametrize("sigma", [0.5, 3.0])
@pytest.mark.parametrize("saturations", [3.0, 30.0], ids=["gradual", "abrupt"])
def test_exact_cycles_give_the_model_back(n: float, sigma: float, saturations: float) -> None:
    model = model_of(n, sigma, saturations)
    wrong = errors(limit_cycle(*steady(model)), model)
    # The integrals take theta as straight between 2000 samples a cycle. Measured worst cases: the cusp at n = 0.5,
    # and a knee of few samples where the loop is abrupt.
    assert max(wrong["kappa_x"], wrong["kappa_omega"]) < 2e-3, wrong
    assert max(wrong["rho"], wrong["sigma"], wrong["n"]) < 8e-3, wrong


def test_finer_sampling_gives_smaller_errors() -> None:
    model = model_of(n=0.8, sigma=3.0)
    coarse, fine = (
        max(errors(limit_cycle(*steady(model, samples=samples)), model).values()) for samples in (500, 4000)
    )
    assert fine < 0.1 * coarse  # of order h^(1 + n) at the cusp, h^2 elsewhere: a factor 42 at least for small h


def test_a_loop_that_is_not_saturated_does() -> None:
    model = model_of(n=1.0, sigma=1.0, saturations=1.0)
    assert np.max(np.abs(PathSolver(model.to_parameters(-AMPLITUDE, AMPLITUDE)).omega(steady(model)[0]))) < 0.8
    assert max(errors(limit_cycle(*steady(model)), model).values()) < 5e-3


def test_the_centre_of_the_cycle_does_not_matter() -> None:
    displacement, force = steady(model_of())
    moved = limit_cycle(displacement + 0.3, force - 77.0)
    assert max(errors(moved, limit_cycle(displacement, force)).values()) < 1e-6  # rounding of 0.3 m


@pytest.mark.parametrize("n", [0.5, 1.0, 2.0])
def test_noise_is_averaged_over_the_whole_branch(n: float) -> None:
    model = model_of(n)
    displacement, force = steady(model, cycles=10, samples=1000)
    noise = 0.02 * model.kappa_omega * np.random.default_rng(5).standard_normal(force.size)
    wrong = errors(limit_cycle(displacement, force + noise), model)
    # Measured over six seeds: 0.1 % and 2.5 % at most.
    assert max(wrong["kappa_x"], wrong["kappa_omega"]) < 5e-3, wrong
    assert max(wrong["rho"], wrong["sigma"], wrong["n"]) < 0.05, wrong


def test_what_is_no_such_cycle_is_refused() -> None:
    displacement, force = steady(model_of())
    with pytest.raises(RecordError, match=r"loop\.csv.*symmetric"):
        limit_cycle(displacement, force + 2e5 * displacement**2, "loop.csv")
    with pytest.raises(RecordError, match="rise and fall once"):
        limit_cycle(displacement + 0.01 * np.sin(1.5 + 600.0 * displacement) * (force > 0.0), force)
    for outcome, wrong in (
        (Outcome.NO_LOOP, 3e3 * displacement),
        (Outcome.COLUMNS_SWAPPED, 6e3 * displacement - 0.1 * force),
        (Outcome.FORCE_REVERSED, force - 6e3 * displacement),
    ):
        with pytest.raises(IdentificationError) as refusal:
            limit_cycle(displacement, wrong)
        assert refusal.value.outcome is outcome
