"""Options of report and figure, and their writing."""

from __future__ import annotations

from typing import Any

import click

from ...api.identification import Identification
from ...model.modelfile import ModelFile
from ...report.details import ReportDetails
from ...report.figure import write_figure
from ...report.rendering.report_path import SUFFIXES as REPORT_SUFFIXES
from ...report.rendering.report_path import check_report_path
from ...report.report_content import write_report
from .option_types import positive, together
from .output import working
from .paths import PLOT_FILE, FileOfFormat


def _fields(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    pairs = [text.partition("=") for text in texts]
    for text, (label, sign, _) in zip(texts, pairs, strict=True):
        if not sign or not label.strip():
            raise click.BadParameter(f"must be LABEL=TEXT, got {text!r}.")
    return tuple((label.strip(), text.strip()) for label, _, text in pairs)


report_options = together(
    click.option("--report", type=FileOfFormat(*REPORT_SUFFIXES), metavar="FILE.html|pdf",
                 help="Also write a report: a page with all figures to zoom into, or a document."),
    click.option("--date", default="", metavar="TEXT", help="Date in the report.  [default: a line to fill in]"),
    click.option("--operator", default="", metavar="TEXT", help="Who ran the test, likewise."),
    click.option("--specimen", default="", metavar="TEXT", help="Which spring was tested, likewise."),
    click.option("--field", "fields", multiple=True, metavar="LABEL=TEXT", callback=_fields,
                 help="A further line of the report; repeat for more."),
    click.option("--report-mass", "mass", type=positive("kg"), metavar="KG",
                 help="Mass of the report's transmissibility [kg].  [default: one that suits the spring]"),
    click.option("--figure", type=PLOT_FILE, metavar="FILE.svg|png|pdf",
                 help="Also draw the loops as a figure for a paper."),
)  # fmt: skip


class Reporting:
    """What the options ask for, checked before the work begins; takes them out of a command's.

    Raises
    ------
    click.UsageError      If details are given without --report.
    StrandspringError     If a PDF cannot be made here.
    """

    def __init__(self, options: dict[str, Any]) -> None:
        self.report: str | None = options.pop("report")
        self.figure: str | None = options.pop("figure")
        given = {name: options.pop(name) for name in ("date", "operator", "specimen", "fields", "mass")}
        if self.report is None and any(given.values()):
            raise click.UsageError("--date, --operator, --specimen, --field and --report-mass belong to --report.")
        self.details = ReportDetails(**given)
        if self.report is not None:
            check_report_path(self.report)

    @property
    def outputs(self) -> dict[str, str | None]:
        """Files that are written, by option."""
        return {"--report": self.report, "--figure": self.figure}

    def write(self, identification: Identification, model: ModelFile, comparison: str) -> None:
        """Write what is asked for."""
        if self.report is not None:
            with working("Drawing the report"):
                write_report(self.report, identification, model, self.details, comparison)
        if self.figure is not None:
            write_figure(self.figure, identification)
