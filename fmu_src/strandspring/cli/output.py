"""What people see: progress and messages on standard error, results on standard output, and files.

rich takes as long to import as the rest of a short command, so that it is imported only to draw something.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from textwrap import wrap
from typing import Any, TextIO

import click

from ..errors import Reader
from ..findings import CAUTIONS, NOTES, Finding, Severity, gathered, of_severity
from ..ground.files import refuse_unwritable

WIDTH = 80  # columns, where no terminal says how many it has


def keep(context: click.Context, option: click.Parameter, value: Any) -> Any:
    """Callback of --verbose, --json and the files to write, which say how results are presented."""
    context.meta[option.opts[-1]] = value
    return value


def is_asked(name: str) -> bool:
    """Whether the command that runs was called with --verbose, --json or the option of a file."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(f"--{name}"))


def asked_files() -> dict[str, tuple[tuple[str, str, str], str | None]]:
    """What `opt.written` says of the files that the command that runs can write, and their paths, by their options."""
    context = click.get_current_context()
    options = [option for option in context.command.params if getattr(option, "file", None)]
    return {option.opts[-1]: (vars(option)["file"], context.meta[option.opts[-1]]) for option in options}


@contextmanager
def reporting(step: str = "", noun: str = "", journal: Path | None = None) -> Iterator[Callable[..., None]]:
    """A line on a terminal, and a function that takes what is being done, the parts done, and their number.

    Of one long step the line shows the time taken so far. Of parts that are kept in a journal, an interrupt says how
    many they are and where.
    """
    finished: tuple[float, int] = (0, 0)
    bar: Any = None
    if sys.stderr is not None and sys.stderr.isatty():
        from rich import progress as rich
        from rich.console import Console

        columns: list[Any] = [rich.SpinnerColumn(), "{task.description}", rich.TimeElapsedColumn()]
        if not step:
            columns[2:2] = [rich.BarColumn(20), rich.MofNCompleteColumn()]
            columns += ["left", rich.TimeRemainingColumn()]
        bar = rich.Progress(*columns, console=Console(stderr=True), transient=True)
        bar.add_task(step, total=None)

    def progress(what: str, done: float = 0, total: int = 0) -> None:
        nonlocal finished
        finished = done, total
        if bar is not None:
            bar.update(bar.task_ids[0], description=what, completed=done, total=total or None)

    try:
        with bar or nullcontext():
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
    """Report cautions, without --verbose so many at most and the number of the others, and notes; with it all details.

    `sentences` gives those of some severities for a reader, in few words if the third is true.
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

    Outputs are the files of options, and by option what is written besides them; None where nothing is.
    """
    read = {os.path.realpath(path): path for path in inputs}
    written = {option: path for option, (_, path) in asked_files().items()} | dict(outputs or {})
    taken: dict[str, str] = {}
    for option, path in written.items():
        if path is None:
            continue
        place = os.path.realpath(path)
        if place in read:
            raise click.UsageError(f"{option} {path} would overwrite the input {read[place]}; write elsewhere.")
        if (other := taken.setdefault(place, option)) != option:
            raise click.UsageError(f"{option} must be another file than {other}, got {path} for both.")
        refuse_unwritable(Path(path))


def present(made: Any, content: Mapping[str, Any] | None = None, most: int | None = None, **files: Any) -> None:
    """A result on standard output, in JSON or words, with the files that were written; findings on standard error.

    Parameters
    ----------
    made : Result            Writes the files of options, but for those that the command writes.
    content : dict or None   What the JSON object has besides, or instead.
    most : int or None       So many cautions are printed at most, without --verbose.
    **files                  More files, by key the title and the path.
    """
    written: dict[str, tuple[str, Any]] = {}
    for (key, title, method), path in asked_files().values():
        written[key] = title, path
        if method and path is not None:
            with reporting(f"Writing {path}"):
                getattr(made, method)(path)
    written |= files
    if is_asked("json"):
        result_json({**made.as_json(), **(content or {}), **{key: path for key, (_, path) in written.items()}})
        return
    width = width_of(sys.stdout)
    for line in made.text_lines(width, brief=not is_asked("verbose")):
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
    """A line of words in several of at most a width, as far as its words allow it."""
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
