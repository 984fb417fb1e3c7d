"""`strandspring synthesize`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from ..core.parameters import N_RANGE
from ..files import write_csv
from ..kernel.path import PathSolver
from ..modelfile import load_model
from ..peers.ni import PAPER_NI, sine_period, with_noise
from .cautions import caution_samples
from .options import FiniteRange
from .output import note, result
from .paths import refuse_overwriting


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
    _refuse_too_many(max(1, len(amplitudes)) * cycles * samples)
    refuse_overwriting([model], {"--output": output})
    parameters = load_model(model).parameters
    centre = parameters.displacement_offset if mean is None else mean * 1e-3
    reaches = [a * 1e-3 for a in amplitudes] or [0.5 * (parameters.displacement_max - parameters.displacement_min)]
    phase = np.arange(cycles * samples) / samples
    path = np.concatenate([*(centre + reach * np.sin(2.0 * np.pi * phase) for reach in reaches), [centre]])
    caution_samples(output, path, parameters)
    force = PathSolver(parameters).force(path)
    if noise > 0.0:
        note(f"Noise level {noise:g}, seed {seed}")
        force = with_noise(force, noise, seed)
    force = force * (1.0 + drift * np.arange(path.size) / path.size)
    time = np.arange(path.size) / (samples * frequency)
    columns = {
        "time [s]": time,
        "displacement [mm]": _quantised(path * 1e3, displacement_resolution),
        "force [N]": _quantised(force, force_resolution),
    }
    write_record(Path(output), columns)
    result(f"Record: {output} ({path.size} samples)")


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
    _refuse_too_many(cycles * samples)
    refuse_overwriting((), {"--output": output, "--clean": clean})
    path = sine_period(amplitude, samples)
    response = np.tile(replace(PAPER_NI, n=exponent).steady_force(path), cycles)
    columns = {
        "time [s]": 2.0 * np.pi * np.arange(response.size) / samples,
        "displacement [mm]": np.tile(path, cycles),
        "force [N]": response,
    }
    if clean is not None:
        write_record(Path(clean), columns)
    if noise > 0.0:
        note(f"Noise level {noise:g}, seed {seed}")
        columns["force [N]"] = with_noise(response, noise, seed)
    write_record(Path(output), columns)
    result(f"Record: {output} ({response.size} samples)")
    if clean is not None:
        result(f"Without noise: {clean}")


def _refuse_too_many(samples: int) -> None:
    if samples > 20_000_000:
        raise click.UsageError(
            f"The record would have {samples} samples, more than 20000000; reduce --cycles or --samples."
        )


def _quantised(values: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    return np.round(values / step) * step if step > 0.0 else values


def write_record(path: Path, columns: dict[str, NDArray[np.float64]]) -> None:
    """Write a record with all digits, so that reading it gives the same numbers."""
    write_csv(path, columns, np.column_stack(list(columns.values())).tolist())
