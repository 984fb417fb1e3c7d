"""The classes of models that are compared: the spring's own, and six that others fit to such mounts.

Each class predicts a force

    r = FE(x) + sum of c_k * H_k(path; shape),

FE a polynomial of degree N, in which the coefficients of FE and the c_k are linear. A class is its shape parameters
with their bounds, and the columns H_k.

Lengths are in half ranges of the displacement, so that x = (displacement - offset)/half; s is the travel since the last
reversal, d = +-1 the direction.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...identification.least_squares.stages import N_BOUNDS, SIGMA_BOUNDS
from ...identification.points.polynomials import Basis
from ...identification.rig.other_mounts import stop_operators
from ...kernel.arrays import FloatArray
from ...kernel.generalised import generalised_path
from .track import Track

_STOPS = 8  # stop operators of the Prandtl-Ishlinskii model
# beta_1 to beta_6 of a generalised Bouc-Wen model from its psi in six phases (Song and Der Kiureghian 2006, fig. 2):
# loading on the right and on the left, unloading there, and recovery after the reversals on the right and on the left.
_PHASES = np.array([[1, 1, 1], [-1, 1, 1], [1, -1, -1], [-1, -1, -1], [1, -1, 1], [-1, 1, -1]], dtype=np.float64)
_BETA_OF_PSI = np.linalg.inv(
    np.stack(
        [
            _PHASES[:, 1] * _PHASES[:, 2],
            _PHASES[:, 0] * _PHASES[:, 1],
            _PHASES[:, 0] * _PHASES[:, 2],
            _PHASES[:, 1],
            _PHASES[:, 2],
            _PHASES[:, 0],
        ],
        axis=1,
    )
)
# Bounds of the knee of a stroke: the inverse of the length over which the force saturates, in half ranges.
KNEE = (0.3, 300.0)


@dataclass(frozen=True)
class Shape:
    """One shape parameter; it is searched on the scale given, uniformly at the start.

    Parameters
    ----------
    name : str
    low, high : float   Bounds.
    logarithmic : bool
    """

    name: str
    low: float
    high: float
    logarithmic: bool = True

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds on the scale of the search."""
        return (float(np.log(self.low)), float(np.log(self.high))) if self.logarithmic else (self.low, self.high)

    def value(self, searched: float) -> float:
        """The parameter at a point of the search."""
        return float(np.exp(searched)) if self.logarithmic else searched


