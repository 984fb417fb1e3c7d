"""The page of records before they are identified, used in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from browser import chromium, opened
from strandspring import Record, bundled_record, show
from strandspring.loops.wanted import Wanted

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
