"""Serialized states of the native FMU: damaged and foreign ones are refused, whatever they hold."""

from __future__ import annotations

import math
from ctypes import byref, c_double, c_size_t, create_string_buffer

import pytest

from fmu_tools import OTHER
from native_tools import ERROR, MODEL_EXCHANGE, OK, Native, doubles, library


@pytest.fixture
def spring():
    with Native() as one:
        yield one


def test_damaged_states_are_refused(spring):
    spring.initialize()
    spring.step(0.03)
    before = spring.serialized()
    for length in (0, 1, 7, 8, 27, 28, 65, 66, 67, len(before) - 8, len(before) - 1):
        assert spring.restore(before[:length]) == ERROR
        assert spring.said.startswith("The serialized state ")
    assert spring.restore(before + b"\0") == ERROR
    for place in range(len(before)):
        damaged = bytearray(before)
        damaged[place] ^= 1
        assert spring.restore(bytes(damaged)) == ERROR, place
    assert spring.serialized() == before


def sealed(content: bytearray) -> bytes:
    """A state with the checksum (FNV-1a) that belongs to it."""
    total = 0xCBF29CE484222325
    for byte in content[28:]:
        total = (total ^ byte) * 0x100000001B3 % 2**64
    content[20:28] = total.to_bytes(8, "little")
    return bytes(content)


def test_states_with_impossible_values_are_refused(spring):
    """Whatever value a crafted state holds, it is refused or does no harm."""
    spring.initialize()
    spring.step(0.03)
    before = spring.serialized()
    assert sealed(bytearray(before)) == before
    refused = set()
    for place in range(66, len(before) - 7, 4):
        for bad in (b"\xff" * 8, b"\x00" * 6 + b"\xf0\x7f", b"\x07" * 8, b"\x00" * 6 + b"\xf8\x3f"):
            content = bytearray(before)
            content[place : place + 8] = bad
            if spring.restore(sealed(content)) == ERROR:
                refused.add(spring.said)
            else:
                spring.DoStep(c_double(0.0), c_double(1.0), 1)
                spring.GetReal(spring.references("force"), c_size_t(1), doubles([0.0]))
            assert spring.restore(before) == OK
    fields = (
        "mode",
        "time",
        "displacement",
        "input derivatives",
        "memory",
        "flags",
        "watch",
        "settings",
        "omega_start",
    )
    assert {f"The serialized state is damaged in its field `{field}`." for field in fields} <= refused
    assert any("`rho` must be within" in text for text in refused)


def test_a_spring_that_has_moved_has_a_direction(spring):
    """Without one there is no branch to take the energy along, which would not be a number."""
    spring.initialize()
    spring.step(0.03)
    content = spring.serialized()
    directions = [place for place in range(66, len(content) - 3) if content[place : place + 4] == b"\1\0\0\0"]
    said = set()
    for place in directions:
        crafted = bytearray(content)
        crafted[place] = 0
        if spring.restore(sealed(crafted)) == ERROR:
            said.add(spring.said)
        else:
            assert math.isfinite(spring.get("absorbed_energy")[0])
        assert spring.restore(content) == OK
    assert "The serialized state is damaged in its field `memory`." in said


def test_the_state_of_another_fmu_version_or_kind_is_refused(spring):
    spring.initialize()
    content = spring.serialized()
    with Native(library(OTHER)) as other:
        other.initialize()
        assert other.restore(content) == ERROR
        assert other.said == "The serialized state is from another FMU."
        assert other.SetFMUstate(spring.snapshot()) == ERROR
        assert "must come from an instance of the same FMU" in other.said
    newer = bytearray(content)
    newer[8] += 1
    assert spring.restore(bytes(newer)) == ERROR
    assert "the format of another version" in spring.said
    with Native(kind=MODEL_EXCHANGE) as model:
        assert model.restore(content) == ERROR
        assert model.said == "The state must be one of model exchange, but it is one of co-simulation."


def test_a_buffer_of_the_wrong_size(spring):
    state = spring.snapshot()
    size = len(spring.serialized())
    content = create_string_buffer(b"." * (size - 1))
    assert spring.SerializeFMUstate(state, content, c_size_t(size - 1)) == ERROR
    assert spring.said == f"A serialized state must have {size} bytes, got {size - 1}."
    assert content.value == b"." * (size - 1)
    assert spring.FreeFMUstate(byref(state)) == OK
