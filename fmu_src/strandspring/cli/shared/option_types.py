"""Types of options, and options of most commands; nothing here waits for what records and identification need."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import click

from ...errors import StrandspringError
from ...model.names import check_name
from .output import verbose_option


class FiniteRange(click.FloatRange):
    """A range in a unit that refuses NaN and infinity, which `click.FloatRange` accepts; values are times `factor`."""

    def __init__(
        self,
        min: float | None = None,  # noqa: A002 - named as in `click.FloatRange`
        max: float | None = None,  # noqa: A002
        min_open: bool = False,
        unit: str = "",
        factor: float = 1.0,
    ) -> None:
        super().__init__(min, max, min_open)
        self.unit, self.factor = unit, factor

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            number = float(super().convert(value, param, ctx))
        except click.BadParameter:
            number = math.nan
        if not math.isfinite(number):
            self.fail(f"must be {self.allowed}, got {value}.", param, ctx)
        return self.factor * number

    def _describe_range(self) -> str:
        """The range for the help, where `click.FloatRange` says "x<=None" without bounds."""
        return "finite" if self.min is None and self.max is None else super()._describe_range()

    @property
    def allowed(self) -> str:
        """The accepted values in words."""
        low = "" if self.min is None else f" {'>' if self.min_open else '>='} {self.min:g}"
        high = "" if self.max is None else f" <= {self.max:g}"
        return f"a finite number{low}{' and' if low and high else ''}{high}" + (f" [{self.unit}]" if self.unit else "")


def positive(unit: str, factor: float = 1.0) -> FiniteRange:
    """Type of an option: a number above 0 in a unit, with the factor to SI."""
    return FiniteRange(min=0.0, min_open=True, unit=unit, factor=factor)


@contextmanager
def values_as_usage() -> Iterator[None]:
    """Make a ValueError one of usage, but for refusals of data and models."""
    try:
        yield
    except StrandspringError:
        raise
    except ValueError as problem:
        raise click.UsageError(str(problem)) from None


Command = TypeVar("Command", bound=Callable[..., Any])


def together(*options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Several options as one decorator, which the help shows in this order."""

    def decorate(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
# Of commands that print less than all they know.
output_options = together(verbose_option, json_option)


def checked_by(check: Callable[[Any], Any]) -> Callable[[click.Context, click.Parameter, Any], Any]:
    """Callback of an option: what a check makes of its value, None for None; a refusal is wrong usage."""

    def checked(_context: click.Context, _option: click.Parameter, value: Any) -> Any:
        try:
            return None if value is None else check(value)
        except StrandspringError as refusal:
            raise click.BadParameter(str(refusal)) from None

    return checked


def name_option(text: str) -> Callable[[Command], Command]:
    """The name of a model, with its help."""
    return click.option("--name", callback=checked_by(check_name), help=text)


def loop_amplitudes(about: str, default: str) -> Callable[[Command], Command]:
    """Amplitudes of loops about some displacement [m], with what they are by default."""
    return click.option(
        "--amplitude", "amplitudes", type=FiniteRange(1e-6, 1e6, unit="mm", factor=1e-3), multiple=True, metavar="MM",
        help=f"Amplitude of a loop about the {about} [mm]; repeat for more.  [default: {default}]",
    )  # fmt: skip
