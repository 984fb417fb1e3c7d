"""`info`: loops of a model beside those of records, in the table and in the plot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from strandspring import Record, Spring, info, synthesize
from strandspring.kernel.path import PathSolver
from strandspring.loops.campaign import RateVerdict
from strandspring.loops.loop import steady_loop
from synthetic import MEAN, record_of, sine, spring_of

SPRING = Spring(spring_of(1.0, 1.0), "mount", "a mount")


def test_one_row_for_each_loop() -> None:
    record = synthesize(SPRING, amplitudes=[0.01, 0.02], noise=0.005)
    information = info(SPRING, record, amplitudes=[0.005])
    frame = information.to_frame()
    assert frame["source"].tolist() == ["model", "<mount>", "model", "<mount>", "model"]
    assert frame["from"].tolist() == ["", "", "<mount>", "", "<mount>"]
    expected = steady_loop(PathSolver(SPRING.parameters), MEAN - 0.005, MEAN + 0.005).figures
    assert frame.loc[0, "energy_per_cycle"] == pytest.approx(expected.energy_per_cycle, rel=1e-9)  # another zero
    # 0.5 % noise; the mean over some cycles and hundreds of samples leaves less than 1 %.
    for measured, model in ((1, 2), (3, 4)):
        for figure in ("secant_stiffness", "energy_per_cycle", "loss_factor"):
            assert frame.loc[measured, figure] == pytest.approx(frame.loc[model, figure], rel=0.01)
    assert frame.loc[1, "frequency"] == pytest.approx(1.0)


def test_displacements_are_counted_from_the_zero() -> None:
    assert info(SPRING).zero == MEAN  # 0 lies outside the range
    assert info(SPRING, zero="rig").zero == 0.0
    low = info(SPRING, zero=0.03).to_frame()["low"].iloc[-1]
    assert low == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(ValueError, match='"rig", "middle" or a displacement'):
        info(SPRING, zero="left")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="amplitudes"):
        info(SPRING, amplitudes=[-0.01])


def test_arrays_paths_and_the_method_of_the_spring(tmp_path: Path) -> None:
    record = record_of(SPRING.parameters, sine(), 0.0)
    record.save(tmp_path / "loop.csv")
    expected = info(SPRING, record).to_frame().drop(columns=["source", "from"])
    arrays = SPRING.info(record.displacement, record.force).to_frame().drop(columns=["source", "from"])
    path = info(SPRING, tmp_path / "loop.csv").to_frame().drop(columns=["source", "from"])
    assert expected.equals(arrays)
    assert expected.equals(path)
    with pytest.raises(TypeError, match="Arrays are given"):
        info(SPRING, record.displacement)


def test_the_plot_and_the_words() -> None:
    information = info(SPRING, synthesize(SPRING, amplitudes=[0.01, 0.02]))
    axes = list(Figure().subplots(1, 3))
    assert information.plot(axes) == axes
    points = axes[1].lines[1].get_xydata()
    assert points[:, 0] == pytest.approx([10.0, 20.0], rel=1e-3)
    line = axes[1].lines[0].get_xydata()
    assert line[-1, 1] == pytest.approx(points[-1, 1], rel=1e-3)
    with pytest.raises(ValueError, match="`ax` must be 3 axes of matplotlib, got 2"):
        information.plot(axes[:2])
    text = information.summary()
    for expected in ("Model mount (mount): a mount", "secant N/mm", "loading paths", "counted from 50 mm"):
        assert expected in text


@pytest.mark.parametrize("is_sine", [False, True])
def test_a_first_loading_is_no_steady_loop(is_sine: bool) -> None:
    up = np.linspace(-0.01, 0.01, 200)
    first = sine(1, 401, 0.01) if is_sine else MEAN + np.concatenate([up, up[-2::-1]])
    record = Record(first, SPRING.response(first))
    information = info(SPRING, record)
    ((measured, modelled),) = information.pairs
    # omega begins at 0, while in a steady loop it begins at +-1: what is measured is no loop of the model.
    assert abs(measured.figures.energy_per_cycle / modelled.figures.energy_per_cycle - 1.0) > 0.02
    assert abs(measured.gap) > 0.1
    (caution,) = information.cautions
    assert "is open" in caution

    slower = synthesize(SPRING, amplitudes=[0.01], frequency=0.1)
    at_ten_hertz = Record(first, SPRING.response(first), np.linspace(0.0, 0.1, first.size))
    verdict = info(SPRING, slower, at_ten_hertz).rate_independence
    assert verdict is None or verdict.verdict is not RateVerdict.DEPENDENT

    twice = np.concatenate([first, first[1:], first[1:]])
    steady = info(SPRING, Record(twice, SPRING.response(twice)))
    assert not steady.cautions
    # Sums over 200 samples a stroke.
    assert steady.pairs[0][0].figures.energy_per_cycle == pytest.approx(modelled.figures.energy_per_cycle, rel=2e-3)
