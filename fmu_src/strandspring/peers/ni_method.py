"""Ni's method for Ni's model: Levenberg-Marquardt, as a trust region, on the force's Fourier coefficients (section 4).

The method needs one steady period (or several) and start values. In every iteration the response predicted for
the period is transformed by FFT and its complex coefficients are compared with those of the measured force; by
Parseval's theorem that is a least-squares fit over the samples.

Two choices the paper leaves open. The optimizer varies ln(eta), ln(theta + lambda), ln(sigma - 1/2) and ln(n) in
place of eta, theta, lambda and n, so that no step leaves the physically possible models (sigma >= 1/2), for which
alone the response has its closed form; sigma and n stop at the ends of the closed form's range, and a step to a
saturation that no double holds is refused like any step that worsens the fit. And of B and C only C*ln(B) is
varied, by changing C, since the force depends on nothing else.

As a method of `identify` the model becomes a spring of this package: r = F2*(F1 + Z) is the modified normalized
Bouc-Wen model with FE = F2*F1 and kappa_omega*FA = z0*F2, which are fitted by polynomials over the record's range.

Units are those of `strandspring.peers.ni`: mm and N.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..core.parameters import N_RANGE, SIGMA_RANGE
from ..errors import RecordError
from ..identification.least_squares.stages import Backbone, Hysteresis
from ..identification.methods.fitted import Fitted, fitted
from ..identification.methods.method import Method
from ..identification.points.polynomials import Basis
from ..identification.points.sample_points import SamplePoints
from ..identification.points.steady_part import SteadyRecord
from ..identification.search.solution import Solution
from ..kernel.arrays import FloatArray
from ..loops.noise_levels import noise_level
from ..model.outcomes import IdentificationError, Outcome
from .ni import NiParameters
from .periods import Periods, one_record, whole_periods

_MOST_DRAWS = 1000  # of random start values
_MAX_STEPS = 500  # of the optimizer, refused ones included
# A sum of squares that improves by less than this share says nothing more about the parameters: with K samples,
# one standard error changes it by 1/K.
_FTOL = 1e-6
_XTOL = _GTOL = 1e-8
_DIFFERENCE = 1e-6  # step of the forward differences in the logarithms
_LARGEST_LOG_EXCESS = math.log(SIGMA_RANGE[1] - 0.501)
_LOG_N = (math.log(N_RANGE[0]), math.log(N_RANGE[1]))
_FAR_OFF = 1e3  # a refused step counts as a prediction this many times the force away
_LEFT_OVER = 1.2  # misfit that is more than noise, share of the noise...
_SHAPE = 0.01  # ...or of the rms force, whichever is larger
_DEGREES = (8, 6)  # of the polynomials that stand for Ni's exponential
_SAMPLES = 400  # of the range at which they are fitted
_MILLIMETRE = 1e-3


class NiOutcome(Enum):
    """How Ni's method ended; the value is the sentence for the user."""

    CONVERGED = "Ni's method converged, and its residuals are the record's noise."
    LOCAL_MINIMUM = (
        "Ni's method converged, but its residuals exceed the record's noise: the start values led it to a local "
        "minimum, or Ni's model does not describe this spring; try other start values or another method."
    )
    OUT_OF_STEPS = (
        f"Ni's method did not converge within its {_MAX_STEPS} steps; try other start values or another method."
    )


@dataclass(frozen=True)
class NiResult:
    """Result of Ni's method.

    Attributes
    ----------
    parameters : NiParameters
    rmse : float              Of the steady force against the mean period of the record [N].
    outcome : NiOutcome
    """

    parameters: NiParameters
    rmse: float
    outcome: NiOutcome


