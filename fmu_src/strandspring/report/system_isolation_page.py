"""`write_system_isolation`: steady vibration of a system as a page that opens offline, or as a document for print."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from .._version import __version__
from ..errors import Reader
from ..findings import gathered
from ..vibration.bodies.modes import Mode
from ..vibration.bodies.mounted import MountedSystem
from ..vibration.bodies.six_response import DIRECTIONS, SystemResponse
from .charts.system_drawing import system_drawing
from .content.blocks import Block, Gallery, Level, Notice, PageContent, Section, Text, first_rows
from .content.chart import Axis, Chart, ChartForm, Role, Trace
from .content.quantities import HZ, MM, DisplayUnit, number, percent
from .rendering.page import write
from .rendering.report_path import check_report_path

Curve = tuple[str, SystemResponse]
_STYLES = [
    (role, form) for form in (ChartForm.LINE, ChartForm.DASHED) for role in (Role.FIRST, Role.SECOND, Role.THIRD)
]


def write_system_isolation(
    path: str | Path, name: str, system: MountedSystem, modes: Mapping[str, Sequence[Mode]], curves: Sequence[Curve]
) -> None:
    """Write the report of the steady vibration of a system.

    Parameters
    ----------
    path : str or Path            Ending in .html or .pdf.
    name : str                    Of the system.
    system : MountedSystem        The first candidate.
    modes : mapping               Of small motion of each candidate.
    curves : sequence of (candidate, SystemResponse)

    Raises
    ------
    StrandspringError             If the ending does not suit, the package `typst` is missing for a PDF, or the file
                                  cannot be written.
    """
    check_report_path(path)
    sections = (
        Section("resonances", "Resonances", tuple(_resonances(curves))),
        Section("curves", "Curves", (Gallery(tuple(_charts(curves))),)),
        Section("system", "System", tuple(system_drawing(system, ()))),
        Section("modes", "Natural modes", tuple(_modes(modes))),
    )
    names = {k: _curve_name(*curve) for k, curve in enumerate(curves)}
    content = PageContent(
        title=f"Steady vibration: {name}", subtitle="", sections=sections, records=names,
        footer=f"strandspring {__version__}", noun="Curve",
    )  # fmt: skip
    write(path, content)


def _unit(response: SystemResponse) -> DisplayUnit:
    """Of its gain."""
    return DisplayUnit(response.gain_column.shown, response.gain_column.factor)


def _curve_name(candidate: str, response: SystemResponse) -> str:
    return f"{candidate}, {response.shaking.name}, {response.level_text}"


def _resonances(curves: Sequence[Curve]) -> Iterator[Block]:
    rows = []
    for candidate, response in curves:
        unit = _unit(response)
        worst = max((error.largest for error in response.errors), default=None)
        for peak in response.resonances:
            isolates = number(peak.isolation_frequency) if math.isfinite(peak.isolation_frequency) else "–"
            error = "–" if worst is None else percent(worst)
            rows.append((_curve_name(candidate, response), f"{peak.point} {peak.direction}", number(peak.frequency),
                         f"{unit.text(peak.gain)}".rstrip(), number(1e3 * peak.sway), isolates,
                         error))  # fmt: skip
    header = (
        "candidate, excitation and level", "motion of", "resonance [Hz]", "gain", "sway [mm]", "isolates from [Hz]",
        "error",
    )  # fmt: skip
    yield from first_rows("Largest gain of each point in each direction", header, rows)
    yield Text(
        "Gain is the first harmonic of a point's absolute motion over that of the base, or its motion over a force. "
        "The error is the largest difference of acceleration, sway and tilt from time integration of the exact "
        "equations, at the motions with the largest acceleration and tilt; where no body turns by half a degree there "
        "is none."
    )
    for candidate, response in curves:
        for sentence in gathered(response.findings, Reader.FILE):
            yield Notice(Level.CARE, f"{_curve_name(candidate, response)}: {sentence}")


def _charts(curves: Sequence[Curve]) -> Iterator[Chart]:
    gains, sways = [], []
    unit = _unit(curves[0][1])
    for place, (_, response) in enumerate(curves):
        motion = np.abs(response.gain)
        for p, point in enumerate(response.points[: len(_STYLES)]):
            way = int(np.argmax(motion[:, p].max(axis=0)))
            style = _STYLES[p]
            values = unit.factor * motion[:, p, way]
            gains.append(Trace(f"{point.name} {DIRECTIONS[way]}", response.frequency, values, *style, record=place))
            sways.append(Trace(point.name, response.frequency, 1e3 * response.sway[:, p], *style, record=place))
    frequency = Axis("frequency", HZ, log=True)
    note = "Of each point the direction in which it moves most."
    wide = {"wide": True, "single": True}
    yield Chart("gain", "Motion over excitation", frequency, Axis("gain", unit, log=True), tuple(gains), note, **wide)
    note = "Largest distance of a point from its place at rest, relative to the base."
    yield Chart("sway", "Sway", frequency, Axis("sway", MM), tuple(sways), note, **wide)


def _modes(modes: Mapping[str, Sequence[Mode]]) -> Iterator[Block]:
    for candidate, of_candidate in modes.items():
        rows = [
            (str(k), number(mode.frequency), number(100.0 * mode.damping, 3), mode.words)
            for k, mode in enumerate(of_candidate, start=1)
        ]
        header = ("mode", "Hz", "viscous damping [%]", "motion")
        yield from first_rows(f"Natural modes of {candidate}", header, rows)
