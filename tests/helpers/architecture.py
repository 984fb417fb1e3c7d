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


def rooms() -> dict[str, str]:
    """The folders of the package that hold code, with the first sentence of what each says of itself, up to a colon or
    semicolon.
    """
    files = {path.parent.name: path.read_text(encoding="utf-8") for path in sorted(PACKAGE.glob("*/__init__.py"))}
    firsts = {room: (ast.get_docstring(ast.parse(text)) or "").splitlines()[0] for room, text in files.items()}
    return {room: re.split("[;:]", first)[0].rstrip(".") for room, first in firsts.items()}


def picture() -> str:
    """The architecture as a Mermaid flowchart, without arrows that follow from the others."""
    import grimp

    graph = grimp.build_graph("strandspring", cache_dir=None)
    inside = {room: {f"strandspring.{room}", *graph.find_descendants(f"strandspring.{room}")} for room in rooms()}
    below: dict[str, set[str]] = {room: set() for room in inside}
    for upper, lower in permutations(inside, 2):
        if any(graph.find_modules_directly_imported_by(module) & inside[lower] for module in inside[upper]):
            below[upper].add(lower)

    def reachable(room: str) -> set[str]:
        return below[room].union(*map(reachable, below[room]))

    lines = [f'    {room}["<b>{room}</b><br>{purpose}"]' for room, purpose in rooms().items()]
    for upper, direct in below.items():
        lines += [f"    {upper} --> {lower}" for lower in sorted(direct - set().union(*map(reachable, direct)))]
    return "\n".join(["flowchart TD", *lines, ""])


if __name__ == "__main__":
    PAGE.write_text(PICTURE.sub(lambda _: picture(), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
