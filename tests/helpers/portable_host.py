"""The host in C without Python, host.c: compiled for this computer or for Windows, and driven."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np

from kernel_tools import HERE, compiled
from native_tools import HEADERS
from tools import ziglang

# Programs of this environment first, such as cmake, even if it is not activated.
ENVIRONMENT = {**os.environ, "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])}


def run(command: list[str | Path], **options: Any) -> str:
    """Standard output of a program that ends well."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False, **options)
    assert done.returncode == 0, f"{command[0]}: {done.returncode}: {done.stdout[-500:]}{done.stderr[-2000:]}"
    return done.stdout


def host(folder: Path, *flags: str) -> Path:
    """The program for this computer."""
    return compiled(folder / "host", "-O1", *flags, f"-I{HEADERS}", HERE / "host.c", "-ldl", "-lpthread")


def wine() -> str | None:
    # Debian does not put it on the path unless its 32-bit half is installed, too.
    return shutil.which("wine64") or shutil.which("wine") or shutil.which("wine64", path="/usr/lib/wine")


def responses(fmu: Path, path: np.ndarray, folder: Path, platform: str) -> np.ndarray:
    """Force [N] and absorbed energy [J] of two copies of a binary, loaded one beside the other, shape (K, 2, 2)."""
    command: list[str | Path] = [folder / "host.exe"] if platform == "win64" else [host(folder)]
    environment = ENVIRONMENT
    if platform == "win64":
        flags = ["-target", "x86_64-windows-gnu", "-std=c11", "-O2", "-s"]
        run([*ziglang("cc"), *flags, f"-I{HEADERS}", HERE / "host.c", "-o", command[0]])
        # A prefix of its own, and no offer to install Mono and Gecko.
        settings = {"WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
        command, environment = [str(wine()), *command], ENVIRONMENT | settings
    command += ["path"]
    for k in range(2):
        unpacked = folder / f"copy{k}"
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(unpacked)
            (name,) = filter(re.compile(rf"binaries/{platform}/[^/]+\.(so|dll)").fullmatch, archive.namelist())
        guid = str(fmpy.read_model_description(str(fmu)).guid)
        command += [unpacked / name, guid, (unpacked / "resources").as_uri()]
    said = run(command, input="\n".join(map(repr, path.tolist())), env=environment)
    values = [[float.fromhex(value) for value in line.split()] for line in said.splitlines()]
    return np.array(values).reshape(len(path), 2, 2)
