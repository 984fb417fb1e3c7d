"""What is known before a test: by a model file, by records, or by a rough stiffness and stroke."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import ModelError, OptionError
from ...kernel.arrays import FloatArray
from ...model.joint import JointCovariance, names_of
from ...model.modelfile import ModelFile
from ...model.stated_cautions import stated_amplitudes
from ...model.stated_figures import stated_fit
from .knowledge import Noise

_FORCES = (1e-9, 1e12)  # at the ends of a rough stroke [N]
_DRAWN = 3  # springs beside the identified one
_ROUGH = 6  # springs for a rough stiffness
_SEED = 0
_NOISE = 0.005  # of the force, where nothing says it, share of half the range of FE
_FRICTION = (0.05, 0.4)  # kappa_omega over half the range of FE, likewise
_SATURATIONS = (4.0, 40.0)  # rho times half the range
_SIGMA = (0.5, 4.0)
_N = (0.3, 4.0)
_SHAPE = 0.15  # standard deviation of coefficients of FE and FA at the end of the range, share of the force there
_STIFFNESS = 0.2  # the same of the stiffness
_LOGARITHMS = (0.6, 0.6, 0.5, 0.6)  # of kappa_omega, rho, sigma and n
_OF_BRANCH = (0.6, 0.7)  # of stiffness and time constant of a branch
_LARGEST = 1.0  # standard deviation of a coefficient from a file: beyond, nothing is linear


@dataclass(frozen=True, eq=False)
class Prior:
    """Springs that are possible before the test, with the covariance about each.

    Attributes
    ----------
    springs : tuple of SpringParameters
    roots : tuple of ndarray, shape (P, P)   Of the covariance of the own coefficients of each.
    noise : Noise
    amplitudes : tuple of float   Of the loops that were recorded [m]; empty without records.
    rates : bool                  Whether several rates were recorded.
    velocity : float or None      Of the strokes recorded [m/s].
    name : str                    What the plan is for, in words.
    """

    springs: tuple[SpringParameters, ...]
    roots: tuple[FloatArray, ...]
    noise: Noise
    amplitudes: tuple[float, ...]
    rates: bool
    velocity: float | None
    name: str


def prior_of_model(model: ModelFile, rates: bool = False, velocity: float | None = None) -> Prior:
    """Of a model file: its joint covariance if it holds one, else widely about its spring.

    Parameters
    ----------
    model : ModelFile
    rates : bool              Whether its records hold several rates, which the file does not say.
    velocity : float or None  Of their strokes [m/s].

    """
    spring = model.parameters
    rates = rates or bool(spring.branches)  # which are found at several rates only
    half = 0.5 * (spring.displacement_max - spring.displacement_min)
    amplitudes = tuple(value for value in stated_amplitudes(model) if value <= 1.5 * half)
    noise = _noise(model)
    joint = JointCovariance.from_uncertainty(spring, model.uncertainty)
    if joint is None:
        return Prior((spring,), (_wide(spring),), noise, amplitudes, rates, velocity, model.name)
    springs = [spring]
    with suppress(ModelError):
        drawable = JointCovariance.to_draw_from(spring, model.uncertainty)
        springs += [drawable.draw(spring, _SEED, number) for number in range(_DRAWN)]
    root = np.zeros((len(joint.root), len(joint.root)))
    for row, values in zip(root, joint.root, strict=True):
        row[: len(values)] = values
    wide = _wide(spring)
    for k, name in enumerate(names_of(spring)):
        size = float(np.linalg.norm(root[k]))
        if name.startswith("ln ") and size == 0.0:
            root[k, k] = wide[k, k]  # what ended at a bound has no standard error, and is not known for that
        elif name.startswith("ln "):
            root[k] *= min(1.0, _LARGEST / size)
    return Prior(
        tuple(springs), (root,) * len(springs), noise, amplitudes or (half,), rates, velocity, model.name
    )  # fmt: skip


def prior_of_stiffness(stiffness: float, low: float, high: float) -> Prior:
    """Of a rough stiffness [N/m] and stroke [m]: springs drawn over the class.

    Raises
    ------
    OptionError   If no spring has this stiffness and stroke.
    """
    half = 0.5 * (high - low)
    force = stiffness * half
    if not _FORCES[0] <= force <= _FORCES[1]:
        raise OptionError(
            f"A stiffness of {stiffness:.4g} N/m over a stroke of {2.0 * half:.4g} m makes a force of {force:.3g} N, "
            f"which must be within {_FORCES[0]:g} and {_FORCES[1]:g} N; check both and their units."
        )
    generator = np.random.default_rng(_SEED)

    def between(ends: tuple[float, float]) -> float:
        return float(np.exp(generator.uniform(*np.log(ends))))

    springs = []
    for _ in range(_ROUGH):
        shape = np.array([0.0, 1.0, generator.uniform(-0.2, 0.2), generator.uniform(0.0, 0.5)])
        springs.append(
            SpringParameters(
                kE=tuple(force * shape / half ** np.arange(4)),
                kA=(1.0, generator.uniform(-0.3, 0.3) / half, generator.uniform(-0.2, 0.3) / half**2),
                kappa_omega=force * between(_FRICTION),
                rho=between(_SATURATIONS) / half,
                sigma=between(_SIGMA),
                n=between(_N),
                displacement_offset=0.5 * (low + high),
                displacement_min=low,
                displacement_max=high,
            )
        )
    name = f"a stiffness of {stiffness / 1e3:.4g} N/mm over {2e3 * half:.4g} mm"
    noise = Noise(_NOISE * force)
    return Prior(tuple(springs), tuple(map(_wide, springs)), noise, (), False, None, name)


def _wide(spring: SpringParameters) -> FloatArray:
    """Root of a wide covariance of the own coefficients."""
    half = 0.5 * (spring.displacement_max - spring.displacement_min)
    force = _half_range(spring)
    if spring.kE:
        elastic = [_SHAPE * force / half**k for k in range(len(spring.kE))]
        elastic[1:2] = [_STIFFNESS * force / half] * len(elastic[1:2])
    else:
        elastic = [_SHAPE * force] * len(spring.FE_forces)
    further = [_SHAPE / half**k for k in range(1, len(spring.second.kA))] + [*_LOGARITHMS] if spring.second else []
    further += [*_OF_BRANCH] * len(spring.branches)
    amplifier = [_SHAPE / half**k for k in range(1, len(spring.kA))]
    return np.diag([*elastic, *further, *amplifier, *_LOGARITHMS])


def _half_range(spring: SpringParameters) -> float:
    """Half the range of FE, at least kappa_omega [N]."""
    if spring.FE_forces:
        size = 0.5 * float(np.ptp(spring.FE_forces))
    else:
        places = np.linspace(spring.x_min, spring.x_max, 33)
        size = 0.5 * float(np.ptp(np.polynomial.polynomial.polyval(places, spring.kE)))
    return max(size, spring.kappa_omega)


def _noise(model: ModelFile) -> Noise:
    """Errors of the force as the file states them, else such as usual."""
    known = model.uncertainty
    correlated = known.get("autocorrelation_time")
    time = max(float(correlated), 1.0) if isinstance(correlated, int | float) else 1.0
    interval = known.get("prediction_interval")
    if interval is not None and interval["additive"] > 0.0:
        return Noise(float(interval["additive"]), float(interval["relative"]), time)
    fit = stated_fit(model)
    return Noise((fit and fit.alone["rmse"]) or _NOISE * _half_range(model.parameters), correlated=time)
