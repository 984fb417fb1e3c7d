"""One instance of the FMU as its binary (fmu/bridge) sees it: arrays come and go as bytes, exceptions as statuses."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from functools import partial
from typing import Any

from .facade import Fmi2Status
from .slave import SpringSlave
from .state import State

# Status, answer, and the messages in the order of their events: a line each, of a digit for the status and ASCII.
Reply = tuple[int, Any, bytes]

_OK, _ERROR = int(Fmi2Status.ok), int(Fmi2Status.error)
# By FMI's types. No variable is a String, so that their values do not come.
_CODES = {"real": "d", "integer": "i", "boolean": "i", "string": "i"}


def start(slave: type[SpringSlave], resources: str, name: bytes, guid: bytes) -> Reply:
    """A new instance, if the host knows which FMU it is of.

    Parameters
    ----------
    slave : type of SpringSlave   That of the FMU.
    resources : str               The FMU's folder of this name.
    name : bytes                  Of the instance.
    guid : bytes                  What the host takes for the FMU's.
    """
    given = guid.decode("ascii", "replace")
    if given != slave.fmu_guid:
        return _ERROR, None, _line(_ERROR, f"The GUID must be {slave.fmu_guid}, got {given[:64]}.")
    component = Component(partial(slave, instance_name=name.decode("utf-8", "replace"), resources=resources))
    return _OK, component, b""


class Component:
    """One slave at a time; `reset` makes the next one.

    Parameters
    ----------
    new_slave : callable   Makes a slave with the start values.
    """

    def __init__(self, new_slave: Callable[[], SpringSlave]) -> None:
        self._new_slave = new_slave
        self.reset()

    def call(self, method: str, *arguments: Any) -> Reply:
        """What a method below returns; a refusal is an error with its sentence."""
        status, problem = _OK, b""
        answer: Any = b""
        try:
            answer = getattr(self, method)(*arguments)
        except ValueError as refusal:  # whose text is written for the user
            status, problem = _ERROR, _line(_ERROR, str(refusal))
        except BaseException as fault:  # nothing may reach the binary
            status = _ERROR
            problem = _line(_ERROR, f"`{method}` failed in Python by {type(fault).__name__}: {fault}")
        waiting, self._slave.log_queue[:] = list(self._slave.log_queue), ()
        return status, answer, b"".join(_line(message.status, message.msg) for message in waiting) + problem

    def reset(self) -> bytes:
        self._slave = self._new_slave()
        return b""

    def exit_initialization_mode(self) -> bytes:
        self._slave.exit_initialization_mode()
        return b""

    def terminate(self) -> bytes:
        self._slave.terminate()
        return b""

    def do_step(self, time_and_size: bytes) -> bytes:
        self._slave.do_step(*array("d", time_and_size))
        return b""

    def get(self, kind: str, references: bytes) -> bytes:
        values = getattr(self._slave, f"get_{kind}")(array("I", references).tolist())
        return array(_CODES[kind], values).tobytes()

    def set(self, kind: str, references: bytes, values: bytes) -> bytes:
        getattr(self._slave, f"set_{kind}")(array("I", references).tolist(), array(_CODES[kind], values).tolist())
        return b""

    def get_state(self, phase_and_times: bytes) -> State:
        phase, time, stop_time = array("d", phase_and_times)
        return self._slave._get_fmu_state()._replace(phase=int(phase), time=time, stop_time=stop_time)

    def set_state(self, state: State) -> bytes:
        self._slave._set_fmu_state(state)
        return array("d", (state.phase, state.time, state.stop_time)).tobytes()

    def to_bytes(self, state: State) -> bytes:
        return self._slave._fmu_state_to_bytes(state)

    def from_bytes(self, content: bytes) -> State:
        return self._slave._fmu_state_from_bytes(content)


def _line(status: int, text: str) -> bytes:
    """A message as the binary takes it, in printable ASCII; FMI takes # as the mark of a value reference."""
    printable = "".join(c if " " <= c <= "~" and c != "#" else "?" for c in " ".join(text.split()))
    return f"{int(status)}{printable}\n".encode("ascii")
