"""The rows of the conformance table: every form of FMU by one name, built once, and one driver of FMI calls for all.

The driver is `native_tools.Native`, whose calls are those of FMI 2.0; `Instance3` understands them in FMI 3.0. What a
law needs of a form is asked of the form: whether it follows a path, can be differentiated, or has a solver's states.
"""

from __future__ import annotations

import functools
import itertools
import math
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from ctypes import byref, c_bool, c_double, c_size_t, c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.fmi2 import fmi2EventInfo
from fmpy.fmi3 import fmi3LogMessageCallback

from branched_springs import BRANCHED
from fmu_tools import SPRING, wandering_path
from native_tools import CO_SIMULATION, ERROR, MODEL_EXCHANGE, OK, Library, Native, doubles
from oracles import OracleSpring
from springs import TABLE
from strandspring import Spring, SpringParameters
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile

BRANCHES = BRANCHED["both"]
FATAL = 4  # the one error of PythonFMU
OUTPUTS = ("force", "stiffness", "absorbed_energy", "omega")
# Names of FMI 2.0 that FMI 3.0 has otherwise.
RENAMED = {
    "GetFMUstate": "GetFMUState", "SetFMUstate": "SetFMUState", "FreeFMUstate": "FreeFMUState",
    "SerializedFMUstateSize": "SerializedFMUStateSize", "SerializeFMUstate": "SerializeFMUState",
    "DeSerializeFMUstate": "DeserializeFMUState", "GetDerivatives": "GetContinuousStateDerivatives",
    "GetReal": "GetFloat64", "SetReal": "SetFloat64", "GetRealOutputDerivatives": "GetOutputDerivatives",
    "NewDiscreteStates": "UpdateDiscreteStates",
}  # fmt: skip
_FOLDER = tempfile.TemporaryDirectory(prefix="strandspring-forms-", ignore_cleanup_errors=True)
_numbers = itertools.count(1)


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

    @property
    def fmi(self) -> int:
        return int(self.options.get("fmi", 2))

    @property
    def has_states(self) -> bool:
        return bool(self.options.get("with_states"))

    @property
    def outputs(self) -> tuple[str, ...]:
        return tuple(name for name in OUTPUTS if name != "absorbed_energy" or "no_energy" not in self.options)

    @property
    def refusal(self) -> int:
        """The status of what is refused."""
        return FATAL if self.python else ERROR

    @property
    def starts(self) -> dict[str, float]:
        """Where omega starts, of each mechanism."""
        return {"omega_start": 0.3} | ({"second_omega_start": -0.2} if self.spring.second else {})

    def build(self, folder: Path, spring: SpringParameters | None = None) -> Path:
        """The FMU in a folder, of another spring if asked for; displacement is counted as in the parameters."""
        model = ModelFile("spring", spring or self.spring)
        if self.python:
            return build_python_fmu(model, folder, zero=0.0)
        return build_native_fmu(model, folder, chosen_platforms("host"), zero=0.0, **self.options)

    def library(self, spring: SpringParameters | None = None) -> Library:
        """Built and unpacked once in a process."""
        return _library(self.python, tuple(sorted(self.options.items())), spring or self.spring)

    def instance(self, spring: SpringParameters | None = None, **given: Any) -> Instance:
        kind = MODEL_EXCHANGE if self.exchange or self.has_states else CO_SIMULATION
        return (Instance if self.fmi == 2 else Instance3)(self.library(spring), kind, **given)

    @contextmanager
    def begun(self, displacement: float, **start: float) -> Iterator[Instance]:
        """An instance at the beginning of a path."""
        with self.instance() as one:
            one.begin(displacement=displacement, **start)
            yield one

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


@functools.cache
def _library(python: bool, options: tuple[tuple[str, Any], ...], spring: SpringParameters) -> Library:
    folder = Path(_FOLDER.name, str(next(_numbers)))
    with zipfile.ZipFile(Form(spring, dict(options), python=python).build(folder)) as archive:
        archive.extractall(folder / "unpacked")
    return Library(folder / "unpacked")


