"""Structures that Python shares with the compiled kernel lie where the compiler has put them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from strandspring.compiled import zig
from strandspring.compiled.images import KERNEL
from strandspring.compiled.targets import host_target
from strandspring.errors import BuildError
from strandspring.kernel import library as kernel
from strandspring.kernel.structures import constants, rows, structures

NOT_FILLED = {"SpringTable", "SpringLaw", "MotionBodyState", "MotionReach", "MotionAxisState", "MotionState"}


def test_every_field_is_compared() -> None:
    compared: dict[str, set[str]] = {}
    for place in kernel.library().kernel_layout():
        if place.structure is None:
            break
        compared.setdefault(place.structure.decode(), set()).add(place.field.decode())
    assert compared["MotionState"] == {"", "body", "reach", "axis"}
    for name, fields in compared.items():
        assert name in NOT_FILLED or fields == {"", *(field for field, *_ in structures()[name]._fields_)}


@pytest.mark.parametrize(
    ("header", "before", "after", "where"),
    [
        ("motion/motion", "double mass, center[3];", "double mass, added, center[3];", "the end of MotionBody"),
        ("balance/balance", "double parallel, series;", "double series, parallel;", "parallel of BalancedAxis"),
    ],
)
def test_a_library_with_other_structures_is_refused(
    header: str, before: str, after: str, where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sources = KERNEL.sources()
    path = f"kernel/c/{header}.h"
    assert sources[path].count(before.encode()) == 1
    sources[path] = sources[path].replace(before.encode(), after.encode())
    other = tmp_path / "kernel"
    other.write_bytes(zig.shared_library(host_target(), sources, KERNEL.file, KERNEL.name, ("-O0",)))
    monkeypatch.setattr(kernel, "image", lambda *_: other)
    with pytest.raises(BuildError, match=rf"does not fit its C headers: {where} is at byte "):
        kernel.library.__wrapped__()


def test_structures_are_filled_by_the_names_of_their_fields() -> None:
    channel = rows("MotionChannel", 2, body=[1, 2], direction=[[1, 2, 3], [4, 5, 6]])
    assert channel.view(np.float64)[8:].tolist() == [4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 0.0, 2.0]
    assert rows("MotionPoint", 0, place=[], body=[]).size == 0
    with pytest.raises(ValueError, match="added"):
        rows("MotionPoint", 1, added=[1.0])
    with pytest.raises(AttributeError, match="added"):
        structures()["MotionPoint"](added=1.0)
    assert constants()["MOTION_OF_POINT"] == 18
