"""What the verdict says of errors on held-out strokes, and the plain models beside which it stands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
TIME = np.arange(1201) / 100.0  # twelve cycles
EQUAL = np.sin(2.0 * np.pi * TIME)
# Amplitudes fall, so that no held-out stroke goes beyond all others but the first, which is not fitted.
FALLING = (1.0 - TIME / 24.0) * EQUAL


def bouc_wen_and_dashpot(y: FloatArray) -> FloatArray:
    spring = SpringParameters((5.0, 4000.0), (1.0,), 30.0, 350.0, 1.3, 1.6, 0.0, -0.01, 0.01)
    return Spring(spring).response(0.01 * y) + 3.0 * np.gradient(y, TIME)


def stops_and_cubic(y: FloatArray) -> FloatArray:
    force = 20.0 * y + 15.0 * y**3
    for threshold in (0.05, 0.15, 0.4):
        state = 0.0
        for k, step in enumerate(np.diff(y), start=1):
            state = float(np.clip(state + step, -threshold, threshold))
            force[k] += 9.0 * state / threshold
    return force


def smooth_surface(y: FloatArray) -> FloatArray:
    v = np.cos(2.0 * np.pi * TIME)
    return np.asarray(20.0 * np.sin(2.0 * y) + 10.0 * np.tanh(2.0 * v) + 5.0 * y * v)


@pytest.mark.parametrize(
    ("name", "path", "law"),
    [
        ("Bouc-Wen with dashpot", FALLING, bouc_wen_and_dashpot), ("Prandtl-Ishlinskii", FALLING, stops_and_cubic),
        ("kernel regression", EQUAL, smooth_surface),
    ],
)  # fmt: skip
def test_a_plain_model_reaches_the_noise_on_its_own_class_and_sees_nothing_of_the_held_out_force(
    name: str, path: FloatArray, law: Callable[[FloatArray], FloatArray]
) -> None:
    force = law(path)
    force = force + NOISE * np.std(force) * np.random.default_rng(1).standard_normal(path.size)
    samples = Samples.of([Record(0.01 * path, force, TIME)], 900)
    left = np.sqrt(np.nanmean(held_out(samples)[name] ** 2, axis=1))
    # A mean of some neighbours has noise of its own; thresholds and the lag of the speed are not those of the data.
    assert np.median(left) < 1.25 * NOISE
    assert left.max() < 2.0 * NOISE
    at = samples.rows[samples.folds[0]]
    permuted = samples.force.copy()
    permuted[at] = np.random.default_rng(2).permutation(permuted[at])
    other = samples.on([Record(samples.displacement, permuted, TIME)])
    assert not np.array_equal(other.r, samples.r)
    np.testing.assert_array_equal(PLAIN_MODELS[name](other)[0], PLAIN_MODELS[name](samples)[0])
