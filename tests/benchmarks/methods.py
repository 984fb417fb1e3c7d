"""Methods of identification that the paper names, beside this program's.

Table 1's record is one period of Ni's model with 3 % noise; each method gets the same samples. Ni's method fits Ni's
model, whose own data Table 1 holds, from exact values, from values read off the record, or from random ones within a
factor of ten.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from tables import show

from strandspring import PaperOptions, Record, RefinedOptions, Spring, StrandspringError, TwoStageOptions, identify
from strandspring.examples.paper import random_start
from strandspring.identification.method import Method
from strandspring.peers.ni import PAPER_NI, NiParameters, ni_method, plausible_start, sine_period, with_noise
from strandspring.peers.periods import whole_periods

SAMPLES, NOISE = (1000, 128), 0.03  # of a period; the paper does not say how many it has
FAILED = 2.5  # RMSE [N] above which a run counts as failed: the paper's figure
UNSEEN = (0.3, 0.6)  # amplitudes of the unseen paths, share of the recorded one

Array = np.ndarray
Steady = Callable[[Array], Array]  # displacement over one period [mm] -> force in the steady state [N]
Run = Callable[[Array, Array, int], Steady]  # displacement and force of a period, and a seed
Start = Callable[[Array, Array, int], NiParameters]


def ours(options: Method) -> Run:
    def run(x: Array, force: Array, _: int) -> Steady:
        spring = Spring(identify(Record(1e-3 * x, force), options).parameters)
        return lambda period: spring.response(np.tile(1e-3 * period, 5))[-period.size :]

    return run


def ni(start: Start) -> Run:
    def run(x: Array, force: Array, seed: int) -> Steady:
        period, periods = whole_periods(Record(x, force))
        return ni_method(period, periods.mean(axis=0), start(x, force, seed)).parameters.steady_force

    return run


def read_off(x: Array, force: Array, _: int) -> NiParameters:
    """From the secant stiffness and the area of the loop."""
    period, periods = whole_periods(Record(x, force))
    return plausible_start(period, periods.mean(axis=0))


def methods_of(truth: NiParameters) -> dict[str, Run]:
    def exact(*_: object) -> NiParameters:
        return truth

    def at_random(_x: Array, _force: Array, seed: int) -> NiParameters:
        return random_start(np.random.default_rng(seed), truth)

    return {
        "paper": ours(PaperOptions()),
        "two-stage": ours(TwoStageOptions()),
        "refined": ours(RefinedOptions()),
        "Ni's, exact values": ni(exact),
        "Ni's, read off": ni(read_off),
        "Ni's, random": ni(at_random),
    }


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def table_1(seeds: int = 10) -> None:
    """Errors, failures and times of all methods on the paper's Table 1, medians over so many `seeds`."""
    for amplitude, exponent in ((5.0, 0.222), (5.45, 1.0)):
        for samples in SAMPLES:
            truth, x, rows = replace(PAPER_NI, n=exponent), sine_period(amplitude, samples), []
            paths = [x, *(share * x for share in UNSEEN)]
            clean = [truth.steady_force(path) for path in paths]
            for name, run in methods_of(truth).items():
                errors, times = [], []
                for seed in range(seeds):
                    begin = time.process_time()
                    try:
                        steady = run(x, with_noise(clean[0], NOISE, seed), seed)
                        errors.append([rms(steady(path) - force) for path, force in zip(paths, clean, strict=True)])
                    except (StrandspringError, ValueError, ArithmeticError, np.linalg.LinAlgError):
                        errors.append([np.inf] * len(paths))
                    times.append(time.process_time() - begin)
                own, *others = np.array(errors).T
                unseen = np.mean(
                    [1.0 - each / rms(force) for each, force in zip(others, clean[1:], strict=True)], axis=0
                )
                rows.append({
                    "method": name, "RMSE [N]": float(np.median(own)), "worst": float(own.max()),
                    "RNL unseen": f"{np.median(unseen):.3f}", "failed": f"{np.sum(~(own <= FAILED))}/{seeds}",
                    "time [ms]": f"{1e3 * np.median(times):.0f}",
                })  # fmt: skip
            show(f"Table 1's record, X = {amplitude:g} mm, n = {exponent:g}, K = {samples}", rows)
