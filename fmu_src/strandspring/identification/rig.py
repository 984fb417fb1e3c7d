"""What a rig adds to records: a moving mass, a fixture that yields and a delay between the columns.

With the measured displacement x and force R, a force that lags by d, a mass m between load cell and spring and a
fixture of stiffness K between displacement sensor and spring, the spring's own displacement and force are

    x_s(t) = x(t) - R(t + d)/K,    R_s(t) = R(t + d) - m*a(t),

with the acceleration a of x_s. The force stays at the samples at which it was measured: beside the force at t stands
the displacement at t - d.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import RecordError
from ..ground.arguments import number, optional_number
from ..kernel.arrays import FloatArray
from ..records.record import Record
from .choice import flexible
from .fit import Fit, Problem, SpringClass
from .refusals import Strokes
from .samples import Samples

_WORTH = 0.005  # change of the stiffness that is worth a note
_MASS, _FIXTURE = 1.0, 1e7  # whose effects the note gives [kg], [N/m]
_SMOOTHED = 0.04  # of a stroke, half the window of an acceleration: 0.2 % of a sine is lost
_SMOOTH = SpringClass((3, 10), (5,))  # that should leave nothing but noise


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
        return cls(**given, delay=effects["delay"] if options.get("delay", "auto") != "auto" else None)

    @property
    def effects(self) -> dict[str, float]:
        """What is removed, by name, in SI units."""
        taken = {
            "moving_mass": self.moving_mass if self.moving_mass > 0.0 else None,
            "fixture_stiffness": self.fixture_stiffness if self.fixture_stiffness < math.inf else None,
            "delay": self.delay,
        }
        return {name: size for name, size in taken.items() if size is not None}

    def removed(self, record: Record) -> Record:
        """The record of the spring alone: at each sample its force, and the displacement where that force arose.

        Raises
        ------
        RecordError   If mass or delay need times that the record does not have, or the delay is longer than a stroke.
        """
        lag = self.delay or 0.0
        if lag:
            _refuse_delay(record, lag)
        time, measured = record.rising_time, record.displacement
        if self.fixture_stiffness < math.inf:
            force = record.force if time is None else np.interp(time + lag, time, record.force)
            record = replace(record, displacement=measured - force / self.fixture_stiffness)
        inertia = np.zeros(len(record))
        if self.moving_mass > 0.0:
            inertia = self.moving_mass * acceleration(record)
            if lag and time is not None:
                inertia = np.interp(time - lag, time, inertia)
        return lagging(replace(record, force=record.force - inertia), lag)


def lagging(record: Record, lag: float) -> Record:
    """The record with the displacement at the moments at which its forces arose; those beside it are not compared."""
    if not lag or record.time is None:
        return record
    moment = record.time - lag
    inside = (moment >= record.time[0]) & (moment <= record.time[-1])
    compared = inside if record.compared is None else inside & record.compared
    return replace(
        record,
        displacement=np.interp(moment, record.time, record.displacement),
        compared=record.compared if compared.all() else compared,
    )


def acceleration(record: Record) -> FloatArray:
    """Acceleration at each sample, shape (K,) [m/s^2]: second derivatives of quadratics over a part of a stroke.

    Raises
    ------
    RecordError   Without times that rise.
    """
    if record.time is None:
        raise RecordError(
            f"{record.path}: a moving mass needs times, and the record has none; name its time column with `time=...`, "
            "or go without `moving_mass=...`."
        )
    if record.rising_time is None:
        raise RecordError(
            f"{record.path}: a moving mass needs the acceleration, and the times do not rise from sample to sample; "
            "check the column with `time=...`."
        )
    samples = float(np.median(np.diff(Strokes(record).turning)))
    half = min(max(2, round(_SMOOTHED * samples)), (len(record) - 1) // 2)
    middle = np.clip(np.arange(len(record)), half, len(record) - 1 - half)
    moments, products = np.zeros((5, middle.size)), np.zeros((3, middle.size))
    scale = record.time[middle + half] - record.time[middle - half]
    for offset in range(-half, half + 1):
        place = (record.time[middle + offset] - record.time[middle]) / scale
        powers = place ** np.arange(5)[:, None]
        moments += powers
        products += powers[:3] * (record.displacement[middle + offset] - record.displacement[middle])
    matrices = np.moveaxis(moments[np.add.outer(np.arange(3), np.arange(3))], 2, 0)
    return np.asarray(2.0 * np.linalg.solve(matrices, products.T[:, :, None])[:, 2, 0] / scale**2)


def _refuse_delay(record: Record, lag: float) -> None:
    if record.time is None:
        raise RecordError(
            f"{record.path}: a delay needs times, and the record has none; name its time column with `time=...`, "
            "or go without `delay=...`."
        )
    if record.rising_time is None:
        raise RecordError(
            f"{record.path}: a delay needs times that rise from sample to sample, and they do not; check `time=...`."
        )
    stroke = float(np.median(np.diff(record.time[Strokes(record).turning])))
    if abs(lag) >= stroke:
        raise RecordError(
            f"{record.path}: the given delay of {1e3 * lag:.6g} ms is longer than a stroke "
            f"({1e3 * stroke:.4g} ms); check the unit of `delay=...` and of the time column."
        )


def likely_delay(samples: Samples) -> float:
    """The lag of the force without which a flexible spring leaves nothing but noise [s]; 0 if it does so with it."""
    problem = Problem(samples)
    fit = flexible(problem, _SMOOTH)
    if problem.is_noise(fit):
        return 0.0
    lag, is_noise, squares = best_lag(samples, fit, 0.0, 0.02 * samples.cycle_time)
    return lag if is_noise and squares < 0.5 * fit.squares else 0.0


def best_lag(samples: Samples, fit: Fit, lag: float, step: float) -> tuple[float, bool, float]:
    """The lag near another with which a class leaves least, whether that is noise, and the squared misfit."""

    def at(lag: float, q: FloatArray) -> tuple[float, float, Problem, Fit]:
        problem = Problem(samples.on([lagging(record, lag) for record in samples.records]))
        fitted = problem.local(fit.spring_class, q, 4, 1e-3)
        return fitted.squares, lag, problem, fitted

    best = at(lag, fit.q)
    for _ in range(10):
        nearer = min((at(best[1] + side * step, best[3].q) for side in (-1.0, 1.0)), key=lambda trial: trial[0])
        step *= 1.0 if nearer[0] < best[0] else 0.4
        best = min(best, nearer, key=lambda trial: trial[0])
    return best[1], best[2].is_noise(best[3]), best[0]


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
    stroke = float(np.median(np.diff(record.time[Strokes(record).turning])))
    stiffness = _stiffness(record)
    share = _MASS * (math.pi / stroke) ** 2 / stiffness if stroke > 0.0 and stiffness > 0.0 else 0.0
    return share, 0.5 / stroke if stroke > 0.0 else 0.0


def _stiffness(record: Record) -> float:
    """Slope of the force over the displacement by least squares [N/m]."""
    x = record.displacement - np.mean(record.displacement)
    return float(x @ record.force / (x @ x))
