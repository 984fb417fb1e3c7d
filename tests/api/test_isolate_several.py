"""`isolate` in Python: one model or several, tables, plots, verification."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from springs import MOUNT
from strandspring import Spring, StrandspringError, isolate
from strandspring.api.vibration.isolation import CheckedMotion
from strandspring.examples.rigid_platform import STIFF as STIFF_CORNER
from strandspring.vibration.one_mass.curves_plot import fill
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, IsolationError

SOFT = Spring(MOUNT, "soft")
STIFF = Spring(STIFF_CORNER, "stiff")


def test_levels_are_in_si_and_may_be_one_or_several() -> None:
    result = isolate(SOFT, 5.0, force=[1.0, 2.0], points=8, zero="rig")
    assert (result.excitation, result.levels) == (Excitation.FORCE, (1.0, 2.0))
    expected = frequency_response(
        IsolatedMass(MOUNT, 5.0), Excitation.FORCE, 2.0, result.models[0].responses[1].column("frequency")[[0, -1]]
    )
    assert result.models[0].responses[1].points[0].transmissibility == pytest.approx(
        expected.points[0].transmissibility, rel=1e-9
    )
    assert isolate(SOFT, 5.0, base_acceleration=0.5, points=8).levels == (0.5,)


def test_the_default_levels_suit_the_model_with_the_least_free_travel(tmp_path: Path) -> None:
    STIFF.save(tmp_path / "stiff.json")
    alone = isolate(tmp_path / "stiff.json", 8.0, points=8)
    both = isolate([SOFT, tmp_path / "stiff.json"], 8.0, points=8)
    assert both.levels == alone.levels
    assert both.levels[0] < isolate(SOFT, 8.0, points=8).levels[0]
    assert both.levels_chosen == (
        f"Levels: 0.5, 1 and 2 % of the free travel of {1e3 * both.levels[0] / 0.005:.4g} mm on stiff, the smallest of "
        "these models."
    )
    assert both.levels_chosen in both.summary()
    assert [one.source for one in both.models] == [None, str(tmp_path / "stiff.json")]
    # The curves are those of each model alone.
    pd.testing.assert_frame_equal(
        both.to_frame().query("model == 'stiff'").reset_index(drop=True), alone.to_frame(), check_exact=True
    )


def test_tables_have_the_names_of_the_attributes() -> None:
    result = isolate([SOFT, STIFF], 8.0, base_displacement=1e-4, points=12)
    resonances = result.resonances()
    assert resonances["model"].tolist() == ["soft", "stiff"]
    frame = result.to_frame()
    for one in result.models:
        of_model = frame[frame["model"] == one.label]
        assert of_model["transmissibility"].max() == one.responses[0].resonance.transmissibility
        assert of_model["requested"].sum() == 12
    assert "resonance Hz" in result.summary()
    assert repr(result).count("\n") < 10
    assert "<table" in result._repr_html_()


def test_models_of_one_name_are_numbered() -> None:
    result = isolate([SOFT, Spring(STIFF_CORNER, "soft"), STIFF], 8.0, base_displacement=1e-4, points=6)
    assert [one.label for one in result.models] == ["soft (1)", "soft (2)", "stiff"]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"force": 1.0, "base_displacement": 1e-3}, "`base_displacement` and `force` exclude each other"),
        ({"force": []}, r"Every level of force must be finite and > 0 \[N\]"),
        ({"force": [1.0, float("nan")]}, r"Every level of force must be finite and > 0 \[N\]"),
        ({"mass": -1.0}, "`mass` must be within"),
        ({"points": 1}, "`points` must be >= 2, got 1"),
        ({"zero": "left"}, '`zero` must be "rig", "middle" or a displacement'),
        ({"models": []}, "give at least one model"),
    ],
)
def test_what_is_out_of_bounds_is_refused(options: dict[str, object], told: str) -> None:
    with pytest.raises(StrandspringError, match=told):
        isolate(**{"models": SOFT, "mass": 5.0, "points": 8, **options})  # type: ignore[arg-type]


def test_a_refusal_names_the_model_if_there_are_several() -> None:
    with pytest.raises(IsolationError, match=r"^soft: The static load of 9806"):
        isolate([SOFT, STIFF], 1000.0)
    with pytest.raises(IsolationError, match=r"^soft: At .* outside the identified range"):
        isolate([SOFT, STIFF], 8.0, base_displacement=5e-3, points=8)
    with pytest.raises(IsolationError, match=r"^At .* outside the identified range"):
        isolate(SOFT, 8.0, base_displacement=5e-3, points=8)


def test_something_else_is_no_model() -> None:
    with pytest.raises(TypeError, match="A model must be a Spring or the path of a model file or FMU, got float"):
        isolate(1.0, 5.0)  # type: ignore[arg-type]


def test_progress_moves_within_a_level() -> None:
    seen: list[tuple[str, float, int]] = []
    isolate([SOFT, STIFF], 5.1, base_displacement=2e-3, damping=20.0, band=(5.0, 25.0), points=1500, extrapolate=True,
            progress=lambda task, done, total: seen.append((task, done, total)))  # fmt: skip
    assert {total for *_, total in seen} == {3000}
    done = [done for _, done, _ in seen]
    assert done == sorted(done)
    assert done[-1] == 3000
    assert len([value for value in done if 0.0 < value < 1500.0]) >= 2
    assert {task for task, *_ in seen} == {"soft, 2 mm", "stiff, 2 mm", "done"}


def test_superharmonic_peaks_are_resolved_and_nothing_else_changes() -> None:
    system = IsolatedMass(MOUNT, 5.1)
    band = np.geomspace(2.6, 57.0, 200)
    plain, resolved = (
        frequency_response(system, Excitation.BASE_DISPLACEMENT, 6e-4, band, resolve=resolve)
        for resolve in (False, True)
    )
    assert resolved.resonance == plain.resonance
    assert [point for point in resolved.points if point.requested] == [
        point for point in plain.points if point.requested
    ]
    frequency, amplitude = resolved.column("frequency"), resolved.column("amplitude")
    near = (frequency > 3.6) & (frequency < 4.0)
    assert near.sum() >= 15
    # No corner is left in the peak that 200 points show as a needle.
    steps = np.abs(np.diff(np.log(amplitude[near])))
    before = plain.column("frequency")
    corner = np.abs(np.diff(np.log(plain.column("amplitude")[(before > 3.6) & (before < 4.0)]))).max()
    assert steps.max() < 0.5 * corner


def test_the_figure_has_decimal_ticks_its_legend_below_and_marks_superharmonics() -> None:
    result = isolate(SOFT, 5.1, base_displacement=[3e-4, 6e-4])
    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    top, bottom = fill(figure, result.curves, result.title)
    figure.draw_without_rendering()
    for axis in (bottom.xaxis, top.yaxis, bottom.yaxis):
        low, high = sorted(axis.get_view_interval())
        labels = [tick.label1.get_text() for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
        assert len(labels) >= 3
        assert all("$" not in label and "e" not in label and float(label) > 0.0 for label in labels)
    (legend,) = figure.legends
    assert "superharmonic peaks at 1/3 of the natural frequency" in legend.get_title().get_text()
    assert "1/3" in [text.get_text() for text in bottom.texts]
    assert legend.get_window_extent().y1 < bottom.xaxis.label.get_window_extent().y0


def test_unstable_parts_are_dotted() -> None:
    result = isolate(SOFT, 5.1, base_displacement=2e-3, damping=20.0, band=(5.0, 25.0), points=60, extrapolate=True)
    figure = Figure(layout="constrained")
    top, _ = fill(figure, result.curves, result.title)
    solid, dotted, _ = top.lines
    unstable = ~result.models[0].responses[0].columns["stable"]
    assert np.isnan(solid.get_ydata()).tolist() == unstable.tolist()
    assert dotted.get_linestyle() == "--"  # what matplotlib calls any pattern
    assert np.isfinite(dotted.get_ydata()[unstable]).all()
    assert "unstable where dotted" in figure.legends[0].get_title().get_text()


def test_plot_takes_axes_and_gives_them_back() -> None:
    result = isolate([SOFT, STIFF], 8.0, base_displacement=[1e-4, 2e-4], points=12)
    axes = Figure().subplots()
    assert result.plot(axes) is axes
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["soft, 0.1 mm", "soft, 0.2 mm", "stiff, 0.1 mm", "stiff, 0.2 mm"]
    colors = [line.get_color() for line in axes.lines[:4]]
    assert colors[0] == colors[1] != colors[2] == colors[3]
    with mpl.rc_context({"backend": "agg"}):
        own = result.plot()
        assert len(own.figure.axes) == 2
        from matplotlib import pyplot as plt

        plt.close("all")


def test_files_are_written_as_the_command_does(tmp_path: Path) -> None:
    result = isolate([SOFT, STIFF], 8.0, force=1.0, points=8)
    result.save_csv(tmp_path / "curves.csv")
    table = pd.read_csv(tmp_path / "curves.csv")
    assert table.columns[:3].tolist() == ["model", "level [N]", "frequency [Hz]"]
    assert "relative motion over force [m/N]" in table
    assert table["lowest displacement of a spring [m]"].tolist() == result.to_frame()["min"].tolist()
    result.save_plot(tmp_path / "curves.svg")
    first = (tmp_path / "curves.svg").read_bytes()
    result.save_plot(tmp_path / "curves.svg")
    assert (tmp_path / "curves.svg").read_bytes() == first
    with pytest.raises(StrandspringError, match=r"must end in \.png, \.svg, \.pdf"):
        result.save_plot(tmp_path / "curves.txt")


def test_verify_simulates_the_ends_of_the_band_and_the_peak() -> None:
    result = isolate(SOFT, 5.1, base_displacement=3e-4, band=(20.0, 40.0), points=4)
    seen: list[str] = []
    checked = result.verify(lambda task, done, total: seen.append(f"{done}/{total} {task}"))
    assert [one.agrees for one in checked] == [True] * len(checked)
    assert len(checked) == 2  # the peak is at the lower end
    assert seen[0] == "0/3 Building the FMU of soft"
    assert seen[1].startswith("1/3 Simulating soft, 0.3 mm, 20 Hz")
    wrong = CheckedMotion(checked[0].model, checked[0].response, replace(checked[0].check, difference=0.02))
    assert not wrong.agrees
    assert "amplitude +2.000 %" in wrong.sentence
    assert "DIFFERS" in wrong.sentence


def test_verify_does_not_warn_of_what_was_asked_for() -> None:
    result = isolate(SOFT, 5.1, base_displacement=2e-3, damping=20.0, band=(5.0, 25.0), points=30, extrapolate=True)
    assert all(response.extrapolating for _, response in result.every)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(result.verify(lambda *_: None)) == 3
