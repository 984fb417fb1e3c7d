"""The compiler of the ziglang package, which compiles for every target on every computer."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from ..errors import BuildError
from ..ground.children import run
from ..ground.scratch import TemporaryFolder
from .targets import FLAGS, Target

# Variables that say where the compiler has its cache, the first that is set.
_HOMES = ("ZIG_GLOBAL_CACHE_DIR", "XDG_CACHE_HOME", "HOME", "LOCALAPPDATA")
# Variables by which the compiler would find other headers and libraries than those it brings.
_FOREIGN = ("CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "SDKROOT")


def is_installed() -> bool:
    """Whether there is a compiler."""
    return find_spec("ziglang") is not None


def shared_library(
    target: Target, sources: Mapping[str, bytes], files: Sequence[str], name: str, flags: Sequence[str]
) -> bytes:
    """The shared library of C sources; the same arguments give the same bytes.

    Parameters
    ----------
    target : Target
    sources : mapping of str to bytes   Content of each C file by its path below a common folder.
    files : sequence of str             Those to be compiled; they may include others.
    name : str                          Of the library, without suffix.
    flags : sequence of str             Besides those of every library; with -O, or a file for Windows holds the time.

    Raises
    ------
    BuildError   If ziglang is not installed, or refuses the sources.
    """
    compiler = find_spec("ziglang")
    if compiler is None or compiler.origin is None:
        raise BuildError('C sources are compiled by ziglang; install it with pip install "strandspring[native]".')
    system, library = target.system, f"{name}{target.system.suffix}"
    headers = [] if system.headers is None else ["-isystem", str(Path(compiler.origin).parent / system.headers)]
    if system.runtime is not None:
        sources, files = {**sources, system.runtime: runtime(target)}, [*files, system.runtime]
    with TemporaryFolder() as folder:
        for path, content in sources.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content)
        # File names are relative to where the compiler runs: no path of this computer reaches the binary.
        arguments = [*FLAGS, *flags, *headers, *files, *system.linking, "-shared", "-s", "-o", library]
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target.triple, *arguments]
        done = run(command, folder, _environment(folder))
        if done.returncode != 0:
            message = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip()[:200])
            raise BuildError(
                f"ziglang {metadata.version('ziglang')} failed to compile for {target.triple}: {message.strip()}. "
                "Correct the source or, if it has not been changed, install another version of ziglang."
            )
        return (folder / library).read_bytes()


def runtime(target: Target) -> bytes:
    """The C file that takes the place of the compiler's start code, or nothing."""
    file = target.system.runtime
    return b"" if file is None else (Path(__file__).parent / file).read_bytes()


def _environment(folder: Path) -> dict[str, str]:
    environment = {key: value for key, value in os.environ.items() if key not in _FOREIGN}
    home = next((environment[key] for key in _HOMES if environment.get(key)), None)
    if home is None or not _can_write(home):
        # As in services and containers. Without a cache the compiler fails or never ends.
        environment["ZIG_GLOBAL_CACHE_DIR"] = str(folder / "cache")
    return environment


def _can_write(folder: str) -> bool:
    with suppress(OSError):
        Path(folder).mkdir(parents=True, exist_ok=True)
        return os.access(folder, os.W_OK)
    return False
