"""What people see: progress and messages on standard error, results on standard output.

rich takes as long to import as the rest of a short command, so that it is imported only to draw something.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any, TypeVar

import click

Item = TypeVar("Item")


def _is_watched() -> bool:
    """Whether standard error is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()


def progress(items: Sequence[Item], description: str) -> Iterable[Item]:
    """The items, with a progress bar on a terminal if there are several."""
    if not _is_watched() or len(items) < 2:
        return items
    from rich.console import Console
    from rich.progress import track

    return track(items, description=description, console=Console(stderr=True), transient=True)


def working(description: str) -> AbstractContextManager[Any]:
    """A spinner on a terminal for one long step."""
    if not _is_watched():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(description)


@contextmanager
def advancing(description: str, total: int) -> Iterator[Callable[[int], None]]:
    """A progress bar on a terminal, and a function that takes the number of parts done so far."""
    if not _is_watched():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress

    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(description, total=total)
        yield lambda count: bar.update(task, completed=count)


@contextmanager
def reporting() -> Iterator[Callable[[str, float, int], None]]:
    """A progress bar on a terminal, and a function that takes what is being done, the parts done, and their number."""
    if not _is_watched():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda what, done, total: bar.update(task, description=what, completed=done, total=total)


def note(text: str) -> None:
    """A message on standard error."""
    click.echo(text, err=True)


def result(text: str) -> None:
    """A line of the result on standard output."""
    click.echo(text)


def result_table(headings: Sequence[str], rows: Iterable[Sequence[str]], left: Collection[str] = ()) -> None:
    """A table on standard output, with the columns `left` aligned to the left and all others to the right."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for heading in headings:
        table.add_column(heading, justify="left" if heading in left else "right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    # Wider than any row: a terminal may wrap lines, a file keeps them.
    console = Console(width=100_000, markup=False, emoji=False, highlight=False)
    with console.capture() as capture:
        console.print(table)
    for line in capture.get().splitlines():
        result(f"  {line.rstrip()}")


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
