"""Icons of FMUs and of terminals, as they lie in the folder `assets`."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

# By version of FMI.
_ICONS = {2: ("model.png",), 3: ("terminalsAndIcons/icon.png", "terminalsAndIcons/icon.svg")}


def icon(fmi: int = 2, name: str = "model") -> dict[str, bytes]:
    """The icon by its paths in the FMU, of a spring (model) or a system."""
    return {path: asset(f"{name}{Path(path).suffix}") for path in _ICONS[fmi]}


def asset(name: str) -> bytes:
    """A file of the folder `assets`."""
    return (files("strandspring.fmu") / "assets" / name).read_bytes()
