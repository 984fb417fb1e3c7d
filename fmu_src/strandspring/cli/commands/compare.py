"""`strandspring compare`."""

from __future__ import annotations

from typing import Any

import click

from ...api.comparing.comparison import DRAWS
from ...api.comparing.comparison import compare as compare_springs
from ...ground.plotfile import SUFFIXES
from ...model.modelfile import load_model
from ..shared.cautions import note_cautions, note_records, noted
from ..shared.option_types import loop_amplitudes, output_options, positive, values_as_usage
from ..shared.options import read_records, record_files, record_options
from ..shared.output import present, working
from ..shared.paths import PLOT_FILE, refuse_overwriting


@click.command()
@click.argument("a", metavar="A.json")
@click.argument("b", metavar="B.json")
@click.argument("records", nargs=-1, metavar="[RECORD...]")
@click.option(
    "--align",
    type=click.Choice(["record", "middle"]),
    default="record",
    show_default=True,
    help="Displacements as in the records of both; or each counted from the middle of its own range, where the zero "
    "was moved between the tests.",
)
@loop_amplitudes("middle of the shared range", "its quarters")
@click.option(
    "--mass",
    type=positive("kg"),
    metavar="KG",
    help="Mass for the transmissibility [kg].  [default: one that A holds in the middle of the range]",
)
@click.option(
    "--draws",
    type=click.IntRange(0, 100_000),
    default=DRAWS,
    show_default=True,
    help="Springs drawn from the uncertainty of each model, at least 20; 0 for no verdict.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the draws.")
@click.option(
    "--plot",
    type=PLOT_FILE,
    metavar="FILE.png",
    help=f"Plot loops, figures and transmissibility ({', '.join(SUFFIXES)}).",
)
@record_options
@output_options
def compare(
    a: str,
    b: str,
    records: tuple[str, ...],
    amplitudes: tuple[float, ...],
    plot: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Compare two springs, such as two lots, or one before and after fatigue.

    Parameters, stiffness, energy, mean force and loss factor of loops, and transmissibility are compared over the
    range that both share, and judged by the uncertainty in the model files, all together at the 5 % level (5 of 150
    pairs of records of one spring were found to differ). z is the difference over its standard deviation; * marks
    what is beyond the uncertainty. With records: which of both follows each one better.

    \b
    Examples:
      strandspring compare new.json worn.json
      strandspring compare lot1.json lot2.json loop.csv --mass 5 --plot lots.png
      strandspring compare new.json worn.json --align middle --json
    """
    refuse_overwriting([a, b, *record_files(records)], {"--plot": plot})
    for path in (a, b):
        load_model(path)  # a bad model is refused before long records are read
    of_springs = {name: options.pop(name) for name in ("align", "mass", "draws", "seed")}
    group = read_records(records, options)
    note_records(group)
    with working("Comparing"), values_as_usage():
        comparison = compare_springs(a, b, group, amplitudes=amplitudes or None, **of_springs)
        if plot is not None:
            comparison.save_plot(plot)
    note_cautions(comparison.findings)

    def with_notes(width: int | None) -> list[str]:
        return [*comparison.text_lines(width), *noted(comparison.findings)]

    present(as_json, comparison.as_json, comparison.brief, with_notes, plot=("Plot", plot))
