"""Around calls of libraries: whatever they report about a damaged file becomes one sentence, and they print nothing."""

from __future__ import annotations

import contextlib
import gc
import io
import logging
import re
import sys
import traceback
import warnings
from collections.abc import Iterator

from ...errors import RecordError
from ...ground.quoting import quoted

_OBJECT = re.compile(r"<[\w.]+ object at 0x[0-9a-fA-F]+>")  # the bytes of the file, as libraries name them


@contextlib.contextmanager
def guarded(kind: str, where: str) -> Iterator[None]:
    """Turn whatever a library reports about a damaged file into one sentence, and let it print nothing.

    Parameters
    ----------
    kind : str    Of the file, with its article.
    where : str   The file, for messages.
    """
    logged, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    sys.unraisablehook = lambda _: None
    printed = io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            warnings.simplefilter("ignore")
            try:
                yield
            except BaseException as problem:
                _close_files(problem)
                raise _refusal(problem, kind, where) from None
    finally:
        logging.disable(logged)
        sys.unraisablehook = hook


def damaged(kind: str, where: str, reason: str) -> RecordError:
    """The refusal of a file that a library cannot read."""
    return RecordError(
        f"{where}: is {kind} that is damaged or cut off, or of a kind that cannot be read ({reason}); export the "
        "record again, or as CSV."
    )


def _refusal(problem: BaseException, kind: str, where: str) -> BaseException:
    # Libraries report damaged files by exceptions of every kind, those in Rust by a BaseException.
    if isinstance(problem, RecordError) or not (
        isinstance(problem, Exception) or type(problem).__name__ == "PanicException"
    ):
        return problem
    if isinstance(problem, ImportError):
        return RecordError(
            f"{where}: is {kind}, which needs {problem.name or 'a library'} to be read; "
            'install it with pip install "strandspring[formats]".'
        )
    if isinstance(problem, MemoryError):
        return damaged(kind, where, "it declares more data than fits into memory")
    text = " ".join(_OBJECT.sub("the file", str(problem)).split())
    return damaged(kind, where, quoted(text) if text else type(problem).__name__)


def _close_files(problem: BaseException | None) -> None:
    """Let go of what libraries leave open, which complains when it is collected later."""
    while problem is not None:
        traceback.clear_frames(problem.__traceback__)
        problem = problem.__context__
    gc.collect()
