"""The paper's Table 1 with every method: python tests/benchmarks/table1.py

The simulated experiment of section 4: one period of Ni's model, 1000 samples, 3 % noise, RMSE against the noise-free
response. Seeds 0 to 19. None of the first three methods is given start values.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from strandspring import Record, RefinedOptions, ScanOptions, TwoStageOptions, identify
from strandspring.peers.ni import PAPER_NI, NiParameters, sine_period, with_noise
from strandspring.peers.ni_method import ni_method, plausible_start, random_start

SEEDS = range(20)
SAMPLES = 1000
NOISE = 0.03
FAILED = 2.5  # RMSE [N] above which a start of Ni's method counts as failed: the paper's two-stage figure
console = Console(width=118)

Start = Callable[[np.ndarray, np.ndarray, int], NiParameters]

# Displacement [mm], noisy force, seed -> displacement of the prediction [mm], prediction, iterations.
Run = Callable[[np.ndarray, np.ndarray, int], tuple[np.ndarray, np.ndarray, int | None]]


def without_start(options: TwoStageOptions | ScanOptions | RefinedOptions) -> Run:
    def run(x: np.ndarray, force: np.ndarray, _: int) -> tuple[np.ndarray, np.ndarray, int | None]:
        return x, identify(Record(1e-3 * x, force), options).fits[0].predicted, None

    return run


def by_ni(start: Start) -> Run:
    def run(x: np.ndarray, force: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, int | None]:
        result = ni_method(x, force, start(x, force, seed))
        return result.displacement, result.predicted, result.iterations

    return run


def _starts(truth: NiParameters) -> tuple[Start, Start]:
    """Starts at the exact values, and at random within a factor of ten."""
    return (
        lambda _x, _force, _seed: truth,
        lambda _x, _force, seed: random_start(np.random.default_rng(seed), truth),
    )


def main() -> None:
    console.print(f"Seeds {SEEDS.start} to {SEEDS.stop - 1}, {SAMPLES} samples of one period, noise {NOISE:g}")
    console.print("The paper: two-stage 2.5337, Ni from random values 6.0202, Ni from exact values 2.0494")
    for amplitude, exponent in ((5.0, 0.222), (5.45, 1.0)):
        truth = replace(PAPER_NI, n=exponent)
        x = sine_period(amplitude, SAMPLES)
        clean = truth.steady_force(x)
        table = Table(title=f"X = {amplitude:g}, n = {exponent:g}: RMSE [N] against the noise-free response")
        for column in ("method", "start", "median", "worst", "failed", "iterations", "median time [ms]"):
            table.add_column(column, justify="left" if column in ("method", "start") else "right")
        exact, random = _starts(truth)
        runs: list[tuple[str, str, Run]] = [
            ("two-stage", "none", without_start(TwoStageOptions())),
            ("scan", "none", without_start(ScanOptions())),
            ("refined", "none", without_start(RefinedOptions())),
            ("Ni's", "exact values", by_ni(exact)),
            ("Ni's", "read off the record", by_ni(lambda x, force, _: plausible_start(x, force))),
            ("Ni's", "random, factor 10", by_ni(random)),
        ]
        for method, start, run in runs:
            errors, iterations, times = [], [], []
            for seed in SEEDS:
                force = with_noise(clean, NOISE, seed)
                begin = time.perf_counter()
                at, predicted, count = run(x, force, seed)
                times.append(time.perf_counter() - begin)
                errors.append(float(np.sqrt(np.mean((predicted - truth.steady_force(at)) ** 2))))
                if count is not None:
                    iterations.append(count)
            failed = sum(error > FAILED for error in errors)
            table.add_row(
                method, start, f"{np.median(errors):.2f}", f"{max(errors):.2f}", f"{failed}/{len(SEEDS)}",
                f"{np.median(iterations):.0f}" if iterations else "-", f"{1e3 * np.median(times):.0f}",
            )  # fmt: skip
        console.print(table)


if __name__ == "__main__":
    main()
