"""The compiled kernel, found, loaded and declared."""

from __future__ import annotations

import ctypes
from ctypes import c_double, c_int, c_size_t, c_void_p
from functools import cache

from ..compiled.images import KERNEL, image
from ..compiled.targets import host_target

# Result and arguments of each function. Arrays and structures are passed by their addresses.
_FUNCTIONS = {
    "kernel_tabulate": (None, (c_void_p, c_double, c_double, c_int)),
    "kernel_prepare": (None, (c_void_p, c_void_p, c_void_p)),
    "kernel_inverse": (None, (c_void_p, c_size_t, c_void_p, c_void_p)),
    "spring_path": (None, (c_void_p, c_size_t, c_void_p, c_double, c_void_p, c_void_p, c_void_p, c_void_p)),
    "spring_force_at": (None, (c_void_p, c_size_t, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p)),
    "spring_on_records": (
        None,
        (c_void_p, c_size_t, c_void_p, c_void_p, c_size_t, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p,
         c_void_p, c_void_p, c_void_p),
    ),
    "balance_workspace": (c_size_t, (c_void_p,)),
    "balance_at": (c_int, (c_void_p, c_void_p, c_double, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p)),
    "balance_solve": (c_int, (c_void_p, c_double, c_void_p, c_void_p)),
    "balance_sweep": (c_size_t, (c_void_p, c_double, c_void_p, c_size_t, c_void_p, c_void_p, c_void_p)),
    "spring_line_sums": (
        None,
        (c_size_t, c_void_p, c_size_t, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_size_t, c_void_p,
         c_void_p, c_void_p),
    ),
    "generalised_path": (None, (c_size_t, c_void_p, c_double, c_double, c_void_p, c_void_p)),
    "shock_spectrum": (None, (c_size_t, c_void_p, c_double, c_size_t, c_void_p, c_void_p)),
    "spring_steady": (None, (c_void_p, c_size_t, c_void_p, c_int, c_void_p, c_void_p)),
    "motion_begin": (None, (c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p)),
    "motion_sense": (c_double, (c_void_p, c_double)),
    "motion_rest": (c_int, (c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p)),
    "motion_workspace": (c_size_t, (c_size_t, c_size_t, c_size_t, c_size_t)),
    "motion_run": (c_size_t, (c_void_p, c_void_p, c_size_t, c_double, c_void_p, c_void_p)),
}  # fmt: skip


@cache
def library() -> ctypes.CDLL:
    """The library for this computer; its calls release the interpreter's lock.

    Raises
    ------
    BuildError   If it has not been compiled and cannot be compiled now.
    """
    loaded = ctypes.CDLL(str(image(KERNEL, host_target())))
    for name, (result, arguments) in _FUNCTIONS.items():
        function = getattr(loaded, name)
        function.restype, function.argtypes = result, arguments
    return loaded
