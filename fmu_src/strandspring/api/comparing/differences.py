"""Differences between two springs against the uncertainty of both.

Differences of figures (secant stiffness, energy per cycle, mean force of steady loops) are judged by draws from the
joint covariance of each model: z is the difference over its standard deviation. Loops are slow, their Maxwell branches
relaxed. The hysteresis parameters, and those of a second mechanism and of branches where both springs have as many, are
judged together, d'*C^-1*d with the differences d of their logarithms and the sum C of their covariances, which is
chi-square distributed for one spring identified twice. kappa_omega is the hysteretic force at displacement_offset,
which two models place differently: it is compared as kappa_omega*FA at one displacement.

Where the forms of the models differ, only what remains in a common form counts: the same degrees of FE and FA. They are
chosen from noisy records, and another choice shifts the figures of one and the same spring by more than its uncertainty
says: a smaller loop, which no record holds, by 10 % and more. A model is put into a simpler form by identifying the
record that it gives itself. Of wider classes nothing is judged then.

All judgements together have an error of 5 % (Holm's procedure, which allows for any dependence between them). Of 150
pairs of records of one spring (2 % noise, 1500 samples in 3 cycles of one amplitude, degrees chosen from each record),
5 were called different.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from statistics import NormalDist
from typing import Any

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import ModelError, StrandspringError
from ...ground.result_columns import ResultColumn
from ...identification.identify import identify_records
from ...identification.options import RefinedOptions
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.loop import LOOP_FIGURE, steady_loop
from ...model.joint import HYSTERETIC_PARAMETERS, JointCovariance, further_columns, names_of
from ...model.modelfile import ModelFile
from ...records.record import Record
from ..common.text import bounds_95
from ..identifying.synthesis import synthesize

LEVEL = 0.05  # error of all judgements together
# Figures of loops, and whether a difference is judged; the loss factor follows from the two before.
FIGURES = {"secant_stiffness": True, "energy_per_cycle": True, "loss_factor": False, "mean_force": True}
_NORMAL_90 = NormalDist().inv_cdf(0.95)
# Factor on standard deviations: what the choice of degrees and starts from noisy records adds, measured on pairs of
# records of one spring, whose z passed 1.96 in 9 instead of 5 of 100 cases without it.
_OF_CHOICE = 1.15
_MOST_LOG = 700.0  # whose exponential is still a number
_CYCLES, _SAMPLES = 2, 500
_OF_TABLES = 5  # degree of FE where it is a table in both
_RANK = 1e-9  # eigenvalue of the correlation of the logarithms up to which it counts as 0


@dataclass(frozen=True)
class SpringDifference:
    """Of one quantity of two springs.

    Attributes
    ----------
    quantity, unit, words : str
    amplitude : float or None   Of the loop [m]; None for a parameter.
    a, b : float                The quantity in SI units.
    relative : bool             Whether `change`, `low` and `high` are shares of A's value, or differences.
    change : float              From A to B.
    low, high : float           5 % and 95 % of the change; NaN if unknown.
    z : float                   Change over its standard deviation; NaN if unknown.
    reason : str                Why z is unknown, in words; else empty.
    seen_from : float           Change that would have been judged beyond the uncertainty in 95 of 100 cases; NaN
                                where the quantity is not judged.
    differs : bool or None      Whether it is judged to be beyond the uncertainty; None where it is not judged, as are
                                single parameters (their joint test is), loss factors and springs that are not drawn.
    """

    quantity: str
    unit: str
    words: str
    amplitude: float | None
    a: float
    b: float
    relative: bool
    change: float
    low: float = math.nan
    high: float = math.nan
    z: float = math.nan
    reason: str = ""
    seen_from: float = math.nan
    differs: bool | None = None

    @property
    def p(self) -> float:
        """Probability of a z as far from 0 if the springs are the same; NaN if unknown."""
        return math.erfc(abs(self.z) / math.sqrt(2.0))

    def as_json(self) -> dict[str, Any]:
        """All of it."""
        return {**asdict(self), "p": self.p}


@dataclass(frozen=True)
class HysteresisTest:
    """Joint test of kappa_omega, rho, sigma and n, and of those that wider classes have.

    Attributes
    ----------
    parameters : tuple of str   Those that could be tested.
    chi_square : float
    degrees_of_freedom : int
    p : float                   Probability of as large a chi-square if the springs are the same.
    differs : bool or None      Whether it is judged to be beyond the uncertainty; None if no springs were drawn.
    """

    parameters: tuple[str, ...]
    chi_square: float
    degrees_of_freedom: int
    p: float
    differs: bool | None = None


def spreads_of(models: tuple[ModelFile, ModelFile]) -> tuple[tuple[JointCovariance, JointCovariance] | None, str]:
    """What springs are drawn from, of A and of B; or None, and in words why there is nothing."""
    spreads, reasons = [], []
    for label, model in zip("AB", models, strict=True):
        if not model.uncertainty:
            reasons.append(f"{label} holds no uncertainty; identify it with the refined method.")
            continue
        try:
            spreads.append(JointCovariance.to_draw_from(model.parameters, model.uncertainty))
        except ModelError as problem:
            reasons.append(f"{label}: {problem}")
    return (None, " ".join(reasons)) if reasons else ((spreads[0], spreads[1]), "")


def loop_figures(p: SpringParameters, middle: float, amplitudes: Sequence[float]) -> FloatArray:
    """`FIGURES` of steady loops about one place, shape (amplitudes, FIGURES)."""
    solver = PathSolver(p).slow
    loops = [steady_loop(solver, middle - reach, middle + reach).figures for reach in amplitudes]
    return np.array([[getattr(loop, name) for name in FIGURES] for loop in loops])


def drawn(
    p: SpringParameters, spread: JointCovariance, middle: float, amplitudes: Sequence[float], seed: int, numbers: range
) -> FloatArray:
    """Figures of drawn springs, shape (D, amplitudes, FIGURES).

    Springs of different models need different numbers, or their draws are alike.

    Raises
    ------
    StrandspringError   If hardly any draw is a physically possible spring.
    """
    return np.stack([loop_figures(spread.draw(p, seed, number), middle, amplitudes) for number in numbers])


def quantiles(figures: FloatArray) -> FloatArray:
    """5 % and 95 % over draws, shape (2, amplitudes, FIGURES)."""
    return np.asarray(np.quantile(figures, [0.05, 0.95], axis=0))


def figure_differences(
    figures: tuple[FloatArray, FloatArray],
    in_common_form: tuple[FloatArray, FloatArray],
    amplitudes: Sequence[float],
    draws: tuple[FloatArray, FloatArray] | None,
) -> list[SpringDifference]:
    """Differences of the figures of two springs, figure by figure.

    Parameters
    ----------
    figures : tuple of 2 ndarrays          Of A and B as identified, shape (amplitudes, FIGURES).
    in_common_form : tuple of 2 ndarrays   Of both in one form: z is that of the difference that remains there.
    amplitudes : sequence of float         [m]
    draws : (ndarray, ndarray) or None     Figures of drawn springs of A and B.
    """
    differences = []
    a, b = figures
    change = b - a
    held = _held(change, in_common_form[1] - in_common_form[0])
    if draws is not None:
        scatter = draws[1] - draws[0]
        low, high = quantiles(scatter)
        deviation = _OF_CHOICE * np.std(scatter, axis=0)
    for j, column in enumerate(LOOP_FIGURE[name] for name in FIGURES):
        relative = column.unit != "N"  # a force may be 0
        for k, amplitude in enumerate(amplitudes):
            scale = abs(float(a[k, j])) if relative else 1.0
            difference = SpringDifference(
                column.key,
                column.unit,
                column.words,
                amplitude,
                float(a[k, j]),
                float(b[k, j]),
                relative,
                _over(change[k, j], scale),
            )
            if draws is not None and deviation[k, j] > 0.0:
                difference = replace(
                    difference,
                    low=_over(low[k, j], scale),
                    high=_over(high[k, j], scale),
                    z=float(held[k, j] / deviation[k, j]),
                    seen_from=_over(deviation[k, j], scale),  # until the number of judgements is known
                )
            differences.append(difference)
    return differences


def _held(change: FloatArray, in_common_form: FloatArray) -> FloatArray:
    """The smaller one of two changes of one sign; 0 if their signs differ."""
    smaller = np.minimum(np.abs(change), np.abs(in_common_form))
    return np.where(change * in_common_form > 0.0, np.sign(change) * smaller, 0.0)


def _over(value: Any, scale: float) -> float:
    return float(value) / scale if scale > 0.0 else math.nan


def parameter_differences(
    springs: tuple[SpringParameters, SpringParameters],
    in_common_form: tuple[SpringParameters, SpringParameters],
    uncertainties: tuple[Mapping[str, Any], Mapping[str, Any]],
    joints: tuple[JointCovariance | None, JointCovariance | None],
    labels: tuple[str, str],
    place: float,
) -> tuple[list[SpringDifference], HysteresisTest | None]:
    """Differences of the hysteresis parameters, kappa_omega at a displacement [m], and their joint test.

    Those of a second mechanism and of branches are compared where both springs are of one class. As in
    `figure_differences`, z and the test are those of what remains in one form. The test is None where a model has no
    joint covariance, or no parameter can be tested.
    """
    is_one_class = class_of(springs[0]) == class_of(springs[1])
    columns = (*HYSTERETIC_PARAMETERS, *(further_columns(springs[0]) if is_one_class else ()))
    values = np.array([_values(p, columns, place) for p in springs])
    change = np.log(values[1] / values[0])
    remaining = np.log(np.divide(*(_values(p, columns, place) for p in reversed(in_common_form))))
    held = _held(change, remaining)
    known = None
    if joints[0] is not None and joints[1] is not None:
        rows = [_rows(p, columns, joint, place) for p, joint in zip(springs, joints, strict=True) if joint is not None]
        known = rows[0] @ rows[0].T + rows[1] @ rows[1].T
    differences = []
    for k, column in enumerate(columns):
        name = column.key
        difference = SpringDifference(
            name, column.unit, name, None, float(values[0, k]), float(values[1, k]), True, math.expm1(change[k])
        )
        reasons = [
            _unbounded(name, label, p, uncertainty)
            for label, p, uncertainty in zip(labels, springs, uncertainties, strict=True)
        ]
        reason = "; ".join(filter(None, reasons)) or ("" if known is not None else "no joint covariance")
        if reason or known is None or not known[k, k] > 0.0:
            differences.append(replace(difference, reason=reason or "no standard error"))
            continue
        error = math.sqrt(known[k, k])
        low, high = (math.expm1(min(change[k] + side * _NORMAL_90 * error, _MOST_LOG)) for side in (-1.0, 1.0))
        differences.append(replace(difference, low=low, high=high, z=float(held[k] / (_OF_CHOICE * error))))
    if known is None:
        return differences, None
    tests = [_joint_test(differences, shift, _OF_CHOICE**2 * known) for shift in (change, remaining)]
    return differences, min(filter(None, tests), key=lambda test: test.chi_square, default=None)


def _values(p: SpringParameters, columns: Sequence[ResultColumn], place: float) -> FloatArray:
    """The parameters, where kappa_omega of a mechanism is kappa_omega*FA at a place."""
    values = []
    for column in columns:
        owner, _, name = column.key.rpartition(".")
        part: Any = p
        if owner:
            part = p.second if owner == "second" else p.branches[int(owner[len("branches[") : -1])]
        values.append(float(getattr(part, name)))
        if name == "kappa_omega":
            values[-1] *= float(np.polynomial.polynomial.polyval(place - p.displacement_offset, part.kA))
    return np.array(values)


def _rows(p: SpringParameters, columns: Sequence[ResultColumn], joint: JointCovariance, place: float) -> FloatArray:
    """Root of the covariance of the logarithms of `_values`, shape (columns, m)."""
    root = np.zeros((len(joint.root), len(joint.root)))
    for k, numbers in enumerate(joint.root):
        root[k, : k + 1] = numbers
    names = names_of(p)
    row_of = dict(zip(names, root, strict=True))
    rows = []
    for column in columns:
        row: FloatArray = row_of[f"ln {column.key}"].copy()
        prefix, is_force, _ = column.key.partition("kappa_omega")
        if is_force:
            kA = p.second.kA if prefix and p.second is not None else p.kA
            powers = (place - p.displacement_offset) ** np.arange(1, len(kA))
            amplifier = 1.0 + float(powers @ np.array(kA[1:]))
            for k, power in enumerate(powers.tolist(), start=1):
                row += power / amplifier * row_of[f"{prefix}kA[{k}]"]
        rows.append(row)
    return np.array(rows)


def _unbounded(name: str, label: str, p: SpringParameters, uncertainty: Mapping[str, Any]) -> str:
    """Why a parameter of a model has no two-sided uncertainty, in words; empty if it has."""
    if "." in name:
        of_further = (uncertainty.get("further") or {}).get(name) or {}
        uncertainty = {name: of_further.get("standard_error"), "interval_95": {name: of_further.get("interval_95")}}
    ends = bounds_95(name, uncertainty)
    if ends is None:
        return f"{label} has no 95 % interval of it"
    low, high = ends
    if uncertainty.get(name) is None:
        side = "" if high is None else f", < {high:.3g} (95 %)"
        bound = "" if "." in name else f" {getattr(p, name):.3g}"
        return f"at its bound{bound} in {label}{side}"
    if low is None and high is None:
        return f"not bounded by the records of {label}"
    if high is None:
        return f"> {low:.3g} in {label} (95 %), not bounded from above"
    return "" if low is not None else f"< {high:.3g} in {label} (95 %), not bounded from below"


def _joint_test(
    differences: Sequence[SpringDifference], change: FloatArray, covariance: FloatArray
) -> HysteresisTest | None:
    tested = [k for k, difference in enumerate(differences) if not math.isnan(difference.z)]
    if not tested:
        return None
    # Imported here because it takes a tenth of a second.
    from scipy.special import gammaincc

    scale = np.sqrt(np.diag(covariance))[tested]
    values, vectors = np.linalg.eigh(covariance[np.ix_(tested, tested)] / np.outer(scale, scale))
    kept = values > _RANK
    along = vectors[:, kept].T @ (change[tested] / scale)
    chi_square, degrees = float(np.sum(along**2 / values[kept])), int(kept.sum())
    p = float(gammaincc(0.5 * degrees, 0.5 * chi_square))
    return HysteresisTest(tuple(differences[k].quantity for k in tested), chi_square, degrees, p)


def judged(
    differences: Sequence[SpringDifference], test: HysteresisTest | None
) -> tuple[list[SpringDifference], HysteresisTest | None]:
    """The same, with what is beyond the uncertainty and what could have been seen, by Holm's procedure."""
    places = [
        k
        for k, difference in enumerate(differences)
        if FIGURES.get(difference.quantity) and not math.isnan(difference.z)
    ]
    probabilities = [differences[k].p for k in places] + ([] if test is None else [test.p])
    count = max(len(probabilities), 1)
    beyond = [False] * count
    for rank, k in enumerate(sorted(range(len(probabilities)), key=probabilities.__getitem__)):
        if probabilities[k] > LEVEL / (count - rank):
            break
        beyond[k] = True
    normal = NormalDist()
    reach = normal.inv_cdf(1.0 - 0.5 * LEVEL / count) + normal.inv_cdf(0.95)
    result = [replace(difference, seen_from=math.nan) for difference in differences]
    for place, differs in zip(places, beyond, strict=False):
        difference = differences[place]
        result[place] = replace(difference, differs=differs, seen_from=reach * difference.seen_from)
    return result, None if test is None else replace(test, differs=beyond[-1])


