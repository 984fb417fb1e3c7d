"""The right basin: several starts, the distinct minima carried on, degrees chosen after refinement.

The misfit as a function of rho, sigma and n has several minima, and on records of few amplitudes a wrong one may look
as good as the right one to a single start. Starts are the two-stage result and the scan's local minima over n and the
saturation length. Each is refined with FE and FA of middling degrees, what arrives at the same place counts once, and
each distinct minimum gets the degrees that a criterion of Schwarz's form chooses,

    criterion = K*ln(S + floor^2) + p*ln(K),

with the mean squared misfit S, p fitted parameters and K independent samples: the number of points over the
autocorrelation time of the best residual. The floor keeps high degrees from being paid for by what no polynomial
follows anyway: they would spend themselves on imitating the hysteresis of the amplitudes measured. A minimum whose
strokes do not saturate must be better by SATURATION. Where misfit comes back in every cycle, FE as a table and an FA of
degree 4 are tried as well, and judged by cycles left out (`with_richer_bases`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..least_squares.projection import Problem, Refinement
from ..least_squares.stages import Hysteresis
from ..least_squares.trust_region import triangle_of
from ..points.polynomials import Basis
from ..points.residuals import autocorrelation_time, repeated_share
from ..points.sample_points import SamplePoints
from ..points.table import TableBasis
from .degrees import prediction_error
from .scan import scan_minima
from .solution import cautions_of, is_positive, least_points
from .two_stage import two_stage

PILOT = (5, 2)  # degrees at which minima are looked for
_DEGREES = (8, 2)  # highest degrees chosen from: an FA that bends more imitates the loop
_FLOOR = 0.003  # misfit not worth a coefficient, share of the force's standard deviation
_STARTS = 6  # local minima of the scan that are refined
_PILOT_EVALUATIONS, _EVALUATIONS = 12, 20
_PILOT_TOLERANCE, _TOLERANCE = 1e-3, 1e-5
_PROMISING = 1.5  # minima with a misfit up to this many times the least are carried through the degrees
_ROUNDS = 3  # of choosing degrees and refining
_FAR = 100.0  # by which the criterion that a minimum promises may be worse for it to be given degrees of its own
_SAME = 0.1  # difference of ln(rho), ln(sigma), ln(n) within which two fits are one minimum
_INTERVALS = (6, 8, 10, 12, 16, 20, 24)  # of FE as a table
_BENDING = 4  # degree of FA where misfit comes back in every cycle
_LOCKED = 0.2  # correlation of the residuals between cycles that is called coming back
_WORTH = 0.15  # share of the held-out error that a richer basis must explain, unless nothing but noise is left
_EXACT = 0.3  # share of a misfit below the floor that higher degrees must leave at most to be chosen all the same
_AS_WELL = 1.02  # held-out error in that of the best basis up to which a polynomial, or else a leaner one, is taken
NOISE_ONLY = 1.2  # misfit over noise up to which residuals are noise, if they are white
WHITE = 2.0  # autocorrelation time up to which they are
MARGIN = 12.0  # by which an effect or another class must lower the criterion beyond its price
CLOSE = 10.0  # difference of the criterion up to which two fits are about as good
SATURATION = 20.0  # by which the criterion must favour a fit whose strokes do not saturate


@dataclass(frozen=True, eq=False)
class Candidate:
    """A physically possible minimum.

    Attributes
    ----------
    basis : Basis
    refinement : Refinement
    misfit : float               rms [N].
    steady : bool                Whether its strokes saturate.
    autocorrelation_time : float Of the residuals, in points.
    criterion : float            Less is better; differences count, see above.
    """

    basis: Basis
    refinement: Refinement
    misfit: float
    steady: bool
    autocorrelation_time: float
    criterion: float = np.inf

    @property
    def hysteresis(self) -> Hysteresis:
        """rho, sigma, n."""
        return self.refinement.hysteresis

    @property
    def coefficients(self) -> int:
        """Number of coefficients of FE and FA."""
        return self.basis.elastic + self.basis.amplifier + 2


@dataclass(frozen=True)
class Criterion:
    """The criterion of this module.

    Attributes
    ----------
    independent : float   Number of independent samples.
    floor : float         Misfit that is not worth a coefficient [N].
    """

    independent: float
    floor: float

    @classmethod
    def from_points(cls, loops: SamplePoints, autocorrelation_time: float) -> Criterion:
        """The criterion of some points, given the autocorrelation time of the residuals [points]."""
        return cls(loops.force.size / autocorrelation_time, force_floor(loops))

    def value(self, misfit: float, coefficients: int) -> float:
        """The criterion of an rms misfit [N] with so many fitted parameters."""
        return float(self.independent * np.log(misfit**2 + self.floor**2) + coefficients * np.log(self.independent))

    def ranked(self, candidate: Candidate) -> Candidate:
        """The candidate with its criterion."""
        value = self.value(candidate.misfit, candidate.coefficients)
        return replace(candidate, criterion=value + (0.0 if candidate.steady else SATURATION))


def search(loops: SamplePoints, degrees: tuple[int, int] | None = None) -> list[Candidate]:
    """The distinct minima by their criterion, the best first; none if nothing physically possible was found.

    Parameters
    ----------
    loops : SamplePoints
    degrees : (int, int) or None   Chosen if None.
    """
    pilots: list[Candidate] = []
    for start in _starts(loops, degrees or PILOT):
        pilot = refined(loops, Basis(*loops.reach, *(degrees or PILOT)), start, _PILOT_TOLERANCE, _PILOT_EVALUATIONS)
        if pilot is None or any(are_alike(pilot.hysteresis, other.hysteresis) for other in pilots):
            continue
        pilots.append(pilot)
    if not pilots:
        return []
    least = min(pilot.misfit for pilot in pilots)
    carried = [pilot for pilot in pilots if pilot.misfit <= _PROMISING * (least + force_floor(loops))]
    if degrees is None:
        carried = _all_with_degrees(loops, sorted(carried, key=lambda c: c.misfit))
    else:
        # A degree of FA that the pilot could not have is tried again.
        wanted = Basis(*loops.reach, *degrees)
        carried = [refined(loops, wanted, c.hysteresis) or c for c in carried]
    return _distinct(loops, carried)


def _distinct(loops: SamplePoints, fits: Sequence[Candidate]) -> list[Candidate]:
    """The distinct ones of some fits by their criterion, the best first."""
    criterion = Criterion.from_points(loops, min(fits, key=lambda fit: fit.misfit).autocorrelation_time)
    ranked = sorted(map(criterion.ranked, fits), key=lambda fit: fit.criterion)
    found = [fit.hysteresis for fit in ranked]
    return [fit for k, fit in enumerate(ranked) if not any(are_alike(found[k], other) for other in found[:k])]


def _starts(loops: SamplePoints, degrees: tuple[int, int]) -> Iterator[Hysteresis]:
    """The two-stage result, then the scan's minima, which take longer."""
    start = two_stage(loops, degrees)
    if start is not None:
        yield start.hysteresis
    yield from scan_minima(loops, Basis(*loops.reach, *degrees).columns(loops.displacement))[:_STARTS]


