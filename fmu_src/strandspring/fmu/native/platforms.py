"""The platforms of an FMU: folders below ``binaries/`` and the images that go into them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...compiled.images import OF_FMUS, PACKAGED, CompiledUnit, contents
from ...compiled.targets import LINUX_ARM, LINUX_X86, MACOS_ARM, MACOS_X86, WINDOWS_X86, Target, host_target
from ...errors import BuildError
from .macho import universal

# Of the Python-backed FMU, with its library, by the folder below `binaries/`.
PYTHON_PLATFORMS = {"linux64": "libpythonfmu-export.so", "win64": "pythonfmu-export.dll"}


@dataclass(frozen=True)
class Platform:
    """One folder below ``binaries/``.

    Attributes
    ----------
    name : str                    Of the folder, by FMI 2.0.4.
    targets : tuple of Target     Several become one universal binary in FMI 2.0, and a folder each in FMI 3.0.
    """

    name: str
    targets: tuple[Target, ...]

    @property
    def suffix(self) -> str:
        """Of the binary."""
        return self.targets[0].system.suffix

    def folders(self, fmi: int) -> dict[str, tuple[Target, ...]]:
        """The images of the binary in each folder, by the folder's name in a version of FMI, 2 or 3."""
        return {self.name: self.targets} if fmi == 2 else {platform_tuple(target): (target,) for target in self.targets}

    @property
    def is_packaged(self) -> bool:
        """Whether the installed package carries all images."""
        return all((PACKAGED / unit.file_name(target)).is_file() for unit in OF_FMUS for target in self.targets)


# FMI 2.0.4 keeps the names of FMI 2.0 for x86 and takes those of FMI 3.0 for everything else. Simulators on Apple
# silicon look in either folder, so darwin64 is universal and aarch64-darwin holds its half for arm64.
PLATFORMS = {
    known.name: known
    for known in (
        Platform("linux64", (LINUX_X86,)),
        Platform("aarch64-linux", (LINUX_ARM,)),
        Platform("win64", (WINDOWS_X86,)),
        Platform("darwin64", (MACOS_X86, MACOS_ARM)),
        Platform("aarch64-darwin", (MACOS_ARM,)),
    )
}


# What else people may call them: the names of FMI 3.0.
_BY_FMI3 = {
    "x86_64-linux": PLATFORMS["linux64"],
    "x86_64-windows": PLATFORMS["win64"],
    "x86_64-darwin": Platform("darwin64", (MACOS_X86,)),
}


def platform_tuple(target: Target) -> str:
    """The name of a folder below ``binaries/`` by FMI 3.0."""
    processor, system = target.triple.split("-")[:2]
    return f"{processor}-{system.split('.')[0].replace('macos', 'darwin')}"


def host_folder(fmi: int = 2) -> str | None:
    """The folder below ``binaries/`` for this computer, if FMUs of ours can have one, by a version of FMI."""
    try:
        target = host_target()
    except BuildError:
        return None
    of_fmi2 = next(platform.name for platform in PLATFORMS.values() if target in platform.targets)
    return of_fmi2 if fmi == 2 else platform_tuple(target)


def default_platforms() -> tuple[Platform, ...]:
    """Those whose images the installed package carries; in a source checkout that of this computer."""
    return tuple(p for p in PLATFORMS.values() if p.is_packaged) or chosen_platforms("host")


def chosen_platforms(names: str) -> tuple[Platform, ...]:
    """Platforms by their names in FMI 2.0 or 3.0 with commas between, or all of them, or that of this computer.

    Raises
    ------
    BuildError   If there is no such platform.
    """
    chosen: dict[str, Platform] = {}
    for name in (part.strip() for part in names.split(",")):
        if name == "all":
            chosen |= PLATFORMS
        elif name == "host":
            host_target()  # or the reason why there is none
            chosen[str(host_folder())] = PLATFORMS[str(host_folder())]
        elif known := PLATFORMS.get(name) or _BY_FMI3.get(name):
            chosen[known.name] = max(known, chosen.get(known.name, known), key=lambda platform: len(platform.targets))
        else:
            raise BuildError(f"A platform must be `host`, `all` or one of {', '.join(PLATFORMS)}, got {name[:40]!r}.")
    return tuple(chosen.values())


def binaries(
    name: str,
    platforms: Sequence[Platform],
    unit: CompiledUnit,
    finished: Callable[[bytes], bytes] = bytes,
    fmi: int = 2,
) -> dict[str, bytes]:
    """The binaries of an FMU by their path inside it.

    Parameters
    ----------
    name : str                          The FMU's model identifier.
    platforms : sequence of Platform
    unit : CompiledUnit                 What the images are of.
    finished : callable                 Makes the binary of one FMU of an image.
    fmi : int                           Version of FMI.

    Raises
    ------
    BuildError   If an image would have to be compiled and ziglang is not installed, or fails.
    """
    images = contents(unit, {target for platform in platforms for target in platform.targets})
    members = {}
    for platform in platforms:
        for folder, targets in platform.folders(fmi).items():
            parts = [finished(images[target]) for target in targets]
            path = f"binaries/{folder}/{name}{platform.suffix}"
            members[path] = parts[0] if len(parts) == 1 else universal(parts)
    return members
