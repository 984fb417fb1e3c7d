"""`strandspring show`."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import Any

import click

from ...api.showing import Overview
from ...api.showing import show as write_page
from ...ground.files import user_cache
from ...report.record_page import record_warnings
from ..shared.cautions import note_records
from ..shared.option_types import output_options
from ..shared.options import read_records, record_files, record_options
from ..shared.output import note, present, working
from ..shared.paths import FileNamed, refuse_overwriting


@click.command()
@click.argument("records", nargs=-1, required=True, metavar="RECORD...")
@click.option(
    "-o",
    "--output",
    type=FileNamed(".html"),
    metavar="FILE.html",
    help="Write the page to this file, and open nothing.",
)
@record_options
@output_options
def show(records: tuple[str, ...], output: str | None, as_json: bool, **options: Any) -> None:
    """Show loops, strokes and cycles of records before they are identified.

    The page shows what was detected and what would be left out. Zooming into its figures, or choosing cycles, prints
    the options that choose the same in every command that reads records. Without -o it is opened in the browser.

    \b
    Examples:
      strandspring show loop.csv
      strandspring show rig.xlsx --force "Sheet 2/Load" -o rig.html
      strandspring show campaign.toml -o campaign.html
    """
    refuse_overwriting(record_files(records), {"--output": output}, ".html")
    group = read_records(records, options)
    note_records(group)
    page = user_cache() / "record.html" if output is None else Path(output)
    with working("Drawing the page"):
        write_page(group, page)
    seen = Overview(group)
    for warning in (warning for record in group for warning in record_warnings(record)):
        note(f"Caution: {warning}")
    present(as_json, seen.as_json, seen.brief, seen.text_lines, page=("Page", page))
    if output is None:
        webbrowser.open(page.resolve().as_uri())