def refined(
    loops: SamplePoints,
    basis: Basis,
    start: Hysteresis,
    tolerance: float = _TOLERANCE,
    evaluations: int = _EVALUATIONS,
) -> Candidate | None:
    """Least squares on the points from a start, with the degree of FA lowered until it is positive.

    None if it never is, or if there are more coefficients than points.
    """
    if loops.force.size < least_points(basis, int(loops.record[-1]) + 1):
        return None
    while True:
        problem = Problem(loops, basis, start, coarse=True)
        fit = problem.solve(start, np.zeros(problem.records), loops.weight, tolerance, evaluations)
        if is_positive(basis, fit.backbone):
            break
        if basis.amplifier == 0:
            return None
        basis = replace(basis, amplifier=basis.amplifier - 1)
    return candidate_of(loops, basis, fit)


def candidate_of(loops: SamplePoints, basis: Basis, fit: Refinement) -> Candidate:
    """A fit with what it leaves of the points, not yet compared."""
    residuals = fit.backbone.misfit(loops.force, fit.omega)
    time = autocorrelation_time(np.sqrt(loops.weight) * residuals)
    steady = not cautions_of(loops, fit.hysteresis, fit.omega)
    return Candidate(basis, fit, loops.rms(residuals), steady, time)


def _all_with_degrees(loops: SamplePoints, pilots: Sequence[Candidate]) -> list[Candidate]:
    """The pilots with degrees of their own; those left as they are that promise far less than the first has reached."""
    first = with_degrees(loops, pilots[0])
    criterion = Criterion.from_points(loops, first.autocorrelation_time)
    worst = criterion.ranked(first).criterion + _FAR
    return [first] + [
        pilot if _choose(loops, pilot, criterion)[0] > worst else with_degrees(loops, pilot) for pilot in pilots[1:]
    ]


