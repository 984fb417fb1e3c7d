"""The option --zero: where displacement is counted from."""

from __future__ import annotations

import click

from ...api.common.placing import origin_of as origin_of
from ...errors import StrandspringError
from ...model.coordinates import given_zero


def _given(_context: click.Context, _option: click.Parameter, text: str | None) -> str | float | None:
    try:
        return None if text is None else given_zero(text)
    except StrandspringError as refusal:
        raise click.BadParameter(str(refusal)) from None


zero_option = click.option(
    "--zero",
    metavar="rig|middle|MM",
    callback=_given,
    help="Where displacement is counted from: the rig's zero, the middle of the identified range, or a displacement of "
    "the record [mm].  [default: as in X.fmu if that is given; else rig if it lies within the range, else middle]",
)
