"""`synthesize` and `synthesize_ni`: records computed from a model, and those of the paper's simulated experiment."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ...findings import Finding, Outcome
from ...ground.arguments import number, numbers, seed_of, whole
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...peers.ni import PAPER_NI, sine_period, with_noise
from ...records.record import Record
from ..common.model_source import ModelSource, model_of
from ..common.record_findings import outside

_MOST_SAMPLES = 20_000_000


def synthesize(
    model: ModelSource,
    amplitudes: ArrayLike | None = None,
    *,
    mean: float | None = None,
    cycles: int = 3,
    samples: int = 1000,
    frequency: float = 1.0,
    noise: float = 0.0,
    seed: int = 0,
    drift: float = 0.0,
    displacement_resolution: float = 0.0,
    force_resolution: float = 0.0,
) -> Record:
    """The record of a model's spring under sinusoidal displacement.

    Parameters
    ----------
    model : Spring, ModelFile or path   A model file, or an FMU that holds one.
    amplitudes : float or array_like    Of the sines, one after the other [m]; that of the identified range if None.
    mean : float or None                Mean displacement [m]; the model's offset if None.
    cycles, samples : int               Cycles of each amplitude, and samples of each cycle.
    frequency : float                   Of the times [Hz]; the force does not depend on it.
    noise : float                       eps of the force r*(1 + eps*R), R standard normal (paper eq. 31).
    seed : int                          Of the noise.
    drift : float                       Relative growth of the force from the first sample to the last.
    displacement_resolution, force_resolution : float   Of the sensors [m], [N]; 0 for all digits.

    Returns
    -------
    Record   Its findings say the noise with its seed, and what lies outside the identified range.

    Raises
    ------
    ModelError   If the model is not a physically possible spring.
    ValueError   If a number is not possible, or the record would have more than 20000000 samples.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, synthesize
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> record = synthesize(spring, amplitudes=[0.005, 0.02], noise=0.01, seed=7)
    >>> len(record), record.notes
    (6001, ('Noise level 0.01, seed 7.',))
    """
    content = model_of(model)
    p = content.parameters
    whole_range = 0.5 * (p.displacement_max - p.displacement_min)
    reaches = (whole_range,) if amplitudes is None else numbers("amplitudes", amplitudes, "m")
    for reach in reaches or (0.0,):
        _checked("amplitudes", reach, "> 0 [m]", lambda value: value > 0.0)
    frequency = _checked("frequency", frequency, "> 0 [Hz]", lambda value: value > 0.0)
    noise = _checked_not_negative("noise", noise)
    displacement_resolution = _checked_not_negative("displacement_resolution", displacement_resolution)
    force_resolution = _checked_not_negative("force_resolution", force_resolution)
    drift = _checked("drift", drift, "finite")
    seed = seed_of(seed)
    _refuse_impossible(cycles, samples, len(reaches))
    centre = p.displacement_offset if mean is None else _checked("mean", mean, "finite [m]")
    phase = np.arange(cycles * samples) / samples
    path = np.concatenate([*(centre + reach * np.sin(2.0 * np.pi * phase) for reach in reaches), [centre]])
    time = np.asarray(np.arange(path.size) / (samples * frequency), dtype=np.float64)
    force = _noisy(PathSolver(p).force(path, 0.0, time), noise, seed)
    force = force * (1.0 + drift * np.arange(path.size) / path.size)
    name = f"<{content.name}>"
    return Record(
        1e-3 * _quantised(1e3 * path, displacement_resolution / 1e-3),  # as it is read from a file in mm
        _quantised(force, force_resolution),
        time,
        path=name,
        findings=(*_noise(noise, seed), *outside("", path, p)),
    )


def synthesize_ni(
    amplitude: float = 5e-3,
    exponent: float = PAPER_NI.n,
    cycles: int = 1,
    samples: int = 1000,
    noise: float = 0.03,
    seed: int = 0,
) -> Record:
    """The paper's simulated experiment: Ni's model in its steady state under x = X sin(t), paper eqs. (26)-(31).

    The record holds whole periods without their closing sample; the periods before the steady state are omitted.

    Parameters
    ----------
    amplitude : float       X [m], > 0 and at most 0.1.
    exponent : float        n of eq. (29), which the paper does not print.
    cycles, samples : int   Periods, and samples of each.
    noise : float           eps of the force r*(1 + eps*R), R standard normal (paper eq. 31).
    seed : int              Of the noise.

    Returns
    -------
    Record

    Raises
    ------
    ValueError   If a number is not possible, or the record would have more than 20000000 samples.

    Examples
    --------
    >>> from strandspring import synthesize_ni
    >>> clean = synthesize_ni(noise=0.0)
    >>> round(float((clean.force**2).mean() ** 0.5), 1)  # rms force [N], 248.2 in the paper's Table 1
    248.3
    """
    amplitude = _checked("amplitude", amplitude, "> 0 and at most 0.1 [m]", lambda value: 0.0 < value <= 0.1)
    exponent = _checked("exponent", exponent, "finite")
    noise = _checked_not_negative("noise", noise)
    seed = seed_of(seed)
    _refuse_impossible(cycles, samples, 1)
    path = sine_period(1e3 * amplitude, samples)
    force = np.tile(replace(PAPER_NI, n=exponent).steady_force(path), cycles)
    return Record(
        1e-3 * np.tile(path, cycles),
        _noisy(force, noise, seed),
        2.0 * np.pi * np.arange(force.size) / samples,
        path="<Ni's model>",
        findings=_noise(noise, seed),
    )


def _checked(name: str, value: float, condition: str, holds: Callable[[float], bool] = lambda _: True) -> float:
    checked = number(name, value)
    if not (math.isfinite(checked) and holds(checked)):
        raise ValueError(f"`{name}` must be {condition}, got {value!r}.")
    return checked


def _checked_not_negative(name: str, value: float) -> float:
    return _checked(name, value, ">= 0", lambda checked: checked >= 0.0)


def _refuse_impossible(cycles: int, samples: int, amplitudes: int) -> None:
    cycles, samples = whole("cycles", cycles), whole("samples", samples)
    for name, count, least in (("cycles", cycles, 1), ("samples", samples, 8)):
        if count < least:
            raise ValueError(f"`{name}` must be at least {least}, got {count!r}.")
    if amplitudes * cycles * samples > _MOST_SAMPLES:
        raise ValueError(
            f"The record would have {amplitudes * cycles * samples} samples, more than {_MOST_SAMPLES}; use fewer "
            "cycles or samples."
        )


def _noisy(force: FloatArray, noise: float, seed: int) -> FloatArray:
    return with_noise(force, noise, seed) if noise > 0.0 else force


def _noise(noise: float, seed: int) -> tuple[Finding, ...]:
    return (Finding(Outcome.NOISE, {"noise": noise, "seed": seed}),) if noise > 0.0 else ()


def _quantised(values: FloatArray, step: float) -> FloatArray:
    return np.asarray(np.round(values / step) * step) if step > 0.0 else values
