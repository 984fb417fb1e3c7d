"""Structures that Python shares with the compiled kernel lie where the compilers of all computers put them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from strandspring.compiled import zig
from strandspring.compiled.images import KERNEL
from strandspring.compiled.targets import FMU_TARGETS, Target
from strandspring.errors import BuildError
from strandspring.kernel.structures import constants, rows, structures
from tools import tool


def comparisons() -> Iterator[str]:
    """What a compiler refuses where it puts a field elsewhere than ctypes does."""
    for name, structure in structures().items():
        yield f'_Static_assert(sizeof({name}) == {np.dtype(structure).itemsize}, "{name}");'
        for field, *_ in structure._fields_:
            offset = getattr(structure, field).offset
            yield f'_Static_assert(offsetof({name}, {field}) == {offset}, "{field} of {name}");'


def compile_with(sources: dict[str, bytes], target: Target) -> None:
    tool("ziglang")
    included = (f'#include "kernel/c/{header}.h"' for header in ("balance/balance", "motion/motion"))
    unit = "\n".join([*included, *comparisons(), "int compared;"])
    zig.shared_library(target, {**sources, "compared.c": unit.encode()}, ("compared.c",), KERNEL.name, ("-O1",))


@pytest.mark.parametrize("target", FMU_TARGETS, ids=lambda target: target.triple)
def test_fields_are_where_compilers_put_them(target: Target) -> None:
    assert len(list(comparisons())) > 150
    compile_with(KERNEL.sources(), target)


@pytest.mark.parametrize(
    ("header", "before", "after", "where"),
    [
        ("motion/motion", "double mass, center[3];", "double mass, added, center[3];", "MotionBody"),
        ("balance/balance", "double parallel, series;", "double series, parallel;", "parallel of BalancedAxis"),
    ],
)
def test_other_structures_are_noticed(header: str, before: str, after: str, where: str) -> None:
    sources = KERNEL.sources()
    path = f"kernel/c/{header}.h"
    assert sources[path].count(before.encode()) == 1
    sources[path] = sources[path].replace(before.encode(), after.encode())
    with pytest.raises(BuildError, match=where):
        compile_with(sources, FMU_TARGETS[0])


def test_structures_are_filled_by_the_names_of_their_fields() -> None:
    channel = rows("MotionChannel", 2, body=[1, 2], direction=[[1, 2, 3], [4, 5, 6]])
    assert channel.view(np.float64)[8:].tolist() == [4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 0.0, 2.0]
    assert rows("MotionPoint", 0, place=[], body=[]).size == 0
    with pytest.raises(ValueError, match="added"):
        rows("MotionPoint", 1, added=[1.0])
    with pytest.raises(AttributeError, match="added"):
        structures()["MotionPoint"](added=1.0)
    assert constants()["MOTION_OF_POINT"] == 18
