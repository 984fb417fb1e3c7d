"""What all targets draw from: awkward numbers and texts, contents changed, bytes damaged; and what a refusal is.

Everything is determined by `random.Random`, so that unit tests can draw the same: hypothesis gives one by
`st.randoms(use_true_random=True)`.
"""

from __future__ import annotations

import copy
import json
import random
import re
from pathlib import Path
from typing import Any

import numpy as np

# Text that stands for itself in a file, since libraries do not write it.
RAW = "raw:"
ABSURD_NUMBERS = (
    0.0, -0.0, 1.0, -1.0, 5e-324, 1e-308, 1e-30, 1e-9, 1e9, 1e15, 1e30, 1e154, 1e300, 1.7976931348623157e308,
    -1.7976931348623157e308, float("nan"), float("inf"), float("-inf"),
)  # fmt: skip
ABSURD_INTEGERS = (
    0, 1, 2, 3, 7, 8, 16, 127, 128, 255, 256, 32767, 32768, 65535, 65536, 10**6, 2**24, 2**31 - 1, 2**31, 2**32 - 1,
    2**32, 2**48, 2**62, 2**63 - 1, 2**63, 2**64 - 1,
)  # fmt: skip
# Of contents that are written as text: numbers, and what is none.
NUMBERS: tuple[Any, ...] = (
    0, 1, -1, 0.0, -0.0, 0.5, 3, 1e-9, -1e-9, 1e3, 1e6, 1e9, -1e9, 1e15, 1e38, 1e77, 1e100, 1e153, -1e153, 1e154, 1e155,
    1e200, 1e300, 1e307, 1.7e308, -1.7e308, 1e-19, 1e-100, 1e-160, 1e-300, 2.3e-308, 1e-309, 5e-324, -5e-324, 10**17,
    10**400, -(10**400), 2**63, 2**70, 2**1023, RAW + "1e400", RAW + "-1e999", RAW + "1e-400", RAW + "1" + "0" * 5000,
    RAW + "0." + "3" * 5000, RAW + "-0",
)  # fmt: skip
OTHERS: tuple[Any, ...] = (
    True, False, "", " ", "1.0", "nan", "=1+1", "\x00", "\x1b[31m", "\u202e", "\u00e4" * 70, "x" * 3000, "a\0b", "..",
    [], {}, [[]], [0, 0, 1], [1.0], {"a": 1}, [[1.0], [2.0, 3.0]], [0.0] * 30, [[0.0] * 40] * 40, {"": {}}, [{}] * 3,
    RAW + "[" * 150 + "]" * 150, RAW + "[" + ",".join(["0"] * 100_000) + "]",
)  # fmt: skip
JSON_ONLY: tuple[Any, ...] = (
    None, [None], "\ud800", RAW + "NaN", RAW + "Infinity", RAW + "-Infinity", RAW + "[" * 100_000 + "]" * 100_000,
    RAW + '{"a":' * 5000 + "1" + "}" * 5000,
)  # fmt: skip
FACTORS = (-1.0, 2.0, 0.5, 1e-3, 1e3, 1e-9, 1e9, 1e30, 1e-30, 1e150, 1e-150)


def chance(dice: random.Random, probability: float) -> bool:
    return dice.random() < probability


def numpy_of(dice: random.Random) -> np.random.Generator:
    """A generator of arrays."""
    return np.random.default_rng(dice.getrandbits(62))


# ---- contents of files -----------------------------------------------------------------------------------------------


def places(value: Any) -> list[tuple[Any, Any]]:
    """Every container with every key of it."""
    found = []
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        found += [(value, key), *places(value[key])]
    return found


def changed(dice: random.Random, content: Any, values: tuple[Any, ...], part: Any = None) -> None:
    """Change one thing in a content, or in a part of it: a value of the given ones or of another place, a factor,
    something lost, repeated or unknown."""
    found = places(content if part is None or not places(part) else part) or [(content, "name")]
    container, key = dice.choice(found)
    match dice.choice(("number", "number", "factor", "factor", "other", "exchanged", "lost", "twice", "unknown")):
        case "number":
            container[key] = dice.choice(NUMBERS)
        case "factor":
            floats = [(c, k) for c, k in found if isinstance(c[k], float)]
            container, key = dice.choice(floats or found)
            if floats:
                container[key] = max(min(container[key] * dice.choice(FACTORS), 1.7e308), -1.7e308)
        case "other":
            container[key] = copy.deepcopy(dice.choice(values))
        case "exchanged":
            other, at = dice.choice(places(content))
            container[key] = copy.deepcopy(other[at])
        case "lost":
            del container[key]
        case "twice":
            lists = [c[k] for c, k in found if isinstance(c[k], list)]
            if lists:
                one = dice.choice(lists)
                one += copy.deepcopy(one) * dice.choice((1, 1, 30, 300))
        case _:
            tables = [c for c, _ in found if isinstance(c, dict)] or [{}]
            unknown = dice.choice(("mas", "", "\u00e4", "direction", "x", "a.b", "name", "file"))
            dice.choice(tables)[unknown] = dice.choice((1, "x", "12 mm", [], {}))


