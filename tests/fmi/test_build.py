"""FMUs as files: binaries of every platform, images of the C sources, and what `build` refuses."""

from __future__ import annotations

import json
import os
import platform
import re
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import pytest

from fmu_tools import SPRING, contents_of
from native_tools import FUNCTIONS, FUNCTIONS3
from strandspring import Spring, build_fmu
from strandspring.api.common.model_source import built_with
from strandspring.compiled import images, sources, zig
from strandspring.compiled.images import KERNEL, OF_FMUS, image
from strandspring.compiled.targets import (
    FMU_TARGETS,
    LINUX_X86,
    MACOS_ARM,
    Target,
    host_target,
    wheel_platform,
)
from strandspring.errors import BuildError, ModelError
from strandspring.fmu.archive import write_archive
from strandspring.fmu.native.block import filled
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms, host_folder
from strandspring.fmu.related_files import BUILD, sealed
from strandspring.model.modelfile import ModelFile
from tools import tool

pytestmark = pytest.mark.long
MODEL = ModelFile("spring", SPRING)


# Binaries

MACHINES = {
    2: {"linux64": ["X86_64"], "aarch64-linux": ["AARCH64"], "win64": ["AMD64"], "darwin64": ["X86_64", "ARM64"],
        "aarch64-darwin": ["ARM64"]},
    3: {"x86_64-linux": ["X86_64"], "aarch64-linux": ["AARCH64"], "x86_64-windows": ["AMD64"],
        "x86_64-darwin": ["X86_64"], "aarch64-darwin": ["ARM64"]},
}  # fmt: skip


def facts(content: bytes) -> tuple[list[str], set[str], set[str]]:
    """Processors, libraries that are needed, and functions that are exported, of a shared library of any system."""
    import lief

    if content[:4] == b"\x7fELF":
        elf = lief.ELF.parse(content)
        versions = {v.name for needed in elf.symbols_version_requirement for v in needed.get_auxiliary_symbols()}
        assert all(tuple(map(int, v.removeprefix("GLIBC_").split("."))) <= (2, 17) for v in versions), versions
        assert not list(elf.symtab_symbols)
        assert not {".debug_info", ".symtab", ".note.gnu.build-id"} & {section.name for section in elf.sections}
        assert not any(entry.tag.name in ("RPATH", "RUNPATH", "TEXTREL") for entry in elf.dynamic_entries)
        return [elf.header.machine_type.name], set(elf.libraries), {symbol.name for symbol in elf.exported_symbols}
    if content[:2] == b"MZ":
        pe = lief.PE.parse(content)
        assert not pe.has_delay_imports
        assert not pe.has_tls
        # No debug information but the mark that the time in the header is a hash.
        assert all(entry.type.name == "REPRO" for entry in pe.debug)
        return [pe.header.machine.name], set(pe.libraries), {entry.name for entry in pe.get_export().entries}
    file = lief.MachO.parse(content)  # frees the images together with the file
    libraries, exported = set[str](), set[str]()
    for one in file:
        assert (list(one.build_version.minos), one.build_version.platform.name) == ([11, 0, 0], "MACOS")
        assert not any(segment.name == "__DWARF" for segment in one.segments)
        libraries |= {library.name for library in one.libraries} - {"spring.dylib"}
        # The linker of ziglang exports two names of its own.
        exported |= {export.symbol.name for export in one.dyld_info.exports} - {"__mh_dylib_header", "___dso_handle"}
    return [one.header.cpu_type.name for one in file], libraries, {name.removeprefix("_") for name in exported}


