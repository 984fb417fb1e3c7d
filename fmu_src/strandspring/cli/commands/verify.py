"""`strandspring verify`."""

from __future__ import annotations

import sys
from dataclasses import replace

import click

from ...api.common.text import counted
from ...api.fmus.verifying import verify as verified
from ...ground.files import readable
from ..shared.option_types import json_option
from ..shared.output import present, refusal, working


@click.command()
@click.argument("fmus", nargs=-1, required=True, metavar="X.fmu...")
@json_option
def verify(fmus: tuple[str, ...], as_json: bool) -> None:
    """Verify FMUs on this computer.

    Compares every file with the hash that was written when the FMU was built, the model description with FMI's rules,
    and co-simulation and model exchange with the reference result that the FMU carries. An FMU with a changed file is
    not run, except for binaries that were added to or compiled anew from the sources of the same FMU: they are named
    and run. The hashes show damage, not who built it: run FMUs of people you trust only.

    \b
    Examples:
      strandspring verify dist/spring.fmu
      strandspring verify dist/*.fmu --json
    """
    verifications = []
    for fmu in fmus:
        with working(f"Verifying {fmu}"):
            verifications.append(verified(fmu))
    problems = [(verification.path, check) for verification in verifications for check in verification.problems]
    fmu, first = problems[0] if problems else ("", None)
    # The first problem is the refusal, and is said once.
    others = [replace(one, checks=tuple(each for each in one.checks if each is not first)) for one in verifications]
    present(
        as_json,
        lambda: {"fmus": [verification.as_json() for verification in verifications]},
        lambda width: [line for verification in others for line in verification.text_lines(width)],
    )
    if first is not None:
        more = f" It has {counted(len(problems) - 1, 'more problem')}." if len(problems) > 1 else ""
        refusal(readable(f"strandspring: {fmu} must not be used: {first.text}{more}"))
        sys.exit(1)
