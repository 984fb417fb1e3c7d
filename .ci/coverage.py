"""Branch coverage of the package: of Python by coverage.py, of C by gcov; what is not covered is listed.

usage: python .ci/coverage.py [TESTS AND OPTIONS OF PYTEST...], with strandspring[dev] and gcc

The Python tests run with the kernel compiled to count; what is in FMUs besides is counted while the fuzzers of FMI
calls run, and the Python inside FMUs as that of the package. The pages are written to coverage/: python.txt and c.txt
with the lines and the branches that were never taken, of each file.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAGES = ROOT / "coverage"
PACKAGE = ROOT / "fmu_src" / "strandspring"
sys.path[:0] = [str(ROOT / "tests" / folder) for folder in ("helpers", "fuzz")]

import instrumented  # noqa: E402
import program  # noqa: E402

COUNTING = ("-O0", "--coverage", "-fprofile-update=atomic")
FORMS = ("spring", "table", "states", "branches", "branches-states", "system")
SEQUENCES = 500
SETTINGS = """\
[run]
branch = true
parallel = true
include =
    {package}/*
    */resources/strandspring*/core/*
patch = subprocess
data_file = {data}
[paths]
core =
    {package}/core
    */resources/strandspring*/core
[report]
include = {package}/*
show_missing = true
skip_covered = true
exclude_also =
    if TYPE_CHECKING:
    if __name__ == .__main__.:
"""


def python_tests(arguments: list[str], folder: Path) -> str:
    """Run the tests, and return the table of what they leave out."""
    (folder / "kernel").mkdir()
    kernel = instrumented.build(folder / "kernel", COUNTING)
    settings = folder / "settings"
    settings.write_text(SETTINGS.format(data=folder / "data", package=PACKAGE))
    environment = {**os.environ, instrumented.VARIABLE: str(kernel), "COVERAGE_RCFILE": str(settings)}
    command = [sys.executable, "-m", "coverage"]
    subprocess.run(
        [*command, "run", "-m", "pytest", "-p", "instrumented", *arguments], cwd=ROOT, env=environment, check=False
    )
    # What no test imports is not covered either.
    everything = [*command, "run", "--source", str(PACKAGE), "-m", "strandspring", "--version"]
    subprocess.run(everything, cwd=ROOT, env=environment, check=True)
    subprocess.run([*command, "combine", "--quiet"], cwd=ROOT, env=environment, check=True)
    done = subprocess.run([*command, "report"], cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    return done.stdout


def fuzzed(folder: Path) -> None:
    """Run the fuzzers of FMI calls, compiled to count."""
    for form in FORMS:
        (folder / form).mkdir()
        built = program.program_of(form, folder / form, (*COUNTING, "-g"))
        print(f"{form}: {SEQUENCES} sequences {program.run(built, 1, SEQUENCES)[0]}", flush=True)


def counts(folder: Path) -> dict[str, tuple[dict[int, int], dict[tuple[int, int], int]]]:
    """Executions of each line, and of each branch of a line, by the file's path in the package."""
    lines: dict[str, dict[int, int]] = defaultdict(lambda: defaultdict(int))
    branches: dict[str, dict[tuple[int, int], int]] = defaultdict(lambda: defaultdict(int))
    for file in _reports(folder):
        name = _in_package(Path(os.path.normpath(file["file"])))
        if name is None:
            continue
        for line in file["lines"]:
            number = line["line_number"]
            lines[name][number] += line["count"]
            for k, branch in enumerate(line["branches"]):
                branches[name][number, k] += branch["count"]
    return {name: (dict(lines[name]), dict(branches[name])) for name in sorted(lines)}


def _in_package(file: Path) -> str | None:
    """The path of a C file in the package, of which the fuzzers have copies; None if it is another's."""
    if file.is_relative_to(PACKAGE):
        return str(file.relative_to(PACKAGE))
    # What is in the kernel alone is in no FMU.
    same = sorted(path for path in PACKAGE.rglob(file.name) if "kernel" not in path.relative_to(PACKAGE).parts)
    return str(same[0].relative_to(PACKAGE)) if same and not file.is_relative_to(ROOT) else None


def _reports(folder: Path) -> Iterator[dict[str, Any]]:
    for data in folder.rglob("*.gcda"):
        command = ["gcov", "--json-format", "--branch-probabilities", "--stdout", data.name]
        done = subprocess.run(command, cwd=data.parent, capture_output=True, text=True, check=True)
        for text in done.stdout.splitlines():
            yield from json.loads(text)["files"]


def table(found: dict[str, tuple[dict[int, int], dict[tuple[int, int], int]]]) -> str:
    """One line for each file that is not covered whole, and the sum."""
    rows, total = [], [0, 0, 0, 0]
    for name, (lines, branches) in found.items():
        missed = [number for number, count in sorted(lines.items()) if count == 0]
        untaken = sorted({number for (number, _), count in branches.items() if count == 0} - set(missed))
        figures = [len(lines), len(missed), len(branches), sum(count == 0 for count in branches.values())]
        total = [a + b for a, b in zip(total, figures, strict=True)]
        if figures[1] or figures[3]:
            where = f"lines {_ranges(missed)}" * bool(missed) + f" branches of {_ranges(untaken)}" * bool(untaken)
            rows.append(f"{name:38}{figures[0]:7}{figures[1]:7}{figures[2]:9}{figures[3]:9}  {where.strip()}")
    heads = f"{'file':38}{'lines':>7}{'missed':>7}{'branches':>9}{'untaken':>9}"
    share = 100.0 * (1.0 - (total[1] + total[3]) / max(total[0] + total[2], 1))
    end = f"{'all':38}{total[0]:7}{total[1]:7}{total[2]:9}{total[3]:9}  {share:.1f} % of lines and branches"
    return "\n".join([heads, *rows, end, ""])


def _ranges(numbers: list[int]) -> str:
    """Numbers with those that follow each other as a range."""
    ranges: list[list[int]] = []
    for number in numbers:
        if ranges and number == ranges[-1][-1] + 1:
            ranges[-1] = [ranges[-1][0], number]
        else:
            ranges.append([number, number])
    return ", ".join(str(low) if low == high else f"{low}-{high}" for low, high in ranges)


def main() -> None:
    PAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (PAGES / "python.txt").write_text(python_tests(sys.argv[1:], folder), encoding="utf-8")
        fuzzed(folder)
        (PAGES / "c.txt").write_text(table(counts(folder)), encoding="utf-8")
    for page in ("python.txt", "c.txt"):
        print((PAGES / page).read_text(encoding="utf-8").splitlines()[-1])


if __name__ == "__main__":
    main()
