"""FMUs in a process that rounds otherwise, as some hosts do.

    python tests/helpers/rounded.py INPUT.npz OUTPUT.npz

INPUT holds the `mode` of fenv.h, `springs` as rows of values of PARAMETERS, `paths` as a row of displacements for each,
and FMUs by names that begin with what they are: those of springs are instantiated with each row. OUTPUT gets all
outputs at every step by the same names.
"""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

import numpy as np

from fmu_tools import Instance
from native_tools import OK, Library
from system_fmu3_tools import NativeSystem3
from system_fmu_tools import BOX, BOX_OPTIONS, NativeSystem, shock

PARAMETERS = ("rho", "sigma", "n", "omega_start")
OUTPUTS = ("force", "stiffness", "absorbed_energy", "omega")
STEP = 1e-3  # [s]


def of_python(fmu: Path, start: dict[str, float], path: list[float]) -> list[list[float]]:
    instance = Instance(fmu, fmu.with_suffix(""))
    instance.initialize(**start)
    rows = [instance.step(x, *OUTPUTS, time=STEP * k, size=STEP) for k, x in enumerate(path)]
    instance.slave.freeInstance()
    return rows


def of_native(fmu: NativeSystem, start: dict[str, float], path: list[float]) -> list[list[float]]:
    rows = []
    with fmu as instance:
        instance.initialize(**start)
        for k, displacement in enumerate(path):
            assert instance.set(displacement=displacement) == instance.go(STEP * k, STEP) == OK
            rows.append(instance.get(*OUTPUTS))
    return rows


def main() -> None:
    given = np.load(sys.argv[1])
    assert ctypes.CDLL("libm.so.6").fesetround(int(given["mode"])) == 0
    found = {}
    for name in set(given.files) - {"mode", "springs", "paths"}:
        fmu, is_3 = Path(str(given[name])), name.startswith(("fmi3", "system3"))
        native = NativeSystem3 if is_3 else NativeSystem
        if name.startswith("system"):
            with native(Library(fmu)) as system:
                found[name] = system.begin().run(shock(BOX, BOX_OPTIONS, 3, 40, 50.0), STEP)
            continue
        rows = []
        for values, path in zip(given["springs"].tolist(), given["paths"].tolist(), strict=True):
            start = {**dict(zip(PARAMETERS, values, strict=True)), "displacement": path[0]}
            is_python = name.startswith("python")
            rows.append(of_python(fmu, start, path) if is_python else of_native(native(Library(fmu)), start, path))
        found[name] = np.array(rows)
    np.savez(sys.argv[2], **found)


if __name__ == "__main__":
    main()
