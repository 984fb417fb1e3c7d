"""Methods of identification, what they return, and the stages that they go through."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

from ..core.parameters import SpringParameters
from ..findings import Finding
from ..kernel.arrays import FloatArray
from .certainty import Certainty
from .samples import Samples
from .verdict import Verdict


@dataclass(frozen=True, eq=False)
class Fitted:
    """What a method returns.

    Attributes
    ----------
    parameters : SpringParameters
    findings : tuple of Finding
    choices : dict                   What the method settled beside its options, for the provenance.
    effects : dict                   Sizes of what the rig added, found or given, by name, in SI units.
    nuisance : tuple of ndarray      What zeros and drift add to the force at every sample of each record [N].
    delay : float                    By which the force lags, as found [s].
    certainty : Certainty or None    Errors, intervals and ranges; None if the method knows none.
    verdict : Verdict or None        Errors on what was held out, likewise.
    """

    parameters: SpringParameters
    findings: tuple[Finding, ...] = ()
    choices: dict[str, Any] = field(default_factory=dict)
    effects: dict[str, Any] = field(default_factory=dict)
    nuisance: tuple[FloatArray, ...] = ()
    delay: float = 0.0
    certainty: Certainty | None = None
    verdict: Verdict | None = None


class Candidates(Protocol):
    """A method of identification, which keeps nothing between calls."""

    def __call__(self, options: Any, samples: Samples, where: str) -> Iterator[Fitted]:
        """The springs of this method, the likeliest first, of which the first that meets its certificate is saved.

        Parameters
        ----------
        options : Method    Those of this method.
        samples : Samples   Of the records, those that may be fitted.
        where : str         Names of the records, for messages.

        Raises
        ------
        IdentificationError   If no model is physically possible.
        RecordError           If the records do not suit the method.
        """
        ...


class Stage(Enum):
    """Stages of an identification in their order; the value is what is being done. Some methods have fewer."""

    PREPARING = "finding strokes and noise"
    SEARCHING = "searching the class that predicts best"
    REFINING = "refining"
    UNCERTAINTY = "estimating the uncertainty"
    CHECKING = "checking the saved spring"

    @property
    def words(self) -> str:
        """The stage with its place among all, such as "refining (3 of 5)"."""
        return f"{self.value} ({[*Stage].index(self) + 1} of {len(Stage)})"


_listener: ContextVar[Callable[[Stage], None]] = ContextVar("listener", default=lambda _: None)


def begin(stage: Stage) -> None:
    """Say that a stage begins."""
    _listener.get()(stage)


@contextmanager
def heard_by(listener: Callable[[Stage], None]) -> Iterator[None]:
    """Within it, identifications of this thread call a function with each stage that begins."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
