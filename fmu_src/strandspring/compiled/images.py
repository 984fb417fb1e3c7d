"""Finished images of the package's C units, and where they are found.

An image's file name holds a digest of all it is compiled from, so that a changed source never meets an old image. A
wheel carries images in the folder ``images``; those that are not there, as in a source checkout, are compiled once and
kept in the user's cache.
"""

from __future__ import annotations

import atexit
import hashlib
import shutil
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from ..errors import BuildError, StrandspringError
from ..files import replacing, user_cache
from . import zig
from .targets import FLAGS, Target

_PACKAGE = Path(__file__).resolve().parent.parent
PACKAGED = _PACKAGE / "compiled" / "images"

FMI_HEADERS = ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h")

_KEPT_FOR = 30 * 24 * 3600.0  # [s]


@dataclass(frozen=True)
class Unit:
    """C sources of the package that become one shared library.

    Attributes
    ----------
    name : str                  Of the library, without suffix.
    file : str                  To be compiled; it includes the others.
    parts : tuple of str        Folders of the sources, or single ones, below the package.
    flags : tuple of str        Besides those of every library.
    fmi : bool                  Whether the headers of FMI are needed.
    loads : bool                Whether it loads other libraries at run time.
    """

    name: str
    file: str
    parts: tuple[str, ...]
    flags: tuple[str, ...] = ()
    fmi: bool = False
    loads: bool = False

    def sources(self) -> dict[str, bytes]:
        """Content of each C file by its path below the package."""
        parts = [_PACKAGE / part for part in self.parts]
        inside = [path for part in parts if part.is_dir() for path in part.iterdir() if path.suffix in (".c", ".h")]
        paths = [*inside, *(part for part in parts if not part.is_dir())]
        return {path.relative_to(_PACKAGE).as_posix(): path.read_bytes() for path in sorted(paths)}

    def file_name(self, target: Target) -> str:
        """Of the image for a target."""
        digest = hashlib.sha256(repr((FLAGS, self, target, target.system)).encode() + zig.runtime(target))
        for path, content in self.sources().items():
            digest.update(f"{path} {len(content)} ".encode() + content)
        return f"{self.name}-{target.triple}-{digest.hexdigest()[:16]}{target.system.suffix}"


KERNEL = Unit("kernel", "kernel/c/kernel.c", ("core/c", "kernel/c"), ("-O3",))
# -O3 makes it a tenth larger, and no step faster.
FMU = Unit("spring", "core/c/all.c", ("core/c",), ("-O2", "-fvisibility=hidden"), fmi=True)
# The binary of a Python-backed FMU, the same for all springs.
BRIDGE = Unit(
    "bridge",
    "fmu/bridge/bridge.c",
    ("fmu/bridge", *(f"core/c/{name}" for name in ("fmi2_api.h", "fmi2_calls.h", "fmi2_log.c", "fmi2_log.h",
                                                   "fmi2_states.c", "fmi2_states.h", "spring_local.h",
                                                   "spring_number.h"))),
    ("-O2", "-fvisibility=hidden"),
    fmi=True,
    loads=True,
)  # fmt: skip


@cache
def image(unit: Unit, target: Target) -> Path:
    """The image of a unit for a target, compiled now if there is none.

    Raises
    ------
    BuildError   If it would have to be compiled and ziglang is not installed, or fails.
    """
    found = _found(unit, target)
    if found is not None:
        return found
    if not zig.is_installed():
        raise BuildError(
            f"The compiled {unit.name} for {target.triple} is missing, and ziglang, which compiles it, is not "
            "installed; run pip install ziglang, or install strandspring from a wheel."
        )
    print(f"Compiling the {unit.name} for {target.triple}, once for these C sources.", file=sys.stderr)
    content = compiled(unit, target)
    name = unit.file_name(target)
    try:
        with replacing(user_cache() / name) as part:
            part.write_bytes(content)
        _discard_old(user_cache())
        return user_cache() / name
    except (StrandspringError, RuntimeError):  # RuntimeError: the user has no home
        folder = Path(tempfile.mkdtemp(prefix="strandspring-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        (folder / name).write_bytes(content)
        return folder / name


def compiled(unit: Unit, target: Target) -> bytes:
    """The image of a unit, compiled now."""
    sources = unit.sources()
    if unit.fmi:
        sources |= {f"core/c/{name}": fmi_header(name) for name in FMI_HEADERS}
    loading = target.system.loading if unit.loads else ()
    return zig.shared_library(target, sources, unit.file, unit.name, unit.flags, loading)


def fmi_header(name: str) -> bytes:
    """A header of FMI 2.0, which FMPy brings.

    Raises
    ------
    BuildError   If it is not there.
    """
    # Not by importing it, which takes long.
    found = find_spec("fmpy")
    folders = [] if found is None else list(found.submodule_search_locations or ())
    try:
        return Path(*folders, "c-code", name).read_bytes()
    except OSError:
        raise BuildError(f"The header {name} is missing; install fmpy 0.3.20 or newer.") from None


def _found(unit: Unit, target: Target) -> Path | None:
    name = unit.file_name(target)
    folders = [PACKAGED]
    with suppress(RuntimeError):
        folders.append(user_cache())
    return next((folder / name for folder in folders if (folder / name).is_file()), None)


def _discard_old(folder: Path) -> None:
    for path in folder.iterdir():
        # Another process may be doing the same, or have the library loaded.
        with suppress(OSError):
            if path.stat().st_mtime < time.time() - _KEPT_FOR:
                path.unlink()
