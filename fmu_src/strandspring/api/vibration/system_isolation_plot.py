"""Curves of gain and sway over frequency, a column for each excitation and a curve for each point and level.

Colours tell points, or points and candidates, apart, and dashes levels. Dotted parts lie between two folds and are
unstable.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...kernel.arrays import FloatArray
from ...report.drawing import legend_columns, shortened
from ...vibration.bodies.six_response import SystemResponse
from ...vibration.one_mass.curves_plot import COLORS, HANDLE_LENGTH, LEGEND_COLUMNS, STYLES, UNSTABLE, decimal_ticks

_WIDTH, _HEIGHT, _LEGEND = 4.5, 7.5, 0.25  # of a column, of both rows, of a line of the legend [inches]
_LETTERS, _POINTS = 32, 9.0  # of a name in the legend, and its height

Responses = Mapping[str, Sequence[SystemResponse]]


def size_of(candidates: Responses) -> tuple[float, float]:
    """Width and height of the figure [inches]."""
    excitations = _excitations(candidates)
    width, names = max(8.0, _WIDTH * len(excitations)), [name for name, *_ in _curves(candidates, excitations[0])]
    return width, _HEIGHT + _LEGEND * (len(names) // _columns(names, width) + 1)


def grid_of(candidates: Responses) -> tuple[int, int]:
    """Rows and columns of axes: gain above sway, of each excitation."""
    return 2, len(_excitations(candidates))


def fill(figure: Figure, candidates: Responses, title: str) -> list[Axes]:
    """Draw the responses of each candidate by its label into an empty figure with a constrained layout."""
    axes = list(figure.subplots(*grid_of(candidates), sharex="col", sharey="row", squeeze=False).flat)
    draw(axes, candidates)
    figure.suptitle(title)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=_columns(labels, figure.get_figwidth()),
                  fontsize=_POINTS, frameon=False, handlelength=HANDLE_LENGTH)  # fmt: skip
    return axes


def draw(axes: Sequence[Axes], candidates: Responses) -> None:
    """Draw the responses of each candidate by its label into axes, row by row."""
    excitations = _excitations(candidates)
    tops, bottoms = axes[: len(excitations)], axes[len(excitations) :]
    for top, bottom, name in zip(tops, bottoms, excitations, strict=True):
        _draw(top, bottom, candidates, name)
        top.set_title(name, fontsize=10)
        bottom.set_xlabel("frequency [Hz]")
    gain = next(iter(candidates.values()))[0].gain_column
    tops[0].set_ylabel(f"{gain.short or 'motion'} [{gain.shown or '-'}], largest of x, y and z")
    bottoms[0].set_ylabel("sway [mm]")


def _excitations(candidates: Responses) -> list[str]:
    return list(dict.fromkeys(response.shaking.name for responses in candidates.values() for response in responses))


def _levels(candidates: Responses) -> list[float]:
    return list(dict.fromkeys(response.level for responses in candidates.values() for response in responses))


def _curves(candidates: Responses, excitation: str) -> Iterator[tuple[str, SystemResponse, int, int]]:
    """Name, response, point and number of the colour of each curve of an excitation."""
    color = 0
    for label, responses in candidates.items():
        of = [shortened(label, _LETTERS)] if len(candidates) > 1 else []
        for p, point in enumerate(responses[0].points):
            for response in responses:
                if response.shaking.name == excitation:
                    yield ", ".join([*of, shortened(point.name, _LETTERS), response.level_text]), response, p, color
            color += 1


def _columns(names: Sequence[str], width: float) -> int:
    """Of a legend as wide as a figure [inches]."""
    return min(LEGEND_COLUMNS, legend_columns(names, width, _POINTS, 12))


def _draw(top: Axes, bottom: Axes, candidates: Responses, excitation: str) -> None:
    """The curves of one excitation."""
    levels = _levels(candidates)
    for name, response, p, color in _curves(candidates, excitation):
        style = STYLES[levels.index(response.level) % len(STYLES)]
        gain = response.gain_column.factor * np.abs(response.gain[:, p]).max(axis=1)
        for axes, values in ((top, gain), (bottom, 1e3 * response.sway[:, p])):
            look = {"color": COLORS[color % len(COLORS)], "lw": 1.3}
            stable = np.where(response.stable, values, np.nan)
            axes.plot(response.frequency, stable, ls=style, label=name, **look)  # type: ignore[arg-type]
            if not response.stable.all():
                axes.plot(response.frequency, _dotted(response, values), ls=UNSTABLE, **look)  # type: ignore[arg-type]
    for axes in (top, bottom):
        axes.set(xscale="log", yscale="log")
        axes.grid(True, which="major", color="0.85", lw=0.8)
        axes.grid(True, which="minor", color="0.93", lw=0.5)
        for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            decimal_ticks(axis, *limits)


def _dotted(response: SystemResponse, values: FloatArray) -> FloatArray:
    """The unstable values with their stable neighbours, so that the curve has no gaps."""
    unstable = ~response.stable
    return np.where(unstable | np.append(unstable[1:], False) | np.insert(unstable[:-1], 0, False), values, np.nan)
