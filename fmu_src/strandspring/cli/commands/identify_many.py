"""`strandspring identify-many`."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from ...api.identifying.many import ManyResult
from ...api.identifying.many import identify_many as identify_all
from ...campaigns.batches.sources import COLUMNAR_TABLE, JOURNAL
from ...errors import Reader
from ...findings import CAUTIONS
from ..shared.cautions import notable, noted
from ..shared.option_types import FiniteRange, output_options
from ..shared.options import identification_options, method_options, record_options, wanted_of
from ..shared.output import is_verbose, note, present, refusal, reporting_kept
from ..shared.worker_options import cluster_option, worker_options


@click.command("identify-many")
@click.argument("sources", nargs=-1, required=True, metavar="FILE|FOLDER...")
@click.option("-o", "--output", required=True, metavar="FOLDER", help="Write models and tables into this folder.")
@click.option(
    "--amplitude",
    type=FiniteRange(1e-6, 1e6, unit="mm", factor=1e-3),
    metavar="MM",
    help="Amplitude at which stiffness, energy and loss factor are compared [mm].  [default: the largest that all "
    "springs have in common]",
)
@worker_options
@record_options
@identification_options
@output_options
def identify_many(
    sources: tuple[str, ...],
    output: str,
    amplitude: float | None,
    workers: int | None,
    save_anyway: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Identify many springs, each from a file of its own.

    Of a folder, the files in it that are named like records (.csv, .txt, .xlsx, ...) are taken, not those in folders
    within it. FOLDER gets FOLDER/NAME.json for each spring, and springs.csv and springs.parquet with one row for each
    file: parameters, errors, engineering figures, cautions, whether it is an outlier of the batch, or why it is not
    identified. A damaged file does not stop the others. What is finished is kept in FOLDER/springs.journal.sqlite: the
    same command again, also after an interrupt, identifies only files that are new or have changed.

    Exit status: 0 if all are identified, 1 if some are not.

    \b
    Examples:
      strandspring identify-many monday/ -o models
      strandspring identify-many monday/*.csv -o models --force-unit kN
      strandspring identify-many monday/ -o models --amplitude 20 --workers 4
    """
    method = method_options(options)
    scheduler = cluster_option(workers, options)
    columns = asdict(wanted_of(options))
    quantities = ("displacement", "force", "time")
    units = {name: unit for name in quantities if (unit := columns.pop(f"{name}_unit")) is not None}
    with reporting_kept("files", Path(output) / JOURNAL, "springs/s") as report:
        many = identify_all(
            sources,
            output,
            options=method,
            amplitude=amplitude,
            workers=workers,
            scheduler=scheduler,
            save_anyway=save_anyway,
            progress=report,
            notify=note,
            units=units,
            **columns,
        )
    _print(many, as_json)
    if not many.is_complete:
        refusal(f"strandspring: {many.problem}")
        sys.exit(1)


def _print(many: ManyResult, as_json: bool) -> None:
    if many.batch.columnar_table is None:
        note(
            f'{COLUMNAR_TABLE} needs pyarrow and was not written; install it with pip install "strandspring[formats]".'
        )
    if not as_json:
        is_brief, found = not is_verbose(), many.batch.found
        for line in found.lines(Reader.COMMAND_LINE, CAUTIONS, is_brief):
            note(f"Caution: {line}")
        for line in (*noted(many.left_out), *map("Note: {}".format, found.lines(Reader.COMMAND_LINE, notable()))):
            note(line)
    present(as_json, many.as_json, many.text_lines, table=("Table", many.batch.table))
