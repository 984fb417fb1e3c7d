"""The command `strandspring`: subcommands, exit status and the one place where refusals become messages."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import click

from .._version import __version__
from ..errors import StrandspringError
from .build import build
from .export import export
from .identify import identify
from .info import info
from .isolate import isolate
from .output import drop_failing_output
from .predict import predict
from .study import study
from .synthesize import synthesize


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="strandspring")
def strandspring() -> None:
    """Identify hysteretic springs from force-displacement records and build FMUs of them.

    \b
    Examples:
      strandspring identify record.csv -o spring.json --report spring.html
      strandspring predict spring.json other.csv -o predicted.csv
      strandspring info spring.json other.csv
      strandspring build spring.json -o dist
      strandspring export spring.json --ssv --modelica
      strandspring isolate spring.json --mass 5 --plot curves.png
      strandspring study spring.json --mass 4:8:5 --base-displacement 0.5 -o study.csv
      strandspring synthesize spring spring.json --amplitude 20 -o synthetic.csv

    Exit status: 0 done; 1 the data or the model is refused, with one sentence that says why; 2 wrong usage.
    """


for command in (identify, predict, info, synthesize, build, export, isolate, study):
    strandspring.add_command(command)


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
