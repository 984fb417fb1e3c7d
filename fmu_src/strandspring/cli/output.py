"""What people see: progress and messages on standard error, results on standard output, and files.

rich takes as long to import as the rest of a short command, so that it is imported only to draw something.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple, TextIO

import click

from ..errors import Reader
from ..findings import CAUTIONS, NOTES, Finding, Severity, gathered, of_severity
from ..ground.files import refuse_unwritable

WIDTH = 80  # columns, where no terminal says how many it has
FILES = "strandspring.files"  # key of click's context


class WrittenFile(NamedTuple):
    """A file that a command writes if its option is given."""

    flag: str
    key: str  # in the JSON object
    title: str  # in words
    method: str  # of the result, which writes it; empty if the command does so
    path: str | None


def keep(context: click.Context, option: click.Parameter, value: bool) -> None:
    """Callback of --verbose and --json, which say how results are presented."""
    context.meta[option.opts[0]] = value


def is_asked(name: str) -> bool:
    """Whether the command that runs was called with --verbose, or with --json."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(f"--{name}"))


@contextmanager
def _drawn(has_end: bool) -> Iterator[Callable[..., None]]:
    """A line on a terminal while something takes long, and a function that changes it, which does nothing elsewhere."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda **_: None
        return
    from rich import progress as rich
    from rich.console import Console

    columns = (rich.SpinnerColumn(), rich.TextColumn("{task.description}"))
    parts = (rich.BarColumn(20), rich.MofNCompleteColumn()) if has_end else ()
    left = (rich.TextColumn("left"), rich.TimeRemainingColumn()) if has_end else ()
    shown = (*columns, *parts, rich.TimeElapsedColumn(), *left)
    with rich.Progress(*shown, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda **fields: bar.update(task, **fields)


@contextmanager
def working(description: str) -> Iterator[Callable[[str], None]]:
    """A spinner on a terminal for one long step, with the time taken so far, and a function that takes its stages."""
    with _drawn(has_end=False) as show:
        show(description=description)
        yield lambda stage: show(description=f"{description}: {stage}")


@contextmanager
def reporting(noun: str = "", journal: Path | None = None) -> Iterator[Callable[[str, float, int], None]]:
    """A progress bar on a terminal, and a function that takes what is being done, the parts done, and their number.

    Of parts that are kept in a journal, an interrupt says how many they are and where.
    """
    finished: tuple[float, int] = (0, 0)

    def progress(what: str, done: float, total: int) -> None:
        nonlocal finished
        finished = done, total
        show(description=what, completed=done, total=total)

    try:
        with _drawn(has_end=True) as show:
            yield progress
    except KeyboardInterrupt:
        if journal is not None and journal.exists():  # all is written where it does not
            done, total = finished
            kept = f"{done} of {total} {noun}" if done else f"Finished {noun}"
            note(f"{kept} are kept in {journal}; the same command continues from there.")
        raise


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
    is_brief = not is_asked("verbose")
    cautions = sentences(CAUTIONS, Reader.COMMAND_LINE, is_brief)
    shown = cautions[:most] if is_brief else cautions
    for sentence in shown:
        note(f"Caution: {sentence}")
    if more := len(cautions) - len(shown):
        note(f"and {more} more: see the report, --verbose or --json")
    for sentence in sentences(NOTES if is_brief else (*NOTES, Severity.STATED), Reader.COMMAND_LINE, is_brief):
        note(f"Note: {sentence}")


def remark_on(findings: Iterable[Finding]) -> None:
    """Report findings of what is no result."""
    found = tuple(findings)
    remark(lambda severities, *reader: [*gathered(of_severity(found, severities), *reader)])


def refuse_overwriting(inputs: Iterable[str | Path], outputs: Mapping[str, str | Path | None] | None = None) -> None:
    """Refuse an output that cannot be written, or is an input or another output of the same command, by whatever path.

    Parameters
    ----------
    inputs : iterable of paths
    outputs : mapping or None    Path by option of what is written besides the files of options; None where nothing is.

    Raises
    ------
    click.UsageError             With the option and the path.
    StrandspringError            If an output cannot be written.
    """
    files = click.get_current_context().meta.get(FILES, ())
    of_options = {file.flag: file.path for file in files} | dict(outputs or {})
    written = {option: path for option, path in of_options.items() if path is not None}
    read, taken = list(inputs), dict[str, str | Path]()
    for option, path in written.items():
        for source in read:
            if _is_same_file(path, source):
                raise click.UsageError(f"{option} {path} would overwrite the input {source}; write elsewhere.")
        for other, earlier in taken.items():
            if _is_same_file(path, earlier):
                raise click.UsageError(f"{option} must be another file than {other}, got {path} for both.")
        taken[option] = path
    for path in written.values():
        refuse_unwritable(Path(path))


def _is_same_file(path: str | Path, other: str | Path) -> bool:
    """Whether two paths lead to the same file, which need not exist."""
    try:
        return Path(path).samefile(other)
    except OSError:
        return os.path.realpath(path) == os.path.realpath(other)


def present(
    made: Any, content: Mapping[str, Any] | None = None, most: int | None = None, without: Collection[str] = (),
    **files: Any,
) -> None:  # fmt: skip
    """A result with its files: on standard output one JSON object, or words with the files that were written, and then
    what is found on standard error.

    Parameters
    ----------
    made : Result            Writes the files of options, those that it has a method for.
    content : dict or None   What the JSON object has besides, or instead.
    most : int or None       So many cautions are printed at most, without --verbose.
    without : collection of str   Keys of files that it does not have.
    **files                  More of them, by key the title and the path; None if it was not written.
    """
    written: dict[str, tuple[str, Any]] = {}
    for file in click.get_current_context().meta.get(FILES, ()):
        if file.key in without or not (file.method == "" or hasattr(made, file.method)):
            continue
        written[file.key] = file.title, file.path
        if file.method and file.path is not None:
            with working(f"Writing {file.path}"):
                getattr(made, file.method)(file.path)
    written |= files
    if is_asked("json"):
        paths = {key: None if path is None else str(path) for key, (_, path) in written.items()}
        result_json({**made.as_json(), **(content or {}), **paths})
        return
    width = width_of(sys.stdout)
    for line in (made.text_lines if is_asked("verbose") else made.brief)(width):
        click.echo(folded(line, width))
    for title, path in written.values():
        if path is not None:
            click.echo(f"{title}: {path}")
    remark(made.sentences, most)


def width_of(stream: TextIO) -> int | None:
    """Columns of the terminal that shows a stream; if it goes elsewhere, 80, and with --verbose any number."""
    if stream.isatty():
        return shutil.get_terminal_size().columns
    return None if is_asked("verbose") else WIDTH


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


def result_json(content: dict[str, Any]) -> None:
    """The result as one JSON object on standard output; NaN and infinity, which JSON lacks, become null."""
    from ..api.common.result import in_json

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
