"""Charts of a report for papers and notebooks, drawn by matplotlib into given axes or a file.

Examples
--------
>>> import numpy as np
>>> from strandspring import Record, identify
>>> from strandspring.report.figure import plot_chart
>>> x = 0.02 * np.sin(np.linspace(0.0, 6 * np.pi, 900))
>>> spring_force = 2e3 * x + 10.0 * np.tanh(500.0 * (x + 0.004 * np.sign(np.gradient(x))))
>>> axes = plot_chart(identify(Record(x, spring_force)), "branches")
>>> axes.get_xlabel()
'displacement [mm]'
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import StrandspringError
from ..ground.plotfile import SUFFIXES, save_figure, some_axes
from ..identification.identified import IdentifiedModel
from .charts import engineering, fit_charts, isolation_charts, model_charts
from .charts.engineering import EngineeringFigures
from .charts.evaluation import Evaluation
from .content.chart import Chart

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMN = 88.0  # width of a column of a journal [mm]
_RESOLUTION = 600  # of a PNG [dots per inch]


def _over_amplitude(key: str, evaluation: Evaluation) -> Chart | None:
    charts = engineering.over_amplitude(evaluation, EngineeringFigures(evaluation))
    return next((chart for chart in charts if chart.key == key), None)


_AMPLITUDES = ("amplitude-secant-stiffness", "amplitude-energy-per-cycle", "amplitude-loss-factor")
# Each makes a chart, None where it is unknown, or a sentence that says why it cannot be drawn.
CHARTS: dict[str, Callable[[Evaluation], Chart | str | None]] = {
    "loops": fit_charts.loops,
    "force": fit_charts.force,
    "residuals-displacement": fit_charts.residuals_over_displacement,
    "residuals-velocity": fit_charts.residuals_over_velocity,
    "residuals-time": fit_charts.residuals_over_time,
    "histogram": fit_charts.histogram,
    "autocorrelation": fit_charts.autocorrelation,
    "branches": model_charts.branches,
    "amplifier": model_charts.amplifier,
    "omega": model_charts.omega,
    "correlations": model_charts.correlations,
    "band": model_charts.band,
    **{key: partial(_over_amplitude, key) for key in _AMPLITUDES},
    "transmissibility": partial(isolation_charts.transmissibility, mass=None),
}


def plot_chart(
    identification: IdentifiedModel, chart: str = "loops", ax: Axes | None = None, record: int | None = None
) -> Axes:
    """Draw a chart of the report.

    Parameters
    ----------
    identification : IdentifiedModel
    chart : str             "loops", "force", "residuals-displacement", "residuals-velocity", "residuals-time",
                            "histogram", "autocorrelation", "branches", "amplifier", "omega", "correlations", "band",
                            "amplitude-secant-stiffness", "amplitude-energy-per-cycle", "amplitude-loss-factor" or
                            "transmissibility".
    ax : Axes or None       To draw into; new ones of pyplot if None.
    record : int or None    Place of the record shown; all if None.

    Raises
    ------
    StrandspringError       If there is no such chart, or it is unknown, as correlations are after other methods than
                            the refined one.
    """
    from .rendering.drawing import draw

    if chart not in CHARTS:
        raise StrandspringError(f"`chart` must be one of {', '.join(CHARTS)}, got {chart!r}.")
    drawn = CHARTS[chart](Evaluation(identification))
    if drawn is None:
        raise StrandspringError(f"This identification has no chart {chart!r}: it holds nothing of what that shows.")
    if isinstance(drawn, str):
        raise StrandspringError(drawn)
    return draw(drawn, some_axes(ax)[0], record, scale=1.4)


def write_figure(path: str | Path, identification: IdentifiedModel) -> None:
    """Write measured and predicted loops as a figure for a column of a paper, 88 mm wide and without a title.

    Parameters
    ----------
    path : str or Path        Ending in .svg, .png or .pdf.
    identification : IdentifiedModel

    Raises
    ------
    StrandspringError         If the ending does not suit, or the file cannot be written.
    """
    from matplotlib import rc_context

    from .rendering.drawing import STYLE, paper_figure

    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise StrandspringError(f"A figure must end in {', '.join(SUFFIXES)}, got {str(path)!r}; choose one of them.")
    evaluation = Evaluation(identification)
    with rc_context(STYLE):
        save_figure(
            path, paper_figure(fit_charts.loops(evaluation), COLUMN, dict(enumerate(evaluation.names))), _RESOLUTION
        )