class Instance(Native):
    """One instance of FMI 2.0, which knows how far its path has come."""

    time = 0.0

    @property
    def is_exchange(self) -> bool:
        return self.kind == MODEL_EXCHANGE

    def __init__(self, of: Library, kind: int = CO_SIMULATION, **given: Any) -> None:
        self.kind = kind
        super().__init__(of, kind, **given)

    def begin(self, **start: float) -> Instance:
        """To where a path begins: step mode, or continuous-time mode."""
        self.begin_continuous_time(**start) if self.is_exchange else self.initialize(**start)
        return self

    def advance(self, displacement: float, size: float = 1e-3) -> None:
        """Commit the straight path to a displacement [m] in a time [s]."""
        if self.is_exchange:
            self.time += size
            if self.accept(self.time, displacement):
                self.event()
        else:
            assert self.set(displacement=displacement) == OK, self.said
            assert self.DoStep(c_double(self.time), c_double(size), 1) == OK, self.said
            self.time += size

    def tune(self, **values: float) -> int:
        """The status of setting values where parameters may be set between steps."""
        if not self.is_exchange or "omega_start" not in self.library.references:
            return self.set(**values)
        assert self.EnterEventMode() == OK
        status = self.set(**values)
        assert self.NewDiscreteStates(byref(fmi2EventInfo())) == OK
        assert self.EnterContinuousTimeMode() == OK
        return status

    def along(self, path: np.ndarray, time: np.ndarray, *names: str) -> list[list[float]]:
        """Outputs after each step of a path."""
        rows = []
        for x, h in zip(path[1:].tolist(), np.diff(time).tolist(), strict=True):
            self.advance(x, h)
            rows.append(self.get(*names))
        return rows

    def set_states(self, *values: float) -> int:
        """fmi2SetContinuousStates."""
        return int(self.SetContinuousStates(doubles(values), c_size_t(len(values))))

    def rates(self, count: int = 2) -> list[float]:
        """fmi2GetDerivatives."""
        found = (c_double * count)()
        assert self.GetDerivatives(found, c_size_t(count)) == OK, self.said
        return list(found)

    def directional(self, unknowns: list[str], seeds: Mapping[str, float]) -> int:
        """The status of fmi2GetDirectionalDerivative; `found` has its values."""
        self.found = doubles([7.0] * len(unknowns))
        return int(
            self.GetDirectionalDerivative(
                self.references(*unknowns), c_size_t(len(unknowns)), self.references(*seeds), c_size_t(len(seeds)),
                doubles(list(seeds.values())), self.found,
            )
        )  # fmt: skip


class Instance3(Instance):
    """The same of FMI 3.0: its calls are understood by their names and arguments of FMI 2.0."""

    def __init__(
        self, of: Library, kind: int = CO_SIMULATION, name: str = "one", guid: str | None = None, logging: bool = True,
        events: bool = False,
    ) -> None:  # fmt: skip
        self.library, self.kind, self.messages = of, kind, []
        self._logger = fmi3LogMessageCallback(
            lambda _, status, category, text: self.messages.append((status, category.decode(), text.decode()))
        )
        begin = (name.encode(), (guid or of.guid).encode(), None, c_bool(False), c_bool(logging))
        functions = of.functions
        functions.fmi3InstantiateModelExchange.restype = c_void_p
        if kind == MODEL_EXCHANGE:
            self.component = functions.fmi3InstantiateModelExchange(*begin, None, self._logger)
        else:
            self.component = functions.fmi3InstantiateCoSimulation(
                *begin, c_bool(events), c_bool(True), None, c_size_t(0), None, self._logger, None
            )
        self._experiment: tuple[Any, ...] = (c_bool(False), c_double(0.0), c_double(0.0), c_bool(False), c_double(0.0))

    def __exit__(self, *_: object) -> None:
        self.library.functions.fmi3FreeInstance(c_void_p(self.component))

    def __getattr__(self, name: str) -> Any:
        function = getattr(self.library.functions, f"fmi3{RENAMED.get(name, name)}")
        return functools.partial(function, c_void_p(self.component))

    def _counted(name: str, *places: int) -> Callable[..., int]:  # type: ignore[misc]  # noqa: N805
        """A call that, unlike in FMI 2.0, takes the number of values: after arguments i, the one of argument j."""

        def call(self: Instance3, *given: Any) -> int:
            arguments = list(given)
            for after, count in sorted(zip(places[::2], places[1::2], strict=True), reverse=True):
                arguments.insert(after + 1, given[count])
            return int(self.__getattr__(name)(*arguments))

        return call

    SetReal = _counted("SetFloat64", 2, 1)
    GetReal = _counted("GetFloat64", 2, 1)
    GetBoolean = _counted("GetBoolean", 2, 1)
    GetDirectionalDerivative = _counted("GetDirectionalDerivative", 4, 3, 5, 1)
    GetAdjointDerivative = _counted("GetAdjointDerivative", 4, 1, 5, 3)
    GetRealOutputDerivatives = _counted("GetOutputDerivatives", 3, 1)

    @property
    def extrapolating(self) -> bool:
        found = c_bool()
        assert self.GetBoolean(self.references("extrapolating"), c_size_t(1), byref(found)) == OK
        return found.value

    def SetupExperiment(self, *experiment: Any) -> int:  # noqa: N802
        """Kept, for it is given with the next call."""
        self._experiment = experiment
        return OK

    def EnterInitializationMode(self) -> int:  # noqa: N802
        return int(self.__getattr__("EnterInitializationMode")(*self._experiment))

    def NewDiscreteStates(self, _: Any) -> int:  # noqa: N802
        """fmi3UpdateDiscreteStates, which asks for nothing."""
        flags = [c_bool(True) for _ in range(5)]
        status = int(self.__getattr__("UpdateDiscreteStates")(*map(byref, flags), byref(c_double())))
        assert status != OK or not any(flag.value for flag in flags)
        return status

    def CompletedIntegratorStep(self, no_set: int, enter: Any, terminate: Any) -> int:  # noqa: N802
        flags = c_bool(True), c_bool(True)
        status = int(self.__getattr__("CompletedIntegratorStep")(c_bool(bool(no_set)), *map(byref, flags)))
        enter._obj.value, terminate._obj.value = (int(flag.value) for flag in flags)
        return status

    def DoStep(self, time: Any, size: Any, _: int) -> int:  # noqa: N802
        """fmi3DoStep, which never ends early."""
        flags, reached = [c_bool(True) for _ in range(3)], c_double(math.nan)
        status = int(self.__getattr__("DoStep")(time, size, c_bool(True), *map(byref, flags), byref(reached)))
        if status == OK:
            assert [flag.value for flag in flags] == [False] * 3
            assert reached.value == time.value + size.value
        else:  # refused by itself, or since no step may be done
            assert math.isnan(reached.value) or reached.value == self.get("time")[0]
        return status

    def adjoint(self, unknowns: list[str], knowns: list[str], seed: list[float]) -> list[float]:
        """fmi3GetAdjointDerivative."""
        found = (c_double * len(knowns))()
        status = self.GetAdjointDerivative(
            self.references(*unknowns), c_size_t(len(unknowns)), self.references(*knowns), c_size_t(len(knowns)),
            doubles(seed), found,
        )  # fmt: skip
        assert status == OK, self.said
        return list(found)


