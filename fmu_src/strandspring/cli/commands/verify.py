"""`strandspring verify`."""

from __future__ import annotations

import sys
from dataclasses import asdict

import click

from ...api.common.text import counted
from ...api.fmus.verifying import verify as verified
from ...ground.files import readable
from ..shared.output import note, result_json, result_lines, working


@click.command()
@click.argument("fmus", nargs=-1, required=True, metavar="X.fmu...")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
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
    if as_json:
        result_json(
            {
                "fmus": [
                    {"path": verification.path, "findings": list(map(asdict, verification.findings))}
                    for verification in verifications
                ]
            }
        )
    else:
        for verification in verifications:
            result_lines(verification)
    problems = [(verification.path, finding) for verification in verifications for finding in verification.problems]
    if problems:
        fmu, first = problems[0]
        more = f" It has {counted(len(problems) - 1, 'more problem')}." if len(problems) > 1 else ""
        note(readable(f"strandspring: {fmu} must not be used: {first.text}{more}"))
        sys.exit(1)
