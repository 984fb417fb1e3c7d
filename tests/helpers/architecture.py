"""The picture in ARCHITECTURE.md, drawn from the package's imports: python tests/helpers/architecture.py

Run as a program it writes the picture into that page; a test compares the two.
"""

from __future__ import annotations

import ast
from itertools import product
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "ARCHITECTURE.md"
PACKAGE = ROOT / "fmu_src" / "strandspring"
BEGIN, END = "```mermaid\n", "```\n"


def rooms() -> list[str]:
    """The folders of the package that hold code."""
    return sorted(path.parent.name for path in PACKAGE.glob("*/__init__.py"))


def purpose(room: str) -> str:
    """The first sentence of what a room says of itself, up to a colon or semicolon."""
    docstring = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text(encoding="utf-8"))) or ""
    return docstring.splitlines()[0].split(";")[0].split(":")[0].rstrip(".")


def arrows() -> list[tuple[str, str]]:
    """Which room imports from which, without those that follow from the others."""
    graph = grimp.build_graph("strandspring", cache_dir=None)
    inside = {room: {f"strandspring.{room}", *graph.find_descendants(f"strandspring.{room}")} for room in rooms()}
    direct = {
        (upper, lower)
        for upper, lower in product(inside, repeat=2)
        if upper != lower
        and any(graph.find_modules_directly_imported_by(module) & inside[lower] for module in inside[upper])
    }
    below: dict[str, set[str]] = {room: {lower for upper, lower in direct if upper == room} for room in inside}

    def reachable(room: str) -> set[str]:
        return below[room].union(*(reachable(lower) for lower in below[room]))

    return sorted(
        (upper, lower)
        for upper, lower in direct
        if not any(lower in reachable(other) for other in below[upper] - {lower})
    )


def picture() -> str:
    """The architecture as a Mermaid flowchart."""
    lines = ["flowchart TD"]
    lines += [f'    {room}["<b>{room}</b><br>{purpose(room)}"]' for room in rooms()]
    lines += [f"    {upper} --> {lower}" for upper, lower in arrows()]
    return "".join(f"{line}\n" for line in lines)


def picture_in_page() -> str:
    """What the page shows."""
    text = PAGE.read_text(encoding="utf-8")
    return text.split(BEGIN, 1)[1].split(END, 1)[0]


def main() -> None:
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN, 1)
    _, after = rest.split(END, 1)
    PAGE.write_text(before + BEGIN + picture() + END + after, encoding="utf-8")


if __name__ == "__main__":
    main()
