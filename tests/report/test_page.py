"""The report as a page, looked at in a browser."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from pypdf import PdfReader

import reports
from browser import chromium, opened
from strandspring import Identification
from strandspring.report.details import ReportDetails
from strandspring.report.rendering.palette import DARK, LIGHT
from strandspring.report.report_content import write_report

pytestmark = pytest.mark.long

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

DETAILS = ReportDetails(
    date=reports.HOSTILE, specimen="s" * 400, fields=((reports.HOSTILE, reports.HOSTILE),), mass=3.0
)
CASES: dict[str, tuple[Callable[[], Identification], ReportDetails]] = {
    "hinge": (reports.hinge, ReportDetails(date="2026-03-02")),
    "campaign": (reports.campaign, ReportDetails()),
    "hostile": (reports.hostile, DETAILS),
    "plain": (reports.plain, ReportDetails()),
}
# Of the hinge: all that there is; by a method without uncertainty no interval, no band, no correlations.
FIGURES = {"hinge": 19, "campaign": 19, "hostile": 19, "plain": 17}


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pages")


def page_of(folder: Path, name: str) -> Path:
    """The report of a case, written once."""
    path = folder / f"{name}.html"
    if not path.exists():
        make, details = CASES[name]
        identification = make()
        write_report(path, identification, identification.spring(name).model, details)
    return path


@pytest.mark.parametrize(
    ("name", "width", "scheme"),
    [
        ("hinge", 1300, "light"),
        ("hinge", 400, "dark"),
        ("campaign", 1300, "dark"),
        ("campaign", 400, "light"),
        ("hostile", 400, "light"),
        ("plain", 1300, "light"),
    ],
)
def test_a_page_is_drawn_whole_and_asks_for_nothing(
    browser: Browser, folder: Path, name: str, width: int, scheme: str
) -> None:
    with opened(browser, page_of(folder, name), width, scheme) as sight:
        assert sight.messages == []
        assert sight.requests == []
        assert sight.page.locator("figure").count() == FIGURES[name]
        assert sight.empty() == []
        assert sight.overlaps() == []
        assert sight.outside() == []
        assert sight.page.locator("figure:has(.plot[aria-describedby])").count() == FIGURES[name]
        assert "alert" not in sight.page.evaluate("() => [...document.scripts].map((s) => s.id).join()")
        if (name, width) == ("hinge", 1300):
            pages = PdfReader(io.BytesIO(sight.page.pdf(prefer_css_page_size=True))).pages
            assert 7 <= len(pages) <= 14
            assert "Usable: " in pages[0].extract_text()


def rgb(colour: str) -> str:
    return f"rgb({', '.join(str(int(colour[k : k + 2], 16)) for k in (1, 3, 5))})"


def colours(page: Page) -> list[str]:
    return page.evaluate(
        """() => [getComputedStyle(document.querySelector("section")).backgroundColor,
                  getComputedStyle(document.querySelector("#figure-loops .xname")).fill,
                  getComputedStyle(document.querySelector("#figure-loops .data .c-model")).stroke,
                  getComputedStyle(document.querySelector("#figure-loops .swatch.c-model")).color]"""
    )


def test_figures_follow_light_and_dark(browser: Browser, folder: Path) -> None:
    with opened(browser, page_of(folder, "plain"), 900, "dark") as sight:
        dark = colours(sight.page)
        sight.page.emulate_media(color_scheme="light")
        light = colours(sight.page)
    for scheme, palette in ((light, LIGHT), (dark, DARK)):
        assert scheme == [rgb(palette[name]) for name in ("paper", "text", "model", "model")]


def points(page: Page, figure: str) -> int:
    """Letters of the paths that are seen, about in proportion to their points."""
    return page.evaluate(
        """(key) => [...document.querySelectorAll(`#figure-${key} .data g path`)]
             .filter((path) => getComputedStyle(path.parentNode).display !== "none" && !path.closest(".panel").hidden)
             .reduce((sum, path) => sum + path.getAttribute("d").length, 0)""",
        figure,
    )


def test_records_cycles_and_lines_are_chosen(browser: Browser, folder: Path) -> None:
    with opened(browser, page_of(folder, "campaign"), 1300, "light") as sight:
        page = sight.page
        everything = points(page, "loops")
        record = page.locator("#figure-loops select").first
        assert record.locator("option").all_text_contents() == ["all records", "loop.csv", "loop.csv (2)"]
        record.select_option("1")
        one = points(page, "loops")
        assert 0 < one < 0.6 * everything
        # The choice holds for all figures, also for those of one record at a time.
        assert page.locator("#figure-force select").first.input_value() == "1"
        page.locator("#figure-loops select").nth(1).select_option("cycle 2")
        assert 0 < points(page, "loops") < 0.6 * one
        button = page.locator("#figure-loops .legend button", has_text="model")
        before = points(page, "loops")
        button.click()
        assert button.get_attribute("aria-pressed") == "false"
        assert 0 < points(page, "loops") < before
        assert sight.messages == []


def test_without_scripts_all_figures_of_all_records_are_shown(browser: Browser, folder: Path) -> None:
    with opened(browser, page_of(folder, "campaign"), 1300, "light", scripts=False) as sight:
        page = sight.page
        seen = (
            page.locator("#figure-loops, #figure-force")
            .locator(".plot")
            .evaluate_all(
                "(plots) => plots.map((plot) => plot.checkVisibility() && plot.getBoundingClientRect().height > 100)"
            )
        )
        assert seen == [True, True, True]
        assert page.locator("#figure-force .note").all_inner_texts() == ["loop.csv", "loop.csv (2)"]
        assert sight.empty() == []


def ticks(page: Page, way: str) -> dict[str, tuple[float, float]]:
    """Middles of the ticks of the loops [pixels]."""
    boxes = page.locator(f"#figure-loops g.{way} text").evaluate_all(
        """(texts) => texts.map((text) => [text.textContent, text.getBoundingClientRect()])
             .map(([text, box]) => [text, [box.x + box.width / 2, box.y + box.height / 2]])"""
    )
    return {text: tuple(middle) for text, middle in boxes}


def read_at(page: Page, x: float, y: float) -> list[float]:
    """What the readout says at a point."""
    page.mouse.move(x, y)
    words = (page.locator("#figure-loops .readout").text_content() or "").replace("−", "-").split(", ")
    assert [word.split()[1] for word in words] == ["mm", "N"]
    return [float(word.split()[0]) for word in words]


def test_a_figure_is_read_and_zoomed(browser: Browser, folder: Path) -> None:
    with opened(browser, page_of(folder, "hinge"), 1300, "light") as sight:
        page = sight.page
        page.locator("#figure-loops").scroll_into_view_if_needed()
        start = ticks(page, "x")
        for _ in range(2):
            across, up = ticks(page, "x"), ticks(page, "y")
            assert (len(across), len(up)) >= (3, 3)
            for text, (x, _) in across.items():
                for other, (_, y) in up.items():
                    # A pixel is a thousandth of the width, two thousandths of the height.
                    expected = [float(word.replace("−", "-")) for word in (text, other)]
                    assert read_at(page, x, y) == pytest.approx(expected, abs=0.03 if across == start else 0.01)
            box = page.locator("#figure-loops .plot").bounding_box()
            assert box is not None
            page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 0.3 * box["height"])
            page.mouse.down()
            page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.8 * box["height"], steps=3)
            page.mouse.up()
            assert ticks(page, "x").keys() != across.keys()
        page.mouse.dblclick(box["x"] + 50.0, box["y"] + 50.0)
        assert ticks(page, "x") == start
        assert sight.messages == []


def test_a_page_tells_no_folder_and_is_the_same_twice(folder: Path, tmp_path: Path) -> None:
    for name in ("campaign", "hostile"):
        text = page_of(folder, name).read_text(encoding="utf-8")
        assert reports.FOLDER not in text
        assert "secret" not in text
        assert len(text.encode()) < 4e5
    make, details = CASES["campaign"]
    write_report(tmp_path / "again.html", make(), make().spring("campaign").model, details)
    assert (tmp_path / "again.html").read_bytes() == page_of(folder, "campaign").read_bytes()
