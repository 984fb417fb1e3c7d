"""Options shared by several commands."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from typing import Any, TypeVar

import click

from ...api.common.methods import METHODS
from ...campaigns.jobs.cluster import PATIENCE, Cluster
from ...campaigns.jobs.runners import JobError
from ...errors import RecordError, StrandspringError
from ...identification.methods.method import Method
from ...identification.methods.refined import KEEP, RefinedOptions
from ...identification.rig.effect_columns import STATES
from ...loops.description_file import entries
from ...loops.wanted import Wanted, is_window
from ...model.names import check_name
from ...model.names import identifier as identifier
from ...records.record import Record
from .output import progress, verbose_option


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


def _one_column(_context: click.Context, _option: click.Parameter, columns: tuple[str, ...]) -> str | None:
    if len(set(columns)) > 1:
        raise click.BadParameter(f"must be one column, got {' and '.join(columns)}; negate the other one in the file.")
    return columns[0] if columns else None


def _time(_context: click.Context, _option: click.Parameter, values: tuple[str, ...]) -> tuple[str | None, str | None]:
    """The column and the window."""
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
    given: dict[str, Any] = {name: text}
    try:
        Wanted(**given)
    except RecordError as problem:
        raise click.BadParameter(str(problem)) from None


def name_option(text: str) -> Callable[[Command], Command]:
    """The name of a model, with its help."""
    return click.option("--name", callback=checked_by(check_name), help=text)


def _degrees(_context: click.Context, _option: click.Parameter, text: str) -> tuple[int, int] | None:
    if text == "auto":
        return None
    match = re.fullmatch(r"\s*(\d{1,2})\s*,\s*(\d{1,2})\s*", text)
    if not match:
        raise click.BadParameter(f"must be N,M (such as 3,2) or auto, got {text!r}.")
    return int(match[1]), int(match[2])


def _keep(_context: click.Context, _option: click.Parameter, names: str | None) -> tuple[str, ...]:
    kept = tuple(name.strip() for name in (names or "").split(",") if name.strip())
    if unknown := [name for name in kept if name not in KEEP]:
        raise click.BadParameter(f"must be some of {', '.join(KEEP)}, got {unknown[0]!r}.")
    return kept


def loop_amplitudes(about: str, default: str) -> Callable[[Command], Command]:
    """Amplitudes of loops about some displacement [m], with what they are by default."""
    return click.option(
        "--amplitude", "amplitudes", type=FiniteRange(1e-6, 1e6, unit="mm", factor=1e-3), multiple=True, metavar="MM",
        help=f"Amplitude of a loop about the {about} [mm]; repeat for more.  [default: {default}]",
    )  # fmt: skip


# Options that say how records are read and what of them is used.
record_options = together(
    click.option("--displacement", metavar="COLUMN",
                 help="Displacement column: name, or number from 1; of several sheets or groups, SHEET/COLUMN."),
    click.option("--force", metavar="COLUMN", help="Force column, likewise."),
    click.option("--time", metavar="COLUMN|FROM:TO", multiple=True, callback=_time,
                 help="Time column, if any. The model does not need it; identify finds delay, viscous force and gaps "
                 "by it. Numbers as in 2.5:60, 2.5: or :60 are a window instead, to which the record is cut [s]; give "
                 "the option twice for both."),
    click.option("--displacement-unit", metavar="UNIT", callback=_form,
                 help="mm, m, in, ...  [default: the file's, or mm]"),
    click.option("--force-unit", metavar="UNIT", callback=_form,
                 help="N, kN, lbf, kip, ...  [default: the file's, or N]"),
    click.option("--time-unit", metavar="UNIT", callback=_form,
                 help="s, ms, min, ...  [default: the file's, or s]"),
    click.option("--reverse", type=click.Choice(["displacement", "force"]), multiple=True, callback=_one_column,
                 help="Negate this column."),
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
                 type=click.Choice(list(METHODS)),
                 help="refined: least squares from several starts, effects of the rig removed, standard errors; "
                 "two-stage: the paper's, no iteration, no initial values; scan: a coarse grid; ni: Ni's model and "
                 "method, for comparison."),
    click.option("--formulas", default="whole-branch", show_default=True,
                 type=click.Choice(["whole-branch", "three-point"]),
                 help="Two-stage: least squares over whole branches, or the paper's three-point formulas."),
    click.option("--smoothing", type=click.IntRange(0, 10_000), metavar="POINTS",
                 help="Two-stage: half width of the moving average.  [default: from the noise]"),
    click.option("--filter", "filter_", default="moving-average", show_default=True,
                 type=click.Choice(["moving-average", "low-pass", "fourier"]),
                 help="Two-stage: against heavy noise; fourier needs whole periods."),
    click.option("--robust", is_flag=True, help="Refined: Huber's loss, for records with outliers."),
    click.option("--bootstrap", type=click.IntRange(0, 10_000), default=0, metavar="REPETITIONS",
                 help="Refined: also estimate standard errors by resampling strokes."),
    click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True,
                 help="Seed of the bootstrap and the posterior."),
    click.option("--posterior", type=click.IntRange(0, 1_000_000), default=0, metavar="STEPS",
                 help="Refined: also sample the posterior distribution of the parameters by Monte Carlo; some thousand "
                 "steps, which are taken where 2000 weighted draws do not do. Needs pip install "
                 '"strandspring[posterior]".'),
    click.option("--moving-mass", type=FiniteRange(min=0.0, unit="kg"), default=0.0, metavar="KG",
                 help="Refined: mass between load cell and spring, whose inertia is removed [kg]; needs times."),
    click.option("--fixture-stiffness", type=positive("N/mm", 1e3), metavar="N/MM",
                 help="Refined: stiffness of what yields between displacement sensor and spring, whose deflection is "
                 "removed [N/mm]."),
    click.option("--delay", type=FiniteRange(unit="ms", factor=1e-3), metavar="MS",
                 help="Refined: time by which the force lags, negative if it leads [ms]; needs times.  "
                 "[default: sought in the records]"),
    click.option("--keep", metavar="EFFECT,...", callback=_keep,
                 help=f"Refined: effects that are left in the spring, not removed as the rig's: {', '.join(KEEP)}."),
    click.option("--state", type=click.Choice(list(STATES)), default=RefinedOptions.state, show_default=True,
                 help="Refined: the cycle that the model describes where wear or drift changes them."),
    click.option("--save-anyway", is_flag=True,
                 help="Save, with a caution, a spring that follows the records worse than a straight line does, instead"
                 " of refusing it."),
)  # fmt: skip

# Options that say where many tasks are executed.
worker_options = together(
    click.option("--workers", type=click.IntRange(1, 1024), metavar="N",
                 help="Number of processes; 1 for none besides this one.  [default: all cores]"),
    click.option("--scheduler", metavar="tls://HOST:PORT",
                 help="Run on the cluster of this dask.distributed scheduler instead. A scheduler without TLS (tcp://) "
                 "executes code from anyone who can reach it: use it on a trusted network only."),
    click.option("--tls-ca-file", metavar="FILE",
                 help="Certificate of the authority that signed the scheduler's, in PEM format.  "
                 "[default: from dask's configuration]"),
    click.option("--tls-cert", metavar="FILE", help="Certificate of this client, in PEM format."),
    click.option("--tls-key", metavar="FILE", help="Key of this client, in PEM format, without passphrase."),
    click.option("--patience", type=FiniteRange(1.0, 1e6, unit="s"), default=PATIENCE, show_default=True, metavar="S",
                 help="Give up after this time [s] without an answer from the scheduler, without workers, or waiting "
                 "for silent ones."),
)  # fmt: skip


def cluster_option(workers: int | None, options: dict[str, Any]) -> Cluster | None:
    """Take what `worker_options` say of a cluster out of a command's options; raises click.UsageError."""
    scheduler, patience = options.pop("scheduler"), options.pop("patience")
    certificates = {name: options.pop(name) for name in ("tls_ca_file", "tls_cert", "tls_key")}
    if workers is not None and scheduler is not None:
        raise click.UsageError("--workers and --scheduler exclude each other; give one of them.")
    if scheduler is not None:
        try:
            return Cluster(scheduler, **certificates, patience=patience)
        except JobError as problem:
            raise click.UsageError(str(problem)) from None
    if any(certificates.values()):
        raise click.UsageError("Certificates are for a scheduler; add --scheduler tls://HOST:PORT.")
    return None


def method_options(chosen: dict[str, Any]) -> Method:
    """Take the options of identification out of a command's; wrong ones are wrong usage."""
    method = METHODS[chosen.pop("method")]
    known = {field.name for field in fields(method)}
    owners = {field.name: (other.name, field.default) for other in METHODS.values() for field in fields(other)}
    values = {name: chosen.pop("filter_" if name == "filter" else name) for name in owners if name != "start"}
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
    time, window = options["time"]
    return Wanted(time=time, time_window=window, **{name: value for name, value in options.items() if name != "time"})


def read_records(paths: Sequence[str], options: Mapping[str, Any]) -> list[Record]:
    """Read records and description files with a progress bar, with what `record_options` say."""
    selection = wanted_of(options)
    if not paths and selection != Wanted():
        raise click.UsageError("Columns, units and selections are those of records, and none is given; give a record.")
    return [entry.read() for entry in progress(entries(paths, selection), "Reading records")]


def record_files(paths: Sequence[str]) -> list[str]:
    """The files that are read: those given, and those that description files among them name."""
    return [*paths, *(entry.path for entry in entries(paths))]