FORMS: dict[str, Form] = {
    "co-simulation": Form(),
    "model exchange": Form(exchange=True),
    "states": Form(options={"with_states": True}),
    "fmi3": Form(options={"fmi": 3}),
    "fmi3 exchange": Form(options={"fmi": 3}, exchange=True),
    "fmi3 states": Form(options={"fmi": 3, "with_states": True}),
    "fmi3 arrays": Form(options={"fmi": 3, "arrays": True}),
    "real time": Form(options={"real_time": True}),
    "no energy": Form(options={"fmi": 3, "real_time": True, "no_energy": True}),
    "python": Form(python=True),
    "table": Form(TABLE),
    "table, arrays": Form(TABLE, {"fmi": 3, "arrays": True}),
    "table, states": Form(TABLE, {"with_states": True}),
    "table, python": Form(TABLE, python=True),
    "branches": Form(BRANCHES),
    "branches, fmi3": Form(BRANCHES, {"fmi": 3}),
    "branches, real time": Form(BRANCHES, {"real_time": True}),
    "branches, states": Form(BRANCHES, {"with_states": True}),
    "branches, python": Form(BRANCHES, python=True),
}


def rows(of: Callable[[Form], object] = lambda _: True) -> list[str]:
    """The names of forms of a kind."""
    return [name for name, form in FORMS.items() if of(form)]


# Forms with a memory, which follow a path.
PATHS = rows(lambda form: not form.has_states)
STEPPED = rows(lambda form: not (form.exchange or form.has_states))
NATIVE_PATHS = rows(lambda form: not (form.has_states or form.python))


def motion(p: SpringParameters, samples: int = 160, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """A path with reversals, standstills and excursions, and times with steps of 1e-6 to 10 s and some of no size."""
    path = wandering_path(p, samples, seed)
    steps = 10.0 ** np.random.default_rng(seed + 100).uniform(-6.0, 1.0, path.size - 1)
    steps[::9] = 0.0
    return path, np.concatenate([[0.0], np.cumsum(steps)])


@functools.cache
def oracle_force(p: SpringParameters) -> np.ndarray:
    """Force along `motion(p, 60)` by an ODE solver, from omega 0.3 and -0.2 of a second mechanism [N]."""
    path, time = motion(p, 60)
    tight = {"rtol": 1e-11, "atol": 1e-13}
    first = OracleSpring(p.mechanisms[0].as_dict(), **tight).force(path, 0.3)
    parts = [OracleSpring(m.as_dict(), **tight).force(path, -0.2) for m in p.mechanisms[1:]]
    if p.branches:
        of_branches = {"kE": [0.0], "kA": [1.0], "kappa_omega": 0.0, "rho": 1.0, "sigma": 1.0, "n": 1.0}
        place = {name: getattr(p, name) for name in ("displacement_offset", "displacement_min", "displacement_max")}
        rows = [{"stiffness": b.stiffness, "time_constant": b.time_constant} for b in p.branches]
        parts.append(OracleSpring({**of_branches, **place, "branches": rows}).force(path, 0.0, time))
    return np.asarray(first + sum(parts))


def moved(form: Form, one: Instance) -> bytes:
    """A state in the middle of a path, or of a life of the form with states."""
    if form.has_states:
        assert one.set(velocity=0.2, omega=0.4, rho=100.0) == OK
        one.accept(0.1, form.spring.displacement_max)
    else:
        path, time = motion(form.spring, 80)
        one.along(path[:40], time[:40], *form.outputs)
        assert one.tune(rho=100.0, displacement=float(path[30])) == OK
    return one.serialized()
