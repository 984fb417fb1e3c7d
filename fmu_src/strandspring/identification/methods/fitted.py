"""What a method returns, and how it is made from the solution of a method that has one closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...model.outcomes import IdentificationError, Outcome
from ..certainty.lack_of_fit import LackOfFit
from ..certainty.prediction_interval import PredictionBand
from ..certainty.uncertainty import is_sigma_uncertain
from ..classes.wider import Wider
from ..least_squares.projection import Problem
from ..least_squares.stages import fit_backbone
from ..points.sample_points import SamplePoints
from ..points.steady_part import SteadyRecord
from ..search.solution import Solution, cautions_of, is_positive, refuse_too_few, spring_of

_FULL = 0.9  # share of the longest stroke from which a stroke counts as a full one
_DRIFT = 0.05  # change of a stroke's mean force over the record that is called drift, share of the rms force


@dataclass(frozen=True, eq=False)
class Fitted:
    """What a method returns.

    Attributes
    ----------
    parameters : SpringParameters
    cautions : dict                  Outcomes with their details, which may be empty.
    steady_share : float             Where the steady section was taken to begin, share of the longest stroke.
    omega_start : tuple of float     omega at the first sample of each record; 0 where it is empty.
    uncertainty : dict               Content of the model file's field; empty if the method knows none.
    band : PredictionBand or None
    effects : dict                   Sizes of what the rig added, found or given, by name, in SI units.
    predicted : tuple of ndarray     Force at every sample of each record, the rig's effects included [N]; empty where
                                     the spring alone says it.
    lack_of_fit : LackOfFit or None
    other_energies : tuple of float  Energies of small loops that the records do not rule out [J].
    alone : tuple of SteadyRecord    The steady parts without the rig's effects; empty if the method takes none out.
    turning : tuple of SteadyRecord  The steady parts with reversals between their samples; empty if at samples.
    wider : Wider or None            What a search for wider classes found; None if none was promising.
    choices : dict                   What the method settled beside its options, for the provenance.
    """

    parameters: SpringParameters
    cautions: dict[Outcome, str]
    steady_share: float
    omega_start: tuple[float, ...] = ()
    uncertainty: dict[str, Any] = field(default_factory=dict)
    band: PredictionBand | None = None
    effects: dict[str, Any] = field(default_factory=dict)
    predicted: tuple[FloatArray, ...] = ()
    lack_of_fit: LackOfFit | None = None
    alone: tuple[SteadyRecord, ...] = ()
    other_energies: tuple[float, ...] = ()
    turning: tuple[SteadyRecord, ...] = ()
    wider: Wider | None = None
    choices: dict[str, Any] = field(default_factory=dict)


def fitted(loops: SamplePoints, solution: Solution | None, where: str, cautions: Sequence[Outcome] = ()) -> Fitted:
    """The spring of a solution: the degree of FA is lowered until it is positive over the whole range.

    Parameters
    ----------
    loops : SamplePoints
    solution : Solution or None
    where : str                     Names of the records, for messages.
    cautions : sequence of Outcome  Further cautions of the method.

    Raises
    ------
    IdentificationError   If there is no solution, it has as many parameters as there are points, or even a constant FA
                          is not positive.
    """
    if solution is None:
        raise IdentificationError(Outcome.NO_STEADY_SECTION, where)
    basis, backbone, hysteresis = solution.basis, solution.backbone, solution.hysteresis
    refuse_too_few(loops, basis, where)
    reduced = []
    while not is_positive(basis, backbone):
        again = None
        if basis.amplifier > 0:
            basis = replace(basis, amplifier=basis.amplifier - 1)
            again = fit_backbone(loops, basis.columns(loops.displacement), solution.omega)
        if again is None:
            raise IdentificationError(Outcome.BRANCHES_CROSS, where)
        backbone, reduced = again, [Outcome.AMPLIFIER_REDUCED]
    all_cautions = [*reduced, *cautions_of(loops, hysteresis, solution.omega), *cautions]
    if drifts(loops):
        all_cautions.append(Outcome.DRIFT)
    refinement = Problem(loops, basis, hysteresis).linearised(hysteresis, backbone)
    if is_sigma_uncertain(loops, basis, refinement):
        all_cautions.append(Outcome.SIGMA_AT_BOUND)
    return Fitted(spring_of(basis, backbone, hysteresis, where), dict.fromkeys(all_cautions, ""), solution.steady_share)


def drifts(loops: SamplePoints) -> bool:
    """Whether the mean force of the full strokes of a kind changes from the first to the last of a record."""
    used, first, samples = np.unique(loops.stroke, return_index=True, return_counts=True)
    spread = loops.force_deviation
    full = {
        int(stroke): _mean(loops.travel[at : at + n], loops.force[at : at + n])
        for stroke, at, n in zip(used, first, samples, strict=True)
        if loops.travel[at + n - 1] > loops.travel[at] and loops.length[stroke] >= _FULL * loops.longest
    }
    for record, side in product(range(int(loops.record.max()) + 1), (1, -1)):
        means = [mean for k, mean in full.items() if loops.record[k] == record and loops.direction[k] == side]
        if len(means) >= 3:
            slope = np.polyfit(np.arange(len(means)), means, 1)[0]
            if abs(slope) * (len(means) - 1) > _DRIFT * spread:
                return True
    return False


def _mean(travel: FloatArray, force: FloatArray) -> float:
    """Mean of the force over the travel [N]."""
    return float(np.trapezoid(force, travel)) / float(travel[-1] - travel[0])
