"""Figures, parameters and plots of an identification in one HTML file."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .._version import __version__
from ..core.parameters import ARRAYS
from ..files import write_text
from ..identification.prediction_interval import PredictionBand, PredictionInterval
from ..identification.result import IdentifiedModel
from ..kernel.path import PathSolver
from ..modelfile import ModelFile

# More points are not visible in a plot and only make the file larger.
_PLOTTED = 6000


def write_report(path: Path, model: ModelFile, identification: IdentifiedModel, comparison: str = "") -> None:
    """Write the report with all its plots into one file.

    Parameters
    ----------
    path : Path
    model : ModelFile
    identification : Identification
    comparison : str            How other classes of models compare, in a sentence; empty if they were not fitted.
    """
    environment = Environment(
        loader=PackageLoader("strandspring", "report/assets"), autoescape=True, undefined=StrictUndefined
    )
    page = environment.get_template("report.html.j2").render(
        model=model,
        p=model.parameters,
        values=_values(model),
        identification=identification,
        interval=PredictionInterval.of(model.uncertainty),
        comparison=comparison,
        version=__version__,
        plots=[
            _loops(identification),
            _residuals(identification),
            _backbone(identification),
            *([] if identification.band is None else [_band(identification.band)]),
        ],
    )
    write_text(path, page)


def _values(model: ModelFile) -> dict[str, str]:
    """The parameters with as many digits as their standard errors justify."""
    numbers, errors = model.parameters.as_dict(), model.uncertainty
    texts = {name: _digits(numbers[name], errors.get(name)) for name in ("kappa_omega", "rho", "sigma", "n")}
    for name in (name for name in ARRAYS if name in numbers):
        of_each = errors.get(name) or [None] * len(numbers[name])
        texts[name] = ", ".join(_digits(*pair) for pair in zip(numbers[name], of_each, strict=True))
    return texts


def _digits(value: float, error: float | None) -> str:
    """A number down to the second digit of its standard error; six digits if that is unknown or zero."""
    if not error or not value:
        return f"{value:.6g}"
    figures = math.floor(math.log10(abs(value))) - math.floor(math.log10(error)) + 2
    return f"{value:.{min(max(figures, 2), 15)}g}"


def _loops(identification: IdentifiedModel) -> tuple[str, str]:
    figure, axes = _figure(len(identification.records))
    for axis, record, fit in zip(axes, identification.records, identification.fits, strict=True):
        shown = _shown(record.force.size, fit.first_sample)
        axis.plot(record.displacement * 1e3, record.force, color="0.8", lw=0.8, label="measured, not compared")
        axis.plot(record.displacement[shown] * 1e3, record.force[shown], color="0.35", lw=1.2, label="measured")
        axis.plot(record.displacement[shown] * 1e3, fit.predicted[shown], color="C3", lw=1.0, label="model")
        axis.set(xlabel="displacement [mm]", ylabel="force [N]", title=Path(record.path).name)
        axis.legend(fontsize=8)
    return "Measured and predicted loops", _svg(figure)


def _residuals(identification: IdentifiedModel) -> tuple[str, str]:
    figure, axes = _figure(len(identification.records))
    for axis, record, fit in zip(axes, identification.records, identification.fits, strict=True):
        shown = _shown(record.force.size, fit.first_sample)
        axis.plot(shown, (record.force - fit.predicted)[shown], color="C0", lw=0.8)
        axis.axhline(0.0, color="0.5", lw=0.6)
        axis.set(xlabel="sample", ylabel="measured - model [N]", title=Path(record.path).name)
    return "Residuals", _svg(figure)


def _backbone(identification: IdentifiedModel) -> tuple[str, str]:
    figure, (axis,) = _figure(1)
    p = identification.parameters
    solver = PathSolver(p)
    x = np.linspace(p.displacement_min, p.displacement_max, 400)
    # omega = +-1 at the start and a path that goes on keep the branch saturated.
    for omega, path, name in ((1.0, x, "loading, saturated"), (-1.0, x[::-1], "unloading, saturated")):
        axis.plot(path * 1e3, solver.force(path, omega), lw=1.0, label=name)
    elastic = 0.5 * (solver.force(x, 1.0) + solver.force(x[::-1], -1.0)[::-1])
    axis.plot(x * 1e3, elastic, color="k", lw=1.2, label="elastic part FE")
    axis.set(xlabel="displacement [mm]", ylabel="force [N]", title="Elastic part and saturated branches")
    axis.legend(fontsize=8)
    return "Backbone and saturated branches", _svg(figure)


def _band(band: PredictionBand) -> tuple[str, str]:
    figure, (loop, width) = _figure(2)
    half = 0.5 * (band.high - band.low)
    x = band.displacement * 1e3
    loop.plot(x, band.force, color="C3", lw=0.9, label="model")
    for sign in (-1.0, 1.0):
        label = "95 % prediction interval of a measured force" if sign > 0.0 else None
        loop.plot(x, band.force + sign * band.reach, color="C0", lw=0.5, label=label)
        label = "95 % confidence band of the mean" if sign > 0.0 else None
        loop.plot(x, band.force + sign * half, color="C3", lw=0.5, ls="--", label=label)
    loop.set(xlabel="displacement [mm]", ylabel="force [N]", title="Last loop with the uncertainty of its prediction")
    loop.legend(fontsize=8)
    width.plot(x, band.reach, color="C0", lw=0.9, label="prediction interval")
    width.plot(x, half, color="C3", lw=0.9, ls="--", label="confidence band")
    width.set(
        xlabel="displacement [mm]",
        ylabel="half-width [N]",
        title=f"Half-width {np.median(half):.2g} N in the median, {half.max():.2g} N at most (confidence band)",
        ylim=(0.0, None),
    )
    width.legend(fontsize=8)
    return "Uncertainty of the prediction", _svg(figure)


def _shown(size: int, first: int) -> NDArray[np.intp]:
    return np.arange(first, size, max(1, (size - first) // _PLOTTED))


def _figure(rows: int) -> tuple[Figure, Sequence[Axes]]:
    # Not pyplot: no global state, no window system.
    figure = Figure(figsize=(7.5, 4.2 * rows), layout="constrained")
    return figure, list(figure.subplots(rows, 1, squeeze=False)[:, 0])


def _svg(figure: Figure) -> str:
    buffer = io.StringIO()
    # A fixed salt and no date: the same identification gives the same report.
    with mpl.rc_context({"svg.hashsalt": "strandspring", "svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]
