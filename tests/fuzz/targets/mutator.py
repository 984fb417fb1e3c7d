"""What is done to sound inputs: contents, texts, archives and bytes with a few things changed; and what a refusal is.

Everything is determined by `random.Random`, so that unit tests can draw the same: hypothesis gives one by
`st.randoms(use_true_random=True)`.
"""

from __future__ import annotations

import copy
import io
import json
import random
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

RAW = "raw:"  # what follows stands as it is in the file, since libraries do not write it
# What is put in the place of numbers, other values, words of a text and lines, and of what one target has.
ABSURD: dict[str, list[Any]] = json.loads((Path(__file__).parents[1] / "corpus/dictionary.json").read_text("utf-8"))
NUMBERS = (*ABSURD["numbers"], RAW + "1" + "0" * 5000, RAW + "0." + "3" * 5000)
OTHERS = (*ABSURD["others"], "x" * 3000, [[0.0] * 40] * 40, RAW + "[" * 150 + "]" * 150, RAW + f"[{'0,' * 100_000}0]")
JSON_ONLY = (
    None, [None], "\ud800", RAW + "NaN", RAW + "Infinity", RAW + "[" * 100_000 + "]" * 100_000,
    RAW + '{"a":' * 5000 + "1" + "}" * 5000,
)  # fmt: skip
FLOATS = (0.0, -0.0, 1.0, -1.0, 5e-324, 1e-30, 1e-9, 1e9, 1e30, 1e154, 1e300, -1.7976931348623157e308, np.nan, np.inf)
TOKENS = (*ABSURD["tokens"], "1" * 5000, "x" + "/m" * 400)
LINES = (*ABSURD["lines"], "," * 1000, "1," * 100_000, "\n" * 30_000, "[" * 3000, "<a>" * 50_000, "(" * 10_000)
_TOKEN = re.compile(r"[^\s,;<>\"=\[\]]+")


def numpy_of(dice: random.Random) -> np.random.Generator:
    """A generator of arrays."""
    return np.random.default_rng(dice.getrandbits(62))


