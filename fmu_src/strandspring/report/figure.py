"""Figures for papers and notebooks: loops and more, drawn by matplotlib into given axes or a file.

Examples
--------
>>> import numpy as np
>>> from strandspring import Record, identify
>>> from strandspring.report.figure import plot_loops
>>> x = 0.02 * np.sin(np.linspace(0.0, 6 * np.pi, 900))
>>> spring_force = 2e3 * x + 10.0 * np.tanh(500.0 * (x + 0.004 * np.sign(np.gradient(x))))
>>> axes = plot_loops(identify(Record(x, spring_force)))
>>> axes.get_xlabel()
'displacement [mm]'
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ..errors import StrandspringError
from ..ground.plotfile import SUFFIXES, save_figure
from ..identification.identified_model import IdentifiedModel
from .chart import Figure
from .charts import engineering_charts, fit_charts, isolation_charts, model_charts
from .engineering import EngineeringFigures
from .evaluation import Evaluation

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMN = 88.0  # width of a column of a journal [mm]
_WIDTHS = (30.0, 400.0)
_RESOLUTION = 600  # of a PNG [dots per inch]

Against = Literal["displacement", "velocity", "time"]


def check_figure_path(path: str | Path) -> None:
    """Refuse a figure of another kind than SVG, PNG or PDF, before the work begins.

    Raises
    ------
    StrandspringError   If the name ends in anything else.

    Examples
    --------
    >>> check_figure_path("loop.svg")
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise StrandspringError(f"A figure must end in {', '.join(SUFFIXES)}, got {str(path)!r}; choose one of them.")


def write_figure(path: str | Path, identification: IdentifiedModel, width: float = COLUMN) -> None:
    """Write measured and predicted loops as a figure for a paper, without a title.

    Parameters
    ----------
    path : str or Path        Ending in .svg, .png or .pdf.
    identification : IdentifiedModel
    width : float             [mm]; 88 for a column, 180 for a page.

    Raises
    ------
    StrandspringError         If the ending or the width does not suit, or the file cannot be written.
    """
    from matplotlib import rc_context

    from .drawing import STYLE, paper_figure

    path = Path(path)
    check_figure_path(path)
    if not _WIDTHS[0] <= width <= _WIDTHS[1]:
        raise StrandspringError(f"A figure must be {_WIDTHS[0]:g} to {_WIDTHS[1]:g} mm wide, got {width:g} mm.")
    of = Evaluation(identification)
    with rc_context(STYLE):
        save_figure(path, paper_figure(fit_charts.loops(of), width, dict(enumerate(of.names))), _RESOLUTION)


def plot_loops(identification: IdentifiedModel, axes: Axes | None = None) -> Axes:
    """Measured and predicted loops of all records over each other.

    Parameters
    ----------
    identification : IdentifiedModel
    axes : Axes or None   To draw into; new ones of pyplot if None.
    """
    return _drawn(fit_charts.loops(Evaluation(identification)), axes)


def plot_force(identification: IdentifiedModel, axes: Axes | None = None, record: int = 0) -> Axes:
    """Measured and predicted force over time, or over the sample number without times; of one record."""
    return _drawn(fit_charts.force(Evaluation(identification)), axes, record)


def plot_residuals(
    identification: IdentifiedModel, axes: Axes | None = None, record: int = 0, against: Against = "displacement"
) -> Axes:
    """Residuals of one record against displacement, velocity or time.

    Raises
    ------
    StrandspringError   If a velocity is asked for and no record has rising times.
    """
    of = Evaluation(identification)
    charts = {
        "displacement": fit_charts.residuals_over_displacement,
        "velocity": fit_charts.residuals_over_velocity,
        "time": fit_charts.residuals_over_time,
    }
    if against not in charts:
        raise StrandspringError(f"`against` must be one of {', '.join(charts)}, got {against!r}.")
    chart = charts[against](of)
    if chart is None:
        raise StrandspringError("Residuals against velocity need times that rise; give a time column.")
    return _drawn(chart, axes, record)


def plot_histogram(identification: IdentifiedModel, axes: Axes | None = None, record: int = 0) -> Axes:
    """Distribution of the residuals of one record, beside the normal one."""
    return _drawn(fit_charts.histogram(Evaluation(identification)), axes, record)


def plot_autocorrelation(identification: IdentifiedModel, axes: Axes | None = None, record: int = 0) -> Axes:
    """Autocorrelation of the residuals of one record."""
    return _drawn(fit_charts.autocorrelation(Evaluation(identification)), axes, record)


def plot_branches(identification: IdentifiedModel, axes: Axes | None = None) -> Axes:
    """Elastic force FE between the saturated branches."""
    return _drawn(model_charts.branches(Evaluation(identification)), axes)


def plot_omega(identification: IdentifiedModel, axes: Axes | None = None) -> Axes:
    """omega over displacement along the records."""
    return _drawn(model_charts.omega(Evaluation(identification)), axes)


def plot_correlations(identification: IdentifiedModel, axes: Axes | None = None) -> Axes:
    """Correlations between all coefficients.

    Raises
    ------
    StrandspringError   If they are unknown, as after other methods than the refined one.
    """
    return _drawn(_known(model_charts.correlations(Evaluation(identification)), "correlations"), axes)


def plot_band(identification: IdentifiedModel, axes: Axes | None = None) -> Axes:
    """The last loop with its 95 % confidence band and prediction interval.

    Raises
    ------
    StrandspringError   If they are unknown, as after other methods than the refined one.
    """
    found = model_charts.band(Evaluation(identification))
    return _drawn(_known(None if found is None else found[0], "a prediction interval"), axes)


def plot_over_amplitude(
    identification: IdentifiedModel,
    axes: Axes | None = None,
    figure: Literal["secant_stiffness", "energy_per_cycle", "loss_factor"] = "secant_stiffness",
) -> Axes:
    """One of the engineering figures over the amplitude, measured and modelled."""
    of = Evaluation(identification)
    names = [name for name, _, _ in engineering_charts.FIGURES]
    charts = dict(zip(names, engineering_charts.over_amplitude(of, EngineeringFigures(of)), strict=True))
    if figure not in charts:
        raise StrandspringError(f"`figure` must be one of {', '.join(charts)}, got {figure!r}.")
    return _drawn(charts[figure], axes)


def plot_transmissibility(identification: IdentifiedModel, axes: Axes | None = None, mass: float | None = None) -> Axes:
    """Transmissibility of a mass [kg] on the spring; of one that rests near mid-range if None.

    Raises
    ------
    StrandspringError   If the mass does not rest on the spring; the sentence says why.
    """
    chart = isolation_charts.transmissibility(Evaluation(identification), mass)
    if isinstance(chart, str):
        raise StrandspringError(chart)
    return _drawn(chart, axes)


def _known(figure: Figure | None, what: str) -> Figure:
    if figure is None:
        raise StrandspringError(f"This identification has no {what.removeprefix('a ')}; use the refined method.")
    return figure


def _drawn(figure: Figure, axes: Axes | None, record: int | None = None) -> Axes:
    from .drawing import draw

    if axes is None:
        from matplotlib import pyplot

        axes = pyplot.subplots(layout="constrained")[1]
    return draw(figure, axes, record, scale=1.4)
