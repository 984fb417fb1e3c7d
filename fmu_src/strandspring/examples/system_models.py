"""The example systems: python -m strandspring.examples.system_models FOLDER copies them into a new folder.

Their springs are synthesized, not measured: plausible parameters of wire-rope mounts give records of cyclic tests at
15 to 100 % of the half range with 1 % of noise, those of a recoil spring the campaign of `strandspring.examples.paper`,
and a model file is what `strandspring.identify` finds in these, with its uncertainty.
"""

from __future__ import annotations

import sys
from pathlib import Path

SYSTEMS = Path(__file__).with_name("systems")


def main() -> None:
    if len(sys.argv) != 2:
        sys.exit("Usage: python -m strandspring.examples.system_models FOLDER, the name of a new folder.")
    folder = Path(sys.argv[1])
    try:
        folder.mkdir(parents=True)
    except OSError as problem:
        sys.exit(f"{folder}: {problem.strerror}; give the name of a new folder.")
    for file in SYSTEMS.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())


if __name__ == "__main__":
    main()
