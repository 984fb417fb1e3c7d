"""The paper, drawn: the campaign of its spring, pictures in the manner of its figures, and its tables.

python -m strandspring.examples.paper -o FOLDER. All of it is synthetic. The spring has the paper's size, motion and
forces (section 5), but its parameters are ours, since the paper gives none.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import strandspring as ss
from strandspring.api.common.result import table_lines
from strandspring.campaigns.jobs.threads import usable_cores
from strandspring.ground.files import refuse_unwritable, write_text
from strandspring.ground.one_thread import one_thread
from strandspring.ground.plotfile import save_figure
from strandspring.kernel.arrays import FloatArray
from strandspring.peers.ni import PAPER_NI, ni_method, steady_force
from strandspring.peers.options import NiParameters
from strandspring.report.drawing import LIGHT, STYLE

SYNTHETIC = "synthetic: what the paper leaves out is ours"
# Displacement is the compression of a spring of 176 mm: one core wire, layers of 3 and 6 wires of 1.5 mm.
SPRING = ss.SpringParameters(
    kE=(252.0, 4.6e3, 3.2e4, 5e5), kA=(1.0, 12.0), kappa_omega=42.0, rho=300.0, sigma=1.2, n=0.8,
    displacement_offset=0.057, displacement_min=0.011, displacement_max=0.103,
)  # fmt: skip
PRE_DEFORMATION = 0.057  # m
AMPLITUDES = (0.013, 0.024, 0.046)  # m
CYCLES, SAMPLES = 3, 200  # of each amplitude, of each cycle
NOISE = 0.01  # of the force; the paper's Table 2 leaves 1.2 %
# Table 1: X [mm], noise, seeds, random starts without noise, K; methods with starts, and the paper's RMSE [N] and RNL.
X, NI_NOISE, SEEDS, CLEAN_STARTS, PERIODS = 5.0, 0.03, 40, 10, (128, 1000)
METHODS = {
    **dict.fromkeys([("paper", "none"), ("two-stage", "none"), ("refined", "none")], (2.5337, 0.98979)),
    ("ni", "random"): (6.0202, 0.97575),
    ("ni", "exact"): (2.0494, 0.99174),
}
PICTURES = {
    6: ("paper", "none", "Present model and the paper's method"),
    7: ("ni", "random", "Ni's model and method from a random start"),
    8: ("ni", "exact", "Ni's model and method from the exact start"),
}
MEANING = (
    "No K makes all of the paper's rows typical: Ni's exact row needs K of some 120, the paper's method 1000 and more."
)
# Fig. 3: A, beta, gamma of eq. (2) for loading, with beta + gamma < 0, and unloading; n = 1, alpha, k [N/mm], D [mm].
LOADING, UNLOADING, ALPHA, STIFFNESS, D = (1.0, 0.1, -0.35), (1.0, 0.9, -0.1), 0.2, 10.0, 8.0
COLOURS = [LIGHT[name] for name in ("blue", "green", "purple", "model")]


class Run(NamedTuple):
    """A run of Table 1; the seed is that of the noise and of a random start."""

    method: str
    start: str
    samples: int
    noise: float
    seed: int

    @property
    def record(self) -> ss.Record:
        """One period of Ni's model."""
        return ss.synthesize("ni", 1e-3 * X, samples=self.samples, noise=self.noise, seed=self.seed)

    @property
    def true(self) -> FloatArray:
        """Force without noise [N]."""
        return self._replace(noise=0.0).record.force

    def predicted(self) -> FloatArray:
        """Steady force of what is identified [N]; raises an exception if the method finds nothing or stops."""
        record = self.record
        if self.start == "none":
            spring = ss.identify(record, method=self.method).spring()
            return spring.response(np.tile(record.displacement, 5))[-self.samples :]
        start = PAPER_NI if self.start == "exact" else random_start(np.random.default_rng(self.seed), PAPER_NI)
        found = ni_method(1e3 * record.displacement, record.force, start)
        if found.outcome is ss.Outcome.NOT_CONVERGED:
            raise ss.StrandspringError(found.outcome.value)
        return steady_force(found.parameters, 1e3 * record.displacement)

    def rmse(self) -> float | None:
        """Against the force without noise [N]; None if the method finds nothing or stops."""
        try:
            with one_thread():
                error = rms(self.predicted() - self.true)
        except (ValueError, ArithmeticError):
            return None
        return error if np.isfinite(error) else None


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def random_start(generator: np.random.Generator, scale: NiParameters) -> NiParameters:
    """Possible start values of which each is that of `scale` times a factor, log-uniform in [1/10, 10]."""
    while True:
        factors = (10.0 ** generator.uniform(-1.0, 1.0, 8)).tolist()
        names = ("K1", "K2", "K3", "C", "eta", "theta", "lambda_", "n")  # C carries the one number of the amplifier
        with suppress(ValueError):
            return replace(scale, **{n: getattr(scale, n) * factor for n, factor in zip(names, factors, strict=True)})


