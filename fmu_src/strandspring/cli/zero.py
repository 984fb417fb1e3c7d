"""The option --zero: where displacement is counted from."""

from __future__ import annotations

from pathlib import Path

import click

from ..coordinates import chosen_zero
from ..core.parameters import SpringParameters
from ..modelfile import is_fmu

zero_option = click.option(
    "--zero",
    metavar="rig|middle|MM",
    help="Where displacement is counted from: the rig's zero, the middle of the identified range, or a displacement of "
    "the record [mm].  [default: as in X.fmu if that is given; else rig if it lies within the range, else middle]",
)


def origin_of(source: str | Path, choice: str | None, parameters: SpringParameters) -> float:
    """The zero [m] that the option chooses, by default that of an FMU from which the model file is read."""
    if choice is None and is_fmu(source):
        from ..fmu.papers import BuildSettings

        return BuildSettings.of_fmu(Path(source)).zero
    return chosen_zero(choice, parameters)
