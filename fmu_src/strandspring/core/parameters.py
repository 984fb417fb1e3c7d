"""Parameters of the modified normalized Bouc-Wen spring, and when they are physically possible."""

from __future__ import annotations

import math
import re
from dataclasses import asdict, dataclass, fields, replace
from itertools import pairwise
from typing import Any

from .branches import BRANCHES, TIME_CONSTANT_RANGE, MaxwellBranch, Mechanism, as_coefficients
from .polynomials import least_value

# The limits of what is a spring, for model files, identification, FMUs and both kernels; c/spring_limits.h repeats
# them. Real springs lie far inside, and no force, energy or derivative of what lies inside overflows.
#
# Outside these the closed form's accuracy of 1e-10 has not been shown.
N_RANGE = (0.01, 100.0)
SIGMA_RANGE = (0.5, 1000.0)
# Of FE and of FA: what measured records show ends at degree 4, and a higher FA is hard to keep positive.
MAXIMUM_DEGREE, MAXIMUM_AMPLIFIER_DEGREE = 20, 8
# Of a table of FE: fewer are left to polynomials.
KNOTS = (7, 25)
# Between knots, as a share of the range.
LEAST_SPACING = 1e-3
# Of any displacement [m].
LARGEST_DISPLACEMENT = 1e9
# Of the native FMU alone [m/s].
LARGEST_VELOCITY = 1e9
# Of displacement_max - displacement_min [m].
WIDTH_RANGE = (1e-12, 1e6)
# Of kappa_omega, and of each term of FE over the range [N].
FORCE_RANGE = (1e-15, 1e15)
# Of rho times the identified range: below, energies drown in the rounding of xi, and omega stays where it is.
SATURATION_RANGE = (1e-9, 1e12)
# Of each term of FA over the range.
LARGEST_AMPLIFIER = 1e9
# FA is 1 at the offset: below this it is zero within rounding.
LEAST_AMPLIFIER = 1e-12
# Of where a stroke begins in a restored state: beyond 5e3, omega is 1 within rounding for any n.
LARGEST_START_XI = 1e6
# Of what is summed up along a path, such as the energy [J], in a restored state, and of trials of a solver.
LARGEST_SUM = 1e100


@dataclass(frozen=True)
class SpringParameters:
    """One identified spring, paper eqs. (8)-(11), in SI units.

    With x = displacement - displacement_offset:
    r = sum(kE[i]*x**i) + kappa_omega*omega*sum(kA[i]*x**i).

    Instead of kE, the elastic force FE may be a table: a cubic spline through the forces at knots (see `spline`).

    Parameters
    ----------
    kE : tuple of float        Elastic coefficients of ascending powers [N/m^i]; empty if FE is a table.
    kA : tuple of float        Amplifier coefficients of ascending powers [1/m^i]; kA[0] = 1.
    kappa_omega : float        Hysteretic force at x = 0 when saturated [N], > 0.
    rho : float                Slope of omega at its zero crossing [1/m], > 0.
    sigma : float              Recovery after a reversal [-], >= 1/2.
    n : float                  Smoothness exponent [-], > 0.
    displacement_offset : float   Displacement at x = 0 [m].
    displacement_min, displacement_max : float   Identified range of displacement [m].
    FE_knots, FE_forces : tuple of float   Table of FE: rising displacements [m] from one end of the range to the
                               other, and the forces there [N]; both empty if FE is a polynomial.
    second : Mechanism or None   A second friction mechanism, see `branches`; a mapping of its fields is one.
    branches : tuple of MaxwellBranch   At most BRANCHES, whose forces are added; mappings likewise.

    Raises
    ------
    TypeError    If coefficients are text or a set, or a field of `second` or of a branch is unknown or missing.
    ValueError   If the spring is not physically possible, see `problems`.
    """

    kE: tuple[float, ...]
    kA: tuple[float, ...]
    kappa_omega: float
    rho: float
    sigma: float
    n: float
    displacement_offset: float
    displacement_min: float
    displacement_max: float
    FE_knots: tuple[float, ...] = ()
    FE_forces: tuple[float, ...] = ()
    second: Mechanism | None = None
    branches: tuple[MaxwellBranch, ...] = ()

    def __post_init__(self) -> None:
        for name in ARRAYS:
            object.__setattr__(self, name, as_coefficients(name, getattr(self, name)))
        for name, kind in (("second", Mechanism), ("branches", MaxwellBranch)):
            object.__setattr__(self, name, _made(kind, getattr(self, name)))
        for problem in problems(self):
            raise ValueError(problem)

    @property
    def counts(self) -> tuple[int, int, int, int, int]:
        """How many elastic coefficients, amplifier coefficients, knots, amplifier coefficients of the second mechanism
        and branches there are.
        """
        second = 0 if self.second is None else len(self.second.kA)
        return len(self.kE), len(self.kA), len(self.FE_knots), second, len(self.branches)

    @property
    def elastic_name(self) -> str:
        """Name of the list that FE is linear in."""
        return "FE_forces" if self.FE_forces else "kE"

    def as_dict(self) -> dict[str, Any]:
        """The parameters by name, without the lists that this spring does not have."""
        values = {name: getattr(self, name) for name in (*ARRAYS, *SCALARS)}
        values |= {"second": self.second and asdict(self.second), "branches": tuple(map(asdict, self.branches))}
        return {name: value for name, value in values.items() if value not in ((), None)}

    @property
    def is_plain(self) -> bool:
        """Whether this is the paper's spring: neither a second mechanism nor branches."""
        return self.second is None and not self.branches

    @property
    def mechanisms(self) -> tuple[SpringParameters, ...]:
        """The paper's spring, and the second mechanism as a spring without FE; their forces add up to all but r."""
        if self.is_plain:
            return (self,)
        first = replace(self, second=None, branches=())
        return (first,) if self.second is None else (first, _of_second(self, self.second))

    @property
    def x_min(self) -> float:
        """Lower end of the identified range about the offset [m]."""
        return self.displacement_min - self.displacement_offset

    @property
    def x_max(self) -> float:
        """Upper end of the identified range about the offset [m]."""
        return self.displacement_max - self.displacement_offset