def form_of(p: SpringParameters) -> tuple[int | None, int]:
    """Degrees of FE, None for a table, and of FA."""
    return None if p.FE_knots else len(p.kE) - 1, len(p.kA) - 1


def form_words(form: tuple[int | None, int]) -> str:
    """A form in words."""
    return f"{'FE as a table' if form[0] is None else f'FE of degree {form[0]}'} and FA of degree {form[1]}"


def class_of(p: SpringParameters) -> tuple[int, int]:
    """How many friction mechanisms and Maxwell branches a spring has."""
    return len(p.mechanisms), len(p.branches)


def common_form(a: SpringParameters, b: SpringParameters) -> tuple[int | None, int]:
    """The form that both can be put into: the lower degree of FE and of FA.

    Raises
    ------
    StrandspringError   If they differ in class, or are of a wider class and differ in form.
    """
    forms, classes = (form_of(a), form_of(b)), (class_of(a), class_of(b))
    if forms[0] == forms[1] and classes[0] == classes[1]:
        return forms[0]
    if not (a.is_plain and b.is_plain):
        both = [
            f"{form_words(form)}, {mechanisms} mechanism{'s' * (mechanisms > 1)} and {branches} Maxwell "
            f"branch{'es' * (branches != 1)}"
            for form, (mechanisms, branches) in zip(forms, classes, strict=True)
        ]
        raise StrandspringError(
            f"A has {both[0]}, B {both[1]}; identify both with the same `degrees`, `mechanisms` and `branches`."
        )
    degrees = [degree for degree, _ in forms if degree is not None]
    # The identification takes no FE of degree 0, which a model file may have.
    return max(min(degrees, default=_OF_TABLES), 1), min(degree for _, degree in forms)


def in_form(p: SpringParameters, form: tuple[int | None, int]) -> SpringParameters:
    """A spring as it would have been identified with these degrees, from a record over its whole range.

    Raises
    ------
    StrandspringError   If no physically possible spring of this form follows it.
    """
    degree, amplifier = form
    if form_of(p) == form or degree is None:
        return p
    record = synthesize(ModelFile("spring", p), cycles=_CYCLES, samples=_SAMPLES)
    # Without times, so that no delay is looked for.
    path_only = Record(record.displacement, record.force, path=record.path)
    return identify_records([path_only], RefinedOptions(degrees=(degree, amplifier))).parameters
