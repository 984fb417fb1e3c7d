"""Cross compilation of the C sources by the compiler of the ziglang package, for every platform of an FMU."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from ...compiled.macho import universal
from ...errors import BuildError
from ..archive import installed_version


@dataclass(frozen=True)
class Platform:
    """One folder below ``binaries/``.

    Attributes
    ----------
    name : str                 Of the folder, by FMI 2.0.4.
    targets : tuple of str     The compiler's targets; several become one universal binary.
    suffix : str               Of the binary.
    linking : tuple of str     Flags besides those of every platform.
    runtime : str or None      A C file of ours that stands in for the compiler's start code, by its path here.
    """

    name: str
    targets: tuple[str, ...]
    suffix: str
    linking: tuple[str, ...] = ()
    runtime: str | None = None


_FLAGS = (
    "-std=c11",
    "-O2",
    "-ffp-contract=off",  # or the last bits differ from Python
    "-fvisibility=hidden",
    "-Wall", "-Wextra", "-Wpedantic", "-Werror",
)  # fmt: skip
_ELF = ("-lm", "-Wl,--build-id=none")
_UCRT = (
    "-nostdlib",
    "-Wl,--entry=spring_start",
    *(f"-lapi-ms-win-crt-{part}-l1-1-0" for part in ("convert", "heap", "math", "private", "stdio", "string")),
    "-lcompiler_rt",  # probes the stack for large frames
)

# FMI 2.0.4 keeps the names of FMI 2.0 for x86 and takes those of FMI 3.0 for everything else. Simulators on Apple
# silicon look in either folder, so darwin64 is universal and aarch64-darwin holds its half for arm64.
PLATFORMS = {
    known.name: known
    for known in (
        Platform("linux64", ("x86_64-linux-gnu.2.17",), ".so", _ELF),
        Platform("aarch64-linux", ("aarch64-linux-gnu.2.17",), ".so", _ELF),
        Platform("win64", ("x86_64-windows-gnu",), ".dll", _UCRT, "windows_runtime.c"),
        Platform("darwin64", ("x86_64-macos.11.0", "aarch64-macos.11.0"), ".dylib"),
        Platform("aarch64-darwin", ("aarch64-macos.11.0",), ".dylib"),
    )
}

_HOSTS = {
    ("Linux", "x86_64"): "linux64",
    ("Linux", "aarch64"): "aarch64-linux",
    ("Windows", "x86_64"): "win64",
    ("Darwin", "x86_64"): "darwin64",
    ("Darwin", "aarch64"): "darwin64",
}

# Variables that say where the compiler has its cache, the first that is set.
_HOMES = ("ZIG_GLOBAL_CACHE_DIR", "XDG_CACHE_HOME", "HOME", "LOCALAPPDATA")
# Variables by which the compiler would find other headers and libraries than those it brings.
_FOREIGN = ("CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "SDKROOT")


def host_name() -> str | None:
    """The folder below ``binaries/`` for this computer, if FMUs of ours can have one."""
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    return _HOSTS.get((platform.system(), machine))


def chosen_platforms(names: str) -> tuple[Platform, ...]:
    """Platforms by their names with commas between, or all of them, or that of this computer.

    Raises
    ------
    BuildError   If there is no such platform.
    """
    chosen: dict[str, Platform] = {}
    for name in (part.strip() for part in names.split(",")):
        if name == "all":
            chosen |= PLATFORMS
        elif name == "host":
            chosen |= _of_host()
        elif name in PLATFORMS:
            chosen[name] = PLATFORMS[name]
        else:
            raise BuildError(f"A platform must be `host`, `all` or one of {', '.join(PLATFORMS)}, got {name[:40]!r}.")
    return tuple(chosen.values())


def compile_binary(target: Platform, sources: Mapping[str, bytes], unit: str, name: str) -> bytes:
    """The shared library of a C source for one platform; the same arguments give the same bytes.

    Parameters
    ----------
    target : Platform
    sources : mapping of str to bytes   Content of each C file by its name.
    unit : str                          The file to be compiled; it includes the others.
    name : str                          Of the library, without suffix.

    Raises
    ------
    BuildError   If ziglang is not installed, or refuses the sources.
    """
    if find_spec("ziglang") is None:
        raise BuildError(
            "The native back end compiles with ziglang, which is not installed; run pip install 'strandspring[native]'."
        )
    with tempfile.TemporaryDirectory(prefix="strandspring-", ignore_cleanup_errors=True) as temporary:
        folder = Path(temporary)
        for file, content in sources.items():
            (folder / file).write_bytes(content)
        images = [_image(folder, triple, target, unit, f"{name}{target.suffix}") for triple in target.targets]
    return images[0] if len(images) == 1 else universal(images)


def _image(folder: Path, triple: str, target: Platform, unit: str, library: str) -> bytes:
    output = ("-shared", "-s", "-o", library)
    if target.runtime is None:
        _run(folder, triple, *_FLAGS, unit, *target.linking, *output)
    else:
        (folder / "runtime.c").write_bytes((files("strandspring") / "compiled" / target.runtime).read_bytes())
        # Told to link without its own libraries, the compiler finds no headers either.
        for part in (unit, "runtime.c"):
            _run(folder, triple, *_FLAGS, "-c", part, "-o", f"{part}.o")
        # Without -O2 the linker writes the time into the file.
        _run(folder, triple, "-O2", f"{unit}.o", "runtime.c.o", *target.linking, *output)
    return (folder / library).read_bytes()


def _of_host() -> dict[str, Platform]:
    name = host_name()
    if name is None:
        raise BuildError(
            f"There is no native FMU for this computer ({platform.system()} {platform.machine()}); name the platforms "
            f"it is for, of {', '.join(PLATFORMS)}."
        )
    return {name: PLATFORMS[name]}


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


def _run(folder: Path, triple: str, *arguments: str) -> None:
    # File names are relative to where the compiler runs: no path of this computer reaches the binary.
    done = subprocess.run(
        [sys.executable, "-m", "ziglang", "cc", "-target", triple, *arguments],
        cwd=folder,
        env=_environment(folder),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode != 0:
        said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip()[:200])
        raise BuildError(
            f"ziglang {installed_version('ziglang')} failed to compile for {triple}: {said.strip()}. "
            "Install another version of it."
        )
