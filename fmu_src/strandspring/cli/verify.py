"""`strandspring verify`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from ..errors import BuildError
from ..fmu.verification import verify_fmu
from .output import result, result_json, working


@click.command()
@click.argument("fmus", nargs=-1, required=True, metavar="X.fmu...")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def verify(fmus: tuple[str, ...], as_json: bool) -> None:
    """Verify FMUs on this computer.

    Compares every file with the hash that was written when the FMU was built, the model description with FMI's rules,
    and co-simulation and model exchange with the reference result that the FMU carries. An FMU with a changed file is
    not run. The hashes show damage, not who built it: run FMUs of people you trust only.

    \b
    Examples:
      strandspring verify dist/spring.fmu
      strandspring verify dist/*.fmu --json
    """
    found = {}
    for fmu in fmus:
        with working("Verifying"):
            found[fmu] = verify_fmu(Path(fmu))
    if as_json:
        result_json({"fmus": [{"path": fmu, "findings": list(map(asdict, each))} for fmu, each in found.items()]})
    else:
        for fmu, each in found.items():
            result(fmu)
            for finding in each:
                result(f"  {finding.about}: {finding.text}")
    problems = [(fmu, finding) for fmu, each in found.items() for finding in each if finding.is_problem]
    if problems:
        fmu, first = problems[0]
        more = f" ({len(problems) - 1} more)" if len(problems) > 1 else ""
        raise BuildError(f"{fmu} must not be used: {first.text}{more}")