def campaign() -> dict[str, ss.Record]:
    """The records of section 5: three amplitudes at the lowest and the highest frequency, one amplitude held out."""
    tests = {"slow": (AMPLITUDES, 0.13), "fast": (AMPLITUDES, 2.12), "held_out": ((0.035,), 1.0)}
    return {
        name: ss.synthesize(
            ss.Spring(SPRING), amplitudes, mean=PRE_DEFORMATION, cycles=CYCLES, samples=SAMPLES, frequency=frequency,
            noise=NOISE, seed=seed,
        )
        for seed, (name, (amplitudes, frequency)) in enumerate(tests.items())
    }  # fmt: skip


def table_1() -> list[dict[str, Any]]:
    """Each method at each K over the seeds."""
    groups = [(*method, K, noise) for K in PERIODS for method in METHODS for noise in (NI_NOISE, 0.0)]
    # Without noise the seed matters for random starts only.
    counts = {("random", 0.0): CLEAN_STARTS, ("none", 0.0): 1, ("exact", 0.0): 1}
    runs = [Run(*group, seed) for group in groups for seed in range(counts.get((group[1], group[3]), SEEDS))]
    # A fork would inherit the locks of other threads.
    with ProcessPoolExecutor(min(usable_cores(), 8), get_context("spawn")) as pool:
        errors = dict(zip(runs, pool.map(Run.rmse, runs, chunksize=8), strict=True))
    table = []
    for method, start, K, noise in groups[::2]:
        of_seeds = [errors[Run(method, start, K, noise, seed)] for seed in range(SEEDS)]
        finished = [error for error in of_seeds if error is not None]
        clean = [error for run, error in errors.items() if run[:4] == (method, start, K, 0.0) and error is not None]
        median, (paper_rmse, paper_rnl) = float(np.median(finished)), METHODS[method, start]
        table.append({
            "method": method, "start": start, "K": K, "seeds": SEEDS, "failed": SEEDS - len(finished),
            "median_rmse_N": median, "least_rmse_N": min(finished), "largest_rmse_N": max(finished),
            "median_rnl": 1.0 - median / rms(Run(method, start, K, 0.0, 0).true),
            "rmse_without_noise_N": float(np.median(clean)),
            "paper_rmse_N": paper_rmse, "paper_rnl": paper_rnl,
            "runs_above_paper": sum(error > paper_rmse for error in finished), "rmse_of_seeds_N": of_seeds,
        })  # fmt: skip
    return table


def table_2(records: dict[str, ss.Record]) -> tuple[list[dict[str, Any]], ss.Spring]:
    """What is identified from the campaign, along all its loops and those held out; the spring of the first row."""
    both = [records["slow"], records["fast"]]
    largest = ss.select(records["slow"], cycles=(5, 6))  # of 46 mm
    table, springs = [], []
    for method, source, data in (("refined", "slow and fast", both), ("paper", "46 mm of slow", [largest])):
        springs.append(ss.identify(data, method=method).spring())
        loops, held_out = ss.predict(springs[-1], both), ss.predict(springs[-1], records["held_out"])
        table.append({
            "method": method, "identified_from": source, "rmse_N": loops.rmse, "rnl": loops.rnl,
            "held_out_rmse_N": held_out.rmse, "held_out_rnl": held_out.rnl,
            "parameters": springs[-1].parameters.as_dict(),
        })  # fmt: skip
    return table, springs[0]


def table_text(rows: list[dict[str, Any]]) -> str:
    """The numbers of a table under their names."""
    names = [name for name, value in rows[0].items() if not isinstance(value, list | dict)]
    forms = [".5f" if "rnl" in name else ".4f" if name.endswith("_N") else "" for name in names]
    cells = [[format(row[name], form) for name, form in zip(names, forms, strict=True)] for row in rows]
    return "\n".join(table_lines([name.replace("_", " ") for name in names], cells, ["method", "start"], width=120))


