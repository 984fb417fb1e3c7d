"""Options of commands, made of what options objects say of their fields, in groups; the rarest are shown by --help-all.

Nothing here waits for what records and identification need.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from ...api.options import METHODS, Fitting
from ...campaigns.jobs.options import Cluster, Workers
from ...core.parameters import LARGEST_DISPLACEMENT
from ...errors import OptionError, Reader, StrandspringError, flag_of
from ...ground.options import Option, options_of
from ...loops.reading import Reading, entries
from ...loops.windows import is_window
from ...model.names import check_name
from .output import progress, remark_on, verbose_option
from .paths import PLOT_FILE, OutputFile

if TYPE_CHECKING:
    from ...records.record import Record

Decorator = Callable[[Any], Any]

SHOWS_ALL = "strandspring.shows_all"  # key of click's context
_OUTPUT = "Output"  # the group of options that have none
_WINDOW = (
    ". Numbers as in 2.5:60, 2.5: or :60 are a window instead, to which the record is cut [s]; give the option twice "
    "for both"
)


class GroupedOption(click.Option):
    """An option of a group in the help, perhaps a rare one."""

    def __init__(self, *arguments: Any, group: str = _OUTPUT, is_rare: bool = False, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self.group, self.is_rare = group, is_rare

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """What the help shows; nothing of a rare option unless all are asked for."""
        return None if self.is_rare and not ctx.meta.get(SHOWS_ALL) else super().get_help_record(ctx)


class OptionsCommand(click.Command):
    """A command whose help shows its options in groups, and to which options that do not apply are wrong usage."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """The options, and --help-all if there are rare ones."""
        params = super().get_params(ctx)
        if any(getattr(param, "is_rare", False) for param in params):
            settings: Any = {"is_flag": True, "expose_value": False, "is_eager": True, "callback": _show_all}
            params.insert(-1, click.Option(["--help-all"], help="Show the rarest options, too.", **settings))
        return params

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options, one group after the other."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option) and (record := param.get_help_record(ctx)) is not None:
                groups.setdefault(getattr(param, "group", _OUTPUT), []).append(record)
        groups[_OUTPUT] = groups.pop(_OUTPUT)  # comes last
        for name, records in groups.items():
            with formatter.section(f"{name} options" if len(groups) > 1 else "Options"):
                formatter.write_dl(records)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except OptionError as refusal:
            raise click.UsageError(_words(refusal)) from None


def _show_all(context: click.Context, _option: click.Parameter, is_asked: bool) -> None:
    if is_asked and not context.resilient_parsing:
        context.meta[SHOWS_ALL] = True
        click.echo(context.get_help())
        context.exit()


def _words(problem: Exception) -> str:
    return problem.words(Reader.COMMAND_LINE) if isinstance(problem, StrandspringError) else str(problem)


class Written(click.types.StringParamType):
    """The value of a field as people write it."""

    def __init__(self, said: Option) -> None:
        self.said = said

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return self.said.read(value)
        except ValueError as refusal:
            self.fail(_words(refusal), param, ctx)


def written(metavar: str, text: str, flags: str = "-o --output", is_required: bool = False) -> Decorator:
    """A file to write, whose name gets the ending of the metavar."""
    kind = OutputFile(f".{metavar.partition('.')[2]}")
    return given(*flags.split(), type=kind, metavar=metavar, required=is_required, help=text)


def plot_option(text: str) -> Decorator:
    """A plot to write."""
    return given("--plot", type=PLOT_FILE, metavar="FILE.png", help=f"{text} (.png, .svg or .pdf).")


def given(*flags: str, group: str = _OUTPUT, **more: Any) -> Decorator:
    """An option of a command alone."""
    return click.option(*flags, cls=GroupedOption, group=group, **more)


def option_of(name: str, said: Option, default: Any = None, group: str = "", owner: str = "") -> Decorator:
    """The option of a field; without it the command gets None, and the object its default."""
    is_flag, several = said.kind == "flag", said.kind in ("numbers", "texts")
    types = {"flag": bool, "choice": click.Choice(said.choices), "whole": click.IntRange(said.least, said.most)}  # type: ignore[arg-type]
    kind: Any = (float, float) if said.kind == "limits" and said.parse is None else types.get(said.kind, Written(said))
    unit = said.shown or said.unit
    text = f"{said.help}{f' [{unit}]' if unit else ''}{f' ({owner})' if owner else ''}"
    if several:
        text += "; repeat, or give LOW:HIGH:COUNT, for more" if said.kind == "numbers" else "; repeat for more"
    if shown := said.otherwise or _shown(said, default):
        text += f"{'' if text.endswith('.') else '.'}  [default: {shown}]"
    return given(
        flag_of(said.flag or name), name, group=said.group or group, is_rare=said.rare, type=kind, is_flag=is_flag,
        default=None, multiple=several, metavar=said.metavar or None, callback=_callback(said),
        help=text if text.endswith(("]", ".")) else f"{text}.",
    )  # fmt: skip


def _shown(said: Option, default: Any) -> str:
    """A default for people; nothing where it is the absence of something."""
    if not default or default == math.inf:
        return ""
    if isinstance(default, tuple):
        return ",".join(f"{value:g}" for value in default)
    return f"{default / said.factor:g}" if isinstance(default, float) else str(default)


def _callback(said: Option) -> Callable[[click.Context, click.Parameter, Any], Any]:
    def joined(_context: click.Context, _option: click.Parameter, value: Any) -> Any:
        """The values of an option that is repeated, None of none; limits are checked."""
        if value is None or value == ():
            return None
        if said.kind == "limits" and said.checks is not None:
            return checked_by(said.checks)(_context, _option, value)
        return tuple(number for numbers in value for number in numbers) if said.kind == "numbers" else value

    return joined


def checked_by(check: Callable[[Any], Any]) -> Callable[[click.Context, click.Parameter, Any], Any]:
    """Callback of an option: what a check makes of its value, None for None; a refusal is wrong usage."""

    def checked(_context: click.Context, _option: click.Parameter, value: Any) -> Any:
        try:
            return None if value is None else check(value)
        except ValueError as refusal:
            raise click.BadParameter(_words(refusal)) from None

    return checked


def takes_options(**objects: Any) -> Decorator:
    """Give a command objects of options, made of the options of their fields.

    Parameters
    ----------
    **objects    By argument of the command its class, or an object with the defaults of the command.
    """
    defaults = {name: kind() if isinstance(kind, type) else kind for name, kind in objects.items()}

    def decorate(command: Any) -> Any:
        @wraps(command)
        def call(*arguments: Any, **values: Any) -> Any:
            made = {name: _made(default, values) for name, default in defaults.items()}
            return command(*arguments, **values, **made)

        return together(*(option for default in defaults.values() for option in _of_object(default)))(call)

    return decorate


def together(*options: Decorator) -> Decorator:
    """Several options as one decorator, which the help shows in this order."""

    def decorate(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def _of_object(default: Any) -> Iterable[Decorator]:
    """The options of an object; of an identification also those of all methods, of workers those of a cluster."""
    for name, said in options_of(default).items():
        if isinstance(default, Reading) and name in ("time", "reverse"):
            # Two columns cannot be one, and --time is a column or a window, or both.
            kind = click.Choice(said.choices) if said.choices else str
            text = f"{said.help}{_WINDOW if name == 'time' else ''}."
            yield given(f"--{name}", group=default.group, type=kind, multiple=True, metavar=said.metavar or None,
                        callback=_columns, help=text)  # fmt: skip
        elif said.flag != "":
            yield option_of(name, said, getattr(default, name), default.group)
    if isinstance(default, Workers):
        yield from _of_object(Cluster(""))
    if isinstance(default, Fitting):
        for name, method in {name: each for each in reversed(METHODS.values()) for name in options_of(each)}.items():
            owner = "" if name == "degrees" else f"method {method.name}"
            yield option_of(name, options_of(method)[name], getattr(method, name), Fitting.group, owner)


def _columns(_context: click.Context, option: click.Parameter, values: tuple[str, ...]) -> Any:
    """One column of --reverse; column and window of --time."""
    windows = [value for value in dict.fromkeys(values) if option.name == "time" and is_window(value)]
    columns = [value for value in dict.fromkeys(values) if value not in windows]
    for named, what in ((columns, "column"), (windows, "window FROM:TO")):
        if len(named) > 1:
            raise click.BadParameter(f"must be one {what}, got {' and '.join(named)}.")
    column, window = (next(iter(named), None) for named in (columns, windows))
    return column if option.name == "reverse" else (column, window)


def _made(default: Any, values: dict[str, Any]) -> Any:
    """Take the options of an object out of a command's, and make it of those that are given."""
    chosen = {name: values.pop(name) for name in options_of(default) if name in values}
    try:
        if isinstance(default, Fitting):
            chosen |= _method(chosen, values)
        elif isinstance(default, Workers):
            chosen["scheduler"] = _cluster(chosen["scheduler"], values)
        elif isinstance(default, Reading):
            chosen["time"], chosen["time_window"] = chosen["time"]
        return replace(default, **{name: value for name, value in chosen.items() if _is_given(value)})
    except (TypeError, ValueError) as problem:
        raise click.UsageError(_words(problem)) from None