@pytest.mark.parametrize("fmi", [2, 3])
def test_binaries_of_every_platform(fmi: int, tmp_path: Path) -> None:
    fmu = build_native_fmu(MODEL, tmp_path, chosen_platforms("all"), zero=0.0, fmi=fmi)
    contents = contents_of(fmu)
    binaries = {name.split("/")[1]: content for name, content in contents.items() if name.startswith("binaries/")}
    assert binaries.keys() == MACHINES[fmi].keys()
    guid = str(fmpy.read_model_description(str(fmu)).guid).encode()
    for folder, processors in MACHINES[fmi].items():
        found, libraries, functions = facts(binaries[folder])
        assert found == processors
        assert functions == FUNCTIONS | FUNCTIONS3
        # The C runtime alone, and on Windows what is there since Windows 10: not even KERNEL32.
        expected = r"libc\.so\.6|libm\.so\.6|api-ms-win-crt-\w+-l1-1-0\.dll|/usr/lib/libSystem\.B\.dylib"
        expected += r"|ld-linux-aarch64\.so\.1"  # which holds the value of the stack protector there
        # Without the C library of MinGW there is none on Windows.
        assert (b"__stack_chk_fail" in binaries[folder]) is ("win" not in folder or "darwin" in folder)
        assert all(re.fullmatch(expected, library) for library in libraries), libraries
        assert 10_000 < len(binaries[folder]) < 380_000, folder
        assert guid in binaries[folder]  # it is instantiated for its own description only
    assert fmu.stat().st_size < 545_000
    root = os.fsencode(Path(__file__).parents[2])
    for name, content in contents.items():
        for path in (b"/tmp/", b"/home/", b"/root/", b"ziglang/", b".cache", root):
            assert path not in content, (name, path)
    sources = [name for name in contents if name.startswith("sources/")]
    assert not [name for name in sources if "system" in name or f"fmi{5 - fmi}" in name]
    assert "2-Clause BSD License" in contents["documentation/licenses/fmi-headers.txt"].decode()


@pytest.mark.parametrize("target", FMU_TARGETS, ids=lambda target: target.triple)
def test_a_filled_image_differs_in_its_block_and_hashes_only(target: Target) -> None:
    import lief

    content = images.image(images.FMU, target).read_bytes()
    made = filled(content, MODEL, "{12345678-1234-1234-1234-123456789abc}")
    changed = [k for k, (one, other) in enumerate(zip(content, made, strict=True)) if one != other]
    block = content.index(b"strandspringfmu\0")
    end = block + int.from_bytes(content[block + 16 : block + 20], "little")
    outside = [k for k in changed if not block + 24 <= k < end]
    signature = lief.MachO.parse(content).at(0).code_signature.data_offset if target == MACOS_ARM else len(content)
    assert changed
    # SHA-256 of the two or three pages that hold the block.
    assert len(outside) <= (96 if target == MACOS_ARM else 0)
    assert all(k >= signature for k in outside)


HOSTS = {
    "Linux x86_64": ("linux64", "manylinux_2_17_x86_64"), "Windows AMD64": ("win64", "win_amd64"),
    "Linux aarch64": ("aarch64-linux", "manylinux_2_17_aarch64"), "Darwin x86_64": ("darwin64", "macosx_11_0_x86_64"),
    "Darwin arm64": ("darwin64", "macosx_11_0_arm64"), "Linux riscv64": (None, ""), "Windows ARM64": (None, ""),
}  # fmt: skip


def test_the_platform_of_a_host(monkeypatch: pytest.MonkeyPatch) -> None:
    for host, (name, tag) in HOSTS.items():
        for function, said in zip(("system", "machine"), host.split(), strict=True):
            monkeypatch.setattr(platform, function, lambda said=said: said)
        assert host_folder() == name
        if name:
            assert ([one.name for one in chosen_platforms("host")], wheel_platform()) == ([name], tag)
        else:
            with pytest.raises(BuildError, match=host):
                chosen_platforms("host")


# Images of the C sources


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The user's cache, empty, where the package carries no image and compiling takes no time."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(images, "PACKAGED", tmp_path / "package")
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(images, "compiled", lambda _, target: done.append(target) or b"an image")
    monkeypatch.setattr(zig, "is_installed", lambda: True)
    done: list[Target] = []
    image.cache_clear()
    yield tmp_path / "strandspring"
    assert done in ([], [LINUX_X86])  # once
    image.cache_clear()


