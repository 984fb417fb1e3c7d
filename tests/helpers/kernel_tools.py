"""The single steps of the C kernel, which the native FMU takes, compiled and reached by ctypes.

Whole paths, tables and points are tested as the package calls them, through `strandspring.kernel`.
"""

from __future__ import annotations

import atexit
import ctypes
import functools
import shutil
import subprocess
import tempfile
import weakref
from ctypes import POINTER, Structure, c_char_p, c_double, c_int, c_size_t, c_void_p
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import strandspring
from springs import along, spring
from strandspring import SpringParameters
from strandspring.core.parameters import KNOTS, MAXIMUM_AMPLIFIER_DEGREE, MAXIMUM_DEGREE, N_RANGE, SIGMA_RANGE
from strandspring.kernel.path import packed
from strandspring.kernel.structures import structures
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


class Gradient(Structure):
    """SpringGradient of spring.h, its fields named by what they are derivatives by."""

    _fields_ = [(name.removeprefix("by_"), kind) for name, kind, *_ in structures()["SpringGradient"]._fields_]


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
    """The C files that travel inside an FMU and the test driver in one shared library."""
    driver = HERE / "kernel_driver.c"
    kernel = ctypes.CDLL(
        str(compiled(build_folder() / "driver.so", "-O2", "-shared", "-fPIC", *SOURCES, driver, "-lm"))
    )
    kernel.driver_spring.restype = c_void_p
    kernel.driver_spring.argtypes = [POINTER(Parameters)]
    kernel.driver_free.argtypes = [c_void_p]
    kernel.driver_taken.argtypes = [c_void_p]
    kernel.driver_path.argtypes = [c_void_p, c_int, c_void_p, c_double, c_void_p]
    kernel.driver_gradient.argtypes = [c_void_p, c_int, c_void_p, c_double, c_void_p, c_void_p]
    kernel.driver_saturation.argtypes = [c_void_p, c_int, c_void_p, c_void_p]
    kernel.spring_problem.argtypes = [POINTER(Parameters), c_char_p, c_size_t]
    return kernel


def c_parameters(parameters: SpringParameters) -> Parameters:
    """The same spring for C."""
    return Parameters.from_buffer_copy(packed(parameters))


def problem(parameters: Parameters, size: int = 200) -> str:
    """What the kernel says is wrong with parameters; empty if nothing is."""
    text = ctypes.create_string_buffer(size)
    refused = library().spring_problem(ctypes.byref(parameters), text, size)
    assert refused == bool(text.value)
    return text.value.decode("ascii")


def room() -> int:
    """For pieces of a branch of W."""
    return int(library().driver_limit())


class Kernel:
    """Single steps of one spring.

    Parameters
    ----------
    parameters : SpringParameters or Parameters   The latter unchecked, as C takes them.
    """

    def __init__(self, parameters: SpringParameters | Parameters) -> None:
        self._library = library()
        given = parameters if isinstance(parameters, Parameters) else c_parameters(parameters)
        self._spring = self._library.driver_spring(ctypes.byref(given))
        weakref.finalize(self, self._library.driver_free, self._spring)

    def taken(self) -> int:
        """What of the room this spring takes."""
        return int(self._library.driver_taken(self._spring))

    def path(self, displacement: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """omega [-], force [N], stiffness [N/m] and absorbed energy [J] at each sample, shape (4, K)."""
        response = np.empty((4, displacement.size))
        path = np.ascontiguousarray(displacement)
        different = self._library.driver_path(
            self._spring, path.size, path.ctypes.data, omega_start, response.ctypes.data
        )
        assert different == 0, f"trial and commit differ at {different} steps"
        return response

    def gradients(self, displacement: FloatArray, omega_start: float = 0.0) -> tuple[list[Gradient], list[Gradient]]:
        """Derivatives of force and of stiffness at each sample."""
        path = np.ascontiguousarray(displacement)
        of_force, of_stiffness = (Gradient * path.size)(), (Gradient * path.size)()
        self._library.driver_gradient(
            self._spring, path.size, path.ctypes.data, omega_start, ctypes.byref(of_force), ctypes.byref(of_stiffness)
        )
        return list(of_force), list(of_stiffness)


def random_spring(random: np.random.Generator) -> SpringParameters:
    """Any possible spring: all of the supported range of n and sigma, its corners often, and all degrees."""
    edge = random.random() < 0.2
    degree = int(random.integers(0, MAXIMUM_AMPLIFIER_DEGREE + 1 if random.random() < 0.3 else 7))
    weights = random.uniform(-1.0, 1.0, degree)
    weights *= random.uniform(0.0, 0.95) / max(1.0, float(np.sum(np.abs(weights))))
    return spring(
        n=float(random.choice([N_RANGE[0], 1.0, 2.0, N_RANGE[1]]) if edge else 10.0 ** random.uniform(-2.0, 2.0)),
        sigma=float(random.choice(SIGMA_RANGE) if edge else 0.5 + 10.0 ** random.uniform(-2.0, 2.99)),
        saturations=10.0 ** random.uniform(-1.0, 2.0),
        elastic=tuple(random.uniform(-5.0, 5.0, random.integers(1, MAXIMUM_DEGREE + 2))),
        amplifier=tuple(weights),
        kappa_omega=float(random.choice([1e-3, 25.0, 1e6])),
        middle=float(random.choice([0.0, -0.3, 0.05])),
        half=float(random.choice([1e-4, 0.02, 3.0])),
    )


def random_table(random: np.random.Generator) -> SpringParameters:
    """The same with FE as a table of 7 to 25 knots, at distances that differ by up to 30 times."""
    p = random_spring(random)
    count = int(random.integers(KNOTS[0], KNOTS[1] + 1))
    shares = np.cumsum(10.0 ** random.uniform(-1.5, 0.0, count - 1))
    inner = p.displacement_min + shares[:-1] / shares[-1] * (p.displacement_max - p.displacement_min)
    return replace(
        p,
        kE=(),
        FE_knots=(p.displacement_min, *inner, p.displacement_max),
        FE_forces=tuple(p.kappa_omega * random.uniform(-5.0, 5.0, count)),
    )


def random_path(random: np.random.Generator, parameters: SpringParameters, steps: int) -> FloatArray:
    """Steps from 1e-12 to three times the range, standstills, many reversals, and excursions out of the range."""
    sizes = random.choice([0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 6.0], steps) * random.standard_normal(steps)
    fraction = float(random.uniform(-1.0, 1.0))
    path = [fraction]
    for size in sizes:
        fraction += size
        if abs(fraction) > 1.6:
            fraction = random.uniform(-1.4, 1.4)
        path.append(fraction)
    return along(parameters, path)
