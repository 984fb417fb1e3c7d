"""The reports of an identification, of records, of a simulation and of steady vibration: pages that open offline.

Here is what a report is called and what it says besides its figures: who tested what, and when.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from ..errors import StrandspringError
from ..ground.options import check, described, option


def check_report_path(path: str | Path) -> None:
    """Raise StrandspringError with what to do unless a report is a page."""
    suffix = Path(path).suffix.lower()
    if suffix != ".html":
        advice = "; let the report end in .html, open it in a browser and print it to PDF." if suffix == ".pdf" else "."
        raise StrandspringError(f"A report is a page and must end in .html, got {str(path)!r}{advice}")


def field_of(text: str) -> tuple[str, str]:
    """Label and text of LABEL=TEXT; raises ValueError for anything else."""
    label, sign, rest = text.partition("=")
    if not sign or not label.strip():
        raise ValueError(f"must be LABEL=TEXT, got {text!r}.")
    return label.strip(), rest.strip()


@described
@dataclass(frozen=True)
class ReportDetails:
    """Details of a report as the user gives them; an empty text leaves a line to be filled in by hand.

    The date is given and never taken from the clock, so that the same input gives the same bytes.

    Raises
    ------
    StrandspringError       If a label is empty, or the mass is not finite and > 0.

    Examples
    --------
    >>> details = ReportDetails(date="2026-03-02", specimen="lot 7, no. 12", fields=(("Temperature", "23 °C"),))
    >>> details.pairs
    (('Date', '2026-03-02'), ('Specimen', 'lot 7, no. 12'), ('Operator', ''), ('Temperature', '23 °C'))
    """

    group: ClassVar[str] = "Report"

    date: str = option(
        "", "text", "Date of the test or of the report, in any form", otherwise="a line to fill in", metavar="TEXT"
    )
    operator: str = option("", "text", "Who ran the test, likewise", metavar="TEXT")
    specimen: str = option("", "text", "Which spring was tested, likewise", metavar="TEXT")
    fields: tuple[tuple[str, str], ...] = option(
        (), "texts", "A further line of the report, with its label", metavar="LABEL=TEXT", parse=field_of
    )
    mass: float | None = option(
        None, "number", "Mass of the report's transmissibility", unit="kg", least=0.0, is_open=True,
        otherwise="one that suits the spring", metavar="KG", flag="report_mass",
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self, StrandspringError)
        if not all(isinstance(pair, tuple | list) and len(pair) == 2 and pair[0].strip() for pair in self.fields):
            raise StrandspringError(
                f'`fields` must be pairs of label and text, such as (("Temperature", "23 °C"),), got {self.fields!r}.'
            )

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """All lines with their labels, the empty ones too."""
        return (("Date", self.date), ("Specimen", self.specimen), ("Operator", self.operator), *self.fields)
