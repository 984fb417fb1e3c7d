"""Pages of reports, records and simulations: looked at and used in a browser, and printed."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import reports
from browser import chromium, opened
from strandspring import Record, ReportDetails, bundled_record, show, simulate
from strandspring.examples.system_models import SYSTEMS
from strandspring.loops.reading import Reading
from tools import slow_but

pytestmark = pytest.mark.long

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

HOSTILE = ReportDetails(
    date=reports.HOSTILE, specimen="s" * 400, fields=((reports.HOSTILE, reports.HOSTILE),), mass=3.0
)


def write(path: Path, make: Callable[[], reports.Identification], details: ReportDetails) -> None:
    make().report(path, path.stem, details)


def simulation(path: Path) -> None:
    """A shock that leaves axes alone, a drop and random vibration."""
    simulate(SYSTEMS / "electronics_box.toml", ["shock +y", "drop", "transport"], draws=16).report(path)


PAGES: dict[str, Callable[[Path], object]] = {
    "hinge": lambda path: write(path, reports.hinge, ReportDetails(date="2026-03-02")),
    "campaign": lambda path: write(path, reports.campaign, ReportDetails()),
    "hostile": lambda path: write(path, reports.hostile, HOSTILE),
    "plain": lambda path: write(path, reports.plain, ReportDetails()),
    "record": lambda path: show(bundled_record(), path, reverse="displacement"),
    "box": simulation,
}
# Of an identification all that there is; without times no velocity.
FIGURES = {"hinge": 10, "campaign": 10, "hostile": 9, "plain": 10}


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The page of a name, written once."""
    folder = tmp_path_factory.mktemp("pages")

    def page(name: str) -> Path:
        path = folder / f"{name}.html"
        if not path.exists():
            PAGES[name](path)
        return path

    return page


SIGHTS = [
    "hinge 1300 light", "record 400 dark", "box 1300 dark", "campaign 400 light", "hostile 400 dark",
    "plain 1300 light", "hinge 400 dark", "record 1300 light", "box 400 light",
]  # fmt: skip


@pytest.mark.parametrize("sight", slow_but(SIGHTS, SIGHTS[:3]))
def test_a_page_stands_whole_and_asks_for_nothing(browser: Browser, pages: Callable[[str], Path], sight: str) -> None:
    from pypdf import PdfReader

    name, width, scheme = sight.split()
    assert reports.FOLDER not in pages(name).read_text(encoding="utf-8")
    with opened(browser, pages(name), int(width), scheme) as seen:
        assert seen.faults() == []
        count = seen.page.locator("figure:has(.plot[aria-labelledby])").count()
        assert count == FIGURES.get(name, seen.page.locator("figure").count()) >= 3
        assert "alert" not in seen.page.evaluate("() => [...document.scripts].map((s) => s.id).join()")
        if sight == SIGHTS[0]:
            printed = PdfReader(io.BytesIO(seen.page.pdf(prefer_css_page_size=True))).pages
            assert 4 <= len(printed) <= 10
            assert "Usable: " in printed[0].extract_text()


def dragged(page: Page, figure: str) -> None:
    """Zoom into the middle of a figure."""
    page.locator(f"#figure-{figure}").scroll_into_view_if_needed()
    box = page.locator(f"#figure-{figure} .plot").bounding_box()
    assert box is not None
    y = box["y"] + 0.5 * box["height"]
    page.mouse.move(box["x"] + 0.25 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.75 * box["width"], y + 2.0, steps=5)
    page.mouse.up()


def middle(text: Locator) -> tuple[float, float]:
    """Of a text [pixels]."""
    box = text.bounding_box() or {}
    return box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]


def test_a_figure_is_read_and_zoomed(browser: Browser, pages: Callable[[str], Path]) -> None:
    with opened(browser, pages("hinge"), 1300, "light") as sight:
        page, plot = sight.page, sight.page.locator("#figure-loops .plot")
        plot.scroll_into_view_if_needed()
        whole = plot.get_attribute("viewBox")
        across, up = (
            {words: middle(text)[way] for text in plot.locator(f"text[style*='text-anchor: {at}']").all()
             if (words := (text.text_content() or "").replace("−", "-")).strip("-.0123456789") == ""}
            for way, at in enumerate(("middle", "end"))
        )  # fmt: skip
        assert min(len(across), len(up)) > 2
        for (text, x), (other, y) in product(across.items(), up.items()):
            page.mouse.move(x, y)
            words = (page.locator("#figure-loops .readout").text_content() or "").replace("−", "-").split()
            assert words[1::2] == ["mm,", "N"]
            # A pixel is a thousandth of the width, two hundredths of the height.
            expected = [float(text), float(other)]
            assert abs(float(words[0]) - expected[0]) < 0.05
            assert abs(float(words[2]) - expected[1]) < 0.01
        dragged(page, "loops")
        assert plot.get_attribute("viewBox") != whole
        plot.dblclick(position={"x": 50.0, "y": 50.0})
        assert plot.get_attribute("viewBox") == whole


def test_a_record_is_chosen(browser: Browser, pages: Callable[[str], Path]) -> None:
    with opened(browser, pages("campaign"), 1300, "light") as sight:
        page = sight.page

        def seen(figure: str) -> list[str | None]:
            parts = page.locator(f"#figure-{figure} [data-record]").all()
            return sorted({part.get_attribute("data-record") for part in parts if part.is_visible()}, key=str)

        assert (seen("loops"), seen("force")) == (["0", "1"], ["0"])
        page.select_option("#record", "1")
        assert (seen("loops"), seen("force")) == (["1"], ["1"])
    page = browser.new_context(java_script_enabled=False).new_page()
    page.goto(pages("campaign").as_uri())
    assert page.locator("#figure-force .plot:visible").count() == 2
    assert page.locator("#figure-force .record:visible").count() == 2


def test_what_is_chosen_of_a_record_is_printed_as_options(browser: Browser, pages: Callable[[str], Path]) -> None:
    with opened(browser, pages("record"), 1300, "light") as sight:
        page, options = sight.page, sight.page.locator("#options")
        assert "no option is needed" in options.inner_text()
        page.select_option("#first-cycle", "2")
        for figure, option in (("loops", "--displacement-range"), ("displacement", "--time")):
            dragged(page, figure)
            page.wait_for_function(f"document.querySelector('#options').value.includes('{option}')")
        words = options.inner_text().split()
        assert words[:2] == ["--cycles", "2"]
    low, high = (float(end) for end in words[3].split(":"))
    record = Reading(reverse="displacement", displacement_range=words[3]).read(bundled_record())
    assert record.compared is not None
    chosen = 1e3 * record.displacement[record.compared]
    assert low <= chosen.min() <= chosen.max() <= high


def test_documents_have_the_text_and_records_without_a_spring_their_reason(
    browser: Browser, pages: Callable[[str], Path], tmp_path: Path
) -> None:
    from pypdf import PdfReader

    with opened(browser, pages("hostile"), 1300, "dark") as sight:
        sight.page.emulate_media(media="print")
        assert not sight.page.locator("select:visible, nav:visible").count()
        found = PdfReader(io.BytesIO(sight.page.pdf(prefer_css_page_size=True))).pages
    text = "\n".join(page.extract_text() for page in found)
    assert {"x$_$y.csv", "kappa_omega", "Approved:"} <= set(text.split())
    path = np.sin(np.linspace(0.0, 20.0, 2000))
    page = show(Record(1e-3 * path, -1e3 * path, path="backwards.csv"), tmp_path / "page.html")
    assert "No spring would be identified: backwards.csv" in page.read_text(encoding="utf-8")
