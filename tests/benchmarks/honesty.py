"""Whether an identification can be believed, on a simulated rig.

Wrong: more than 10 % in the energy of loops at 30 % of the amplitude, or more than 5 % of the force's standard
deviation on minor loops, against the noise-free truth. Silent: wrong, and no caution that points to it; extrapolated is
what was silent but for the caution on records of one amplitude. Refused: no spring, but a sentence that says why.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from tables import console, counted, percent, show

from judgement import Judgement, judge_case
from noise_bound import bound
from rig import DOUBTED, UNDECIDED, Case, Experiment, Fault, draw_experiment, draw_spring, simulate
from rig_faults import FAULTS
from strandspring import Identification, Outcome, RefinedOptions, identify
from strandspring.errors import StrandspringError

FEW = (9.0, 60.0)  # samples in a cycle of coarse records
WITHIN = 0.05  # error of n and rho that is allowed under noise of the displacement, share of them
KNOWN = {field.name for field in fields(RefinedOptions)}


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
        return {one.name: sentence for one, sentence in zip(self.found.outcomes, self.found.cautions, strict=True)}

    @property
    def wrong(self) -> bool:
        return self.judgement is not None and self.judgement.wrong

    def says(self, words: Sequence[str]) -> bool:
        """Whether the name or the sentence of a caution holds one of the words."""
        texts = [
            f"{name.replace('_', ' ')} {sentence}".lower()
            for name, sentence in self.cautions.items()
            if name != Outcome.ONE_AMPLITUDE.name
        ]
        return any(re.search(rf"\b{re.escape(word)}", text) for text in texts for word in words)

    @property
    def silent(self) -> bool:
        return self.wrong and not self.says(self.words)

    @property
    def line(self) -> str:
        p = self.case.spring
        case = f"n {p.n:5.2f} sigma {p.sigma:5.2f} rho*A {p.rho * self.case.amplitude:5.1f}"
        if self.judgement is None:
            return f"{case} refused: {self.problem}"
        verdict = "SILENT" if self.silent else "WRONG" if self.wrong else "right"
        energy, force = 100.0 * self.judgement.energy, 100.0 * self.judgement.force
        return f"{case} {verdict:6} energy {energy:+6.1f} % force {force:5.1f} % {', '.join(self.cautions)}"


def run(case: Case, words: Sequence[str] = UNDECIDED) -> Result:
    """The case identified with the options that a user of this rig would give."""
    options = RefinedOptions(**{name: value for name, value in case.options.items() if name in KNOWN})
    try:
        found = identify(case.records, options)
    except StrandspringError as error:
        return Result(case, tuple(words), problem=str(error))
    return Result(case, tuple(words), found, judge_case(case, found.spring()))


def summary(results: Sequence[Result]) -> dict[str, object]:
    judgements = [result.judgement for result in results if result.judgement is not None]
    return {
        "runs": len(results),
        "wrong": sum(result.wrong for result in results),
        "silent": sum(result.silent for result in results),
        "extrapolated": sum(result.silent and Outcome.ONE_AMPLITUDE.name in result.cautions for result in results),
        "refused": sum(bool(result.problem) for result in results),
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


def shown(label: str, result: Result, verbose: bool) -> Result:
    if verbose or result.silent or result.problem:
        console.print(f"{label:30} {result.line}", soft_wrap=True)
    return result


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
        results.append(shown(str(index), run(case), verbose))
    show("Clean records; medians of errors", [summary(results)])
    console.print(f"cautions: {counted([name.lower() for result in results for name in result.cautions])}")


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
                label = f"{name} {case.magnitude:.3g}"
                results.append(shown(label, run(case, (*FAULTS[name].points_to, *DOUBTED)), verbose))
            pointed = sum(result.says(FAULTS[name].points_to) for result in results)
            rows.append({"fault": name, "size": size} | summary(results) | {"pointed": pointed})
            every += results
    rows.append({"fault": "all", "size": ""} | summary(every) | {"pointed": ""})
    show("Faults of the rig; medians of errors", rows)


def pairs(count: int = 200, seed: int = 0, coarse: bool = False, verbose: bool = False) -> None:
    """Two faults at a time with drawn sizes."""
    usual = Fault(0.0, 0.0, "", ())
    # The first of a pair must leave the experiment, the truth and the number of samples as they are.
    firsts = [
        name
        for name, fault in FAULTS.items()
        if name not in ("gaps", "lost reversals", "duplicates")
        and all(getattr(fault, field) is getattr(usual, field) for field in ("truths", "programme", "options"))
    ]
    results = []
    for index in range(count):
        generator = np.random.default_rng([seed, index])
        first = str(generator.choice(firsts))
        second = str(generator.choice([name for name in FAULTS if name != first]))
        magnitude = FAULTS[first].magnitude("drawn", generator)
        fault = FAULTS[first].beside(FAULTS[second], magnitude)
        spring, experiment = draw_spring(generator), drawn_experiment(generator, coarse)
        case = simulate(spring, experiment, generator, fault, "drawn")
        label = f"{index} {first} {magnitude:.3g}, {second} {case.magnitude:.3g}"
        results.append(shown(label, run(case, (*case.points_to, *DOUBTED)), verbose))
    show("Pairs of faults; medians of errors", [summary(results)])


def spans(count: int = 60, seed: int = 0, verbose: bool = False) -> None:
    """Whether the range given for the energy of small loops holds it: one amplitude, tanh, kink and bump stop."""
    held, results = 0, []
    for index in range(count):
        generator = np.random.default_rng([seed, index])
        name = ("tanh", "kink", "bump stop")[index % 3]
        experiment = draw_experiment(generator, amplitudes=(1.0,), cycles=(3,))
        result = run(simulate(draw_spring(generator), experiment, generator, FAULTS[name], "drawn"))
        results.append(shown(f"{index} {name}", result, verbose))
        if result.judgement is not None and result.found is not None:
            given = result.found.certainty.unrecorded
            held += given.low / given.energy <= 1.0 / (1.0 + result.judgement.energy) <= given.high / given.energy
    show("Ranges of small loops of one amplitude", [{"held": held} | summary(results)])


def noise(count: int = 20, seed: int = 0, share: float = 0.002, verbose: bool = False) -> None:
    """Noise of the displacement, a `share` of the amplitude: n and rho beside the Cramer-Rao bound.

    Springs with high loops. The bound is that of a path that is known, as by perfect smoothing, and that of one that is
    not smoothed at all; both are given as the number of runs within 5 % that they let expect.
    """
    rows = []
    for shape in ("sine", "triangle"):
        errors, shares, results = [], [], []
        for index in range(count):
            generator = np.random.default_rng([seed, index])
            spring = draw_spring(generator, (0.3, 3.0), (0.5, 3.0), (6.0, 30.0), friction=(0.2, 0.4))
            experiment = draw_experiment(generator, shape=shape)
            case = simulate(spring, experiment, generator, replace(FAULTS["displacement noise"], small=share))
            results.append(shown(f"{index} {shape}", run(case), verbose))
            covariances = [bound(case, displacement) for displacement in (0.0, case.magnitude * case.amplitude)]
            draws = np.random.default_rng(0)
            shares.append([
                np.mean(np.abs(draws.multivariate_normal(np.zeros(2), each, 20_000)).max(axis=1) <= WITHIN)
                for each in covariances
            ])  # fmt: skip
            found = results[-1].found
            p = None if found is None else found.parameters
            errors.append([np.inf] * 2 if p is None else [abs(p.n / spring.n - 1.0), abs(p.rho / spring.rho - 1.0)])
        n, rho = np.array(errors).T
        known, unsmoothed = np.sum(shares, axis=0)
        rows.append({
            "shape": shape, "n median [%]": percent(np.median(n)), "worst": percent(n.max()),
            "rho median [%]": percent(np.median(rho)), "rho worst": percent(rho.max()),
            "within 5 %": int(np.sum(np.maximum(n, rho) <= WITHIN)), "bound": f"{known:.1f}",
            "unsmoothed": f"{unsmoothed:.1f}", "wrong": sum(result.wrong for result in results),
        })  # fmt: skip
    show(f"Displacement noise of {100.0 * share:g} % of the amplitude", rows)
