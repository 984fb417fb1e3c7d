"""The budget of lines and files: the build fails where a folder of the package or of the tests is above its own.

usage: python .ci/budget.py [--fall]; with `--fall` limits above what stands are lowered to it

`.ci/budget` states lines and files of each folder, and the bytes of a line in the mean. All text that git keeps counts
but recorded data: records, corpora, golden outputs, models and pictures. A limit rises by what an issue states only,
and the commit that moves it says why. A file of code has at most 900 lines, a function of Python at most 80 beside its
docstring.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import tomllib

ROOT = Path(__file__).resolve().parents[1]
BUDGET = ROOT / ".ci" / "budget"
PLACES = {"package": "fmu_src/strandspring/", "tests": "tests/"}
TEXT = frozenset({".py", ".c", ".h", ".inc", ".m", ".mo", ".html", ".css", ".js", ".j2"})
TEXT |= {".md", ".toml", ".txt"}
RECORDED = ("tests/data/", "tests/fuzz/corpus/", "fmu_src/strandspring/examples/systems/")
LONGEST_FILE, LONGEST_FUNCTION = 900, 80


def counted(place: str) -> dict[str, tuple[int, int, int]]:
    """Lines, files and bytes of the text in each folder of a place, "." for files beside the folders."""
    lines: Counter[str] = Counter()
    files: Counter[str] = Counter()
    size: Counter[str] = Counter()
    for path in texts(PLACES[place]):
        folder = path.split("/")[PLACES[place].count("/")] if path.count("/") > PLACES[place].count("/") else "."
        content = (ROOT / path).read_bytes()
        lines[folder] += content.count(b"\n")
        files[folder] += 1
        size[folder] += len(content)
    return {folder: (lines[folder], files[folder], size[folder]) for folder in sorted(lines)}


def texts(place: str) -> list[str]:
    """Paths of the text under a place that git keeps, without recorded data."""
    listed = subprocess.run(["git", "ls-files", place], cwd=ROOT, capture_output=True, text=True, check=True)
    paths = listed.stdout.splitlines()
    return [path for path in paths if Path(path).suffix in TEXT and not path.startswith(RECORDED)]


def too_long() -> Iterator[str]:
    """Files and functions that are longer than a person reads."""
    for place in PLACES.values():
        for path in texts(place):
            if Path(path).suffix not in {".py", ".c", ".h"}:
                continue
            source = (ROOT / path).read_text()
            if (count := source.count("\n")) > LONGEST_FILE:
                yield f"{path}: {count} lines, at most {LONGEST_FILE}; divide it by what may change by itself."
            if path.endswith(".py"):
                yield from (f"{path}: {text}" for text in _long_functions(ast.parse(source)))


def _long_functions(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            count = node.end_lineno - body[0].lineno + 1 if body and node.end_lineno else 0
            if count > LONGEST_FUNCTION:
                yield f"`{node.name}` has {count} lines beside its docstring, at most {LONGEST_FUNCTION}."


def main(arguments: list[str]) -> int:
    """Compare, and tell; exit status 1 if anything is above its limit."""
    budget = tomllib.loads(BUDGET.read_text())
    found, written = list(too_long()), []
    for place, limits in budget.items():
        folders = counted(place)
        bytes_a_line = sum(size for *_, size in folders.values()) / sum(lines for lines, *_ in folders.values())
        if bytes_a_line > limits["bytes_a_line"]:
            found.append(f"{place}: {bytes_a_line:.2f} bytes a line, at most {limits['bytes_a_line']}.")
        written += [f"[{place}]", f"bytes_a_line = {limits['bytes_a_line']}"]
        total = 0
        for folder, (lines, files, _) in folders.items():
            most = limits.get(folder, [0, 0])
            if lines > most[0] or files > most[1]:
                found.append(f"{place}/{folder}: {lines} lines in {files} files, at most {most[0]} in {most[1]}.")
            total += lines
            written.append(f'"{folder}" = [{min(lines, most[0])}, {min(files, most[1])}]')
        print(f"{place}: {total} lines")
        written.append("")
    if "--fall" in arguments:
        BUDGET.write_text("# Lines and files of each folder; see budget.py.\n" + "\n".join(written[:-1]) + "\n")
    print("\n".join(found) or "Within the budget.")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
