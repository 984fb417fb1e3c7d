"""The simulator in C without Python, portable_host.c: compiled for this computer or for Windows, and driven."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np

from native_tools import HEADERS
from tools import program, ziglang

SOURCE = Path(__file__).with_name("portable_host.c")


def environment() -> dict[str, str]:
    """Programs of this environment first, such as cmake, even if it is not activated."""
    return {**os.environ, "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])}


def run(command: list[str], **options: object) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False, **options)  # type: ignore[call-overload]
    assert done.returncode == 0, f"{command[0]}: exit status {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done


def compiled_host(folder: Path) -> list[str]:
    """The command that runs it here."""
    host = folder / "host"
    flags = ["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    run([program("cc", package="gcc libc6-dev"), *flags, f"-I{HEADERS}", str(SOURCE), "-o", str(host), "-ldl"])
    return [str(host)]


def wine() -> str | None:
    # Debian does not put it on the path unless its 32-bit half is installed, too.
    return shutil.which("wine64") or shutil.which("wine") or shutil.which("wine64", path="/usr/lib/wine")


def windows_host(folder: Path, program: str) -> tuple[list[str], dict[str, str]]:
    """The command that runs it for Windows by wine, and the environment for that."""
    host = folder / "host.exe"
    flags = ["-target", "x86_64-windows-gnu", "-std=c11", "-O2", "-s"]
    run([*ziglang("cc"), *flags, f"-I{HEADERS}", str(SOURCE), "-o", str(host)])
    # A prefix of its own, and no offer to install Mono and Gecko.
    settings = {"WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
    return [program, str(host)], {**environment(), **settings}


def unpacked(fmu: Path, platform: str, folder: Path) -> Path:
    """The binary for a platform in a folder of its own, with the rest of the FMU."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
        pattern = re.compile(rf"binaries/{platform}/[^/]+\.(so|dll|dylib)")
        (name,) = filter(pattern.fullmatch, archive.namelist())
    return folder / name


def guid_of(fmu: Path) -> str:
    return str(fmpy.read_model_description(str(fmu)).guid)


def responses(host: list[str], fmu: Path, libraries: list[Path], path: np.ndarray, **options: object) -> np.ndarray:
    """Force [N] and absorbed energy [J] of each library, loaded one beside the other, shape (K, libraries, 2)."""
    resources = libraries[0].parents[2] / "resources"
    command = [*host, guid_of(fmu), resources.as_uri(), *map(str, libraries)]
    said = run(command, input="\n".join(map(repr, path.tolist())), **options).stdout
    values = np.array([[float.fromhex(value) for value in line.split()] for line in said.splitlines()])
    return values.reshape(len(path), len(libraries), 2)
