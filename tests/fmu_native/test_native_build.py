"""The native FMU as a file: what its binaries import and export, its description, reproducible bytes, refusals."""

from __future__ import annotations

import hashlib
import json
import os
import re
import struct
import time
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import lief
import pytest
from fmpy.validation import validate_fmu

from fmu_tools import OTHER, SPRING, built, check_fmu
from native_tools import FUNCTIONS, FUNCTIONS3
from strandspring import Spring
from strandspring.cli.main import main
from strandspring.compiled import images, zig
from strandspring.compiled.targets import FMU_TARGETS, LINUX_X86, MACOS_ARM, WINDOWS_X86, Target, host_target
from strandspring.errors import BuildError
from strandspring.fmu.native.block import filled
from strandspring.fmu.native.macho import universal
from strandspring.fmu.native.native_fmu import build_native_fmu, native_contents
from strandspring.fmu.native.platforms import PLATFORMS, chosen_platforms, default_platforms, host_folder
from strandspring.model.modelfile import ModelFile
from tools import tool

AWKWARD = (
    "\"quoted\" 'single' <b>bold</b> &amp; ]]> <!-- --> \n#error newline\r\n*/ int evil = 1; /* \\ \\\n ?/ %s %n "
    "../../up {name} {{ 7*7 }} äöü 弹簧"
)


def binary(fmu: Path, platform: str) -> bytes:
    with zipfile.ZipFile(fmu) as archive:
        return archive.read(f"binaries/{platform}/spring{PLATFORMS[platform].suffix}")


@pytest.fixture(scope="module")
def description(native_fmu: Path) -> Any:
    return fmpy.read_model_description(str(native_fmu))


def test_valid(native_fmu: Path) -> None:
    assert validate_fmu(str(native_fmu)) == []


def test_both_kinds_run_and_answer_as_the_model(native_fmu: Path) -> None:
    report = check_fmu(native_fmu)
    assert report.interfaces == ("co-simulation", "model exchange")
    # The largest force is some 500 N: 2e-12 of it.
    assert report.force_difference < 1e-9
    assert "401 steps of co-simulation and of model exchange" in report.summary


def test_capabilities(description: Any) -> None:
    slave, model = description.coSimulation, description.modelExchange
    for kind in (slave, model):
        assert kind.modelIdentifier == "spring"
        assert kind.canGetAndSetFMUstate
        assert kind.canSerializeFMUstate
        assert kind.providesDirectionalDerivative
        assert not kind.needsExecutionTool
        assert not kind.canBeInstantiatedOnlyOncePerProcess
        assert not kind.canNotUseMemoryManagementFunctions
    assert slave.canHandleVariableCommunicationStepSize
    assert slave.canInterpolateInputs
    assert slave.maxOutputDerivativeOrder == 1
    assert model.needsCompletedIntegratorStep
    assert description.numberOfContinuousStates == 0
    assert description.numberOfEventIndicators == 1
    assert {c.name for c in description.logCategories} >= {"logStatusWarning", "logStatusError", "logAll"}


def test_variables_are_those_of_the_python_back_end(description: Any, tmp_path: Path) -> None:
    other = fmpy.read_model_description(str(built(tmp_path)))
    for part in ("modelVariables", "unitDefinitions", "outputs", "initialUnknowns"):
        assert repr(getattr(description, part)) == repr(getattr(other, part)), part


def test_sources_are_complete_and_listed(native_fmu: Path) -> None:
    with zipfile.ZipFile(native_fmu) as archive:
        names = {name.removeprefix("sources/") for name in archive.namelist() if name.startswith("sources/")}
        xml = archive.read("modelDescription.xml").decode()
    assert {"spring/spring.c", "spring/spring.h", "fmu/spring_values.h", "fmi2/fmi2Functions.h"} < names
    # Once for each interface.
    assert re.findall(r'<File name="([^"]+)"', xml) == ["fmi2_all.c", "fmi2_all.c"]
    assert not [name for name in names if name.startswith("fmi3") or "system" in name]


@pytest.mark.parametrize(("platform", "machine"), [("linux64", "X86_64"), ("aarch64-linux", "AARCH64")])
def test_linux_binaries(native_fmu: Path, platform: str, machine: str) -> None:
    elf = lief.ELF.parse(binary(native_fmu, platform))
    assert elf.header.machine_type.name == machine
    assert set(elf.libraries) <= {"libc.so.6", "libm.so.6"}
    versions = {v.name for needed in elf.symbols_version_requirement for v in needed.get_auxiliary_symbols()}
    assert versions
    assert all(tuple(map(int, v.removeprefix("GLIBC_").split("."))) <= (2, 17) for v in versions), versions
    assert {symbol.name for symbol in elf.exported_symbols} == FUNCTIONS | FUNCTIONS3
    assert not list(elf.symtab_symbols)
    assert not {".debug_info", ".symtab", ".note.gnu.build-id"} & {section.name for section in elf.sections}
    assert not any(entry.tag.name in ("RPATH", "RUNPATH", "TEXTREL") for entry in elf.dynamic_entries)


