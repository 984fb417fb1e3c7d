"""`strandspring docs`."""

from __future__ import annotations

import webbrowser
from collections.abc import Iterator
from pathlib import Path
from textwrap import fill

import click

import strandspring

from ..docs.site import PAGES, Reference, page_text, site, write_site
from .options import SHOWS_ALL

_HELP = f"""Open the documentation, which needs no network.

\b
{fill(f"Pages: {', '.join(PAGES)}", 66, subsequent_indent="  ", break_on_hyphens=False)}

\b
Examples:
  strandspring docs
  strandspring docs troubleshooting --text
  strandspring docs -o site
"""


@click.command(help=_HELP)
@click.argument("page", required=False, type=click.Choice(PAGES), metavar="[PAGE]")
@click.option("-o", "--output", metavar="FOLDER", help="Build the site in this folder, and open nothing.")
@click.option("--text", is_flag=True, help="Print the page in the terminal.")
def docs(page: str | None, output: str | None, text: bool) -> None:
    """See its help."""
    if text:
        if output is not None:
            raise click.UsageError("--text and --output exclude each other; give one of them.")
        from rich.console import Console
        from rich.markdown import Markdown

        Console().print(Markdown(page_text(page or "overview")))
        return
    if output is not None:
        write_site(folder := Path(output), reference())
    else:
        folder, name = site(reference()), "index" if page in (None, "overview") else page
        webbrowser.open((folder / f"{name}.html").absolute().as_uri())
    click.echo(f"Documentation: {folder / 'index.html'}")


def reference() -> Reference:
    """The help of all commands with their rarest options, and all public names."""
    context = click.get_current_context().find_root()
    context.meta[SHOWS_ALL] = True
    public = [name for name in vars(strandspring)["__all__"] if not name.startswith("_")]
    return Reference(dict(_helps(context.command, context, [])), public)


def _helps(command: click.Command, context: click.Context, names: list[str]) -> Iterator[tuple[str, str]]:
    yield " ".join(names) or "strandspring", command.get_help(context)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            if (below := command.get_command(context, name)) is not None:
                yield from _helps(below, click.Context(below, context, name), [*names, name])
