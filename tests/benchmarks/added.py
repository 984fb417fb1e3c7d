"""Whether branches and second mechanisms are found where they are, and nowhere else.

    python tests/benchmarks/added.py [--count N] [--seed S]

Simulated mounts, a quarter of each kind: the paper's spring, with a Maxwell branch, with a second mechanism, with both;
what is added has 2 to 20 % of the force. Records are of three amplitudes at two rates, with 0.5 % noise. Wrong and
silent are as in honesty.py, on loops at a rate between the two; what is not found matters if the force on them is 1 %
off.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from judgement import SAMPLES, AtRate, judge
from mounts_with_branches import maxwell, sines
from rig import UNDECIDED, FloatArray, draw_spring, log_uniform
from strandspring import Record, Spring, SpringParameters, StrandspringError, identify

KINDS = ((1, 0), (1, 1), (2, 0), (2, 1))  # mechanisms and branches
NOISE, RATES, SHARE = 0.005, (0.5, 2.5), (0.02, 0.2)
RATE = 1.2  # of the loops that are judged [Hz]
WORTH = 0.01  # of the force on minor loops


@dataclass(frozen=True)
class Mount:
    """Springs side by side with a branch of stiffness [N/m] and time constant [s]."""

    springs: tuple[SpringParameters, ...]
    branches: tuple[tuple[float, float], ...]

    def force(self, path: FloatArray, times: FloatArray) -> FloatArray:
        total = sum(Spring(spring).response(path) for spring in self.springs)
        return np.asarray(total + sum(maxwell(times, path, *branch) for branch in self.branches))

    def response(self, path: FloatArray) -> FloatArray:
        return self.force(path, np.arange(path.size) / (SAMPLES * RATE))


def drawn(generator: np.random.Generator, kind: tuple[int, int]) -> tuple[Mount, float, float]:
    """A mount with its amplitude and the middle of its motion [m]."""
    first = draw_spring(generator, n=(0.3, 4.0), sigma=(0.5, 3.0), saturations=(4.0, 20.0), friction=(0.1, 0.4))
    centre = 0.5 * (first.displacement_min + first.displacement_max)
    amplitude = 0.5 * (first.displacement_max - first.displacement_min)
    cycle = centre + amplitude * np.sin(np.linspace(0.0, 4.0 * np.pi, 800))
    size = float(np.std(Spring(first).response(cycle)))
    springs, branches = [first], []
    if kind[0] == 2:
        kappa = log_uniform(generator, *SHARE) * size
        springs.append(
            replace(
                first, kE=(0.0,), kA=(1.0,), kappa_omega=kappa, rho=first.rho * log_uniform(generator, 4.0, 10.0),
                n=log_uniform(generator, 0.5, 2.0), sigma=log_uniform(generator, 0.5, 2.0),
            )
        )  # fmt: skip
    if kind[1]:
        tau = log_uniform(generator, 0.3, 3.0) / (2.0 * np.pi * float(np.sqrt(RATES[0] * RATES[1])))
        branches.append((log_uniform(generator, *SHARE) * size / (0.7 * amplitude), tau))
    return Mount(tuple(springs), tuple(branches)), amplitude, centre


def records(mount: Mount, amplitude: float, centre: float, generator: np.random.Generator) -> list[Record]:
    made = []
    for rate in RATES:
        times, way = sines([share * amplitude for share in (0.3, 0.6, 1.0)], rate)
        force = mount.force(centre + way, times)
        noise = NOISE * float(np.std(force)) * generator.standard_normal(force.size)
        made.append(Record(centre + way, force + noise, time=times, path=f"{rate:g}_hz.csv"))
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    verdicts: Counter[str] = Counter()
    for number in range(given.count):
        generator = np.random.default_rng((given.seed, number))
        kind = KINDS[number % len(KINDS)]
        mount, amplitude, centre = drawn(generator, kind)
        begin = time.process_time()
        try:
            found = identify(records(mount, amplitude, centre, generator))
        except StrandspringError as refusal:
            verdicts["refused"] += 1
            print(f"{number:3} {kind} refused: {refusal}")
            continue
        p = found.parameters
        got = (1 + (p.second is not None), len(p.branches))
        judgement = judge(mount, AtRate(found.spring(), RATE), amplitude, centre)
        said = " ".join([*(outcome.name for outcome in found.outcomes), *found.cautions]).lower()
        is_silent = judgement.wrong and not any(word in said for word in UNDECIDED)
        verdicts["not there, found"] += got[0] > kind[0] or got[1] > kind[1]
        is_missed = got[0] < kind[0] or got[1] < kind[1]
        verdicts["there, not found"] += is_missed
        verdicts[f"of them with an error of {100 * WORTH:g} %"] += is_missed and judgement.force > WORTH
        verdicts["wrong"] += judgement.wrong
        verdicts["silent"] += is_silent
        verdict = " WRONG" * judgement.wrong + " SILENT" * is_silent
        print(
            f"{number:3} {kind} found {got}, energy {100 * judgement.energy:+.1f} %, "
            f"force {100 * judgement.force:.2f} %{verdict}, {time.process_time() - begin:.1f} s, "
            f"{', '.join(outcome.name for outcome in found.outcomes)}",
            flush=True,
        )
    print(", ".join(f"{name} {count}" for name, count in verdicts.items()), f"of {given.count} (seed {given.seed})")


if __name__ == "__main__":
    main()
