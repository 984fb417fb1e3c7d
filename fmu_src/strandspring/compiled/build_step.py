"""What setuptools does besides copying files when the package is built.

It compiles the images of a wheel, and describes the package by a README without links into the repository.

pyproject.toml names these commands. setuptools loads this file by itself, before the package can be imported.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py
from setuptools.command.egg_info import egg_info

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from strandspring.compiled import images
from strandspring.compiled.targets import FMU_TARGETS, host_target, wheel_platform

# The bundled record and the schemas of files, which a source checkout keeps beside its models.
_RECORD = [f"models/records/{name}" for name in ("LICENSE.txt", "README.md", "rubber_stretch.csv")]
_EXAMPLES = [*_RECORD, *(f"models/strandspring-{file}.schema.json" for file in ("model", "system"))]


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
        wanted = [(host_target(), [images.KERNEL]), *((target, images.OF_FMUS) for target in FMU_TARGETS)]
        with ThreadPoolExecutor() as pool:
            contents = pool.map(lambda job: images.all_compiled(job[1], job[0]), wanted)
            folder.mkdir(parents=True)
            for (target, units), of_target in zip(wanted, contents, strict=True):
                for unit, content in zip(units, of_target, strict=True):
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


class WheelOfPlatform(bdist_wheel):
    """Tags the wheel: any Python 3, this kind of computer. The same sources give the same bytes."""

    def run(self) -> None:
        """Run the command."""
        # The time of every file in the archive: the earliest that it can hold, 1980.
        os.environ.setdefault("SOURCE_DATE_EPOCH", "315532800")
        super().run()

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