def ni_method(
    displacement: ArrayLike, force: ArrayLike, start: NiParameters, time: ArrayLike | None = None
) -> NiResult:
    """Fit Ni's model to a periodic record.

    Parameters
    ----------
    displacement, force : array_like, shape (K,)   Whole steady periods, from the neutral position [mm], [N].
    start : NiParameters                           Start values: exact, a guess or `plausible_start`.
    time : array_like, shape (K,), or None         [s]; None if the samples are uniform in time.

    Returns
    -------
    NiResult

    Raises
    ------
    RecordError   If the record holds no whole periods.
    """
    from scipy.optimize import least_squares  # slow to import, and only identification needs it

    periods = whole_periods(displacement, force, time)
    problem = _FourierProblem(periods, start)
    # Not "lm", MINPACK's: its last bits vary where the Jacobian is nearly singular, and the minimum it finds with them.
    fit = least_squares(
        problem.misfit, _to_vector(start), jac=problem.jacobian, method="trf", x_scale="jac", max_nfev=_MAX_STEPS,
        xtol=_XTOL, ftol=_FTOL, gtol=_GTOL,
    )  # fmt: skip
    parameters = _from_vector(fit.x, start)
    measured = periods.mean_force
    rmse = float(np.sqrt(np.mean((parameters.steady_force(periods.displacement) - measured) ** 2)))
    if fit.status == 0:
        outcome = NiOutcome.OUT_OF_STEPS
    elif rmse > max(_LEFT_OVER * _noise(periods), _SHAPE * float(np.sqrt(np.mean(measured**2)))):
        outcome = NiOutcome.LOCAL_MINIMUM
    else:
        outcome = NiOutcome.CONVERGED
    return NiResult(parameters, rmse, outcome)


def plausible_start(displacement: ArrayLike, force: ArrayLike) -> NiParameters:
    """Start values of the right order for a record, from its secant stiffness and the height of its loop [mm], [N]."""
    periods = whole_periods(displacement, force)
    x, r = periods.displacement, periods.mean_force
    reach = 0.5 * float(np.ptp(x))
    stiffness = float(np.ptp(r)) / (2.0 * reach)
    # The area of the loop, as that of a parallelogram of this half height [N].
    height = max(abs(float(np.sum(r * (np.roll(x, -1) - np.roll(x, 1))))) / (8.0 * reach), 1e-3 * float(np.ptp(r)))
    rho, sigma, n = 5.0 / reach, 0.75, 0.5
    total = rho * height / height**n  # theta + lambda, from eta = rho*z0
    return NiParameters(
        K1=0.5 * stiffness, K2=0.1 * stiffness / reach, K3=0.1 * stiffness / reach**2, B=math.e, C=0.1 / reach,
        eta=rho * height, theta=(1.0 - sigma) * total, lambda_=sigma * total, n=n,
    )  # fmt: skip


def random_start(generator: np.random.Generator, scale: NiParameters) -> NiParameters:
    """Start values of which each is that of `scale` times a factor, log-uniform in [1/10, 10].

    Draws that are not physically possible are drawn again. B stays, since C carries the one number of the amplifier.

    Raises
    ------
    ValueError   If none of a thousand draws is possible.
    """
    names = ("K1", "K2", "K3", "C", "eta", "theta", "lambda_", "n")
    for _ in range(_MOST_DRAWS):
        factors = (10.0 ** generator.uniform(-1.0, 1.0, len(names))).tolist()
        drawn = {name: getattr(scale, name) * factor for name, factor in zip(names, factors, strict=True)}
        try:
            return replace(scale, **drawn)
        except ValueError:
            continue
    raise ValueError(f"no parameters within a factor of ten of {scale} are physically possible; give others.")


def _noise(periods: Periods) -> float:
    """rms noise of the mean period [N]; multiplicative noise counts by its mean square, not by its median."""
    difference = np.diff(periods.mean_force, 4) / math.sqrt(70.0)
    return max(noise_level(periods.mean_force), float(np.sqrt(np.mean(difference**2))))


def _to_vector(p: NiParameters) -> FloatArray:
    # sigma = 1/2 itself lies at -infinity.
    excess = math.log(max(p.sigma - 0.5, 1e-6))
    return np.array([p.K1, p.K2, p.K3, p.growth, math.log(p.eta), math.log(p.theta + p.lambda_), excess, math.log(p.n)])


def _from_vector(vector: FloatArray, start: NiParameters) -> NiParameters:
    """The parameters of a vector; B is the start's, unless that is 1 and cannot carry any growth."""
    K1, K2, K3, growth, log_eta, log_total, log_excess, log_n = vector.tolist()
    B = start.B if start.B != 1.0 else math.e
    try:
        eta, total = math.exp(log_eta), math.exp(log_total)
    except OverflowError:
        raise ValueError("the parameters overflow.") from None
    lambda_ = total * (0.5 + math.exp(min(log_excess, _LARGEST_LOG_EXCESS)))
    n = float(np.clip(np.exp(np.clip(log_n, *_LOG_N)), *N_RANGE))
    return NiParameters(K1, K2, K3, B, growth / math.log(B), eta, min(total - lambda_, lambda_), lambda_, n)


