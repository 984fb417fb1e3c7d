"""`strandspring docs`."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import click

from ..._version import __version__
from ...docs.site import PAGES, page_text, write_site
from ...ground.files import user_cache
from ..shared.output import result
from ..shared.paths import refuse_overwriting


@click.command()
@click.argument("page", required=False, type=click.Choice(PAGES), metavar="[PAGE]")
@click.option(
    "-o",
    "--output",
    metavar="FILE.html",
    help="Write the documentation to this file, and open nothing.",
)
@click.option("--text", is_flag=True, help="Print the page in the terminal.")
def docs(page: str | None, output: str | None, text: bool) -> None:
    """Open the documentation, which needs no network.

    \b
    Pages: overview, test-engineer, simulation-engineer, tools, real-time,
      designer, systems, system-file, python, limits, troubleshooting,
      security, method, figures

    \b
    Examples:
      strandspring docs
      strandspring docs troubleshooting --text
      strandspring docs -o strandspring.html
    """
    if text:
        if output is not None:
            raise click.UsageError("--text and --output exclude each other; give one of them.")
        from rich.console import Console
        from rich.markdown import Markdown

        Console().print(Markdown(page_text(page or "overview")))
        return
    refuse_overwriting((), {"--output": output}, ".html")
    path = user_cache() / f"strandspring-{__version__}.html" if output is None else Path(output)
    write_site(path)
    result(f"Documentation: {path}")
    if output is None:
        webbrowser.open(f"{path.as_uri()}#{page or 'overview'}")
