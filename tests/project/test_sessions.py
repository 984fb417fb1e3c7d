"""Programs that use the package beside other things: in many threads, and without being changed by it."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from strandspring import Record, Spring, SpringParameters, identify

pytestmark = pytest.mark.long
THREADS = 8
SPRING = Spring(
    SpringParameters((1.0, 4000.0, 0.0, 2e6), (1.0, 5.0), 12.0, 700.0, 0.8, 0.6, 0.0, -0.015, 0.015), "mount"
)


def _isolate(number: int) -> str:
    isolation = SPRING.isolate(0.5 + 0.1 * number, base_displacement=1e-4, points=6)
    # Not "%a", Python's ascii(): it depends on NumPy's print options, which each thread has for itself.
    return isolation.to_frame().to_csv(float_format=float.hex)


def _identify(number: int) -> str:
    path = 0.013 * np.sin(np.linspace(0.0, 8.0 * np.pi, 400)) * np.repeat([0.6, 1.0], 200)
    noise = 0.05 * np.random.default_rng(number).standard_normal(path.size)
    result = identify(Record(path, SPRING.response(path) + noise))
    return repr((result.parameters, result.rmse, result.rnl))


@pytest.mark.parametrize(("work", "count"), [(_isolate, THREADS), pytest.param(_identify, 2, marks=pytest.mark.slow)])
def test_many_threads_give_the_bits_of_one(work: Callable[[int], str], count: int) -> None:
    from threadpoolctl import threadpool_info

    before = threadpool_info()
    alone = [work(number) for number in range(count)]
    together = threading.Barrier(THREADS)

    def begun_together(thread: int) -> bool:
        together.wait()
        return work(thread % count) == alone[thread % count]

    with ThreadPoolExecutor(THREADS) as pool:
        assert all(pool.map(begun_together, range(THREADS)))
    assert threadpool_info() == before  # threads of linear algebra are given back by the last


# Libraries that are loaded first have done what they do; state.json says what belongs to the program that imports.
PROGRAM = """
import decimal, gc, json, locale, logging, os, random, signal, sys, threading, warnings
import fmpy, matplotlib, numpy, pandas, pydantic, pythonfmu, scipy.linalg, scipy.optimize, strandspring
from threadpoolctl import threadpool_info
state = json.load(open(sys.argv[1]))
before = {name: eval(value) for name, value in state.items()}
LOAD
print(*(name for name, value in state.items() if eval(value) != before[name]))
"""


def test_the_import_changes_nothing_of_the_program() -> None:
    for load, changes in (
        ("[getattr(strandspring, name) for name in strandspring.__all__]", []),
        ("warnings.simplefilter('error'); os.environ['A_VARIABLE'] = '1'", ["warnings", "environment"]),
    ):
        command = [sys.executable, "-c", PROGRAM.replace("LOAD", load), Path(__file__).with_name("state.json")]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert done.stdout.split() == changes
