"""`strandspring synthesize`."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from ..files import replacing
from ..model.path import PathSolver
from ..modelfile import load_model
from .output import note, result


@click.group()
def synthesize() -> None:
    """Make records by computation: a test without a test rig."""


@synthesize.command()
@click.argument("model", metavar="MODEL.json")
@click.option("-o", "--output", required=True, metavar="RECORD.csv", help="Record to write.")
@click.option(
    "--amplitude",
    "amplitudes",
    type=click.FloatRange(min=0.0, min_open=True),
    multiple=True,
    metavar="MM",
    help="Amplitude of the sine [mm]; repeat for one after the other.  [default: the identified range]",
)
@click.option("--mean", type=float, metavar="MM", help="Displacement it swings about [mm].  [default: mid-stroke]")
@click.option("--cycles", type=click.IntRange(1, 100_000), default=3, show_default=True, help="For each amplitude.")
@click.option("--samples", type=click.IntRange(8, 1_000_000), default=1000, show_default=True, help="Per cycle.")
@click.option(
    "--frequency",
    type=click.FloatRange(min=0.0, min_open=True),
    default=1.0,
    show_default=True,
    metavar="HZ",
    help="For the time column; the force does not depend on it.",
)
@click.option(
    "--noise",
    type=click.FloatRange(0.0, 10.0),
    default=0.0,
    show_default=True,
    metavar="EPS",
    help="Force noise as r*(1 + EPS*R), R standard normal (paper eq. 31).",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the noise.")
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
) -> None:  # fmt: skip
    """Make the record that a model's spring would give under sinusoidal displacement.

    \b
    Examples:
      strandspring synthesize spring spring.json -o loop.csv
      strandspring synthesize spring spring.json --amplitude 13 --amplitude 46 --mean 57 --noise 0.03 -o campaign.csv
    """
    total = max(1, len(amplitudes)) * cycles * samples
    if total > 20_000_000:
        raise click.UsageError(f"{total} samples were asked for; at most 20000000 are written.")
    parameters = load_model(model).parameters.spring()
    centre = parameters.displacement_offset if mean is None else mean * 1e-3
    reaches = [a * 1e-3 for a in amplitudes] or [0.5 * (parameters.displacement_max - parameters.displacement_min)]
    phase = np.arange(cycles * samples) / samples
    path = np.concatenate([*(centre + reach * np.sin(2.0 * np.pi * phase) for reach in reaches), [centre]])
    force = PathSolver(parameters).force(path)
    if noise > 0.0:
        note(f"Noise level {noise:g}, seed {seed}")
        force = force * (1.0 + noise * np.random.default_rng(seed).standard_normal(force.size))
    time = np.arange(path.size) / (samples * frequency)
    columns = {"time [s]": time, "displacement [mm]": path * 1e3, "force [N]": force}
    write_record(Path(output), columns)
    result(f"Record: {output} ({path.size} samples)")


def write_record(path: Path, columns: dict[str, NDArray[np.float64]]) -> None:
    """Write a record with every digit, so that reading it gives the same numbers."""
    import pandas as pd

    with replacing(path) as part:
        pd.DataFrame(columns).to_csv(part, index=False, lineterminator="\n")
