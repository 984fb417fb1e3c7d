"""Programs that use the package beside other things: in many threads, and without being changed by it."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from strandspring import Record, Spring, SpringParameters, identify
from strandspring.ground.one_thread import one_thread

THREADS = 8
SPRING = Spring(
    SpringParameters((1.0, 4000.0, 0.0, 2e6), (1.0, 5.0), 12.0, 700.0, 0.8, 0.6, 0.0, -0.015, 0.015), "mount"
)


def _response(number: int) -> bytes:
    path = 0.014 * np.sin(np.linspace(0.0, 30.0 + number, 500))
    return SPRING.response(path).tobytes() + SPRING.absorbed_energy(path).tobytes()


def _isolate(number: int) -> bytes:
    isolation = SPRING.isolate(0.5 + 0.1 * number, base_displacement=1e-4, points=6)
    # Not "%a", Python's ascii(): it depends on NumPy's print options, which each thread has for itself.
    return isolation.to_frame().to_csv(float_format=float.hex).encode()


@cache
def _record(number: int) -> Record:
    path = 0.013 * np.sin(np.linspace(0.0, 8.0 * np.pi, 400)) * np.repeat([0.6, 1.0], 200)
    noise = 0.05 * np.random.default_rng(number).standard_normal(path.size)
    return Record(path, SPRING.response(path) + noise)


def _identify(number: int) -> bytes:
    result = identify(_record(number))
    return repr((result.parameters, result.rmse, result.rnl)).encode()


@pytest.mark.parametrize("work", [_response, _isolate, _identify], ids=["response", "isolate", "identify"])
def test_many_threads_give_the_bits_of_one(work: Callable[[int], bytes], tmp_path: Path) -> None:
    numbers = range(2) if work is _identify else range(THREADS)
    alone = {number: work(number) for number in numbers}
    together = threading.Barrier(THREADS)

    def begun_together(thread: int) -> tuple[int, bytes]:
        number = numbers[thread % len(numbers)]
        together.wait()
        return number, work(number)

    with ThreadPoolExecutor(THREADS) as pool:
        for number, answer in pool.map(begun_together, range(THREADS)):
            if answer != alone[number]:
                for name, text in (("alone", alone[number]), ("among_others", answer)):
                    (tmp_path / name).write_bytes(text)
                pytest.fail(f"number {number} differs among other threads; both answers are in {tmp_path}")


# What belongs to the program that imports, as text.
STATE = """
import decimal, gc, locale, logging, os, random, signal, sys, threading, warnings
import matplotlib, numpy
from threadpoolctl import threadpool_info

def state():
    return {
        "warnings": repr(warnings.filters),
        "showwarning": repr(warnings.showwarning),
        "locale": locale.setlocale(locale.LC_ALL),
        "signals": repr([signal.getsignal(number) for number in signal.valid_signals()]),
        "linear algebra": repr([(pool["internal_api"], pool["num_threads"]) for pool in threadpool_info()]),
        "matplotlib": repr(list(dict.items(matplotlib.rcParams))),  # as it is: to ask for the backend would choose one
        "environment": repr(sorted(os.environ.items())),
        "folder": os.getcwd(),
        "path": repr(sys.path),
        "hooks": repr((sys.excepthook, sys.displayhook, threading.excepthook)),
        "interpreter": repr((sys.getswitchinterval(), sys.getrecursionlimit())),
        "streams": repr((sys.stdout, sys.stderr, sys.stdin)),
        "numpy": repr((numpy.geterr(), numpy.get_printoptions())),
        "random": repr((random.getstate(), numpy.random.get_state())),
        "decimal": repr(decimal.getcontext()),
        "logging": repr((logging.root.handlers, logging.root.level)),
        "garbage": repr((gc.isenabled(), gc.get_threshold())),
        "running threads": threading.active_count(),
    }

"""
IMPORT = """
import importlib, pkgutil, strandspring
before = state()
{load}
after = state()
changed = [name for name in before if before[name] != after[name]]
print(*changed, sep="\\n")
"""
WHOLE = """
for name in strandspring.__all__:
    getattr(strandspring, name)
"""


@pytest.mark.parametrize(
    "load", ["import strandspring.api.identification", WHOLE], ids=["identify", "all public names"]
)
def test_the_import_changes_nothing_of_the_program(load: str) -> None:
    # Libraries that are loaded first have done what they do: NumPy, SciPy and pandas are not this package.
    program = (
        STATE + "import scipy.optimize, scipy.linalg, pandas, pydantic, fmpy, pythonfmu\n" + IMPORT.format(load=load)
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n") == ["", ""]


def test_a_change_is_noticed() -> None:
    program = STATE + IMPORT.format(load="warnings.simplefilter('error'); os.environ['A_VARIABLE'] = '1'")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.split() == ["warnings", "environment"]


def test_one_thread_is_given_back_by_the_last() -> None:
    def threads() -> set[int]:
        return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

    with threadpool_limits(limits=2, user_api="blas"):
        before, first = threads(), one_thread()
        first.__enter__()
        with one_thread():
            first.__exit__(None, None, None)
            assert threads() == {1}
        assert threads() == before