def with_degrees(loops: SamplePoints, candidate: Candidate) -> Candidate:
    """The candidate refined with the degrees that the criterion asks for; repeated as long as that lowers it."""
    criterion = Criterion.from_points(loops, candidate.autocorrelation_time)
    best = criterion.ranked(candidate)
    for _ in range(_ROUNDS):
        _, elastic, amplifier = _choose(loops, best, criterion)
        if (elastic, amplifier) == (best.basis.elastic, best.basis.amplifier):
            break
        basis = replace(best.basis, elastic=elastic, amplifier=amplifier)
        other = refined(loops, basis, best.hysteresis)
        if other is None:
            break
        other = criterion.ranked(other)
        if other.criterion >= best.criterion:
            break
        best = other
    return best


def _choose(loops: SamplePoints, candidate: Candidate, criterion: Criterion) -> tuple[float, int, int]:
    """The least criterion by linear least squares, in which all else yields as well, and its degrees N, M."""
    basis = replace(candidate.basis, elastic=_DEGREES[0], amplifier=_DEGREES[1])
    columns = basis.columns(loops.displacement)
    fit = candidate.refinement
    root = np.sqrt(loops.weight)
    *yielding, own = fit.derivatives * fit.backbone.G
    whole = np.hstack([columns.elastic, fit.omega[:, None] * columns.amplifier, np.transpose([*yielding, loops.force])])
    triangle = triangle_of(loops.beside_starts(whole * root[:, None], own * root))
    points, size = loops.force.size, triangle.shape[1]
    n_E, n_A = basis.elastic + 1, basis.amplifier + 1
    freed = size - 1 - n_E - n_A
    pairs = [(N, M) for N in range(1, n_E) for M in range(n_A) if N + M + 2 + freed < points]
    # The columns of each pair first, then the force: what is left of it is an element of R.
    order = np.array(
        [
            [
                *range(N + 1),
                *range(n_E, n_E + M + 1),
                *range(n_E + n_A, size),
                *range(N + 1, n_E),
                *range(n_E + M + 1, n_E + n_A),
            ]
            for N, M in pairs
        ]
    )
    R = np.asarray(np.linalg.qr(triangle[:, order].transpose(1, 0, 2), mode="r"))
    total = float(np.sqrt(loops.weight.sum()))
    criteria = [
        criterion.value(float(root[N + M + 2 + freed, N + M + 2 + freed]) / total, N + M + 2)
        for root, (N, M) in zip(R, pairs, strict=True)
    ]
    best = int(np.argmin(criteria))
    return criteria[best], *pairs[best]


