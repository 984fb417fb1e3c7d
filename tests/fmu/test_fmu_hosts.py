"""The Python-backed FMU in hosts that are not Python: its binary finds a Python, or says what it looked for."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import fmpy
import lief
import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, built, instance, run_python, wandering_path
from kernel_tools import HERE, build_folder, compiled
from native_tools import HEADERS, close, library
from native_tools import Native as NativeInstance
from portable_host import wine
from strandspring.fmu.native.platforms import PLATFORMS, chosen_platforms, host_folder
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile

VERSIONS = range(10, 15)
CYCLES_GROW_BY = 256  # pages: what the heap may need to settle after a thousand cycles
ODD_NAMES = ["with space", "quo'te\"d", "a#b", "100%", "50%25", "Üben 弹簧", "a?b;c&d"]


@dataclass(frozen=True)
class Unpacked:
    """A Python-backed FMU in a folder."""

    fmu: Path
    folder: Path

    @property
    def guid(self) -> str:
        return str(fmpy.read_model_description(str(self.fmu)).guid)

    def binary(self, platform: str) -> Path:
        (path,) = (self.folder / "binaries" / platform).iterdir()
        return path

    def arguments(self, uri: str | None = None) -> list[str]:
        """Of the host: binary, GUID and URI of the resources."""
        resources = (self.folder / "resources").as_uri() if uri is None else uri
        return [str(self.binary(str(host_folder()))), self.guid, resources]


def unpacked(fmu: Path, folder: Path) -> Unpacked:
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return Unpacked(fmu, folder)


@pytest.fixture(scope="module")
def spring(tmp_path_factory: pytest.TempPathFactory) -> Unpacked:
    folder = tmp_path_factory.mktemp("hosts")
    fmu = build_python_fmu(ModelFile("spring", SPRING), folder, chosen_platforms("all"), zero=0.0)
    return unpacked(fmu, folder / "unpacked")


@pytest.fixture(scope="module")
def without_python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that hides every libpython from the loader when LD_LIBRARY_PATH names it."""
    folder = tmp_path_factory.mktemp("hidden")
    for minor in VERSIONS:
        (folder / f"libpython3.{minor}.so.1.0").touch()
    return folder


def host() -> Path:
    return compiled(
        build_folder() / "python_calls", "-O1", f"-I{HEADERS}", HERE / "python_calls.c", "-ldl", "-lpthread"
    )