# ---- contents of files -----------------------------------------------------------------------------------------------


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Every container with every key of it."""
    found = []
    for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        found += [(value, key), *_places(value[key])]
    return found


def changed(dice: random.Random, content: Any, values: tuple[Any, ...]) -> None:
    """Change one thing in a content: a value of the given ones or of another place, a factor, something lost, repeated
    or unknown.
    """
    found = _places(content) or [({"": 0}, "")]
    # As often in a part that is small as in one that has many numbers.
    part = dice.choice([(container, key) for container, key in found if container is content] or found)
    container, key = dice.choice(_places(part[0][part[1]]) or [part]) if dice.random() < 0.7 else dice.choice(found)
    match dice.choice(("number", "number", "factor", "factor", "other", "exchanged", "lost", "twice", "unknown")):
        case "number":
            container[key] = dice.choice(NUMBERS)
        case "factor" if isinstance(container[key], float):
            container[key] = float(np.clip(container[key] * 10.0 ** dice.uniform(-30, 30), -1.7e308, 1.7e308))
        case "exchanged":
            other, at = dice.choice(found)
            container[key] = copy.deepcopy(other[at])
        case "lost":
            del container[key]
        case "twice" if isinstance(container[key], list):
            container[key] += copy.deepcopy(container[key]) * dice.choice((1, 1, 30, 300))
        case "unknown" if isinstance(container, dict):
            container[dice.choice(("mas", "", "\u00e4", "x", "a.b", "name", "file"))] = dice.choice(
                (1, "12 mm", [], {})
            )
        case _:
            container[key] = copy.deepcopy(dice.choice(values))


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


def toml_file(dice: random.Random, content: dict[str, Any]) -> bytes:
    """A file of TOML, now and then damaged."""
    text = "\n".join(f"{json.dumps(key)} = {as_toml(value)}" for key, value in content.items())
    data = text.encode("utf-8", "surrogatepass")
    return mutated(dice, data) if dice.random() < 0.15 else data


# ---- files -----------------------------------------------------------------------------------------------------------


def mutated(dice: random.Random, data: bytes) -> bytes:
    """A file changed in a few places, by what it is: an archive mostly in one member, JSON, a text, or bytes."""
    if data.startswith(b"PK\x03\x04") and dice.random() < 0.8:
        return _archive(dice, data)
    if data.startswith(b"{") and dice.random() < 0.8:
        content = json.loads(data)
        for _ in range(dice.choice((1, 1, 2))):
            changed(dice, content, (*OTHERS, *JSON_ONLY))
        return as_json(content).encode("utf-8", "surrogatepass")
    if b"\0" in data or dice.random() < 0.2:
        return damaged(dice, data)
    return _text(dice, data.decode("utf-8", "replace"))


def _archive(dice: random.Random, data: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(stream, "w", dice.choice((0, 8, 8))) as new:
        names = old.namelist()
        held = [name for name in names if re.search(r"sheet1|content|\.npy|modelDesc", name)]
        one = dice.choice(held or names) if dice.random() < 0.8 else dice.choice(names)
        for name in names:
            if name != one or dice.random() < 0.95:
                new.writestr(name, mutated(dice, old.read(name)) if name == one else old.read(name))
    return stream.getvalue()


def _text(dice: random.Random, text: str) -> bytes:
    """Tokens and lines changed; then perhaps another encoding or end."""
    for _ in range(dice.choice((1, 1, 2, 4))):
        lines = text.split("\n")
        k = dice.randrange(len(lines))
        tokens = [*_TOKEN.finditer(lines[k])]
        if tokens and dice.random() < 0.5:
            begin, end = dice.choice(tokens).span()
            lines[k] = lines[k][:begin] + dice.choice(TOKENS) + lines[k][end:]
        else:
            at = dice.randrange(len(lines[k]) + 1)
            lines[k : k + 1] = dice.choice((
                [], [lines[k]] * 2, [lines[k]] * 1000, [dice.choice(LINES), lines[k]], [lines[k][:at]],
                [lines[k], lines[0]], [lines[k].replace(dice.choice(",;\t "), dice.choice(",;\t |:"))],
                [lines[k][:at] + dice.choice(('"', "'", "#", "\0", "\r", "\ufeff", "\ud800")) + lines[k][at:]],
            ))  # fmt: skip
        text = "\n".join(lines)
    match dice.randrange(12):
        case 0:
            encoding = dice.choice(
                ("utf-8-sig", "utf-16", "utf-16-le", "utf-32", "utf-7", "cp037", "cp1252", "gb18030")
            )
            return text.encode(encoding, "replace")
        case 1:
            text = text.replace("\n", dice.choice(("\r\n", "\r", "\n\r")))
        case 2:
            before, after = dice.choice((("[", "]"), ("", "\x1a"), ("\n" * 1000, ""), ("", text), ("\ufeff", "")))
            text = before + text + after
    return text.encode("utf-8", "surrogatepass")


def damaged(dice: random.Random, data: bytes) -> bytes:
    """Bytes with a few of them flipped, replaced by absurd numbers, cut out, cut off or repeated."""
    made = bytearray(data or b"\0")
    for _ in range(dice.choice((1, 1, 1, 2, 4))):
        # The beginning and the end, where formats keep their tables, are as often changed as the rest.
        place = dice.randrange(min(dice.choice((64, 512, len(made))), len(made)))
        place = len(made) - 1 - place if dice.random() < 0.3 else place
        width = dice.choice((1, 2, 4, 8))
        absurd = dice.choice((0, 1, 127, 255, 256, 32768, 65535, 10**6, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**64 - 1))
        match dice.randrange(7):
            case 0 | 1:
                made[place] ^= 1 << dice.randrange(8)
            case 2 | 3:
                at = place - place % width
                made[at : at + width] = (absurd % 256**width).to_bytes(width, dice.choice(("little", "big")))
            case 4:
                made[place:place] = made[place : place + dice.choice((1, 8, 1000))] * dice.choice((1, 2, 20))
            case 5:
                made[place : place + 8] = np.float64(dice.choice(FLOATS)).tobytes()
            case _:
                del made[place : None if dice.random() < 0.3 else place + dice.choice((1, 4, 8, 100))]
        made = made or bytearray(b"\0")
    return bytes(made)


# ---- answers ---------------------------------------------------------------------------------------------------------

# A sentence with advice has one of these, or says what must be.
_ADVICE = (
    r"[;?]|\b(give|choose|correct|identify|remove|add|use|write|record|ask|upgrade|build|check|compare|must|should|install|"
    r"see|take|negate|exchange|try|sample|delete|leave|smaller|larger|lower|raise|shift|reverse|copy)\b"
)
_RAW = re.compile(
    r"<[\w.]+ object|0x[0-9a-f]{6}|\barray\(|\bnp\.|numpy\.|Traceback|got None\b|\bNone[,;\])]|\[[Ee]rrno|dtype"
)


def kind_of(refusal: BaseException, folder: Path) -> str:
    """The sentence without its numbers and names; AssertionError unless it says what is wrong where, and what to do."""
    text = str(refusal).replace(str(folder), "FOLDER")
    assert re.search(_ADVICE, text, re.IGNORECASE), f"without advice: {text}"
    assert not _RAW.search(text), f"holds what is not for people: {text}"
    assert text.isprintable(), f"holds control characters: {text!a}"
    assert text.endswith((".", "?", ")")), f"no sentence: {text}"
    assert len(text) < 2500, f"too long: {text[:300]}"
    text = re.sub(r"'(?:[^'\\]|\\.)*'|\"[^\"]*\"|`[^`]*`|got .*?(;|\.$)|FOLDER\S*", "...", text)
    return re.sub(r"-?\d[\d.e+-]*", "0", text)[:80]


def finite(what: str, values: Any) -> None:
    """Raise AssertionError unless all values are finite numbers."""
    array = np.asarray(values, dtype=np.float64)
    assert np.isfinite(array).all(), f"{what} is not finite: {array!r:.500}"


def refuse_constant(text: str) -> float:
    """For `json.loads`, where NaN must not be."""
    raise AssertionError(f"{text} in JSON")
