"""`strandspring synthesize`."""

from __future__ import annotations

import click

from ...api.common.caution_text import outside_cautions
from ...api.identifying.synthesis import synthesize as synthesize_spring
from ...api.identifying.synthesis import synthesize_ni
from ...core.parameters import N_RANGE
from ...model.modelfile import load_model
from ...peers.ni import PAPER_NI
from ...records.record import Record
from ..shared.cautions import note_cautions
from ..shared.options import FiniteRange, values_as_usage
from ..shared.output import note, result
from ..shared.paths import refuse_overwriting


@click.group()
def synthesize() -> None:
    """Compute records: a spring's response, or the paper's experiment."""


@synthesize.command()
@click.argument("model", metavar="MODEL.json")
@click.option("-o", "--output", required=True, metavar="RECORD.csv", help="Record to write.")
@click.option(
    "--amplitude",
    "amplitudes",
    type=FiniteRange(min=0.0, min_open=True, unit="mm"),
    multiple=True,
    metavar="MM",
    help="Amplitude of the sine [mm]; repeat for a sequence.  [default: the identified range]",
)
@click.option(
    "--mean",
    type=FiniteRange(unit="mm"),
    metavar="MM",
    help="Mean displacement [mm].  [default: mid-stroke]",
)
@click.option("--cycles", type=click.IntRange(1, 100_000), default=3, show_default=True, help="For each amplitude.")
@click.option("--samples", type=click.IntRange(8, 1_000_000), default=1000, show_default=True, help="Per cycle.")
@click.option(
    "--frequency",
    type=FiniteRange(min=0.0, min_open=True, unit="Hz"),
    default=1.0,
    show_default=True,
    metavar="HZ",
    help="Frequency of the time column; the force does not depend on it.",
)
@click.option(
    "--noise",
    type=FiniteRange(0.0, 10.0),
    default=0.0,
    show_default=True,
    metavar="EPS",
    help="Force noise as r*(1 + EPS*R), R standard normal (paper eq. 31).",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the noise.")
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
    type=FiniteRange(min=0.0, unit="mm"),
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
def spring(
    model: str,
    output: str,
    amplitudes: tuple[float, ...],
    mean: float | None,
    cycles: int,
    samples: int,
    frequency: float,
    noise: float,
    seed: int,
    drift: float,
    displacement_resolution: float,
    force_resolution: float,
) -> None:  # fmt: skip
    """Compute the record of a model's spring under sinusoidal displacement.

    \b
    Examples:
      strandspring synthesize spring spring.json -o loop.csv
      strandspring synthesize spring spring.json --noise 0.03 -o campaign.csv
    """
    refuse_overwriting([model], {"--output": output}, ".csv")
    content = load_model(model)
    with values_as_usage():
        record = synthesize_spring(
            content,
            [a * 1e-3 for a in amplitudes] or None,
            None if mean is None else mean * 1e-3,
            cycles,
            samples,
            frequency,
            noise,
            seed,
            drift,
            1e-3 * displacement_resolution,
            force_resolution,
        )
    note_cautions(outside_cautions(output, record.displacement, content.parameters))
    _write(output, record, noise, seed)


@synthesize.command()
@click.option("-o", "--output", required=True, metavar="RECORD.csv", help="Record to write.")
@click.option(
    "--amplitude",
    type=FiniteRange(min=0.0, min_open=True, max=100.0, unit="mm"),
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
@click.option("--samples", type=click.IntRange(8, 1_000_000), default=1000, show_default=True, help="Per cycle.")
@click.option("--cycles", type=click.IntRange(1, 100_000), default=1, show_default=True)
@click.option(
    "--noise",
    type=FiniteRange(0.0, 10.0),
    default=0.03,
    show_default=True,
    metavar="EPS",
    help="Force noise as r*(1 + EPS*R), R standard normal (paper eq. 31).",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the noise.")
@click.option("--clean", metavar="FILE.csv", help="Also write the record without noise.")
def ni(
    output: str,
    amplitude: float,
    exponent: float,
    samples: int,
    cycles: int,
    noise: float,
    seed: int,
    clean: str | None,
) -> None:  # fmt: skip
    """Compute the paper's simulated experiment: Ni's model in its steady state under x = X sin(t).

    The record holds whole periods without their closing sample; the periods before the steady state are omitted.

    \b
    Examples:
      strandspring synthesize ni -o table1.csv --clean true.csv
      strandspring synthesize ni --amplitude 5.45 --exponent 1 -o drowned.csv
    """
    refuse_overwriting((), {"--output": output, "--clean": clean}, ".csv")
    with values_as_usage():
        record = synthesize_ni(1e-3 * amplitude, exponent, cycles, samples, noise, seed)
    _write(output, record, noise, seed)
    if clean is not None:
        synthesize_ni(1e-3 * amplitude, exponent, cycles, samples, 0.0).save(clean, "mm")
        result(f"Without noise: {clean}")


def _write(output: str, record: Record, noise: float, seed: int) -> None:
    if noise > 0.0:
        note(f"Noise level {noise:g}, seed {seed}")
    record.save(output, "mm")
    result(f"Record: {output} ({len(record)} samples)")
