"""What the methods of identification have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from ...core.parameters import MAXIMUM_AMPLIFIER_DEGREE, MAXIMUM_DEGREE
from ...records.record import Record
from ..points.steady_part import SteadyRecord
from .fitted import Fitted

_SIMPLER_DEGREES = ((5, 2), (3, 1), (1, 0))


@dataclass(frozen=True)
class Method(ABC):
    """A method of identification with its options, which check themselves.

    `identify` calls `prepare` with each record, cuts the result into strokes, and calls `fit` once with the steady
    parts of all records. A method keeps nothing between calls.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA, both polynomials; chosen from the data if None.
    """

    name: ClassVar[str]

    degrees: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if self.degrees is None:
            return
        try:
            elastic, amplifier = self.degrees
            is_possible = 1 <= elastic <= MAXIMUM_DEGREE and 0 <= amplifier <= MAXIMUM_AMPLIFIER_DEGREE
        except (TypeError, ValueError):  # not two numbers
            is_possible = False
        if not is_possible:
            raise ValueError(
                f"`degrees` must be N,M with 1 <= N <= {MAXIMUM_DEGREE} and 0 <= M <= {MAXIMUM_AMPLIFIER_DEGREE}, "
                f"got {self.degrees}."
            )

    @property
    def withstands_outliers(self) -> bool:
        """Whether isolated outliers hardly change the fit."""
        return False

    def prepare(self, record: Record) -> Record:
        """The record that is identified in place of a measured one.

        Raises
        ------
        RecordError   If the record does not suit the method.
        """
        return record

    @property
    def known_delay(self) -> float:
        """By which the force of the records is known to lag [s]."""
        return 0.0

    @property
    def seeks_delay(self) -> bool:
        """Whether a delay between the columns is sought in the records, those too that only a delay explains."""
        return False

    @property
    def simpler(self) -> Sequence[Method]:
        """What is tried in this order where the spring does not meet its certificate."""
        return () if self.degrees else [replace(self, degrees=degrees) for degrees in _SIMPLER_DEGREES]

    @abstractmethod
    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Identify one spring.

        Parameters
        ----------
        parts : sequence of SteadyRecord   At least one.
        where : str                        Names of the records, for messages.

        Raises
        ------
        IdentificationError   If no model is physically possible.
        RecordError           If the records do not suit the method.
        """


def checked_method(options: Method) -> Method:
    """The options, unless they are of no method, which is a TypeError."""
    if not isinstance(options, Method):
        raise TypeError(f"`options` must be of a method, such as RefinedOptions(), got {options!r}.")
    return options
