"""The platforms of a native FMU: folders below ``binaries/`` and the images that go into them."""

from __future__ import annotations

from dataclasses import dataclass

from ...compiled.images import FMU, PACKAGED
from ...compiled.targets import LINUX_ARM, LINUX_X86, MACOS_ARM, MACOS_X86, WINDOWS_X86, Target, host_target
from ...errors import BuildError


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
        return all((PACKAGED / FMU.file_name(target)).is_file() for target in self.targets)


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
