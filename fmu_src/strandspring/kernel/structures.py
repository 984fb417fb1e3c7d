"""The kernel's structures and constants, read from the C headers, which alone say what they hold.

A library's file name holds a digest of the headers that it was compiled with, so that both always agree.
"""

from __future__ import annotations

import ast
import ctypes
import operator
import re
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_HEADERS = (
    *(
        f"core/c/spring/{name}.h"
        for name in ("spring_limits", "numerics", "saturation", "spline", "spring", "branches")
    ),
    *(f"kernel/c/{name}.h" for name in ("balance/fourier", "balance/balance", "motion/motion")),
)
_TYPES = {
    "int": ctypes.c_int, "size_t": ctypes.c_size_t, "double": ctypes.c_double, "unsigned char": ctypes.c_ubyte,
}  # fmt: skip
_OPERATIONS: dict[type[ast.operator], Callable[[int, int], int]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.floordiv,
}  # fmt: skip
_FULL_ONLY = r"#ifndef SPRING_STEPS_ONLY\n.*?#endif\n"


@cache
def structures(steps_only: bool = False) -> dict[str, type[ctypes.Structure]]:
    """Every structure of the kernel by its name in C; those of a build with SPRING_STEPS_ONLY if asked for."""
    text = re.sub(_FULL_ONLY, "", _text(), flags=re.DOTALL) if steps_only else _text()
    classes: dict[str, type[ctypes.Structure]] = {}
    for body, name in re.findall(r"typedef struct \{(.*?)\} (\w+);", text, re.DOTALL):
        lines = re.sub(r"^#.*$", "", body, flags=re.MULTILINE).split(";")
        fields = [field for line in lines if line.strip() for field in _fields(line, constants(), classes)]
        classes[name] = type(name, (ctypes.Structure,), {"_fields_": fields, "__slots__": ()})
    return classes


@cache
def constants() -> dict[str, int]:
    """Every constant of an enum by its name in C."""
    values: dict[str, int] = {}
    for name, expression in re.findall(r"(\w+) = ([^,}]+)", "".join(re.findall(r"enum \{.*?\};", _text(), re.DOTALL))):
        values[name] = _value(expression, values)
    return values


def rows(name: str, count: int, **columns: ArrayLike) -> NDArray[np.void]:
    """An array of so many structures, with zeros in fields for which no column is given."""
    table = np.zeros(count, _dtype(name))
    for field, column in columns.items():
        table[field] = np.reshape(column, table[field].shape)
    return table


@cache
def _dtype(name: str) -> np.dtype[Any]:
    return np.dtype(structures()[name])


@cache
def _text() -> str:
    """The headers without comments."""
    package = files("strandspring")
    text = "".join((package / name).read_text(encoding="utf-8") for name in _HEADERS)
    return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)


def _fields(
    line: str, constants: dict[str, int], structs: dict[str, type[ctypes.Structure]]
) -> list[tuple[str, type[Any]]]:
    """Name and type of what one declaration declares."""
    ((base, rest),) = re.findall(r"^\s*(?:const )?(unsigned char|\w+)\s+(.*)$", line, re.DOTALL)
    kinds: dict[str, type[Any]] = {**_TYPES, **structs, "*": ctypes.c_void_p}
    fields = []
    for pointer, name, dimensions in re.findall(r"(\*?)(\w+)((?:\[[^\]]+\])*)(?:,|$)", rest):
        kind = kinds[pointer or base]
        for size in reversed(re.findall(r"\[([^\]]+)\]", dimensions)):
            kind = kind * _value(size, constants)
        fields.append((name, kind))
    return fields


def _value(expression: str, constants: dict[str, int]) -> int:
    """Of a constant expression."""

    def value_of(node: ast.expr) -> int:
        if isinstance(node, ast.BinOp):
            return _OPERATIONS[type(node.op)](value_of(node.left), value_of(node.right))
        return constants[node.id] if isinstance(node, ast.Name) else int(ast.literal_eval(node))

    return value_of(ast.parse(expression.strip(), mode="eval").body)
