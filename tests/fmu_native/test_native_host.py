"""The native FMU in a C host of our own, with no Python in the process: a million steps, memory, messages, threads."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from copy import copy
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, wandering_path
from kernel_tools import HERE, build_folder, compiled
from native_tools import FUNCTIONS, HEADERS, ROUNDING, Native, close, library
from strandspring.kernel.path import PathSolver


@cache
def host(*flags: str) -> Path:
    """The host compiled with these flags."""
    output = build_folder() / f"native_calls{len(flags)}"
    return compiled(output, "-O1", *flags, f"-I{HEADERS}", HERE / "native_calls.c", "-ldl", "-lm", "-lpthread")


def run(task: str, *, given: bytes = b"", program: Path | None = None, binary: Path | None = None) -> bytes:
    """Standard output of the host."""
    command = [str(program or host()), str(binary or library().path), library().guid, task]
    done = subprocess.run(command, input=given, capture_output=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


@pytest.mark.slow
def test_a_million_steps_give_the_force_of_the_model():
    """With trials, excursions, steps of any size, states taken back and states that go on in another instance."""
    path = wandering_path(SPRING, 1_000_000, seed=11)
    assert path.size > 1_000_000
    found = np.frombuffer(run("path", given=path.tobytes()))
    expected = PathSolver(SPRING).force(path)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDING * np.abs(expected).max())


def test_memory_of_the_host_is_asked_for_and_given_back():
    said = run("memory").decode()
    assert "must both be given or both be NULL" in said
    assert said.count("There is not enough memory") == 1


def test_messages_are_no_formats():
    lines = [line.split("|") for line in run("messages").decode().splitlines()]
    assert [line[:3] for line in lines] == [
        ["%s%n", "3", "logStatusError"],
        ["50 %s%n", "3", "logStatusError"],
        ["50 %s%n", "3", "logStatusError"],
        ["50 %s%n", "1", "logStatusWarning"],
    ]
    assert lines[0][3] == f"The GUID must be {library().guid}, got {{%s%n}}."
    assert lines[1][3].endswith("got 100 %s%n%d.")


def test_many_instances_in_many_threads():
    run("threads")


def from_sources(name: str, *flags: str | Path) -> Path:
    """Compiled with the C sources of the FMU of SPRING."""
    return compiled(build_folder() / name, *flags, library().folder / "sources" / "fmi2_all.c", "-lm")


def test_threads_share_nothing_that_changes():
    """The same under the thread sanitizer, which sees what good luck hides."""
    sanitizer = ("-g", "-fsanitize=thread")
    binary = from_sources("sanitized.so", "-O1", "-shared", "-fPIC", *sanitizer)
    run("threads", program=host(*sanitizer), binary=binary)


class Prefixed:
    """The functions of one of several FMUs linked into one library."""

    def __init__(self, functions: ctypes.CDLL, prefix: str) -> None:
        self._functions, self._prefix = functions, prefix
        self.fmi2Instantiate.restype = ctypes.c_void_p

    def __getattr__(self, name):
        return getattr(self._functions, self._prefix + name)


@pytest.mark.slow
def test_two_springs_linked_into_one_program():
    springs = {"one_": SPRING, "other_": OTHER}
    objects = [
        compiled(
            build_folder() / f"{prefix}.o",
            "-O2", "-fPIC", f"-DFMI2_FUNCTION_PREFIX={prefix}", "-c", library(of).folder / "sources" / "fmi2_all.c",
        )
        for prefix, of in springs.items()
    ]  # fmt: skip
    listed = [
        subprocess.run(["nm", "-g", "--defined-only", "-P", unit], capture_output=True, text=True, check=True).stdout
        for unit in objects
    ]
    for prefix, names in zip(springs, listed, strict=True):
        assert {line.split()[0] for line in names.splitlines()} == {prefix + name for name in FUNCTIONS}
    functions = ctypes.CDLL(str(compiled(build_folder() / "linked.so", "-shared", *objects, "-lm")))
    for prefix, parameters in springs.items():
        linked = copy(library(parameters))
        linked.functions = Prefixed(functions, prefix)
        path = wandering_path(parameters, 200, seed=3)
        with Native(linked) as spring:
            spring.initialize(displacement=path[0])
            found = [spring.get("force"), *(spring.step(displacement, "force") for displacement in path[1:])]
        close(np.ravel(found), PathSolver(parameters).force(path))


HOSTS = """
import gc
import sys
from ctypes import byref
from fmpy.fmi2 import calloc, defaultCallbacks, fmi2CallbackAllocateMemoryTYPE, fmi2CallbackFreeMemoryTYPE, free
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions

def instance(name):
    # Functions of this instance only; what they are made of goes with it.
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = defaultCallbacks.logger
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    slave = FMU2Slave(guid=sys.argv[2], unzipDirectory=sys.argv[1], modelIdentifier="spring", instanceName=name)
    slave.instantiate(callbacks=callbacks)
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.setReal([0], [0.02])
    slave.exitInitializationMode()
    return slave

first, second = instance("first"), instance("second")
first.freeInstance()
del first
gc.collect()
second.freeInstance()
print("all freed")
"""


def test_a_shared_table_outlives_the_host_of_the_first_instance() -> None:
    folder = library().folder
    done = subprocess.run(
        [sys.executable, "-c", HOSTS, str(folder), library().guid], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, "all freed\n"), done.stderr
