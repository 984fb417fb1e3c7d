"""Which tool runs which kind of FMU, and how exactly: the matrix of the documentation.

A new kind of FMU is one entry of KINDS; a new tool is one entry of TOOLS and a module in `hosts`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from portable_host import wine
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.model.modelfile import ModelFile


class Sampling(Enum):
    """How far a tool's rows may be from the model: its largest error over the range of the values."""

    # The displacement of a row is that of its force. The FMU and the model are the same closed form in two languages.
    SAME_TIME = "exact"
    # The displacement at the start of a step is held over it. The fastest change in one step is 1.3e-3 of the force's
    # range at the step of the matrix.
    STEP_LATE = "one step late"

    @property
    def tolerance(self) -> float:
        return 1e-9 if self is Sampling.SAME_TIME else 2e-3


def _native(model: ModelFile, folder: Path) -> Path:
    return build_native_fmu(model, folder, chosen_platforms("all"))


def _native_by_fmi_3(model: ModelFile, folder: Path) -> Path:
    return build_native_fmu(model, folder, chosen_platforms("host"), fmi=3)


def build_with_states(model: ModelFile, folder: Path) -> Path:
    return build_native_fmu(model, folder, chosen_platforms("host"), with_states=True)


def _with_states_by_fmi_3(model: ModelFile, folder: Path) -> Path:
    return build_native_fmu(model, folder, chosen_platforms("host"), with_states=True, fmi=3)


CO_SIMULATION, MODEL_EXCHANGE = "CoSimulation", "ModelExchange"


@dataclass(frozen=True)
class Kind:
    """A kind of FMU: its column in the documentation, how it is built, and its interface as FMPy names it.

    `build` makes it by FMI 2.0, and `build_by_fmi_3` by FMI 3.0 where it exists.
    """

    title: str
    build: Callable[[ModelFile, Path], Path]
    interface: str
    build_by_fmi_3: Callable[[ModelFile, Path], Path] | None = None


NATIVE = Kind("native, co-simulation", _native, CO_SIMULATION, _native_by_fmi_3)
EXCHANGE = Kind("native, model exchange", _native, MODEL_EXCHANGE, _native_by_fmi_3)
STATES = Kind("native with states, model exchange", build_with_states, MODEL_EXCHANGE, _with_states_by_fmi_3)
PYTHON = Kind("Python-backed, co-simulation", build_python_fmu, CO_SIMULATION)
KINDS = (NATIVE, EXCHANGE, STATES, PYTHON)


@dataclass(frozen=True)
class Tool:
    """A row of the documentation.

    Attributes
    ----------
    title : str
    host : str               The module in `hosts` that runs it.
    results : mapping        How exact FMUs must be in it, or in words why it does not run them: by interface, and by
                             kind where that differs.
    fmi_3 : str or None      In words why it does not run FMUs of FMI 3.0; None if they give the bits of FMI 2.0.
    missing : callable       Why it cannot be run on this computer, or None.
    module : str or None     That brings it, of the extra `dev`.
    """

    title: str
    host: str
    results: Mapping[Kind | str, Sampling | str]
    fmi_3: str | None = None
    missing: Callable[[], str | None] = lambda: None
    module: str | None = None

    def result(self, kind: Kind) -> Sampling | str:
        return self.results[kind if kind in self.results else kind.interface]


def _without_wine() -> str | None:
    return None if wine() else "wine is not installed: the Windows binary was looked into by test_build.py only"


def _without_cofmupy() -> str | None:
    if Path(sys.prefix, "cofmupy").is_dir() or "STRANDSPRING_ALL_TOOLS" in os.environ:
        return None
    return "CoFMUPy is not installed: tests/interop/cofmupy.txt says how"


_SAME = {CO_SIMULATION: Sampling.SAME_TIME, MODEL_EXCHANGE: "has no model exchange"}
_LATE = {CO_SIMULATION: Sampling.STEP_LATE, MODEL_EXCHANGE: "has no model exchange"}
_HOST = {CO_SIMULATION: Sampling.SAME_TIME, MODEL_EXCHANGE: "not written for it"}

TOOLS = (
    Tool("`strandspring.simulate_fmu`", "with_strandspring", _SAME),
    Tool("FMPy, `simulate_fmu`", "with_fmpy", _LATE | {EXCHANGE: Sampling.SAME_TIME, STATES: Sampling.STEP_LATE}),
    Tool(
        "PathSim (pathsim-fmi)", "with_pathsim",
        _SAME | {EXCHANGE: "needs continuous states", STATES: Sampling.SAME_TIME},
        module="pathsim_fmi",
    ),
    Tool(
        "CasADi", "with_casadi",
        {CO_SIMULATION: "has no co-simulation", EXCHANGE: "knows states only", STATES: Sampling.SAME_TIME},
        module="casadi",
    ),
    Tool("CoFMUPy", "with_cofmupy", _SAME, missing=_without_cofmupy),
    Tool(
        "FMU Manipulation Toolbox: check, and container in FMPy", "with_container", _LATE,
        module="fmu_manipulation_toolbox",
    ),
    Tool("libcosim (libcosimpy)", "with_libcosimpy", _SAME, "\"Unsupported FMI version\"", module="libcosimpy"),
    Tool("Ecos (ecospy)", "with_ecospy", _SAME, module="ecospy"),
    Tool("host in C without Python", "with_c_host", _HOST | {PYTHON: "must preload libpython"}, "not written for it"),
    Tool(
        "the same for Windows, by wine", "with_wine", _HOST | {PYTHON: "must load Python first"},
        "not written for it", _without_wine, "ziglang",
    ),
)  # fmt: skip


def table() -> str:
    """The matrix as the documentation has it."""
    heads = ["tool", *(kind.title for kind in KINDS), "FMI 3.0"]
    rows = [
        [tool.title, *(_cell(tool.result(kind)) for kind in KINDS), f"- ({tool.fmi_3})" if tool.fmi_3 else "same bits"]
        for tool in TOOLS
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows))


def _cell(result: Sampling | str) -> str:
    return f"ok, {result.value}" if isinstance(result, Sampling) else f"- ({result})"
