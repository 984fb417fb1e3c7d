"""What a report may be called."""

from __future__ import annotations

from pathlib import Path

from ...errors import StrandspringError

SUFFIXES = (".html", ".pdf")


def check_report_path(path: str | Path) -> None:
    """Refuse a report of another kind than HTML or PDF, or a PDF without what makes it, before the work begins.

    Raises
    ------
    StrandspringError   With what to do.

    Examples
    --------
    >>> check_report_path("spring.html")
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise StrandspringError(f"A report must end in {' or '.join(SUFFIXES)}, got {str(path)!r}; choose one of them.")
    if suffix == ".pdf":
        from .document import check_typst

        check_typst()