def with_richer_bases(loops: SamplePoints, candidate: Candidate, noise: float) -> Candidate | None:
    """A candidate with FE as a table or an FA of higher degree; None where that is not called for.

    It is if misfit is left that comes back in every cycle, or in the only one, and if the richer basis takes a good
    part of it in cycles that it was not fitted to, where there are several.

    Parameters
    ----------
    loops : SamplePoints
    candidate : Candidate
    noise : float           The rms that noise alone gives the residuals [N].
    """
    if is_explained(candidate, noise):
        return None
    if candidate.misfit <= force_floor(loops):
        return _exact(loops, candidate)
    residuals = candidate.refinement.backbone.misfit(loops.force, candidate.refinement.omega)
    if loops.cycles()[-1] > 0 and repeated_share(loops, residuals) < _LOCKED:
        return None
    low, high, amplifier = candidate.basis.low, candidate.basis.high, _DEGREES[1]
    bases = [Basis(low, high, _DEGREES[0], _BENDING)]
    tables = [TableBasis(low, high, intervals, degree) for intervals in _INTERVALS for degree in (amplifier, _BENDING)]
    bases += [table for table in tables if table.is_determined(loops.displacement)]
    fits = [refined(loops, basis, candidate.hysteresis) for basis in bases]
    richer = [fit for fit in fits if fit is not None]
    errors = [prediction_error(loops, fit.basis, fit.refinement.omega) for fit in richer]
    if not errors:
        return None
    good = [fit for fit, error in zip(richer, errors, strict=True) if error <= _AS_WELL * min(errors)]
    best = min(good, key=lambda fit: (isinstance(fit.basis, TableBasis), fit.coefficients))
    before = prediction_error(loops, candidate.basis, candidate.refinement.omega)
    after = prediction_error(loops, best.basis, best.refinement.omega)
    return best if after < (1.0 - _WORTH) * before or is_explained(best, noise) else None


def other_splits(loops: SamplePoints, candidate: Candidate) -> list[Candidate]:
    """The distinct minima with the same FE and an FA of any degree up to the candidate's, ranked, the best first.

    A rich FE can take over part of the loop of a single amplitude, so that quite different loops fit about as well.
    With several amplitudes it cannot, and the candidate is the only one.
    """
    fits = [candidate]
    if loops.has_one_amplitude:
        for amplifier in range(candidate.basis.amplifier + 1):
            basis = replace(candidate.basis, amplifier=amplifier)
            minima = scan_minima(loops, basis.columns(loops.displacement))[:_STARTS]
            refits = (refined(loops, basis, start) for start in (candidate.hysteresis, *minima))
            fits += [fit for fit in refits if fit is not None]
    return _distinct(loops, fits)


def _exact(loops: SamplePoints, candidate: Candidate) -> Candidate | None:
    """A candidate with degrees that leave next to nothing, as on records of the model itself without noise."""
    fit = refined(loops, replace(candidate.basis, elastic=_DEGREES[0], amplifier=_DEGREES[1]), candidate.hysteresis)
    if fit is None or fit.misfit > _EXACT * candidate.misfit:
        return None
    _, elastic, amplifier = _choose(loops, fit, Criterion(float(loops.force.size), _EXACT * candidate.misfit))
    return refined(loops, replace(fit.basis, elastic=elastic, amplifier=amplifier), fit.hysteresis)


def bending_more(loops: SamplePoints, candidate: Candidate) -> list[Candidate]:
    """The candidate again with the next degree of FA, unless it has the highest; both ranked anew, itself first."""
    amplifier = candidate.basis.amplifier + 1
    if amplifier > _DEGREES[1]:
        return [candidate]
    basis = replace(candidate.basis, amplifier=amplifier)
    other = refined(loops, basis, candidate.hysteresis)
    criterion = Criterion.from_points(loops, candidate.autocorrelation_time)
    return [criterion.ranked(fit) for fit in (candidate, other) if fit is not None]


def is_explained(candidate: Candidate, noise: float) -> bool:
    """Whether nothing but noise is left of the residuals."""
    return candidate.misfit <= NOISE_ONLY * noise and candidate.autocorrelation_time <= WHITE


def force_floor(loops: SamplePoints) -> float:
    """The misfit that is not worth a coefficient [N]."""
    return _FLOOR * loops.force_deviation


def are_alike(a: Hysteresis, b: Hysteresis) -> bool:
    """Whether two fits are the same minimum."""
    logs = np.log([a.rho / b.rho, a.sigma / b.sigma, a.n / b.n])
    return bool(np.abs(logs).max() <= _SAME)
