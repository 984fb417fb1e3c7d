"""A document for print, made by the package `typst`; texts go to it as data, never as its source."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from importlib import resources, util
from pathlib import Path
from typing import Any

from ...errors import StrandspringError
from ...ground.files import replacing
from ...ground.scratch import TemporaryFolder
from ..content.blocks import Block, Gallery, Notice, PageContent, Text
from ..content.quantities import bound

WIDE, COLUMNS = 178.0, {2: 86.0, 3: 56.0}  # widths of figures [mm]


def check_typst() -> None:
    """Refuse without the package that makes documents.

    Raises
    ------
    StrandspringError   With how to install it.
    """
    if util.find_spec("typst") is None:
        raise StrandspringError(
            "A report in PDF needs the package typst, which is not installed; run "
            '`pip install "strandspring[pdf]"`, or let the report end in .html.'
        )


def write_document(path: Path, content: PageContent) -> None:
    """Write content as a PDF.

    Parameters
    ----------
    path : Path
    content : PageContent

    Raises
    ------
    StrandspringError   If typst is missing or fails, or the file cannot be written.
    """
    check_typst()
    import typst

    with TemporaryFolder() as folder:
        drawn = _draw(folder, content)
        form = {
            "title": content.title,
            "subtitle": content.subtitle,
            "footer": content.footer,
            "sections": [
                {"title": section.title, "blocks": [_block(block, drawn) for block in section.blocks]}
                for section in content.sections
            ],
        }
        (folder / "content.json").write_text(json.dumps(form), encoding="utf-8")
        source = resources.files("strandspring").joinpath("report/assets/report.typ").read_text(encoding="utf-8")
        (folder / "report.typ").write_text(source, encoding="utf-8")
        try:
            pdf = typst.compile(str(folder / "report.typ"), root=str(folder), font_paths=[_fonts()], format="pdf")
        except RuntimeError as problem:
            # What typst says can name the temporary folder.
            raise StrandspringError(
                f"typst could not make the PDF: {str(problem).replace(str(folder), '')[:300]}"
            ) from None
        with replacing(path) as part:
            part.write_bytes(pdf)


def _fonts() -> str:
    """The folder of the fonts that come with matplotlib, so that the PDF looks alike everywhere."""
    import matplotlib as mpl

    return str(Path(mpl.get_data_path()) / "fonts" / "ttf")


def _draw(folder: Path, content: PageContent) -> dict[str, dict[str, Any]]:
    """Every figure as one SVG or several in the folder; by its key their names, and whether they are wide."""
    from matplotlib import rc_context

    from .drawing import FEW, STYLE, groups_of_records, paper_figure

    drawn: dict[str, dict[str, Any]] = {}
    galleries = [block for section in content.sections for block in section.blocks if isinstance(block, Gallery)]
    with rc_context(STYLE):
        for gallery in galleries:
            for figure in gallery.figures:
                groups = groups_of_records(figure, content.panels)
                wide = figure.wide or len(groups[0]) > FEW
                width = WIDE if wide else COLUMNS[gallery.columns]
                files = [f"{figure.key}-{number}.svg" for number in range(len(groups))]
                drawn[figure.key] = {"wide": wide, "files": files}
                for file, places in zip(files, groups, strict=True):
                    paper = paper_figure(figure, width, {place: content.records[place] for place in places})
                    paper.savefig(folder / file, metadata={"Date": None}, dpi=300)
    return drawn


def _block(block: Block, drawn: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """A block as typst reads it, with the name of its class."""
    if isinstance(block, Gallery):
        figures = [
            {"title": figure.title, "sentence": bound(figure.sentence), **drawn[figure.key]} for figure in block.figures
        ]
        return {"form": "Gallery", "columns": block.columns, "figures": figures}
    form = {"form": type(block).__name__, **asdict(block)}
    if isinstance(block, Text | Notice):
        form["text"] = bound(form["text"])
    if "level" in form:
        form["level"] = form["level"].value
    if "levels" in form:
        form["levels"] = [level.value for level in form["levels"]]
    return form
