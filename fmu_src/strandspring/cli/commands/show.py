"""`strandspring show`."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import Any

import click

from ...api.common.text import counted
from ...api.showing import show as write_page
from ...ground.files import user_cache
from ...loops.overview import overview
from ..shared.cautions import note_assumptions
from ..shared.options import read_records, record_files, record_options
from ..shared.output import result, result_json, working
from ..shared.paths import refuse_overwriting


@click.command()
@click.argument("records", nargs=-1, required=True, metavar="RECORD...")
@click.option("-o", "--output", metavar="FILE.html", help="Write the page to this file, and open nothing.")
@record_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
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
    note_assumptions(group)
    page = user_cache() / "record.html" if output is None else Path(output)
    with working("Drawing the page"):
        write_page(group, page)
    seen = [overview(record) for record in group]
    if as_json:
        result_json(
            {
                "page": str(page),
                "records": [
                    {
                        "path": seen_record.path,
                        "samples": seen_record.samples,
                        "strokes": len(seen_record.strokes),
                        "cycles": [vars(cycle) for cycle in seen_record.cycles],
                        "left_out": {part.reason: int(part.samples.size) for part in seen_record.left_out},
                        "notes": list(seen_record.notes),
                    }
                    for seen_record in seen
                ],
            }
        )
    else:
        for seen_record in seen:
            left_out = "".join(f", {part.samples.size} {part.reason}" for part in seen_record.left_out)
            result(
                f"{seen_record.path}: {seen_record.samples} samples, {counted(len(seen_record.strokes), 'stroke')}, "
                f"{counted(len(seen_record.cycles), 'whole cycle')}{left_out}"
            )
        result(f"Page: {page}")
    if output is None:
        webbrowser.open(page.resolve().as_uri())