def run(
    *arguments: str, given: bytes = b"", environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[bytes]:
    """The host, in an environment without anything of this Python's."""
    clean = {"PATH": "/usr/bin:/bin", **(environment or {})}
    return subprocess.run(
        [str(host()), *arguments], input=given, capture_output=True, timeout=100, env=clean, check=False
    )


def forces(fmus: list[list[str]], path: np.ndarray, environment: Mapping[str, str] | None = None) -> np.ndarray:
    """Of each FMU at each displacement, shape (K, FMUs)."""
    arguments = [argument for fmu in fmus for argument in fmu]
    done = run(*arguments, "path", given=path.tobytes(), environment=environment)
    assert done.returncode == 0, done.stderr.decode()
    return np.frombuffer(done.stdout).reshape(len(path), len(fmus))


def refusal(fmu: Unpacked, environment: Mapping[str, str], uri: str | None = None) -> str:
    """The one message of an instantiation that fails."""
    done = run(*fmu.arguments(uri), "path", given=np.zeros(1).tobytes(), environment=environment)
    assert done.returncode == 1
    (line,) = done.stderr.decode().splitlines()
    assert line.startswith("one|3|logStatusError|")
    return line.removeprefix("one|3|logStatusError|")


def shared_library() -> Path:
    """A libpython: that of this Python, or one that the loader knows."""
    of = sysconfig.get_config_var
    own = Path(str(of("LIBDIR")), str(of("INSTSONAME")))
    if ".so" in own.name and own.is_file():
        return own
    listed = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    return Path(re.findall(r"libpython3\.1[0-4]\.so\.1\.0 .*=> (\S+)", listed)[0])


def test_a_host_without_python_gets_the_forces_of_the_native_fmu(spring: Unpacked) -> None:
    path = wandering_path(SPRING, 300, seed=21)
    with NativeInstance(library(SPRING)) as native:
        native.initialize(displacement=path[0])
        expected = [native.get("force")[0], *(native.step(x, "force")[0] for x in path[1:])]
    close(forces([spring.arguments()], path)[:, 0], expected)


def test_two_springs_in_one_process_do_not_meet(spring: Unpacked, tmp_path: Path) -> None:
    other = unpacked(built(tmp_path, OTHER, "other"), tmp_path / "other")
    path = wandering_path(SPRING, 100, seed=22)
    found = forces([spring.arguments(), other.arguments()], path)
    close(found[:, 0], PathSolver(SPRING).force(path))
    close(found[:, 1], PathSolver(OTHER).force(path))


@pytest.mark.parametrize("name", ODD_NAMES)
def test_it_runs_in_any_folder(spring: Unpacked, tmp_path: Path, name: str) -> None:
    moved = unpacked(spring.fmu, tmp_path / name)
    path = np.array([0.02, 0.03, 0.01])
    close(forces([moved.arguments()], path)[:, 0], PathSolver(SPRING).force(path))
    with instance(spring.fmu, tmp_path / name) as one:
        close(one.initialize().step(0.03, "force"), PathSolver(SPRING).force(path[:2])[-1:])


@pytest.mark.parametrize("written", ["file:{}", "file://{}", "file://localhost{}", "FILE://{}", "{}", "file://{}/"])
def test_every_way_to_write_the_location(spring: Unpacked, tmp_path: Path, written: str) -> None:
    moved = unpacked(spring.fmu, tmp_path / "a b#c")
    resources = moved.folder / "resources"
    path = np.array([0.02, 0.03])
    for text in (resources.as_uri().removeprefix("file://"), str(resources)):
        close(forces([moved.arguments(written.format(text))], path)[:, 0], PathSolver(SPRING).force(path))


def test_a_location_with_nothing_there(spring: Unpacked) -> None:
    said = refusal(spring, {}, "file:///nowhere/a%20b")
    assert "cannot be loaded from" in said
    assert "slavemodule.txt" in said


def test_the_library_that_the_user_names(spring: Unpacked) -> None:
    environment = {"PATH": "", "STRANDSPRING_LIBPYTHON": str(shared_library())}
    path = np.array([0.02, 0.03])
    close(forces([spring.arguments()], path, environment)[:, 0], PathSolver(SPRING).force(path))


@pytest.mark.parametrize(
    ("named", "reason"),
    [("/nowhere/libpython.so", "cannot open shared object file"), ("libm.so.6", "it has no function Py_IsInitialized")],
)
def test_a_library_that_cannot_be_used_is_named_and_no_other_taken(spring: Unpacked, named: str, reason: str) -> None:
    said = refusal(spring, {"STRANDSPRING_LIBPYTHON": named})
    assert said.startswith("The library that STRANDSPRING_LIBPYTHON names cannot be used: ")
    assert reason in said
    assert said.endswith("or unset it.")


def test_without_a_python_one_sentence_says_what_was_looked_for(spring: Unpacked, without_python: Path) -> None:
    said = refusal(spring, {"PATH": "", "LD_LIBRARY_PATH": str(without_python)})
    assert said == (
        "No Python was found: looked for libpython3.14.so.1.0 to libpython3.10.so.1.0 where this system keeps "
        "libraries, and for the shared library of python3 on PATH; install Python 3.10 or newer with its shared "
        "library, or set STRANDSPRING_LIBPYTHON to the path of that library."
    )


def test_a_library_without_a_standard_library_is_not_started(spring: Unpacked, tmp_path: Path) -> None:
    """Python itself would end the process."""
    lonely = tmp_path / "lonely" / shared_library().name
    lonely.parent.mkdir()
    shutil.copy(shared_library(), lonely)
    assert "there is no standard library for Python 3." in refusal(spring, {"STRANDSPRING_LIBPYTHON": str(lonely)})


@pytest.fixture
def on_path(tmp_path: Path) -> Callable[[str, str], str]:
    """Puts a program with a name on a PATH, which comes back."""

    def put(name: str, does: str) -> str:
        program = tmp_path / "bin" / name
        program.parent.mkdir(exist_ok=True)
        program.write_text(f"#!/bin/sh\n{does}\n")
        program.chmod(0o755)
        return str(program.parent)

    return put


def test_the_python_of_path_is_asked(
    spring: Unpacked, without_python: Path, on_path: Callable[[str, str], str]
) -> None:
    """A static one, which has no library, is passed over."""
    on_path("python3", "echo")
    folder = on_path("python3.10", f'unset LD_LIBRARY_PATH\nexec "{sys.executable}" "$@"')
    environment = {"PATH": folder, "LD_LIBRARY_PATH": str(without_python)}
    path = np.array([0.02, 0.03])
    if shared_library().is_relative_to(sys.base_prefix):
        close(forces([spring.arguments()], path, environment)[:, 0], PathSolver(SPRING).force(path))
    else:
        assert refusal(spring, environment).startswith("No Python was found")


def test_a_home_of_another_python_does_no_harm(spring: Unpacked) -> None:
    path = np.array([0.02, 0.03])
    found = forces([spring.arguments()], path, {"PYTHONHOME": "/nowhere", "LC_ALL": "C"})
    close(found[:, 0], PathSolver(SPRING).force(path))


def test_instances_of_two_fmus_in_several_threads(spring: Unpacked, tmp_path: Path) -> None:
    """The first calls, too, which look for a Python and start it."""
    copy = unpacked(spring.fmu, tmp_path / "copy")
    done = run(*spring.arguments(), *copy.arguments(), "threads")
    assert done.returncode == 0, done.stderr.decode()


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="resident memory is read from /proc")
def test_ten_thousand_instances_leave_nothing_in_a_host_without_python(spring: Unpacked) -> None:
    done = run(*spring.arguments(), "cycles")
    assert done.returncode == 0, done.stderr.decode()
    pages = [int(line) for line in done.stdout.split()]
    assert len(pages) == 11
    assert pages[-1] - pages[1] < CYCLES_GROW_BY, pages


