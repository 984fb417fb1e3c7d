"""Curves of steady vibration over frequency, in panels of which all have the same curves.

Dotted parts lie between two folds and are unstable. Small peaks below the resonance are superharmonic resonances: a
multiple of the frequency meets the natural frequency, and the plot says which.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from ...kernel.arrays import BoolArray, FloatArray
from .response import FrequencyResponse, with_neighbours

Style = str | tuple[int, tuple[float, ...]]

# Okabe and Ito, distinguishable with any colour vision and on white.
_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
# Dots are for what is unstable.
_STYLES: tuple[Style, ...] = ("-", (0, (7.0, 2.0)), (0, (7.0, 2.0, 2.0, 2.0)))
_UNSTABLE = (0, (1.0, 1.6))
_HANDLE_LENGTH = 3.6  # of a legend, so that its dashes can be distinguished
# A superharmonic peak: its prominence in ln(amplitude), and how near its multiple lies to the natural frequency.
_PROMINENT = 0.02
_ORDERS = range(2, 12)
_ALIKE = 0.25


@dataclass(frozen=True, eq=False)
class Curve:
    """A line of a panel.

    Attributes
    ----------
    frequency, values : ndarray, shape (P,)   [Hz], and in the unit of the panel.
    is_stable : ndarray of bool, shape (P,)
    group, variant : str                      What its colour and what its dashes stand for, in words; empty if nothing.
    """

    frequency: FloatArray
    values: FloatArray
    is_stable: BoolArray
    group: str
    variant: str = ""


@dataclass(frozen=True, eq=False)
class Panel:
    """What one pair of axes shows: curves, and a level across."""

    label: str
    curves: Sequence[Curve]
    title: str = ""
    level: float | None = None

    def draw(self, axes: Axes) -> None:
        """Draw it on logarithmic axes."""
        groups = list(dict.fromkeys(curve.group for curve in self.curves))
        variants = list(dict.fromkeys(curve.variant for curve in self.curves))
        for curve in self.curves:
            rounds, color = divmod(groups.index(curve.group), len(_COLORS))
            style = _STYLES[(variants.index(curve.variant) + rounds) % len(_STYLES)]
            look = {"color": _COLORS[color], "lw": 1.4}
            name = ", ".join(filter(None, (curve.group, curve.variant)))
            stable = np.where(curve.is_stable, curve.values, np.nan)
            axes.plot(curve.frequency, stable, ls=style, label=name, **look)  # type: ignore[arg-type]
            if not curve.is_stable.all():
                dotted = np.where(with_neighbours(~curve.is_stable), curve.values, np.nan)
                axes.plot(curve.frequency, dotted, ls=_UNSTABLE, **look)  # type: ignore[arg-type]
        if self.level is not None:
            axes.axhline(self.level, color="0.45", lw=0.8, zorder=1.5)
        axes.set(xlabel="frequency [Hz]", ylabel=self.label, title=self.title, xscale="log", yscale="log")
        axes.margins(x=0.02)
        axes.grid(True, which="major", color="0.85", lw=0.8)
        axes.grid(True, which="minor", color="0.93", lw=0.5)
        for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            decimal_ticks(axis, *limits)


def draw_panels(figure: Figure, panels: Sequence[Panel], title: str) -> list[Axes]:
    """Draw panels into two rows of an empty figure with a constrained layout, and one legend below them."""
    columns = len(panels) // 2
    axes = list(figure.subplots(2, columns, sharex="col", sharey="row", squeeze=False).flat)
    for one, panel in zip(axes, panels, strict=True):
        panel.draw(one)
        one.label_outer()
    figure.suptitle(title)
    is_stable = all(curve.is_stable.all() for panel in panels for curve in panel.curves)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns + 1, fontsize=9, frameon=False,
                  handlelength=_HANDLE_LENGTH, title="" if is_stable else "unstable where dotted")  # fmt: skip
    return axes


def decimal_ticks(axis: Axis, low: float, high: float) -> None:
    """Ticks such as 0.5, 1, 2, 5, so many that some lie between the limits."""
    decades = math.log10(high / low)
    if decades < 0.4:
        axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    elif decades < 1.0:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 4.0, 6.0, 8.0), numticks=50))
    else:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 3.5 else (1.0,), numticks=50))
    axis.set_minor_locator(LogLocator(subs=np.arange(2.0, 10.0).tolist(), numticks=50))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.10g}"))
    axis.set_minor_formatter(NullFormatter())


def mark_superharmonics(axes: Axes, responses: Sequence[FrequencyResponse]) -> None:
    """Mark the largest superharmonic peak of each order among amplitudes [mm] with its share of the resonance."""
    peaks: dict[int, tuple[float, float]] = {}
    for response in responses:
        for order, peak in _superharmonics(response).items():
            peaks[order] = max(peaks.get(order, peak), peak, key=lambda at: at[1])
    for order, (frequency, amplitude) in peaks.items():
        axes.annotate(f"1/{order}", (frequency, 1e3 * amplitude), (0.0, 8.0),
                      textcoords="offset points", ha="center", fontsize=9)  # fmt: skip


def _superharmonics(response: FrequencyResponse) -> dict[int, tuple[float, float]]:
    """Frequency [Hz] and amplitude [m] of superharmonic peaks by their order."""
    from scipy.signal import find_peaks  # slow to import, and only this needs it

    frequency, amplitude = response.column("frequency"), response.column("amplitude")
    highest: dict[int, tuple[float, float]] = {}
    for k in find_peaks(np.log(amplitude), prominence=_PROMINENT)[0].tolist():
        ratio = response.natural_frequency / float(frequency[k])
        order = round(ratio)
        if order in _ORDERS and abs(ratio - order) < _ALIKE:
            at = (float(frequency[k]), float(amplitude[k]))
            highest[order] = max(highest.get(order, at), at, key=lambda peak: peak[1])
    return highest
