"""Options of commands, made of what options objects say of their fields, in groups; the rarest are shown by --help-all.

Nothing here waits for what records and identification need.
"""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from ..core.parameters import LARGEST_DISPLACEMENT
from ..errors import OptionError, Reader, StrandspringError, flag_of
from ..ground.options import Option, options_of, refuse_given
from ..loops.reading import Reading, entries
from .main import COMMANDS
from .output import asked_files, keep, refuse_overwriting, remark_on, reporting

if TYPE_CHECKING:
    from ..records.record import Record

Decorator = Callable[[Any], Any]

SHOWS_ALL = "strandspring.shows_all"  # key of click's context
_OBJECTS = "options_objects"  # attribute of a command with the objects that it takes
_OUTPUT = "Output"  # the group of options that have none
_FLAGS = {
    "verbose": "Print all figures, how files were read, and cautions with their details.",
    "json": "Print one JSON object instead of text.",
}


class GroupedOption(click.Option):
    """An option of a group in the help, perhaps a rare one, or one of a file to write."""

    def __init__(
        self, *arguments: Any, group: str = _OUTPUT, is_rare: bool = False, file: tuple[str, ...] = (), **more: Any
    ) -> None:
        super().__init__(*arguments, **more)
        self.group, self.is_rare, self.file = group, is_rare, file


class OptionsCommand(click.Command):
    """A command whose help shows its options in groups; options of `identify` that it lacks are refused with advice."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The arguments."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as problem:
            from ..api.options import Fitting

            if problem.option_name not in {flag_of(name) for name, _ in options_of_object(Fitting())}:
                raise
            advice = "is an option of `identify`; identify the records first, then give MODEL.json."
            raise click.UsageError(f"{problem.option_name} {advice}", ctx) from None

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options, one group after the other; rare ones only if all are asked for."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            is_shown = ctx.meta.get(SHOWS_ALL) or not getattr(param, "is_rare", False)
            if isinstance(param, click.Option) and is_shown and (record := param.get_help_record(ctx)) is not None:
                groups.setdefault(getattr(param, "group", _OUTPUT), []).append(record)
        groups[_OUTPUT] = groups.pop(_OUTPUT)  # comes last
        for name, records in groups.items():
            with formatter.section(f"{name} options" if len(groups) > 1 else "Options"):
                formatter.write_dl(records)


def _show_all(context: click.Context, _option: click.Parameter, is_asked: bool) -> None:
    if is_asked and not context.resilient_parsing:
        context.meta[SHOWS_ALL] = True
        click.echo(context.get_help())
        context.exit()


def _words(problem: Exception) -> str:
    return problem.words(Reader.COMMAND_LINE) if isinstance(problem, StrandspringError) else str(problem)


class Written(click.types.StringParamType):
    """A value as people write it, of which a function that raises ValueError makes another, or that it checks."""

    def __init__(self, read: Callable[[str], Any]) -> None:
        self._read = read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            made = self._read(value)
        except ValueError as refusal:
            self.fail(_words(refusal), param, ctx)
        return value if made is None else made

    def shell_complete(self, _context: click.Context, _param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Files, as shells offer them for programs that they do not know."""
        return [CompletionItem(incomplete, type="file")]


PATH = Written(str)


def output_path(endings: Sequence[str], path: str) -> str:
    """The name of a file to write; raises ValueError if it has none of these endings, which begin with dots.

    Of several endings the name must have one, which chooses the format; a single one is added to a name without any
    that is not that of a file that is there, such as /dev/null.
    """
    ending, *others = endings
    suffix = Path(path).suffix.lower()
    if suffix in endings:
        return path
    if others:
        raise ValueError(f"must end in {', '.join(endings)}, got {path!r}.")
    if suffix:
        raise ValueError(f"{path} would be written as {ending}; give a name that ends in {ending}.")
    return path if os.path.exists(path) or not Path(path).name else f"{path}{ending}"  # noqa: PTH110 - of a long name


