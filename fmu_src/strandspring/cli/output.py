"""What people see: progress and messages on standard error, results on standard output."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import click
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, track

Item = TypeVar("Item")


def progress(items: Sequence[Item], description: str) -> Iterable[Item]:
    """The items with a progress bar on standard error, if somebody watches and there are several."""
    console = Console(stderr=True)
    quiet = not console.is_terminal or len(items) < 2
    return track(items, description=description, console=console, transient=True, disable=quiet)


def working(description: str) -> Any:
    """A spinner on standard error for one long step, shown only to somebody who watches."""
    return Console(stderr=True).status(description)


@contextmanager
def advancing(description: str, total: int) -> Iterator[Callable[[int], None]]:
    """A progress bar on standard error, if somebody watches, and a function that takes how many are done by now."""
    console = Console(stderr=True)
    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(description, total=total)

        def done(count: int) -> None:
            bar.update(task, completed=count)

        yield done


def note(text: str) -> None:
    """A message on standard error."""
    click.echo(text, err=True)


def result(text: str) -> None:
    """A line of the result on standard output."""
    click.echo(text)


def drop_failing_output() -> bool:
    """Whether standard output cannot be written; then what it holds is dropped, or Python would try it on leaving."""
    try:
        click.echo()
    except OSError:
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())
        return True
    return False


def result_json(content: dict[str, Any]) -> None:
    """The result as one JSON object on standard output."""
    click.echo(json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False))