def test_an_image_is_compiled_once_and_kept(cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cache.mkdir()
    for name, days in (("old", 31), ("young", 29)):
        (cache / name).touch()
        os.utime(cache / name, (time.time() - days * 24 * 3600,) * 2)
    path = image(KERNEL, LINUX_X86)
    assert (path.parent, path.read_bytes()) == (cache, b"an image")
    said = capsys.readouterr()
    assert said.err == "Compiling the kernel for x86_64-linux-gnu.2.17, once for these C sources.\n"
    image.cache_clear()
    assert image(KERNEL, LINUX_X86) == path
    assert capsys.readouterr() == ("", "")
    assert {kept.name for kept in cache.iterdir()} == {path.name, "young"}  # those of old sources go after a month
    images.PACKAGED.mkdir()
    packaged = images.PACKAGED / KERNEL.file_name(LINUX_X86)
    packaged.touch()
    image.cache_clear()
    assert image(KERNEL, LINUX_X86) == packaged  # comes before the cache


def test_a_changed_source_flag_or_target_asks_for_another_image(monkeypatch: pytest.MonkeyPatch) -> None:
    names = {unit.file_name(target) for unit in (KERNEL, *OF_FMUS) for target in FMU_TARGETS}
    content, law = KERNEL.sources(), "core/c/spring/spring.c"
    renamed = {name.replace("spring.c", "other.c"): text for name, text in content.items()}
    for changed in ({**content, law: content[law] + b"\n"}, renamed):
        monkeypatch.setattr(images.CompiledUnit, "sources", lambda _, changed=changed: changed)
        names.add(KERNEL.file_name(LINUX_X86))
    monkeypatch.undo()
    monkeypatch.setattr(images, "FLAGS", (*images.FLAGS, "-DOTHER"))
    assert len(names | {KERNEL.file_name(LINUX_X86)}) == 15 + 3


def test_without_a_compiler_one_sentence_says_what_to_do(cache: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(zig, "is_installed", lambda: False)
    hint = r'^The compiled kernel for .* is missing, .*pip install "strandspring\[native\]".*\.$'
    with pytest.raises(BuildError, match=hint):
        image(KERNEL, LINUX_X86)
    assert not cache.exists()
    monkeypatch.setattr(sources, "find_spec", lambda _: None)
    with pytest.raises(BuildError, match="install fmpy"):
        sources.fmi_header("fmi2Functions.h")


def test_the_compiler_takes_nothing_of_the_machine_and_no_warnings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tool("ziglang")
    (tmp_path / "math.h").write_text("#error of the machine")
    foreign = {"CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "SDKROOT"}
    for variable in foreign:
        monkeypatch.setenv(variable, str(tmp_path))
    assert foreign.isdisjoint(
        given := zig._environment(tmp_path)
    )  # which this version of the compiler may ignore itself
    assert given.keys() > {"PATH"}
    # New to the compiler's cache.
    source = f"#include <math.h>\ndouble f{time.time_ns()}(double x);\n"
    assert zig.shared_library(host_target(), {"f.c": source.encode()}, ("f.c",), "f", ())
    with pytest.raises(BuildError, match=r"ziglang \S+ failed to compile for x86_64-linux-gnu\.2\.17.*unused"):
        zig.shared_library(LINUX_X86, {"a.c": b"int f(void);\nint f(void) { int u; return 1; }\n"}, ("a.c",), "a", ())


# Settings


def test_settings_of_an_fmu_that_no_command_writes_are_refused(tmp_path: Path) -> None:
    fmu = build_native_fmu(MODEL, tmp_path, ())
    for wrong in ({"fmi": 4}, {"fmi": True}, {"fmi": "3"}, {"needs_execution_tool": 1}):
        contents = contents_of(fmu)
        contents[BUILD] = json.dumps({**json.loads(contents[BUILD]), **wrong}).encode()
        write_archive(tmp_path / "damaged.fmu", sealed(contents))
        with pytest.raises(ModelError, match="is damaged; build the FMU from its model file again"):
            built_with(tmp_path / "damaged.fmu")


def test_an_fmu_that_answers_otherwise_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from strandspring.fmu.native import native_fmu

    fill, wrong = native_fmu.filled, replace(MODEL, parameters=replace(SPRING, rho=1.01 * SPRING.rho))
    monkeypatch.setattr(native_fmu, "filled", lambda content, _model, *rest: fill(content, wrong, *rest))
    for options in ({}, {"fmi": 3}, {"states": True}):
        with pytest.raises(BuildError, match="was not written, because the FMU failed its check"):
            build_fmu(Spring(SPRING, "spring"), tmp_path / "dist", **options)  # type: ignore[arg-type]
    assert not (tmp_path / "dist").exists()
