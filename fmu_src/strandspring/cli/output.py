"""What people see: progress and messages on standard error, results on standard output.

rich takes as long to import as the rest of a short command, so that it is imported only to draw something.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any, TypeVar

import click

from .tables import Column, cell_width, narrow_table_lines, table_lines

Item = TypeVar("Item")

_INDENT = "  "  # of tables


def _is_watched() -> bool:
    """Whether standard error is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()


def progress(items: Sequence[Item], description: str) -> Iterable[Item]:
    """The items, with a progress bar on a terminal if there are several."""
    if len(items) < 2:
        yield from items
        return
    with advancing(description, len(items)) as advance:
        for done, item in enumerate(items):
            advance(done)
            yield item


def working(description: str) -> AbstractContextManager[Any]:
    """A spinner on a terminal for one long step."""
    if not _is_watched():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(description)


@contextmanager
def advancing(description: str, total: int) -> Iterator[Callable[[int], None]]:
    """A progress bar on a terminal, and a function that takes the number of parts done so far.

    A spinner and the time passed move while one part takes long.
    """
    if not _is_watched():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import TimeRemainingColumn as Remaining

    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(20), MofNCompleteColumn())
    with Progress(*columns, TimeElapsedColumn(), TextColumn("left"), Remaining(), console=Console(stderr=True),
                  transient=True) as bar:  # fmt: skip
        task = bar.add_task(description, total=total)
        yield lambda count: bar.update(task, completed=count)


def note(text: str) -> None:
    """A message on standard error."""
    click.echo(text, err=True)


def result(text: str) -> None:
    """A line of the result on standard output."""
    click.echo(text)


def result_table(headings: Sequence[str], rows: Iterable[Sequence[str]], left: Collection[str] = ()) -> None:
    """A table on standard output, with the columns `left` aligned to the left and all others to the right.

    On a terminal that is narrower, it becomes several tables one below the other; see `narrow_table_lines`.
    """
    cells = list(zip(*rows, strict=True)) or [()] * len(headings)
    columns = [Column(heading, heading in left, tuple(of)) for heading, of in zip(headings, cells, strict=True)]
    lines = table_lines(columns)
    if sys.stdout.isatty():
        width = shutil.get_terminal_size().columns - len(_INDENT)
        if any(cell_width(line) > width for line in lines):
            lines = narrow_table_lines(columns, width)
    for line in lines:
        result(f"{_INDENT}{line}" if line else "")


def result_json(content: dict[str, Any]) -> None:
    """The result as one JSON object on standard output; NaN and infinity, which JSON lacks, become null."""
    click.echo(json.dumps(_without_nan(content), indent=2, ensure_ascii=False, allow_nan=False))


def _without_nan(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _without_nan(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_without_nan(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def drop_failing_output() -> bool:
    """Whether standard output cannot be written; if so, what it holds is dropped, or Python would try it on leaving."""
    try:
        click.echo()
    except OSError:
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())
        return True
    return False
