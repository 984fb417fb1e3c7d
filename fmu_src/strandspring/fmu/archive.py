"""What every FMU holds whatever its back end, and how it becomes a file with reproducible bytes."""

from __future__ import annotations

import hashlib
import re
import zipfile
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

from ..compiled.sources import fmi_header
from ..errors import BuildError
from ..ground.files import replacing
from ..model.modelfile import ModelFile
from .description.content import Backend
from .description.icons import icon
from .documentation import documentation_page

_TYPES_OF_PLATFORM = {2: "fmi2TypesPlatform.h", 3: "fmi3PlatformTypes.h"}
# The earliest time a zip archive can hold.
_TIMESTAMP = (1980, 1, 1, 0, 0, 0)


def installed_version(distribution: str) -> str:
    """Version of an installed distribution, or "unknown" if it is run without being installed."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "unknown"


def content_guid(parts: list[bytes], files: Mapping[str, bytes]) -> str:
    """A GUID that is the same for the same parts and files."""
    digest = hashlib.sha256()
    for part in (*parts, *(part for name, content in sorted(files.items()) for part in (name.encode(), content))):
        digest.update(len(part).to_bytes(8, "big"))
        digest.update(part)
    code = digest.hexdigest()
    return f"{{{code[:8]}-{code[8:12]}-{code[12:16]}-{code[16:20]}-{code[20:32]}}}"


def common_contents(
    model: ModelFile,
    zero: float,
    description: bytes,
    backend: Backend,
    others: tuple[str, ...] = (),
    platforms: tuple[str, ...] | None = None,
) -> dict[str, bytes]:
    """Description, icon, documentation and licences by their path in the FMU.

    The model's displacement is counted from `zero` [m]. `others` are the distributions of which the FMU holds parts,
    besides ours; `platforms` are those of a native FMU.
    """
    return {
        "modelDescription.xml": description,
        **icon(backend.fmi),
        "documentation/index.html": documentation_page(model, zero, platforms, backend).encode("utf-8"),
        **licences(others, backend.fmi),
    }


def licences(others: tuple[str, ...], fmi: int = 2) -> dict[str, bytes]:
    """Our licence and those of what else an FMU holds parts of, FMI and other distributions, by path in the FMU.

    Raises
    ------
    BuildError   If FMPy's headers of FMI, from which the binaries are compiled, are missing or hold no licence.
    """
    # FMI takes license.txt as the entry point.
    names = {"strandspring": "license", **{other: other for other in others}}
    texts = {name: _licence(distribution) for distribution, name in names.items()}
    texts["fmi-headers"] = _licence_of_headers(fmi)
    return {f"documentation/licenses/{name}.txt": text.encode("utf-8") for name, text in texts.items() if text}


def fmu_name(name: str, backend: str, fmi: int = 2) -> str:
    """The name of the FMU of a model of this name; all kinds may be written into one folder."""
    parts = (name, f"fmi{fmi}" if fmi != 2 else "", backend.replace("native", ""))
    return "_".join(filter(None, parts))


def fmu_path(directory: str | Path, name: str, backend: str, fmi: int = 2) -> Path:
    """Where this FMU is written."""
    return Path(directory) / f"{fmu_name(name, backend, fmi)}.fmu"


def write_archive(path: Path, contents: Mapping[str, bytes]) -> Path:
    """Write a zip archive whose bytes depend on the contents alone; returns its path."""
    with replacing(path) as part, zipfile.ZipFile(part, "w") as archive:
        for name, content in sorted(contents.items()):
            entry = zipfile.ZipInfo(name, _TIMESTAMP)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix, on every platform, so that the permissions below count
            entry.external_attr = (0o100755 if name.startswith("binaries/") else 0o100644) << 16
            archive.writestr(entry, content)
    return path


def binary_sizes(fmu: Path) -> dict[str, int]:
    """Bytes of the binary for each platform of an FMU."""
    with zipfile.ZipFile(fmu) as archive:
        parts = [(entry.filename.split("/"), entry.file_size) for entry in archive.infolist()]
    return {path[1]: size for path, size in parts if path[0] == "binaries"}


def _licence_of_headers(fmi: int) -> str:
    """The copyright notice and the licence, which stand in the first comment of each header of FMI."""
    header = fmi_header(_TYPES_OF_PLATFORM[fmi]).decode("utf-8")
    notice = re.search(r"Copyright .*?(?=\s*-*\s*\*/)", header, flags=re.DOTALL)
    if notice is None:
        raise BuildError(f"The headers of fmpy {installed_version('fmpy')} hold no licence; install another fmpy.")
    return f"{notice.group()}\n"


def _licence(distribution: str) -> str | None:
    try:
        installed = metadata.distribution(distribution)
    except metadata.PackageNotFoundError:
        return None
    # Metadata 2.4 has a folder for licences; before, they lay beside the metadata.
    return installed.read_text("licenses/LICENSE") or installed.read_text("LICENSE")
