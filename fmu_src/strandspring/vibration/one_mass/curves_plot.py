"""Curves over frequency: of one mass transmissibility and amplitude, one for each model and level.

Dotted parts lie between two folds and are unstable. Small peaks below the resonance are superharmonic resonances: a
multiple of the frequency meets the natural frequency, and the plot says which.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from ...kernel.arrays import BoolArray, FloatArray
from .options import Excitation
from .response import FrequencyResponse, with_neighbours

Quantity = Literal["transmissibility", "amplitude"]
Style = str | tuple[int, tuple[float, ...]]

# Okabe and Ito, distinguishable with any colour vision and on white.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
# Dots are for what is unstable.
STYLES: tuple[Style, ...] = ("-", (0, (7.0, 2.0)), (0, (7.0, 2.0, 2.0, 2.0)))
UNSTABLE = (0, (1.0, 1.6))
_FACTORS: Mapping[Quantity, float] = {"transmissibility": 1.0, "amplitude": 1e3}  # to the unit of the axis
LEGEND_COLUMNS = 4
HANDLE_LENGTH = 3.6  # of a legend, so that its dashes can be distinguished
# A superharmonic peak: its prominence in ln(amplitude), and how near its multiple lies to the natural frequency.
_PROMINENT = 0.02
_ORDERS = range(2, 12)
_ALIKE = 0.25


@dataclass(frozen=True, eq=False)
class Curve:
    """A line with its place in the legend.

    Attributes
    ----------
    frequency, values : ndarray, shape (P,)   [Hz], and in the unit of the axis.
    is_stable : ndarray of bool, shape (P,)
    label, color : str
    style : str or tuple                      Of the line.
    """

    frequency: FloatArray
    values: FloatArray
    is_stable: BoolArray
    label: str
    color: str
    style: Style


def curves_of(models: Mapping[str, Sequence[FrequencyResponse]], quantity: Quantity) -> list[Curve]:
    """Curves of each model by its label: colours tell levels apart, or models where there are several."""
    if len(models) == 1:
        ((_, responses),) = models.items()
        places = [(response, response.level_text, k, k // len(COLORS)) for k, response in enumerate(responses)]
    else:
        places = [
            (response, f"{label}, {response.level_text}", k, level)
            for k, (label, responses) in enumerate(models.items())
            for level, response in enumerate(responses)
        ]
    return [
        Curve(response.column("frequency"), _FACTORS[quantity] * response.column(quantity), ~response.unstable,
              label, COLORS[color % len(COLORS)], STYLES[style % len(STYLES)])
        for response, label, color, style in places
    ]  # fmt: skip


def draw(axes: Axes, curves: Sequence[Curve], ylabel: str, level: float | None = None) -> None:
    """Draw curves over frequency on logarithmic axes, and a level across."""
    for curve in curves:
        look = {"color": curve.color, "lw": 1.4}
        stable = np.where(curve.is_stable, curve.values, np.nan)
        axes.plot(curve.frequency, stable, ls=curve.style, label=curve.label, **look)  # type: ignore[arg-type]
        if not curve.is_stable.all():
            dotted = np.where(with_neighbours(~curve.is_stable), curve.values, np.nan)
            axes.plot(curve.frequency, dotted, ls=UNSTABLE, **look)  # type: ignore[arg-type]
    if level is not None:
        axes.axhline(level, color="0.45", lw=0.8, zorder=1.5)
    axes.set(xlabel="frequency [Hz]", ylabel=ylabel, xscale="log", yscale="log")
    axes.margins(x=0.02)
    axes.grid(True, which="major", color="0.85", lw=0.8)
    axes.grid(True, which="minor", color="0.93", lw=0.5)
    for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        decimal_ticks(axis, *limits)


def draw_transmissibility(axes: Axes, models: Mapping[str, Sequence[FrequencyResponse]]) -> None:
    """Draw the transmissibility of each model by its label, with a line at 1."""
    first = next(iter(models.values()))[0]
    kind = "force" if first.excitation is Excitation.FORCE else "absolute"
    draw(axes, curves_of(models, "transmissibility"), f"{kind} transmissibility [-]", 1.0)


def fill(figure: Figure, models: Mapping[str, Sequence[FrequencyResponse]], title: str) -> tuple[Axes, Axes]:
    """Draw transmissibility and amplitude into an empty figure with a constrained layout, the legend below them."""
    responses = [response for of_model in models.values() for response in of_model]
    top, bottom = figure.subplots(2, 1, sharex=True)
    draw_transmissibility(top, models)
    draw(bottom, curves_of(models, "amplitude"), "amplitude of the mount [mm]")
    top.set(title=title, xlabel="")
    handles, labels = top.get_legend_handles_labels()
    heading = responses[0].excitation.value
    if any(response.unstable.any() for response in responses):
        heading += "; unstable where dotted"
    if orders := _mark_superharmonics(bottom, responses):
        heading += f"\nsuperharmonic peaks at {', '.join(f'1/{order}' for order in orders)} of the natural frequency"
    columns = min(len(models) if len(models) > 1 else len(responses), LEGEND_COLUMNS)
    legend = figure.legend(handles, labels, loc="outside lower center", ncols=columns, title=heading, fontsize=9,
                           title_fontsize=9, frameon=False, handlelength=HANDLE_LENGTH)  # fmt: skip
    legend.get_title().set_multialignment("center")
    return top, bottom


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


def _mark_superharmonics(axes: Axes, responses: Sequence[FrequencyResponse]) -> list[int]:
    """Mark the largest superharmonic peak of each order; the orders, rising."""
    peaks: dict[int, tuple[float, float]] = {}
    for response in responses:
        for order, peak in _superharmonics(response).items():
            peaks[order] = max(peaks.get(order, peak), peak, key=lambda at: at[1])
    for order, (frequency, amplitude) in peaks.items():
        axes.annotate(f"1/{order}", (frequency, _FACTORS["amplitude"] * amplitude), (0.0, 8.0),
                      textcoords="offset points", ha="center", fontsize=9)  # fmt: skip
    return sorted(peaks)


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
