"""Pages of reports, records and simulations: looked at and used in a browser, and as documents."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import reports
from browser import chromium, opened
from strandspring import Record, bundled_record, show, simulate
from strandspring.examples.system_models import SYSTEMS
from strandspring.loops.selection import Wanted
from strandspring.report.details import ReportDetails
from strandspring.report.report_content import write_report

pytestmark = pytest.mark.long

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

HOSTILE = ReportDetails(
    date=reports.HOSTILE, specimen="s" * 400, fields=((reports.HOSTILE, reports.HOSTILE),), mass=3.0
)


def write(path: Path, make: Callable[[], reports.Identification], details: ReportDetails) -> None:
    write_report(path, make(), make().spring(path.stem).model, details)


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
# Of an identification all that there is; without uncertainty no interval, no band, no correlations.
FIGURES = {"hinge": 19, "campaign": 19, "hostile": 19, "plain": 17}


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


@pytest.mark.parametrize(
    ("name", "width", "scheme"),
    [
        ("hinge", 1300, "light"),
        ("record", 400, "dark"),
        ("box", 1300, "dark"),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in [
                ("campaign", 400, "light"),
                ("hostile", 400, "dark"),
                ("plain", 1300, "light"),
                ("hinge", 400, "dark"),
                ("record", 1300, "light"),
                ("box", 400, "light"),
            ]
        ),
    ],
)
def test_a_page_stands_whole_and_asks_for_nothing(
    browser: Browser, pages: Callable[[str], Path], name: str, width: int, scheme: str
) -> None:
    from pypdf import PdfReader

    text = pages(name).read_text(encoding="utf-8")
    assert reports.FOLDER not in text
    with opened(browser, pages(name), width, scheme) as sight:
        assert sight.faults() == []
        count = sight.page.locator("figure:has(.plot[aria-describedby])").count()
        assert count == FIGURES.get(name, sight.page.locator("figure").count()) >= 3
        assert "alert" not in sight.page.evaluate("() => [...document.scripts].map((s) => s.id).join()")
        if name == "hinge" and width == 1300:
            printed = PdfReader(io.BytesIO(sight.page.pdf(prefer_css_page_size=True))).pages
            assert 7 <= len(printed) <= 14
            assert "Usable: " in printed[0].extract_text()


def points(page: Page, figure: str) -> int:
    """Letters of the paths that are seen, about in proportion to their points."""
    return page.evaluate(
        """(key) => [...document.querySelectorAll(`#figure-${key} .data g path`)]
             .filter((path) => getComputedStyle(path.parentNode).display !== "none" && !path.closest(".panel").hidden)
             .reduce((sum, path) => sum + path.getAttribute("d").length, 0)""",
        figure,
    )


@pytest.mark.slow
def test_records_cycles_and_lines_are_chosen(browser: Browser, pages: Callable[[str], Path]) -> None:
    with opened(browser, pages("campaign"), 1300, "light") as sight:
        page = sight.page
        seen = [points(page, "loops")]
        record = page.locator("#figure-loops select").first
        assert record.locator("option").all_text_contents() == ["all records", "loop.csv", "loop.csv (2)"]
        record.select_option("1")
        seen.append(points(page, "loops"))
        # The choice holds for all figures, also for those of one record at a time.
        assert page.locator("#figure-force select").first.input_value() == "1"
        page.locator("#figure-loops select").nth(1).select_option("cycle 2")
        seen.append(points(page, "loops"))
        page.locator("#figure-loops .legend button", has_text="model").click()
        seen.append(points(page, "loops"))
        assert 0 < seen[3] < seen[2] < 0.6 * seen[1] < 0.36 * seen[0]
        assert sight.messages == []


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


def ticks(page: Page, way: str) -> dict[str, tuple[float, float]]:
    """Middles of the ticks of the loops [pixels]."""
    boxes = page.locator(f"#figure-loops g.{way} text").evaluate_all(
        """(texts) => texts.map((text) => [text.textContent, text.getBoundingClientRect()])
             .map(([text, box]) => [text, [box.x + box.width / 2, box.y + box.height / 2]])"""
    )
    return {text: tuple(middle) for text, middle in boxes}


def test_a_figure_is_read_and_zoomed(browser: Browser, pages: Callable[[str], Path]) -> None:
    with opened(browser, pages("hinge"), 1300, "light") as sight:
        page = sight.page
        page.locator("#figure-loops").scroll_into_view_if_needed()
        start = ticks(page, "x")
        for _ in range(2):
            across, up = ticks(page, "x"), ticks(page, "y")
            for text, (x, _) in across.items():
                for other, (_, y) in up.items():
                    page.mouse.move(x, y)
                    words = (page.locator("#figure-loops .readout").text_content() or "").replace("−", "-").split()
                    assert words[1::2] == ["mm,", "N"]
                    # A pixel is a thousandth of the width, two thousandths of the height.
                    expected = [float(word.replace("−", "-")) for word in (text, other)]
                    found = [float(words[0]), float(words[2])]
                    assert found == pytest.approx(expected, abs=0.03 if across == start else 0.01)
            dragged(page, "loops")
            assert ticks(page, "x").keys() != across.keys()
        box = page.locator("#figure-loops .plot").bounding_box()
        assert box is not None
        page.mouse.dblclick(box["x"] + 50.0, box["y"] + 50.0)
        assert ticks(page, "x") == start


def test_what_is_chosen_of_a_record_is_printed_as_options(browser: Browser, pages: Callable[[str], Path]) -> None:
    with opened(browser, pages("record"), 1300, "light") as sight:
        page = sight.page
        options = page.locator("#options")
        assert "no option is needed" in options.inner_text()
        page.select_option("#first-cycle", "2")
        for figure, option in (("loops", "--displacement-range"), ("displacement", "--time")):
            dragged(page, figure)
            page.wait_for_function(f"document.querySelector('#options').value.includes('{option}')")
        words = options.inner_text().split()
        assert words[:2] == ["--cycles", "2"]
        page.click("#reset")
        page.wait_for_function("document.querySelector('#options').value.includes('no option')")
    low, high = (float(end) for end in words[3].split(":"))
    record = Wanted(reverse="displacement", displacement_range=words[3]).read(bundled_record())
    assert record.compared is not None
    chosen = 1e3 * record.displacement[record.compared]
    assert low <= chosen.min() <= chosen.max() <= high


@pytest.mark.slow
def test_documents_have_the_text_and_records_without_a_spring_their_reason(tmp_path: Path) -> None:
    from pypdf import PdfReader

    details = ReportDetails(date="2 March", specimen=reports.HOSTILE, fields=(("Lot", "</x> #panic() $1$"),))
    write(tmp_path / "a.pdf", reports.hostile, details)
    found = PdfReader(tmp_path / "a.pdf").pages
    assert 6 <= len(found) <= 12
    text = "\n".join(page.extract_text() for page in found).replace("\N{ZERO WIDTH SPACE}", "")
    for words in ("Spring identification: a", "2 March", "#panic() $1$", "x$_$y.csv", "kappa_omega"):
        assert words in text
    path = np.sin(np.linspace(0.0, 20.0, 2000))
    page = show(Record(1e-3 * path, -1e3 * path, path="backwards.csv"), tmp_path / "page.html")
    assert "No spring would be identified: backwards.csv" in page.read_text(encoding="utf-8")
