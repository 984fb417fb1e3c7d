"""The option --zero: where displacement is counted from."""

from __future__ import annotations

import click

from ...api.common.model_source import origin_of as origin_of
from ...core.parameters import LARGEST_DISPLACEMENT


def given_zero(_context: click.Context, _option: click.Parameter, text: str | None) -> str | float | None:
    """The zero as `origin_of` takes it: "rig", "middle" or a displacement [m]; raises click.BadParameter."""
    if text is None or text in ("rig", "middle"):
        return text
    try:
        zero = 1e-3 * float(text)
    except ValueError:
        zero = float("nan")
    if not abs(zero) <= LARGEST_DISPLACEMENT:
        raise click.BadParameter(f"--zero must be `rig`, `middle` or a displacement of the record in mm, got {text!r}.")
    return zero


zero_option = click.option(
    "--zero",
    metavar="rig|middle|MM",
    callback=given_zero,
    help="Where displacement is counted from: the rig's zero, the middle of the identified range, or a displacement of "
    "the record [mm].  [default: as in X.fmu if that is given; else rig if it lies within the range, else middle]",
)
