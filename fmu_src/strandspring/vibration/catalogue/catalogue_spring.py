"""A spring from what a catalogue states: stiffness or static curve, and damping, at one amplitude.

A catalogue gives two figures of one loop, and the spring has exactly these. What it does not give is the shape of the
loop, which is set by convention: n = 1, sigma = 1/2, FA = 1, and friction that builds up over 1/rho, a fifth of the
stated amplitude A, unless the stiffness of small vibration is stated too, which then decides rho.

With z = rho*A, the steady loop between -A and A (paper eq. 22) turns at omega = w, is 2*m*kappa high in its middle and
absorbs the energy e*kappa*A:

    w = 1 - W0(exp(1 - 2*z))       from u = -w: u = rho*s - w up to 0, then u = 1 - exp(w - rho*s), u = w at s = 2*A
    m = z - w, and 1 - exp(w - z) where z > w
    e = (2/z)*(2*z - 2*w - w^2/2)

where W0 is Lambert's function. K, the stiffness of the loop, is the force between the ends of the loop over 2*A; the
loss factor is eta = (energy per cycle)/(pi*K*A^2), twice the damping ratio. With S, the same stiffness of FE alone:

    K = S + kappa*w/A,    kappa = eta*pi*K*A/e    or, of a loop whose middle has the share q of its height, q*K*A/m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import lambertw

from ...core.parameters import SpringParameters
from ...core.spline import Elastic
from ...errors import MountedSystemError
from .static_curve import Curve, knots_of, with_origin

_BUILDUP = 0.2  # of the amplitude, over which friction builds up where no catalogue says so: 1/rho
_LEAST_Z, _LARGEST_Z = 1.0, 1000.0
_GRID = 200  # values of z among which the least stiffness of small vibration is looked for
_ROUNDING = 1e-9  # of the stroke


@dataclass(frozen=True)
class CatalogueValues:
    """What a catalogue states of one spring along one axis; one of the stiffnesses, and one of the dampings.

    Parameters
    ----------
    amplitude : float              Of the loop whose stiffness and damping are stated [m].
    stroke : tuple of float        Least and largest deflection [m].
    stiffness : float or None      Force between the ends of the loop over twice the amplitude [N/m].
    curve : sequence of tuple      Instead: static deflections [m] and forces [N], the middle of the loop.
    is_symmetric : bool            Whether the curve is the same, with opposite sign, in the other sense.
    about : float                  Deflection in the middle of the loop [m].
    loss_factor : float or None    Energy per cycle over pi*stiffness*amplitude^2.
    loop_width : float or None     Force between the branches in the middle of the loop [N].
    loop_share : float or None     The same over the force between the ends of the loop.
    vibration_stiffness : float or None   Of small vibration [N/m].
    """

    amplitude: float
    stroke: tuple[float, float]
    stiffness: float | None = None
    curve: Curve = ()
    is_symmetric: bool = False
    about: float = 0.0
    loss_factor: float | None = None
    loop_width: float | None = None
    loop_share: float | None = None
    vibration_stiffness: float | None = None


def spring_from_catalogue(values: CatalogueValues) -> SpringParameters:
    """The spring of which the loop at the stated amplitude has the stated stiffness and damping.

    Its identified range is the stroke, and its displacement the deflection.

    Raises
    ------
    MountedSystemError   If no such spring is possible; the message names neither file nor field.
    """
    if (values.stiffness is None) == (not values.curve):
        raise MountedSystemError("must have either `stiffness` or `curve`; give one of them.")
    if [values.loss_factor, values.loop_width, values.loop_share].count(None) != 2:
        raise MountedSystemError(
            "must have one of `loss_factor`, `damping_ratio` and `loop_width`; give the one stated."
        )
    _check_stroke(values)
    try:
        # Friction and, without a curve, FE are still those of no spring.
        draft = _with_elastic_force(values)
        z = 1.0 / _BUILDUP if values.vibration_stiffness is None else _saturation(values, draft)
        return _solved(values, draft, _SteadyLoop(z))
    except MountedSystemError:  # a ValueError, too
        raise
    except ValueError as problem:
        raise MountedSystemError(f"these values make no spring, correct them: {problem}") from None


@dataclass(frozen=True)
class _SteadyLoop:
    """The steady loop of omega for n = 1 and sigma = 1/2, by z = rho*amplitude."""

    z: float

    @property
    def turn(self) -> float:
        """omega where the loop turns, w."""
        return 1.0 - float(lambertw(math.exp(1.0 - 2.0 * self.z)).real)

    @property
    def middle(self) -> float:
        """omega in the middle of the rising branch, m."""
        past = self.z - self.turn
        return past if past < 0.0 else -math.expm1(-past)

    @property
    def energy(self) -> float:
        """Absorbed in one cycle over kappa_omega*amplitude, e."""
        w = self.turn
        return 2.0 / self.z * (2.0 * self.z - 2.0 * w - 0.5 * w * w)


def _check_stroke(values: CatalogueValues) -> None:
    low, high = values.stroke
    if not low <= 0.0 <= high:
        raise MountedSystemError(
            f"`stroke` must hold 0 mm, where the mount is free, got {1e3 * low:.6g} to {1e3 * high:.6g} mm."
        )
    slack = _ROUNDING * (high - low)
    if not (low - slack <= values.about - values.amplitude and values.about + values.amplitude <= high + slack):
        raise MountedSystemError(
            f"`amplitude` must leave the loop within the stroke of {1e3 * low:.6g} to {1e3 * high:.6g} mm, got "
            f"{1e3 * values.amplitude:.6g} mm about {1e3 * values.about:.6g} mm; give the amplitude at which stiffness "
            "and damping are stated, and in `about` the deflection about which, such as that under the static load."
        )


def _with_elastic_force(values: CatalogueValues) -> SpringParameters:
    """A spring with the stroke, and FE where a curve gives it."""
    low, high = values.stroke
    draft = SpringParameters(
        (0.0, values.stiffness or 1.0), (1.0,), 1.0, 1.0 / values.amplitude, 0.5, 1.0, 0.0, low, high
    )
    if not values.curve:
        return draft
    points = with_origin(values.curve, values.is_symmetric)
    if low < points[0][0] or points[-1][0] < high:
        raise MountedSystemError(
            f"`stroke` must lie within `curve`, {1e3 * points[0][0]:.6g} to {1e3 * points[-1][0]:.6g} mm, got "
            f"{1e3 * low:.6g} to {1e3 * high:.6g} mm; give points of the other sense, too, or `symmetric = true`, or a "
            "stroke of two ends."
        )
    knots, forces = knots_of(points, low, high)
    return replace(draft, kE=(), FE_knots=knots, FE_forces=forces)


def _saturation(values: CatalogueValues, draft: SpringParameters) -> float:
    """z of the stated stiffness of small vibration."""
    wanted = values.vibration_stiffness or 0.0

    def excess(z: float) -> float:
        spring = _solved(values, draft, _SteadyLoop(z))
        return Elastic(spring).slope(values.about) + spring.kappa_omega * spring.rho - wanted

    grid, excesses = np.geomspace(_LEAST_Z, _LARGEST_Z, _GRID).tolist(), []
    for z in grid:
        try:
            excesses.append(excess(z))
        except MountedSystemError:  # at small z no friction has such a loss
            excesses.append(math.inf)
    lowest = int(np.argmin(excesses))
    if not excesses[lowest] <= 0.0 <= excesses[-1] < math.inf:
        ends = [f"{1e-3 * (value + wanted):.4g}" for value in (excesses[lowest], excesses[-1])]
        raise MountedSystemError(
            f"`vibration_stiffness` must be within {ends[0]} to {ends[1]} N/mm for friction with this damping, got "
            f"{1e-3 * wanted:.6g} N/mm; leave it out, and the program assumes one."
        )
    return float(brentq(excess, grid[lowest], grid[-1], rtol=1e-14))


def _solved(values: CatalogueValues, draft: SpringParameters, loop: _SteadyLoop) -> SpringParameters:
    """The spring whose loop has the stated stiffness and damping."""
    amplitude = values.amplitude
    # kappa_omega = fixed + per_stiffness*K.
    fixed, per_stiffness = 0.0, 0.0
    if values.loss_factor is not None:
        per_stiffness = math.pi * values.loss_factor * amplitude / loop.energy
    elif values.loop_share is not None:
        per_stiffness = values.loop_share * amplitude / loop.middle
    else:
        fixed = 0.5 * (values.loop_width or 0.0) / loop.middle
    left = 1.0 - per_stiffness * loop.turn / amplitude  # of K for FE
    if values.stiffness is not None:
        kappa = fixed + per_stiffness * values.stiffness
        elastic_stiffness = values.stiffness - kappa * loop.turn / amplitude
        spring = replace(draft, kE=(0.0, elastic_stiffness))
    else:
        elastic = Elastic(draft)
        ends = [elastic.force(values.about + side * amplitude) for side in (-1.0, 1.0)]
        elastic_stiffness = 0.5 * (ends[1] - ends[0]) / amplitude
        kappa = (fixed + per_stiffness * elastic_stiffness) / left if left > 0.0 else math.inf
        spring = draft
    if not (left > 0.0 and elastic_stiffness > 0.0):
        most = loop.energy / (math.pi * loop.turn)
        raise MountedSystemError(
            f"the damping must be less: friction can have a loss factor up to {most:.3g} (damping ratio "
            f"{0.5 * most:.3g}) at this amplitude; give a smaller one, and the rest as `damping` of a viscous damper."
        )
    return replace(spring, kappa_omega=kappa, rho=loop.z / amplitude)
