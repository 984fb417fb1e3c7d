"""Many springs along paths, or one along many, with derivatives by the parameters, in the compiled kernel."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence

import numpy as np

from ..core.parameters import SpringParameters
from .arrays import FloatArray, address, floats, integers
from .library import library
from .path import packed
from .structures import structures

QUANTITIES = ("force", "stiffness", "absorbed_energy")


def gradient_fields(name: str, count: int) -> range:
    """The fields of the kernel's gradient that are derivatives by the so many values of a parameter."""
    begin: int = getattr(structures()["SpringGradient"], f"by_{name}").offset // ctypes.sizeof(ctypes.c_double)
    return range(begin, begin + count)


def along_paths(
    springs: Sequence[SpringParameters],
    path: FloatArray,
    omega_start: FloatArray,
    values: Mapping[str, FloatArray],
    fields: Sequence[int],
    gradients: Mapping[str, FloatArray],
) -> None:
    """Fill arrays with `QUANTITIES` along paths, and with their derivatives.

    Neighbouring springs of one n and sigma share a table, which takes most of the time on short paths.

    Parameters
    ----------
    springs : sequence of SpringParameters, length S
    path : ndarray, shape (K,) or (S, K)         One for all, or one for each [m].
    omega_start : ndarray, shape (S,)            [-]
    values : mapping of ndarray, shape (S, K)    By quantity; those to fill.
    fields : sequence of int, length F           Of the derivatives, see `gradient_fields`.
    gradients : mapping of ndarray, shape (S, F, K)   By quantity; those to fill.
    """
    path, omega_start, numbers = floats(path), floats(omega_start), integers(fields)
    parameters = np.frombuffer(b"".join(map(packed, springs)), dtype=np.float64)
    table = np.empty(ctypes.sizeof(structures()["SpringTable"]) // 8)
    results = [rows.get(name) for rows in (values, gradients) for name in QUANTITIES]
    library().spring_many_paths(
        len(springs),
        address(parameters),
        address(omega_start),
        path.shape[-1],
        address(path),
        path.shape[-1] if path.ndim == 2 else 0,
        numbers.size,
        address(numbers),
        address(table),
        *(None if rows is None else address(rows) for rows in results),
    )
