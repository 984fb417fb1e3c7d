"""The tables [[case]] of SYSTEM.toml as load cases: one for each direction."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import singledispatchmethod
from pathlib import Path

import numpy as np

from ...errors import MountedSystemError
from ...ground.quoting import quoted
from ..bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from ..bodies.parts import RigidBody, Vector
from ..signals.pulses import (
    TabulatedPulse,
)
from ..signals.recorded_signal import RecordedSignal
from . import quantity_text as q
from .case_tables import (
    CaseTable,
    DirectedCase,
    DropCase,
    ForceCase,
    ForceTableOfCase,
    RecordCase,
)
from .described_signals import pulse_of
from .described_system import body_number
from .described_vibration import AXES, Vibration, vibration_of
from .named_files import NamedFiles
from .record_columns import RecordColumn, read_timed_columns
from .system_tables import MOST_CASES
from .table_types import Direction, located

_HELD = 1e-9


@dataclass(frozen=True)
class CaseBuilder:
    """Makes load cases of tables.

    Parameters
    ----------
    bodies : tuple of RigidBody
    gravity : Vector
    afterwards : float                How long motion is simulated after a load has ended [s].
    files : NamedFiles                Those that the tables name.
    """

    bodies: tuple[RigidBody, ...]
    gravity: Vector
    afterwards: float
    files: NamedFiles

    def load_cases(self, tables: Sequence[CaseTable]) -> tuple[LoadCase, ...]:
        """The load cases of all tables.

        Raises
        ------
        MountedSystemError   If a case cannot be; the message names the field.
        """
        cases: list[LoadCase] = []
        for k, table in enumerate(tables):
            with located("case", k):
                cases += self.build(table)
            if len(cases) > MOST_CASES:
                raise MountedSystemError(
                    f"case: there may be at most {MOST_CASES} cases, one for each direction; split the file."
                )
        name, count = Counter(case.name for case in cases).most_common(1)[0] if cases else ("", 0)
        if count > 1:
            raise MountedSystemError(f"case: {quoted(name)} is the name of {count} cases; give each direction once.")
        return tuple(cases)

    @singledispatchmethod
    def build(self, table: CaseTable) -> list[LoadCase]:
        """The cases of a table."""
        raise TypeError(f"No load case is made of {type(table).__name__}.")

    @build.register
    def _(self, table: DirectedCase) -> list[LoadCase]:
        vibration = vibration_of(table, self.files, self.afterwards)
        if not vibration.by_axis:
            return [
                self._vibration(table, vibration, name, f" along {direction.text}", direction.vector)
                for name, direction in self._directions(table, None)
            ]
        if table.direction is not None or table.directions is not None:
            raise MountedSystemError("must have no direction where `psd` has one density for each axis; leave it out.")
        return [self._vibration(table, vibration, table.name, "", (0.0, 0.0, 0.0))]

    @build.register
    def _(self, table: DropCase) -> list[LoadCase]:
        drop, gravity = table.drop, math.hypot(*self.gravity)
        with located("drop"):
            if drop.velocity is not None and drop.height is None:
                speed = drop.velocity
            elif drop.height is None or drop.velocity is not None:
                raise MountedSystemError("must have either `height` or `velocity`; give one of them.")
            elif gravity == 0.0:
                raise MountedSystemError("`height` gives no velocity without gravity; give `velocity`.")
            else:
                speed = math.sqrt(2.0 * gravity * drop.height)
        height = "" if drop.height is None else f" from {1e3 * drop.height:.6g} mm"
        cases = []
        for name, direction in self._directions(table, self._down()):
            x, y, z = (speed * component for component in direction.vector)
            text = f"drop{height}, {speed:.4g} m/s along {direction.text}"
            duration = self._duration(table, 0.0)
            cases.append(
                LoadCase(name, "drop", duration, velocity=(x, y, z), weightless=True, text=_with_source(text, table))
            )
        return cases

    @build.register
    def _(self, table: RecordCase) -> list[LoadCase]:
        record = table.record
        wanted: dict[str, RecordColumn] = {
            name: RecordColumn(column, q.ANGULAR_VELOCITY if name[0] == "r" else q.ACCELERATION, record.units.get(name))
            for name, column in record.columns.items()
        }
        with located("record"):
            if not wanted:
                raise MountedSystemError("`columns` must name one column or more, as in { x = 'ax', z = 3 }.")
            content = self.files.record(record.file)
            times, values = read_timed_columns(content, wanted, record.time, record.units.get("time"))
            channels = []
            for name, column in values.items():
                kind = ChannelKind.BASE_ANGULAR_VELOCITY if name[0] == "r" else ChannelKind.BASE_ACCELERATION
                channels.append(LoadChannel(kind, RecordedSignal(times, record.scale * column), AXES[name[-1]]))
            accelerated = [c.direction for c in channels if c.kind is ChannelKind.BASE_ACCELERATION]
            if len(accelerated) == len(channels) and all(self._is_held(direction) for direction in accelerated):
                raise MountedSystemError(f"no body can move along {' or '.join(values)}; see `motion` of the bodies.")
        text = f"record {Path(record.file).name} of {', '.join(values)}"
        duration = table.simulate or float(times[-1] - times[0]) + self.afterwards
        return [
            LoadCase(
                table.name, "record", duration, tuple(channels), table.settling or 0.0, text=_with_source(text, table)
            )
        ]

    @build.register
    def _(self, table: ForceCase) -> list[LoadCase]:
        force = table.force
        with located("force"):
            if force.body is None and len(self.bodies) > 1:
                raise MountedSystemError(
                    "must have `body` where there are several bodies; name the one that it acts on."
                )
            number = 0 if force.body is None else body_number(force.body, self.bodies)
            signal, duration, text = self._force(force)
        body = self.bodies[number]
        place = force.place or body.center
        cases = []
        for name, direction in self._directions(table, None):
            if np.linalg.norm(body.translations @ direction.vector) < _HELD:
                raise MountedSystemError(
                    f"{body.name} cannot move along {direction.text}, so that a force has no effect; see its `motion`."
                )
            channel = LoadChannel(ChannelKind.FORCE, signal, direction.vector, number, place)
            words = f"{text} on {body.name} along {direction.text}"
            cases.append(
                LoadCase(name, "force", self._duration(table, duration), (channel,), text=_with_source(words, table))
            )
        return cases

    def _vibration(
        self, table: DirectedCase, vibration: Vibration, name: str, along: str, direction: Vector
    ) -> LoadCase:
        """The case of a base acceleration."""
        channels = vibration.channels(direction)
        if all(self._is_held(channel.direction) for channel in channels):
            where = along.removeprefix(" along ") or " or ".join(axis for axis, _ in vibration.by_axis)
            raise MountedSystemError(f"no body can move along {where}, which makes the case void; see their `motion`.")
        # Root mean squares are of the vibration alone, not of its decay.
        duration = self._duration(table, vibration.duration, vibration.ends)
        if vibration.settling >= duration:
            raise MountedSystemError(
                f"`settling` of {vibration.settling:.6g} s must be shorter than the simulated {duration:.6g} s."
            )
        text = _with_source(f"{vibration.text}{along}", table)
        return LoadCase(name, vibration.kind, duration, channels, vibration.settling, text=text)

    def _directions(self, table: DirectedCase, otherwise: Direction | None) -> Iterator[tuple[str, Direction]]:
        """Names of cases with their directions."""
        if table.direction is not None and table.directions is not None:
            raise MountedSystemError("must have either `direction` or `directions`, got both; leave one out.")
        directions: Sequence[Direction | None] = table.directions or [table.direction or otherwise]
        for direction in directions:
            if direction is None:
                raise MountedSystemError("must have `direction`, such as '+x', or `directions`, a list; add one.")
            yield (f"{table.name} {direction.text}" if len(directions) > 1 else table.name), direction

    def _duration(self, table: CaseTable, of_load: float, is_settled: bool = False) -> float:
        if table.simulate is None:
            return of_load if is_settled else of_load + self.afterwards
        if table.simulate < of_load:
            raise MountedSystemError(
                f"`simulate` must not end before the load does, at {of_load:.6g} s, got {table.simulate:.6g} s; "
                "lengthen it or leave it out."
            )
        return table.simulate

    def _is_held(self, direction: Vector) -> bool:
        """Whether no body can move along a direction."""
        return all(np.linalg.norm(body.translations @ direction) < _HELD for body in self.bodies)

    def _down(self) -> Direction | None:
        """Along gravity, if there is any."""
        strength = math.hypot(*self.gravity)
        if strength == 0.0:
            return None
        x, y, z = (component / strength for component in self.gravity)
        return Direction((x, y, z), "gravity")

    def _force(self, table: ForceTableOfCase) -> tuple[Signal, float, str]:
        """The signal, its duration, and it in words."""
        if sum(given is not None for given in (table.pulse, table.table, table.file)) != 1:
            raise MountedSystemError("must have one of `pulse`, `table` and `file`; give one of them.")
        if table.pulse is not None:
            signal, text = pulse_of(table, table.peak, table.impulse, "impulse", 1.0, "N")
            return signal, table.duration or 0.0, text
        if table.table is not None:
            pulse = TabulatedPulse(table.table)
            return pulse, pulse.duration, f"force of up to {pulse.peak:.6g} N by a table"
        file = table.file or ""
        times, values = read_timed_columns(
            self.files.record(file),
            {"force": RecordColumn(table.column, q.FORCE, table.unit)},
            table.time,
            table.time_unit,
        )
        record = RecordedSignal(times, values["force"])
        return record, record.duration, f"force by {Path(file).name}"


def _with_source(text: str, table: CaseTable) -> str:
    return f"{text}; source: {table.source}" if table.source else text
