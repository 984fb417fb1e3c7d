"""Finished images of the package's C units, and where they are found.

An image's file name holds a digest of all it is compiled from, so that a changed source never meets an old image. A
wheel carries images in the folder ``images``; those that are not there, as in a source checkout, are compiled once and
kept in the user's cache or, if that cannot be written, in a folder of the user among the temporary files.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
import time
from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ..errors import BuildError, StrandspringError
from ..ground.children import kill_all
from ..ground.files import replacing, user_cache
from . import zig
from .sources import PACKAGE, c_sources, fmi_headers
from .targets import FLAGS, WINDOWS_X86, Target

PACKAGED = PACKAGE / "compiled" / "images"
_KEPT_FOR = 30 * 24 * 3600.0  # [s]


@dataclass(frozen=True)
class CompiledUnit:
    """C sources of the package that become one shared library.

    Attributes
    ----------
    name : str               Of the library, without suffix.
    files : tuple of str     To be compiled, each by itself, below the package; they include the others.
    flags : tuple of str     Besides those of every library.
    fmi : tuple of int       The versions of FMI whose headers are needed.
    """

    name: str
    files: tuple[str, ...]
    flags: tuple[str, ...] = ()
    fmi: tuple[int, ...] = ()

    def sources(self) -> dict[str, bytes]:
        """Content of each C file of the package that is compiled, by its path below the package."""
        return c_sources(*self.files)

    def file_name(self, target: Target) -> str:
        """Of the image for a target."""
        digest = hashlib.sha256(repr((FLAGS, self, target, target.system)).encode() + zig.runtime(target))
        for path, content in self.sources().items():
            digest.update(f"{path} {len(content)} ".encode() + content)
        return f"{self.name}-{target.triple}-{digest.hexdigest()[:16]}{target.system.suffix}"


# Vectors of three are slower in pairs, and a spring's force through a call.
_KERNEL_FLAGS = ("-O3", "-fno-slp-vectorize", "-mllvm", "-inline-threshold=600")
KERNEL = CompiledUnit("kernel", ("kernel/c/kernel.c",), _KERNEL_FLAGS)
# -O3 makes it a tenth larger, and no step faster. The header of FMI 3 declares two callbacks without a prototype.
_FMU_FLAGS = ("-O2", "-fvisibility=hidden", "-DFMU_SHARED_APART", "-Wno-strict-prototypes")
# The binary of every spring's FMU, and that of every system of bodies on mounts, for both versions of FMI. The second
# and third file are all of the FMU's sources for one version, unless what both share is compiled apart, as here.
SPRING_FILES = {2: "core/c/fmi2_all.c", 3: "core/c/fmi3_all.c"}
SYSTEM_FILES = {2: "fmu/system/c/system_all.c", 3: "fmu/system/c/system_all3.c"}
FMU = CompiledUnit("spring", ("core/c/fmu_all.c", *SPRING_FILES.values()), _FMU_FLAGS, (2, 3))
SYSTEM = CompiledUnit("system", ("fmu/system/c/system_shared.c", *SYSTEM_FILES.values()), _FMU_FLAGS, (2, 3))
OF_FMUS = (FMU, SYSTEM)


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
    sources = unit.sources()
    for fmi in unit.fmi:
        sources |= fmi_headers(fmi)
    # Of what hosts load; for Windows the compiler knows none without the C library of MinGW.
    guards = ("-fstack-protector-strong",) if unit.fmi and target != WINDOWS_X86 else ()
    return zig.shared_library(target, sources, unit.files, unit.name, (*unit.flags, *guards))


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
