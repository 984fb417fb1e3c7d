"""Cautions about springs from a catalogue, of which stiffness and damping are known at one amplitude alone, and about
mounts that rest under more than their rated static load.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...core.spline import Elastic
from ...kernel.path import PathSolver
from ...loops.modelled import steady_loop_figures
from ..bodies.mounted import MountedSystem
from ..bodies.parts import MountAxis
from .case_cautions import Caution, CautionKind
from .range_use import RangeUse
from .static_answer import StaticAnswer

_FAR = 2.0  # factor between amplitudes from which a swing is another than that stated
_AT_REST = 1e-6  # of the stated amplitude: below, a spring does not move


def catalogue_cautions(system: MountedSystem) -> Iterator[str]:
    """What is not known of springs from a catalogue, one sentence for each source."""
    axes = {axis.model: axis for axis in system.axes if axis.stated_amplitude is not None}
    of_source: dict[str, list[str]] = {}
    for name, axis in axes.items():
        source, _, direction = name.rpartition(", ")
        of_source.setdefault(source, []).append(f"{direction} {_stated(axis)}")
    for source, stated in of_source.items():
        yield (
            f"No loops stand behind {source}: {'; '.join(stated)}. Stiffness and damping at other amplitudes are those "
            "of an assumed loop, and effects of speed and temperature are left out; keep a margin, or record loops."
        )


def _stated(axis: MountAxis) -> str:
    amplitude, spring = axis.stated_amplitude or 0.0, axis.spring
    small = Elastic(spring).slope(axis.nominal - spring.displacement_offset) + spring.kappa_omega * spring.rho
    return (
        f"holds at +-{1e3 * amplitude:.4g} mm, and has {1e-3 * small:.4g} N/mm in small motion and friction of "
        f"+-{spring.kappa_omega:.4g} N"
    )


def overloads(system: MountedSystem, static: StaticAnswer) -> Iterator[str]:
    """Mounts that rest under more than the rated load of their springs, whatever the omega."""
    rated = np.array([axis.parallel * axis.rated_load for axis in system.axes])
    shares = np.max([np.abs(pose.force) for pose in static.poses], axis=0) / rated
    beyond = shares > 1.0
    if beyond.any():
        worst = int(np.argmax(shares))
        yield (
            f"{int(beyond.sum())} of {int(np.isfinite(rated).sum())} axes with a rated static load rest under more, "
            f"{system.axis_names[worst]} under {shares[worst] * rated[worst]:.4g} N of {rated[worst]:.4g} N; use more "
            "or larger mounts."
        )


def swings_apart(system: MountedSystem, uses: Sequence[RangeUse]) -> Iterator[Caution]:
    """Springs from a catalogue that swing by far more or less than the amplitude at which it states them."""
    apart: list[tuple[float, str, MountAxis, float, float]] = []
    for number, (axis, name) in enumerate(zip(system.axes, system.axis_names, strict=True)):
        if axis.stated_amplitude is None:
            continue
        for use in uses:
            low, high = float(use.lowest[number]), float(use.highest[number])
            ratio = 0.5 * (high - low) / axis.stated_amplitude
            if ratio > _AT_REST and not 1.0 / _FAR <= ratio <= _FAR:
                apart.append((abs(math.log(ratio)), name, axis, low, high))
    if not apart:
        return
    measure, worst, axis, low, high = max(apart, key=lambda entry: entry[0])
    figures = steady_loop_figures(PathSolver(axis.spring), low, high)
    yield Caution(
        CautionKind.CATALOGUE,
        measure,
        f"{len({name for _, name, *_ in apart})} axes of mounts with catalogue values swing by less than half or more "
        f"than twice the amplitude at which these are stated, {worst} by +-{5e2 * (high - low):.3g} mm instead of "
        f"+-{1e3 * (axis.stated_amplitude or 0.0):.3g} mm; there a stiffness of {1e-3 * figures.secant_stiffness:.4g} "
        f"N/mm and a loss factor of {figures.loss_factor:.2g} are assumed.",
    )
