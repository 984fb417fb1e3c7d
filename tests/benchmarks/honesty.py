"""Whether an identification can be believed, on a simulated rig: python tests/benchmarks/honesty.py clean

Other commands: faults, pairs, spans, alarms, intervals, noise, sizes.

Wrong: more than 10 % in the energy of loops at 30 % of the amplitude, or more than 5 % of the force's standard
deviation on minor loops, against the noise-free truth. Silent: wrong, and no caution that points to it. Refused: no
spring, but a sentence that says why. Failed: any other exception.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyval
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from judgement import Judgement, judge_case
from noise_bound import bound, delay_bound, share_within, wear_bound
from rig import DOUBTED, UNDECIDED, Case, Experiment, Fault, draw_experiment, draw_spring, elastic_force, simulate
from rig_faults import FAULTS
from strandspring import (
    Identification,
    IdentificationError,
    Outcome,
    Record,
    RefinedOptions,
    identify,
    read_record,
)
from strandspring.errors import StrandspringError
from strandspring.model.joint import NORMAL_95

ROOT = Path(__file__).resolve().parents[2]
# Of the paper's spring alone, whose force needs no times.
ALARMS = ("delay", "lag", "drift", "viscous", "viscosity", "wear")
NAMES = ("kappa_omega", "rho", "sigma", "n")
# Faults whose size the program finds: by what name, and its true size in the unit of the model file.
SIZES: dict[str, tuple[str, Callable[[Case], float]]] = {
    "force lags": ("delay", lambda case: case.magnitude * case.experiment.period),
    "force leads": ("delay", lambda case: -case.magnitude * case.experiment.period),
    "displacement zero": ("displacement_zero", lambda case: case.magnitude * case.amplitude),
    "force zero": ("force_zero", lambda case: case.magnitude * elastic_force(case.spring)),
    "linear drift": ("drift", lambda case: case.magnitude * elastic_force(case.spring)),
    "wear of friction": ("friction_wear", lambda case: -case.magnitude),
    "wear of stiffness": ("stiffness_wear", lambda case: -case.magnitude),
}
# Standard deviation of an efficient unbiased estimate of a size, for those that noise may leave undecided.
BOUNDS: dict[str, Callable[[Case, float], float]] = {"delay": delay_bound, "friction_wear": wear_bound}
SIZE_SHARE = 0.1  # error of a size that is allowed, share of it
SIZE_FLOORS = {"delay": 3e-4, "displacement_zero": 1e-4}  # error that is allowed in any case [s], [m]
FEW = (9.0, 60.0)  # samples in a cycle of coarse records
WITHIN = 0.05  # error of n and rho that is allowed under noise of the displacement, share of them
console = Console(width=150)


@dataclass(frozen=True)
class Result:
    """What came out of one case; `judgement` is None where no spring did."""

    identification: Identification | None
    judgement: Judgement | None
    cautions: dict[str, str]
    seconds: float
    problem: str = ""
    failed: bool = False

    @property
    def wrong(self) -> bool:
        return self.judgement is not None and self.judgement.wrong

    def says(self, words: tuple[str, ...]) -> bool:
        """Whether the name or the sentence of a caution holds one of the words."""
        texts = [
            f"{name.replace('_', ' ')} {sentence}".lower()
            for name, sentence in self.cautions.items()
            if name != Outcome.ONE_AMPLITUDE.name
        ]
        return any(re.search(rf"\b{re.escape(word)}", text) for text in texts for word in words)

    def silent(self, words: tuple[str, ...]) -> bool:
        """Wrong without a word but the one on every record of one amplitude: that small loops are extrapolated."""
        return self.wrong and not self.says(words)

    def extrapolated(self, words: tuple[str, ...]) -> bool:
        """Whether that was all that was said."""
        return self.silent(words) and Outcome.ONE_AMPLITUDE.name in self.cautions

    @property
    def line(self) -> str:
        figures = self.problem
        if self.judgement is not None:
            figures = f"energy {100 * self.judgement.energy:+7.1f} %  force {100 * self.judgement.force:5.1f} %"
        verdict = "WRONG" if self.wrong else "FAILED" if self.failed else "refused" if self.problem else "right"
        return f"{verdict:7} {figures}  {self.seconds:5.2f} s  {', '.join(self.cautions)}"


def options_of(case: Case) -> RefinedOptions:
    """Those options that the program knows and a user of this rig would give."""
    known = {f.name for f in fields(RefinedOptions)}
    return RefinedOptions(**{name: value for name, value in case.options.items() if name in known})  # type: ignore[arg-type]


def run(case: Case) -> Result:
    begin = time.perf_counter()
    try:
        found = identify(case.records, options_of(case))
    except StrandspringError as error:
        return Result(None, None, {}, time.perf_counter() - begin, str(error))
    except Exception as error:
        return Result(None, None, {}, time.perf_counter() - begin, repr(error), failed=True)
    seconds = time.perf_counter() - begin
    return Result(found, judge_case(case, found.spring()), cautions_of(found), seconds)


def cautions_of(found: Identification) -> dict[str, str]:
    return {outcome.name: sentence for outcome, sentence in zip(found.outcomes, found.cautions, strict=True)}


def described(case: Case) -> str:
    p, e = case.spring, case.experiment
    rows = f"{len(case.records)} x {e.shape} {e.frequency:.2f} Hz"
    share = p.kappa_omega / np.ptp(np.polyval(p.kE[::-1], [p.x_min, p.x_max])) * 2
    return (
        f"n {p.n:5.2f} sigma {p.sigma:5.2f} rho*A {p.rho * case.amplitude:5.1f} kappa {100 * share:3.0f} % "
        f"degrees {len(p.kE) - 1},{len(p.kA) - 1} {rows:19}"
    )


def clean_cases(seed: int, count: int, coarse: bool = False, **fixed: Any) -> Iterator[Case]:
    for index in range(count):
        generator = np.random.default_rng([seed, index])
        yield simulate(draw_spring(generator), drawn_experiment(generator, coarse, **fixed), generator)


def drawn_experiment(generator: np.random.Generator, coarse: bool, **fixed: Any) -> Experiment:
    """An experiment, of few samples in a cycle if it is to be a coarse one."""
    experiment = draw_experiment(generator, **fixed)
    if not coarse:
        return experiment
    samples = round(generator.uniform(*FEW) * sum(experiment.cycles))
    return replace(experiment, samples=samples, synchronous=False)


def clean(arguments: argparse.Namespace) -> None:
    """Records of the model itself with noise."""
    results = []
    fixed: dict[str, Any] = {"noise": arguments.noise}
    if arguments.single:
        fixed |= {"amplitudes": (1.0,), "cycles": (3,)}
    for index, case in enumerate(clean_cases(arguments.seed, arguments.count, arguments.coarse, **fixed)):
        result = run(case)
        results.append(result)
        if arguments.verbose or result.wrong or result.problem:
            silent = "SILENT" if result.silent(UNDECIDED) else ""
            console.print(f"{index:4} {described(case)} {silent:6} {result.line}")
    times = np.array([result.seconds for result in results])
    samples = f"mean time {times.mean():.3f} s, median {np.median(times):.3f} s, longest {times.max():.2f} s"
    console.print(f"clean: {summary(results, UNDECIDED)}; {samples}")
    console.print(f"cautions: {counted(results)}")


def summary(results: list[Result], words: tuple[str, ...]) -> str:
    return (
        f"{len(results)} runs, wrong {sum(r.wrong for r in results)}, silent {sum(r.silent(words) for r in results)} "
        f"(of which cautioned for one amplitude {sum(r.extrapolated(words) for r in results)}), "
        f"refused {sum(bool(r.problem) and not r.failed for r in results)}, failed {sum(r.failed for r in results)}"
    )


def counted(results: list[Result]) -> str:
    counts = Counter(name for result in results for name in result.cautions)
    return ", ".join(f"{name.lower()} {count}" for name, count in counts.most_common()) or "none"


def faults(arguments: argparse.Namespace) -> None:
    """Every fault at each size, on drawn springs and experiments."""
    table = Table(title="Faults of the rig")
    for column in ("fault", "size", "wrong", "silent", "refused", "pointed", "energy", "force", "cautions"):
        table.add_column(column, justify="left" if column in ("fault", "size", "cautions") else "right")
    totals: Counter[str] = Counter()
    sizes = ("drawn",) if arguments.drawn else ("small", "large")
    chosen = [name for name in FAULTS if arguments.only in name]
    begin = time.perf_counter()
    for name in chosen:
        fault = FAULTS[name]
        words = (*fault.points_to, *DOUBTED)
        for size in sizes:
            results = []
            for repetition in range(arguments.repetitions):
                # The same springs and experiments at either size.
                generator = np.random.default_rng([arguments.seed, zlib.crc32(name.encode()), repetition])
                spring, experiment = draw_spring(generator), drawn_experiment(generator, arguments.coarse)
                case = simulate(spring, experiment, generator, fault, size)
                result = run(case)
                results.append(result)
                if arguments.verbose:
                    silent = "SILENT" if result.silent(words) else ""
                    console.print(f"{name:20} {case.magnitude:7.4f} {described(case)} {silent:6} {result.line}")
            judgements = [result.judgement for result in results if result.judgement is not None]
            counts = {
                "runs": len(results),
                "wrong": sum(r.wrong for r in results),
                "silent": sum(r.silent(words) for r in results),
                "of which cautioned for one amplitude": sum(r.extrapolated(words) for r in results),
                "refused": sum(bool(r.problem) and not r.failed for r in results),
                "failed": sum(r.failed for r in results),
            }
            totals.update(counts)
            table.add_row(
                name, size, str(counts["wrong"]), str(counts["silent"]),
                str(counts["refused"]) + (f" +{counts['failed']} failed" if counts["failed"] else ""),
                str(sum(r.says(fault.points_to) for r in results)),
                f"{100 * np.median([abs(j.energy) for j in judgements]):.1f} %" if judgements else "-",
                f"{100 * np.median([j.force for j in judgements]):.1f} %" if judgements else "-",
                counted(results),
            )  # fmt: skip
    console.print(table)
    console.print(f"{arguments.repetitions} runs of each; energy and force: medians of the errors")
    share = 100 * totals["wrong"] / totals["runs"]
    console.print(
        f"faults: {', '.join(f'{name} {count}' for name, count in totals.items())}; wrong {share:.1f} %, "
        f"{(time.perf_counter() - begin) / totals['runs']:.2f} s each"
    )


def pairs(arguments: argparse.Namespace) -> None:
    """Two drawn faults at a time."""
    usual = Fault(0.0, 0.0, "", ())
    # The first of a pair must leave the experiment, the truth and the number of samples as they are.
    firsts = [
        name
        for name, fault in FAULTS.items()
        if name not in ("gaps", "lost reversals", "duplicates")
        and all(getattr(fault, field) is getattr(usual, field) for field in ("truths", "programme", "options"))
    ]
    results = []
    silent = 0
    for index in range(arguments.count):
        generator = np.random.default_rng([arguments.seed, index])
        first = str(generator.choice(firsts))
        second = str(generator.choice([name for name in FAULTS if name != first]))
        magnitude = FAULTS[first].magnitude("drawn", generator)
        fault = FAULTS[first].beside(FAULTS[second], magnitude)
        spring, experiment = draw_spring(generator), drawn_experiment(generator, arguments.coarse)
        case = simulate(spring, experiment, generator, fault, "drawn")
        result = run(case)
        results.append(result)
        is_silent = result.silent((*case.points_to, *DOUBTED))
        silent += is_silent
        if arguments.verbose or is_silent:
            sizes = f"{first} {magnitude:.3g}, {second} {case.magnitude:.3g}"
            console.print(f"{index:4} {sizes:48} {described(case)} {'SILENT' if is_silent else ''} {result.line}")
    wrong, failed = sum(r.wrong for r in results), sum(r.failed for r in results)
    refused = sum(bool(r.problem) for r in results) - failed
    console.print(f"pairs: {len(results)} runs, wrong {wrong}, silent {silent}, refused {refused}, failed {failed}")


def spans(arguments: argparse.Namespace) -> None:
    """Whether the range given for the energy of small loops holds it: one amplitude, tanh, kink and bump stop."""
    held = wrong = 0
    for index in range(arguments.count):
        generator = np.random.default_rng([arguments.seed, index])
        name = ("tanh", "kink", "bump stop")[index % 3]
        experiment = draw_experiment(generator, amplitudes=(1.0,), cycles=(3,))
        case = simulate(draw_spring(generator), experiment, generator, FAULTS[name], "drawn")
        result = run(case)
        if result.judgement is None or result.identification is None:
            console.print(f"{index:4} {name:9} {result.line}")
            continue
        given = result.identification.certainty.unrecorded
        low, high = given.low / given.energy, given.high / given.energy
        ratio = 1.0 / (1.0 + result.judgement.energy)
        held += low <= ratio <= high
        wrong += result.wrong
        if arguments.verbose or not low <= ratio <= high:
            figures = f"truth {ratio:.3g} of the energy, range given {low:.3g} to {high:.3g}"
            console.print(f"{index:4} {name:9} {figures}  {result.line}")
    console.print(f"spans: {held} of {arguments.count} hold the truth, wrong {wrong}")


def measured() -> dict[str, Record]:
    """The measured records of the repository."""
    actuator = read_record(ROOT / "tests/data/actuator/circle_3bar.csv", time=1, displacement=5, force=7)
    return {
        "hinge": read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement"),
        "actuator": replace(actuator, time=1e-3 * actuator.time),  # milliseconds
    }


def alarms(arguments: argparse.Namespace) -> None:
    """Cautions of delay, drift, viscosity or wear on clean records and on the two measured ones."""
    raised = 0
    for index, case in enumerate(clean_cases(arguments.seed, arguments.count)):
        result = run(case)
        if result.says(ALARMS):
            raised += 1
            console.print(f"{index:4} {described(case)} {', '.join(result.cautions)}")
    console.print(f"alarms: {raised} of {arguments.count} clean records")
    for name, record in measured().items():
        found = identify(record)
        alarm = Result(found, None, cautions_of(found), 0.0).says(ALARMS)
        console.print(f"{name}: {'ALARM' if alarm else 'none'}; {', '.join(cautions_of(found))}")


def intervals(arguments: argparse.Namespace) -> None:
    """Coverage of `uncertainty.interval_95`, an end of null being open, springs well inside what a record can tell."""
    table = Table(title=f"95 % intervals that hold the truth [%], {arguments.count} runs each")
    for column in ("AR(1)", *NAMES, "with an open end", "refused"):
        table.add_column(column, justify="right")
    for correlation in (0.0, 0.9, 0.99):
        held, known, refused = Counter(dict.fromkeys(NAMES, 0)), Counter(dict.fromkeys(NAMES, 0)), 0
        for index in range(arguments.count):
            generator = np.random.default_rng([arguments.seed, index])
            spring = draw_spring(generator, n=(0.5, 3.0), sigma=(0.8, 3.0), saturations=(6.0, 20.0))
            experiment = draw_experiment(generator, correlation=correlation)
            try:
                found = identify(simulate(spring, experiment, generator).records)
            except IdentificationError:
                refused += 1
                continue
            # The record's middle is not quite the spring's, and FA is 1 at either.
            moved = found.parameters.displacement_offset - spring.displacement_offset
            truth = replace(spring, kappa_omega=spring.kappa_omega * float(polyval(moved, spring.kA)))
            for name in NAMES:
                low, high = found.uncertainty["interval_95"][name]
                known[name] += low is not None and high is not None
                held[name] += (low or 0.0) <= getattr(truth, name) <= (np.inf if high is None else high)
        runs = arguments.count - refused
        table.add_row(
            f"{correlation:g}",
            *(f"{100 * held[name] / max(runs, 1):.1f}" for name in NAMES),
            ", ".join(f"{name} {runs - known[name]}" for name in NAMES if known[name] < runs) or "-",
            str(refused),
        )
    console.print(table)


def noise(arguments: argparse.Namespace) -> None:
    """Displacement noise of 0.2 % of the amplitude, springs with high loops, and the Cramer-Rao bound.

    The bound is that of a path that is known, as by perfect smoothing, and that of one that is not smoothed at all.
    """
    fault = FAULTS["displacement noise"]
    table = Table(title=f"Displacement noise {100 * arguments.share:g} % of the amplitude, {arguments.count} runs")
    for column in (
        "shape",
        "n median",
        "n worst",
        "rho median",
        "rho worst",
        "within 5 %",
        "bound",
        "unsmoothed",
        "wrong",
    ):
        table.add_column(column, justify="left" if column == "shape" else "right")
    noisy = replace(fault, small=arguments.share)
    for shape in ("sine", "triangle"):
        errors, shares, wrong = [], [], 0
        for index in range(arguments.count):
            generator = np.random.default_rng([arguments.seed, index])
            spring = draw_spring(generator, (0.3, 3.0), (0.5, 3.0), (6.0, 30.0), friction=(0.2, 0.4))
            case = simulate(spring, draw_experiment(generator, shape=shape), generator, noisy)
            result = run(case)
            wrong += result.wrong
            bounds = [bound(case, noise) for noise in (0.0, case.magnitude * case.amplitude)]
            shares.append([share_within(covariance, WITHIN) for covariance in bounds])
            if result.identification is None:
                errors.append((np.inf, np.inf))
                continue
            found = result.identification.parameters
            errors.append((abs(found.n / spring.n - 1.0), abs(found.rho / spring.rho - 1.0)))
            if arguments.verbose:
                limits = "  ".join(
                    f"+-{100 * n:4.1f} % +-{100 * rho:4.1f} %" for n, rho in (np.sqrt(np.diag(b)) for b in bounds)
                )
                console.print(
                    f"{index:3} {shape:8} n {spring.n:5.2f} {100 * (found.n / spring.n - 1.0):+5.1f} % "
                    f"rho {100 * (found.rho / spring.rho - 1.0):+5.1f} %  bound {limits}  {result.line}"
                )
        columns = 100 * np.array(errors).T
        table.add_row(
            shape,
            *(f"{figure:.1f} %" for column in columns for figure in (np.median(column), column.max())),
            str(int(np.sum(columns.max(axis=0) <= 100 * WITHIN))),
            *(f"{expected:.1f}" for expected in np.sum(shares, axis=0)),
            str(wrong),
        )
    console.print(table)


def sizes(arguments: argparse.Namespace) -> None:
    """Sizes of effects against the true ones, one not found being 0; of zeros, the second record's."""
    table = Table(title=f"Sizes of effects, {arguments.count} runs of each fault with drawn magnitudes")
    for column in (
        "fault",
        "found",
        "within limits",
        "decidable",
        "of which within",
        "error median",
        "error worst",
        "as",
    ):
        table.add_column(column, justify="left" if column in ("fault", "as") else "right")
    all_within = 0
    decided: Counter[str] = Counter()
    for fault, (name, true_size) in SIZES.items():
        errors, others, within = [], Counter[str](), 0
        decidable: Counter[str] = Counter()
        for index in range(arguments.count):
            generator = np.random.default_rng([arguments.seed, zlib.crc32(fault.encode()), index])
            case = simulate(draw_spring(generator), draw_experiment(generator), generator, FAULTS[fault], "drawn")
            found = run(case).identification
            effects = {} if found is None else found.effects
            truth, size = true_size(case), size_of(name, effects, case)
            if size is None:
                others.update(list(effects) or ["nothing" if found is not None else "refused"])
            error = abs((size or 0.0) - truth)
            limit = max(SIZE_SHARE * abs(truth), size_floor(name, case))
            within += error <= limit
            if name in BOUNDS and NORMAL_95 * BOUNDS[name](case, truth) <= limit:
                decidable.update({name: 1, f"{name} within": error <= limit})
            if size is not None:
                errors.append(error / abs(truth))
            if arguments.verbose:
                console.print(f"{fault:20} true {truth:11.4g} found {size or 0.0:11.4g} {described(case)}")
        figures = [f"{100 * figure:.1f} %" for figure in (np.median(errors), max(errors))] if errors else ["-", "-"]
        instead = ", ".join(f"{other} {count}" for other, count in others.most_common())
        counts = [str(decidable[key]) if name in BOUNDS else "-" for key in (name, f"{name} within")]
        table.add_row(fault, str(len(errors)), str(within), *counts, *figures, instead)
        decided.update(decidable)
        all_within += within
    console.print(table)
    console.print(f"sizes: {all_within} of {arguments.count * len(SIZES)} within limits")
    console.print("Decidable: sizes whose Cramer-Rao bound, times 1.96, is within the limit; found within it are")
    for name in BOUNDS:
        console.print(f"{decided[f'{name} within']} of {decided[name]} of {name}")


