"""Whether an identification can be believed, on a simulated rig.

Wrong: more than 10 % in the energy of loops at 30 % of the amplitude, or more than 5 % of the force's standard
deviation on minor loops, against the noise-free truth. Silent: wrong, and no caution that points to it; extrapolated is
what was silent but for the caution on records of one amplitude. Refused: no spring, but a sentence that says why. Held:
the range that is given for the energy of those small loops holds it.
"""

from __future__ import annotations

import re
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from tables import console, percent, show

from rig import (
    DOUBTED,
    UNDECIDED,
    Case,
    Experiment,
    Judgement,
    amplitude_of,
    draw_experiment,
    draw_spring,
    judge_case,
    simulate,
)  # fmt: skip
from rig_faults import FAULTS
from strandspring import Identification, Outcome, RefinedOptions, identify
from strandspring.errors import Reader, StrandspringError
from strandspring.findings import words
from zoo_mounts import LAWS, draw_mount

FEW = (9.0, 60.0)  # samples in a cycle of coarse records
KNOWN = {field.name for field in fields(RefinedOptions)}
OTHERS = (*UNDECIDED, "minor loops", "nested", "another class", "other class", "rate", "bound", "cycle to cycle")


@dataclass(frozen=True)
class Result:
    """What came out of one case; `judgement` is None where no spring did."""

    case: Case
    words: tuple[str, ...]
    found: Identification | None = None
    judgement: Judgement | None = None
    problem: str = ""

    @property
    def cautions(self) -> dict[str, str]:
        if self.found is None:
            return {}
        return {one.kind.name: words(one, Reader.PYTHON) for one in self.found.findings}

    @property
    def wrong(self) -> bool:
        return self.judgement is not None and self.judgement.wrong

    def says(self, words: Sequence[str]) -> bool:
        """Whether the name or the sentence of a caution holds one of the words."""
        pairs = ((name, text) for name, text in self.cautions.items() if name != Outcome.ONE_AMPLITUDE.name)
        texts = [f"{name.replace('_', ' ')} {text}".lower() for name, text in pairs]
        return any(re.search(rf"\b{re.escape(word)}", text) for text in texts for word in words)

    @property
    def silent(self) -> bool:
        return self.wrong and not self.says(self.words)

    @property
    def held(self) -> bool:
        if self.found is None or self.judgement is None:
            return False
        given = self.found.certainty.unrecorded
        return given.low / given.energy <= 1.0 / (1.0 + self.judgement.energy) <= given.high / given.energy


def run(label: str, case: Case, verbose: bool, words: Sequence[str] = UNDECIDED) -> Result:
    """The case identified with the options that a user of this rig would give, printed where it is worth it."""
    options = RefinedOptions(**{name: value for name, value in case.options.items() if name in KNOWN})
    try:
        found = identify(case.records, options)
        result = Result(case, tuple(words), found, judge_case(case, found.spring()))
    except StrandspringError as error:
        result = Result(case, tuple(words), problem=str(error))
    if verbose or result.silent or result.problem:
        p, judgement, outcome = case.spring, result.judgement, f"refused: {result.problem}"
        if judgement is not None:
            verdict = "SILENT" if result.silent else "WRONG" if result.wrong else "right"
            errors = f"energy {percent(judgement.energy)} % force {percent(judgement.force)} %"
            outcome = f"{verdict:6} {errors} {', '.join(result.cautions)}"
        drawn = f"n {p.n:5.2f} sigma {p.sigma:5.2f} rho*A {p.rho * amplitude_of(p):5.1f}"
        console.print(f"{label:30} {drawn} {outcome}", soft_wrap=True)
    return result


def summary(results: Sequence[Result]) -> dict[str, object]:
    judgements = [result.judgement for result in results if result.judgement is not None]
    return {
        "runs": len(results),
        "wrong": sum(result.wrong for result in results),
        "silent": sum(result.silent for result in results),
        "extrapolated": sum(result.silent and Outcome.ONE_AMPLITUDE.name in result.cautions for result in results),
        "refused": sum(bool(result.problem) for result in results),
        "held": sum(result.held for result in results),
        "energy [%]": percent(np.median([abs(each.energy) for each in judgements])) if judgements else "-",
        "force [%]": percent(np.median([each.force for each in judgements])) if judgements else "-",
    }


