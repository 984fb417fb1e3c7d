"""Definition of a study of a SYSTEM.toml: every grid point with every draw, candidate and load case."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...errors import MountedSystemError, StrandspringError
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.rest import SHARES
from ...vibration.description.named_files import HeldFiles
from ...vibration.description.system_file import SystemFile, system_of_content
from ...vibration.description.system_tables import SystemTable
from ...vibration.description.value_paths import Location
from ...vibration.verdicts.answers import CaseAnswer, answer_case
from ...vibration.verdicts.drawn_springs import Drawn
from ...vibration.verdicts.verdicts import Quantity, Verdict
from .definition import DONE
from .varied import Varied, with_texts

OUTSIDE = "outside"
_MOST_RUNS = 1_000_000
# Figures of which the worst subject stands in a row; those with limits come first.
LIMITED = (Quantity.ACCELERATION, Quantity.SWAY, Quantity.TILT, Quantity.STROKE)
_WITH_ERRORS = (Quantity.ACCELERATION, Quantity.SWAY, Quantity.STROKE)


@dataclass(frozen=True)
class SystemRow:
    """One run: a load case on a candidate at a grid point.

    Attributes
    ----------
    run : int                             From 0 in the study.
    accelerations : tuple of float        Largest absolute acceleration of each point [m/s^2]; empty if refused.
    sway, tilt : float or None            Largest of all points and of all bodies [m], [rad].
    stroke : float or None                Largest share used of the way from rest to the end of a spring's range.
    mount : str or None                   The axis of a mount that has it.
    force : float or None                 Largest of any axis of a mount [N].
    rms_acceleration, rms_sway : float or None   Largest of all points and axes [m/s^2], [m]; None if nothing settles.
    error : float or None                 Numerical error of acceleration, sway or stroke, relative to the largest.
    acceleration_margin, sway_margin, tilt_margin, stroke_margin : float or None
                                          Least share of a limit that is left; None without a limit.
    governing : str or None               The limit with the least margin.
    verdict : str                         See `Verdict`.
    outcome : str                         `DONE`, `OUTSIDE` where figures are extrapolated, or why it is refused.
    """

    run: int
    accelerations: tuple[float, ...] = ()
    sway: float | None = None
    tilt: float | None = None
    stroke: float | None = None
    mount: str | None = None
    force: float | None = None
    rms_acceleration: float | None = None
    rms_sway: float | None = None
    error: float | None = None
    acceleration_margin: float | None = None
    sway_margin: float | None = None
    tilt_margin: float | None = None
    stroke_margin: float | None = None
    governing: str | None = None
    verdict: str = Verdict.REFUSED.value
    outcome: str = DONE


class Place(NamedTuple):
    """Which run it is: indices of the grid point, the draw, the candidate and the case."""

    point: int
    draw: int
    candidate: int
    case: int


@dataclass(frozen=True)
class SystemStudy:
    """Runs over a grid of values of a SYSTEM.toml, each with every draw of its springs, candidate and load case.

    Cases come first, then candidates, draws and grid points, of which the values of the last path come first.

    Parameters
    ----------
    content : mapping            Of the description, as TOML gives it.
    files : HeldFiles            All that it may name.
    varied : tuple of Varied     The axes of the grid.
    candidates, cases : tuple    Their indices in the description, and their names.
    points : tuple of str        Names of the points whose acceleration is asked for.
    draws, seed : int            Draws at each grid point; 0 for the identified springs alone.
    step : float or None         See `simulate_case`.

    Raises
    ------
    MountedSystemError           If there are no runs or too many, or two paths lead to the same value.
    """

    content: Mapping[str, Any]
    files: HeldFiles
    varied: tuple[Varied, ...]
    candidates: tuple[tuple[int, str], ...]
    cases: tuple[tuple[int, str], ...]
    points: tuple[str, ...]
    draws: int = 0
    seed: int = 0
    step: float | None = None
    grid_size: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "grid_size", int(np.prod([len(one.values) for one in self.varied], dtype=object)))
        taken: dict[Location, str] = {}
        for one in self.varied:
            for location in one.locations:
                if location in taken:
                    raise MountedSystemError(f"{taken[location]} and {one.path} vary the same value; leave one out.")
                taken[location] = one.path
        for name in ("draws", "seed"):
            if getattr(self, name) < 0:
                raise MountedSystemError(f"`{name}` must be >= 0, got {getattr(self, name)!r}.")
        if not 0 < len(self) <= _MOST_RUNS:
            raise MountedSystemError(
                f"A study must have from 1 to {_MOST_RUNS} runs, got {len(self)}; vary less, or choose cases and "
                "candidates."
            )

    @property
    def runs_per_point(self) -> int:
        """Draws, candidates and cases of a grid point."""
        return max(self.draws, 1) * len(self.candidates) * len(self.cases)

    def __len__(self) -> int:
        return self.grid_size * self.runs_per_point

    def place(self, run: int) -> Place:
        """Which run it is."""
        rest, case = divmod(run, len(self.cases))
        rest, candidate = divmod(rest, len(self.candidates))
        point, draw = divmod(rest, max(self.draws, 1))
        return Place(point, draw, candidate, case)

    def indices(self, point: int) -> tuple[int, ...]:
        """Of the value of each path at a grid point."""
        found = []
        for one in reversed(self.varied):
            point, index = divmod(point, len(one.values))
            found.append(index)
        return tuple(reversed(found))

    def values(self, point: int) -> tuple[float | str, ...]:
        """The value of each path at a grid point."""
        return tuple(one.values[index] for one, index in zip(self.varied, self.indices(point), strict=True))

    def described(self, point: int) -> SystemFile:
        """The description at a grid point; raises StrandspringError if there is no such system."""
        content = self.content
        pairs = zip(self.varied, self.indices(point), strict=True)
        # Places last, which other paths count from the first on.
        for one, index in sorted(pairs, key=lambda pair: pair[0].counts_places):
            content = one.applied(content, self._table, index)
        return system_of_content(content, self.files)

    def distinct_files(self) -> Iterator[SystemFile]:
        """The description as it is, and with each text that is varied, as far as these are possible."""
        for content in with_texts(self.content, self._table, self.varied):
            with suppress(StrandspringError):
                yield system_of_content(content, self.files)

    @cached_property
    def _table(self) -> SystemTable:
        return SystemTable.model_validate(self.content)

    def rows(self, runs: Iterable[int]) -> list[SystemRow]:
        """Execute runs."""
        systems = _Systems(self)
        # Motions that overflow are refused; they need no warning.
        with np.errstate(all="ignore"):
            return [self._row(run, systems) for run in runs]

    def _row(self, run: int, systems: _Systems) -> SystemRow:
        place = self.place(run)
        try:
            file = systems.file(place.point)
            system = systems.system(place)
            omega = file.options.rest_omega
            answer = answer_case(
                self.candidates[place.candidate][1], system, file.cases[self.cases[place.case][0]], file.limits,
                SHARES if omega is None else (omega,), self.step or file.options.step,
            )  # fmt: skip
        except StrandspringError as refusal:
            return SystemRow(run, outcome=str(refusal))
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:
            # One extreme system must not end a study of thousands.
            return SystemRow(run, outcome=f"No motion was found: {problem}.")
        return system_row(run, answer)


class _Systems:
    """The systems of runs that follow each other, which share most of them."""

    def __init__(self, study: SystemStudy) -> None:
        self._study = study
        self._point: int | None = None
        self._file: SystemFile | StrandspringError = MountedSystemError("")
        self._drawn: dict[int, Drawn] = {}
        self._systems: dict[tuple[int, int], MountedSystem] = {}

    def file(self, point: int) -> SystemFile:
        """The description at a grid point."""
        if point != self._point:
            self._point, self._drawn, self._systems = point, {}, {}
            try:
                self._file = self._study.described(point)
            except StrandspringError as refusal:
                self._file = refusal
        if isinstance(self._file, StrandspringError):
            raise self._file
        return self._file

    def system(self, place: Place) -> MountedSystem:
        """The system of a run."""
        file, study = self.file(place.point), self._study
        system = file.candidates[study.candidates[place.candidate][0]][1]
        if not study.draws:
            return system
        key = place.candidate, place.draw
        if key not in self._systems:
            if place.candidate not in self._drawn:
                self._drawn[place.candidate] = Drawn.of(system, file.models)
            self._systems = {key: self._drawn[place.candidate].system(system, study.seed, place.draw)}
        return self._systems[key]


def system_row(run: int, answer: CaseAnswer) -> SystemRow:
    """A run of which there is an answer."""
    if answer.refusal:
        return SystemRow(run, outcome=answer.refusal)
    worst = {quantity: max((one.value for one in answer.of(quantity)), default=None) for quantity in Quantity}
    stroke = max(answer.of(Quantity.STROKE), key=lambda one: one.value)
    margins = {
        quantity: min((one.margin for one in answer.of(quantity) if one.margin is not None), default=None)
        for quantity in LIMITED
    }
    limited = [one for one in answer.figures if one.margin is not None]
    nearest = min(limited, key=lambda one: one.margin or 0.0, default=None)
    return SystemRow(
        run=run,
        accelerations=tuple(one.value for one in answer.of(Quantity.ACCELERATION)),
        sway=worst[Quantity.SWAY],
        tilt=worst[Quantity.TILT],
        stroke=_finite(worst[Quantity.STROKE]),
        mount=stroke.subject,
        force=worst[Quantity.FORCE],
        rms_acceleration=worst[Quantity.RMS_ACCELERATION],
        rms_sway=worst[Quantity.RMS_SWAY],
        error=_finite(_error(answer)),
        acceleration_margin=margins[Quantity.ACCELERATION],
        sway_margin=margins[Quantity.SWAY],
        tilt_margin=margins[Quantity.TILT],
        stroke_margin=_finite(margins[Quantity.STROKE]),
        governing=None if nearest is None else f"{nearest.quantity.value} of {nearest.subject}",
        verdict=answer.verdict.value,
        outcome=OUTSIDE if answer.verdict is Verdict.OUTSIDE else DONE,
    )


def _error(answer: CaseAnswer) -> float:
    """The largest numerical error of a figure, relative to the largest of its kind."""
    errors = [0.0]
    for quantity in _WITH_ERRORS:
        figures = answer.of(quantity)
        largest = max((one.value for one in figures), default=0.0)
        if largest > 0.0:
            errors.append(max(one.error for one in figures) / largest)
    return max(errors)


def _finite(value: float | None) -> float | None:
    return value if value is not None and np.isfinite(value) else None
