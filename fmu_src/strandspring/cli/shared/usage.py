"""Values that a function refuses are wrong usage of its command; what a file holds is not."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import click

from ...errors import StrandspringError


@contextmanager
def values_as_usage() -> Iterator[None]:
    """Make a ValueError one of usage, but for refusals of data and models."""
    try:
        yield
    except StrandspringError:
        raise
    except ValueError as problem:
        raise click.UsageError(str(problem)) from None