def drawn_experiment(generator: np.random.Generator, coarse: bool, **fixed: Any) -> Experiment:
    """An experiment, of few samples in a cycle if it is to be a coarse one."""
    experiment = draw_experiment(generator, **fixed)
    if coarse:
        samples = round(generator.uniform(*FEW) * sum(experiment.cycles))
        experiment = replace(experiment, samples=samples, synchronous=False)
    return experiment


def clean(
    count: int = 100, seed: int = 0, noise: float = 0.005, single: bool = False, coarse: bool = False,
    verbose: bool = False,
) -> None:  # fmt: skip
    """Records of the model itself with noise; `single` of one amplitude, `coarse` of 9 to 60 samples in a cycle."""
    fixed: dict[str, Any] = {"noise": noise} | ({"amplitudes": (1.0,), "cycles": (3,)} if single else {})
    results = []
    for index in range(count):
        generator = np.random.default_rng([seed, index])
        case = simulate(draw_spring(generator), drawn_experiment(generator, coarse, **fixed), generator)
        results.append(run(str(index), case, verbose))
    show("Clean records; medians of errors", [summary(results)])
    names = Counter(name.lower() for result in results for name in result.cautions)
    console.print("cautions:", dict(names.most_common()))


def faults(
    repetitions: int = 3, seed: int = 0, only: str = "", drawn: bool = False, coarse: bool = False,
    verbose: bool = False,
) -> None:  # fmt: skip
    """Every fault of a rig, small and large (or `drawn`), on springs and experiments that are drawn."""
    rows, every = [], []
    for name in [name for name in FAULTS if only in name]:
        for size in ("drawn",) if drawn else ("small", "large"):
            results = []
            for repetition in range(repetitions):
                # The same springs and experiments at either size.
                generator = np.random.default_rng([seed, zlib.crc32(name.encode()), repetition])
                spring, experiment = draw_spring(generator), drawn_experiment(generator, coarse)
                case = simulate(spring, experiment, generator, FAULTS[name], size)
                words = (*FAULTS[name].points_to, *DOUBTED)
                results.append(run(f"{name} {case.magnitude:.3g}", case, verbose, words))
            pointed = sum(result.says(FAULTS[name].points_to) for result in results)
            rows.append({"fault": name, "size": size} | summary(results) | {"pointed": pointed})
            every += results
    rows.append({"fault": "all", "size": ""} | summary(every) | {"pointed": ""})
    show("Faults of the rig; medians of errors", rows)


def spans(count: int = 60, seed: int = 0, verbose: bool = False) -> None:
    """Whether the range given for the energy of small loops holds it: one amplitude, tanh, kink and bump stop."""
    results = []
    for index in range(count):
        generator = np.random.default_rng([seed, index])
        name = ("tanh", "kink", "bump stop")[index % 3]
        experiment = draw_experiment(generator, amplitudes=(1.0,), cycles=(3,))
        case = simulate(draw_spring(generator), experiment, generator, FAULTS[name], "drawn")
        results.append(run(f"{index} {name}", case, verbose))
    show("Ranges of small loops of one amplitude", [summary(results)])


def zoo(count: int = 24, seed: int = 7, verbose: bool = False) -> None:
    """Mounts of other classes (tests/helpers/zoo_mounts.py), so many of each."""
    rows = []
    for name in LAWS:
        results = []
        for index in range(count):
            generator = np.random.default_rng([seed, index])
            experiment = draw_experiment(generator, noise=0.003)
            case = simulate(draw_mount(generator, name), experiment, generator)
            results.append(run(f"{name} {index}", case, verbose, OTHERS))
        rows.append({"mount": name} | summary(results))
    show("Mounts of other classes; medians of errors", rows)