class Rival(ABC):
    """One class of models; it holds nothing but its description.

    Attributes
    ----------
    name, title : str            Identifier, and name with its source.
    memory : tuple of Shape      The shape parameters but those of the polynomial factor, lengths in half ranges.
    has_amplifier : bool         Whether its hysteretic part has a polynomial factor, of degree M.
    is_nonnegative : bool        Whether the c_k must not be negative. The coefficients of the factor are then shape
                                 parameters, otherwise they are the c_k.
    needs_time : bool            Whether it depends on the rate.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    memory: ClassVar[tuple[Shape, ...]]
    has_amplifier: ClassVar[bool] = False
    is_nonnegative: ClassVar[bool] = True
    needs_time: ClassVar[bool] = False

    @abstractmethod
    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:
        """H_k at the points of a track for values of the shape parameters, shape (P, L)."""

    def shapes(self, basis: Basis) -> tuple[Shape, ...]:
        """All shape parameters."""
        factors = basis.amplifier if self.has_amplifier and self.is_nonnegative else 0
        return self.memory + tuple(Shape(f"amplifier {k + 1}", -0.9, 0.9, False) for k in range(factors))

    def dissipates(self, basis: Basis, values: FloatArray, coefficients: FloatArray) -> bool:
        """Whether the polynomial factor is positive over the range, with a margin for rounding."""
        if not self.has_amplifier:
            return True
        series = np.append(1.0, values[len(self.memory) :]) if self.is_nonnegative else coefficients
        grid = basis.offset + basis.half * np.linspace(-1.0, 1.0, 201)
        return bool(np.min(basis.columns(grid).amplifier @ series) > 1e-3 * abs(float(series[0])))


_SATURATION = (
    Shape("rho", *KNEE),
    Shape("recovery", 1e-3, 2.0 * SIGMA_BOUNDS[1] - 1.0),  # 2*sigma - 1
    Shape("n", *N_BOUNDS),
)


def _omega(track: Track, basis: Basis, values: FloatArray) -> FloatArray:
    rho, recovery, n = values
    return track.loops.omega(float(rho) / basis.half, 0.5 * (1.0 + float(recovery)), float(n))


class NormalizedRival(Rival):
    """r = FE + omega*(c_0 + c_1*x + ...), the modified normalized Bouc-Wen model of Zhao et al. 2013."""

    name = "normalized-bouc-wen"
    title = "modified normalized Bouc-Wen (this program's)"
    memory = _SATURATION
    has_amplifier = True
    is_nonnegative = False

    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:
        return _omega(track, basis, values)[:, None] * basis.columns(track.loops.displacement).amplifier


class ClassicRival(Rival):
    """r = FE + c*z with z of Bouc and Wen: omega with FA = 1."""

    name = "bouc-wen"
    title = "Bouc-Wen with polynomial elastic part"
    memory = _SATURATION

    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:
        return _omega(track, basis, values)[:, None]


class Bilinear(Rival):
    """r = FE + c*z, z elastic up to a threshold and constant beyond it: dry friction in series with a spring (Hu)."""

    name = "bilinear"
    title = "bilinear hysteretic with polynomial elastic part (Hu)"
    memory = (Shape("threshold", 1.0 / KNEE[1], 1.0 / KNEE[0]),)

    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:
        return stop_operators(track.loops, values * basis.half) / (values * basis.half)


class VelocityPower(Rival):
    """r = FE + c*|v|^p*sgn(v) + f*sgn(v) (Tinker and Cutchins 1992)."""

    name = "velocity-power"
    title = "nth-power velocity damping with Coulomb friction (Tinker and Cutchins)"
    needs_time = True
    memory = (Shape("exponent", 0.1, 4.0),)

    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:  # noqa: ARG002
        side = track.loops.side.astype(np.float64)
        return np.stack([side * track.speed ** float(values[0]), side], axis=1)


class GeneralisedBoucWen(Rival):
    """r = FE + c*z with six shape coefficients by the signs of x, dx and z (Song and Der Kiureghian 2006).

    The coefficients are searched as the values of psi that they give in the six phases: contrasts of the four in which
    |z| grows (by direction, by side and by their product), whose geometric mean the scale of z makes 1, and the two
    in which |z| falls.
    """

    name = "generalised-bouc-wen"
    title = "generalised Bouc-Wen, asymmetric (Song and Der Kiureghian)"
    memory = (
        _SATURATION[0],
        _SATURATION[2],
        *(Shape(of, 0.2, 5.0) for of in ("direction", "side", "product")),
        Shape("recovery right", _SATURATION[1].low, _SATURATION[1].high),
        Shape("recovery left", _SATURATION[1].low, _SATURATION[1].high),
    )

    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:
        rho, n, direction, side, product, right, left = values.tolist()
        psi = [
            direction * side * product,
            direction / side / product,
            side / direction / product,
            product / direction / side,
            -right,
            -left,
        ]
        beta = _BETA_OF_PSI @ np.array(psi)
        loops = track.loops
        z = np.empty(loops.travel.size)
        for strokes, points in loops.by_record:
            # The path goes through every reversal; where the points lie on it, their z is kept.
            stroke = np.arange(strokes.start, strokes.stop)
            at = np.searchsorted(loops.stroke[points], stroke, side="right")
            path = np.insert(loops.displacement[points], at, track.stroke_ends()[strokes])
            kept = np.insert(np.ones(loops.stroke[points].size, dtype=bool), at, False)
            path = (np.concatenate([loops.start[strokes][:1], path]) - basis.offset) / basis.half
            z[points] = generalised_path(path, rho, n, beta)[1:][kept]
        return z[:, None]


class VaianaRosati(Rival):
    """Each branch goes exponentially to its own limiting curve: the model of Vaiana and Rosati, algebraic.

        r = U(x) - [U(x_j) - r_j]*exp(-alpha_+*s)    loading,
        r = L(x) - [L(x_j) - r_j]*exp(-alpha_-*s)    unloading,

    x_j, r_j at the last reversal (N. Vaiana, Vaiana-Rosati Model, Analytical Formulation, report P1 of 9 July 2023,
    https://www.slideshare.net/NicolVaiana/vrm-afpdf). There U and L are each a line, an exponential and a sigmoid,

        k_b*x +- f_0 + beta_1*exp(beta_2*x) - beta_1 + 4*gamma_1/{1 + exp[-gamma_2*(x - gamma_3)]} - 2*gamma_1;

    here L = FE and U - L are polynomials, with degrees chosen as those of all other classes.
    """

    name = "vaiana-rosati"
    title = "Vaiana-Rosati, two branches with polynomial limits"
    has_amplifier = True
    is_nonnegative = False
    memory = (Shape("alpha loading", *KNEE), Shape("alpha unloading", *KNEE))

    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:
        loops = track.loops
        rising = loops.direction > 0
        decay = np.where(rising, values[0], values[1]) / basis.half
        terms = basis.columns(np.concatenate([loops.start, track.stroke_ends()])).amplifier
        at_start, at_end = terms[: loops.direction.size], terms[loops.direction.size :]
        # Response to a limiting curve that is a term of the polynomial when loading, and zero when unloading.
        limit_start, limit_end = rising[:, None] * at_start, rising[:, None] * at_end
        left = np.exp(-decay * loops.length)[:, None]
        begin = np.zeros_like(at_start)
        held = np.zeros(at_start.shape[1])
        for k in range(loops.direction.size):
            if k and loops.record[k] != loops.record[k - 1]:
                held = np.zeros(at_start.shape[1])
            begin[k] = held
            held = limit_end[k] - (limit_start[k] - held) * left[k]
        stroke = loops.stroke
        limit = rising[stroke, None] * basis.columns(loops.displacement).amplifier
        away = (limit_start - begin)[stroke]
        return np.asarray(limit - away * np.exp(-decay[stroke] * loops.travel)[:, None])


class PrandtlIshlinskii(Rival):
    """r = FE + FA*(sum of c_k*E_k), E_k stop operators of thresholds in geometric progression, c_k >= 0."""

    name = "prandtl-ishlinskii"
    title = f"Prandtl-Ishlinskii of {_STOPS} stop operators times polynomial"
    has_amplifier = True
    memory = (Shape("least threshold", 0.5 / KNEE[1], 0.1), Shape("ratio", 1.2, 4.0))

    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:
        thresholds = values[0] * values[1] ** np.arange(_STOPS) * basis.half
        terms = basis.columns(track.loops.displacement).amplifier
        amplifier = terms[:, 0] + terms[:, 1:] @ values[2:]
        return np.asarray(stop_operators(track.loops, thresholds) / thresholds * amplifier[:, None])


OWN: Rival = NormalizedRival()
RIVALS: tuple[Rival, ...] = (
    Bilinear(), VelocityPower(), ClassicRival(), GeneralisedBoucWen(), VaianaRosati(), PrandtlIshlinskii(),
)  # fmt: skip
