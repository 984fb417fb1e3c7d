"""What setuptools does besides copying files when the package is built.

It compiles the images of a wheel, describes the package by a README without links into the repository, and writes the
same bytes for the same sources, whatever the times and the permissions of their files.

pyproject.toml names these commands. setuptools loads this file by itself, before the package can be imported.
"""

from __future__ import annotations

import gzip
import os
import re
import shutil
import sys
import tarfile
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py
from setuptools.command.egg_info import egg_info
from setuptools.command.sdist import sdist

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from strandspring.compiled import images
from strandspring.compiled.targets import FMU_TARGETS, host_target, wheel_platform

# The bundled record and the schemas of files, which a source checkout keeps beside its models.
_RECORD = [f"models/records/{name}" for name in ("LICENSE.txt", "README.md", "rubber_stretch.csv")]
_EXAMPLES = [*_RECORD, *(f"models/strandspring-{file}.schema.json" for file in ("model", "system"))]

_TIME = 315532800  # of every file in an archive [s]: the earliest that a wheel can hold, 1980


class BuildWithImages(build_py):
    """Adds the kernel for this computer and the images of FMUs for all; editable installs compile the kernel only."""

    def run(self) -> None:
        """Run the command."""
        super().run()
        if self.editable_mode:
            images.image(images.KERNEL, host_target())
            return
        folder = self._images()
        # A folder that an earlier build left may hold images of other sources.
        shutil.rmtree(folder, ignore_errors=True)
        wanted = [(images.KERNEL, host_target()), *product(images.OF_FMUS, FMU_TARGETS)]
        with ThreadPoolExecutor() as pool:
            contents = list(pool.map(images.compiled, *zip(*wanted, strict=True)))
        folder.mkdir(parents=True)
        for (unit, target), content in zip(wanted, contents, strict=True):
            (folder / unit.file_name(target)).write_bytes(content)
        for path in _EXAMPLES:
            self.mkpath(str(self._example(path).parent))
            self.copy_file(path, self._example(path))

    def get_outputs(self, include_bytecode: bool = True) -> list[str]:
        """Files of the build."""
        built = [*self._images().glob("*"), *(self._example(path) for path in _EXAMPLES)]
        return [*super().get_outputs(include_bytecode), *map(str, built)]

    def _images(self) -> Path:
        return Path(self.build_lib, *images.PACKAGED.relative_to(images.PACKAGED.parents[2]).parts)

    def _example(self, path: str) -> Path:
        return Path(self.build_lib, "strandspring", "examples", *Path(path).parts[1:])


class SourcesAsArchive(sdist):
    """Writes the archive of the sources."""

    def make_archive(self, base_name: str, *_: object, base_dir: str, **__: object) -> str:
        """The path of the archive of a folder."""
        path = f"{base_name}.tar.gz"
        with gzip.GzipFile(path, "wb", mtime=_TIME) as packed, tarfile.open(fileobj=packed, mode="w") as archive:
            archive.add(base_dir, filter=_without_origin)
        return path


def _without_origin(member: tarfile.TarInfo) -> tarfile.TarInfo:
    member.mtime, member.mode = _TIME, _permissions(member.mode)
    member.uid = member.gid = 0
    member.uname = member.gname = ""
    return member


def _permissions(mode: int) -> int:
    """Those that do not depend on whose file it is."""
    return 0o755 if mode & 0o100 else 0o644


class WheelOfPlatform(bdist_wheel):
    """Tags the wheel: any Python 3, this kind of computer."""

    def run(self) -> None:
        """Run the command."""
        os.environ.setdefault("SOURCE_DATE_EPOCH", str(_TIME))
        super().run()

    def write_wheelfile(self, wheelfile_base: str, *arguments: str) -> None:
        """Write the last of the files that are archived."""
        super().write_wheelfile(wheelfile_base, *arguments)
        for path in Path(self.bdist_dir).rglob("*"):
            path.chmod(_permissions(path.stat().st_mode))

    def get_tag(self) -> tuple[str, str, str]:
        """Python, binary interface and platform of the wheel."""
        return "py3", "none", wheel_platform()


class DescriptionForIndex(egg_info):
    """Describes the package by the README, as a package index can show it."""

    def run(self) -> None:
        """Run the command."""
        metadata = self.distribution.metadata
        metadata.long_description = without_relative_links(metadata.long_description)
        super().run()


def without_relative_links(markdown: str) -> str:
    """Markdown without paragraphs of pictures, and with the texts of links to files in place of the links."""
    without_pictures = re.sub(r"^<img .*?\n\n", "", markdown, flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"\[([^\]]+)\]\((?!https?://)[^)]+\)", r"\1", without_pictures)