def test_windows_binary(native_fmu: Path) -> None:
    pe = lief.PE.parse(binary(native_fmu, "win64"))
    assert pe.header.machine.name == "AMD64"
    # The C runtime alone, and what is there since Windows 10: not even KERNEL32.
    assert all(re.fullmatch(r"api-ms-win-crt-\w+-l1-1-0\.dll", library) for library in pe.libraries), pe.libraries
    assert not pe.has_delay_imports
    assert {entry.name for entry in pe.get_export().entries} == FUNCTIONS | FUNCTIONS3
    # No debug information but the mark that the time in the header is a hash.
    assert all(entry.type.name == "REPRO" for entry in pe.debug)
    assert not pe.has_tls


@pytest.mark.parametrize(("platform", "processors"), [("darwin64", ["X86_64", "ARM64"]), ("aarch64-darwin", ["ARM64"])])
def test_macos_binaries(native_fmu: Path, platform: str, processors: list[str]) -> None:
    # lief frees the images together with the file.
    file = lief.MachO.parse(binary(native_fmu, platform))
    assert [image.header.cpu_type.name for image in file] == processors
    for image in file:
        assert image.header.file_type.name == "DYLIB"
        own = {"spring.dylib"}
        assert {library.name for library in image.libraries} - own == {"/usr/lib/libSystem.B.dylib"}
        assert list(image.build_version.minos) == [11, 0, 0]
        assert image.build_version.platform.name == "MACOS"
        exported = {export.symbol.name for export in image.dyld_info.exports}
        # The linker of ziglang exports two names of its own.
        assert exported - {"__mh_dylib_header", "___dso_handle"} == {f"_{name}" for name in FUNCTIONS | FUNCTIONS3}
        assert not any(segment.name == "__DWARF" for segment in image.segments)


def test_the_arm64_image_keeps_its_code_signature(native_fmu: Path) -> None:
    # macOS runs no arm64 code without; an ad-hoc signature is a hash of each page.
    fat, thin = binary(native_fmu, "darwin64"), binary(native_fmu, "aarch64-darwin")
    assert fat.endswith(thin)
    file = lief.MachO.parse(thin)
    signature = file.at(0).code_signature
    blob = thin[signature.data_offset : signature.data_offset + signature.data_size]
    magic, _, count = struct.unpack_from(">III", blob)
    assert magic == 0xFADE0CC0
    (start,) = (offset for kind, offset in struct.iter_unpack(">II", blob[12 : 12 + 8 * count]) if kind == 0)
    magic, _, _, flags, hashes, _, _, slots, limit = struct.unpack_from(">IIIIIIIII", blob, start)
    size, kind, _, page_power = struct.unpack_from(">BBBB", blob, start + 36)
    assert magic == 0xFADE0C02
    assert flags & 0x2, "ad hoc"
    assert (size, kind) == (32, 2), "SHA-256"
    page = 1 << page_power
    pages = [thin[at : min(at + page, limit)] for at in range(0, limit, page)]
    assert len(pages) == slots
    for k, content in enumerate(pages):
        at = start + hashes + k * size
        assert blob[at : at + size] == hashlib.sha256(content).digest(), k


def test_no_path_of_this_computer_reaches_the_fmu(native_fmu: Path) -> None:
    root = os.fsencode(Path(__file__).parents[2])
    with zipfile.ZipFile(native_fmu) as archive:
        for name in archive.namelist():
            content = archive.read(name)
            for path in (b"/tmp/", b"/home/", b"/root/", b"ziglang/", b".cache", root):
                assert path not in content, (name, path)


def test_sizes(native_fmu: Path) -> None:
    for platform in PLATFORMS:
        # Two images with pages of 16 KiB make the largest one.
        assert 10_000 < len(binary(native_fmu, platform)) < 380_000, platform
    assert native_fmu.stat().st_size < 545_000


