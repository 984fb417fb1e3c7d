"""`strandspring docs`."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path

import click

from ..docs.site import PAGES, Reference, page_text, site, write_site
from .options import SHOWS_ALL
from .output import result


@click.command()
@click.argument("page", required=False, type=click.Choice(PAGES), metavar="[PAGE]")
@click.option(
    "-o",
    "--output",
    metavar="FOLDER",
    help="Build the site in this folder, and open nothing.",
)
@click.option("--text", is_flag=True, help="Print the page in the terminal.")
def docs(page: str | None, output: str | None, text: bool) -> None:
    """Open the documentation, which needs no network.

    \b
    Pages: overview, tutorial, gallery, limits, test-engineer,
      rig-files, findings, planning, simulation-engineer, fmu-kinds,
      tools, tool-tests, coupling, export, real-time, designer,
      clusters, systems, catalogue, system-studies, system-file,
      load-cases, python, method, identification, figures,
      figures-methods, figures-speed, figures-systems,
      troubleshooting, security, glossary

    \b
    Examples:
      strandspring docs
      strandspring docs troubleshooting --text
      strandspring docs -o site
    """
    if text:
        if output is not None:
            raise click.UsageError("--text and --output exclude each other; give one of them.")
        from rich.console import Console
        from rich.markdown import Markdown

        Console().print(Markdown(page_text(page or "overview")))
        return
    folder = site(reference()) if output is None else Path(output)
    if output is not None:
        write_site(folder, reference())
    result(f"Documentation: {folder / 'index.html'}")
    if output is None:
        name = "index" if page in (None, "overview") else page
        webbrowser.open((folder / f"{name}.html").absolute().as_uri())


def reference() -> Reference:
    """The help of all commands with their rarest options, and all public names."""
    context = click.get_current_context().find_root()
    context.meta[SHOWS_ALL] = True
    program = context.command
    assert isinstance(program, click.Group)  # noqa: S101 - this command belongs to one
    commands = {"strandspring": program.get_help(context)}
    for name in program.list_commands(context):
        command = program.get_command(context, name)
        assert command is not None  # noqa: S101 - it was listed
        below = click.Context(command, context, name)
        commands[name] = command.get_help(below)
        if isinstance(command, click.Group):
            for kind, one in command.commands.items():
                commands[f"{name} {kind}"] = one.get_help(click.Context(one, below, kind))
    package = sys.modules[__name__.partition(".")[0]]
    return Reference(commands, [name for name in vars(package)["__all__"] if not name.startswith("_")])