def _is_given(value: Any) -> bool:
    """Whether an option is on the command line; 0 is a value."""
    return value is not None and value is not False and value != ()


def _method(chosen: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """The method that is chosen with its options, in place of its name."""
    method = METHODS[chosen.pop("method", None) or "refined"]
    owners = {name: other.name for other in METHODS.values() for name in options_of(other)}
    named = {name: value for name in owners if _is_given(value := values.pop(name, None))}
    for name in named:
        if name not in options_of(method):
            raise click.UsageError(f"{flag_of(name)} belongs to --method {owners[name]}.")
    return {"method": None, "options": method(**named)}


def _cluster(address: str | None, values: dict[str, Any]) -> Cluster | None:
    """The cluster of an address with its certificates."""
    named = {name: value for name in options_of(Cluster) if (value := values.pop(name)) is not None}
    if address is not None:
        return Cluster(address, **named)
    if named.keys() - {"patience"}:
        raise click.UsageError("Certificates are for a scheduler; add --scheduler tls://HOST:PORT.")
    return None


json_option: Decorator = given("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
# Of commands that print less than all they know.
output_options: Decorator = together(verbose_option, json_option)


def name_option(text: str) -> Decorator:
    """The name of a model, with its help."""
    return given("--name", callback=checked_by(check_name), help=text)


def amplitudes_option(text: str, otherwise: str) -> Decorator:
    """Amplitudes of loops [m]."""
    said = Option("numbers", text, "m", "mm", 1e-3, least=0.0, is_open=True, otherwise=otherwise, metavar="MM")
    return option_of("amplitudes", said, group="Loop")


def mass_option(text: str, group: str = "Mount", several: bool = False) -> Decorator:
    """A mass [kg], or several."""
    said = Option("numbers" if several else "number", text, "kg", least=0.0, is_open=True, metavar="KG")
    return option_of("mass", said, group=group)


def _given_zero(text: str) -> str | float:
    """The zero as `origin_of` takes it: "rig", "middle" or a displacement [m]."""
    if text in ("rig", "middle"):
        return text
    try:
        zero = 1e-3 * float(text)
    except ValueError:
        zero = math.nan
    if not abs(zero) <= LARGEST_DISPLACEMENT:
        raise ValueError(f"--zero must be `rig`, `middle` or a displacement of the record in mm, got {text!r}.")
    return zero


zero_option: Decorator = given(
    "--zero", metavar="rig|middle|MM", callback=checked_by(_given_zero), group="Model",
    help="Where displacement is counted from: the rig's zero, the middle of the identified range, or a displacement of "
    "the record [mm].  [default: as in X.fmu if that is given; else rig if it lies within the range, else middle]",
)  # fmt: skip


def read_records(paths: Sequence[str], reading: Reading) -> list[Record]:
    """Read records and description files with a progress bar, and report what was assumed."""
    if not paths and reading != Reading():
        raise click.UsageError("Columns, units and selections are those of records, and none is given; give a record.")
    records = [of_file.read(path) for path, of_file in progress(entries(paths, reading), "Reading records")]
    remark_on(finding for record in records for finding in record.found)
    return records


def record_files(paths: Sequence[str]) -> list[str]:
    """The files that are read: those given, and those that description files among them name."""
    return [*paths, *(path for path, _ in entries(paths))]


def refuse_reading(reading: Reading, needed: str, reason: str, **others: Any) -> None:
    """Refuse options of records, and others, that say nothing about what is given."""
    named = {name: value for name, value in others.items() if _is_given(value)} | reading.given
    if named:
        raise click.UsageError(f"{', '.join(map(flag_of, named))} can only be given with {needed}, and {reason}.")