@pytest.mark.slow
def test_images_have_the_same_bytes_from_another_folder_and_an_empty_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tool("ziglang")
    elsewhere = tmp_path / "a longer name" / "of a folder"
    elsewhere.mkdir(parents=True)
    monkeypatch.setattr("tempfile.tempdir", str(elsewhere))
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(tmp_path / "empty"))
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    monkeypatch.setenv("CC", "/bin/false")
    # Those with most of what a cache holds: the stubs of glibc and the import libraries.
    for target in (LINUX_X86, WINDOWS_X86):
        assert images.compiled(images.FMU, target) == images.image(images.FMU, target).read_bytes()
    assert list(elsewhere.iterdir()) == []


def test_the_archive_has_the_same_bytes_again(native_fmu: Path, tmp_path: Path) -> None:
    again = build_native_fmu(ModelFile("spring", SPRING), tmp_path, chosen_platforms("all"), zero=0.0)
    assert again.read_bytes() == native_fmu.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["spring.fmu"]


def test_all_platforms_in_half_a_second_without_a_compiler(
    native_fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(zig, "is_installed", lambda: False)
    monkeypatch.setenv("CC", "/bin/false")
    begin = time.process_time()
    again = build_native_fmu(ModelFile("spring", SPRING), tmp_path, chosen_platforms("all"), zero=0.0)
    assert time.process_time() - begin < 0.5
    assert again.read_bytes() == native_fmu.read_bytes()


@pytest.mark.parametrize("target", FMU_TARGETS, ids=lambda target: target.triple)
def test_a_filled_image_differs_in_its_block_and_hashes_only(target: Target) -> None:
    image = images.image(images.FMU, target).read_bytes()
    made = filled(image, ModelFile("spring", SPRING), "{12345678-1234-1234-1234-123456789abc}")
    changed = [k for k, (one, other) in enumerate(zip(image, made, strict=True)) if one != other]
    block = image.index(b"strandspringfmu\0")
    outside = [k for k in changed if not block + 24 <= k < block + 880]
    signature = lief.MachO.parse(image).at(0).code_signature.data_offset if target == MACOS_ARM else len(image)
    assert changed
    # SHA-256 of the one or two pages that hold the block.
    assert len(outside) <= (64 if target == MACOS_ARM else 0)
    assert all(k >= signature for k in outside)


def test_an_image_without_exactly_one_block_is_refused() -> None:
    image = images.image(images.FMU, LINUX_X86).read_bytes()
    for bad, count in ((image + image, 2), (image.replace(b"strandspringfmu", b"strandspringgmu"), 0)):
        with pytest.raises(BuildError, match=f"found {count}"):
            filled(bad, ModelFile("spring", SPRING), "")


@pytest.mark.slow
@pytest.mark.parametrize("home", ["", "/dev/null/home"])
def test_builds_where_no_cache_can_be_kept(home: str, monkeypatch: pytest.MonkeyPatch) -> None:
    tool("ziglang")
    for variable in ("ZIG_GLOBAL_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("HOME", home)
    source = b"int f(void);\nint f(void) { return 1; }\n"
    assert zig.shared_library(host_target(), {"f.c": source}, ("f.c",), "f", ())


def test_headers_and_libraries_of_the_machine_are_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tool("ziglang")
    (tmp_path / "math.h").write_text("#error of the machine")
    for variable in ("CPATH", "C_INCLUDE_PATH"):
        monkeypatch.setenv(variable, str(tmp_path))
    # New to the compiler's cache.
    source = f"#include <math.h>\ndouble f{time.time_ns()}(double x);\n"
    assert zig.shared_library(host_target(), {"f.c": source.encode()}, ("f.c",), "f", ())


def guid(contents: dict[str, bytes]) -> str:
    return re.findall(r'guid="([^"]+)"', contents["modelDescription.xml"].decode())[0]


def test_guid_follows_the_content_and_not_the_platforms(native_fmu: Path, description: Any) -> None:
    guids = {
        guid(native_contents(model, (), zero=0.0))
        for model in (
            ModelFile("spring", SPRING),
            ModelFile("spring", replace(SPRING, rho=SPRING.rho * (1 + 1e-15))),
            ModelFile("renamed", SPRING),
            ModelFile("spring", SPRING, "described"),
            ModelFile("spring", OTHER),
        )
    }
    assert len(guids) == 5
    assert description.guid in guids
    # The binary refuses to be instantiated for another description.
    assert description.guid.encode() in binary(native_fmu, "linux64")


def test_awkward_texts_reach_neither_c_nor_paths(tmp_path: Path) -> None:
    plain = native_contents(ModelFile("awkward", SPRING), (), zero=0.0)
    model = ModelFile("awkward", SPRING, AWKWARD, provenance={"records": [{"path": AWKWARD}]})
    fmu = build_native_fmu(model, tmp_path, zero=0.0)
    assert validate_fmu(str(fmu)) == []
    # Line ends are the only characters that XML and HTML change.
    assert fmpy.read_model_description(str(fmu)).description.split() == AWKWARD.split()
    with zipfile.ZipFile(fmu) as archive:
        names = archive.namelist()
        for name in names:
            if name.startswith("sources/"):
                without = archive.read(name).replace(
                    guid(native_contents(model, (), zero=0.0)).encode(), guid(plain).encode()
                )
                assert without == plain[name], name
        page = archive.read("documentation/index.html").decode()
    assert {Path(name).parts[0] for name in names} == {
        "binaries", "documentation", "extra", "model.png", "modelDescription.xml", "resources", "sources",
    }  # fmt: skip
    assert not any(".." in name or name.startswith("/") for name in names)
    assert "<b>bold" not in page
    assert "&lt;b&gt;bold" in page
    assert check_fmu(fmu).problems == ()


@pytest.mark.parametrize("name", ['x"; int evil; //', "../up", "a\nb", "a*/", "<x/>", "%s", "-o", "@file"])
def test_awkward_names_are_refused_before_anything_is_built(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    content = json.loads(ModelFile("fine", SPRING).to_json())
    Path("m.json").write_text(json.dumps({**content, "name": name}), encoding="utf-8")
    with pytest.raises(SystemExit) as left:
        main(["build", "m.json", "--backend", "native"])
    assert left.value.code == 1
    assert "name must be" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["m.json"]


def test_documentation_tells_what_is_native(native_fmu: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(native_fmu) as archive:
        page = archive.read("documentation/index.html").decode()
        licences = {name: archive.read(name).decode() for name in archive.namelist() if "/licenses/" in name}
    for told in (*PLATFORMS, "fmpy compile spring.fmu", "Model exchange", "-ffp-contract=off", "glibc 2.17"):
        assert told in page, told
    assert "libpython" not in page.lower()
    assert set(licences) == {f"documentation/licenses/{name}.txt" for name in ("license", "fmi-headers")}
    notice = licences["documentation/licenses/fmi-headers.txt"]
    assert notice.startswith("Copyright (C)")
    assert "2-Clause BSD License" in notice
    assert notice.rstrip().endswith("SUCH DAMAGE.")
    with zipfile.ZipFile(built(tmp_path)) as archive:
        page = archive.read("documentation/index.html").decode()
    assert "LD_PRELOAD" in page
    assert "Model exchange" not in page


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Spring(SPRING, "mount").save("mount.json")
    return "mount.json"


@pytest.mark.slow
def test_command_line_builds_for_the_host_and_tells_sizes(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    main(["build", model, "--json"])
    (fmu,) = json.loads(capsys.readouterr().out)["fmus"]
    assert fmu["backend"] == "native"
    assert sorted(fmu["binaries"]) == sorted(platform.name for platform in default_platforms())
    size = fmu["binaries"][host_folder()]
    main(["build", model, "--backend", "native", "--platform", "host", "--verbose"])
    out = capsys.readouterr().out
    assert f"Binaries: {host_folder()} {size / 1024:.0f} KiB\n" in out
    assert "valid; 401 steps of co-simulation and of model exchange" in out


@pytest.mark.slow
def test_an_fmu_for_other_computers_only_is_validated_but_not_run(
    model: str, capsys: pytest.CaptureFixture[str]
) -> None:
    other = "win64" if host_folder() != "win64" else "linux64"
    main(["build", model, "--backend", "native", "--platform", other, "--verbose"])
    out = capsys.readouterr().out
    assert f"Binaries: {other} " in out
    assert "no binary for this computer" in out


@pytest.mark.parametrize(
    ("arguments", "status", "expected"),
    [
        (["--backend", "native", "--platform", "amiga"], 2, "'amiga'"),
        (["--backend", "native", "--platform", "linux64,"], 2, "''"),
        (["--backend", "native", "--platform", "../x"], 2, "'../x'"),
        (["--backend", "native", "--needs-execution-tool"], 2, "for the Python-backed FMU"),
        (["--backend", "python", "--platform", "host"], 2, "the Python-backed one has linux64 and win64"),
    ],
)
def test_command_line_refuses(
    arguments: list[str], status: int, expected: str, model: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(["build", model, *arguments])
    assert left.value.code == status
    err = capsys.readouterr().err
    assert expected in err
    assert "Traceback" not in err
    assert not Path("dist").exists()


@pytest.fixture
def other_sources(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Callable[[bytes], None]]:
    """Changes the C sources, and takes away the images of these."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path.parent / f"{tmp_path.name}-cache"))
    sources = images.CompiledUnit.sources
    images.image.cache_clear()

    def change(line: bytes) -> None:
        monkeypatch.setattr(
            images.CompiledUnit, "sources", lambda unit: {name: line + text for name, text in sources(unit).items()}
        )

    yield change
    images.image.cache_clear()


def test_without_image_and_ziglang_one_sentence_says_what_to_do(
    model: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    other_sources: Callable[[bytes], None],
) -> None:
    other_sources(b"\n")
    monkeypatch.setattr(zig, "is_installed", lambda: False)
    with pytest.raises(SystemExit) as left:
        main(["build", model])
    assert left.value.code == 1
    assert 'pip install "strandspring[native]"' in capsys.readouterr().err
    assert not Path("dist").exists()


@pytest.mark.slow
def test_a_failing_compiler_leaves_the_old_fmu(tmp_path: Path, other_sources: Callable[[bytes], None]) -> None:
    tool("ziglang")
    (tmp_path / "spring.fmu").write_text("kept")
    other_sources(b'#error "broken here"\n')
    with pytest.raises(BuildError, match=r"ziglang \S+ failed to compile for x86_64-linux-gnu\.2\.17.*broken here"):
        build_native_fmu(ModelFile("spring", SPRING), tmp_path, chosen_platforms("linux64"))
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("spring.fmu", "kept")]


def test_warnings_are_refused() -> None:
    tool("ziglang")
    with pytest.raises(BuildError, match="unused"):
        zig.shared_library(LINUX_X86, {"a.c": b"int f(void);\nint f(void) { int u; return 1; }\n"}, ("a.c",), "a", ())


@pytest.mark.parametrize(
    ("system", "machine", "name"),
    [
        ("Linux", "x86_64", "linux64"), ("Linux", "aarch64", "aarch64-linux"), ("Windows", "AMD64", "win64"),
        ("Darwin", "x86_64", "darwin64"), ("Darwin", "arm64", "darwin64"), ("Linux", "riscv64", None),
        ("Windows", "ARM64", None),
    ],
)  # fmt: skip
def test_the_platform_of_a_host(system: str, machine: str, name: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.system", lambda: system)
    monkeypatch.setattr("platform.machine", lambda: machine)
    assert host_folder() == name
    if name is None:
        with pytest.raises(BuildError, match=f"{system} {machine}"):
            chosen_platforms("host")
    else:
        assert [platform.name for platform in chosen_platforms("host")] == [name]


def test_default_platforms_are_those_that_the_package_carries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("strandspring.fmu.native.platforms.PACKAGED", tmp_path)
    for unit in images.OF_FMUS:
        assert default_platforms() == chosen_platforms("host")
        for target in FMU_TARGETS:
            (tmp_path / unit.file_name(target)).touch()
    assert [p.name for p in default_platforms()] == list(PLATFORMS)


def test_platforms_are_chosen_once_each() -> None:
    assert [p.name for p in chosen_platforms("win64, linux64,win64")] == ["win64", "linux64"]
    assert [p.name for p in chosen_platforms("all,win64")] == list(PLATFORMS)


def image(processor: int, variant: int, size: int) -> bytes:
    return struct.pack("<III", 0xFEEDFACF, processor, variant).ljust(size, b"\xaa")


def test_universal_binary_has_aligned_untouched_images() -> None:
    images = [image(0x01000007, 3, 17_001), image(0x0100000C, 0, 40)]
    content = universal(images)
    assert struct.unpack_from(">II", content) == (0xCAFEBABE, 2)
    for k, expected in enumerate(images):
        processor, variant, offset, size, power = struct.unpack_from(">IIIII", content, 8 + 20 * k)
        assert (processor, variant) == struct.unpack_from("<II", expected, 4)
        assert power == 14
        assert offset % (1 << power) == 0
        assert content[offset : offset + size] == expected
    assert len(content) == 3 * (1 << 14) + 40


def test_universal_binary_takes_images_of_macos_only() -> None:
    with pytest.raises(ValueError, match="7f454c46"):
        universal([b"\x7fELF".ljust(40, b"\0")])


@pytest.mark.parametrize("counts", [(1, 1), (21, 9)])
def test_every_number_of_coefficients_compiles(counts: tuple[int, int], tmp_path: Path) -> None:
    kE, kA = ((first, *[0.0] * (count - 1)) for first, count in zip((5.0, 1.0), counts, strict=True))
    model = ModelFile("counted", replace(SPRING, kE=kE, kA=kA))
    assert check_fmu(build_native_fmu(model, tmp_path, zero=0.0)).problems == ()
