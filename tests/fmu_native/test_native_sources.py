"""The C sources in native FMUs, as simulators compile them."""

from __future__ import annotations

import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import pytest
from fmpy.util import create_cmake_project

from branched_springs import BRANCHED
from fmu_tools import SPRING, check_fmu
from native_tools import HEADERS
from strandspring.compiled.images import KERNEL, OF_FMUS
from strandspring.compiled.sources import PACKAGE
from strandspring.exchange.c_sources import write_c_sources
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.system.system_check import examine_system_fmu
from strandspring.fmu.system.system_native import build_system_fmu
from strandspring.model.modelfile import ModelFile
from system_fmu_tools import BOX, BOX_OPTIONS
from tools import program, ziglang

REFUSED = ("-ffast-math", "-Ofast", "-ffinite-math-only")
KINDS = ("spring 2", "spring 3", "system 2", "system 3")
UNITS = ("fmi2_all.c", "fmi3_all.c", "fmu/system/c/system_all.c", "fmu/system/c/system_all3.c")
MACROS = (("MODEL_EXCHANGE",), ("CO_SIMULATION",), ("MODEL_EXCHANGE", "CO_SIMULATION"))


def built(kind: str, folder: Path) -> Path:
    what, version = kind.split()
    host = chosen_platforms("host")
    if what == "spring":
        return build_native_fmu(ModelFile("spring", SPRING), folder, host, zero=0.0, fmi=int(version))
    return build_system_fmu(BOX, folder, replace(BOX_OPTIONS, fmi=int(version)), host)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "unit"), list(zip(KINDS, UNITS, strict=True)))
def test_sources_are_c99_whatever_customary_macros_a_tool_defines(kind: str, unit: str, tmp_path: Path) -> None:
    """Also for 32 bits, where structures are laid out otherwise, and the static assertions still hold."""
    with zipfile.ZipFile(built(kind, tmp_path)) as archive:
        archive.extractall(tmp_path)
    for target in ("x86_64-linux-gnu", "x86-linux-gnu"):
        for macros in MACROS:
            command = [*ziglang("cc"), "-target", target, "-std=c99", "-c", "-o"]
            command += [str(tmp_path / "unit.o"), *(f"-D{macro}" for macro in macros)]
            command += [f"-I{Path(fmpy.__file__).parent / 'c-code'}", str(tmp_path / "sources" / unit)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert done.returncode == 0, (target, macros, done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_project_that_fmpy_makes_builds_and_gives_the_same_forces(kind: str, tmp_path: Path) -> None:
    fmu, project = built(kind, tmp_path), tmp_path / "project"
    create_cmake_project(str(fmu), str(project))
    (binary,) = project.glob("binaries/*/*")
    binary.unlink()
    for command in (["cmake", "-B", "build", "-S", "."], ["cmake", "--build", "build"]):
        subprocess.run(command, cwd=project, check=True, capture_output=True)
    assert binary.is_file()
    rebuilt = tmp_path / "rebuilt.fmu"
    with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(rebuilt, "w") as other:
        for name in archive.namelist():
            other.writestr(name, binary.read_bytes() if name.startswith("binaries/") else archive.read(name))
    if kind.startswith("spring"):
        assert check_fmu(rebuilt).force_difference == 0.0
    else:
        assert examine_system_fmu(rebuilt, BOX, replace(BOX_OPTIONS, fmi=int(kind[-1]))).problems == ()


@pytest.mark.parametrize("compiler", ["cc", "zig"])
def test_sources_refuse_flags_with_which_a_nan_passes_for_a_number(compiler: str, tmp_path: Path) -> None:
    for model in (ModelFile("plain", SPRING), ModelFile("branched", BRANCHED["both"])):
        exported = write_c_sources(tmp_path, model, 0.0).parent
    units = [PACKAGE / file for unit in (KERNEL, *OF_FMUS) for file in unit.files]
    # The examples include what the laws include.
    sources = [*units, *(path for path in sorted(exported.glob("*.c")) if not path.name.endswith("_example.c"))]
    command = ziglang("cc") if compiler == "zig" else (program("cc", package="gcc libc6-dev"),)
    # ziglang takes -Ofast for -O3, and seconds to start.
    for flag in REFUSED if compiler == "cc" else REFUSED[:1]:
        for source in sources if compiler == "cc" else sources[:1]:
            arguments = [*command, "-std=c11", flag, f"-I{HEADERS}", "-fsyntax-only", str(source)]
            done = subprocess.run(arguments, capture_output=True, text=True, check=False)
            assert done.returncode != 0, (flag, source)
            assert "Compile without -ffast-math" in done.stderr, (flag, source)
