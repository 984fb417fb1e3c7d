"""What is known of a rig and no record shows: a moving mass, the fixture's stiffness, the delay between the columns.

With the measured displacement x and force R, a force that lags by d, a mass m between load cell and spring and a
fixture of stiffness K between displacement sensor and spring, the spring's own displacement and force are

    x_s(t) = x(t) - R(t + d)/K,    R_s(t) = R(t + d) - m*a(t),

with the acceleration a of x_s. The force stays at the samples at which it was measured; `Rig` places them in time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import RecordError
from ...ground.arguments import number, optional_number
from ...kernel.arrays import FloatArray
from ...loops.strokes import find_strokes
from ...records.record import Record
from ..points.acceleration import acceleration
from ..points.steady_part import synchronised
from .effect_columns import Effect

_WORTH = 0.005  # change of the stiffness that is worth a note
_MASS = 1.0  # whose effect the note gives [kg]
_FIXTURE = 1e7  # likewise [N/m]


@dataclass(frozen=True)
class KnownRig:
    """What a user knows of a rig.

    Parameters
    ----------
    moving_mass : float         Between load cell and spring [kg].
    fixture_stiffness : float   Of what yields between displacement sensor and spring [N/m]; infinite if nothing does.
    delay : float or None       By which the force lags [s]; None if it is not known.

    Raises
    ------
    ValueError   If one is impossible.
    """

    moving_mass: float = 0.0
    fixture_stiffness: float = math.inf
    delay: float | None = None

    def __post_init__(self) -> None:
        number("moving_mass", self.moving_mass, "kg")
        number("fixture_stiffness", self.fixture_stiffness, "N/m")
        optional_number("delay", self.delay, "s")
        if not 0.0 <= self.moving_mass < math.inf:
            raise ValueError(f"`moving_mass` must be finite and >= 0 [kg], got {self.moving_mass}.")
        if not self.fixture_stiffness > 0.0:
            raise ValueError(f"`fixture_stiffness` must be > 0 [N/m], got {self.fixture_stiffness}.")
        if self.delay is not None and not math.isfinite(self.delay):
            raise ValueError(f"`delay` must be finite [s], got {self.delay}.")

    @classmethod
    def from_effects(cls, effects: Mapping[str, Any], options: Mapping[str, Any]) -> KnownRig:
        """What was given for an identification, by its effects and options."""
        given = {name: effects[name] for name in ("moving_mass", "fixture_stiffness") if name in effects}
        is_given = options.get(Effect.DELAY.value, "auto") != "auto"
        return cls(**given, delay=effects[Effect.DELAY.value] if is_given else None)

    @property
    def effects(self) -> dict[str, float]:
        """What is removed, by name, in SI units."""
        taken = {
            "moving_mass": self.moving_mass if self.moving_mass > 0.0 else None,
            "fixture_stiffness": self.fixture_stiffness if self.fixture_stiffness < math.inf else None,
            Effect.DELAY.value: self.delay,
        }
        return {name: size for name, size in taken.items() if size is not None}

    @property
    def sentence(self) -> str:
        """What is removed, in words; empty if nothing is."""
        texts = {
            "moving_mass": f"a moving mass of {self.moving_mass:.6g} kg",
            "fixture_stiffness": f"a fixture of {1e-3 * self.fixture_stiffness:.6g} N/mm",
            Effect.DELAY.value: f"a delay of the force by {1e3 * (self.delay or 0.0):.6g} ms",
        }
        return f"Taken out as given: {', '.join(texts[name] for name in self.effects)}" if self.effects else ""

    def removed(self, record: Record) -> Record:
        """The record of the spring alone, its force at the samples at which it was measured.

        Raises
        ------
        RecordError   If mass or delay need times that the record does not have, or the delay is longer than a stroke.
        """
        if self.delay:
            self._refuse_delay(record)
        if self.fixture_stiffness < math.inf:
            deflection = synchronised(record, self.delay or 0.0).force / self.fixture_stiffness
            record = replace(record, displacement=record.displacement - deflection)
        if self.moving_mass > 0.0:
            record = replace(record, force=record.force - self.inertia(record))
        return record

    def inertia(self, record: Record) -> FloatArray:
        """Force of the moving mass at the samples of a record of which the fixture's deflection was removed [N]."""
        if self.moving_mass == 0.0:
            return np.zeros(len(record))
        accelerations = acceleration(record)
        if self.delay and record.time is not None:
            accelerations = np.interp(record.time - self.delay, record.time, accelerations)
        return np.asarray(self.moving_mass * accelerations)

    def _refuse_delay(self, record: Record) -> None:
        if record.time is None:
            raise RecordError(
                f"{record.path}: a delay needs times, and the record has none; name its time column with `time=...`, "
                "or go without `delay=...`."
            )
        if record.rising_time is None:
            raise RecordError(
                f"{record.path}: a delay needs times that rise from sample to sample, and they do not; check "
                "`time=...`."
            )
        stroke = float(np.median(np.diff(record.time[find_strokes(record.displacement).turning])))
        if abs(self.delay or 0.0) >= stroke:
            raise RecordError(
                f"{record.path}: the given delay of {1e3 * (self.delay or 0.0):.6g} ms is longer than a stroke "
                f"({1e3 * stroke:.4g} ms); check the unit of `delay=...` and of the time column."
            )


def unknown_effects(records: Sequence[Record], known: KnownRig) -> tuple[str, ...]:
    """How much a mass or a fixture that was not given would change the stiffness, where it could matter.

    Parameters
    ----------
    records : sequence of Record
    known : KnownRig               What was given needs no sentence.
    """
    sentences = []
    shares = [_inertia_share(record) for record in records if record.time is not None]
    if known.moving_mass == 0.0 and shares:
        share, frequency = max(shares)
        if share > _WORTH:
            sentences.append(
                f"{_MASS:g} kg between load cell and spring would change the stiffness by {_percent(share)} at "
                f"{frequency:.2g} Hz (`moving_mass=...`)."
            )
    share = max(map(_stiffness, records)) / _FIXTURE
    if known.fixture_stiffness == math.inf and share > _WORTH:
        sentences.append(
            f"A fixture of {1e-6 * _FIXTURE:g} kN/mm would change the stiffness by {_percent(share)} "
            "(`fixture_stiffness=...`)."
        )
    return tuple(sentences)


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 1.0 else "more than 100 %"


def _inertia_share(record: Record) -> tuple[float, float]:
    """Dynamic stiffness of the mass over that of the spring, and the frequency of the strokes [Hz]."""
    if record.time is None:
        return 0.0, 0.0
    try:
        inertia = replace(record, force=_MASS * acceleration(record))
    except RecordError:
        return 0.0, 0.0
    stroke = float(np.median(np.diff(record.time[find_strokes(record.displacement).turning])))
    stiffness = _stiffness(record)
    return (-_stiffness(inertia) / stiffness if stiffness > 0.0 else 0.0), 0.5 / stroke


def _stiffness(record: Record) -> float:
    """Slope of the force over the displacement by least squares [N/m]."""
    x = record.displacement - np.mean(record.displacement)
    return float(x @ record.force / (x @ x))
