"""`strandspring simulate`."""

from __future__ import annotations

import click

from ..api.simulating import simulate as simulated
from .options import FiniteRange
from .output import reporting, result, result_json, terminal_width
from .paths import refuse_overwriting


@click.command()
@click.argument("system", metavar="SYSTEM.toml")
@click.option(
    "--case",
    "cases",
    multiple=True,
    metavar="NAME",
    help="Simulate only this load case; of several directions all are meant. Repeat for more.",
)
@click.option(
    "--candidate", "candidates", multiple=True, metavar="NAME", help="Simulate only this candidate; repeat for more."
)
@click.option(
    "--step",
    type=FiniteRange(min=0.0, min_open=True, unit="s"),
    metavar="S",
    help="Time step of the coarser of two runs [s].  [default: the file's, or found for errors of 0.1 %]",
)
@click.option("--workers", type=click.IntRange(1, 1024), metavar="N", help="Number of threads.  [default: all cores]")
@click.option("-o", "--output", metavar="OUT.csv", help="Write all figures of all cases to this file.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def simulate(
    system: str,
    cases: tuple[str, ...],
    candidates: tuple[str, ...],
    step: float | None,
    workers: int | None,
    output: str | None,
    as_json: bool,
) -> None:
    """Simulate bodies on mounts under shock and vibration.

    SYSTEM.toml describes rigid bodies on mounts of identified springs, candidates, limits and load cases. Every case is
    run from static equilibrium with omega at rest at its three extremes, and with half the step for the numerical
    error.

    The verdict on a candidate in a case is "pass", "close" (a limit lies within the numerical error), "fail",
    "outside" (a spring leaves its identified range, so that all figures are extrapolated) or "refused" (it cannot be
    simulated). All of these are results, with exit status 0; the status is 1 if nothing could be simulated.

    \b
    Examples:
      strandspring simulate box.toml
      strandspring simulate box.toml --case shock --candidate softer
      strandspring simulate box.toml -o figures.csv
    """
    refuse_overwriting([system], {"--output": output}, ".csv")
    with reporting() as progress:
        found = simulated(
            system, cases or None, candidates or None, step=step, workers=workers, courses=as_json, progress=progress
        )
    if output is not None:
        found.save_csv(output)
    if as_json:
        result_json({"file": system, **found.as_json(), "output": output})
        return
    result("\n".join(found.lines(terminal_width())))
    if output is not None:
        result(f"Figures: {output}")
