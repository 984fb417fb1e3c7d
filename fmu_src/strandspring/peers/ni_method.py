"""Ni's method for Ni's model: least squares of the force's Fourier coefficients from start values (section 4).

The response predicted for a steady period is transformed by FFT, and its complex coefficients are compared with those
of the measured force; by Parseval's theorem that is a least-squares fit over the samples.

Two choices the paper leaves open. The optimizer, Levenberg-Marquardt as a trust region, varies ln(eta), ln(theta +
lambda), ln(sigma - 1/2) and ln(n) in place of eta, theta, lambda and n, so that no step leaves the models with sigma >=
1/2, for which alone the response has its closed form; a step to a saturation that no double holds is refused like any
step that worsens the fit. And of B and C only C*ln(B) is varied, since the force depends on nothing else.

As a method of `identify` the model becomes a spring of this package: r = F2*(F1 + Z) is the modified normalized
Bouc-Wen model with FE = F2*F1 and kappa_omega*FA = z0*F2, which are fitted by polynomials over the record's range.

Units are those of `strandspring.peers.ni`: mm and N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike

from ..core.parameters import N_RANGE, SIGMA_RANGE
from ..errors import RecordError
from ..identification.method import Fitted, Method
from ..identification.samples import Samples
from ..kernel.arrays import FloatArray
from ..loops.strokes import noise_level
from ..model.outcomes import Finding, IdentificationError, Outcome
from .ni import NiParameters
from .periods import one_record, whole_periods
from .two_stage import Hysteresis, spring_of

_MAX_STEPS = 500  # of the optimizer, refused ones included
# A sum of squares that improves by less than this share says nothing more about the parameters: with K samples,
# one standard error changes it by 1/K.
_FTOL = 1e-6
_FAR_OFF = 1e3  # a refused step counts as a prediction this many times the force away
_LEFT_OVER, _SHAPE = 1.2, 0.01  # misfit that is more than noise: share of the noise or, if larger, of the rms force
_DEGREES = (8, 6)  # of the polynomials that stand for Ni's exponential


class NiResult(NamedTuple):
    """Result of Ni's method; the rmse is of the steady force against the mean period of the record [N].

    The outcome is NOT_CONVERGED, NI_MODEL if residuals exceed the record's noise, or None.
    """

    parameters: NiParameters
    rmse: float
    outcome: Outcome | None


def ni_method(
    displacement: ArrayLike, force: ArrayLike, start: NiParameters, time: ArrayLike | None = None
) -> NiResult:
    """Fit Ni's model to a periodic record.

    Parameters
    ----------
    displacement, force : array_like, shape (K,)   Whole steady periods, from the neutral position [mm], [N].
    start : NiParameters                           Start values: exact, a guess or `plausible_start`.
    time : array_like, shape (K,), or None         [s]; None if the samples are uniform in time.

    Raises
    ------
    RecordError   If the record holds no whole periods.
    """
    from scipy.optimize import least_squares  # slow to import, and only identification needs it

    x, periods = whole_periods(displacement, force, time)
    measured = periods.mean(axis=0)
    # Parseval: harmonics between 0 and the Nyquist frequency stand for two coefficients each.
    weight = np.full(x.size // 2 + 1, math.sqrt(2.0) / x.size)
    weight[[0] if x.size % 2 else [0, -1]] = 1.0 / x.size

    def misfit(vector: FloatArray) -> FloatArray:
        """Of the Fourier coefficients [N], as real numbers; far off where the model has no response."""
        far_off = np.full(weight.size, _FAR_OFF * float(np.abs(measured).max()) + 0j)
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                spectrum = np.fft.rfft(_from_vector(vector, start).steady_force(x) - measured) * weight
        except ValueError:
            spectrum = far_off
        return (spectrum if np.isfinite(spectrum).all() else far_off).view(np.float64)

    # Not "lm", MINPACK's: its last bits vary where the Jacobian is nearly singular, and the minimum it finds with them.
    fit = least_squares(misfit, _to_vector(start), method="trf", x_scale="jac", max_nfev=_MAX_STEPS, ftol=_FTOL)
    parameters = _from_vector(fit.x, start)
    rmse = float(np.sqrt(np.mean((parameters.steady_force(x) - measured) ** 2)))
    # Multiplicative noise counts by its mean square, not by its median.
    noise = max(noise_level(measured), float(np.sqrt(np.mean(np.diff(measured, 4) ** 2) / 70.0)))
    is_left = rmse > max(_LEFT_OVER * noise, _SHAPE * float(np.sqrt(np.mean(measured**2))))
    outcome = Outcome.NOT_CONVERGED if fit.status == 0 else Outcome.NI_MODEL if is_left else None
    return NiResult(parameters, rmse, outcome)


def plausible_start(displacement: ArrayLike, force: ArrayLike) -> NiParameters:
    """Start values of the right order for a record, from its secant stiffness and the height of its loop [mm], [N]."""
    x, periods = whole_periods(displacement, force)
    r = periods.mean(axis=0)
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


def _to_vector(p: NiParameters) -> FloatArray:
    # sigma = 1/2 itself lies at -infinity.
    excess = math.log(max(p.sigma - 0.5, 1e-6))
    return np.array([p.K1, p.K2, p.K3, p.growth, math.log(p.eta), math.log(p.theta + p.lambda_), excess, math.log(p.n)])


def _from_vector(vector: FloatArray, start: NiParameters) -> NiParameters:
    """The parameters of a vector; B is the start's, unless that is 1 and cannot carry any growth."""
    K1, K2, K3, growth, log_eta, log_total, log_excess, log_n = vector.tolist()
    B = start.B if start.B != 1.0 else math.e
    eta, total, n = np.exp(np.clip([log_eta, log_total, log_n], -700.0, 700.0)).tolist()
    lambda_ = total * min(0.5 + math.exp(min(log_excess, 700.0)), SIGMA_RANGE[1] - 0.001)
    n = min(max(n, N_RANGE[0]), N_RANGE[1])
    return NiParameters(K1, K2, K3, B, growth / math.log(B), eta, min(total - lambda_, lambda_), lambda_, n)


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

    def fit(self, samples: Samples, where: str) -> Fitted:
        """Ni's method on one periodic record.

        Raises
        ------
        RecordError           If there are several records, or the record does not hold a whole period.
        IdentificationError   If the method does not converge.
        """
        record = one_record(samples, where, "Ni's method")
        # Ni's model has its neutral position at zero; the middle of the stroke stands for it.
        low, high = float(record.displacement.min()), float(record.displacement.max())
        half = 0.5 * (high - low) * 1e3
        x = (record.displacement - 0.5 * (low + high)) * 1e3
        try:
            start = self.start or plausible_start(x, record.force)
            result = ni_method(x, record.force, start, time=record.time)
        except ValueError as problem:
            raise RecordError(f"{where}: {problem}") from None
        if result.outcome is Outcome.NOT_CONVERGED:
            raise IdentificationError(Outcome.NOT_CONVERGED, where)
        p, degrees = result.parameters, self.degrees or _DEGREES
        y = np.cos(np.linspace(0.0, np.pi, 401))
        amplifier = p.amplifier(half * y)
        wanted = zip((amplifier * p.elastic(half * y), amplifier * p.z0), degrees, strict=True)
        FE, G = (np.asarray(polynomial.polyfit(y, force, degree), np.float64) for force, degree in wanted)
        hysteresis = Hysteresis(1e3 * p.rho, p.sigma, p.n)
        spring = spring_of(where, (low, high), 0.5 * (low + high), 1e-3 * half, FE, G, hysteresis)
        findings = () if result.outcome is None else (Finding(result.outcome, {"rmse": result.rmse}),)
        return Fitted(spring, findings, {"degrees": degrees})
