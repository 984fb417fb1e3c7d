"""The spring by its three implementations: Python's steps, the steps in C that FMUs take, and whole paths in C.

The steps in C are compiled here, with a driver that loops over them, and reached by ctypes. Where the sanitizer of
addresses is preloaded (`instrumented`), they are compiled under sanitizers.
"""

from __future__ import annotations

import atexit
import ctypes
import functools
import os
import shutil
import subprocess
import tempfile
import weakref
from ctypes import c_double, c_int, c_size_t, c_void_p
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import strandspring
from instrumented import SANITIZED
from strandspring import SpringParameters
from strandspring.core import stepper
from strandspring.core.law import SpringLaw
from strandspring.kernel.path import PathSolver, packed
from strandspring.kernel.structures import rows, structures
from tools import program

FloatArray = NDArray[np.float64]

KERNEL = Path(strandspring.__file__).parent / "core" / "c" / "spring"
# Those without FMI.
SOURCES = tuple(
    KERNEL / f"{name}.c" for name in ("saturation", "saturation_table", "spline", "spring", "spring_problem")
)
HERE = Path(__file__).parent
FLAGS = (
    "-std=c11", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wshadow", "-Wconversion",
)  # fmt: skip
Parameters = structures()["SpringParameters"]


def compiled(output: Path, *arguments: str | Path, compiler: tuple[str, ...] = ("cc",)) -> Path:
    """Run a C compiler; a warning is an error."""
    compiler = program(compiler[0], package="gcc libc6-dev"), *compiler[1:]
    command = [*compiler, *FLAGS, f"-I{KERNEL}", "-o", str(output), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return output


@functools.cache
def build_folder() -> Path:
    """Where this session's compilations go; removed when the interpreter ends."""
    folder = Path(tempfile.mkdtemp(prefix="strandspring-kernel-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@functools.cache
def library() -> ctypes.CDLL:
    """The C files that travel inside an FMU and the driver in one shared library."""
    flags = ("-g", *SANITIZED) if "libasan" in os.environ.get("LD_PRELOAD", "") else ("-O2",)
    file = build_folder() / "driver.so"
    kernel = ctypes.CDLL(str(compiled(file, *flags, "-shared", "-fPIC", *SOURCES, HERE / "kernel_driver.c", "-lm")))
    kernel.driver_spring.restype = c_void_p
    for name, types in {
        "driver_spring": [c_void_p], "driver_free": [c_void_p], "driver_taken": [c_void_p],
        "driver_path": [c_void_p, c_int, c_void_p, c_double, c_void_p, c_void_p, c_void_p],
        "driver_saturation": [c_void_p, c_int, c_void_p, c_void_p, c_void_p],
        "spring_problem": [c_void_p, c_void_p, c_size_t],
    }.items():  # fmt: skip
        getattr(kernel, name).argtypes = types
    return kernel


def c_parameters(parameters: SpringParameters) -> ctypes.Structure:
    """The same spring for C."""
    return Parameters.from_buffer_copy(packed(parameters))


class Kernel:
    """Single steps of one spring in C.

    Parameters
    ----------
    parameters : SpringParameters or Parameters   The latter unchecked, as C takes them.
    """

    def __init__(self, parameters: SpringParameters | ctypes.Structure) -> None:
        given = c_parameters(parameters) if isinstance(parameters, SpringParameters) else parameters
        self.address = library().driver_spring(ctypes.addressof(given))
        weakref.finalize(self, library().driver_free, self.address)

    def along(self, displacement: FloatArray, omega: float) -> tuple[FloatArray, NDArray[np.void]]:
        """omega [-], force [N], stiffness [N/m] and absorbed energy [J] at each sample, shape (4, K), and derivatives
        of force and of stiffness, shape (2, K), as SpringGradient of spring.h.
        """
        path = np.ascontiguousarray(displacement, dtype=np.float64)
        response = np.empty((4, path.size))
        gradients = rows("SpringGradient", 2 * path.size)
        different = library().driver_path(
            self.address, path.size, path.ctypes.data, omega, response.ctypes.data,
            gradients.ctypes.data, gradients[path.size :].ctypes.data,
        )  # fmt: skip
        assert different == 0, f"trial and commit differ at {different} steps"
        return response, gradients.reshape(2, -1)

    def saturation(self, values: FloatArray) -> FloatArray:
        """W and its inverse, shape (2, K)."""
        found = np.empty((2, values.size))
        library().driver_saturation(self.address, values.size, values.ctypes.data, *(row.ctypes.data for row in found))
        return found


def by_stepper(parameters: SpringParameters, path: FloatArray, omega: float) -> FloatArray:
    """omega, force, stiffness and absorbed energy at each sample, shape (4, K), by Python's steps."""
    law, found = SpringLaw(parameters), []
    memory = stepper.start(float(path[0]), omega)
    for displacement in path.tolist():
        memory = stepper.integrate(law, stepper.trial(law, memory, displacement))
        found.append((memory.omega, stepper.force(law, memory), stepper.stiffness(law, memory), memory.energy))
    return np.array(found).T


def by_path(parameters: SpringParameters, path: FloatArray, omega: float) -> FloatArray:
    """The same by whole paths."""
    solver = PathSolver(parameters)
    return np.array([of(path, omega) for of in (solver.omega, solver.force, solver.stiffness, solver.absorbed_energy)])


def by_steps_in_c(parameters: SpringParameters, path: FloatArray, omega: float) -> FloatArray:
    """The same by the steps in C."""
    return Kernel(parameters).along(path, omega)[0]


in_each_way = pytest.mark.parametrize(
    "respond", [by_stepper, by_path, pytest.param(by_steps_in_c, marks=pytest.mark.long)]
)
