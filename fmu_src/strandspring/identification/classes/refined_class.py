"""A class that was chosen, refined on all samples, as a fit of the paper's class with something added.

All that judges a fit takes the first mechanism as the spring's own omega and G, and what the others add as part of the
force that omega does not change; their coefficients stand beside its own in the Jacobian.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...core.branches import MaxwellBranch, Mechanism
from ...kernel.arrays import FloatArray
from ..least_squares.linearised import Further
from ..least_squares.projection import Refinement
from ..least_squares.refinement import FAIR_TOLERANCE, HUBER, ROBUST_ROUNDS, TOLERANCE, Samples
from ..least_squares.stages import N_BOUNDS, SIGMA_BOUNDS, Backbone
from ..points.polynomials import Basis
from ..points.sample_points import SamplePoints
from ..rig.corrected import Corrected
from ..rig.effect_columns import Rig, Sizes
from ..search.search import candidate_of
from .problem import Along, ClassFit, ClassProblem

_AT_BOUND = 1e-3
_FIRST_EVALUATIONS, _EVALUATIONS = 4, 100


@dataclass(frozen=True, eq=False)
class RefinedClass:
    """A refined fit of a wider class.

    Attributes
    ----------
    fit : ClassFit            The first mechanism has the largest force.
    basis : Basis             Of FE and of the first FA.
    refinement : Refinement   With what the others add as part of FE at the points.
    further : Further         The coefficients of what they add.
    """

    fit: ClassFit
    basis: Basis
    refinement: Refinement
    further: Further

    @property
    def second(self) -> Mechanism | None:
        """The second mechanism of the spring."""
        return second_of(self.fit)

    @property
    def branches(self) -> tuple[MaxwellBranch, ...]:
        """The branches of the spring."""
        return branches_of(self.fit)

    def force_beside(self, rig: Rig, loops: SamplePoints) -> FloatArray:
        """Force that the others add to FE and the first mechanism at some points, shape (P,) [N]."""
        fit = self.fit
        problem = ClassProblem(rig, loops, fit.basis, fit.degrees, fit.stiffness.size, loops.weight)
        return np.asarray(np.sum(problem.at(fit).parts[1:], axis=0))


def second_of(fit: ClassFit) -> Mechanism | None:
    """The second mechanism of a fit, if it has one."""
    if len(fit.degrees) == 1:
        return None
    powers, h = fit.basis.powers(fit.amplified[1]), fit.shape.hysteresis[1]
    return Mechanism((1.0, *(powers[1:] / powers[0]).tolist()), float(powers[0]), h.rho, h.sigma, h.n)


def branches_of(fit: ClassFit) -> tuple[MaxwellBranch, ...]:
    """The branches of a fit."""
    pairs = zip(fit.stiffness.tolist(), fit.shape.times, strict=True)
    return tuple(MaxwellBranch(stiffness, time) for stiffness, time in pairs)


def refined_class(rig: Rig, samples: Samples, fit: ClassFit, robust: bool) -> RefinedClass:
    """Refine a class on all samples, weighted by noise and misfit.

    Parameters
    ----------
    rig : Rig
    samples : Samples
    fit : ClassFit    Of other points of the same records.
    robust : bool     Huber's loss, by reweighting.
    """
    loops = samples.loops

    def problem(of: ClassFit, weight: FloatArray) -> ClassProblem:
        return ClassProblem(rig, loops, of.basis, of.degrees, of.stiffness.size, weight)

    rough = problem(fit, loops.weight)
    fit = rough.solve(fit.shape, fit.omega_start, FAIR_TOLERANCE, _FIRST_EVALUATIONS)
    along, weight = rough.at(fit), loops.weight
    for _ in range(ROBUST_ROUNDS if robust else 1):
        weight = full_weight = samples.weights(_refinement(rough, fit, along, weight, weight), robust)
        if robust:
            pull = np.sqrt(full_weight) * np.abs(loops.force - along.force)
            weight = full_weight * np.minimum(1.0, HUBER / np.maximum(pull, 1e-300))
        final = problem(fit, weight)
        fit = final.solve(fit.shape, fit.omega_start, TOLERANCE, _EVALUATIONS)
        along = final.at(fit)
    fit = _largest_first(fit, along)
    final = problem(fit, weight)
    along = final.at(fit)
    refinement = _refinement(final, fit, along, weight, full_weight)
    basis = replace(fit.basis, amplifier=fit.degrees[0])
    return RefinedClass(fit, basis, refinement, _further(fit, along))


def as_spring(rig: Rig, loops: SamplePoints, fit: ClassFit, sizes: Sizes) -> Corrected:
    """A class as the spring of its largest mechanism, with what the others add as part of FE at the points.

    Parameters
    ----------
    rig : Rig
    loops : SamplePoints   To which the class was fitted.
    fit : ClassFit
    sizes : dict           Effects of the rig that were removed from the points.
    """

    def problem(of: ClassFit) -> ClassProblem:
        return ClassProblem(rig, loops, of.basis, of.degrees, of.stiffness.size, loops.weight)

    fit = _largest_first(fit, problem(fit).at(fit))
    refinement = _refinement(problem(fit), fit, problem(fit).at(fit), loops.weight, loops.weight)
    return Corrected(candidate_of(loops, replace(fit.basis, amplifier=fit.degrees[0]), refinement), loops, sizes)


def _largest_first(fit: ClassFit, along: Along) -> ClassFit:
    """The same fit with the mechanism of the largest force (rms) as the first."""
    if len(fit.degrees) == 1 or np.std(along.parts[0]) >= np.std(along.parts[1]):
        return fit
    shape = replace(fit.shape, hysteresis=fit.shape.hysteresis[::-1])
    return replace(fit, degrees=fit.degrees[::-1], shape=shape, amplified=fit.amplified[::-1])


def _refinement(
    problem: ClassProblem, fit: ClassFit, along: Along, weight: FloatArray, full_weight: FloatArray
) -> Refinement:
    """The fit of the first mechanism, with what the others add as part of FE at the points."""
    G = problem.amplifiers[0] @ fit.amplified[0]
    nonlinear = along.jacobian[:, -(problem.records + fit.shape.vector.size) :]
    by_start = nonlinear[:, fit.shape.vector.size :].sum(axis=1)  # each depends on that of its record alone
    derivatives = np.column_stack([nonlinear[:, :3], by_start])
    return Refinement(
        fit.shape.hysteresis[0],
        fit.omega_start,
        Backbone(fit.elastic, fit.amplified[0], along.force - along.parts[0], G),
        along.parts[0] / G,
        derivatives.T / G,
        weight,
        full_weight,
        fit.converged,
    )


def _further(fit: ClassFit, along: Along) -> Further:
    """The coefficients of what is added to the first mechanism, without those at a bound."""
    mechanisms, branches = len(fit.degrees), fit.stiffness.size
    first_linear = fit.elastic.size + fit.amplified[0].size
    first_shape = first_linear + sum(series.size for series in fit.amplified[1:]) + branches
    columns: list[int] = []
    rows: list[FloatArray] = []
    names: list[str] = []
    values: list[float] = []
    if mechanisms > 1:
        h, series = fit.shape.hysteresis[1], fit.amplified[1]
        matrix = fit.basis.powers_matrix(series.size - 1)
        powers = matrix @ series
        ratio = (matrix - np.outer(powers / powers[0], matrix[0])) / powers[0]
        columns += range(first_linear, first_linear + series.size)
        rows += [*ratio[1:], matrix[0] / powers[0]]
        names += [f"second.kA[{k}]" for k in range(1, series.size)] + ["ln second.kappa_omega"]
        values += [*(powers / powers[0])[1:].tolist(), float(powers[0])]
    place = len(columns)
    free: list[tuple[int, float]] = []  # column and derivative of a logarithm by its coefficient
    if mechanisms > 1:
        for k, name in enumerate(("rho", "sigma", "n")):
            low, high = {"sigma": SIGMA_BOUNDS, "n": N_BOUNDS}.get(name, (0.0, np.inf))
            value = getattr(h, name)
            names.append(f"ln second.{name}")
            values.append(value)
            is_free = low * (1.0 + _AT_BOUND) < value < high * (1.0 - _AT_BOUND)
            free.append((first_shape + 3 + k if is_free else -1, 1.0))
    for j in range(branches):
        c = float(fit.stiffness[j])
        names += [f"ln branches[{j}].stiffness", f"ln branches[{j}].time_constant"]
        values += [c, fit.shape.times[j]]
        stiffness = first_shape - branches + j
        time = first_shape + 3 * mechanisms + j
        free += [(stiffness if c > 0.0 else -1, 1.0 / max(c, 1e-300)), (time if c > 0.0 else -1, 1.0)]
    columns += [column for column, _ in free if column >= 0]
    change = np.zeros((len(names), len(columns)))
    for row, values_of_row in enumerate(rows):
        change[row, : values_of_row.size] = values_of_row
    for row, (column, slope) in enumerate(free, start=len(rows)):
        if column >= 0:
            change[row, place] = slope
            place += 1
    return Further(tuple(names), tuple(values), along.jacobian[:, columns], change)