# The parameters that are lists, in the order of the FMU's variables, and the others.
ARRAYS = ("kE", "FE_knots", "FE_forces", "kA")
OF_MECHANISM = tuple(f.name for f in fields(Mechanism))
_ADDED = ("second", "branches")
SCALARS = tuple(f.name for f in fields(SpringParameters) if f.name not in (*ARRAYS, *_ADDED))


def _made(kind: type[Any], given: Any) -> Any:
    """What was given as an object of a kind, or None, or several of it, where mappings of fields stand for objects."""
    if given is None or isinstance(given, kind):
        return given
    return kind(**given) if isinstance(given, dict) else tuple(_made(kind, one) for one in given)


def problems(p: SpringParameters) -> list[str]:
    """Why these parameters are not a physically possible spring, one sentence each; empty if they are.

    Physically possible (paper eqs. 6-7): rho > 0, kappa_omega > 0, n > 0, sigma >= 1/2 and FA > 0 over the
    range, which together make every closed loop absorb energy; and of a size that a spring can have, so that
    whatever is computed at displacements up to LARGEST_DISPLACEMENT is finite.
    """
    sentences = _count_problems(p)
    if sentences:
        return sentences
    named = [(f"{name}[{i}]", value) for name in ARRAYS for i, value in enumerate(getattr(p, name))]
    named += [(name, getattr(p, name)) for name in SCALARS]
    sentences = [f"`{name}` must be finite, got {value!r}." for name, value in named if not math.isfinite(value)]
    if sentences:
        return sentences
    if p.kA[0] != 1.0:
        sentences.append(f"`kA[0]` must be 1 (kappa_omega carries the scale), got {p.kA[0]!r}.")
    sentences += [
        f"`{name}` must be > 0 [{unit}], got {value!r}."
        for name, value, unit in (("kappa_omega", p.kappa_omega, "N"), ("rho", p.rho, "1/m"))
        if not value > 0.0
    ]
    sentences += [
        f"`{name}` must be within [{low:g}, {high:g}], got {value!r}."
        for name, value, (low, high) in (("sigma", p.sigma, SIGMA_RANGE), ("n", p.n, N_RANGE))
        if not low <= value <= high
    ]
    sentences += _range_problems(p)
    if not sentences:
        sentences = [*_knot_problems(p), *_size_problems(p)]
    if not sentences:
        least, where = least_value(p.kA, p.x_min, p.x_max)
        if not least > LEAST_AMPLIFIER:
            sentences.append(
                f"the amplifier FA (coefficients `kA`) must be > 0 over the identified range, "
                f"got {least:.6g} at displacement {where + p.displacement_offset:.6g} m."
            )
    return sentences or [*_second_problems(p), *_branch_problems(p)]


def _of_second(p: SpringParameters, second: Mechanism) -> SpringParameters:
    """A second mechanism as a spring without FE."""
    placed = ("displacement_offset", "displacement_min", "displacement_max")
    values = {name: getattr(second, name) for name in OF_MECHANISM} | {name: getattr(p, name) for name in placed}
    return SpringParameters(kE=(0.0,), **values)


def _second_problems(p: SpringParameters) -> list[str]:
    """What is wrong with the second mechanism, over a range that is one."""
    if p.second is None:
        return []
    try:
        _of_second(p, p.second)
    except ValueError as problem:
        return [re.sub(rf"`({'|'.join(OF_MECHANISM)})\b", r"`second.\1", str(problem))]
    return []


def _branch_problems(p: SpringParameters) -> list[str]:
    """What is wrong with the branches, over a range that is one."""
    if len(p.branches) > BRANCHES:
        return [f"`branches` must have at most {BRANCHES} Maxwell branches, got {len(p.branches)}."]
    largest = FORCE_RANGE[1] / (p.displacement_max - p.displacement_min)
    limits = (("stiffness", 0.0, largest, "N/m"), ("time_constant", *TIME_CONSTANT_RANGE, "s"))
    return [
        f"`branches[{i}].{name}` must be within [{low:g}, {high:.6g}] {unit}, got {getattr(branch, name)!r}."
        for i, branch in enumerate(p.branches)
        for name, low, high, unit in limits
        if not low <= getattr(branch, name) <= high
    ]


