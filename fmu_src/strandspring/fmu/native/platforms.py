"""The platforms of an FMU: folders below ``binaries/`` and the images that go into them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...compiled.images import OF_FMUS, PACKAGED, Unit, contents
from ...compiled.targets import LINUX_ARM, LINUX_X86, MACOS_ARM, MACOS_X86, WINDOWS_X86, Target, host_target
from ...errors import BuildError
from .macho import universal


@dataclass(frozen=True)
class Platform:
    """One folder below ``binaries/``.

    Attributes
    ----------
    name : str                    Of the folder, by FMI 2.0.4.
    targets : tuple of Target     Several become one universal binary.
    """

    name: str
    targets: tuple[Target, ...]

    @property
    def suffix(self) -> str:
        """Of the binary."""
        return self.targets[0].system.suffix

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


def host_folder() -> str | None:
    """The folder below ``binaries/`` for this computer, if FMUs of ours can have one."""
    try:
        target = host_target()
    except BuildError:
        return None
    return next(platform.name for platform in PLATFORMS.values() if target in platform.targets)


def default_platforms() -> tuple[Platform, ...]:
    """Those whose images the installed package carries; in a source checkout that of this computer."""
    return tuple(p for p in PLATFORMS.values() if p.is_packaged) or chosen_platforms("host")


def chosen_platforms(names: str) -> tuple[Platform, ...]:
    """Platforms by their names with commas between, or all of them, or that of this computer.

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
        elif name in PLATFORMS:
            chosen[name] = PLATFORMS[name]
        else:
            raise BuildError(f"A platform must be `host`, `all` or one of {', '.join(PLATFORMS)}, got {name[:40]!r}.")
    return tuple(chosen.values())


def binaries(
    name: str, platforms: Sequence[Platform], unit: Unit, finished: Callable[[bytes], bytes] = bytes
) -> dict[str, bytes]:
    """The binaries of an FMU by their path inside it.

    Parameters
    ----------
    name : str                          The FMU's model identifier.
    platforms : sequence of Platform
    unit : Unit                         What the images are of.
    finished : callable                 Makes the binary of one FMU of an image.

    Raises
    ------
    BuildError   If an image would have to be compiled and ziglang is not installed, or fails.
    """
    images = contents(unit, {target for platform in platforms for target in platform.targets})
    members = {}
    for platform in platforms:
        parts = [finished(images[target]) for target in platform.targets]
        members[f"binaries/{platform.name}/{name}{platform.suffix}"] = parts[0] if len(parts) == 1 else universal(parts)
    return members
