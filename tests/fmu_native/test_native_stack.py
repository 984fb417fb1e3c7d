"""No call of a native FMU takes much stack: threads of hosts may have 128 kB, as by default with musl, or less."""

from __future__ import annotations

import ctypes
import platform
import sys
from collections.abc import Callable
from ctypes import addressof, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p, cast
from functools import cache, partial
from typing import Any

import fmpy
import pytest
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE, fmi2EventInfo

from branched_springs import BRANCHED
from fmu_tools import SPRING
from kernel_tools import HERE, build_folder, compiled
from native_tools import CO_SIMULATION, ERROR, FUNCTIONS, FUNCTIONS3, MODEL_EXCHANGE, OK, Library, doubles, library
from springs import TABLE
from system_fmu3_tools import system_library3
from system_fmu_tools import BRANCHED as BRANCHED_BOX
from system_fmu_tools import system_library

MOST_STACK = 32768  # of any call [B]
SPRING_FORMS: dict[str, tuple[dict[str, Any], int]] = {
    "usual": ({"parameters": SPRING}, CO_SIMULATION),
    "exchange": ({"parameters": TABLE}, MODEL_EXCHANGE),
    "states": ({"parameters": BRANCHED["both"], "with_states": True}, MODEL_EXCHANGE),
    "branches": ({"parameters": BRANCHED["table"]}, CO_SIMULATION),
    "real_time": ({"parameters": BRANCHED["both"], "real_time": True}, CO_SIMULATION),
    "no_energy": ({"parameters": TABLE, "real_time": True, "no_energy": True}, CO_SIMULATION),
}
# How to get the FMU, and as what it is instantiated.
FORMS: dict[str, tuple[Callable[[], Library], int]] = {
    **{f"{name}{fmi}": (partial(library, fmi=fmi, **form), kind) for name, (form, kind) in SPRING_FORMS.items()
       for fmi in (2, 3)},
    "arrays3": (partial(library, TABLE, fmi=3, arrays=True), CO_SIMULATION),
    "system2": (partial(system_library, BRANCHED_BOX), CO_SIMULATION),
    "system3": (partial(system_library3, BRANCHED_BOX), CO_SIMULATION),
}  # fmt: skip
# Names of FMI 2.0 that FMI 3.0 has otherwise.
RENAMED = {
    "GetReal": "GetFloat64", "SetReal": "SetFloat64", "GetFMUstate": "GetFMUState", "SetFMUstate": "SetFMUState",
    "FreeFMUstate": "FreeFMUState", "SerializedFMUstateSize": "SerializedFMUStateSize",
    "SerializeFMUstate": "SerializeFMUState", "DeSerializeFMUstate": "DeserializeFMUState",
    "GetDerivatives": "GetContinuousStateDerivatives", "GetRealOutputDerivatives": "GetOutputDerivatives",
}  # fmt: skip

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() not in ("x86_64", "aarch64"), reason="looks at the stack of these"
)


@cache
def shim() -> ctypes.CDLL:
    output = build_folder() / "stack_calls.so"
    made = ctypes.CDLL(str(compiled(output, "-O1", "-shared", "-fPIC", HERE / "stack_calls.c")))
    made.stack_of_call.argtypes = [c_void_p] * 4
    return made


