"""Binaries of FMI 3.0 for every platform: their folders, what they need, what they export but functions of FMI 2.0."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import lief
import pytest

from fmu_tools import SPRING
from native_tools import FUNCTIONS, FUNCTIONS3
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.system.system_native import build_system_fmu
from strandspring.model.modelfile import ModelFile
from system_fmu_tools import BOX, BOX_OPTIONS

MACHINES = {
    "x86_64-linux": "X86_64", "aarch64-linux": "AARCH64", "x86_64-windows": "AMD64", "x86_64-darwin": "X86_64",
    "aarch64-darwin": "ARM64",
}  # fmt: skip


@pytest.fixture(scope="module", params=["spring", "system"])
def binaries(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """By their folder."""
    folder, platforms = tmp_path_factory.mktemp("all"), chosen_platforms("all")
    if request.param == "spring":
        fmu = build_native_fmu(ModelFile("spring", SPRING), folder, platforms, zero=0.0, fmi=3)
    else:
        fmu = build_system_fmu(BOX, folder, replace(BOX_OPTIONS, fmi=3), platforms)
    with zipfile.ZipFile(fmu) as archive:
        names = [name for name in archive.namelist() if name.startswith("binaries/")]
        assert {Path(name).stem for name in names} == {fmu.stem}
        assert fmu.stem.endswith("_fmi3")
        return {name.split("/")[1]: archive.read(name) for name in names}


def test_every_platform_has_its_folder(binaries: dict[str, bytes]) -> None:
    assert binaries.keys() == MACHINES.keys()
    assert len(FUNCTIONS3) > 70


@pytest.mark.parametrize("platform", [name for name in MACHINES if name.endswith("linux")])
def test_linux(platform: str, binaries: dict[str, bytes]) -> None:
    elf = lief.ELF.parse(binaries[platform])
    assert elf.header.machine_type.name == MACHINES[platform]
    assert set(elf.libraries) <= {"libc.so.6", "libm.so.6"}
    assert {symbol.name for symbol in elf.exported_symbols} - FUNCTIONS == FUNCTIONS3


def test_windows(binaries: dict[str, bytes]) -> None:
    pe = lief.PE.parse(binaries["x86_64-windows"])
    assert pe.header.machine.name == MACHINES["x86_64-windows"]
    assert {entry.name for entry in pe.get_export().entries} - FUNCTIONS == FUNCTIONS3


@pytest.mark.parametrize("platform", [name for name in MACHINES if name.endswith("darwin")])
def test_macos(platform: str, binaries: dict[str, bytes]) -> None:
    file = lief.MachO.parse(binaries[platform])
    assert [image.header.cpu_type.name for image in file] == [MACHINES[platform]]
    (image,) = file
    exported = {export.symbol.name.removeprefix("_") for export in image.dyld_info.exports}
    # The linker of ziglang exports two names of its own.
    assert exported - FUNCTIONS - {"_mh_dylib_header", "__dso_handle"} == FUNCTIONS3
