"""The report of a simulation, used in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from browser import chromium, opened
from strandspring import simulate
from strandspring.examples import systems
from strandspring.report.simulation_page import write_simulation

pytestmark = pytest.mark.long

if TYPE_CHECKING:
    from playwright.sync_api import Browser

BOX = Path(systems.__path__[0]) / "electronics_box.toml"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of a shock that leaves axes alone, a drop and random vibration."""
    folder = tmp_path_factory.mktemp("pages")
    simulate(BOX, ["shock +y", "drop", "transport"], draws=16).report(folder / "box.html")
    return folder


@pytest.mark.parametrize(("width", "scheme"), [(1300, "light"), (1300, "dark"), (400, "dark")])
def test_everything_is_drawn_and_nothing_overlaps(browser: Browser, folder: Path, width: int, scheme: str) -> None:
    with opened(browser, folder / "box.html", width, scheme) as sight:
        assert (sight.messages, sight.requests, sight.empty(), sight.overlaps(), sight.outside()) == (
            [], [], [], [], [],
        )  # fmt: skip


def test_histories_are_those_of_the_case_that_is_chosen(browser: Browser, folder: Path) -> None:
    with opened(browser, folder / "box.html", 1300, "light") as sight:
        page = sight.page
        choice = page.locator("#figure-history-acceleration [data-choice=record]")
        names = choice.locator("option").all_inner_texts()
        verdicts = {"standard, shock +y": "not decided", "softer, shock +y": "fail"}
        assert names == [
            f"{name}: {verdicts.get(name, 'pass')}"
            for candidate in ("standard", "softer")
            for name in (f"{candidate}, shock +y", f"{candidate}, drop", f"{candidate}, transport")
        ]
        legend = page.locator("#figure-history-acceleration .panel:not([hidden]) .legend")
        assert "limit 15 g" in legend.inner_text()
        choice.select_option("softer, transport: pass")
        # The others follow.
        assert page.locator("#figure-loops [data-choice=record]").input_value() == choice.input_value()
        # Spectra are those of the kind of case: none of shock for a vibration.
        shock = page.locator("#figure-shock-spectra select option").all_inner_texts()
        power = page.locator("#figure-power-spectra select option").all_inner_texts()
        assert (len(shock), len(power)) == (4, 2)


def test_the_report_says_verdicts_cautions_and_errors(browser: Browser, folder: Path) -> None:
    with opened(browser, folder / "box.html", 1300, "light") as sight:
        text = sight.page.locator("main").inner_text()
    for expected in ("Not decided: standard. No limit is known", "Static pose", "Natural modes of softer",
                     "several axes slide at once", "energy exchanged [J]", "draws beyond a limit",
                     "half-sine of 18 g, 11 ms along +y", "Root mean squares"):  # fmt: skip
        assert expected in text, expected


def test_all_answers_stand_beside_their_limits_and_the_drawing_names_their_loads(
    browser: Browser, folder: Path
) -> None:
    with opened(browser, folder / "box.html", 1300, "light") as sight:
        texts, legend = (
            sight.page.locator(f"#figure-{figure} {part}").all_text_contents()
            for figure, part in (("limits", "svg text"), ("limits", ".legend button"))
        )
        drawn = sight.page.locator("#figure-system-front svg text").all_text_contents()
    for candidate in ("standard", "softer"):
        for case in ("shock +y", "drop", "transport"):
            assert f"{candidate}, {case}" in texts
    assert legend == ["acceleration", "sway", "tilt", "stroke", "limit"]
    assert {"drop, transport", "circuit board"} <= set(drawn)


def test_the_sheet_shows_verdicts_and_what_decides() -> None:
    """All marks are within the drawn limits; sway decides, which is not drawn."""
    found = simulate(BOX, ["shock +y", "drop"], draws=16, workers=1)
    axes = found.plot()
    texts = sorted(text.get_text().partition(" %")[0].rpartition(" ")[0] for text in axes.texts)
    assert texts == ["drop: sway", "drop: sway", "shock +y: fail, sway", "shock +y: not decided, sway"]
    crosses = [line for line in axes.lines if line.get_marker() == "X" for _ in line.get_xdata()]
    assert len(crosses) == sum(answer.verdict.value != "pass" for answer in found.answers) == 2
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    for candidate, verdict in found.verdicts()["all cases"].items():
        (name,) = (name for name in names if name.startswith(f"{candidate}: {verdict}, sway 1"))
        assert name.endswith("% of its limit in shock +y")


def test_a_report_is_the_same_twice_and_can_be_a_pdf(folder: Path, tmp_path: Path) -> None:
    simulate(BOX, ["shock +y", "drop", "transport"], draws=16, workers=1).report(tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == (folder / "box.html").read_bytes()
    simulate(BOX, "drop", "standard").report(tmp_path / "box.pdf")
    assert (tmp_path / "box.pdf").read_bytes().startswith(b"%PDF")


def test_a_page_of_many_answers_stays_small(tmp_path: Path) -> None:
    few = simulate(BOX, ["shock +y", "drop"], draws=16, workers=1)
    write_simulation(tmp_path / "many.html", "box", "", "box.toml", few.candidates, few.answers * 20)
    page = (tmp_path / "many.html").read_text(encoding="utf-8")
    assert len(page.encode()) < 2e6
    assert "Histories are left out of 40 of 80 answers." in page
