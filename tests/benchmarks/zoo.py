"""Whether an identification is honest about mounts that are none of its own: python tests/benchmarks/zoo.py run

Commands: run, heldout, measured, own, lab.

Drawn mounts of other classes (tests/helpers/zoo_mounts.py) with one, two and three amplitudes, half of them with a
small fault of the rig. The truth is the mount itself, without fault and noise, driven by the true displacement.

Energy off: the loop energy of the saved spring at a recorded amplitude, along the displacement as recorded, errs by
more than 5 %; "as recorded" counts those that keep the energy of the loop as measured, fault included. Minor off: on
minor loops after the test its force errs by more than 5 % of the force's standard deviation, no offset removed. Silent:
off, and no caution says so: for energy one that gives a difference of the loops' energy or of the force of the right
size (to a factor of 2); for minor loops one that speaks of small or nested loops, another class, a misfit or what the
records leave open. Range: what is given for the energy of loops at 30 % of the amplitude.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
import zlib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from honesty import cautions_of, clean_cases, described
from honesty import measured as measured_records

from oracles import OracleSpring
from rig import FloatArray, draw_experiment, draw_spring
from strandspring import Record, RefinedOptions, identify, read_record
from strandspring.errors import StrandspringError
from strandspring.loops.strokes import find_strokes
from zoo_mounts import DRAWS
from zoo_rig import FORCE_SHIFTS, ZooCase, draw_case, lab_like, own_case, without_times

ROOT = Path(__file__).resolve().parents[2]
WRONG = 0.05  # of a loop's energy, and of the force's standard deviation on minor loops
FACTOR = 2.0  # to which the size of a difference must be given
# Nested loops after the test, in amplitudes: +0.6 to -0.2 and back, 0.3 about 0, 0.3 about +0.5.
NESTED = (0.6, -0.2, 0.6, -0.3, 0.3, -0.3, 0.3, 0.2, 0.8, 0.2, 0.8)
# Cautions that say that loops unlike the recorded ones are open, by name or by the words of their sentences.
OPEN = {
    "SMALL_LOOPS", "ONE_AMPLITUDE", "OTHER_CLASS", "LACK_OF_FIT", "POOR_FIT", "NO_STEADY_SECTION", "SIGMA_AT_BOUND",
    "N_AT_BOUND",
}  # fmt: skip
OPEN_WORDS = ("small loops", "minor loops", "nested", "another class", "misfit", "smaller ones", "rate")
# Percentages that are no sizes of a difference.
_OTHER_SHARES = re.compile(r"[-+.\d]+ % (?:of (?:the|that|its) (?:amplitude|range|period)|interval|prediction)")
_PERCENT = re.compile(r"(\d+(?:\.\d+)?) %")
# Cautions that are never true of a clean spring of the own class on a sound rig.
UNTRUE = {
    "DELAY", "PLAY", "VISCOSITY", "DRIFT", "DRIFT_REMOVED", "FRICTION_WEAR", "STIFFNESS_WEAR", "FORCE_ZERO",
    "DISPLACEMENT_ZERO", "DWELLS", "GAPS", "CLIPPED", "SPIKES", "OTHER_CLASS", "LACK_OF_FIT", "POOR_FIT",
    "FIRST_CYCLE_DIFFERS", "RANGE_WITH_GAPS", "DISPLACEMENT_NOISE", "INTERVAL_TOO_NARROW", "AMPLIFIER_REDUCED",
    "NI_MODEL",
}  # fmt: skip
# Statements about what the data decide.
DATA = {
    "SMALL_LOOPS", "INDISTINCT", "NO_STEADY_SECTION", "SIGMA_AT_BOUND", "N_AT_BOUND", "ONE_AMPLITUDE", "NOT_CONVERGED",
}  # fmt: skip
FINE_SAMPLING = 100  # samples in a cycle from which cautions about coarse ones are untrue
console = Console(width=170)


@dataclass(frozen=True, eq=False)
class Result:
    """What came out of one case.

    Attributes
    ----------
    case : ZooCase
    cautions : dict             Names of outcomes with their sentences.
    effects : tuple of str      What was removed.
    energies : tuple of float   For each amplitude the energy of the spring's loops over that of the mount's.
    recorded : tuple of float   The same, over the energy of the loops as measured.
    force : float               rms error along the records, share of the force's standard deviation.
    minor : float               The same on nested loops.
    small : (float, float, float)   True energy of small loops, and the range given for it [J].
    seconds : float
    problem : str               Why there is no spring.
    """

    case: ZooCase
    cautions: dict[str, str]
    effects: tuple[str, ...]
    energies: tuple[float, ...]
    recorded: tuple[float, ...]
    force: float
    minor: float
    small: tuple[float, float, float]
    seconds: float
    problem: str = ""

    @property
    def energy_error(self) -> float:
        """The largest of the errors of the energies."""
        return max((abs(ratio - 1.0) for ratio in self.energies), default=0.0)

    @property
    def energy_off(self) -> bool:
        return self.energy_error > WRONG

    @property
    def energy_silent(self) -> bool:
        return self.energy_off and not names_size(self.cautions.values(), self.energy_error, self.force)

    @property
    def as_recorded(self) -> bool:
        """Whether the spring keeps the energies of the loops as measured."""
        return max((abs(ratio - 1.0) for ratio in self.recorded), default=0.0) <= WRONG

    @property
    def minor_off(self) -> bool:
        return self.minor > WRONG

    @property
    def minor_silent(self) -> bool:
        return self.minor_off and not (speaks_of_loops(self.cautions) or self.says_changes)

    @property
    def says_changes(self) -> bool:
        """Whether a mount that changes is said to do so, and the change was left in."""
        kept = not any("wear" in effect for effect in self.effects)
        return self.case.mount.changes and kept and any("cycle to cycle" in s for s in self.cautions.values())

    @property
    def held(self) -> bool:
        true, low, high = self.small
        return low <= true <= high

    @property
    def line(self) -> str:
        e, fault = self.case.experiment, f"{self.case.fault} {self.case.magnitude:.2g}" if self.case.fault else "-"
        head = f"{self.case.name:20} {self.case.amplitudes} {e.shape:8} {e.frequency:4.2f} Hz {fault:26}"
        if self.problem:
            return f"{head} refused: {self.problem[:90]}"
        ratios = " ".join(f"{ratio:.2f}" for ratio in self.energies)
        true, low, high = self.small
        marks = f"{'E-SILENT' if self.energy_silent else 'e-off' if self.energy_off else '':8} "
        marks += f"{'M-SILENT' if self.minor_silent else 'm-off' if self.minor_off else '':8}"
        span = f"{low / true:.2f}..{high / true:.2f}{'' if self.held else ' MISSED'}"
        taken_out = f" out: {', '.join(self.effects)};" if self.effects else ""
        return (
            f"{head} {marks} energy {ratios:14} force {100 * self.force:4.1f} % minor {100 * self.minor:5.1f} % "
            f"range {span:18} {self.seconds:4.1f} s{taken_out} {', '.join(self.cautions)}"
        )


def names_size(sentences: Iterable[str], energy: float, force: float) -> bool:
    """Whether a clause about an energy or a force gives a difference like these: of the energy, and of the force."""
    for sentence in sentences:
        for clause in re.split(r"[;()]|[.,:] ", _OTHER_SHARES.sub("", sentence)):
            for words, size in ((("energy", "energies"), energy), (("force",), force)):
                if any(word in clause.lower() for word in words):
                    given = [float(share) / 100.0 for share in _PERCENT.findall(clause)]
                    if any(size / FACTOR <= share <= size * FACTOR for share in given):
                        return True
    return False


def speaks_of_loops(cautions: dict[str, str]) -> bool:
    """Whether a caution leaves loops unlike the recorded ones open."""
    return any(
        name in OPEN or any(re.search(rf"\b{word}", sentence.lower()) for word in OPEN_WORDS)
        for name, sentence in cautions.items()
    )


def judged(case: ZooCase) -> Result:
    begin = time.perf_counter()
    try:
        found = identify(case.records)
    except Exception as error:
        # Refused, or failed if it is none of the package's own.
        problem = str(error).partition(": ")[2] if isinstance(error, StrandspringError) else f"FAILED {error!r}"
        return Result(case, {}, (), (), (), 0.0, 0.0, (np.nan,) * 3, time.perf_counter() - begin, problem)
    seconds = time.perf_counter() - begin
    spring = found.spring()
    own = [
        spring.response(record.displacement, fit.omega_start, record.time)
        for record, fit in zip(case.records, found.fits, strict=True)
    ]
    energies, recorded = [], []
    for _, cycles in case.loops():
        sums = np.zeros(3)
        for record, force, clean, samples in zip(case.records, own, case.clean, cycles, strict=True):
            for at in samples:
                x = record.displacement[at]
                sums += [closed(force[at], x), closed(clean[1][at], clean[0][at]), closed(record.force[at], x)]
        energies.append(float(sums[0] / sums[1]))
        recorded.append(float(sums[0] / sums[2]))
    # What lies before the first sample compared only sets the memory.
    errors = np.concatenate(
        [(force - clean[1])[fit.first_sample :] for force, clean, fit in zip(own, case.clean, found.fits, strict=True)]
    )
    free = case.fault in FORCE_SHIFTS
    path, times, added = case.after(NESTED)
    minor = (spring.response(path, time=times) - case.mount.force(path, times))[added]
    return Result(
        case,
        cautions_of(found),
        tuple(found.effects),
        tuple(energies),
        tuple(recorded),
        deviation(errors, free) / case.scale,
        deviation(minor, free) / case.scale,
        (case.small_energy(), found.certainty.unrecorded.low, found.certainty.unrecorded.high),
        seconds,
    )


def closed(force: FloatArray, displacement: FloatArray) -> float:
    """Energy of a cycle [J], its ends joined."""
    return (
        float(np.trapezoid(np.append(force, force[:1]), np.append(displacement, displacement[:1])))
        if len(force)
        else 0.0
    )


def deviation(errors: FloatArray, free: bool) -> float:
    """Root mean square of errors, of their deviations from the mean if what the force is counted from is free."""
    return float(np.std(errors) if free else np.sqrt(np.mean(errors**2)))


def cases(arguments: argparse.Namespace) -> Iterable[ZooCase]:
    for name in DRAWS:
        if arguments.only in name:
            for index in range(3 * arguments.count):
                yield draw_case(name, arguments.seed, index)


def run(arguments: argparse.Namespace) -> None:
    """Energies, nested loops and given ranges, `count` cases of every mount and number of amplitudes."""
    results = []
    for case in cases(arguments):
        result = judged(case)
        results.append(result)
        if arguments.verbose or result.energy_silent or result.minor_silent or result.problem:
            console.print(result.line, soft_wrap=True)
    table = Table(title=f"{arguments.count} records of each mount and number of amplitudes, half of them with a fault")
    columns = (
        "mount", "amplitudes", "refused", "energy off", "silent", "of which as recorded", "energy worst", "minor off",
        "silent", "minor median", "ranges held", "removed",
    )  # fmt: skip
    for column in columns:
        is_text = column in ("mount", "removed")
        table.add_column(column, justify="left" if is_text else "right", no_wrap=column == "mount")
    names = [name for name in DRAWS if arguments.only in name]
    groups = [(name, k) for name in names for k in (1, 2, 3)] + [("all", k) for k in (1, 2, 3)]
    for name, amplitudes in groups:
        if name == "all" and amplitudes == 1:
            table.add_section()
        chosen = [r for r in results if r.case.name in (name, *names * (name == "all"))]
        chosen = [r for r in chosen if r.case.amplitudes == amplitudes]
        table.add_row(name, str(amplitudes), *summary(chosen))
    console.print(table)
    for kind, chosen in (
        ("without a fault", [r for r in results if not r.case.fault]),
        ("with a fault", [r for r in results if r.case.fault]),
        ("mounts that change from cycle to cycle", [r for r in results if r.case.mount.changes]),
        ("mounts that do not", [r for r in results if not r.case.mount.changes]),
        ("with effects removed", [r for r in results if r.effects]),
        ("with nothing removed", [r for r in results if not r.effects]),
    ):
        cells = summary(chosen)
        pairs = ", ".join(f"{column} {cell}" for column, cell in zip(columns[2:], cells, strict=True))
        console.print(f"{kind}: {len(chosen)} records, {pairs}")
    counts = Counter(name for result in results for name in result.cautions)
    console.print(f"cautions: {', '.join(f'{name.lower()} {count}' for name, count in counts.most_common())}")


def summary(results: Sequence[Result]) -> list[str]:
    springs = [r for r in results if not r.problem]
    counts = Counter(effect for r in springs for effect in r.effects)
    silent = [r for r in springs if r.energy_silent]
    return [
        str(len(results) - len(springs)),
        str(sum(r.energy_off for r in springs)),
        str(len(silent)),
        str(sum(r.as_recorded for r in silent)),
        f"{100 * max((r.energy_error for r in springs), default=0.0):.0f} %",
        str(sum(r.minor_off for r in springs)),
        str(sum(r.minor_silent for r in springs)),
        f"{100 * np.median([r.minor for r in springs]):.1f} %" if springs else "-",
        f"{sum(r.held for r in springs)} of {len(springs)}",
        ", ".join(f"{name} {count}" for name, count in counts.most_common()),
    ]


# Held-out strokes


def without_last_quarter(record: Record) -> tuple[Record, int]:
    """The record without its last quarter of strokes, and how many samples that leaves."""
    turning = find_strokes(record.displacement).turning
    strokes = turning.size - 1
    end = int(turning[strokes - max(1, round(0.25 * strokes))]) + 1
    time = None if record.time is None else record.time[:end]
    return replace(record, displacement=record.displacement[:end], force=record.force[:end], time=time), end


def held_out_error(records: Sequence[Record], **options: Any) -> float:
    """Error on the last quarter of the last record's strokes of a spring identified without them; NaN if refused.

    rms over the samples as a share of the force's standard deviation on that record, path run through the whole record.
    """
    *others, last = records
    first, end = without_last_quarter(last)
    try:
        found = identify([*others, first], RefinedOptions(**options))
    except StrandspringError:
        return float("nan")
    force = found.spring().response(last.displacement, found.fits[-1].omega_start, last.time)
    return float(np.sqrt(np.mean((force - last.force)[end:] ** 2)) / np.std(last.force))


def variants(records: Sequence[Record]) -> dict[str, float]:
    """The error held out with times and without them."""
    errors = {"with time": held_out_error(records)} if records[0].time is not None else {}
    errors["without time"] = held_out_error(without_times(records))
    return errors


def ratio(errors: dict[str, float], own: str, other: str) -> float:
    return errors.get(own, float("nan")) / errors.get(other, float("nan"))


def heldout(arguments: argparse.Namespace) -> None:
    """Errors on strokes that were held out, with and without times."""
    table = Table(title="Error on the last quarter of the strokes, held out; medians, and how often one is worse")
    for column in (
        "mount",
        "records",
        "with time",
        "without",
        "time worse by a tenth",
    ):
        table.add_column(column, justify="left" if column == "mount" else "right")
    every: list[dict[str, float]] = []
    for name in [name for name in DRAWS if arguments.only in name]:
        rows = []
        for index in range(3 * arguments.count):
            case = draw_case(name, arguments.seed, index)
            if case.fault in ("gaps", "outliers", "clipped force"):
                continue  # what is held out would hold the fault
            rows.append(variants(case.records))
            if arguments.verbose:
                shown = ", ".join(f"{key} {100 * error:.1f} %" for key, error in rows[-1].items())
                console.print(f"{name:20} {index:3} {case.amplitudes} {case.fault:22} {shown}")
        every += rows
        table.add_row(name, *held_out_cells(rows))
    table.add_section()
    table.add_row("all", *held_out_cells(every))
    console.print(table)


def held_out_cells(rows: Sequence[dict[str, float]]) -> list[str]:
    def median(key: str) -> str:
        errors = [row[key] for row in rows if key in row]
        return f"{100 * np.nanmedian(errors):.1f} %" if errors else "-"

    worse = sum(ratio(row, "with time", "without time") > 1.1 for row in rows)
    return [str(len(rows)), median("with time"), median("without time"), str(worse)]


# Measured records


def at_hand() -> dict[str, Record]:
    """The measured records of the repository; those of a second programme are a degrading column and an MR damper."""
    return {
        **measured_records(),
        "degrading column": read_record(ROOT / "tests/data/degrading/SPC1.csv"),
        "MR damper": read_record(
            ROOT / "tests/data/mr_damper/ensaio1.mat", time="Tout", displacement="dist", force="forc"
        ),
    }


def measured(arguments: argparse.Namespace) -> None:
    """The saved spring along every measured record as recorded, integrated independently, and held-out errors."""
    table = Table(title="Measured records: the saved spring alone along the record as recorded, by an ODE solver")
    columns = ("record", "RNL given", "RNL", "energy", "with time", "without", "removed", "cautions")
    for column in columns:
        table.add_column(column, justify="left" if column in ("record", "removed", "cautions") else "right")
    for name, record in at_hand().items():
        if arguments.only not in name:
            continue
        found = identify(record)
        (fit,) = found.fits
        # The table of the report is of what the file holds.
        oracle = OracleSpring(found.model_file().parameters.as_dict())
        force = oracle.force(record.displacement, fit.omega_start, record.time)
        used = slice(fit.first_sample, None)
        x, r, p = record.displacement[used], record.force[used], force[used]
        rnl = 1.0 - float(np.sqrt(np.sum((p - r) ** 2) / np.sum(r**2)))
        FE = oracle.elastic(x)
        energy = float(np.trapezoid(p - FE, x) / np.trapezoid(r - FE, x))
        errors = variants([record])
        cells = [f"{100 * errors[key]:.1f} %" if key in errors else "-" for key in ("with time", "without time")]
        removed = ", ".join(found.effects) or "-"
        table.add_row(
            name, f"{fit.rnl:.4f}", f"{rnl:.4f}", f"{energy:.3f}", *cells, removed, ", ".join(cautions_of(found))
        )
        if arguments.verbose:
            for caution in found.cautions:
                console.print(f"{name}: {caution}", soft_wrap=True)
    console.print(table)


# False alarms


def own(arguments: argparse.Namespace) -> None:
    """Untrue cautions on clean springs of the own class: half of them those of honesty.py, half in programmes here."""
    rows = []
    for index, case in enumerate(clean_cases(arguments.seed, arguments.count // 2)):
        per_cycle = case.experiment.samples / sum(case.experiment.cycles)
        rows.append((f"{index:4} {described(case)}", case.records, per_cycle))
    for index in range(arguments.count - len(rows)):
        case = own_case(np.random.default_rng([arguments.seed, zlib.crc32(b"own"), index]))
        per_cycle = case.experiment.samples / sum(case.experiment.cycles)
        rows.append((f"{index:4} {described(case)} programme", case.records, per_cycle))
    alarms(arguments, rows)


def lab(arguments: argparse.Namespace) -> None:
    """Untrue cautions on springs of the own class as a laboratory records them."""
    rows = []
    for index in range(arguments.count):
        generator = np.random.default_rng([arguments.seed, index])
        spring, experiment = draw_spring(generator), draw_experiment(generator, separate=False)
        rows.append(
            (
                f"{index:4} lab {experiment.shape} {experiment.frequency:.2f} Hz",
                lab_like(spring, experiment, generator),
                150.0,
            )
        )
    alarms(arguments, rows)


def alarms(arguments: argparse.Namespace, rows: Sequence[tuple[str, tuple[Record, ...], float]]) -> None:
    counts: Counter[str] = Counter()
    data: Counter[str] = Counter()
    alarmed = refused = 0
    for label, records, per_cycle in rows:
        try:
            cautions = cautions_of(identify(records))
        except StrandspringError as error:
            refused += 1
            console.print(f"{label} refused: {error}", soft_wrap=True)
            continue
        untrue = untrue_cautions(cautions, per_cycle)
        counts.update(untrue)
        data.update(name for name in cautions if name not in untrue)
        alarmed += bool(untrue)
        if untrue or arguments.verbose:
            details = "; ".join(cautions[name][-110:] for name in untrue)
            console.print(f"{label} {', '.join(untrue) or '-'}: {details}", soft_wrap=True)
    console.print(f"{len(rows)} records: {alarmed} with an untrue caution, {counts.total()} in all, {refused} refused")
    console.print(f"untrue: {', '.join(f'{name.lower()} {count}' for name, count in counts.most_common()) or 'none'}")
    console.print(
        f"about the data: {', '.join(f'{name.lower()} {count}' for name, count in data.most_common()) or 'none'}"
    )


def untrue_cautions(cautions: dict[str, str], per_cycle: float) -> list[str]:
    """Cautions that a clean record of the own class gives no reason for."""
    return [
        name
        for name in cautions
        if name not in DATA and (name in UNTRUE or not name.startswith("TURNS_") or per_cycle >= FINE_SAMPLING)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    for function, count in {run: 10, heldout: 4, measured: None, own: 240, lab: 100}.items():
        command = commands.add_parser(function.__name__, help=(function.__doc__ or "").replace("%", "%%"))
        command.set_defaults(function=function)
        command.add_argument("--seed", type=int, default=0)
        command.add_argument("--verbose", action="store_true", help="one line for each record")
        command.add_argument("--only", default="", help="mounts or records whose name holds this")
        if count is not None:
            command.add_argument("--count", type=int, default=count)
    arguments = parser.parse_args()
    console.print(f"{arguments.command}, seed {arguments.seed}")
    arguments.function(arguments)


if __name__ == "__main__":
    main()
