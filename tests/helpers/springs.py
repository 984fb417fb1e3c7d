"""Springs, displacement paths and an independent force for the tests of the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from strandspring import SpringParameters

FloatArray = NDArray[np.float64]

# A hardening, asymmetric mount of a few kilograms.
MOUNT = SpringParameters(
    (50.0, 20_000.0, 1e5, 2e7), (1.0, 10.0, 100.0), 15.0, 400.0, 1.0, 0.5, 0.05, 0.02, 0.08
)  # fmt: skip


def spring(
    n: float,
    sigma: float,
    saturations: float,
    elastic: tuple[float, ...] = (0.5, 8.0, 1.0, 3.0),
    amplifier: tuple[float, ...] = (0.3, -0.2, 0.1),
    kappa_omega: float = 25.0,
    middle: float = 0.05,
    half: float = 0.02,
) -> SpringParameters:
    """A spring by what makes sense of it, with y = (displacement - middle)/half in [-1, 1] over the range.

    Parameters
    ----------
    saturations : float   rho*half: how often half the range saturates the spring.
    elastic : tuple       FE/kappa_omega = sum(elastic[i]*y**i).
    amplifier : tuple     FA = 1 + sum(amplifier[i]*y**(i + 1)); positive where the absolute values sum below 1.
    """
    return SpringParameters(
        kE=tuple(kappa_omega * c / half**i for i, c in enumerate(elastic)),
        kA=(1.0, *(c / half ** (i + 1) for i, c in enumerate(amplifier))),
        kappa_omega=kappa_omega,
        rho=saturations / half,
        sigma=sigma,
        n=n,
        displacement_offset=middle,
        displacement_min=middle - half,
        displacement_max=middle + half,
    )


# Smoothness from cusp to corner, recovery from linear to abrupt, amplifiers of either skew.
EXAMPLES = {
    "wire_rope": spring(n=0.22, sigma=3.0, saturations=20.0),
    "stranded_wire": spring(n=0.6, sigma=1.4, saturations=4.0, amplifier=(-0.5, 0.3)),
    "exponential": spring(n=1.0, sigma=1.0, saturations=8.0),
    "hardening": spring(n=2.0, sigma=0.5, saturations=2.0, elastic=(0.0, 4.0, 0.0, 9.0), amplifier=(0.6,)),
    "dry_friction": spring(n=8.0, sigma=10.0, saturations=30.0, elastic=(0.0, 1.0), amplifier=()),
}


# Asymmetric, with a kink, on knots that are not equally far apart.
_PLACES = np.array([-1.0, -0.83, -0.6, -0.42, -0.1, 0.05, 0.33, 0.5, 0.77, 1.0])
_SHAPE = 40.0 * _PLACES + 25.0 * np.tanh(5.0 * _PLACES) + 180.0 * np.maximum(_PLACES - 0.4, 0.0)
TABLE = replace(
    EXAMPLES["stranded_wire"], kE=(), FE_knots=tuple(0.05 + 0.02 * _PLACES), FE_forces=tuple(12.0 + _SHAPE),
    displacement_min=float(0.05 + 0.02 * _PLACES[0]), displacement_max=float(0.05 + 0.02 * _PLACES[-1]),
    displacement_offset=0.047,
)  # fmt: skip

EXAMPLES["table"] = TABLE


def along(parameters: SpringParameters, fractions: ArrayLike) -> FloatArray:
    """Displacements [m] at fractions of the range: -1 is its lower end, 1 its upper end."""
    middle = 0.5 * (parameters.displacement_min + parameters.displacement_max)
    half = 0.5 * (parameters.displacement_max - parameters.displacement_min)
    return middle + half * np.asarray(fractions, dtype=np.float64)


def force_by_definition(parameters: SpringParameters, displacement: FloatArray, omega: ArrayLike) -> FloatArray:
    """Paper eq. (10), with FE along its tangent and FA held outside the range [N]."""
    from oracles import OracleSpring  # which programs that only want the springs do not find

    return OracleSpring(parameters.as_dict()).force_at(displacement, omega)


def force_scale(parameters: SpringParameters, displacement: FloatArray) -> float:
    """Largest force the spring could show along the path [N]; errors are measured in it."""
    return max(float(np.abs(force_by_definition(parameters, displacement, omega)).max()) for omega in (-1.0, 0.0, 1.0))


def energy_scale(parameters: SpringParameters, displacement: FloatArray) -> float:
    """Force scale times the way travelled [J]; the 1e-300 lets a path that stands still divide."""
    return force_scale(parameters, displacement) * float(np.sum(np.abs(np.diff(displacement)))) + 1e-300


@st.composite
def springs(draw: st.DrawFn) -> SpringParameters:
    """Any physically possible spring in the range of n and sigma for which the design asks accuracy."""
    weights = draw(st.lists(st.floats(-1.0, 1.0), max_size=4))
    share = draw(st.floats(0.0, 0.95)) / max(1.0, sum(map(abs, weights)))
    return spring(
        n=10.0 ** draw(st.floats(-1.3, 1.3)),
        sigma=0.5 + draw(st.sampled_from([0.0, 0.05, 0.5, 2.5, 49.5])),
        saturations=10.0 ** draw(st.floats(-1.0, 2.0)),
        elastic=tuple(draw(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=5))),
        amplifier=tuple(share * w for w in weights),
        kappa_omega=draw(st.sampled_from([1e-3, 25.0, 1e6])),
        middle=draw(st.sampled_from([0.0, -0.3, 0.05])),
        half=draw(st.sampled_from([1e-4, 0.02, 3.0])),
    )


def fractions(minimum: int = 1, maximum: int = 25, reach: float = 1.3) -> st.SearchStrategy[list[float]]:
    """Sample positions of a path for `along`; beyond +-1 it leaves the identified range."""
    return st.lists(st.floats(-reach, reach), min_size=minimum, max_size=maximum)


def omegas() -> st.SearchStrategy[float]:
    """Where a path may start."""
    return st.sampled_from([-1.0, -0.4, 0.0, 1e-9, 0.7, 1.0])
