"""The reports of an identification, of records, of a simulation and of steady vibration: pages that open offline.

Here is what a report is called and what it says besides its figures: who tested what, and when.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ..errors import StrandspringError

REPORT_SUFFIXES = (".html",)
_LONGEST = 500  # characters of one text
_MOST_FIELDS = 50


def check_report_path(path: str | Path) -> None:
    """Refuse a report of another kind than HTML before the work begins.

    Raises
    ------
    StrandspringError   With what to do.

    Examples
    --------
    >>> check_report_path("spring.html")
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".pdf":
        raise StrandspringError(
            f"A report is a page, and {str(path)!r} is a PDF; let the report end in .html, open it in a browser and "
            "print it to PDF."
        )
    if suffix not in REPORT_SUFFIXES:
        raise StrandspringError(f"A report must end in .html, got {str(path)!r}.")


@dataclass(frozen=True)
class ReportDetails:
    """Details of a report, as the user gives them; an empty text leaves a blank line to be filled in by hand.

    The date is given and never taken from the clock, so that the same input gives the same bytes.

    Parameters
    ----------
    date : str              Of the test or of the report, in any form.
    operator : str          Who ran the test.
    specimen : str          Which spring was tested.
    fields : tuple of (label, text)   Further lines.
    mass : float or None    Mass of the transmissibility figure [kg]; one that suits the spring if None.

    Raises
    ------
    StrandspringError       If a text is too long, a label is empty, or the mass is not finite and > 0.

    Examples
    --------
    >>> details = ReportDetails(date="2026-03-02", specimen="lot 7, no. 12", fields=(("Temperature", "23 °C"),))
    >>> details.pairs
    (('Date', '2026-03-02'), ('Specimen', 'lot 7, no. 12'), ('Operator', ''), ('Temperature', '23 °C'))
    """

    date: str = ""
    operator: str = ""
    specimen: str = ""
    fields: tuple[tuple[str, str], ...] = ()
    mass: float | None = None

    def __post_init__(self) -> None:
        if len(self.fields) > _MOST_FIELDS:
            raise StrandspringError(f"A report may have at most {_MOST_FIELDS} further fields, got {len(self.fields)}.")
        if not all(isinstance(pair, tuple | list) and len(pair) == 2 for pair in self.fields):
            raise StrandspringError(
                f'`fields` must be pairs of label and text, such as (("Temperature", "23 °C"),), got {self.fields!r}.'
            )
        for label, text in self.pairs:
            if not label.strip():
                raise StrandspringError(f"A field of the report needs a label, got an empty one for {text[:60]!r}.")
            for part in (label, text):
                if len(part) > _LONGEST:
                    raise StrandspringError(
                        f"A field of the report may have at most {_LONGEST} characters, got {len(part)} in "
                        f"{label[:60]!r}; shorten it."
                    )
        if self.mass is not None and not (math.isfinite(self.mass) and self.mass > 0.0):
            raise StrandspringError(f"The mass of the report must be finite and > 0 [kg], got {self.mass!r}.")

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """All lines with their labels, the empty ones too."""
        return (("Date", self.date), ("Specimen", self.specimen), ("Operator", self.operator), *self.fields)
