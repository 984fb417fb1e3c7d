"""Images of the C sources: found, compiled once, kept, and never those of other sources."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from strandspring.compiled import images, sources, zig
from strandspring.compiled.images import KERNEL, OF_FMUS, PACKAGED, image
from strandspring.compiled.targets import FMU_TARGETS, LINUX_X86, Target, host_target, wheel_platform
from strandspring.errors import BuildError
from tools import program, tool

# Everything that a user's program does to get the kernel.
ROOT = Path(__file__).resolve().parents[2]
RESPONSE = """
from strandspring import Spring, SpringParameters
spring = Spring(SpringParameters((0.0, 1000.0), (1.0,), 25.0, 230.0, 1.0, 1.0, 0.0, -0.05, 0.05))
assert spring.response([0.0, 0.01, -0.01])[1] > 10.0
"""
LOAD = "from strandspring.kernel.library import library; print(library()._name)"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The user's cache, empty, where the package carries no image."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(images, "PACKAGED", tmp_path / "package")
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    image.cache_clear()
    yield tmp_path / "strandspring"
    image.cache_clear()


@pytest.fixture
def compiler(monkeypatch: pytest.MonkeyPatch) -> list[Target]:
    """The targets for which something has been compiled, which takes no time."""
    done: list[Target] = []

    def compiled(_: images.CompiledUnit, target: Target) -> bytes:
        done.append(target)
        return b"an image"

    monkeypatch.setattr(images, "compiled", compiled)
    monkeypatch.setattr(zig, "is_installed", lambda: True)
    return done


def test_an_image_is_compiled_once_and_kept(
    cache: Path, compiler: list[Target], capsys: pytest.CaptureFixture[str]
) -> None:
    path = image(KERNEL, LINUX_X86)
    assert path.parent == cache
    assert path.read_bytes() == b"an image"
    said = capsys.readouterr()
    assert said.err == "Compiling the kernel for x86_64-linux-gnu.2.17, once for these C sources.\n"
    assert said.out == ""
    image.cache_clear()
    assert image(KERNEL, LINUX_X86) == path
    assert compiler == [LINUX_X86]
    assert capsys.readouterr().err == ""
    assert [kept.name for kept in cache.iterdir()] == [path.name]


def test_the_package_comes_before_the_cache(cache: Path, compiler: list[Target]) -> None:
    images.PACKAGED.mkdir()
    packaged = images.PACKAGED / KERNEL.file_name(LINUX_X86)
    packaged.touch()
    assert image(KERNEL, LINUX_X86) == packaged
    assert compiler == []
    assert not cache.exists()


def test_a_changed_source_flag_or_target_asks_for_another_image(monkeypatch: pytest.MonkeyPatch) -> None:
    names = {unit.file_name(target) for unit in (KERNEL, *OF_FMUS) for target in FMU_TARGETS}
    assert len(names) == 15
    files = KERNEL.sources()
    assert {"core/c/spring/spring.c", "core/c/spring/saturation.h", "kernel/c/kernel.c"} <= set(files)
    law = "core/c/spring/spring.c"
    for changed in (
        {**files, law: files[law] + b"\n"},
        {("core/c/spring/other.c" if name == law else name): text for name, text in files.items()},
    ):
        monkeypatch.setattr(images.CompiledUnit, "sources", lambda _, changed=changed: changed)
        names.add(KERNEL.file_name(LINUX_X86))
    monkeypatch.undo()
    monkeypatch.setattr(images, "FLAGS", (*images.FLAGS, "-DOTHER"))
    names.add(KERNEL.file_name(LINUX_X86))
    assert len(names) == 18


def test_without_a_compiler_one_sentence_says_what_to_do(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zig, "is_installed", lambda: False)
    hint = r'^The compiled kernel for .* is missing, .*pip install "strandspring\[native\]".*\.$'
    with pytest.raises(BuildError, match=hint):
        image(KERNEL, LINUX_X86)
    assert not cache.exists()


@pytest.fixture
def no_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder among temporary files that replaces a cache that cannot be written."""
    place = cache.parent
    (place / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(place / "file"))
    return place / "temporary" / f"strandspring-cache-{os.geteuid()}"


