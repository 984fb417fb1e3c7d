"""Tables as text, for summaries."""

from __future__ import annotations

from collections.abc import Collection, Sequence


def table_lines(headings: Sequence[str], rows: Sequence[Sequence[str]], left: Collection[str] = ()) -> list[str]:
    """A table with the columns `left` aligned to the left and all others to the right.

    Examples
    --------
    >>> table_lines(["name", "N"], [["kappa_omega", "25"], ["rho", "7"]], left=["name"])
    ['  name          N', '  kappa_omega  25', '  rho           7']
    """
    cells = [list(headings), *map(list, rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    sides = ["<" if heading in left else ">" for heading in headings]
    return [
        "  " + "  ".join(f"{cell:{side}{width}}" for cell, side, width in zip(row, sides, widths, strict=True)).rstrip()
        for row in cells
    ]
