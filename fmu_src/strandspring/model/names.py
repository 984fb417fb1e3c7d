"""Names of models and of the FMUs that are built of them, and what model files are recognized by."""

from __future__ import annotations

import re

from ..errors import ModelError

FORMAT = "strandspring-model"
# What is written; read are all from 1 on. A second mechanism and Maxwell branches came with the other one.
VERSION, VERSION_OF_BRANCHES = 4, 3
MAX_DESCRIPTION = 2000
# An identifier of C and Python that is also a safe file name.
LONGEST_NAME = 64
NAME_PATTERN = r"^[A-Za-z][A-Za-z0-9_]{0,63}$"
NAME_RULE = "a letter followed by at most 63 letters, digits or underscores, and not a Windows device such as nul"
_WINDOWS_DEVICES = {"con", "prn", "aux", "nul"} | {f"{d}{k}" for d in ("com", "lpt") for k in range(1, 10)}


def check_name(name: str) -> str:
    """The name, if it is valid for a model and its FMU.

    Raises
    ------
    ModelError   If it is not an identifier, or cannot be a file name on Windows.
    """
    if not isinstance(name, str):
        raise ModelError(f"The name must be text, got {type(name).__name__}.")
    if not re.fullmatch(NAME_PATTERN, name) or name.lower() in _WINDOWS_DEVICES:
        raise ModelError(f"The name must be {NAME_RULE}, got {name[:60]!r}; choose another name.")
    return name


def identifier(text: str) -> str:
    """Text, such as a file name without its suffix, as a valid name."""
    name = re.sub(r"[^A-Za-z0-9_]+", "_", text).strip("_")[:LONGEST_NAME].rstrip("_")
    try:
        return check_name(name)
    except ModelError:  # begins with a digit, say
        return f"spring_{name}"[:LONGEST_NAME].rstrip("_")
