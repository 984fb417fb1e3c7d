"""The machines for which C is compiled, and the flags; nothing else in the package knows them."""

from __future__ import annotations

import platform
from dataclasses import dataclass

from ..errors import BuildError

FLAGS = (
    "-std=c11",
    "-ffp-contract=off",  # or the last bits differ from Python
    "-g0",  # the linker would drop what debuggers need, which takes a third of the time to make
    "-Wall", "-Wextra", "-Wpedantic", "-Wdouble-promotion", "-Werror",
)  # fmt: skip


@dataclass(frozen=True)
class System:
    """Conventions of an operating system.

    Attributes
    ----------
    suffix : str              Of a shared library.
    linking : tuple of str    Flags of the linker.
    runtime : str or None     A C file beside this one that takes the place of the compiler's start code.
    headers : str or None     A folder of the compiler with those of the C library, where it does not find them itself
                              without linking its own.
    wheel : str               Tag of a wheel, but for the processor.
    """

    suffix: str
    wheel: str
    linking: tuple[str, ...] = ()
    runtime: str | None = None
    headers: str | None = None


_UCRT = (
    "-nostdlib",
    "-Wl,--entry=library_start",
    *(f"-lapi-ms-win-crt-{part}-l1-1-0" for part in ("convert", "heap", "math", "private", "stdio", "string")),
)
# Only the system's libraries are linked: the compiler's own would first be compiled for each target, which takes long.
_SYSTEMS = {
    "linux": System(".so", "manylinux_2_17_{}", ("-nostdlib", "-lc", "-lm", "-Wl,--build-id=none")),
    "windows": System(".dll", "win_{}", _UCRT, "windows_runtime.c", "lib/libc/include/any-windows-any"),
    "macos": System(".dylib", "macosx_11_0_{}", ("-nostdlib", "-lc")),
}


@dataclass(frozen=True)
class Target:
    """One system on one processor, by the compiler's name for it."""

    triple: str

    @property
    def system(self) -> System:
        return _SYSTEMS[self.triple.split("-")[1].split(".")[0]]


LINUX_X86 = Target("x86_64-linux-gnu.2.17")
LINUX_ARM = Target("aarch64-linux-gnu.2.17")
WINDOWS_X86 = Target("x86_64-windows-gnu")
MACOS_X86 = Target("x86_64-macos.11.0")
MACOS_ARM = Target("aarch64-macos.11.0")

# Of the images that become binaries of an FMU.
FMU_TARGETS = (LINUX_X86, LINUX_ARM, WINDOWS_X86, MACOS_X86, MACOS_ARM)

# By system and processor, with the processor's name in the tag of a wheel.
_HOSTS = {
    ("Linux", "x86_64"): (LINUX_X86, "x86_64"),
    ("Linux", "aarch64"): (LINUX_ARM, "aarch64"),
    ("Windows", "x86_64"): (WINDOWS_X86, "amd64"),
    ("Darwin", "x86_64"): (MACOS_X86, "x86_64"),
    ("Darwin", "aarch64"): (MACOS_ARM, "arm64"),
}


def host_target() -> Target:
    """This computer.

    Raises
    ------
    BuildError   If nothing is compiled for computers of its kind.
    """
    return _host()[0]


def wheel_platform() -> str:
    """The platform tag of a wheel that is built on this computer."""
    target, processor = _host()
    return target.system.wheel.format(processor)


def _host() -> tuple[Target, str]:
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    host = _HOSTS.get((platform.system(), machine))
    if host is None:
        known = ", ".join(" ".join(key) for key in _HOSTS)
        raise BuildError(
            f"strandspring cannot be compiled for this computer ({platform.system()} {platform.machine()}); "
            f"use one of {known}."
        )
    return host
