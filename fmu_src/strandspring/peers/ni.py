"""Ni's modified Bouc-Wen model, which made the data of the paper's simulated experiment, and Ni's method for it.

The model, paper eqs. (26)-(29):

    r  = F2*(Z + F1)                                                      (26)
    F1 = K1*x + K2*sgn(x)*x^2 + K3*x^3                                    (27)
    F2 = B^(C*x)                                                          (28)
    dZ = dx*{eta - [theta + lambda*sgn(dx)*sgn(Z)]*|Z|^n}                 (29)

With z0 = (eta/(theta + lambda))^(1/n) and omega = Z/z0, eq. (29) is the normalized eq. (11) with

    rho = eta/z0,   sigma = lambda/(theta + lambda),

so that Z has the closed form of `strandspring.core.saturation`: no differential equation is solved. The paper prints
eq. (28) as "BCx" and gives no n. Only the product C*ln(B), here `growth`, can be identified; B and C are kept apart for
the paper's numbers.

The method (section 4): the response to a steady period is transformed by FFT, and its complex coefficients are compared
with those of the measured force; by Parseval's theorem that is a least-squares fit over the samples. Two choices the
paper leaves open. The optimizer, Levenberg-Marquardt as a trust region, varies ln(eta), ln(theta + lambda),
ln(sigma - 1/2) and ln(n) in place of eta, theta, lambda and n, so that no step leaves the models with sigma >= 1/2, for
which alone the response has its closed form; a step to a saturation that no double holds is refused like any step that
worsens the fit. And of B and C only C*ln(B) is varied.

As a method of `identify` the model becomes a spring of this package: r = F2*(F1 + Z) is the modified normalized
Bouc-Wen model with FE = F2*F1 and kappa_omega*FA = z0*F2, which are fitted by polynomials over the record's range.

Units are the paper's own, unlike elsewhere in this package: displacement in mm, force in N.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike

from ..core.parameters import N_RANGE, SATURATION_RANGE, SIGMA_RANGE, SpringParameters
from ..findings import Finding, IdentificationError, Outcome
from ..identification.figures import rmse
from ..identification.method import Fitted
from ..identification.samples import Samples
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver, as_path
from ..kernel.steady import steady_omega
from ..loops.strokes import noise_level
from .options import NiOptions, NiParameters
from .periods import Hysteresis, one_record, polynomial_spring, whole_periods


def elastic(p: NiParameters, displacement: FloatArray) -> FloatArray:
    """F1 of eq. (27) [N]."""
    x = displacement
    return np.asarray(x * (p.K1 + np.abs(x) * p.K2 + x * x * p.K3))


def amplifier(p: NiParameters, displacement: FloatArray) -> FloatArray:
    """F2 of eq. (28) [-]."""
    return np.exp(p.growth * displacement)


def steady_force(p: NiParameters, period: ArrayLike) -> FloatArray:
    """Force of eq. (26) over one period of the steady state [N].

    Parameters
    ----------
    p : NiParameters
    period : array_like, shape (K,)   One period [mm]; its first sample follows its last.
    """
    path = as_path(period)
    top = int(np.argmax(path))
    # Begun and ended at its top, so that the memory at the start is that at the end.
    rolled = np.append(np.roll(path, -top), path[top])
    if np.ptp(rolled) == 0.0:
        raise ValueError(f"`period` must move forth and back, got {path.size} samples at {path[0]!r} mm.")
    # The spring whose omega is Z/z0, with lengths in mm. Beyond these limits of rho, omega stays where it is, or is
    # saturated after any step, within rounding.
    rho = min(max(p.rho, 1e-14), 1e11)
    reach = min(1.0 / rho, 1e5)
    spring = SpringParameters((0.0,), (1.0,), 1.0, rho, p.sigma, p.n, 0.0, -reach, reach)
    solver, omega = PathSolver(spring), np.array([steady_omega(spring, float(np.ptp(rolled)))])
    for _ in range(1000):  # until the memory is steady; once if there are two strokes
        begun, omega = omega[-1], solver.omega(rolled, float(omega[-1]))
        if abs(omega[-1] - begun) < 1e-13:
            break
    Z = np.roll(p.z0 * omega[:-1], top)
    return np.asarray(amplifier(p, path) * (Z + elastic(p, path)))


# Section 4 of the paper; B and C enter the force through C*ln(B) only.
PAPER_NI = NiParameters(
    K1=39.145, K2=1.360, K3=0.156, B=1.799, C=0.202, eta=147.761, theta=15.512, lambda_=44.726, n=0.222
)


def sine_period(amplitude: float, samples: int) -> FloatArray:
    """One period of x = X*sin(t), paper eq. (30), without the first sample of the next one; X in mm."""
    return np.asarray(amplitude * np.sin(2.0 * np.pi * np.arange(samples) / samples))


def with_noise(force: FloatArray, level: float, seed: int) -> FloatArray:
    """r*(1 + eps*R) of paper eq. (31), eps = `level`; R is standard normal, as the paper does not say."""
    return np.asarray(force * (1.0 + level * np.random.default_rng(seed).standard_normal(force.size)))


class NiResult(NamedTuple):
    """Result of Ni's method; the rmse is of the steady force against the period [N].

    The outcome is NOT_CONVERGED, NI_MODEL if residuals exceed the period's noise, or None.
    """

    parameters: NiParameters
    rmse: float
    outcome: Outcome | None


def ni_method(x: FloatArray, measured: FloatArray, start: NiParameters) -> NiResult:
    """Fit Ni's model to a steady period.

    Parameters
    ----------
    x, measured : ndarray, shape (K,)   Displacement from the neutral position [mm] and force [N], uniform in phase.
    start : NiParameters                Start values: exact, a guess or `plausible_start`.
    """
    from scipy.optimize import least_squares  # slow to import, and only identification needs it

    # Parseval: harmonics between 0 and the Nyquist frequency stand for two coefficients each.
    weight = np.full(x.size // 2 + 1, math.sqrt(2.0) / x.size)
    weight[[0] if x.size % 2 else [0, -1]] = 1.0 / x.size
    # Where the model has no response or is no spring it counts as this far off, and the step is refused.
    far_off = np.full(weight.size, 1e3 * float(np.abs(measured).max()) + 0j).view(np.float64)
    reach = float(np.ptp(x))

    def misfit(vector: FloatArray) -> FloatArray:
        """Of the Fourier coefficients [N], as real numbers."""
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                model = _from_vector(vector)
                spectrum = np.fft.rfft(steady_force(model, x) - measured) * weight
        except ValueError:
            return far_off
        is_spring = SATURATION_RANGE[0] <= model.rho * reach <= SATURATION_RANGE[1] and np.isfinite(spectrum).all()
        return spectrum.view(np.float64) if is_spring else far_off

    # Not "lm", MINPACK's: its last bits vary where the Jacobian is nearly singular, and the minimum it finds with them.
    # Of K samples, one standard error changes the sum of squares by 1/K: a millionth says nothing about parameters.
    fit = least_squares(misfit, _to_vector(start), method="trf", x_scale="jac", max_nfev=500, ftol=1e-6)
    parameters = _from_vector(fit.x)
    error = rmse(measured, steady_force(parameters, x))
    # Multiplicative noise counts by its mean square, not by its median.
    noise = max(noise_level(measured), float(np.sqrt(np.mean(np.diff(measured, 4) ** 2) / 70.0)))
    is_left = error > max(1.2 * noise, 0.01 * float(np.sqrt(np.mean(measured**2))))
    outcome = Outcome.NOT_CONVERGED if fit.status == 0 else Outcome.NI_MODEL if is_left else None
    return NiResult(parameters, error, outcome)


def plausible_start(x: FloatArray, r: FloatArray) -> NiParameters:
    """Start values of the right order for a period, from its secant stiffness and the height of its loop [mm], [N]."""
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


def _from_vector(vector: FloatArray) -> NiParameters:
    K1, K2, K3, growth = vector[:4].tolist()
    eta, total, excess, n = np.exp(vector[4:].clip(-700.0, 700.0)).tolist()
    lambda_ = total * min(0.5 + excess, SIGMA_RANGE[1] - 0.001)
    n = min(max(n, N_RANGE[0]), N_RANGE[1])
    return NiParameters(K1, K2, K3, math.e, growth, eta, min(total - lambda_, lambda_), lambda_, n)


def candidates(options: NiOptions, samples: Samples, where: str) -> Iterator[Fitted]:
    """Ni's method on one periodic record.

    Raises
    ------
    RecordError           If there are several records, or the record does not hold a whole period.
    IdentificationError   If the method does not converge.
    """
    record = one_record(samples, where, "Ni's method")
    # Ni's model has its neutral position at zero; the middle of the stroke stands for it.
    low, high = float(record.displacement.min()), float(record.displacement.max())
    half, middle = 0.5e3 * (high - low), 0.5 * (low + high)
    displacement, periods = whole_periods(record)
    x, force = 1e3 * (displacement - middle), periods.mean(axis=0)
    found = ni_method(x, force, options.start or plausible_start(x, force))
    if found.outcome is Outcome.NOT_CONVERGED:
        raise IdentificationError(Outcome.NOT_CONVERGED, where)
    p, degrees = found.parameters, options.degrees or (8, 6)
    y = np.cos(np.linspace(0.0, np.pi, 401))
    F2 = amplifier(p, half * y)
    wanted = zip((F2 * elastic(p, half * y), F2 * p.z0), degrees, strict=True)
    FE, G = (np.asarray(polynomial.polyfit(y, part, degree), np.float64) for part, degree in wanted)
    h = Hysteresis(1e3 * p.rho, p.sigma, p.n)
    spring = polynomial_spring(where, (low, high), middle, 1e-3 * half, FE, G, h)
    findings = () if found.outcome is None else (Finding(found.outcome, {"rmse": found.rmse}),)
    yield Fitted(spring, findings, {"degrees": degrees})
