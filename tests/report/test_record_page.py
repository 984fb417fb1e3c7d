"""The page of records before they are identified, used in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from browser import chromium, opened
from springs import MOUNT
from strandspring import Record, Spring, bundled_record, select, show
from strandspring.loops.selection import Wanted
from strandspring.report.record_page import overview

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def hinge(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return show(bundled_record(), tmp_path_factory.mktemp("pages") / "hinge.html", reverse="displacement")


def drag(page: Page, figure: str) -> None:
    """Zoom into the middle of a figure."""
    page.locator(f"#figure-{figure}").scroll_into_view_if_needed()
    box = page.locator(f"#figure-{figure} .plot").bounding_box()
    assert box is not None
    y = box["y"] + 0.5 * box["height"]
    page.mouse.move(box["x"] + 0.25 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.75 * box["width"], y + 2.0, steps=5)
    page.mouse.up()


@pytest.mark.parametrize(("width", "scheme"), [(1300, "light"), (400, "dark")])
def test_everything_is_drawn_and_nothing_overlaps(browser: Browser, hinge: Path, width: int, scheme: str) -> None:
    with opened(browser, hinge, width, scheme) as sight:
        assert (sight.messages, sight.requests, sight.empty(), sight.overlaps(), sight.outside()) == (
            [],
            [],
            [],
            [],
            [],
        )


def test_what_is_chosen_is_printed_as_options_that_choose_it(browser: Browser, hinge: Path) -> None:
    with opened(browser, hinge, 1300, "light") as sight:
        page = sight.page
        options = page.locator("#options")
        assert "no option is needed" in options.inner_text()
        page.select_option("#first-cycle", "2")
        assert options.inner_text() == "--cycles 2"
        drag(page, "loops")
        page.wait_for_function("document.querySelector('#options').value.includes('--displacement-range')")
        drag(page, "displacement")
        page.wait_for_function("document.querySelector('#options').value.includes('--time')")
        words = options.inner_text().split()
        assert words[::2] == ["--cycles", "--displacement-range", "--time"]
        page.click("#reset")
        page.wait_for_function("document.querySelector('#options').value.includes('no option')")
    low, high = (float(end) for end in words[3].split(":"))
    record = Wanted(reverse="displacement", displacement_range=words[3]).read(bundled_record())
    assert record.compared is not None
    chosen = 1e3 * record.displacement[record.compared]
    assert low <= chosen.min() <= chosen.max() <= high
    # The middle half of the axis, which has a margin of 5 % on both sides; a pixel is a thousandth of it.
    assert high - low == pytest.approx(0.55 * 1e3 * np.ptp(record.displacement), rel=0.005)
    assert len(Wanted(reverse="displacement", time_window=words[5]).read(bundled_record())) > 100


def test_a_record_that_no_spring_has_made_is_shown_with_the_reason(tmp_path: Path) -> None:
    path = np.sin(np.linspace(0.0, 20.0, 2000))
    page = show(Record(1e-3 * path, -1e3 * path, path="backwards.csv"), tmp_path / "page.html")
    assert "No spring would be identified: backwards.csv" in page.read_text(encoding="utf-8")


def test_an_overview_tells_cycles_and_spikes() -> None:
    time = np.linspace(0.0, 10.0, 4001)
    path = 0.05 + 0.025 * np.sin(2.0 * np.pi * time)
    force = Spring(MOUNT).response(path) + np.random.default_rng(3).normal(0.0, 0.2, path.size)
    force[1000] += 5000.0
    record = Record(path, np.minimum(force, 1e4), time)
    seen = overview(record)
    assert (seen.strokes, len(seen.cycles)) == (21, 9)
    for number, cycle in enumerate(seen.cycles, 1):
        assert cycle.figures.amplitude == pytest.approx(0.025, rel=1e-3)
        assert cycle.frequency == pytest.approx(1.0, rel=1e-2)
        part = select(record, cycles=(number, number))
        np.testing.assert_array_equal(part.force, record.force[cycle.first_sample : cycle.last_sample + 1])
    assert {reason: samples.tolist() for reason, samples in seen.left_out.items()} == {"spikes": [1000]}


def test_an_overview_tells_dwells_clipping_and_selection() -> None:
    time = np.arange(0.0, 12.0, 0.0025)
    phase = np.interp(time, [0.0, 4.25, 6.25, 12.0], [0.0, 4.25, 4.25, 10.0])
    path = 0.05 + 0.025 * np.sin(2.0 * np.pi * phase)
    force = np.minimum(Spring(MOUNT).response(path), 700.0)
    record = select(Record(path, force, time), displacement=(None, 0.07))
    reasons = overview(record).left_out
    assert set(reasons) == {"clipped", "dwells", "not selected"}
    np.testing.assert_array_equal(reasons["clipped"], np.flatnonzero(force == 700.0))
    np.testing.assert_array_equal(reasons["not selected"], np.flatnonzero(path > 0.07))
    assert time[reasons["dwells"][0]] == pytest.approx(4.25, abs=0.1)
