"""`strandspring docs`."""

from __future__ import annotations

import webbrowser
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
    contexts = [click.get_current_context().find_root()]
    contexts[0].meta[SHOWS_ALL] = True
    for context in contexts:  # to which those of the commands below are added
        if isinstance(group := context.command, click.Group):
            below = {name: group.get_command(context, name) for name in group.list_commands(context)}
            contexts += [click.Context(command, context, name) for name, command in below.items() if command]
    helps = {context.command_path.partition(" ")[2] or "strandspring": context.get_help() for context in contexts}
    return Reference(helps, [name for name in vars(strandspring)["__all__"] if not name.startswith("_")])