def test_without_a_cache_an_image_is_compiled_once_too(
    no_cache: Path, compiler: list[Target], capsys: pytest.CaptureFixture[str]
) -> None:
    for _ in range(3):
        assert image(KERNEL, LINUX_X86).read_bytes() == b"an image"
        assert image(KERNEL, LINUX_X86).parent == no_cache
        image.cache_clear()
    assert compiler == [LINUX_X86]
    assert no_cache.stat().st_mode & 0o777 == 0o700
    said = capsys.readouterr().err
    assert said.count(f"It is kept in {no_cache}; set XDG_CACHE_HOME to a folder that can be written.") == 1


@pytest.mark.parametrize("attack", ["open to others", "link"])
def test_an_image_that_others_may_have_written_is_not_loaded(
    attack: str, no_cache: Path, compiler: list[Target], tmp_path: Path
) -> None:
    if attack == "link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        no_cache.symlink_to(tmp_path / "elsewhere")
    else:
        no_cache.mkdir(mode=0o700)
        no_cache.chmod(0o770)
    (no_cache / KERNEL.file_name(LINUX_X86)).write_bytes(b"an attack")
    with pytest.raises(BuildError, match="Set XDG_CACHE_HOME to a folder that can be written"):
        image(KERNEL, LINUX_X86)
    assert compiler == [LINUX_X86]


def test_images_of_old_sources_are_discarded_after_a_month(cache: Path, compiler: list[Target]) -> None:
    cache.mkdir()
    for name, days in (("old", 31), ("young", 29)):
        (cache / name).touch()
        then = time.time() - days * 24 * 3600
        os.utime(cache / name, (then, then))
    made = image(KERNEL, LINUX_X86)
    assert compiler
    assert {path.name for path in cache.iterdir()} == {"young", made.name}


@pytest.mark.slow
def test_processes_that_compile_at_once_do_not_disturb_each_other(tmp_path: Path) -> None:
    tool("ziglang")
    # The source checkout, which carries no images.
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT / "fmu_src")}
    environment.setdefault("ZIG_GLOBAL_CACHE_DIR", str(Path("~/.cache/zig").expanduser()))
    running = [
        subprocess.Popen([sys.executable, "-c", LOAD], env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    paths = {process.communicate()[0].strip() for process in running}
    assert paths == {str(tmp_path / "strandspring" / KERNEL.file_name(host_target()))}
    assert [path.name for path in (tmp_path / "strandspring").iterdir()] == [KERNEL.file_name(host_target())]


def test_a_wheel_carries_every_image() -> None:
    if not PACKAGED.exists():
        pytest.skip("run from a source checkout")
    of_fmus = {unit.file_name(target) for unit in OF_FMUS for target in FMU_TARGETS}
    assert {path.name for path in PACKAGED.iterdir()} == {KERNEL.file_name(host_target()), *of_fmus}


@pytest.mark.parametrize(
    ("system", "machine", "tag"),
    [
        ("Linux", "x86_64", "manylinux_2_17_x86_64"), ("Linux", "aarch64", "manylinux_2_17_aarch64"),
        ("Windows", "AMD64", "win_amd64"), ("Darwin", "x86_64", "macosx_11_0_x86_64"),
        ("Darwin", "arm64", "macosx_11_0_arm64"),
    ],
)  # fmt: skip
def test_tag_of_a_wheel(system: str, machine: str, tag: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.system", lambda: system)
    monkeypatch.setattr("platform.machine", lambda: machine)
    assert wheel_platform() == tag


def test_headers_of_fmi_are_those_of_fmpy(monkeypatch: pytest.MonkeyPatch) -> None:
    assert b"fmi2DoStepTYPE" in sources.fmi_header("fmi2Functions.h")
    monkeypatch.setattr(sources, "find_spec", lambda _: None)
    with pytest.raises(BuildError, match="install fmpy"):
        sources.fmi_header("fmi2Functions.h")


@pytest.mark.skipif(host_target() != LINUX_X86, reason="emulates an x86 processor on Linux")
def test_the_kernel_runs_on_a_processor_without_avx() -> None:
    emulator = program("qemu-x86_64", package="qemu-user")
    # The oldest that NumPy runs on. On a computer of AMD the emulator keeps the maker, by which OpenBLAS would choose.
    environment = {**os.environ, "OPENBLAS_CORETYPE": "Nehalem"}
    subprocess.run([emulator, "-cpu", "Nehalem", sys.executable, "-c", RESPONSE], check=True, env=environment)
