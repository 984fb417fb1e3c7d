"""From a fit to the spring that is saved."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from ..core.branches import MaxwellBranch, Mechanism
from ..core.parameters import SpringParameters
from ..findings import IdentificationError, Outcome
from .bases import Shape, inner_knots
from .fit import Fit, Linear, Problem

_LEAST = 1e-9  # share of the force's span below which a mechanism or a branch is none


def spring_of(problem: Problem, fit: Fit, drifted: float = 0.0, solved: Linear | None = None) -> SpringParameters:
    """The spring of a fit; mechanisms and branches without force are left out.

    Parameters
    ----------
    problem : Problem
    fit : Fit
    drifted : float   Of the force from the middle of the test to the moment that is described [N].
    solved : Linear   The linear problem at the fit, solved for if None.
    """
    c, q, frame = fit.spring_class, fit.q, problem.frame
    solved = problem.linear(c, q) if solved is None else solved
    coefficients = solved.coefficients * problem.deviation
    elastic = coefficients[: solved.terms].copy()
    elastic[1:] -= solved.fall
    elastic[0] += solved.base + drifted
    shape = Shape(frame.low, frame.high, c.elastic[0], inner_knots(c.elastic[1], frame.places), elastic)
    at, mechanisms = solved.terms, []
    for k, degree in enumerate(c.amplifiers):
        amplifier = coefficients[at : at + degree + 1]
        at += degree + 1
        rho, excess, n = (math.exp(value) for value in q[3 * k : 3 * k + 3])
        if amplifier.max() > _LEAST * problem.span:
            amplifier = amplifier.clip(1e-6 * amplifier.max())  # the saved one is positive everywhere
            parameters = shape.amplifier_parameters(amplifier)
            mechanisms.append(Mechanism(**parameters, rho=rho / problem.half, sigma=0.5 + excess, n=n))
    if not mechanisms:
        mechanisms = [Mechanism((1.0,), _LEAST * problem.span, 1.0 / problem.half, 1.0, 1.0)]
    branches = [
        MaxwellBranch(float(stiffness) / problem.half, math.exp(log_tau))
        for stiffness, log_tau in zip(coefficients[at:], q[3 * c.mechanisms :], strict=False)
        if stiffness > _LEAST * problem.span
    ]
    return possible_spring(
        ", ".join(record.path for record in problem.samples.measured),
        **{"kE": (), **shape.elastic_parameters()},
        **asdict(mechanisms[0]),
        displacement_offset=0.5 * (frame.low + frame.high),
        displacement_min=frame.low,
        displacement_max=frame.high,
        second=mechanisms[1] if len(mechanisms) > 1 else None,
        branches=tuple(branches),
    )


def possible_spring(where: str, **parameters: Any) -> SpringParameters:
    """The spring of some parameters; an IdentificationError if they are beyond the limits of one."""
    try:
        return SpringParameters(**parameters)
    except ValueError as problem:
        raise IdentificationError(Outcome.BEYOND_LIMITS, where, {"problem": str(problem)}) from None