def as_json(content: Any) -> str:
    """The JSON of a content, with its raw parts as they are."""
    text = json.dumps(content, ensure_ascii=False, allow_nan=True)
    # A raw part ends at the quote that closes it, and holds escaped quotes only.
    return re.sub(rf'"{RAW}((?:[^"\\]|\\.)*)"', lambda match: match[1].replace('\\"', '"'), text)


def as_toml(value: Any) -> str:
    """A value of a table of TOML."""
    if isinstance(value, str) and value.startswith(RAW):
        return value.removeprefix(RAW)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {as_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value)


# ---- bytes -----------------------------------------------------------------------------------------------------------


def damaged(dice: random.Random, data: bytes, count: int | None = None) -> bytes:
    """Bytes with a few of them flipped, replaced by absurd numbers, cut out, cut off or repeated."""
    made = bytearray(data)
    for _ in range(dice.choice((1, 1, 1, 2, 4)) if count is None else count):
        if not made:
            break
        # The beginning and the end, where formats keep their tables, are as often changed as the rest.
        place = dice.randrange(min(dice.choice((64, 512, len(made))), len(made)))
        place = len(made) - 1 - place if chance(dice, 0.3) else place
        match dice.randrange(8):
            case 0 | 1:
                made[place] ^= 1 << dice.randrange(8)
            case 2:
                made[place] = dice.randrange(256)
            case 3 | 4:
                width = dice.choice((1, 2, 4, 8))
                place -= place % width if chance(dice, 0.8) else 0
                order: Any = dice.choice(("little", "big"))
                made[place : place + width] = (dice.choice(ABSURD_INTEGERS) % 256**width).to_bytes(width, order)
            case 5:
                del made[place : place + dice.choice((1, 4, 8, 100))]
            case 6:
                made[place:place] = made[place : place + dice.choice((1, 8, 100, 1000))] * dice.choice((1, 2, 20))
            case _ if chance(dice, 0.4):
                del made[place:]
            case _:
                made[place : place + 8] = np.float64(dice.choice(ABSURD_NUMBERS)).tobytes()
    return bytes(made)


def damaged_text(dice: random.Random, text: str) -> bytes:
    """A text in another encoding, surrounded, or with its bytes damaged."""
    match dice.randrange(4):
        case 0:
            return text.encode(dice.choice(("utf-16", "utf-32", "utf-8-sig", "cp500", "latin-1", "utf-7")), "replace")
        case 1:
            around = (("[", "]"), ("", "\x00"), ("\n" * 1000, ""), ("", text), ("//\n", ""), ("\ufeff", ""))
            before, after = dice.choice(around)
            return (before + text + after).encode("utf-8", "surrogatepass")
        case _:
            return damaged(dice, text.encode("utf-8", "surrogatepass"))


# ---- answers ---------------------------------------------------------------------------------------------------------

# A sentence with advice has one of these, or says what must be.
_ADVICE = (
    r"\b(give|choose|correct|identify|remove|add|use|write|record|ask|upgrade|build|check|compare|must|install|see|take|"
    r"negate|exchange|try|sample|delete|leave|smaller|larger|lower|raise|shift|reverse|copy)\b"
)
_RAW = re.compile(
    r"<[a-z_.]+ object|0x[0-9a-f]{6}|\barray\(|\bnp\.|numpy\.|Traceback|got None\b|\bNone[,;\])]|\[[Ee]rrno|dtype"
)


def finite(what: str, values: Any) -> None:
    """Raise AssertionError unless all values are finite numbers."""
    array = np.asarray(values, dtype=np.float64)
    assert np.isfinite(array).all(), f"{what} is not finite: {array!r:.500}"


def refuse_constant(text: str) -> float:
    """For `json.loads`, where NaN must not be."""
    raise AssertionError(f"{text} in JSON")


def kind_of(refusal: BaseException, path: Path) -> str:
    """The sentence without its numbers and names; AssertionError if it is no sentence with advice."""
    text = str(refusal)
    own = text.replace(str(path), "PATH").replace(str(path.parent), "FOLDER")
    assert re.search(_ADVICE, own, re.IGNORECASE), f"without advice: {text}"
    assert not _RAW.search(own), f"holds what is not for people: {text}"
    assert own.isprintable(), f"holds control characters: {text!a}"
    assert len(own) < 2000, f"too long: {text[:300]}"
    own = re.sub(r"got .*?(;|\.$)", "got ...\\1", own)
    own = re.sub(r"\[\d+\]", "[i]", re.sub(r"-?\d[\d.e+-]*", "0", own))
    return re.sub(r"'[^']*'|\"[^\"]*\"|`[^`]*`", "...", own)[:110]
