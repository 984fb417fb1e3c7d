"""Where displacement is counted from in a function's results."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ..coordinates import chosen_zero
from ..core.parameters import SpringParameters
from ..modelfile import is_fmu


def origin_of(source: Any, choice: str | float | None, parameters: SpringParameters) -> float:
    """The zero [m] that "rig", "middle" or a displacement of the record [m] stands for; by default that of an FMU from
    which the model is read, else a sensible one.

    Raises
    ------
    StrandspringError   If it is none of these, or the FMU is damaged.
    """
    if choice is None and isinstance(source, str | os.PathLike) and is_fmu(os.fspath(source)):
        from ..fmu.papers import BuildSettings

        return BuildSettings.of_fmu(Path(source)).zero
    return chosen_zero(choice, parameters)