def command(group: Any = click, flags: Sequence[str] = ("verbose", "json"), **arguments: str) -> Decorator:
    """A command with arguments by their metavars: in brackets if they are optional, with dots for any number.

    Of a command that prints less than all that it knows the flags are --verbose and --json. Files that its options name
    do not overwrite those that it reads, and options that do not apply are wrong usage.
    """

    def decorate(function: Any) -> Any:
        @wraps(function)
        def run(**values: Any) -> None:
            given = [values[name] for name in arguments]
            paths = [path for one in given for path in ([one] if isinstance(one, str) else one)]
            if any(path is not None for _, path in asked_files().values()):
                params = click.get_current_context().command.params
                of_records = any(getattr(param, "group", "") == Reading.group for param in params)
                refuse_overwriting(record_files(paths) if of_records else paths)
            for argument, (default, names) in getattr(function, _OBJECTS, {}).items():
                taken = ((name, values.pop(name)) for name in names)
                chosen = {name: one for name, one in taken if one not in (None, ()) and one is not False}
                try:
                    values[argument] = getattr(default, "with_options", partial(replace, default))(**chosen)
                except (TypeError, ValueError) as problem:
                    raise click.UsageError(_words(problem)) from None
            try:
                function(**values)
            except OptionError as refusal:
                raise click.UsageError(_words(refusal)) from None

        _, summary = COMMANDS.get(function.__name__.replace("_", "-"), ("", ""))
        run.__doc__ = f"{summary}\n\n{inspect.cleandoc(function.__doc__)}".strip()
        made = group.command(cls=OptionsCommand)(run)
        for name, metavar in arguments.items():
            count, is_required = -1 if "..." in metavar else 1, metavar[0] != "["
            made.params.append(click.Argument([name], nargs=count, required=is_required, metavar=metavar, type=PATH))
        settings: Any = {"is_flag": True, "expose_value": False}
        for name in flags:
            made.params.append(GroupedOption([f"--{name}"], **settings, callback=keep, help=_FLAGS[name]))
        if any(getattr(param, "is_rare", False) for param in made.params):
            settings |= {"is_eager": True, "callback": _show_all, "help": "Show the rarest options, too."}
            made.params.append(GroupedOption(["--help-all"], **settings))
        return made

    return decorate


def given(*flags: str, group: str = _OUTPUT, **more: Any) -> Decorator:
    """An option of a command alone."""
    usual = {} if more.get("is_flag") else {"type": PATH}
    return click.option(*flags, cls=GroupedOption, group=group, **usual | more)


def written(
    metavar: str, text: str, title: str, key: str = "output", method: str = "", flags: str = "-o --output",
    is_required: bool = False, read: Callable[[str], Any] | None = None,
) -> Decorator:  # fmt: skip
    """A file to write, whose name ends as the metavar, with its title in words and its key in the JSON object.

    A method of the result writes it, or the command, which gets it then.
    """
    kind = Written(read or partial(output_path, [f".{ending}" for ending in metavar.partition(".")[2].split("|")]))
    return given(
        *flags.split(), type=kind, metavar=metavar, required=is_required, help=text, callback=keep,
        expose_value=not method, file=(key, title, method),
    )  # fmt: skip


def plot_option(text: str) -> Decorator:
    """A plot to write."""
    return written("FILE.png|svg|pdf", f"{text}.", "Plot", "plot", "save_plot", "--plot")


def option_of(name: str, said: Option, default: Any = None, group: str = "", owner: str = "") -> Decorator:
    """The option of a field; without it the command gets None, and the object its default."""
    is_flag, is_repeated = said.kind == "flag", said.kind in ("numbers", "texts") or said.repeated is not None
    types = {"flag": bool, "choice": click.Choice(said.choices), "whole": click.IntRange(said.least, said.most)}  # type: ignore[arg-type]
    is_pair = said.kind == "limits" and said.parse is None
    kind: Any = (float, float) if is_pair else types.get(said.kind, Written(said.read))
    unit, shown = said.shown or said.unit, said.otherwise or _shown(said, default)
    text = f"{said.help}{f' [{unit}]' if unit else ''}{f' ({owner})' if owner else ''}{said.repeated or ''}"
    more = {"numbers": "; repeat, or give LOW:HIGH:COUNT, for more", "texts": "; repeat for more"}.get(said.kind, "")
    return given(
        flag_of(said.flag or name), name, group=said.group or group, is_rare=said.rare, type=kind, is_flag=is_flag,
        default=None, multiple=is_repeated, metavar=said.metavar or None,
        callback=(lambda *given: sum(given[-1], ()) or None) if said.kind == "numbers" else None,
        help=f"{text}{more}.{f'  [default: {shown}]' if shown else ''}",
    )  # fmt: skip


