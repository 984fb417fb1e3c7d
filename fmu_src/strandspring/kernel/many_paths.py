"""Many springs along paths, or one along many, with derivatives by the parameters, in the compiled kernel."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import SpringParameters
from .arrays import FloatArray, address, floats, integers
from .library import library
from .path import packed
from .structures import rows, structures

QUANTITIES = ("force", "stiffness", "absorbed_energy")


def gradient_fields(name: str, count: int) -> range:
    """The fields of the kernel's gradient that are derivatives by the so many values of a parameter."""
    begin: int = getattr(structures()["SpringGradient"], f"by_{name}").offset // ctypes.sizeof(ctypes.c_double)
    return range(begin, begin + count)


def spring_rows(base: SpringParameters, count: int, columns: Mapping[str, FloatArray]) -> NDArray[np.void]:
    """Springs as the kernel takes them, which are not checked.

    Parameters
    ----------
    base : SpringParameters      What is not in a column.
    count : int                  S, the number of springs.
    columns : mapping of ndarray, shape (S,), or (S, C) of a list   By the names of parameters.
    """
    springs = np.repeat(np.frombuffer(packed(base), rows("SpringParameters", 0).dtype), count)
    for name, column in columns.items():
        if column.ndim == 1:
            springs[name] = column
        else:
            springs[name][:, : column.shape[1]] = column
    return springs


def along_paths(
    springs: NDArray[np.void],
    path: FloatArray,
    omega_start: FloatArray,
    values: Mapping[str, FloatArray],
    fields: Sequence[int],
    gradients: Mapping[str, FloatArray],
    coarse: bool = False,
) -> None:
    """Fill arrays with `QUANTITIES` along paths, and with their derivatives.

    Neighbouring springs of one n and sigma share a table, which takes most of the time on short paths.

    Parameters
    ----------
    springs : ndarray, shape (S,)                See `spring_rows`.
    path : ndarray, shape (K,) or (S, K)         One for all, or one for each [m].
    omega_start : ndarray, shape (S,)            [-]
    values : mapping of ndarray, shape (S, K)    By quantity; those to fill.
    fields : sequence of int, length F           Of the derivatives, see `gradient_fields`.
    gradients : mapping of ndarray, shape (S, F, K)   By quantity; those to fill.
    coarse : bool                                Tables to 1e-8 only, in a quarter of the time.
    """
    path, omega_start, numbers = floats(path), floats(omega_start), integers(fields)
    table = np.empty(ctypes.sizeof(structures()["SpringTable"]) // 8)
    results = [arrays.get(name) for arrays in (values, gradients) for name in QUANTITIES]
    library().spring_many_paths(
        len(springs),
        address(springs),
        address(omega_start),
        path.shape[-1],
        address(path),
        path.shape[-1] if path.ndim == 2 else 0,
        numbers.size,
        address(numbers),
        address(table),
        coarse,
        *(None if array is None else address(array) for array in results),
    )