CYCLES_IN_PYTHON = """
import sys
from fmu_tools import callbacks_into
import fmpy
from fmpy.fmi2 import FMU2Slave
fmu, folder = sys.argv[1:]
guid = fmpy.read_model_description(fmu).guid
slave = FMU2Slave(guid=guid, unzipDirectory=folder, modelIdentifier="spring", instanceName="one")
callbacks = callbacks_into([])
for cycle in range(10_001):
    if cycle % 1000 == 0:
        print(open("/proc/self/statm").read().split()[1])
    slave.instantiate(callbacks=callbacks)
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.setReal([0], [0.02])
    slave.exitInitializationMode()
    slave.doStep(0.0, 1e-3)
    state = slave.getFMUstate()
    slave.freeFMUstate(state)
    slave.fmi2FreeInstance(slave.component)
"""


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="resident memory is read from /proc")
@pytest.mark.parametrize("backend", ["python", "native"])
def test_ten_thousand_instances_leave_nothing_in_python(
    backend: str, spring: Unpacked, native_fmu: Path, tmp_path: Path
) -> None:
    if backend == "native":
        spring = unpacked(native_fmu, tmp_path)
    pages = [int(line) for line in run_python(CYCLES_IN_PYTHON, spring.fmu, spring.folder).split()]
    assert len(pages) == 11
    assert pages[-1] - pages[1] < CYCLES_GROW_BY, pages


