"""Universal files (UFF, data sets 58 and 58b), read by pyuff."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyuff

from ...errors import RecordError
from ...ground.scratch import TemporaryFolder
from ..channels import Channel
from ..content import FileContent

_FUNCTION = 58
_UNITS = 164
_OF_TIME = (0, 1)  # types of functions: general, time response
_TIME = 17  # what the abscissa holds; 0 is unknown
_DISPLACEMENT, _FORCES = 8, (9, 13)  # what the ordinate holds: displacement; reaction and excitation force
# Length and force of the systems of units in data set 164 of which both are known here.
_SYSTEMS = {1: ("m", "N"), 3: ("m", "kgf"), 5: ("mm", "mN"), 7: ("in", "lbf"), 8: ("mm", "kgf"), 10: ("mm", "N")}


def read_tables(content: FileContent) -> list[Channel]:
    """Channels of the real functions of time, with the units of their labels or of the file.

    Raises
    ------
    RecordError   If there are none, but spectra or shapes.
    """
    # pyuff reads by file name only, and prints what it thinks of a file.
    with TemporaryFolder() as folder, contextlib.redirect_stdout(io.StringIO()):
        path = folder / "record.uff"
        path.write_bytes(content.data)
        file = pyuff.UFF(str(path))
        kinds = file.get_set_types()
        sets = [file.read_sets(k) for k in np.flatnonzero(np.isin(kinds, (_FUNCTION, _UNITS))).tolist()]
    system = next((_SYSTEMS.get(int(s["units_code"])) for s in sets if int(s["type"]) == _UNITS), None)
    functions = [s for s in sets if int(s["type"]) == _FUNCTION]
    of_time = [s for s in functions if int(s["func_type"]) in _OF_TIME and np.isrealobj(s["data"])]
    if not of_time:
        listed = ", ".join(sorted({str(int(kind)) for kind in kinds}))
        raise RecordError(
            f"{content.path}: is a universal file without functions of time (its data sets are of type {listed}); "
            "export time histories as data set 58."
        )
    return [_channel(function, number, system) for number, function in enumerate(of_time, 1)]


def _channel(function: Mapping[str, Any], number: int, system: tuple[str, str] | None) -> Channel:
    quantity = int(function["ordinate_spec_data_type"])
    known = "displacement" if quantity == _DISPLACEMENT else "force" if quantity in _FORCES else ""
    names = (_label(function["id1"]), _label(function["ordinate_axis_lab"]), known, f"function {number}")
    unit = _label(function["ordinate_axis_units_lab"])
    if not unit and system is not None and known:
        unit = system[0 if known == "displacement" else 1]
    values = np.asarray(function["data"], dtype=np.float64)
    timed = int(function["abscissa_spec_data_type"]) in (0, _TIME)
    times = np.asarray(function["x"], dtype=np.float64) if timed else None

    return Channel("", next(filter(None, names)), unit or None, values.size, lambda: (values, times), timed)


def _label(text: Any) -> str:
    """A label, "" where the file says that there is none."""
    label = str(text).strip()
    return "" if label.upper() == "NONE" else label
