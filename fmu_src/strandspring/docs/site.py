"""The documentation as one HTML page that opens offline, made of the Markdown pages in this folder."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from .._version import __version__
from ..errors import StrandspringError
from ..ground.files import write_text

# In the order in which they are read.
PAGES = (
    "overview", "test-engineer", "simulation-engineer", "tools", "real-time", "designer", "systems", "system-file",
    "python", "limits", "troubleshooting", "security", "method", "figures",
)  # fmt: skip


def page_text(name: str) -> str:
    """The Markdown of a page.

    Raises
    ------
    StrandspringError   If there is no such page.

    Examples
    --------
    >>> page_text("limits").splitlines()[0]
    '# When not to use it'
    """
    if name not in PAGES:
        raise StrandspringError(f"There is no page {name!r}; give one of {', '.join(PAGES)}.")
    return (files(__package__) / "pages" / f"{name}.md").read_text(encoding="utf-8")


def write_site(path: Path) -> None:
    """Write all pages as one HTML file; the same version gives the same bytes.

    Raises
    ------
    StrandspringError   If the file cannot be written.
    """
    environment = Environment(loader=PackageLoader("strandspring", "docs"), autoescape=True, undefined=StrictUndefined)
    pages = [(name, *_rendered(name)) for name in PAGES]
    write_text(path, environment.get_template("site.html.j2").render(pages=pages, version=__version__))


def _rendered(name: str) -> tuple[str, Markup]:
    """Title and HTML of a page, with links to other pages as links within the file."""
    text = page_text(name)
    title = text.splitlines()[0].removeprefix("# ").split(":")[0]
    linked = re.sub(r"\]\(([a-z-]+)\.md\)", r"](#\1)", text)
    html = MarkdownIt("commonmark", {"html": False}).enable("table").render(linked)
    html = html.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
    return title, Markup(html)  # noqa: S704 - raw HTML is off
