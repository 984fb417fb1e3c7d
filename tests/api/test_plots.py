"""Every result that has a plot draws it into axes that are given, or into those of a new figure."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

import strandspring
from strandspring import Spring, SpringParameters, identify_many, isolate_system, study, synthesize
from strandspring.examples.system_models import SYSTEMS

MOUNT = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
NAMES = ("Comparison", "Identification", "Information", "Isolation", "ManyResult", "Prediction", "Record", "Simulation")
PLOTTED = (*NAMES, "Spring", "StudyResult", "SystemIsolation", "SystemStudyResult")


def many(folder: Path) -> Any:
    """Two springs identified into a folder."""
    for k in range(2):
        synthesize(MOUNT, [0.01, 0.02], noise=0.01, seed=k, samples=100).save(folder / f"{k}.csv", "mm")
    return identify_many(folder, folder / "models", workers=1, method="two-stage")


MADE: dict[str, Callable[[Path], Any]] = {
    "Spring": lambda _: MOUNT,
    "Record": lambda _: synthesize(MOUNT),
    "StudyResult": lambda _: study(MOUNT, [5.0, 6.0], base_displacement=[1e-4, 2e-4], draws=0, points=8),
    "ManyResult": many,
    "SystemIsolation": lambda _: isolate_system(
        SYSTEMS / "gun_cradle.toml", base_displacement=1e-4, points=6, extrapolate=True
    ),
}


def test_the_argument_is_matplotlibs() -> None:
    for name in PLOTTED:
        assert list(signature(getattr(strandspring, name).plot).parameters) == ["self", "ax"]


@pytest.mark.parametrize("name", MADE)
def test_plots(name: str, tmp_path: Path) -> None:
    result = MADE[name](tmp_path)
    with mpl.rc_context({"backend": "agg"}):
        own = result.plot()
        shown = own if isinstance(own, list) else [own]
        assert shown[0].figure.number in plt.get_fignums()
        plt.close("all")
    given = Figure().subplots(len(shown))
    drawn = result.plot(given)
    for axes in np.ravel(drawn):
        assert axes.lines
        assert axes.get_ylabel() or axes is not drawn
    with pytest.raises(ValueError, match=rf"`ax` must be {len(shown)} axes of matplotlib, got {len(shown) + 1}"):
        result.plot(Figure().subplots(len(shown) + 1))
    if hasattr(result, "save_plot"):
        result.save_plot(tmp_path / "plot.svg")
        assert (tmp_path / "plot.svg").stat().st_size > 5000


def test_what_is_drawn(tmp_path: Path) -> None:
    record = synthesize(MOUNT)
    (line,) = record.plot(Figure().subplots()).lines
    assert np.array_equal(line.get_xdata(), 1e3 * record.displacement)
    assert np.array_equal(line.get_ydata(), record.force)
    loops = MOUNT.plot(Figure().subplots()).lines
    assert [line.get_xdata()[0] for line in loops[::2]] == pytest.approx([-20.0, -15.0, -10.0, -5.0])
    found = many(tmp_path)
    table = found.to_frame()
    springs, outliers = found.plot(Figure().subplots()).lines
    assert springs.get_xdata() == pytest.approx(1e-3 * table["secant stiffness [N/m]"])
    assert outliers.get_xdata().size == 0
    masses = study(MOUNT, [5.0, 6.0], base_displacement=1e-4, draws=0, points=8)
    line = masses.plot(Figure().subplots()).lines[0]
    assert np.array_equal(line.get_xdata(), masses.to_frame()["frequency"])
    assert np.array_equal(line.get_ydata(), masses.to_frame()["transmissibility"])
