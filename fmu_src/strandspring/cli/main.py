"""The command `strandspring`: subcommands, exit status and the one place where refusals become messages."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper

import click
from click.shell_completion import CompletionItem

from .._version import __version__
from ..errors import Reader, StrandspringError
from ..findings import IdentificationError
from ..ground.endings import handled_endings, interrupt, status_and_sentence
from ..ground.files import readable, reason_of
from .output import drop_failing_output, result_json

# Each command is defined in a module, which is imported only to run it or to show its help; that begins with this.
COMMANDS = {
    "show": ("springs", "Show loops, strokes and cycles of records before they are identified."),
    "identify": ("springs", "Identify a spring from force-displacement records."),
    "identify-many": ("springs", "Identify many springs, each from a file of its own, into one table."),
    "plan": ("springs", "Plan the test that decides what is still open about a spring."),
    "predict": ("springs", "Predict the force of records with a model and report the errors."),
    "info": ("springs", "Show a model's parameters and loop figures, beside those of records."),
    "compare": ("springs", "Compare two springs, such as two lots, or one before and after fatigue."),
    "synthesize": ("springs", "Compute records: a spring's response, or the paper's experiment."),
    "build": ("fmus", "Build, validate and run the FMU of a model file, of records, or of a system."),
    "verify": ("fmus", "Verify that FMUs are as they were built and answer as they should."),
    "export": ("fmus", "Export a model as SSP parameter values, in an SSP system, to Modelica, or as C sources."),
    "isolate": ("systems", "Compute transmissibility and resonance of a mass on springs, or of bodies on mounts."),
    "simulate": ("systems", "Simulate bodies on mounts under shock and vibration."),
    "study": ("systems", "Run a parameter study of `isolate` for a model file, or of `simulate` for a SYSTEM.toml."),
    "docs": ("documentation", "Open the documentation."),
}


class LazyGroup(click.Group):
    """A group whose commands are imported one at a time."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        if cmd_name not in COMMANDS:
            return None
        commands = import_module(f".{COMMANDS[cmd_name][0]}", __package__)
        command: click.Command = getattr(commands, cmd_name.replace("-", "_"))
        return command

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        names = [CompletionItem(name, help=text) for name, (_, text) in COMMANDS.items() if name.startswith(incomplete)]
        return names + click.Command.shell_complete(self, ctx, incomplete)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@click.group(
    cls=LazyGroup, commands={name: click.Command(name) for name in COMMANDS},  # those to suggest
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)  # fmt: skip
@click.version_option(__version__, prog_name="strandspring")
def strandspring() -> None:
    """Identify hysteretic springs from force-displacement records and build FMUs of them.

    \b
    Examples:
      strandspring identify record.csv -o spring.json --report spring.html
      strandspring info spring.json other.csv
      strandspring build spring.json -o dist
      strandspring isolate spring.json --mass 5 --plot curves.png
      strandspring simulate box.toml --report box.html

    Exit status: 0 done; 1 the data or the model is refused, with one sentence that says why; 2 wrong usage or a
    wrong value of an option; 130 interrupted (Ctrl-C); 143 terminated; 129 terminal closed. With --json a refusal is
    a JSON object, too.

    \b
    Completion of commands, options and files, for the start-up file of the shell:
      bash: eval "$(_STRANDSPRING_COMPLETE=bash_source strandspring)"
      zsh:  eval "$(_STRANDSPRING_COMPLETE=zsh_source strandspring)"
      fish: _STRANDSPRING_COMPLETE=fish_source strandspring | source
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave the process with its exit status."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    # An option called --json, whatever stands wrong beside it; what follows -- is no option.
    as_json = "--json" in (given[: given.index("--")] if "--" in given else given)
    if sys.stdout is None:
        click.echo("strandspring: Standard output is closed; send it to a file or to /dev/null.", err=True)
        sys.exit(1)
    for stream in (sys.stdout, sys.stderr):
        # Names of files need not be text, nor does every terminal know every character.
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    # No plugins of pydantic are used, and to look for some it reads the metadata of all packages.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    status, outcome = 1, dict[str, str]()
    try:
        with handled_endings(interrupt):
            # Of sys.argv, click expands patterns of files on Windows.
            strandspring.main(None if arguments is None else given, "strandspring", standalone_mode=False)
        return
    except click.ClickException as problem:
        problem.show()
        kind, sentence, status = "UsageError", problem.format_message(), problem.exit_code
    except (click.Abort, KeyboardInterrupt) as end:
        # After an interrupt in the midst of `exec`, which dataclasses use, `python -m` would end by SIGINT whatever the
        # status, unless other code is executed so.
        exec("")  # noqa: S102
        kind, (status, sentence) = "Interrupt", status_and_sentence(end)
    except OSError as problem:
        place = "" if problem.filename is None else f"{readable(str(problem.filename))}: "
        remedy = "check the path, and the free space in the folder for temporary files (TMPDIR)"
        kind, sentence = "OSError", f"{place}{reason_of(problem)}; {remedy}."
        if problem.filename is None and drop_failing_output():
            sentence, as_json = f"Standard output cannot be written: {reason_of(problem)}; send it elsewhere.", False
    except MemoryError:
        kind = "MemoryError"
        sentence = "There is not enough memory for this; give fewer or shorter records, or fewer runs."
    except StrandspringError as refusal:
        kind, sentence = type(refusal).__name__, refusal.words(Reader.COMMAND_LINE)
        outcome = {"outcome": refusal.outcome.name.lower()} if isinstance(refusal, IdentificationError) else {}
    if kind != "UsageError":  # click has shown that
        click.echo(f"strandspring: {readable(sentence)}", err=True)
    if as_json:
        try:
            result_json({"error": {"type": kind, **outcome, "message": sentence}})
        except OSError:
            drop_failing_output()
    sys.exit(status)