def panels(title: str, *names: str) -> tuple[Figure, list[Axes]]:
    """A picture with panels side by side, which says that it is synthetic."""
    figure = Figure((6.8 if len(names) > 1 else 4.2, 3.2), layout="constrained")
    figure.suptitle(title, size=8.0)
    figure.supxlabel(SYNTHETIC, size=6.0, x=0.995, ha="right", color=LIGHT["muted"])
    axes = list(figure.subplots(1, len(names), squeeze=False).flat)
    for name, ax in zip(names, axes, strict=True):
        ax.set_title(name, loc="left", size=7.0)
        ax.set(xlabel="time [s]" if name.endswith("over time") else "displacement [mm]", ylabel="force [N]")
        ax.grid(color=LIGHT["grid"], lw=0.5)
    return figure, axes


def classic_z(x: FloatArray) -> FloatArray:
    """z of eq. (2) with n = 1 along a path [mm], by the midpoint rule."""
    z = np.zeros(x.size)
    for k, step in enumerate(np.diff(x).tolist()):
        A, beta, gamma = LOADING if step > 0.0 else UNLOADING
        ahead = z[k]
        for share in (0.5, 1.0):
            ahead = z[k] + share * step * (A - np.copysign(beta, step) * ahead - gamma * abs(ahead)) / D
        z[k + 1] = ahead
    return z


def figure_3() -> Figure:
    """Hardening by the classic model: z is unbounded, and no loading paths overlap."""
    title = "Classic Bouc-Wen model with one set of parameters for loading and one for unloading (as Fig. 3)"
    figure, (overall, hysteretic) = panels(title, "(a) overall response", "(b) pure hysteretic component")
    for amplitude, colour in zip((4.0, 8.0, 12.0, 16.0), COLOURS, strict=True):
        x = np.tile(-amplitude * np.cos(np.linspace(0.0, 2.0 * np.pi, 801)), 6)
        component = (1.0 - ALPHA) * D * STIFFNESS * classic_z(x)
        hysteretic.plot(x[-801:], component[-801:], color=colour)
        overall.plot(x[-801:], (ALPHA * STIFFNESS * x + component)[-801:], color=colour, label=f"{amplitude:g} mm")
    hysteretic.set(ylabel="(1 - α) D k z [N]")
    overall.legend(title="amplitude")
    return figure


def figure_4() -> Figure:
    """The bounded component of physically possible parameters."""
    figure, (ax,) = panels("Pure hysteretic component (as Fig. 4)", f"|ω| ≤ 1, σ = {SPRING.sigma:g} ≥ 1/2")
    for amplitude, colour in zip((0.004, *AMPLITUDES), COLOURS, strict=True):
        path = PRE_DEFORMATION - amplitude * np.cos(np.linspace(0.0, 6.0 * np.pi, 2401))
        x, omega = 1e3 * path[-801:], ss.Spring(SPRING).omega(path)[-801:]
        ax.plot(x, SPRING.kappa_omega * omega, color=colour, label=f"amplitude {1e3 * amplitude:g} mm")
    ends = x[np.argmax(omega > 0.99)], x[400 + np.argmax(omega[400:] < -0.99)]  # of the largest loop
    ax.axvspan(*ends, color=LIGHT["grid"], zorder=0, label="steady section, |ω| > 0.99")
    ax.set(ylabel="κ ω [N]", ylim=(-75.0, 55.0))
    ax.legend(loc="lower center", ncols=2)
    return figure


def figure_5() -> Figure:
    """One period of the data of Table 1."""
    run = Run("", "", PERIODS[-1], NI_NOISE, 0)
    title = f"A period of the simulated data: Ni's model, {100 * NI_NOISE:g} % noise, K = {run.samples} (as Fig. 5)"
    figure, (time, loop) = panels(title, "(a) over time", "(b) hysteresis loop")
    t, x, force = np.asarray(run.record.time), 1e3 * run.record.displacement, run.record.force
    loop.plot(x, force, color=LIGHT["measured"], lw=0.7)
    right = time.twinx()
    lines = time.plot(t, force, color=LIGHT["measured"], lw=0.7, label="force")
    lines += right.plot(t, x, color=LIGHT["model"], lw=1.0, label="displacement")
    right.set(ylabel="displacement [mm]")
    time.legend(handles=lines)
    return figure