def _shown(said: Option, default: Any) -> str:
    """A default for people; nothing where it is the absence of something."""
    if not default or default == math.inf:
        return ""
    values = default if isinstance(default, tuple) else (default,)
    return ",".join(f"{value / said.factor:g}" if isinstance(value, float) else str(value) for value in values)


def takes_options(**objects: Any) -> Decorator:
    """Give a command objects of options; by argument their classes, or objects with its defaults."""

    def decorate(function: Any) -> Any:
        for argument, kind in reversed(objects.items()):
            default = kind() if isinstance(kind, type) else kind
            options = dict(options_of_object(default))
            vars(function).setdefault(_OBJECTS, {})[argument] = default, options.keys()
            for option in reversed(options.values()):
                option(function)
        return function

    return decorate


def options_of_object(default: Any) -> Iterator[tuple[str, Decorator]]:
    """The options of an object and of its parts by their names; those that not all parts have say whose they are."""
    for name, said in options_of(default).items():
        if said.flag != "":
            yield name, option_of(name, said, getattr(default, name), default.group)
    parts: dict[str, type] = getattr(default, "parts", {})
    for name, owner in {name: owner for owner, part in parts.items() for name in options_of(part)}.items():
        said, usual = options_of(parts[owner])[name], getattr(parts[owner], name)
        is_shared = all(name in options_of(part) for part in parts.values())
        yield name, option_of(name, said, usual, default.group, "" if is_shared else owner)


def amplitude_option(text: str, otherwise: str, group: str = "Loop", several: bool = False) -> Decorator:
    """An amplitude of loops [m], or several."""
    said = Option(
        "numbers" if several else "number", text, "m", "mm", 1e-3, least=0.0, is_open=True, otherwise=otherwise,
        metavar="MM",
    )  # fmt: skip
    return option_of("amplitudes" if several else "amplitude", said, group=group)


def mass_option(text: str, group: str = "Mount", several: bool = False) -> Decorator:
    """A mass [kg], or several."""
    said = Option("numbers" if several else "number", text, "kg", least=0.0, is_open=True, metavar="KG")
    return option_of("mass", said, group=group)


def _zero(text: str) -> str | float:
    """The zero as `origin_of` takes it: "rig", "middle" or a displacement [m]."""
    if text in ("rig", "middle"):
        return text
    with suppress(ValueError):
        if abs(zero := 1e-3 * float(text)) <= LARGEST_DISPLACEMENT:
            return zero
    raise ValueError(f"--zero must be `rig`, `middle` or a displacement of the record in mm, got {text!r}.")


zero_option: Decorator = given(
    "--zero", metavar="rig|middle|MM", type=Written(_zero), group="Model",
    help="Where displacement is counted from: the rig's zero, the middle of the identified range, or a displacement of "
    "the record [mm].  [default: as in X.fmu, else rig if it is within the range, else middle]",
)  # fmt: skip


def read_records(paths: Sequence[str], reading: Reading, models: Iterable[str] = ()) -> list[Record]:
    """Read records and description files with a progress bar, and report what was assumed.

    Models that they are for are read, too: a bad one is refused before long records are read.
    """
    from ..model.modelfile import load_model

    for model in models if paths else ():
        load_model(model)
    if not paths:
        sentence = "{option} can only be given with records, and none is given; give a record."
        refuse_given(sentence, "", **reading.given)
    files = entries(paths, reading)
    records = []
    with reporting() as report:
        for done, (path, of_file) in enumerate(files):
            report("Reading records", done, len(files))
            records.append(of_file.read(path))
    remark_on(finding for record in records for finding in record.found)
    return records


def record_files(paths: Sequence[str]) -> list[str]:
    """The files that are read: those given, and those that description files among them name."""
    return [*paths, *(path for path, _ in entries(paths))]
