"""Finished images of the package's C units, and where they are found.

An image's file name holds a digest of all it is compiled from, so that a changed source never meets an old image. A
wheel carries images in the folder ``images``; those that are not there, as in a source checkout, are compiled once and
kept in the user's cache or, if that cannot be written, in a folder of the user among the temporary files.
"""

from __future__ import annotations

import hashlib
import os
import posixpath
import re
import stat
import sys
import tempfile
import time
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from ..errors import BuildError, StrandspringError
from ..ground.children import kill_all
from ..ground.files import replacing, user_cache
from . import zig
from .targets import FLAGS, Target

_PACKAGE = Path(__file__).resolve().parent.parent
PACKAGED = _PACKAGE / "compiled" / "images"

# By version of FMI.
FMI_HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}

_INCLUDED = re.compile(rb'^ *#include "([^"]+)"', re.MULTILINE)
_KEPT_FOR = 30 * 24 * 3600.0  # [s]


@dataclass(frozen=True)
class CompiledUnit:
    """C sources of the package that become one shared library.

    Attributes
    ----------
    name : str                  Of the library, without suffix.
    file : str                  To be compiled, below the package; it includes the others.
    flags : tuple of str        Besides those of every library.
    shared : str or None        A file that is compiled apart, once for all units that share it, and linked.
    file_flags : tuple of str   Of `file` alone.
    fmi : int                   The version of FMI whose headers are needed; 0: none.
    """

    name: str
    file: str
    flags: tuple[str, ...] = ()
    shared: str | None = None
    file_flags: tuple[str, ...] = ()
    fmi: int = 0

    def sources(self) -> dict[str, bytes]:
        """Content of each C file by its path below the package: of the unit's file and of all that it includes."""
        contents: dict[str, bytes] = {}
        waiting = [self.file, *([self.shared] if self.shared else [])]
        while waiting:
            path = waiting.pop()
            if path not in contents:
                contents[path] = (_PACKAGE / path).read_bytes()
                folder = posixpath.dirname(path)
                included = (posixpath.join(folder, name.decode()) for name in _INCLUDED.findall(contents[path]))
                # Those of FMI are not the package's.
                waiting += [posixpath.normpath(name) for name in included if (_PACKAGE / name).is_file()]
        return dict(sorted(contents.items()))

    def sources_in_fmu(self) -> dict[str, bytes]:
        """The same with FMI's headers, which importers of FMI 3.0 have."""
        return self.sources() | (fmi_headers(self.fmi) if self.fmi == 2 else {})

    def file_name(self, target: Target) -> str:
        """Of the image for a target."""
        digest = hashlib.sha256(repr((FLAGS, self, target, target.system)).encode() + zig.runtime(target))
        for path, content in self.sources().items():
            digest.update(f"{path} {len(content)} ".encode() + content)
        return f"{self.name}-{target.triple}-{digest.hexdigest()[:16]}{target.system.suffix}"


# Vectors of three are slower in pairs, and a spring's force through a call.
_KERNEL_FLAGS = ("-O3", "-fno-slp-vectorize", "-mllvm", "-inline-threshold=600")
KERNEL = CompiledUnit("kernel", "kernel/c/kernel.c", _KERNEL_FLAGS)
# -O3 makes it a tenth larger, and no step faster.
_FMU_FLAGS = ("-O2", "-fvisibility=hidden")
_APART = ("-DFMU_SHARED_APART",)
# The header of FMI 3 declares two callbacks without a prototype.
_APART3 = (*_APART, "-Wno-strict-prototypes")
FMU = CompiledUnit("spring", "core/c/fmi2_all.c", _FMU_FLAGS, "core/c/fmu_all.c", _APART, fmi=2)
FMU3 = CompiledUnit("spring3", "core/c/fmi3_all.c", _FMU_FLAGS, "core/c/fmu_all.c", _APART3, fmi=3)
# The binary of the FMU of bodies on mounts, the same for all systems.
_SYSTEM_C = "fmu/system/c"
SYSTEM = CompiledUnit("system", f"{_SYSTEM_C}/system_all.c", _FMU_FLAGS, f"{_SYSTEM_C}/system_shared.c", _APART, fmi=2)
SYSTEM3 = CompiledUnit(
    "system3", f"{_SYSTEM_C}/system_all3.c", _FMU_FLAGS, f"{_SYSTEM_C}/system_shared.c", _APART3, fmi=3
)
# Those that become binaries of FMUs.
OF_FMUS = (FMU, FMU3, SYSTEM, SYSTEM3)


