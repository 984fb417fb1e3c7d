"""Two springs in six panels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ...loops.loop import PANELS, Loop
from ...vibration.one_mass.response import FrequencyResponse
from .differences import FIGURES, SpringDifference

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLORS = ("C0", "C3")


def draw(
    panels: Sequence[Axes],
    loops: Sequence[Loop],
    figures: Sequence[SpringDifference],
    bands: tuple[Any, Any] | None,
    responses: Sequence[FrequencyResponse],
) -> None:
    """Draw loops, their difference, three figures over the amplitude, and transmissibility into six axes."""
    from ...vibration.one_mass.curves_plot import decimal_ticks  # loads matplotlib

    top, difference, *middle, last = panels
    for label, color, loop in zip("AB", _COLORS, loops, strict=True):
        for branch in (loop.loading, loop.unloading):
            top.plot(
                1e3 * branch.displacement, branch.force, color, lw=1.3, label=label if branch is loop.loading else None
            )
    top.set(xlabel="displacement [mm]", ylabel="force [N]", title="steady loops over the shared range")
    top.legend()
    for side, style in (("loading", "-"), ("unloading", "--")):
        a, b = (getattr(loop, side) for loop in loops)
        difference.plot(1e3 * a.displacement, b.force - a.force, f"k{style}", lw=1.2, label=side)
    difference.axhline(0.0, color="0.7", lw=0.8)
    difference.set(xlabel="displacement [mm]", ylabel="force of B less that of A [N]", title="difference of force")
    difference.legend()
    for axis, column in zip(middle, PANELS, strict=True):
        _figure(axis, [row for row in figures if row.quantity == column.key], bands, column.factor)
        axis.set(xlabel="amplitude [mm]", ylabel=column.label, title="5 to 95 % shaded" if bands else "")
    for label, color, response in zip("AB", _COLORS, responses, strict=False):
        last.plot(response.column("frequency"), response.column("transmissibility"), color, lw=1.3, label=label)
    last.set(xlabel="frequency [Hz]", ylabel="transmissibility [-]", title="mass on the spring")
    if responses:
        last.set(xscale="log", yscale="log")
        decimal_ticks(last.xaxis, *last.get_xlim())
        decimal_ticks(last.yaxis, *last.get_ylim())
        last.axhline(1.0, color="0.7", lw=0.8)
        last.legend()
    else:
        last.text(0.5, 0.5, "not compared", ha="center", transform=last.transAxes)
    for axis in panels:
        axis.grid(True, which="both", color="0.93")


def _figure(axis: Axes, differences: Sequence[SpringDifference], bands: tuple[Any, Any] | None, factor: float) -> None:
    amplitudes = [1e3 * (difference.amplitude or 0.0) for difference in differences]
    place = [*FIGURES].index(differences[0].quantity)
    for k, (side, color) in enumerate(zip("ab", _COLORS, strict=True)):
        if bands is not None:
            low, high = factor * bands[k][:, :, place]
            axis.fill_between(amplitudes, low, high, color=color, alpha=0.2, lw=0.0)
        axis.plot(
            amplitudes,
            [factor * getattr(difference, side) for difference in differences],
            f"{color}",
            marker="o",
            ms=4,
            lw=1.2,
        )
