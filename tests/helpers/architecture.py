"""The picture in ARCHITECTURE.md, drawn from the package's imports: python tests/helpers/architecture.py

Run as a program it writes the picture into that page; a test compares the two.
"""

from __future__ import annotations

import ast
import re
from itertools import permutations
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "ARCHITECTURE.md"
PACKAGE = ROOT / "fmu_src" / "strandspring"
PICTURE = re.compile(r"(?<=```mermaid\n).*?(?=```\n)", re.DOTALL)


def rooms() -> list[str]:
    """The folders of the package that hold code."""
    return sorted(path.parent.name for path in PACKAGE.glob("*/__init__.py"))


def purpose(room: str) -> str:
    """The first sentence of what a room says of itself, up to a colon or semicolon."""
    docstring = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text(encoding="utf-8"))) or ""
    return re.split("[;:]", docstring.splitlines()[0])[0].rstrip(".")


def arrows() -> list[tuple[str, str]]:
    """Which room imports from which, without those that follow from the others."""
    import grimp

    graph = grimp.build_graph("strandspring", cache_dir=None)
    inside = {room: {f"strandspring.{room}", *graph.find_descendants(f"strandspring.{room}")} for room in rooms()}
    below: dict[str, set[str]] = {room: set() for room in inside}
    for upper, lower in permutations(inside, 2):
        if any(graph.find_modules_directly_imported_by(module) & inside[lower] for module in inside[upper]):
            below[upper].add(lower)

    def reachable(room: str) -> set[str]:
        return below[room].union(*map(reachable, below[room]))

    return sorted(
        (upper, lower)
        for upper, direct in below.items()
        for lower in direct
        if not any(lower in reachable(other) for other in direct - {lower})
    )


def picture() -> str:
    """The architecture as a Mermaid flowchart."""
    lines = ["flowchart TD", *(f'    {room}["<b>{room}</b><br>{purpose(room)}"]' for room in rooms())]
    return "".join(f"{line}\n" for line in [*lines, *(f"    {upper} --> {lower}" for upper, lower in arrows())])


if __name__ == "__main__":
    PAGE.write_text(PICTURE.sub(lambda _: picture(), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
