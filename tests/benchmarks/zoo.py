"""Whether an identification is honest about mounts that are none of its own.

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

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from tables import console, counted, percent, show

from rig import FloatArray
from strandspring import identify
from strandspring.errors import StrandspringError
from zoo_mounts import DRAWS
from zoo_rig import FORCE_SHIFTS, ZooCase, draw_case

WRONG = 0.05  # of a loop's energy, and of the force's standard deviation on minor loops
FACTOR = 2.0  # to which the size of a difference must be given
# Nested loops after the test, in amplitudes: +0.6 to -0.2 and back, 0.3 about 0, 0.3 about +0.5.
NESTED = (0.6, -0.2, 0.6, -0.3, 0.3, -0.3, 0.3, 0.2, 0.8, 0.2, 0.8)
# Cautions that say that loops unlike the recorded ones are open, by name or by the words of their sentences.
OPEN = {
    "SMALL_LOOPS", "ONE_AMPLITUDE", "OTHER_CLASS", "LACK_OF_FIT", "POOR_FIT", "NO_STEADY_SECTION", "SIGMA_AT_BOUND",
    "N_AT_BOUND",
}  # fmt: skip
OPEN_WORDS = re.compile(r"\b(small loops|minor loops|nested|another class|misfit|smaller ones|rate)")
# Percentages that are no sizes of a difference.
_OTHER_SHARES = re.compile(r"[-+.\d]+ % (?:of (?:the|that|its) (?:amplitude|range|period)|interval|prediction)")
_PERCENT = re.compile(r"(\d+(?:\.\d+)?) %")


@dataclass(frozen=True)
class Judged:
    """What came out of one case: `problem` says why there is no spring, `effects` what was removed."""

    case: ZooCase
    problem: str = ""
    cautions: dict[str, str] = field(default_factory=dict)
    effects: tuple[str, ...] = ()
    energy_error: float = 0.0
    energy_silent: bool = False
    as_recorded: bool = False
    minor: float = 0.0
    minor_silent: bool = False
    held: bool = False

    @property
    def line(self) -> str:
        head = f"{self.case.name:20} {self.case.amplitudes} {self.case.fault or '-':22}"
        if self.problem:
            return f"{head} refused: {self.problem[:90]}"
        marks = "E-SILENT " * self.energy_silent + "M-SILENT " * self.minor_silent + "MISSED " * (not self.held)
        shares = f"energy off {percent(self.energy_error)} % minor {percent(self.minor)} %"
        return f"{head} {shares} {marks}{', '.join(self.cautions)}"


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


def judged(case: ZooCase) -> Judged:
    try:
        found = identify(case.records)
    except StrandspringError as error:
        return Judged(case, str(error).partition(": ")[2])
    spring, fits, energies = found.spring(), found.fits, []
    own = [spring.response(r.displacement, fit.omega_start, r.time) for r, fit in zip(case.records, fits, strict=True)]
    for cycles in case.loops():
        sums = np.zeros(3)  # of the spring, of the mount, as measured
        for record, force, clean, samples in zip(case.records, own, case.clean, cycles, strict=True):
            for at in samples:
                x = record.displacement[at]
                sums += [closed(force[at], x), closed(clean[1][at], clean[0][at]), closed(record.force[at], x)]
        energies.append(sums[0] / sums[1:])
    off, from_recorded = np.abs(np.array(energies) - 1.0).max(axis=0).tolist()
    # What lies before the first sample compared only sets the memory.
    parts = [(mine - clean[1])[fit.first_sample :] for mine, clean, fit in zip(own, case.clean, fits, strict=True)]
    path, times, added = case.after(NESTED)
    nested = (spring.response(path, time=times) - case.mount.force(path, times))[added]
    # What the force is counted from may be free.
    force, minor = (
        float(np.std(error) if case.fault in FORCE_SHIFTS else np.sqrt(np.mean(error**2))) / case.scale
        for error in (np.concatenate(parts), nested)
    )
    cautions = {outcome.name: sentence for outcome, sentence in zip(found.outcomes, found.cautions, strict=True)}
    says = any(name in OPEN or OPEN_WORDS.search(text.lower()) for name, text in cautions.items())
    if case.mount.changes and not any("wear" in effect for effect in found.effects):
        # A mount that changes may also be said to do so, where the change was left in.
        says |= any("cycle to cycle" in text for text in cautions.values())
    silent = off > WRONG and not names_size(cautions.values(), off, force)
    held = found.certainty.unrecorded.low <= case.small_energy() <= found.certainty.unrecorded.high
    return Judged(
        case, "", cautions, tuple(found.effects), off, silent, from_recorded <= WRONG, minor,
        minor > WRONG and not says, held,
    )  # fmt: skip


def closed(force: FloatArray, displacement: FloatArray) -> float:
    """Energy of a cycle [J], its ends joined."""
    ends = np.append(displacement, displacement[:1])
    return float(np.trapezoid(np.append(force, force[:1]), ends)) if len(force) else 0.0


def summary(chosen: Sequence[Judged]) -> dict[str, object]:
    springs = [r for r in chosen if not r.problem]
    silent = [r for r in springs if r.energy_silent]
    return {
        "records": len(chosen),
        "refused": len(chosen) - len(springs),
        "energy off": sum(r.energy_error > WRONG for r in springs),
        "silent": len(silent),
        "as recorded": sum(r.as_recorded for r in silent),
        "worst [%]": percent(max((r.energy_error for r in springs), default=0.0)),
        "minor off": sum(r.minor > WRONG for r in springs),
        "minor silent": sum(r.minor_silent for r in springs),
        "minor median [%]": percent(np.median([r.minor for r in springs])) if springs else "-",
        "ranges held": sum(r.held for r in springs),
        "removed": counted([effect for r in springs for effect in r.effects]),
    }


def zoo(count: int = 8, seed: int = 7, only: str = "", verbose: bool = False) -> None:
    """Energies, nested loops and given ranges of mounts of 13 other classes, `count` records each by amplitudes."""
    results = []
    names = [name for name in DRAWS if only in name]
    for name in names:
        for index in range(3 * count):
            results.append(one := judged(draw_case(name, seed, index)))
            if verbose or one.problem or one.energy_silent or one.minor_silent:
                console.print(one.line, soft_wrap=True)
    groups = {f"{name}, {k}": [r for r in results if (r.case.name, r.case.amplitudes) == (name, k)]
              for name in names for k in (1, 2, 3)}  # fmt: skip
    groups |= {f"all, {k}": [r for r in results if r.case.amplitudes == k] for k in (1, 2, 3)}
    groups |= {
        "without a fault": [r for r in results if not r.case.fault],
        "with a fault": [r for r in results if r.case.fault],
        "changing from cycle to cycle": [r for r in results if r.case.mount.changes],
        "with effects removed": [r for r in results if r.effects],
        "all": results,
    }
    show("Mounts of other classes, by amplitudes", [{"mount": name} | summary(rows) for name, rows in groups.items()])
    console.print(f"cautions: {counted([name.lower() for r in results for name in r.cautions])}")
