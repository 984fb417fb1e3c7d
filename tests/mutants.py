"""Mutation check: small changes of the package, drawn by a seed, of which the default tier of tests must notice most.

usage: python tests/mutants.py [--seed TEXT] [--python 70] [--c 30] [--whole] [--only NUMBERS]
                               [--of FOLDERS [--by TESTS]]

Each mutant is one change of one line in a copy of the checkout: another comparison, sign, product, number, Boolean or
condition. The tests that executed the line come first, for C the tests that speak to it, and then, with --whole, all of
the default tier; the first that fails, and passes without it, kills the mutant. A mutant that hangs, or with which
pytest can collect nothing, counts as killed. Two run at a time, each in its own copy. Which test executes which line is
measured once for each state of the sources, and kept in the folder for temporary files. While tests of one subject are
written, `--of` draws from its folders or files of the package, and `--by` names the only tests that run.
Exit status 1 if less than 85 of 100 are killed.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import os
import random
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from queue import Queue

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = Path("fmu_src/strandspring")
ASKED = 0.85  # share of the mutants that the tests must kill
MOST_TESTS = 400  # that run for a line, in their names' order; common lines are executed by thousands
# These speak to C, of which nobody measures what they execute.
OF_C = ["tests/core", "tests/kernel", "tests/test_in_systems.py", "tests/fmi", "tests/systems"]
# Of a run of tests [s], after which a mutant hangs; the whole tier takes a quarter of an hour in one of two processes.
PATIENCE, WHOLE_PATIENCE = 900.0, 3600.0
SETTINGS = """\
[run]
dynamic_context = test_function
source_pkgs = strandspring
data_file = {data}
"""
COMPARISONS = {ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "=="}
COMPARISONS |= {ast.Is: "is not", ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in"}
OPERATORS = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*"}
# In C between blanks, where * is a product; numbers are changed by themselves.
C_OPERATORS = {" < ": " <= ", " <= ": " < ", " > ": " >= ", " >= ": " > ", " == ": " != ", " != ": " == "}
C_OPERATORS |= {" + ": " - ", " - ": " + ", " * ": " / ", " / ": " * ", " && ": " || ", " || ": " && "}
C_TOKEN = re.compile("|".join(map(re.escape, C_OPERATORS)) + r"|(?<![\w.])\d+\.\d+(?![\w.])")


@dataclass(frozen=True)
class Mutant:
    """A change of the characters from `begin` to `end` of a line, counted from 1, of a file of the package."""

    file: Path
    line: int
    begin: int
    end: int
    text: str

    def applied(self, source: str) -> str:
        """The source with the change."""
        lines = source.splitlines(keepends=True)
        old = lines[self.line - 1]
        lines[self.line - 1] = old[: self.begin] + self.text + old[self.end :]
        return "".join(lines)

    def __str__(self) -> str:
        old = (ROOT / self.file).read_text().splitlines()[self.line - 1]
        new = old[: self.begin] + self.text + old[self.end :]
        return f"{self.file.relative_to(PACKAGE)}:{self.line}: {old.strip()}  ->  {new.strip()}"


def python_mutants(file: Path) -> Iterator[Mutant]:
    """All mutants of a file of Python."""
    source = (ROOT / file).read_text()
    lines = source.splitlines()
    tree = ast.parse(source)
    untouched = {child for node in ast.walk(tree) for child in _without_effect(node)}
    for node in ast.walk(tree):
        if node in untouched or getattr(node, "lineno", 0) != getattr(node, "end_lineno", -1):
            continue
        line = lines[node.lineno - 1]
        if not line.isascii():
            continue  # columns count bytes
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield _between(file, line, node.left, node.comparators[0], COMPARISONS[type(node.ops[0])])
        elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            yield _between(file, line, node.left, node.right, OPERATORS[type(node.op)])
        elif isinstance(node, ast.BoolOp) and len(node.values) == 2:
            yield _between(file, line, *node.values, "or" if isinstance(node.op, ast.And) else "and")
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield Mutant(file, node.lineno, node.col_offset, node.end_col_offset, str(not node.value))
        elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            number = 2 * node.value if isinstance(node.value, float) and node.value else node.value + 1
            yield Mutant(file, node.lineno, node.col_offset, node.end_col_offset, repr(number))
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
            sign = "not" if isinstance(node.op, ast.Not) else "-"
            yield Mutant(file, node.lineno, node.col_offset, node.col_offset + len(sign), "")


def _between(file: Path, line: str, left: ast.expr, right: ast.expr, new: str) -> Mutant:
    """Another operator between two operands of a line, whose parentheses stay."""
    assert left.end_col_offset is not None
    operator = re.search(r"[^\s()]+(?: not| in)?(?=[\s()]|$)", line[left.end_col_offset : right.col_offset])
    assert operator is not None, line
    begin = left.end_col_offset + operator.start()
    return Mutant(file, left.lineno, begin, begin + len(operator[0]), new)


def _without_effect(node: ast.AST) -> Iterator[ast.AST]:
    """What no test can notice: annotations, texts, and what is only for type checkers."""
    if isinstance(node, ast.arg | ast.AnnAssign) and node.annotation is not None:
        yield from ast.walk(node.annotation)
    if isinstance(node, ast.FunctionDef) and node.returns is not None:
        yield from ast.walk(node.returns)
    if isinstance(node, ast.JoinedStr | ast.Assert) or _is_for_checkers(node):
        yield from ast.walk(node)


def _is_for_checkers(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def c_mutants(file: Path) -> Iterator[Mutant]:
    """All mutants of a file of C."""
    source = (ROOT / file).read_text()
    # Comments and preprocessor lines as blanks, so that places stay.
    bare = re.sub(r"/\*.*?\*/|//[^\n]*|^#(?:[^\n]*\\\n)*[^\n]*|\"[^\"\n]*\"", _blank, source, flags=re.S | re.M)
    for number, line in enumerate(bare.splitlines(), 1):
        for token in C_TOKEN.finditer(line):
            new = C_OPERATORS.get(token[0]) or repr(2.0 * float(token[0]) or 1.0)
            yield Mutant(file, number, token.start(), token.end(), new)


def _blank(match: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", match[0])


def drawn(seed: str, python: int, c: int, folders: list[str]) -> list[Mutant]:
    """So many mutants of Python and of C, a line at most once, from all that there are below some folders."""
    generator = random.Random(seed)
    chosen = []
    for suffixes, count, all_of in (((".py",), python, python_mutants), ((".c", ".h"), c, c_mutants)):
        files = [path.relative_to(ROOT) for path in sorted((ROOT / PACKAGE).rglob("*")) if path.suffix in suffixes]
        files = [file for file in files if any(file.is_relative_to(PACKAGE / folder) for folder in folders)]
        found = [mutant for file in files for mutant in all_of(file)]
        generator.shuffle(found)
        found = list({(mutant.file, mutant.line): mutant for mutant in found}.values())
        chosen += list(islice(filter(_is_program, found), count))
    return chosen


def _is_program(mutant: Mutant) -> bool:
    """Whether the mutant can be compiled; what cannot would be killed by no merit of a test."""
    if mutant.file.suffix == ".py":
        try:
            compile(mutant.applied((ROOT / mutant.file).read_text()), str(mutant.file), "exec")
        except SyntaxError:
            return False
    return True


class Tests:
    """Which tests execute a line."""

    def __init__(self) -> None:
        state = hashlib.sha256()
        for folder in (PACKAGE, Path("tests")):
            for path in sorted((ROOT / folder).rglob("*.[pch]*")):
                if path.is_file() and "__pycache__" not in path.parts:
                    state.update(path.read_bytes())
        self.kept = Path(tempfile.gettempdir()) / f"strandspring-executed-{state.hexdigest()[:16]}"
        if not self.kept.exists():
            self._measure()

    def _measure(self) -> None:
        print("measuring which tests execute which lines: some ten minutes", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            settings, data = Path(folder, "settings"), Path(folder, "data")
            settings.write_text(SETTINGS.format(data=data))
            command = [sys.executable, "-m", "coverage", "run", f"--rcfile={settings}", "-m", "pytest", "-q", "-n", "0"]
            subprocess.run([*command, "-p", "no:cacheprovider"], cwd=ROOT, check=False)
            shutil.move(data, self.kept)

    def of(self, mutant: Mutant) -> list[str]:
        """Files and names of tests for pytest, those that execute the line."""
        if mutant.file.suffix != ".py":
            return OF_C
        with sqlite3.connect(self.kept) as executed:
            rows = executed.execute(
                "SELECT context, numbits FROM line_bits JOIN file ON file.id = file_id JOIN context ON context.id ="
                " context_id WHERE path = ? AND context != ''",
                (str(ROOT / mutant.file),),
            ).fetchall()
        byte, bit = divmod(mutant.line, 8)
        names = [context for context, bits in rows if byte < len(bits) and bits[byte] >> bit & 1]
        return _as_arguments(sorted(names)[:MOST_TESTS])


def killer(copy: Path, mutant: Mutant, selected: list[str], whole: bool) -> str:
    """The first test that fails with a mutant in a copy, "hangs", or nothing if all pass."""
    path, source = copy / mutant.file, (ROOT / mutant.file).read_text()
    for run in ([selected] if selected else []) + ([[]] if whole or not selected else []):
        path.write_text(mutant.applied(source))
        try:
            done = _tested(copy, run, PATIENCE if run else WHOLE_PATIENCE)
        except subprocess.TimeoutExpired:
            return "hangs"
        finally:
            path.write_text(source)
        if done.returncode in (1, 2):
            said = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, re.M)
            if said and _tested(copy, [said[1]]).returncode:
                sys.exit(f"{said[1]} fails without a mutant, too.")
            return said[1] if said else done.stdout.strip().splitlines()[-1]
        if done.returncode not in (0, 5):
            if _tested(copy, ["--collect-only", *run]).returncode:
                sys.exit(done.stdout + done.stderr)
            return "collecting"
    return ""


def _tested(copy: Path, arguments: list[str], patience: float = PATIENCE) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(copy / "fmu_src"), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-xq", "-n0", "-pno:cacheprovider", "--no-header", *arguments]
    return subprocess.run(
        command, cwd=copy, env=environment, capture_output=True, text=True, timeout=patience, check=False
    )


def _as_arguments(contexts: list[str]) -> list[str]:
    """Contexts of coverage, "folder.module.test", as pytest names them."""
    modules = {path.stem: path.relative_to(ROOT) for path in (ROOT / "tests").rglob("test_*.py")}
    names = []
    for context in contexts:
        parts = context.split(".")
        place = next((k for k, part in enumerate(parts) if part in modules), None)
        if place is not None and place + 1 < len(parts):
            names.append(f"{modules[parts[place]]}::{'::'.join(parts[place + 1 :])}")
    return list(dict.fromkeys(names))


def main() -> int:
    """Draw, run and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False)
    parser.add_argument("--seed", default=head.stdout.strip())
    parser.add_argument("--python", type=int, default=70)
    parser.add_argument("--c", type=int, default=30)
    parser.add_argument("--whole", action="store_true", help="all of the default tier for those that survive")
    parser.add_argument("--only", nargs="+", type=int, help="these of those that are drawn, by their numbers")
    parser.add_argument("--of", nargs="+", default=["."], help="folders or files of the package")
    parser.add_argument("--by", nargs="+", default=[], help="the tests that run, instead of what is measured")
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    mutants = drawn(options.seed, options.python, options.c, options.of)
    tests = None if options.by else Tests()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        copies = Queue[Path]()
        for name in ("one", "two"):
            copies.put(Path(folder, name, "strandspring"))
            ignored = shutil.ignore_patterns(".git", ".venv", "__pycache__", "coverage", "*.egg-info")
            shutil.copytree(ROOT, Path(folder, name, "strandspring"), ignore=ignored)

        def tried(number: int, mutant: Mutant) -> bool:
            copy = copies.get()
            by = killer(copy, mutant, tests.of(mutant) if tests else options.by, options.whole)
            copies.put(copy)
            print(f"{number:3} {'killed by ' + by if by else 'SURVIVES'}\n    {mutant}", flush=True)
            return bool(by)

        chosen = options.only or range(1, len(mutants) + 1)
        killed = sum(pool.map(tried, chosen, [mutants[k - 1] for k in chosen]))
    print(f"{killed} of {len(chosen)} are killed")
    return int(killed < ASKED * len(chosen))


if __name__ == "__main__":
    sys.exit(main())
