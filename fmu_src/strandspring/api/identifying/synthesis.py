"""`synthesize`: records computed from a model, and those of the paper's simulated experiment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ...errors import OptionError
from ...findings import Finding, Outcome
from ...ground.arguments import numbers
from ...ground.options import changed, refuse_given, takes
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...peers.ni import PAPER_NI, sine_period, with_noise
from ...records.record import Record
from ..common.model_source import ModelSource, model_of
from ..common.record_findings import outside
from ..options import Sampling

NI = "ni"
_MOST_SAMPLES = 20_000_000
_OF_NI = ("cycles", "samples", "noise", "seed", "exponent")


@takes(sampling=Sampling)
def synthesize(model: ModelSource, amplitudes: ArrayLike | None = None, *, sampling: Sampling) -> Record:
    """The record of a model's spring under sinusoidal displacement, or the paper's simulated experiment.

    That is Ni's model in its steady state under x = X sin(t), paper eqs. (26)-(31). Its record holds whole periods
    without their closing sample; the periods before the steady state are omitted.

    Parameters
    ----------
    model : Spring, ModelFile or path, or "ni"   A model file, or an FMU that holds one; or the paper's experiment.
    amplitudes : float or array_like    Of the sines, one after the other [m]; that of the identified range if None. Of
                                        Ni's experiment X, at most 0.1 m; 5 mm if None.
    sampling : Sampling                 How the record is sampled and measured; or its fields as keywords.

    Returns
    -------
    Record   Its findings say the noise with its seed, and what lies outside the identified range.

    Raises
    ------
    ModelError    If the model is not a physically possible spring.
    ValueError    If a number is not possible, or the record would have more than 20000000 samples.
    OptionError   If an option does not apply.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, synthesize
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> record = synthesize(spring, amplitudes=[0.005, 0.02], noise=0.01, seed=7)
    >>> len(record), record.notes
    (6001, ('Noise level 0.01, seed 7.',))
    >>> clean = synthesize("ni", noise=0.0)
    >>> round(float((clean.force**2).mean() ** 0.5), 1)  # rms force [N], 248.2 in the paper's Table 1
    248.3
    """
    given = None if amplitudes is None else numbers("amplitudes", amplitudes, "m")
    if given is not None and not all(0.0 < reach < np.inf for reach in given or (0.0,)):
        raise OptionError(f"`amplitudes` must be finite and > 0 [m], got {amplitudes!r}.")
    if isinstance(model, str) and model == NI:
        return _ni(given, sampling)
    refuse_given(
        "{option} is of Ni's experiment, and {where} is given; leave it out.", "a model", exponent=sampling.exponent
    )
    content = model_of(model)
    p, cycles, noise = content.parameters, sampling.cycles or 3, sampling.noise or 0.0
    reaches = (0.5 * (p.displacement_max - p.displacement_min),) if given is None else given
    _refuse_too_many(len(reaches) * cycles * sampling.samples)
    centre = p.displacement_offset if sampling.mean is None else sampling.mean
    phase = np.arange(cycles * sampling.samples) / sampling.samples
    path = np.concatenate([*(centre + reach * np.sin(2.0 * np.pi * phase) for reach in reaches), [centre]])
    time = np.asarray(np.arange(path.size) / (sampling.samples * sampling.frequency), dtype=np.float64)
    force = _noisy(PathSolver(p).force(path, 0.0, time), noise, sampling.seed)
    force = force * (1.0 + sampling.drift * np.arange(path.size) / path.size)
    name = f"<{content.name}>"
    return Record(
        1e-3 * _quantised(1e3 * path, sampling.displacement_resolution / 1e-3),  # as it is read from a file in mm
        _quantised(force, sampling.force_resolution),
        time,
        path=name,
        findings=(*_noise(noise, sampling.seed), *outside("", path, p)),
    )


def _ni(amplitudes: tuple[float, ...] | None, sampling: Sampling) -> Record:
    """The paper's simulated experiment."""
    others = {name: value for name, value in changed(sampling).items() if name not in _OF_NI}
    refuse_given("{option} does not apply to {where}; leave it out.", "Ni's experiment", **others)
    (amplitude,) = amplitudes or (5e-3,)
    if amplitude > 0.1:
        raise OptionError(f"`amplitudes` must be one of at most 0.1 [m], got {amplitude!r}.")
    cycles, noise = sampling.cycles or 1, 0.03 if sampling.noise is None else sampling.noise
    _refuse_too_many(cycles * sampling.samples)
    spring = PAPER_NI if sampling.exponent is None else replace(PAPER_NI, n=sampling.exponent)
    path = sine_period(1e3 * amplitude, sampling.samples)
    force = np.tile(spring.steady_force(path), cycles)
    return Record(
        1e-3 * np.tile(path, cycles),
        _noisy(force, noise, sampling.seed),
        2.0 * np.pi * np.arange(force.size) / sampling.samples,
        path="<Ni's model>",
        findings=_noise(noise, sampling.seed),
    )


def _refuse_too_many(samples: int) -> None:
    if samples > _MOST_SAMPLES:
        raise OptionError(
            f"The record would have {samples} samples, more than {_MOST_SAMPLES}; use fewer cycles or samples."
        )


def _noisy(force: FloatArray, noise: float, seed: int) -> FloatArray:
    return with_noise(force, noise, seed) if noise > 0.0 else force


def _noise(noise: float, seed: int) -> tuple[Finding, ...]:
    return (Finding(Outcome.NOISE, {"noise": noise, "seed": seed}),) if noise > 0.0 else ()


def _quantised(values: FloatArray, step: float) -> FloatArray:
    return np.asarray(np.round(values / step) * step) if step > 0.0 else values