def _count_problems(p: SpringParameters) -> list[str]:
    is_table = bool(p.FE_knots or p.FE_forces)
    sentences = []
    if is_table and p.kE:
        sentences.append(f"`kE` must be empty where `FE_knots` gives FE as a table, got {len(p.kE)} values.")
    if is_table and not KNOTS[0] <= len(p.FE_knots) <= KNOTS[1]:
        sentences.append(f"`FE_knots` must have between {KNOTS[0]} and {KNOTS[1]} knots, got {len(p.FE_knots)}.")
    if len(p.FE_forces) != len(p.FE_knots):
        sentences.append(
            f"`FE_forces` must have one force for each of the {len(p.FE_knots)} knots, got {len(p.FE_forces)}."
        )
    degrees = {"kA": MAXIMUM_AMPLIFIER_DEGREE} if is_table else {"kE": MAXIMUM_DEGREE, "kA": MAXIMUM_AMPLIFIER_DEGREE}
    return sentences + [
        f"`{name}` must have between 1 and {degree + 1} coefficients, got {len(getattr(p, name))}."
        for name, degree in degrees.items()
        if not 1 <= len(getattr(p, name)) <= degree + 1
    ]


def _range_problems(p: SpringParameters) -> list[str]:
    """What is wrong with the identified range."""
    sentences = [
        f"`{name}` must be within +-{LARGEST_DISPLACEMENT:g} m, got {getattr(p, name)!r}."
        for name in ("displacement_offset", "displacement_min", "displacement_max")
        if not abs(getattr(p, name)) <= LARGEST_DISPLACEMENT
    ]
    if sentences:
        return sentences
    ends = f"got {p.displacement_min!r} and {p.displacement_max!r}."
    if not p.displacement_min < p.displacement_max:
        return [f"`displacement_min` must be below `displacement_max` [m], {ends}"]
    least, largest = WIDTH_RANGE
    if not least <= p.displacement_max - p.displacement_min <= largest:
        return [f"`displacement_min` must be below `displacement_max` by {least:g} m to {largest:g} m, {ends}"]
    if not p.displacement_min <= p.displacement_offset <= p.displacement_max:
        return [
            f"`displacement_offset` must lie between `displacement_min` and `displacement_max` [m], "
            f"got {p.displacement_offset!r}."
        ]
    return []


def _size_problems(p: SpringParameters) -> list[str]:
    """Which parameters are too small or too large over a range that is one."""
    width, reach = p.displacement_max - p.displacement_min, max(-p.x_min, p.x_max)
    least_force, largest_force = FORCE_RANGE
    sentences = []
    if not least_force <= p.kappa_omega <= largest_force:
        sentences.append(f"`kappa_omega` must be within [{least_force:g}, {largest_force:g}] N, got {p.kappa_omega!r}.")
    low, high = (limit / width for limit in SATURATION_RANGE)
    if not low <= p.rho <= high:
        least, largest = SATURATION_RANGE
        sentences.append(
            f"`rho` must be within [{low:.6g}, {high:.6g}] 1/m, {least:g} to {largest:g} over the identified range, "
            f"got {p.rho!r}."
        )
    for name, largest, unit in (("kE", largest_force, " N"), ("kA", LARGEST_AMPLIFIER, "")):
        power = 1.0
        for i, value in enumerate(getattr(p, name)):
            if not abs(value) <= largest / power:
                sentences.append(
                    f"`{name}[{i}]` must be within +-{largest / power:.6g}, {largest:g}{unit} over the identified "
                    f"range, got {value!r}."
                )
            power *= reach
    return sentences + [
        f"`FE_forces[{i}]` must be within +-{largest_force:g} N, got {force!r}."
        for i, force in enumerate(p.FE_forces)
        if not abs(force) <= largest_force
    ]


def _knot_problems(p: SpringParameters) -> list[str]:
    """What is wrong with the places of the knots, if there are any, within a range that is one."""
    if not p.FE_knots:
        return []
    least = LEAST_SPACING * (p.displacement_max - p.displacement_min)
    ends = ((0, "displacement_min"), (len(p.FE_knots) - 1, "displacement_max"))
    sentences = [
        f"`FE_knots[{place}]` must be `{name}`, {getattr(p, name)!r} m, got {p.FE_knots[place]!r}."
        for place, name in ends
        if p.FE_knots[place] != getattr(p, name)
    ]
    return sentences + [
        f"`FE_knots[{i}]` must lie above `FE_knots[{i - 1}]` by {least:.6g} m or more, {LEAST_SPACING:g} of the range, "
        f"got {after!r} after {before!r}."
        for i, (before, after) in enumerate(pairwise(p.FE_knots), start=1)
        if not after - before >= least
    ]
