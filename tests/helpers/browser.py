"""A headless Chromium that looks at pages: what they say, ask for and draw."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tools import program, tool

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

FAULTS = Path(__file__).with_name("browser.js").read_text(encoding="utf-8")


class Sight(NamedTuple):
    """A page, messages of the console and errors of scripts, and addresses asked for other than of the page itself."""

    page: Page
    messages: list[str]
    requests: list[str]

    def faults(self) -> list[str]:
        """All that is wrong: messages, requests, empty figures, texts that overlap, elements beyond the page."""
        found = [*self.messages, *self.requests, *self.page.evaluate(FAULTS)]
        width: int = self.page.evaluate("() => document.documentElement.scrollWidth - innerWidth")
        return found + ([f"scrolls by {width} px"] if width > 0 else [])


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser of the system."""
    sync_playwright = tool("playwright.sync_api").sync_playwright
    path = program("chromium", "chromium-browser", package="chromium fonts-dejavu-core")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@contextmanager
def opened(browser: Browser, path: Path, width: int, scheme: str) -> Iterator[Sight]:
    """A page, all of it unfolded."""
    options: Any = {"viewport": {"width": width, "height": 900}, "color_scheme": scheme, "has_touch": width < 600}
    page = browser.new_page(**options)
    sight = Sight(page, [], [])
    page.on("console", lambda message: sight.messages.append(message.text))
    page.on("pageerror", lambda error: sight.messages.append(str(error)))
    page.on("request", lambda request: sight.requests.append(request.url))
    page.goto(path.as_uri())
    sight.requests.remove(path.as_uri())
    page.evaluate("() => [...document.querySelectorAll('details')].forEach((fold) => { fold.open = true; })")
    page.wait_for_timeout(100)  # the page answers to what is opened
    yield sight
    page.close()
