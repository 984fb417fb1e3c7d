"""Static analysis of all C sources of the package by clang-tidy, for the systems that they are compiled for.

usage: python .ci/analyse_c.py, with the package on the path and clang-tidy installed; ends with 1 if anything is found.
"""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from strandspring.compiled.images import KERNEL, OF_FMUS
from strandspring.compiled.targets import FLAGS

TIDY = ["clang-tidy", "--quiet", f"--config-file={Path(__file__).with_name('clang-tidy.yaml')}"]


def folder(module: str) -> Path:
    """Of an installed package."""
    spec = find_spec(module)
    if spec is None or spec.origin is None:
        sys.exit(f"{module} is not installed.")
    return Path(spec.origin).parent


def main() -> None:
    package = folder("strandspring")
    headers = f"-I{folder('fmpy') / 'c-code'}"
    windows = ["-target", "x86_64-windows-gnu", f"-isystem{folder('ziglang') / 'lib/libc/include/any-windows-any'}"]
    units = [(file, [*FLAGS, *unit.flags, headers]) for unit in (KERNEL, *OF_FMUS) for file in unit.files]
    units += [("compiled/windows_runtime.c", [*FLAGS, *windows])]
    failures = 0
    for file, flags in units:
        done = subprocess.run([*TIDY, file, "--", *flags], cwd=package, check=False)
        failures += done.returncode != 0
        print(f"{file}{' for Windows' if windows[1] in flags else ''}: {'found' if done.returncode else 'nothing'}")
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
