"""`strandspring plan`."""

from __future__ import annotations

from typing import Any

import click

from ...api.identification import identify
from ...api.planning import plan as plan_test
from ...errors import RecordError
from ...loops.selection import window
from ...model.modelfile import is_model_path, load_model
from ..shared.cautions import note_cautions, note_records, noted
from ..shared.descriptions import refuse_given
from ..shared.option_types import output_options, positive, values_as_usage
from ..shared.options import read_records, record_files, record_options
from ..shared.output import present, save, working
from ..shared.paths import PLOT_FILE, FileNamed, refuse_overwriting


def _ends(_context: click.Context, _option: click.Parameter, text: str | None) -> tuple[float, float] | None:
    """Both ends of LOW:HIGH [m]."""
    if text is None:
        return None
    try:
        low, high = window(text)
    except RecordError:
        low = high = None
    if low is None or high is None:
        raise click.BadParameter(f"must be LOW:HIGH, such as -20:20 [mm], got {text!r}.")
    return 1e-3 * low, 1e-3 * high


@click.command()
@click.argument("sources", nargs=-1, metavar="[MODEL.json | X.fmu | RECORD...]")
@click.option(
    "-o",
    "--output",
    type=FileNamed(".csv"),
    metavar="PROGRAM.csv",
    help="Write the programme to this file: time [s], displacement [mm].",
)
@click.option(
    "--stiffness",
    type=positive("N/mm", 1e3),
    metavar="N/MM",
    help="Instead of a model or a record: the rough stiffness [N/mm], with --stroke.",
)
@click.option(
    "--stroke",
    metavar="LOW:HIGH",
    callback=_ends,
    help="Least and greatest displacement of the rig [mm].  [default: the model's range]",
)
@click.option(
    "--velocity",
    type=positive("mm/s", 1e-3),
    metavar="MM/S",
    help="Largest velocity of the rig [mm/s].  [default: that of the records; else a loop in 4 s]",
)
@click.option(
    "--force-limit",
    type=positive("N"),
    metavar="N",
    help="Largest force of either sign [N], kept to with the uncertainty of the model.  [default: none]",
)
@click.option(
    "--duration",
    type=positive("s"),
    default=300.0,
    show_default=True,
    metavar="S",
    help="Longest programme [s]; it ends earlier where more decides little.",
)
@click.option(
    "--sample-rate",
    type=positive("Hz"),
    default=200.0,
    show_default=True,
    metavar="HZ",
    help="Of the programme and the records [Hz]; a loop takes at least 100 samples.",
)
@click.option("--plot", type=PLOT_FILE, metavar="FILE.png", help="Plot the programme (.png, .svg or .pdf).")
@record_options
@output_options
def plan(
    sources: tuple[str, ...],
    output: str | None,
    plot: str | None,
    as_json: bool,
    stiffness: float | None,
    stroke: tuple[float, float] | None,
    velocity: float | None,
    force_limit: float | None,
    duration: float,
    sample_rate: float,
    **columns: Any,
) -> None:  # fmt: skip
    """Plan the test that decides what is still open about a spring: the programme that a rig should run next.

    From a model file with its uncertainty, from a first record, which is identified on the way, or from a rough
    stiffness and stroke. Full loops, minor loops, small loops down to 10 % of the amplitude, another rate and dwells
    are chosen one after the other for the most that they decide in their time. Each row says what a block decides
    most: half of the 95 % interval before and after it, in % of the value. Displacements are those of the records.

    \b
    Examples:
      strandspring plan spring.json --velocity 50 -o program.csv
      strandspring plan loop.csv --velocity 50 --duration 120 -o program.csv
      strandspring plan --stiffness 20 --stroke -20:20 -o program.csv
      strandspring plan spring.json --force-limit 800 --plot plan.png
    """
    if bool(sources) == (stiffness is not None):
        raise click.UsageError("Give either a model or records, or --stiffness with --stroke.")
    if stiffness is not None and stroke is None:
        raise click.UsageError("--stiffness needs the --stroke over which the spring is tested.")
    is_model = len(sources) == 1 and is_model_path(sources[0])
    if is_model or not sources:
        refuse_given(set(columns), "records", "there are none")
    refuse_overwriting(record_files(sources) if not is_model else sources, {"--output": output, "--plot": plot}, ".csv")
    source: Any = None
    if is_model:
        source = load_model(sources[0])
    elif sources:
        group = read_records(sources, columns)
        note_records(group)
        with working("Identifying"):
            source = identify(group)
        note_cautions(source.findings)
    with working("Planning"), values_as_usage():
        test = plan_test(
            source, stiffness=stiffness, stroke=stroke, velocity=velocity, force_limit=force_limit, duration=duration,
            sample_rate=sample_rate,
        )  # fmt: skip
    save(test, output, plot)

    def lines(width: int | None) -> list[str]:
        return [*test.text_lines(width), *noted(test.findings)]

    present(as_json, test.as_json, lines, program=("Programme", output), plot=("Plot", plot))
