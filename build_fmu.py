"""Identify a measured record (the bundled one by default), build its FMU, validate it and run it.

python build_fmu.py [MODEL.json | RECORD.csv ...] [-o DIR] [--backend native|python|both]; see `--help`. The bundled
record is built with both back ends.
"""

import sys

# The folder of this file comes first on the path, and records may lie there.
if not getattr(sys.flags, "safe_path", sys.flags.isolated):
    del sys.path[0]

from contextlib import suppress
from pathlib import Path

from strandspring.cli.main import main

if __name__ == "__main__":
    models = Path(__file__).resolve().parent / "models"
    with suppress(ValueError):  # called from elsewhere: keep the absolute path
        models = models.relative_to(Path.cwd())
    main(["build", "--models", str(models), *sys.argv[1:]])
