"""Shared by the tests of FMUs: springs, paths, files, and callbacks that keep the log."""

from __future__ import annotations

import itertools
import zipfile
from ctypes import byref
from pathlib import Path

import numpy as np
from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.logging import addLoggerProxy

from strandspring.core.parameters import SpringParameters

SPRING = SpringParameters(
    kE=(3.0, 1.1e4, -2.0e4, 1.0e6), kA=(1.0, 2.0, 30.0), kappa_omega=21.7, rho=310.0, sigma=1.3, n=0.22,
    displacement_offset=0.02, displacement_min=0.001, displacement_max=0.05,
)  # fmt: skip
OTHER = SpringParameters(
    kE=(0.0, 4.0e3), kA=(1.0,), kappa_omega=150.0, rho=90.0, sigma=0.7, n=1.6,
    displacement_offset=-0.01, displacement_min=-0.1, displacement_max=0.1,
)  # fmt: skip
# A name from anywhere, and the shortest and the longest spring.
AWKWARD = (
    "\"quoted\" 'single' <b>bold</b> </html> & \\ \\n ]]> <!-- \nnew line\ttab\rreturn äöü 弹簧 %s {name} ../../up "
    '"; end mount; */ int evil = 1; #error << 7*7 >> <% x %> {{ 7*7 }} // /* \\'
)
CONSTANT = SpringParameters((2.0,), (1.0,), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)
LONGEST = SpringParameters((0.0, 1e4, *[1e5] * 19), (1.0, *[1.0] * 8), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)


def contents_of(fmu: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def wandering_path(parameters: SpringParameters, samples: int, seed: int) -> np.ndarray:
    """Random path with many reversals, uneven steps, standstills and excursions out of the range."""
    random = np.random.default_rng(seed)
    low, high = parameters.displacement_min, parameters.displacement_max
    turns = random.uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), samples // 8)
    path = [parameters.displacement_offset]
    for turn in turns:
        shares = np.sort(random.uniform(0.0, 1.0, 6))
        path += [*(path[-1] + shares * (turn - path[-1])), turn, turn]
    return np.array(path)


# Status, category and text of messages, by the environment of the instance: FMPy's proxy knows one logger for all.
_messages: dict[int | None, list[tuple[int, str, str]]] = {}
_numbers = itertools.count(1)


@fmi2CallbackLoggerTYPE
def _logger(environment: int | None, _name: bytes, status: int, category: bytes, text: bytes) -> None:
    # Instances that FMPy itself makes later come here too, with no environment.
    _messages.setdefault(environment, []).append((status, (category or b"").decode(), text.decode()))


def callbacks_into(messages: list[tuple[int, str, str]]) -> fmi2CallbackFunctions:
    """Callbacks of an instance whose messages come into a list."""
    environment = next(_numbers)
    _messages[environment] = messages
    callbacks = fmi2CallbackFunctions(
        _logger, defaultCallbacks.allocateMemory, defaultCallbacks.freeMemory, componentEnvironment=environment
    )
    # Only a logger written in C sees the arguments of a format; FMPy's passes the text on.
    addLoggerProxy(byref(callbacks))
    return callbacks