class _FourierProblem:
    """Misfit of the Fourier coefficients and its Jacobian, as real numbers."""

    def __init__(self, periods: Periods, start: NiParameters) -> None:
        self._x = periods.displacement
        self._start = start
        size = self._x.size
        # Parseval: harmonics between 0 and the Nyquist frequency stand for two coefficients each.
        weight = np.full(size // 2 + 1, math.sqrt(2.0) / size)
        weight[0] = 1.0 / size
        if size % 2 == 0:
            weight[-1] = 1.0 / size
        self._weight = weight
        self._measured = self._coefficients(periods.mean_force)
        self._refused = np.full_like(self._measured, _FAR_OFF * max(float(np.abs(self._measured).max()), 1e-300))

    def misfit(self, vector: FloatArray) -> FloatArray:
        """Predicted minus measured coefficients [N]; far off where the model has no response."""
        try:
            parameters = _from_vector(vector, self._start)
        except ValueError:
            return self._refused
        with np.errstate(over="ignore", invalid="ignore"):
            predicted = self._coefficients(parameters.steady_force(self._x))
        return predicted - self._measured if np.isfinite(predicted).all() else self._refused

    def jacobian(self, vector: FloatArray) -> FloatArray:
        """Exact for K1, K2, K3 and the growth, forward differences of Z for the other four, shape (R, 8)."""
        parameters = _from_vector(vector, self._start)
        x, amplifier = self._x, parameters.amplifier(self._x)
        Z = parameters.steady_hysteretic(x)
        columns = [amplifier * x, amplifier * np.abs(x) * x, amplifier * x**3]
        columns.append(x * amplifier * (Z + parameters.elastic(x)))
        for k in range(4, vector.size):
            moved = vector.copy()
            moved[k] += _DIFFERENCE
            columns.append(amplifier * (self._hysteretic(moved, Z) - Z) / _DIFFERENCE)
        return np.stack([self._coefficients(column) for column in columns], axis=1)

    def _hysteretic(self, vector: FloatArray, at_the_edge: FloatArray) -> FloatArray:
        try:
            return _from_vector(vector, self._start).steady_hysteretic(self._x)
        except ValueError:
            return at_the_edge

    def _coefficients(self, force: FloatArray) -> FloatArray:
        spectrum = np.fft.rfft(force) * self._weight
        return np.concatenate([spectrum.real, spectrum.imag])


@dataclass(frozen=True)
class NiOptions(Method):
    """Options of Ni's method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; (8, 6) if None.
    start : NiParameters or None   Start values; read off the record's secant stiffness and loop area if None.
    """

    name: ClassVar[str] = "ni"

    start: NiParameters | None = None

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Ni's method on one periodic record.

        Raises
        ------
        RecordError           If there are several records, or the record does not hold a whole period.
        IdentificationError   If it is not described by Ni's model about its neutral position.
        """
        record, loops = one_record(parts, where, "Ni's method"), parts[0].loops
        # Ni's model has its neutral position at zero; the middle of the stroke stands for it.
        low, high = loops.reach
        x = record.displacement / _MILLIMETRE - 0.5 * (low + high) / _MILLIMETRE
        try:
            start = self.start or plausible_start(x, record.force)
            result = ni_method(x, record.force, start, time=record.time)
        except ValueError as problem:
            raise RecordError(f"{where}: {problem}") from None
        if result.outcome is NiOutcome.OUT_OF_STEPS:
            raise IdentificationError(Outcome.NOT_CONVERGED, where)
        p = result.parameters
        basis = Basis(low, high, *(self.degrees or _DEGREES))
        hysteresis = Hysteresis(p.rho / _MILLIMETRE, p.sigma, p.n)
        backbone = _backbone(p, basis, loops)
        omega = loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n)
        cautions = [Outcome.NI_MODEL] if result.outcome is NiOutcome.LOCAL_MINIMUM else []
        return fitted(loops, Solution(basis, backbone, hysteresis, omega, 0.0), where, cautions)


def _backbone(p: NiParameters, basis: Basis, loops: SamplePoints) -> Backbone:
    """Polynomials for FE = F2*F1 and G = z0*F2 over the range."""
    grid = basis.offset + basis.half * np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
    columns_E, columns_A = basis.columns(grid)
    x = (grid - basis.offset) / _MILLIMETRE
    elastic = np.linalg.lstsq(columns_E, p.amplifier(x) * p.elastic(x), rcond=None)[0]
    amplified = np.linalg.lstsq(columns_A, p.z0 * p.amplifier(x), rcond=None)[0]
    return Backbone.from_coefficients(np.concatenate([elastic, amplified]), basis.columns(loops.displacement))
