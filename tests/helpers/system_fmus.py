"""FMUs of the examples' springs for the tests, each built once."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

from strandspring.examples import mounts

_FOLDER = tempfile.TemporaryDirectory(prefix="strandspring-fmus-", ignore_cleanup_errors=True)


@cache
def fmu(name: str, backend: str = "native") -> Path:
    """The FMU of a spring by its name in `mounts`, such as "EQUIPMENT_MOUNT"."""
    return mounts.build_example_fmu(getattr(mounts, name), f"{name.lower()}_{backend}", Path(_FOLDER.name), backend)
