"""Options shared by several commands."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, get_args

import click

from ...api.common.methods import MethodName, methods
from ...core.branches import BRANCHES, MECHANISMS
from ...errors import RecordError
from ...model.names import identifier as identifier
from .option_types import FiniteRange, positive, together
from .output import progress

if TYPE_CHECKING:
    from ...identification.method import Method
    from ...loops.selection import Wanted
    from ...records.record import Record

# What reads records is slow to import, and commands about a model take these options, too: each function imports it.


def _one_column(_context: click.Context, _option: click.Parameter, columns: tuple[str, ...]) -> str | None:
    if len(set(columns)) > 1:
        raise click.BadParameter(f"must be one column, got {' and '.join(columns)}; negate the other one in the file.")
    return columns[0] if columns else None


def _time(_context: click.Context, _option: click.Parameter, values: tuple[str, ...]) -> tuple[str | None, str | None]:
    """The column and the window."""
    if not values:
        return None, None
    from ...loops.selection import is_window

    windows = {value for value in values if is_window(value)}
    columns = set(values) - windows
    for given, what in ((columns, "column"), (windows, "window FROM:TO")):
        if len(given) > 1:
            raise click.BadParameter(f"must be one {what}, got {' and '.join(sorted(given))}.")
    _refuse_wrong("time_window", next(iter(windows), None))
    return next(iter(columns), None), next(iter(windows), None)


def _form(_context: click.Context, option: click.Parameter, text: str | None) -> str | None:
    _refuse_wrong(option.name or "", text)
    return text


def _refuse_wrong(name: str, text: str | None) -> None:
    """Refuse what is not of the form of a selection, or not a unit."""
    if text is None:
        return
    from ...loops.selection import Wanted

    given: dict[str, Any] = {name: text}
    try:
        Wanted(**given)
    except RecordError as problem:
        raise click.BadParameter(str(problem)) from None


def _degrees(_context: click.Context, _option: click.Parameter, text: str) -> tuple[int, int] | None:
    if text == "auto":
        return None
    match = re.fullmatch(r"\s*(\d{1,2})\s*,\s*(\d{1,2})\s*", text)
    if not match:
        raise click.BadParameter(f"must be N,M (such as 3,2) or auto, got {text!r}.")
    return int(match[1]), int(match[2])


def _levels(_context: click.Context, _option: click.Parameter, text: str) -> tuple[float, ...]:
    try:
        return tuple(float(level) for level in text.split(","))
    except ValueError:
        raise click.BadParameter(f"must be H1,H2,H3 (such as -0.5,0.35,0.7), got {text!r}.") from None


# Options that say how records are read and what of them is used.
record_options = together(
    click.option("--displacement", metavar="COLUMN",
                 help="Displacement column: name, or number from 1; of several sheets or groups, SHEET/COLUMN."),
    click.option("--force", metavar="COLUMN", help="Force column, likewise."),
    click.option("--time", metavar="COLUMN|FROM:TO", multiple=True, callback=_time,
                 help="Time column, if any. The model does not need it; identify finds delays, gaps and forces that "
                 "depend on the rate by it. Numbers as in 2.5:60, 2.5: or :60 are a window instead, to which the "
                 "record is cut [s]; give the option twice for both."),
    click.option("--displacement-unit", metavar="UNIT", callback=_form,
                 help="mm, m, in, ...  [default: the file's, or mm]"),
    click.option("--force-unit", metavar="UNIT", callback=_form,
                 help="N, kN, lbf, kip, ...  [default: the file's, or N]"),
    click.option("--time-unit", metavar="UNIT", callback=_form,
                 help="s, ms, min, ...  [default: the file's, or s]"),
    click.option("--reverse", type=click.Choice(["displacement", "force"]), multiple=True, callback=_one_column,
                 help="Negate this column."),
    click.option("--skip-bad-lines", is_flag=True, callback=lambda _context, _option, skips: skips or None,
                 help="Leave out lines of a text that cannot be read, up to a tenth of them, with a caution."),
    click.option("--cycles", metavar="FIRST:LAST", callback=_form,
                 help="Cut the record to these cycles, counted from 1: 2:5, 2:, :5 or 3."),
    click.option("--displacement-range", metavar="LOW:HIGH", callback=_form,
                 help="Compare only samples within these displacements, as in -5:5, -5: or :5 [mm]; the others still "
                 "belong to the path."),
)  # fmt: skip

# Options of the identification itself.
identification_options = together(
    click.option("--degrees", default="auto", show_default=True, metavar="N,M|auto", callback=_degrees,
                 help="Degrees of the elastic and the amplifier polynomial; auto may make the elastic force a table."),
    click.option("--method", default="refined", show_default=True,
                 type=click.Choice(get_args(MethodName)),
                 help="refined: the class that predicts held-out strokes best, with verdict and errors; two-stage: "
                 "two stages as the paper's, by least squares over whole strokes, without iteration; paper: the "
                 "paper's method as printed; ni: Ni's model and method, for comparison."),
    click.option("--steady", type=click.FloatRange(0.0, 1.0, min_open=True), default=0.9, show_default=True,
                 metavar="SHARE", help="Paper: half the steady section, share of the amplitude."),
    click.option("--smoothing", type=click.IntRange(0, 10_000), metavar="SAMPLES",
                 help="Paper: half width of the moving average.  [default: a 48th of a period]"),
    click.option("--branch", type=click.Choice(["loading", "unloading"]), default="loading", show_default=True,
                 help="Paper: the branch of the second stage."),
    click.option("--levels", default="-0.5,0.35,0.7", show_default=True, metavar="H1,H2,H3", callback=_levels,
                 help="Paper: share of saturation at the three points where slopes are read."),
    click.option("--robust", is_flag=True, help="Refined: Huber's loss, for records with outliers."),
    click.option("--moving-mass", type=FiniteRange(min=0.0, unit="kg"), default=0.0, metavar="KG",
                 help="Refined: mass between load cell and spring, whose inertia is removed [kg]; needs times."),
    click.option("--fixture-stiffness", type=positive("N/mm", 1e3), metavar="N/MM",
                 help="Refined: stiffness of what yields between displacement sensor and spring, whose deflection is "
                 "removed [N/mm]."),
    click.option("--delay", type=FiniteRange(unit="ms", factor=1e-3), metavar="MS",
                 help="Refined: time by which the force lags, negative if it leads [ms]; needs times.  "
                 "[default: sought in the records]"),
    click.option("--state", type=click.Choice(["first", "mean", "last"]), default="mean", show_default=True,
                 help="Refined: which cycles of an amplitude are fitted: the first third, all, or the last third."),
    click.option("--mechanisms", type=click.IntRange(1, MECHANISMS), metavar="N",
                 help="Refined: friction mechanisms, 1 or 2.  [default: a second one where it predicts better]"),
    click.option("--branches", type=click.IntRange(0, BRANCHES), metavar="N",
                 help="Refined: Maxwell branches, 0 to 3; need times.  [default: one where it predicts better]"),
    click.option("--save-anyway", is_flag=True,
                 help="Save, with a caution, a spring that follows the records worse than a straight line does, instead"
                 " of refusing it."),
)  # fmt: skip


def method_options(chosen: dict[str, Any]) -> Method:
    """Take the options of identification out of a command's; wrong ones are wrong usage."""
    method = methods()[chosen.pop("method")]
    known = {field.name for field in fields(method)}
    owners = {field.name: (other.name, field.default) for other in methods().values() for field in fields(other)}
    values = {name: chosen.pop(name) for name in owners if name != "start"}
    values["fixture_stiffness"] = values["fixture_stiffness"] or math.inf
    for name, value in values.items():
        owner, default = owners[name]
        if name not in known and value != default:
            raise click.UsageError(f"--{name.replace('_', '-')} belongs to --method {owner}.")
    try:
        return method(**{name: value for name, value in values.items() if name in known})
    except ValueError as problem:
        raise click.UsageError(str(problem)) from None


def wanted_of(options: Mapping[str, Any]) -> Wanted:
    """What `record_options` say."""
    from ...loops.selection import Wanted

    time, window = options["time"]
    return Wanted(time=time, time_window=window, **{name: value for name, value in options.items() if name != "time"})


def read_records(paths: Sequence[str], options: Mapping[str, Any]) -> list[Record]:
    """Read records and description files with a progress bar, with what `record_options` say."""
    from ...loops.selection import Wanted, entries

    selection = wanted_of(options)
    if not paths and selection != Wanted():
        raise click.UsageError("Columns, units and selections are those of records, and none is given; give a record.")
    return [wanted.read(path) for path, wanted in progress(entries(paths, selection), "Reading records")]


def record_files(paths: Sequence[str]) -> list[str]:
    """The files that are read: those given, and those that description files among them name."""
    from ...loops.selection import entries

    return [*paths, *(path for path, _ in entries(paths))]
