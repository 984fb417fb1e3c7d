"""What the verdict says of errors on held-out strokes, and the plain models beside which it stands."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomllib

from strandspring import Outcome, Record, Spring, SpringParameters, identify
from strandspring.identification.plain_models import PLAIN_MODELS, held_out
from strandspring.identification.samples import FloatArray, Samples
from strandspring.identification.verdict import Verdict
from synthetic import record_of, sine, spring_of

CASES = tomllib.loads(Path(__file__).with_name("verdicts.toml").read_text("utf-8"))
STEPS = 200  # in a cycle


def record(amplitudes: Sequence[float], cycles: int = 3, loop: float = 0.5, noise: float = 0.0) -> Samples:
    """Cycles at 0.1 Hz of these amplitudes [mm]; the force leads, so that a loop opens."""
    phase = np.arange(cycles * STEPS) * 2.0 * np.pi / STEPS
    path = np.concatenate([*(amplitude * np.sin(phase) for amplitude in amplitudes), [0.0]])
    ahead = np.concatenate([*(amplitude * np.cos(phase) for amplitude in amplitudes), [amplitudes[-1]]])
    force = path + loop * ahead
    force += noise * np.std(force) * np.random.default_rng(0).standard_normal(path.size)
    return Samples.of([Record(1e-3 * path, force, np.arange(path.size) * 10.0 / STEPS)], 900)


def errors(samples: Samples, size: float | FloatArray) -> FloatArray:
    """Random residuals of this size, shape (F, P)."""
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (len(samples.folds), samples.x.size))
    return np.where(np.array(samples.folds), size * signs, np.nan)


def on_short_strokes(samples: Samples) -> FloatArray:
    stroke = np.searchsorted(samples.strokes[:, 0], samples.rows, side="right") - 1
    length = np.abs(np.diff(samples.displacement[samples.strokes], axis=1))[:, 0]
    return np.where((length < 0.007)[stroke], 2.5, 1.0)


@pytest.mark.parametrize(("made", "size", "plain", "sentence"), CASES["sentences"])
def test_sentences(made: dict[str, Any], size: float, plain: float, sentence: str) -> None:
    samples = record(**made)
    others = {"one": errors(samples, plain), "other": errors(samples, 3.0)}
    own = errors(samples, size if size > 0.0 else -size * on_short_strokes(samples))
    verdict = str(Verdict.of(samples, own, others))
    assert verdict.startswith(sentence)
    assert ("; not at 3 mm, 0.1 Hz: " in verdict) is (size < 0.0)


def test_the_first_line_of_an_identification_is_its_verdict() -> None:
    path = sine(6, 1800)
    good = identify(record_of(spring_of(1.0, 1.0), path, noise=0.01))
    assert str(good.verdict).startswith("usable: 1 % on held-out strokes")  # the noise
    assert str(good.verdict) in good.summary().splitlines()[0]
    assert good.verdict.whole.error < 1.05 * min(good.verdict.whole.plain.values(), default=np.inf)
    # A force of which two thirds come from nothing that the displacement shows.
    wild = record_of(spring_of(1.0, 1.0), path).force
    wild = wild + 30.0 * np.repeat(np.random.default_rng(0).standard_normal(60), 30)
    bad = identify(Record(path, wild), save_anyway=True)
    assert str(bad.verdict).startswith("not usable: ")
    assert Outcome.LACK_OF_FIT in bad.outcomes


# -- plain models

NOISE = 0.02  # of the force's deviation


def test_plain_models_reach_the_noise_where_they_can_and_see_nothing_of_the_held_out_force() -> None:
    """Of a spring with a dashpot, which is the class of the first one; amplitudes fall."""
    time = np.arange(1201) / 100.0  # twelve cycles
    path = 0.01 * (1.0 - time / 24.0) * np.sin(2.0 * np.pi * time)
    spring = SpringParameters((5.0, 4000.0), (1.0,), 30.0, 350.0, 1.3, 1.6, 0.0, -0.01, 0.01)
    force = Spring(spring).response(path) + 300.0 * np.gradient(path, time)
    force = force + NOISE * np.std(force) * np.random.default_rng(1).standard_normal(path.size)
    samples = Samples.of([Record(path, force, time)], 900)
    left = {name: np.sqrt(np.nanmean(each**2, axis=1)) for name, each in held_out(samples).items()}
    at = samples.rows[samples.folds[0]]
    permuted = samples.force.copy()
    permuted[at] = np.random.default_rng(2).permutation(permuted[at])
    other = samples.on([Record(samples.displacement, permuted, time)])
    assert not np.array_equal(other.r, samples.r)
    # Thresholds are not those of the spring, and a mean of some neighbours has noise of its own.
    for name, most in (("Bouc-Wen with dashpot", 1.25), ("Prandtl-Ishlinskii", 4.0), ("kernel regression", 4.0)):
        assert np.median(left[name]) < most * NOISE, name
        np.testing.assert_array_equal(PLAIN_MODELS[name](other)[0], PLAIN_MODELS[name](samples)[0])
