"""The package's kernel compiled with other flags than usual: under sanitizers, or counting what is executed.

    python tests/helpers/instrumented.py [TESTS AND OPTIONS OF PYTEST...]

runs tests with the kernel under the sanitizers of addresses and of undefined behaviour, by default those of
tests/kernel. `.ci/coverage.py` counts. As a plugin of pytest (`-p instrumented`) this has the package load the library
that STRANDSPRING_KERNEL names; processes that tests start load the usual one.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from strandspring.compiled.images import KERNEL
from strandspring.kernel import library
from strandspring.records.formats import reader_process
from tools import program

VARIABLE = "STRANDSPRING_KERNEL"
PACKAGE = Path(library.__file__).parents[1]
ROOT = Path(__file__).parents[2]
SANITIZED = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")
_USUAL = ("-std=c11", "-g", "-ffp-contract=off", "-shared", "-fPIC")


def build(folder: Path, flags: tuple[str, ...]) -> Path:
    """The kernel as a shared library in a folder, where gcc leaves what belongs to it, too."""
    compiler = program("gcc", package="gcc libc6-dev")
    built = folder / "kernel.so"
    command = [compiler, *_USUAL, *flags, *(str(PACKAGE / file) for file in KERNEL.files), "-o", str(built), "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    return built


def pytest_configure() -> None:
    """Have the package load that library, if any, and wait for processes of readers, which are counted as they end."""
    stop = reader_process._stop

    def ended(process: subprocess.Popen[bytes]) -> None:
        with suppress(OSError, subprocess.TimeoutExpired):
            process.stdin.close()  # type: ignore[union-attr]
            process.wait(5.0)
        stop(process)

    reader_process._stop = ended
    if path := os.environ.get(VARIABLE):
        library.image = lambda *_: Path(path)  # type: ignore[assignment]


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        built = build(Path(folder), SANITIZED)
        # Python is not compiled with the sanitizer, which therefore has to be there first.
        shown = subprocess.run(["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=True)
        environment = {
            **os.environ,
            VARIABLE: str(built),
            "LD_PRELOAD": shown.stdout.strip(),
            "ASAN_OPTIONS": "detect_leaks=0",  # Python's own
        }
        command = [sys.executable, "-m", "pytest", "-n", "0", "-p", "instrumented", *(sys.argv[1:] or ["tests/kernel"])]
        return subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