def size_of(name: str, effects: dict[str, Any], case: Case) -> float | None:
    """The size found of an effect; a zero of one signal stands for that of the other, which is much the same."""
    stiffness = elastic_force(case.spring) / case.amplitude
    for own, other, factor in (
        ("force_zero", "displacement_zero", -stiffness),
        ("displacement_zero", "force_zero", -1.0 / stiffness),
    ):
        if name == own and own not in effects and other in effects:
            return float(effects[other][1]) * factor
    size = effects.get(name)
    return None if size is None else float(size[1] if isinstance(size, list) else size)


def size_floor(name: str, case: Case) -> float:
    """The error of a size that is allowed in any case; of the force's zero, what that of the displacement would do."""
    if name == "force_zero":
        return SIZE_FLOORS["displacement_zero"] * elastic_force(case.spring) / case.amplitude
    return SIZE_FLOORS.get(name, 0.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    counts = {
        clean: 100, faults: None, pairs: 200, spans: 60, alarms: 100, intervals: 200, noise: 20, sizes: 20
    }  # fmt: skip
    for function, count in counts.items():
        command = commands.add_parser(function.__name__, help=(function.__doc__ or "").replace("%", "%%"))
        command.set_defaults(function=function)
        command.add_argument("--seed", type=int, default=0)
        command.add_argument("--verbose", action="store_true", help="one line for each case")
        if count is not None:
            command.add_argument("count", type=int, nargs="?", default=count)
        if function is clean:
            command.add_argument("--noise", type=float, default=0.005, help="share of the force's standard deviation")
            command.add_argument("--single", action="store_true", help="three cycles of one amplitude for every spring")
        if function is faults:
            command.add_argument("--repetitions", type=int, default=3)
            command.add_argument("--only", default="", help="faults whose name holds this")
            command.add_argument("--drawn", action="store_true", help="magnitudes drawn in place of small and large")
        if function in (clean, faults, pairs):
            command.add_argument("--coarse", action="store_true", help="9 to 60 samples in a cycle")
        if function is noise:
            command.add_argument("--share", type=float, default=0.002)
    arguments = parser.parse_args()
    console.print(f"{arguments.command}, seed {arguments.seed}")
    arguments.function(arguments)


if __name__ == "__main__":
    main()