@pytest.mark.parametrize("platform", PLATFORMS)
def test_the_binary_needs_the_system_only(spring: Unpacked, platform: str) -> None:
    binary = lief.parse(str(spring.binary(platform)))
    needed = {name.rsplit("/")[-1] for name in map(str, getattr(binary, "libraries", ()))}
    allowed = {
        "linux64": r"lib(c|m|dl)\.so\.6|libdl\.so\.2",
        "aarch64-linux": r"lib(c|m)\.so\.6|libdl\.so\.2|ld-linux-aarch64\.so\.1",
        "win64": r"api-ms-win-crt-\w+-l1-1-0\.dll|KERNEL32\.dll|ADVAPI32\.dll",
    }
    if platform in allowed:
        assert needed
        assert all(re.fullmatch(allowed[platform], name, re.IGNORECASE) for name in needed), needed


class Windows:
    """Programs run by wine in a prefix of their own."""

    def __init__(self, program: str, folder: Path) -> None:
        self._program, self._folder = program, folder

    def run(self, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
        # No offer to install Mono and Gecko.
        settings = {
            **os.environ, "WINEPREFIX": str(self._folder / "prefix"), "WINEDEBUG": "-all",
            "WINEDLLOVERRIDES": "mscoree,mshtml=", **environment,
        }  # fmt: skip
        # Into files: of a pipe, the end would come only when wine's server leaves, seconds later.
        with (self._folder / "out").open("w+b") as out, (self._folder / "err").open("w+b") as err:
            done = subprocess.run([self._program, *command], env=settings, stdout=out, stderr=err, check=False)
        texts = ((self._folder / name).read_text(encoding="utf-8", errors="replace") for name in ("out", "err"))
        return subprocess.CompletedProcess(done.args, done.returncode, *texts)

    def compiled(self, source: str, name: str, *flags: str) -> Path:
        output = self._folder / name
        output.parent.mkdir(exist_ok=True)
        options = ["-target", "x86_64-windows-gnu", "-std=c11", "-O2", "-s", f"-I{HEADERS}", *flags]
        command = [sys.executable, "-m", "ziglang", "cc", *options, str(HERE / source), "-o", str(output)]
        subprocess.run(command, check=True, capture_output=True)
        return output


@pytest.fixture
def windows(tmp_path: Path) -> Windows:
    program = wine()
    if program is None:
        pytest.skip("wine is not installed: the Windows binary was looked into but not run")
    return Windows(program, tmp_path)


@pytest.mark.slow
def test_windows_finds_python_by_its_variable_on_path_and_in_the_registry(spring: Unpacked, windows: Windows) -> None:
    command = [str(windows.compiled("portable_host.c", "host.exe")), spring.guid, "", str(spring.binary("win64"))]
    none = windows.run(*command)
    assert none.returncode == 1
    assert "No Python was found: looked for python314.dll to python310.dll on PATH" in none.stderr
    python = windows.compiled("stand_in_python.c", "Üben/python311.dll", "-shared")
    dos = f"Z:{python}".replace("/", "\\")
    lonely = windows.run(*command, STRANDSPRING_LIBPYTHON=dos)
    assert lonely.returncode == 1
    assert "there is no standard library for Python 3.11; set it to" in lonely.stderr
    landmark = python.parent / "Lib" / "os.py"
    landmark.parent.mkdir()
    landmark.touch()
    started = f"started with {dos.removesuffix(chr(92) + 'python311.dll')}, 0"
    assert windows.run(*command, STRANDSPRING_LIBPYTHON=dos).stdout == started
    assert windows.run(*command, WINEPATH=str(python.parent)).stdout == started
    key = "HKCU\\Software\\Python\\PythonCore\\3.11\\InstallPath"
    assert windows.run("reg", "add", key, "/ve", "/d", dos.removesuffix("\\python311.dll")).returncode == 0
    assert windows.run(*command).stdout == started


def test_the_same_guid_on_every_platform_and_another_by_the_declaration(tmp_path: Path) -> None:
    def guid(folder: str, platforms: str, needs: bool) -> str:
        fmu = build_python_fmu(ModelFile("spring", SPRING), tmp_path / folder, chosen_platforms(platforms), 0.0, needs)
        description = fmpy.read_model_description(str(fmu))
        assert description.coSimulation.needsExecutionTool is needs
        return str(description.guid)

    here = guid("1", "host", False)
    assert guid("2", "all", False) == here
    assert guid("3", "host", True) != here
