"""Curves of transmissibility and relative motion, one for each level."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..files import replacing
from .response import FrequencyResponse
from .system import Excitation

SUFFIXES = (".png", ".svg", ".pdf")


def write_plot(path: Path, responses: Sequence[FrequencyResponse], title: str) -> None:
    """Draw the responses; the format is that of the name's ending, one of `SUFFIXES`."""
    # Without these an SVG or PDF holds a date and random names.
    with mpl.rc_context({"svg.hashsalt": "strandspring"}):
        figure = Figure(figsize=(8.0, 8.0), layout="constrained")
        top, bottom = figure.subplots(2, 1, sharex=True)
        for k, response in enumerate(responses):
            label = response.level_text
            _curve(top, response, "transmissibility", 1.0, f"C{k}", label)
            _curve(bottom, response, "amplitude", 1e3, f"C{k}", label)
        force = responses[0].excitation is Excitation.FORCE
        top.axhline(1.0, color="0.6", lw=0.8)
        top.set(ylabel="force transmissibility [-]" if force else "absolute transmissibility [-]", title=title)
        bottom.set(xlabel="frequency [Hz]", ylabel="amplitude of the mount [mm]")
        for axes in (top, bottom):
            axes.set(xscale="log", yscale="log")
            axes.grid(True, which="both", color="0.92")
        top.legend(title=responses[0].excitation.value, fontsize=8)
        with replacing(path) as part:
            kind = path.suffix.lower().lstrip(".")
            figure.savefig(part, format=kind, dpi=120, metadata={"Date": None} if kind == "svg" else None)


def _curve(axes: Axes, response: FrequencyResponse, name: str, factor: float, color: str, label: str) -> None:
    frequency, values = response.column("frequency"), factor * response.column(name)
    unstable = response.column("stable") == 0.0
    # The dotted part reaches to its stable neighbours, so that the curve has no gaps.
    dotted = unstable | np.roll(unstable, 1) | np.roll(unstable, -1)
    axes.plot(frequency, np.where(unstable, np.nan, values), color=color, lw=1.4, label=label)
    if unstable.any():
        axes.plot(frequency, np.where(dotted, values, np.nan), color=color, lw=1.0, ls=":")