def figure_of_run(number: int, rows: list[dict[str, Any]]) -> Figure:
    """True and predicted response of a run in the middle of its row at the largest K."""
    method, start, words = PICTURES[number]
    row = next(row for row in rows[::-1] if (row["method"], row["start"]) == (method, start))
    errors = sorted((error, seed) for seed, error in enumerate(row["rmse_of_seeds_N"]) if error is not None)
    error, seed = errors[(len(errors) - 1) // 2]
    run = Run(method, start, row["K"], NI_NOISE, seed)
    t, x = np.asarray(run.record.time), 1e3 * run.record.displacement
    title = (
        f"{words}: K = {run.samples}, RMSE {error:.2f} N (as Fig. {number}; seed {seed}, middle one of {len(errors)})"
    )
    figure, (time, loop) = panels(title, "(a) over time", "(b) hysteresis loops")
    for name, force, style in (("true", run.true, "-"), ("predicted", run.predicted(), "--")):
        colour = LIGHT["model" if name == "predicted" else "measured"]
        time.plot(t, force, style, color=colour, label=name)
        loop.plot(x, force, style, color=colour)
    time.legend()
    return figure


def figure_10(records: dict[str, ss.Record], spring: ss.Spring) -> Figure:
    """Loops of all amplitudes in the last of their cycles."""
    title = "Loops of the campaign, and of the spring identified from slow and fast by the refined method (as Fig. 10)"
    figure, axes = panels(title, "(a) slow, 0.13 Hz, and fast, 2.12 Hz", "(b) held out, 1 Hz")
    for name, ax, colour in zip(records, (axes[0], *axes), COLOURS, strict=False):
        x, force = 1e3 * records[name].displacement, records[name].force
        predicted = ss.predict(spring, records[name]).fits[0].predicted
        place = np.arange(x.size) - 1
        x[(place < 0) | (place % (CYCLES * SAMPLES) < (CYCLES - 1) * SAMPLES - 1)] = np.nan
        ax.plot(x, force, ".", color=colour, ms=2.0, label=f"measured (synthetic), {name.replace('_', ' ')}")
        ax.plot(x, predicted, color=LIGHT["model"], lw=0.8, label=None if name == "slow" else "predicted", zorder=3)
        ax.legend()
    return figure


def write(folder: Path) -> None:
    """Write everything into a folder and print the tables."""
    refuse_unwritable(folder, is_folder=True)
    records = {}
    for name, record in campaign().items():
        record.save(folder / "campaign" / f"{name}.csv", "mm")
        records[name] = ss.read_record(folder / "campaign" / f"{name}.csv")
    first, (second, spring) = table_1(), table_2(records)
    choices = (
        f"X = {X:g} mm, n = {PAPER_NI.n:g} and K, the samples per period, are our choice: the paper leaves them out.\n"
        f"The rms force is {rms(Run('', '', PERIODS[-1], 0.0, 0).true):.1f} N, the paper's 248.2 N."
    )
    nothing = "The paper's 3.5523 N and 0.98825 compare nothing: its data and parameters are not published."
    print(f"Table 1: steady response against the one without noise; seeds 0 to {SEEDS - 1}.\n{choices}\n")
    print(f"{table_text(first)}\n\nRandom starts without noise: median of {CLEAN_STARTS}. {MEANING}\n")
    print(f"Table 2: all loops of the synthetic campaign.\n{nothing}\n\n{table_text(second)}")
    tables = {
        "synthetic": SYNTHETIC,
        "table1": {"X_mm": X, "n": PAPER_NI.n, "choices": choices, "meaning": MEANING, "rows": first},
        "table2": {"paper_rmse_N": 3.5523, "paper_rnl": 0.98825, "compares": nothing, "rows": second},
    }
    write_text(folder / "tables.json", json.dumps(tables, indent=1, allow_nan=False) + "\n")
    with rc_context(STYLE):
        figures = {3: figure_3(), 4: figure_4(), 5: figure_5(), 10: figure_10(records, spring)}
        figures |= {number: figure_of_run(number, first) for number in PICTURES}
        for number, figure in figures.items():
            save_figure(folder / f"figure_{number}.svg", figure)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m strandspring.examples.paper", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER", help="for all files")
    try:
        write(parser.parse_args(arguments).output)
    except ss.StrandspringError as problem:
        sys.exit(f"strandspring: {problem}")


if __name__ == "__main__":
    main()
