"""What people see: progress and messages on standard error, results on standard output.

rich takes as long to import as the rest of a short command, so that it is imported only to draw something.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

import click

from ...errors import Reader
from ...findings import CAUTIONS, NOTES, Finding, Severity, gathered, of_severity

if TYPE_CHECKING:
    from rich.progress import Progress


WIDTH = 80  # columns, where no terminal says how many it has
Item = TypeVar("Item")
_VERBOSE = "strandspring.verbose"  # key of click's context


def _keep_verbose(context: click.Context, _option: click.Parameter, is_verbose: bool) -> None:
    context.meta[_VERBOSE] = is_verbose


verbose_option = click.option(
    "--verbose",
    is_flag=True,
    expose_value=False,
    callback=_keep_verbose,
    help="Print all figures, how files were read, and cautions with their details.",
)


def _is_watched() -> bool:
    """Whether standard error is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()


def progress(items: Sequence[Item], description: str) -> Iterable[Item]:
    """The items, with a progress bar on a terminal if there are several, else what is being done."""
    if len(items) < 2:
        with working(description):
            yield from items
        return
    with reporting() as report:
        for done, item in enumerate(items):
            report(description, done, len(items))
            yield item


@contextmanager
def working(description: str) -> Iterator[Callable[[str], None]]:
    """A spinner on a terminal for one long step, with the time taken so far, and a function that takes its stages."""
    if not _is_watched():
        yield lambda _: None
        return
    from rich import progress as rich
    from rich.console import Console

    columns = (rich.SpinnerColumn(), rich.TextColumn("{task.description}"), rich.TimeElapsedColumn())
    with rich.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(description, total=None)
        yield lambda stage: bar.update(task, description=f"{description}: {stage}")


@contextmanager
def reporting(rate: str = "") -> Iterator[Callable[[str, float, int], None]]:
    """A progress bar on a terminal, and a function that takes what is being done, the parts done, and their number.

    With a unit such as "springs/s" the bar shows the rate, too.
    """
    if not _is_watched():
        yield lambda *_: None
        return
    with _bar(rate) as bar:
        task = bar.add_task("", total=None)
        yield lambda what, done, total: bar.update(task, description=what, completed=done, total=total)


@contextmanager
def reporting_kept(noun: str, journal: Path, rate: str = "") -> Iterator[Callable[[str, float, int], None]]:
    """The same for work that is kept in a journal, which an interrupt names."""
    finished: float = 0
    total = 0

    def progress(what: str, done: float, count: int) -> None:
        nonlocal finished, total
        finished, total = done, count
        report(what, done, count)

    try:
        with reporting(rate) as report:
            yield progress
    except KeyboardInterrupt:
        if journal.exists():  # all is written where it does not
            kept = f"{finished} of {total} {noun}" if finished else f"Finished {noun}"
            note(f"{kept} are kept in {journal}; the same command continues from there.")
        raise


def _bar(rate: str = "") -> Progress:
    """A bar of which spinner and time passed move while one part takes long."""
    from rich import progress as rich
    from rich.console import Console
    from rich.text import Text

    class Rate(rich.ProgressColumn):
        def render(self, task: rich.Task) -> Text:
            return Text("" if task.speed is None else f"{task.speed:.3g} {rate}")

    columns = (
        rich.SpinnerColumn(),
        rich.TextColumn("{task.description}"),
        rich.BarColumn(20),
        rich.MofNCompleteColumn(),
        *((Rate(),) if rate else ()),
    )
    times = (rich.TimeElapsedColumn(), rich.TextColumn("left"), rich.TimeRemainingColumn())
    return rich.Progress(*columns, *times, console=Console(stderr=True), transient=True)


def note(text: str) -> None:
    """A message on standard error, besides the result."""
    click.echo(folded(text, width_of(sys.stderr)), err=True)


def remark(sentences: Callable[..., Sequence[str]], most: int | None = None) -> None:
    """Report cautions, counting those beyond a number, and notes; with --verbose all of them with their details.

    Parameters
    ----------
    sentences : callable   Gives the sentences of some severities for a reader, in few words if the third is true.
    most : int or None     So many cautions are printed at most.
    """
    is_brief = not is_verbose()
    cautions = sentences(CAUTIONS, Reader.COMMAND_LINE, is_brief)
    shown = len(cautions) if most is None or not is_brief else most
    for sentence in cautions[:shown]:
        note(f"Caution: {sentence}")
    if more := len(cautions[shown:]):
        note(f"and {more} more: see the report, --verbose or --json")
    for sentence in sentences(NOTES if is_brief else (*NOTES, Severity.STATED), Reader.COMMAND_LINE, is_brief):
        note(f"Note: {sentence}")


def remark_on(findings: Iterable[Finding]) -> None:
    """Report findings of what is no result."""
    found = tuple(findings)
    remark(lambda severities, *reader: [*gathered(of_severity(found, severities), *reader)])


def refusal(text: str) -> None:
    """Why the command fails: one line on standard error."""
    click.echo(text, err=True)


def result(text: str) -> None:
    """A line of the result on standard output."""
    click.echo(text)


def present(as_json: bool, made: Any, content: dict[str, Any], most: int | None = None, **files: Any) -> None:
    """A result: on standard output one JSON object, or words with the files that were written, and then what is found
    on standard error.

    Parameters
    ----------
    as_json : bool
    made : Result
    content : dict       What the JSON object has besides, or instead.
    most : int or None   So many cautions are printed at most, without --verbose.
    **files              By their key in the JSON object the title in words, and the path; None if it was not written.
    """
    if as_json:
        paths = {key: None if path is None else str(path) for key, (_, path) in files.items()}
        result_json({**made.as_json(), **content, **paths})
        return
    lines = made.text_lines if is_verbose() else made.brief
    width = width_of(sys.stdout)
    for line in lines(width):
        result(folded(line, width))
    for title, path in files.values():
        if path is not None:
            result(f"{title}: {path}")
    remark(made.sentences, most)


def is_verbose() -> bool:
    """Whether the command that runs was called with --verbose."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(_VERBOSE))


def width_of(stream: TextIO) -> int | None:
    """Columns of the terminal that shows a stream; if it goes elsewhere, 80, and with --verbose any number."""
    if stream.isatty():
        return shutil.get_terminal_size().columns
    return None if is_verbose() else WIDTH


def folded(line: str, width: int | None) -> str:
    """A line of words in several of at most a width, as far as its words allow it.

    Examples
    --------
    >>> print(folded("  RNL 0.9962 of a record with a long name", 24))
      RNL 0.9962 of a record
        with a long name
    """
    if width is None or len(line) <= width:
        return line
    indent = " " * (len(line) - len(line.lstrip()) + 2)
    parts = wrap(line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return "\n".join(parts)


def save(content: Any, output: str | None, plot: str | None, report: str | None = None) -> None:
    """Write a result into the files that are asked for: its table, its plot, its report."""
    if output is not None:
        content.save_csv(output)
    if plot is not None:
        content.save_plot(plot)
    if report is not None:
        with working("Drawing the report"):
            content.report(report)


def result_json(content: dict[str, Any]) -> None:
    """The result as one JSON object on standard output; NaN and infinity, which JSON lacks, become null."""
    from ...api.common.result import in_json

    click.echo(json.dumps(in_json(content), indent=2, ensure_ascii=False, allow_nan=False))


def drop_failing_output() -> bool:
    """Whether standard output cannot be written; if so, what it holds is dropped, or Python would try it on leaving."""
    try:
        click.echo()
    except OSError:
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())
        return True
    return False
