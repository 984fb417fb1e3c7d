"""The command `strandspring`: subcommands, exit status and the one place where refusals become messages."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module

import click

from .._version import __version__
from ..errors import StrandspringError
from .output import drop_failing_output

# Each command is defined in the module of its name, which is imported only to run it or to show its help.
COMMANDS = {
    "identify": "Identify a spring from force-displacement records.",
    "identify-many": "Identify many springs, each from a file of its own, into one table.",
    "predict": "Predict the force of records with a model and report the errors.",
    "info": "Show a model's parameters and loop figures, beside those of records.",
    "compare": "Compare two springs, such as before and after fatigue, by the uncertainty of both.",
    "synthesize": "Compute records: a spring's response, or the paper's experiment.",
    "build": "Build, validate and run the FMU of a model file or of records.",
    "verify": "Verify that FMUs are as they were built and answer as they should.",
    "export": "Export a model's parameters as SSP parameter values, or into a Modelica library.",
    "isolate": "Compute transmissibility and resonance of a mass on the spring.",
    "docs": "Open the documentation.",
    "study": "Run a parameter study of resonance and isolation.",
}


class LazyGroup(click.Group):
    """A group whose commands are imported one at a time."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        if cmd_name not in COMMANDS:
            return None
        name = cmd_name.replace("-", "_")
        command: click.Command = getattr(import_module(f".{name}", __package__), name)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="strandspring")
def strandspring() -> None:
    """Identify hysteretic springs from force-displacement records and build FMUs of them.

    \b
    Examples:
      strandspring identify record.csv -o spring.json --report spring.html
      strandspring identify-many records/ -o models
      strandspring predict spring.json other.csv -o predicted.csv
      strandspring info spring.json other.csv
      strandspring compare new.json worn.json --plot difference.png
      strandspring build spring.json -o dist
      strandspring verify dist/spring.fmu
      strandspring export spring.json --ssv --modelica
      strandspring isolate spring.json --mass 5 --plot curves.png
      strandspring study spring.json --mass 4:8:5 --base-displacement 0.5 -o study.csv
      strandspring synthesize spring spring.json --amplitude 20 -o synthetic.csv

    Exit status: 0 done; 1 the data or the model is refused, with one sentence that says why; 2 wrong usage.
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave the process with its exit status."""
    try:
        strandspring.main(args=None if arguments is None else list(arguments), standalone_mode=False)
    except click.exceptions.Exit as leaving:
        sys.exit(leaving.exit_code)
    except click.ClickException as problem:
        problem.show()
        sys.exit(problem.exit_code)
    except (click.Abort, KeyboardInterrupt):
        click.echo("strandspring: interrupted; no output file was changed.", err=True)
        sys.exit(1)
    except OSError as problem:
        if not drop_failing_output():
            raise
        click.echo(f"strandspring: Standard output cannot be written: {problem.strerror}; send it elsewhere.", err=True)
        sys.exit(1)
    except StrandspringError as refusal:
        click.echo(f"strandspring: {refusal}", err=True)
        sys.exit(1)