@cache
def image(unit: CompiledUnit, target: Target) -> Path:
    """The image of a unit for a target, compiled now if there is none.

    Raises
    ------
    BuildError   If it would have to be compiled and ziglang is not installed, or fails; or it cannot be kept.
    """
    name = unit.file_name(target)
    built = next((folder / name for folder in (PACKAGED, *_caches()) if (folder / name).is_file()), None)
    if built is not None:
        return built
    if not zig.is_installed():
        raise BuildError(
            f"The compiled {unit.name} for {target.triple} is missing, and ziglang, which compiles it, is not "
            'installed; install it with pip install "strandspring[native]", or strandspring from a wheel.'
        )
    print(f"Compiling the {unit.name} for {target.triple}, once for these C sources.", file=sys.stderr)
    content = compiled(unit, target)
    problem = ""
    for folder in _caches(create=True):
        try:
            with replacing(folder / name) as part:
                part.write_bytes(content)
        except StrandspringError as refusal:
            problem = f"{refusal} "
        else:
            if problem:
                remedy = "set XDG_CACHE_HOME to a folder that can be written"
                print(f"{problem}It is kept in {folder}; {remedy}.", file=sys.stderr)
            _discard_old(folder)
            return folder / name
    raise BuildError(f"{problem}Set XDG_CACHE_HOME to a folder that can be written, for what is compiled.")


def contents(unit: CompiledUnit, targets: Collection[Target]) -> dict[Target, bytes]:
    """The images of a unit for several targets; those that must be compiled are compiled at once.

    Raises
    ------
    BuildError   As for `image`.
    """
    with ThreadPoolExecutor() as pool:
        futures = {target: pool.submit(lambda triple: image(unit, triple).read_bytes(), target) for target in targets}
        try:
            return {target: future.result() for target, future in futures.items()}
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            # A thread may be about to start the compiler once more.
            while not all(future.done() for future in futures.values()):
                kill_all()
                time.sleep(0.05)
            raise


def compiled(unit: CompiledUnit, target: Target) -> bytes:
    """The image of a unit, compiled now."""
    (image_of_unit,) = all_compiled([unit], target)
    return image_of_unit


def all_compiled(units: Sequence[CompiledUnit], target: Target) -> list[bytes]:
    """The images of units for a target, compiled now; what units share is compiled once."""
    images = []
    shared: dict[str, bytes] = {}
    for unit in units:
        sources = unit.sources()
        if unit.shared and unit.shared not in shared:
            shared[unit.shared] = zig.object_file(target, sources, unit.shared, unit.flags)
        if unit.fmi:
            sources |= fmi_headers(unit.fmi)
        own = zig.object_file(target, sources, unit.file, (*unit.flags, *unit.file_flags))
        objects = [own, shared[unit.shared]] if unit.shared else [own]
        images.append(zig.linked(target, objects, unit.name, unit.flags))
    return images


def fmi_headers(fmi: int) -> dict[str, bytes]:
    """The headers of a version of FMI by their path below the package, beside the source that includes them."""
    return {f"core/c/fmi{fmi}/{name}": fmi_header(name) for name in FMI_HEADERS[fmi]}


def fmi_header(name: str) -> bytes:
    """A header of FMI, which FMPy brings.

    Raises
    ------
    BuildError   If it is not there.
    """
    # Not by importing it, which takes long.
    specification = find_spec("fmpy")
    folders = [] if specification is None else list(specification.submodule_search_locations or ())
    try:
        return Path(*folders, "c-code", name).read_bytes()
    except OSError:
        raise BuildError(f"The header {name} is missing; install fmpy 0.3.20 or newer.") from None


def _caches(create: bool = False) -> Iterator[Path]:
    """Where images are kept, in this order; the second folder must exist, or be created."""
    with suppress(RuntimeError):  # the user has no home
        yield user_cache()
    if sys.platform != "win32":  # where everybody has one
        folder = Path(tempfile.gettempdir(), f"strandspring-cache-{os.geteuid()}")
        with suppress(OSError):
            if create:
                folder.mkdir(mode=0o700, exist_ok=True)
            status = folder.lstat()
            # What is in there is executed: it must not be anybody else's.
            if stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & 0o077:
                yield folder


def _discard_old(folder: Path) -> None:
    for path in folder.iterdir():
        # Another process may be doing the same, or have the library loaded.
        with suppress(OSError):
            if path.stat().st_mtime < time.time() - _KEPT_FOR:
                path.unlink()
