"""The paper's spring and its campaign have the numbers of section 5, from the records alone."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from example_springs import write_models
from strandspring import Record, Spring, identify, isolate, predict
from strandspring.docs.site import page_text
from strandspring.examples import paper
from strandspring.examples.system_models import SYSTEMS
from strandspring.model.modelfile import load_model

MIDDLE, AMPLITUDES = 57.0, (13.0, 24.0, 46.0)  # mm
MODEL = SYSTEMS / "recoil_spring.json"


@pytest.fixture(scope="module")
def records() -> dict[str, Record]:
    return paper.campaign()


def turns_of(x: np.ndarray) -> np.ndarray:
    """Samples at which the motion turns."""
    return np.flatnonzero(np.diff(x)[:-1] * np.diff(x)[1:] < 0.0) + 1


def test_motion_is_that_of_section_5(records: dict[str, Record]) -> None:
    amplitudes, frequencies = [], []
    for record in records.values():
        x = 1e3 * record.displacement
        assert record.time is not None
        amplitudes += list(np.round(np.abs(x[turns_of(x)] - MIDDLE), 6))
        rising = np.flatnonzero((x[:-1] < MIDDLE - 1e-6) & (x[1:] >= MIDDLE - 1e-6)) + 1
        frequencies.append(1.0 / np.diff(record.time[rising]).mean())
    assert set(amplitudes) == {13.0, 24.0, 35.0, 46.0}
    assert frequencies == pytest.approx([0.13, 2.12, 1.0], rel=1e-6)


def test_forces_are_those_of_section_5(records: dict[str, Record]) -> None:
    forces = np.concatenate([record.force for record in records.values()])
    assert forces.min() > 0.0
    # What the RMSE and RNL of the paper's Table 2 imply.
    assert np.sqrt(np.mean(forces**2)) == pytest.approx(302.0, rel=0.1)


def test_loading_paths_overlap_and_harden(records: dict[str, Record]) -> None:
    """Of the force without noise, along the displacement of the slow record."""
    x, force = 1e3 * records["slow"].displacement, Spring(paper.SPRING).response(records["slow"].displacement)
    settled = {}  # last strokes between both ends of each amplitude, up and down
    for begin, end in pairwise(turns_of(x)):
        if x[begin] + x[end] == pytest.approx(2.0 * MIDDLE):
            settled[round(x[end] - MIDDLE, 6)] = slice(begin, end + 1)
    assert set(settled) == {sign * amplitude for amplitude in AMPLITUDES for sign in (1.0, -1.0)}
    largest, back = settled[46.0], settled[-46.0]
    height = np.max(force[largest] - np.interp(x[largest], x[back][::-1], force[back][::-1]))
    for amplitude in AMPLITUDES[:-1]:
        smaller = settled[amplitude]
        second = x[smaller] > MIDDLE  # half of the smaller stroke
        apart = (force[smaller] - np.interp(x[smaller], x[largest], force[largest]))[second]
        assert np.abs(apart).max() < 0.05 * np.ptp(force)
        assert np.sqrt(np.mean(apart**2)) < 0.05 * height
    low, middle, high = np.interp([MIDDLE - 46.0, MIDDLE, MIDDLE + 46.0], x[largest], force[largest])
    assert high - middle > middle - low


def test_info_finds_the_overlap(records: dict[str, Record], tmp_path: Path) -> None:
    for name in ("slow", "fast"):
        records[name].save(tmp_path / f"{name}.csv", "mm")
    command = [sys.executable, "-m", "strandspring", "info", str(MODEL), "slow.csv", "fast.csv"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    said = " ".join(done.stdout.split())
    assert "The loading paths of different amplitudes overlap." in said, done.stderr
    of_height = re.search(r"lie \S+ N \(rms\) from the largest one's, (\S+) % of its loop's height", said)
    assert of_height is not None
    assert float(of_height[1]) < 5.0


def test_the_installed_spring_is_identified_from_the_campaign(records: dict[str, Record], tmp_path: Path) -> None:
    write_models(tmp_path, ["recoil_spring"])
    made, bundled = load_model(tmp_path / MODEL.name), load_model(MODEL)
    for name, value in bundled.parameters.as_dict().items():
        # The same fit on another computer: rounding of its last step.
        assert made.parameters.as_dict()[name] == pytest.approx(value, rel=1e-6, abs=1e-9)
    for words in ("Synthesized, not measured", "176 mm", "one core wire and layers of 3 and 6 wires of 1.5 mm"):
        assert words in bundled.description
    assert (bundled.parameters.displacement_min, bundled.parameters.displacement_max) == pytest.approx((0.011, 0.103))
    forces = np.concatenate([records[name].force for name in ("slow", "fast")])
    certificate = bundled.certificate
    assert certificate is not None
    assert (certificate.force_min, certificate.force_max) == pytest.approx((forces.min(), forces.max()))
    spring = Spring.load(MODEL)
    for record in records.values():
        # 1 % of noise leaves 0.99.
        missed = spring.response(record.displacement) - record.force
        assert 1.0 - np.sqrt(np.sum(missed**2) / np.sum(record.force**2)) > 0.98


def test_the_tutorial_says_what_is_printed(records: dict[str, Record]) -> None:
    page = " ".join(page_text("tutorial").split("## 2.")[1].split())
    fit = identify([records["slow"], records["fast"]])
    said = " ".join(fit.summary().split())
    table = page.split("| --- | --- |")[1].split("| the force does not depend")[0]
    figures = [figure for row in table.split("| |") for figure in row.strip("| ").split(" | ")[0].split(", ")]
    assert len(figures) == 8
    for figure in figures:
        assert figure in said, figure
    held_out = predict(fit.spring("spring"), records["held_out"])
    assert f"rmse is {held_out.rmse:.4g} N and RNL {held_out.rnl:.4f} at" in page
    curves = isolate(fit.spring("spring"), 25.0).as_json()["levels"]
    (first, last) = (curves[k]["resonance"] for k in (0, -1))
    assert f"from {first['frequency']:.2f} to {last['frequency']:.2f} Hz" in page
