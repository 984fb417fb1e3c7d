"""`strandspring synthesize`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import click

from ...api.identifying.synthesis import synthesize as synthesize_spring
from ...api.identifying.synthesis import synthesize_ni
from ...core.parameters import N_RANGE
from ...model.modelfile import load_model
from ...peers.ni import PAPER_NI
from ...records.record import Record
from ..shared.cautions import note_cautions
from ..shared.option_types import Command, FiniteRange, positive, together, values_as_usage
from ..shared.output import note, result
from ..shared.paths import FileNamed, refuse_overwriting


def _sampling(cycles: int, noise: float) -> Callable[[Command], Command]:
    """Options of all records, with their defaults."""
    return together(
        click.option("-o", "--output", type=FileNamed(".csv"), required=True, metavar="RECORD.csv",
                     help="Record to write."),
        click.option("--cycles", type=click.IntRange(1, 100_000), default=cycles, show_default=True,
                     help="For each amplitude."),
        click.option("--samples", type=click.IntRange(8, 1_000_000), default=1000, show_default=True,
                     help="Per cycle."),
        click.option("--noise", type=FiniteRange(0.0, 10.0), default=noise, show_default=True, metavar="EPS",
                     help="Force noise as r*(1 + EPS*R), R standard normal (paper eq. 31)."),
        click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the noise."),
    )  # fmt: skip


@click.group()
def synthesize() -> None:
    """Compute records: a spring's response, or the paper's experiment."""


@synthesize.command()
@click.argument("model", metavar="MODEL.json")
@click.option(
    "--amplitude",
    "amplitudes",
    type=positive("mm", 1e-3),
    multiple=True,
    metavar="MM",
    help="Amplitude of the sine [mm]; repeat for a sequence.  [default: the identified range]",
)
@click.option(
    "--mean",
    type=FiniteRange(unit="mm", factor=1e-3),
    metavar="MM",
    help="Mean displacement [mm].  [default: mid-stroke]",
)
@_sampling(cycles=3, noise=0.0)
@click.option(
    "--frequency",
    type=positive("Hz"),
    default=1.0,
    show_default=True,
    metavar="HZ",
    help="Frequency of the time column; the force does not depend on it.",
)
@click.option(
    "--drift",
    type=FiniteRange(-1.0, 1.0),
    default=0.0,
    show_default=True,
    metavar="SHARE",
    help="Relative growth of the force from the first sample to the last.",
)
@click.option(
    "--displacement-resolution",
    type=FiniteRange(min=0.0, unit="mm", factor=1e-3),
    default=0.0,
    metavar="MM",
    help="Resolution of the displacement sensor.",
)
@click.option(
    "--force-resolution",
    type=FiniteRange(min=0.0, unit="N"),
    default=0.0,
    metavar="N",
    help="Resolution of the force sensor.",
)
def spring(model: str, output: str, amplitudes: tuple[float, ...], **options: Any) -> None:
    """Compute the record of a model's spring under sinusoidal displacement.

    \b
    Examples:
      strandspring synthesize spring spring.json -o loop.csv
      strandspring synthesize spring spring.json --noise 0.03 -o campaign.csv
    """
    refuse_overwriting([model], {"--output": output}, ".csv")
    content = load_model(model)
    with values_as_usage():
        record = synthesize_spring(content, amplitudes or None, **options)
    note_cautions(replace(record, path=output).found)
    _write(output, record, options)


@synthesize.command()
@click.option(
    "--amplitude",
    type=FiniteRange(min=0.0, min_open=True, max=100.0, unit="mm", factor=1e-3),
    default=5.0,
    show_default=True,
    metavar="MM",
    help="X of x = X sin(t) [mm].",
)
@click.option(
    "--exponent",
    type=FiniteRange(*N_RANGE),
    default=PAPER_NI.n,
    show_default=True,
    metavar="N",
    help="n of eq. (29), which the paper does not print.",
)
@_sampling(cycles=1, noise=0.03)
@click.option("--clean", type=FileNamed(".csv"), metavar="FILE.csv", help="Also write the record without noise.")
def ni(output: str, clean: str | None, **options: Any) -> None:
    """Compute the paper's simulated experiment: Ni's model in its steady state under x = X sin(t).

    The record holds whole periods without their closing sample; the periods before the steady state are omitted.

    \b
    Examples:
      strandspring synthesize ni -o table1.csv --clean true.csv
      strandspring synthesize ni --amplitude 5.45 --exponent 1 -o drowned.csv
    """
    refuse_overwriting((), {"--output": output, "--clean": clean}, ".csv")
    with values_as_usage():
        record = synthesize_ni(**options)
    _write(output, record, options)
    if clean is not None:
        synthesize_ni(**{**options, "noise": 0.0}).save(clean, "mm")
        result(f"Without noise: {clean}")


def _write(output: str, record: Record, options: dict[str, Any]) -> None:
    if options["noise"] > 0.0:
        note(f"Noise level {options['noise']:g}, seed {options['seed']}")
    record.save(output, "mm")
    result(f"Record: {output} ({len(record)} samples)")
