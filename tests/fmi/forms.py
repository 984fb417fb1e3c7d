"""The rows of the conformance table: every form of FMU by one name, built once, and motion for it."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from branched_springs import BRANCHED
from fmu_tools import SPRING, wandering_path
from native_tools import CO_SIMULATION, ERROR, FATAL, MODEL_EXCHANGE, OK, Library, Native, Native3, unpacked
from springs import TABLE
from strandspring import Spring, SpringParameters
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile
from system_fmu_tools import BOX, BOX_OPTIONS, NativeSystem, NativeSystem3, system_library

BRANCHES = BRANCHED["both"]
OUTPUTS = ("force", "stiffness", "absorbed_energy", "omega")


@dataclass(frozen=True)
class Form:
    """A row of the table: a spring, how its FMU is built, and as what it is instantiated.

    Parameters
    ----------
    options : mapping   Of `build_native_fmu`.
    exchange : bool     Model exchange; those with states are for nothing else.
    python : bool       Python-backed.
    """

    spring: SpringParameters = SPRING
    options: Mapping[str, Any] = field(default_factory=dict, hash=False)
    exchange: bool = False
    python: bool = False
    outputs = OUTPUTS

    @property
    def fmi(self) -> int:
        return int(self.options.get("fmi", 2))

    @property
    def has_states(self) -> bool:
        return bool(self.options.get("with_states"))

    @property
    def refusal(self) -> int:
        """The status of what is refused."""
        return FATAL if self.python else ERROR

    @property
    def starts(self) -> dict[str, float]:
        """Where omega starts, of each mechanism."""
        return {"omega_start": 0.3} | ({"second_omega_start": -0.2} if self.spring.second else {})

    def build(self, folder: Path) -> Path:
        """The FMU in a folder; displacement is counted as in the parameters."""
        model = ModelFile("spring", self.spring)
        if self.python:
            return build_python_fmu(model, folder, zero=0.0)
        return build_native_fmu(model, folder, chosen_platforms("host"), zero=0.0, **self.options)

    def library(self, spring: SpringParameters | None = None) -> Library:
        """Of another spring if asked for, built and unpacked once in a process."""
        return _library(replace(self, spring=spring or self.spring, exchange=False))

    def instance(self, spring: SpringParameters | None = None) -> Native:
        kind = MODEL_EXCHANGE if self.exchange or self.has_states else CO_SIMULATION
        return (Native if self.fmi == 2 else Native3)(self.library(spring), kind)

    @contextmanager
    def begun(self, displacement: float | None = None, **start: float) -> Iterator[Native]:
        """An instance at the beginning of a path, by default at the offset."""
        with self.instance() as one:
            yield one.begin(**start | ({} if displacement is None else {"displacement": displacement}))

    def motion(self, samples: int = 160, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """A path with reversals, standstills and excursions, and times with steps of 1e-6 to 10 s and of no size."""
        path = wandering_path(self.spring, samples, seed)
        steps = 10.0 ** np.random.default_rng(seed + 100).uniform(-6.0, 1.0, path.size - 1)
        steps[::9] = 0.0
        return path, np.concatenate([[0.0], np.cumsum(steps)])

    def moved(self, one: Native) -> bytes:
        """The state of an instance that has begun, in the middle of a path, or of a life of the form with states."""
        if self.has_states:
            assert one.set(velocity=0.2, omega=0.4, rho=100.0) == OK
            one.accept(0.1, self.spring.displacement_max)
        else:
            path, time = self.motion(80)
            one.along(path[:40], time[:40], *self.outputs)
            assert one.tune(rho=100.0, displacement=float(path[30])) == OK
        return one.serialized()

    def expected(
        self, path: np.ndarray, time: np.ndarray, starts: Mapping[str, float], resolution: float = 0.0
    ) -> np.ndarray:
        """The rows of `outputs` by the package, shape (outputs, K)."""
        p, spring = self.spring, Spring(self.spring)
        omegas = (starts.get("omega_start", 0.0), starts.get("second_omega_start", 0.0))
        start = omegas if p.second else omegas[0]
        rows = {
            "force": spring.response(path, start, time, resolution),
            "stiffness": PathSolver(p).stiffness(path, start),
            "absorbed_energy": spring.absorbed_energy(path, start, time=time),
            "omega": PathSolver(p).omegas(path, omegas)[0],
        }
        return np.array([rows[name] for name in self.outputs])


class SystemForm(Form):
    """That of a system of bodies, whose base is shaken."""

    @property
    def outputs(self) -> tuple[str, ...]:
        return "sway_c_g_x", "force_corner_1_z", "absorbed_energy"

    def library(self, spring: SpringParameters | None = None) -> Library:
        """Of another system, if a spring is given."""
        system = BOX.with_springs(lambda _: spring) if spring else BOX
        return system_library(system, replace(BOX_OPTIONS, fmi=self.fmi))

    def instance(self, spring: SpringParameters | None = None) -> Native:
        return (NativeSystem if self.fmi == 2 else NativeSystem3)(self.library(spring))

    @contextmanager
    def begun(self, _: float | None = None, **start: float) -> Iterator[Native]:
        with self.instance() as one:
            yield one.begin(**start)

    def motion(self, samples: int = 160, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations of the base [m/s^2], and times with steps of up to 10 ms."""
        random = np.random.default_rng(seed)
        return random.normal(0.0, 20.0, samples), np.cumsum(10.0 ** random.uniform(-5.0, -2.0, samples))

    def moved(self, one: Native) -> bytes:
        path, time = self.motion(80)
        one.along(path[:40], time[:40])
        return one.serialized()


@functools.cache
def _library(form: Form) -> Library:
    return unpacked(form.build)


FORMS: dict[str, Form] = {
    "co-simulation": Form(),
    "model exchange": Form(exchange=True),
    "states": Form(options={"with_states": True}),
    "fmi3": Form(options={"fmi": 3}),
    "fmi3 exchange": Form(options={"fmi": 3}, exchange=True),
    "fmi3 states": Form(options={"fmi": 3, "with_states": True}),
    "python": Form(python=True),
    "table": Form(TABLE),
    "table, states": Form(TABLE, {"with_states": True}),
    "table, python": Form(TABLE, python=True),
    "branches": Form(BRANCHES),
    "branches, fmi3": Form(BRANCHES, {"fmi": 3}),
    "branches, states": Form(BRANCHES, {"with_states": True}),
    "branches, python": Form(BRANCHES, python=True),
    "system": SystemForm(),
    "system, fmi3": SystemForm(options={"fmi": 3}),
}


def rows(of: Callable[[Form], object] = lambda _: True) -> list[str]:
    """The names of forms of a kind of a single spring."""
    return [name for name, form in FORMS.items() if of(form) and not isinstance(form, SystemForm)]


SYSTEMS = [name for name, form in FORMS.items() if isinstance(form, SystemForm)]
# Forms with a memory, which follow a path.
PATHS = rows(lambda form: not form.has_states)
STEPPED = rows(lambda form: not (form.exchange or form.has_states))
NATIVE_PATHS = rows(lambda form: not (form.has_states or form.python))
STATES = rows(lambda form: form.has_states)