class Host:
    """One instance, and the most stack that each call has taken.

    Parameters
    ----------
    of : Library
    kind : int           CO_SIMULATION or MODEL_EXCHANGE.

    Attributes
    ----------
    taken : dict         Bytes by the name of the function.
    """

    def __init__(self, of: Library, kind: int) -> None:
        description = fmpy.read_model_description(str(of.folder))
        self.fmi, self.functions, self.taken = int(description.fmiVersion[0]), of.functions, dict[str, int]()
        self._references = of.references
        self.outputs = [v.name for v in description.modelVariables if v.causality == "output"]
        self.inputs = [v.name for v in description.modelVariables if v.causality == "input"]
        self.is_spring, guid = "force" in of.references, of.guid.encode()
        self._begin: list[int] = []
        logger = cast(shim()[f"hear{self.fmi}"], fmi2CallbackLoggerTYPE)
        if self.fmi == 2:
            callbacks = fmi2CallbackFunctions(logger=logger)
            component = self.call("Instantiate", b"one", kind, guid, b"", callbacks, 0, 1)
        elif kind == MODEL_EXCHANGE:
            component = self.call("InstantiateModelExchange", b"one", guid, b"", 0, 1, None, logger)
        else:
            component = self.call("InstantiateCoSimulation", b"one", guid, b"", 0, 1, 0, 0, None, 0, None, logger, None)
        assert component
        self._begin = [component]

    def call(self, name: str, *arguments: Any) -> int:
        """What a function returns; it is given the addresses of objects of ctypes."""
        function = f"fmi{self.fmi}{RENAMED.get(name, name) if self.fmi == 3 else name}"
        kept = [_word(argument) for argument in arguments if not isinstance(argument, float)]
        words = (c_size_t * 14)(*self._begin, *(word for word, _ in kept))
        reals = (c_double * 3)(*(argument for argument in arguments if isinstance(argument, float)))
        answer, address = c_size_t(), cast(self.functions[function], c_void_p)
        used = shim().stack_of_call(address, *map(addressof, (words, reals, answer)))
        self.taken[function] = max(used, self.taken.get(function, 0))
        return answer.value if "Instantiate" in name else c_int(answer.value).value

    def ok(self, name: str, *arguments: Any) -> None:
        assert self.call(name, *arguments) == OK, name

    def counted(self, values: ctypes.Array[c_double]) -> list[Any]:
        """Values, and their number where the version asks for it."""
        return [values, len(values)] if self.fmi == 3 else [values]

    def references(self, *names: str) -> list[Any]:
        return [(c_uint * len(names))(*(self._references[name] for name in names)), len(names)]

    def set(self, *names: str, value: float) -> None:
        self.ok("SetReal", *self.references(*names), *self.counted(doubles([value] * len(names))))

    def get(self) -> None:
        """Read all outputs, and derivatives where there are any."""
        self.ok("GetReal", *self.references(*self.outputs), *self.counted(doubles([0.0] * len(self.outputs))))
        if self.is_spring:
            force, displacement, one = self.references("force"), self.references("displacement"), doubles([1.0])
            for call in ("GetDirectionalDerivative", *(["GetAdjointDerivative"] if self.fmi == 3 else [])):
                self.ok(call, *force, *displacement, *self.counted(one), *self.counted(doubles([0.0])))

    def initialize(self, expected: int = OK) -> None:
        if self.fmi == 2:
            self.ok("SetupExperiment", 0, 0.0, 0.0, 0, 0.0)
            self.ok("EnterInitializationMode")
        else:
            self.ok("EnterInitializationMode", 0, 0.0, 0.0, 0, 0.0)
        if expected == OK:
            self.get()
        assert self.call("ExitInitializationMode") == expected

    def go_to_another_state(self) -> None:
        """To the present one by its bytes."""
        state, copy, size = c_void_p(), c_void_p(), c_size_t()
        self.ok("GetFMUstate", state)
        self.ok("SerializedFMUstateSize", state.value, size)
        content = (ctypes.c_ubyte * size.value)()
        self.ok("SerializeFMUstate", state.value, content, size.value)
        self.ok("DeSerializeFMUstate", content, size.value, copy)
        self.ok("SetFMUstate", copy.value)
        for used in (state, copy):
            self.ok("FreeFMUstate", used)

    def step(self, time: float, value: float) -> None:
        """With a derivative of the input where it may have one."""
        self.set(*self.inputs, value=value)
        if self.fmi == 2 and self.is_spring:
            self.call("SetRealInputDerivatives", *self.references("displacement"), (c_int * 1)(1), doubles([1e-3]))
        flags = [(ctypes.c_bool * 1)() for _ in range(3)]
        if self.fmi == 2:
            self.ok("DoStep", time, 1e-3, 1)
        else:
            self.ok("DoStep", time, 1e-3, 1, *flags, c_double())
        self.get()
        if self.is_spring:
            order, rate = (c_int * 1)(1), self.counted(doubles([0.0]))
            self.ok("GetRealOutputDerivatives", *self.references("force"), order, *rate)

    def exchange(self, time: float, value: float) -> None:
        """One evaluation of model exchange, accepted, and an event."""
        flags, number, states = [(c_int * 1)() for _ in range(5)], c_size_t(), doubles([0.0] * 9)
        if self.fmi == 2:
            self.ok("NewDiscreteStates", fmi2EventInfo())
        else:
            self.ok("UpdateDiscreteStates", *flags, c_double())
        self.ok("EnterContinuousTimeMode")
        self.ok("SetTime", time)
        self.set(*self.inputs, value=value)
        self.get()
        count = sum(name.startswith("der(") for name in self._references)
        for call in ("GetContinuousStates", "SetContinuousStates", "GetDerivatives", "GetNominalsOfContinuousStates"):
            self.ok(call, states, count)
        self.ok("GetEventIndicators", doubles([0.0]), int(count == 0))
        if self.fmi == 3:
            self.ok("GetNumberOfContinuousStates", number)
        self.ok("CompletedIntegratorStep", 1, flags[0], flags[1])
        self.ok("EnterEventMode")


def _word(argument: Any) -> tuple[int, Any]:
    """A word that is passed, and what must stay until then."""
    if isinstance(argument, bytes):
        text = c_char_p(argument)
        return cast(text, c_void_p).value or 0, text
    if argument is None or isinstance(argument, int):
        return argument or 0, None
    if isinstance(argument, fmi2CallbackLoggerTYPE):
        return cast(argument, c_void_p).value or 0, None
    return addressof(argument), argument


@pytest.mark.parametrize("form", FORMS)
def test_no_call_takes_much_stack(form: str) -> None:
    build, kind = FORMS[form]
    host = Host(build(), kind)
    host.initialize()
    advance = host.exchange if kind == MODEL_EXCHANGE else host.step
    for k, value in enumerate((0.01, 0.02, -0.01, 0.3, 0.015)):  # out of the range, too, which is a warning
        advance(1e-3 * k, value)
    if host.is_spring:  # a new table
        for parameter in ("rho", "n"):
            host.set(parameter, value=0.7)
        host.get()
    host.go_to_another_state()
    # All others, refused for want of arguments or in this mode.
    names = {name for name in {2: FUNCTIONS, 3: FUNCTIONS3}[host.fmi] if hasattr(host.functions, name)}
    for name in sorted(names - host.taken.keys()):
        if "Instantiate" not in name and "FreeInstance" not in name:
            host.call(name[4:])
    host.ok("Reset")
    if host.is_spring:
        host.set("rho", value=-1.0)
        host.initialize(expected=ERROR)
    host.ok("Terminate")
    host.call("FreeInstance")
    table = dict(sorted(host.taken.items(), key=lambda item: -item[1]))
    print(form, table)
    assert names - table.keys() <= {name for name in names if "Instantiate" in name}
    assert max(table.values()) <= MOST_STACK, table
