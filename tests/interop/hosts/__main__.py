"""Run one tool in a process of its own: python hosts HOST FMU KIND RESULT.npz

HOST is a module beside this one with a function `run(fmu, kind)` that returns the times [s] as the tool reports them,
force [N] and absorbed energy [J]; KIND is an interface as FMPy names it.
"""

from __future__ import annotations

import sys
from importlib import import_module

import numpy as np

host, fmu, kind, result = sys.argv[1:]
time, force, absorbed_energy = import_module(host).run(fmu, kind)
np.savez(result, time=time, force=force, absorbed_energy=absorbed_energy)
