"""The kernel's structures as ctypes has them, read from the C headers, which alone say what they hold."""

from __future__ import annotations

import ast
import ctypes
import operator
import re
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Any

from ..errors import BuildError
from .library import library

_HEADERS = ("spring_limits.h", "saturation.h", "spline.h", "spring.h")
_TYPES = {"int": ctypes.c_int, "double": ctypes.c_double, "unsigned char": ctypes.c_ubyte}
_OPERATIONS: dict[type[ast.operator], Callable[[int, int], int]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.floordiv,
}  # fmt: skip
_FULL_ONLY = r"#ifndef SPRING_STEPS_ONLY\n.*?#endif\n"


@cache
def structures(steps_only: bool = False) -> dict[str, type[ctypes.Structure]]:
    """Every structure of the kernel by its name in C; those of a build with SPRING_STEPS_ONLY if asked for.

    Raises
    ------
    BuildError   If the compiled kernel's are not as large.
    """
    text = "".join((files("strandspring.core") / "c" / name).read_text(encoding="utf-8") for name in _HEADERS)
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    text = re.sub(_FULL_ONLY, "", text, flags=re.DOTALL) if steps_only else text
    constants: dict[str, int] = {}
    for entry in re.findall(r"(\w+) = ([^,}]+)", "".join(re.findall(r"enum \{.*?\};", text, re.DOTALL))):
        constants[entry[0]] = _value(entry[1], constants)
    found: dict[str, type[ctypes.Structure]] = {}
    for body, name in re.findall(r"typedef struct \{(.*?)\} (\w+);", text, re.DOTALL):
        lines = re.sub(r"^#.*$", "", body, flags=re.MULTILINE).split(";")
        fields = [field for line in lines if line.strip() for field in _fields(line, constants, found)]
        found[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
    sizes = {"SpringTable": library().kernel_table_size(), "SpringLaw": library().kernel_law_size()}
    if not steps_only and any(ctypes.sizeof(found[name]) != size for name, size in sizes.items()):
        raise BuildError("The kernel's headers are not those that it was compiled with; install strandspring again.")
    return found


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

    def of(node: ast.expr) -> int:
        if isinstance(node, ast.BinOp):
            return _OPERATIONS[type(node.op)](of(node.left), of(node.right))
        return constants[node.id] if isinstance(node, ast.Name) else int(ast.literal_eval(node))

    return of(ast.parse(expression.strip(), mode="eval").body)
