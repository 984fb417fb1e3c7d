"""What is done to sound inputs: contents, texts, archives and bytes with a few things changed; and what a refusal is.

Everything is determined by the dice, `random.Random`.
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

CORPUS = Path(__file__).parents[1] / "corpus"
RAW = "raw:"  # what follows stands as it is in the file, since libraries do not write it
# What is put in the place of numbers, other values, words of a text and lines, and of what one target has.
ABSURD: dict[str, Any] = json.loads(
    (CORPUS / "dictionary.json").read_text("utf-8"),
    object_hook=lambda entry: entry["of"] * entry["times"] if "times" in entry else entry,
)
OTHERS = [*ABSURD["others"], RAW + f"[{'0,' * 100_000}0]"]
OF_JSON = [
    *OTHERS, *ABSURD["others of json"], RAW + "[" * 100_000 + "]" * 100_000, RAW + '{"a":' * 5000 + "1" + "}" * 5000,
]  # fmt: skip
FLOATS = (0.0, -0.0, 1.0, -1.0, 5e-324, 1e-30, 1e-9, 1e9, 1e30, 1e154, 1e300, -1.7976931348623157e308, np.nan, np.inf)
INTEGERS = (0, 1, 127, 255, 256, 32768, 65535, 10**6, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**64 - 1)


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Every container with every key of it."""
    found = []
    for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        found += [(value, key), *_places(value[key])]
    return found


def changed(dice: random.Random, content: Any, values: list[Any]) -> None:
    """Change one thing in a content: a given value or one of another place, a factor, something lost or repeated."""
    found = _places(content) or [({"": 0}, "")]
    # As often in a part that is small as in one that has many numbers.
    part = dice.choice([(container, key) for container, key in found if container is content] or found)
    container, key = dice.choice(_places(part[0][part[1]]) or [part]) if dice.random() < 0.7 else dice.choice(found)
    value, (other, at) = container[key], dice.choice(found)
    what = dice.randrange(9)
    if what == 0:
        del container[key]
    elif what == 1 and isinstance(container, dict):
        container[dice.choice(("mas", "", "ä", "x", "a.b", "name"))] = dice.choice((1, "12 mm", [], {}))
    elif what == 2 and isinstance(value, list):
        container[key] = copy.deepcopy(value * dice.choice((2, 2, 31, 301)))
    elif what < 5 and isinstance(value, float):
        container[key] = float(np.clip(value * 10.0 ** dice.uniform(-30, 30), -1.7e308, 1.7e308))
    else:
        container[key] = copy.deepcopy(
            dice.choice((*[dice.choice(ABSURD["numbers"])] * 2, other[at], dice.choice(values)))
        )


def mutated(dice: random.Random, data: bytes) -> bytes:
    """A file changed in a few places, by what it is: an archive mostly in one member, JSON, a text, or bytes."""
    if data.startswith(b"PK\x03\x04") and dice.random() < 0.8:
        return _archive(dice, data)
    if data.startswith(b"{") and dice.random() < 0.8:
        content = json.loads(data)
        for _ in range(dice.choice((1, 1, 2))):
            changed(dice, content, OF_JSON)
        text = json.dumps(content, ensure_ascii=False, allow_nan=True)
        # A raw part ends at the quote that closes it, and holds escaped quotes only.
        text = re.sub(rf'"{RAW}((?:[^"\\]|\\.)*)"', lambda match: match[1].replace('\\"', '"'), text)
        return text.encode("utf-8", "surrogatepass")
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
        tokens = [*re.finditer(r"[^\s,;<>\"=\[\]]+", lines[k])]
        if tokens and dice.random() < 0.5:
            begin, end = dice.choice(tokens).span()
            lines[k] = lines[k][:begin] + dice.choice(ABSURD["tokens"]) + lines[k][end:]
        else:
            at = dice.randrange(len(lines[k]) + 1)
            lines[k : k + 1] = dice.choice((
                [], [lines[k]] * 2, [lines[k]] * 1000, [dice.choice(ABSURD["lines"]), lines[k]], [lines[k][:at]],
                [lines[k], lines[0]], [lines[k].replace(dice.choice(",;\t "), dice.choice(",;\t |:"))],
                [lines[k][:at] + dice.choice(('"', "'", "#", "\0", "\r", "\ufeff", "\ud800")) + lines[k][at:]],
            ))  # fmt: skip
        text = "\n".join(lines)
    match dice.randrange(12):
        case 0:
            return text.encode(dice.choice(ABSURD["encodings"]), "replace")
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
        at = dice.randrange(min(dice.choice((64, 512, len(made))), len(made)))
        at = len(made) - 1 - at if dice.random() < 0.3 else at
        width = dice.choice((1, 2, 4, 8))
        number = (dice.choice(INTEGERS) % 256**width).to_bytes(width, dice.choice(("little", "big")))
        length, put = dice.choice((
            (1, bytes([made[at] ^ 1 << dice.randrange(8)])), (width, number), (width, number),
            (0, made[at : at + dice.choice((1, 8, 1000))] * dice.choice((1, 2, 20))),
            (8, np.float64(dice.choice(FLOATS)).tobytes()), (dice.choice((1, 4, 8, 100, len(made))), b""),
        ))  # fmt: skip
        at -= at % max(length, 1) if put is number else 0
        made[at : at + length] = put
        made = made or bytearray(b"\0")
    return bytes(made)


# A sentence with advice has one of these, or says what must be.
_ADVICE = (
    r"[;?]|\b(give|choose|correct|identify|remove|add|use|write|record|ask|upgrade|build|check|compare|must|should|install|"
    r"see|take|negate|exchange|try|sample|delete|leave|smaller|larger|lower|raise|shift|reverse|copy)\b"
)
_RAW = r"<[\w.]+ object|0x[0-9a-f]{6}|\barray\(|\bnp\.|numpy\.|Traceback|got None\b|\bNone[,;\])]|\[[Ee]rrno|dtype"


def kind_of(refusal: BaseException, folder: Path) -> str:
    """The sentence without its numbers and names; AssertionError unless it says what is wrong where, and what to do."""
    text = str(refusal).replace(str(folder), "FOLDER")
    assert re.search(_ADVICE, text, re.IGNORECASE), f"without advice: {text}"
    assert not re.search(_RAW, text), f"holds what is not for people: {text}"
    assert text.isprintable(), f"holds control characters: {text!a}"
    assert text.endswith((".", "?", ")")), f"no sentence: {text}"
    assert len(text) < 2500, f"too long: {text[:300]}"
    text = re.sub(r"'(?:[^'\\]|\\.)*'|\"[^\"]*\"|`[^`]*`|got .*?(;|\.$)|FOLDER\S*", "...", text)
    return re.sub(r"-?\d[\d.e+-]*", "0", text)[:80]


def finite(what: str, values: Any) -> None:
    """Raise AssertionError unless all values are finite numbers."""
    array = np.asarray(values, dtype=np.float64)
    assert np.isfinite(array).all(), f"{what} is not finite: {array!r:.500}"
