"""FMU archives, sound and damaged, given to `verify` and to what reads the model inside.

An FMU is built once without its binaries; each trial changes its files, its list of hashes, its directory or its bytes.
Nothing may be written outside of temporary folders.
"""

from __future__ import annotations

import hashlib
import io
import json
import random
import struct
import zipfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np

from strandspring import SpringParameters, StrandspringError, info, verify
from strandspring.fmu.python_backed import fmu_contents
from strandspring.fmu.related_files import BUILD, HASHES, REFERENCE, STIMULI
from strandspring.model.modelfile import MODEL_IN_FMU, ModelFile
from targets.made import kind_of, numpy_of
from targets.made_models import model_file

Dice = np.random.Generator
Files = dict[str, bytes]
_DESCRIPTION = "modelDescription.xml"
_SPRING = SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)


def trial(drawn: random.Random, folder: Path) -> Iterator[str]:
    """One archive."""
    dice = numpy_of(drawn)
    names = [str(name) for name in dice.choice(sorted(_CHANGES), int(dice.integers(0, 3)), replace=False)]
    yield "verify" if dice.random() < 0.7 else "info"
    files = dict(_sound())
    for name in names:
        _CHANGES[name](dice, files)
    if dice.random() < 0.02:
        (_bomb, _many)[int(dice.integers(2))](dice, files)
    if dice.random() < 0.6:
        _sealed(files)
    data = _packed(dice, files)
    if dice.random() < 0.4:
        data = _damaged(dice, data)
    place = folder / "inner" / "spring.fmu"
    place.parent.mkdir()
    place.write_bytes(data)
    try:
        verification = verify(place)
        text = verification.summary()
        assert text.isascii(), text
        info(place).summary()
    except StrandspringError as refusal:
        outcome = f"refused: {kind_of(refusal, place)}"
    else:
        outcome = "accepted" if verification.ok else f"accepted with findings on {verification.problems[0].about}"
    assert sorted(path.name for path in folder.rglob("*")) == ["inner", "spring.fmu"]
    assert not Path("/tmp/strandspring_escaped").exists()
    yield outcome


@cache
def _sound() -> Files:
    """The files of an FMU without binaries, which therefore is not run."""
    return fmu_contents(ModelFile("spring", _SPRING))


def _sealed(files: Files) -> None:
    """Make the list of hashes fit the files."""
    hashes = {name: hashlib.sha256(content).hexdigest() for name, content in files.items() if name != HASHES}
    files[HASHES] = json.dumps(hashes).encode()


def _packed(dice: Dice, files: Files) -> bytes:
    packed = io.BytesIO()
    method = (zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)[
        max(int(dice.integers(-12, 4)), 0) if len(files) < 1000 else 0  # LZMA takes 2 ms a file
    ]
    with zipfile.ZipFile(packed, "w", method) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name[:60_000])
            entry.compress_type = method
            # A file, a symbolic link, a folder, a device, or nothing in particular.
            entry.external_attr = int(dice.choice((0o100644, 0o100644, 0o120777, 0o040755, 0o020666, 0))) << 16
            archive.writestr(entry, content)
        if dice.random() < 0.1:
            archive.comment = b"x" * 60_000
    return packed.getvalue()


# Changes of the files.


def _of(dice: Dice, files: Files) -> str:
    return str(dice.choice([_DESCRIPTION, MODEL_IN_FMU, BUILD, HASHES, STIMULI, REFERENCE, *sorted(files)]))


def _removed(dice: Dice, files: Files) -> None:
    files.pop(_of(dice, files), None)


def _emptied(dice: Dice, files: Files) -> None:
    files[_of(dice, files)] = b""


def _flipped_file(dice: Dice, files: Files) -> None:
    name = _of(dice, files)
    files[name] = _flipped(dice, files.get(name) or b"x")


def _cut_file(dice: Dice, files: Files) -> None:
    name = _of(dice, files)
    content = files.get(name, b"")
    files[name] = content[: int(dice.integers(len(content) + 1))]


def _other_model(dice: Dice, files: Files) -> None:
    files[MODEL_IN_FMU] = model_file(random.Random(int(dice.integers(2**62))))


def _strange_json(dice: Dice, files: Files) -> None:
    files[str(dice.choice((BUILD, HASHES)))] = (
        b"[]", b"null", b"1e999", b"[" * 100_000, b'{"a": NaN}', b'{"zero": 1e400}', b"\xff", b'{"a": [1]}',
        json.dumps({"backend": "native", "zero": 1e300, "author": "", "needs_execution_tool": False}).encode(),
        json.dumps({"backend": "\ud800", "zero": 0.0, "author": "\x1b", "needs_execution_tool": True}).encode(),
        json.dumps(dict.fromkeys(files, 7)).encode(),
    )[int(dice.integers(11))]  # fmt: skip


_NAMES = (
    "../escaped", "../../../../tmp/strandspring_escaped", "/tmp/strandspring_escaped", "a\\..\\b", "x" * 5000,
    "C:\\escaped", "\x1b[31m", "ä", "a\x01b", "resources/../../escaped", "con", "a/", "\u202e", "\U0001f600",
    "binaries/linux64/spring.so", "modeldescription.XML", "resources",
)  # fmt: skip


def _strange_names(dice: Dice, files: Files) -> None:
    for _ in range(int(dice.integers(1, 4))):
        files[_NAMES[int(dice.integers(len(_NAMES)))]] = b"content"


_XML_HEADS = (
    '<!DOCTYPE a [<!ENTITY x "y">]>',
    "<!DOCTYPE a ["
    + '<!ENTITY l0 "lol">'
    + "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 12))
    + "]>",
    '<!DOCTYPE a SYSTEM "file:///etc/passwd">',
    '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]>',
    '<!DOCTYPE a [<!ENTITY % x SYSTEM "http://localhost:9/x.dtd"> %x;]>',
    "<?xml-stylesheet href='x'?>",
)


def _hostile_xml(dice: Dice, files: Files) -> None:
    text = files.get(_DESCRIPTION, b"").decode("utf-8", "replace")
    entity = str(dice.choice(("&x;", "&l11;", "&l3;", "&#0;", "&#x10FFFF;", "&undefined;", "]]>", "\x00")))
    head = _XML_HEADS[int(dice.integers(len(_XML_HEADS)))]
    changed = text.replace("?>", "?>" + head, 1)
    files[_DESCRIPTION] = changed.replace('description="', f'description="{entity}', 1).encode("utf-8")


def _changed_xml(dice: Dice, files: Files) -> None:
    """An attribute with another value, an element less, twice, or very deep."""
    text = files.get(_DESCRIPTION, b"").decode("utf-8", "replace")
    pieces = text.split('"')
    if len(pieces) > 3:
        place = 1 + 2 * int(dice.integers((len(pieces) - 1) // 2))
        pieces[place] = str(
            dice.choice(["", "1e999", "nan", "-1", "99999999999999999999", "x" * 10_000, "3.0", "../x", "&lt;", "true"])
        )
    text = '"'.join(pieces)
    lines = text.split("\n")
    line = int(dice.integers(len(lines)))
    match int(dice.integers(4)):
        case 0:
            del lines[line]
        case 1:
            lines.insert(line, lines[line])
        case 2:
            lines.insert(line, "<a>" * 50_000)
        case _:
            pass
    files[_DESCRIPTION] = "\n".join(lines).encode("utf-8", str(dice.choice(("strict", "replace"))))


def _other_encoding(dice: Dice, files: Files) -> None:
    text = files.get(_DESCRIPTION, b"").decode("utf-8", "replace")
    files[_DESCRIPTION] = text.encode(str(dice.choice(("utf-16", "utf-32", "cp500", "utf-7"))), "replace")


def _bomb(dice: Dice, files: Files) -> None:
    files[_of(dice, files)] = b"\0" * int(dice.choice((20_000_000, 230_000_000)))


_ROWS = (b"0,nan,inf,1e999\n", b"0\n", b"a,b,c,d\n", b"\xff\n", b"0,0,0,0\n", b'"', b"0,1e300,0,0\n")


def _strange_tables(dice: Dice, files: Files) -> None:
    row = _ROWS[int(dice.integers(len(_ROWS)))]
    files[str(dice.choice((STIMULI, REFERENCE)))] = b"time,displacement,force,absorbed_energy\n" + row


def _many(_dice: Dice, files: Files) -> None:
    for k in range(11_000):
        files[f"extra/{k}"] = b""


_CHANGES: dict[str, Callable[[Dice, Files], None]] = {
    change.__name__[1:]: change
    for change in (_removed, _emptied, _flipped_file, _cut_file, _other_model, _strange_json, _strange_names,
                   _hostile_xml, _changed_xml, _other_encoding, _strange_tables)
}  # fmt: skip


# Damage of the archive.


def _flipped(dice: Dice, data: bytes) -> bytes:
    content = bytearray(data)
    for place in dice.integers(len(content), size=int(dice.choice((1, 3, 30)))).tolist():
        content[place] ^= 1 << int(dice.integers(8))
    return bytes(content)


def _cut(dice: Dice, data: bytes) -> bytes:
    return data[: int(dice.integers(len(data)))]


def _in_directory(dice: Dice, data: bytes) -> bytes:
    """Other sizes, flags, methods or places in the central directory."""
    content = bytearray(data)
    entries = []
    place = data.find(b"PK\x01\x02")
    while place >= 0:
        entries.append(place)
        place = data.find(b"PK\x01\x02", place + 4)
    for place in dice.choice(entries, min(len(entries), int(dice.integers(1, 4)))).tolist():
        offset, form = ((8, "<H"), (10, "<H"), (16, "<L"), (20, "<L"), (24, "<L"), (28, "<H"), (30, "<H"), (42, "<L"))[
            int(dice.integers(8))
        ]
        most = 2 ** (16 if form == "<H" else 32)
        value = int(dice.choice((0, 1, most - 1, int(dice.integers(most)))))
        struct.pack_into(form, content, place + offset, value)
    return bytes(content)


def _with_end(dice: Dice, data: bytes) -> bytes:
    """Something before or after the archive, or the end twice."""
    end = data[data.rfind(b"PK\x05\x06") :]
    return (b"MZ" * 100 + data, data + b"\0" * 1000, data + end, data + data, b"", b"PK\x03\x04", end)[
        int(dice.integers(7))
    ]


def _twice(_dice: Dice, data: bytes) -> bytes:
    """A name given twice: that of one entry in the place of another of the same length."""
    old, new = MODEL_IN_FMU.encode(), MODEL_IN_FMU.replace("model", "build").encode()
    return data.replace(new, old)


_DAMAGES = (_flipped, _cut, _in_directory, _in_directory, _with_end, _twice)


def _damaged(dice: Dice, data: bytes) -> bytes:
    return _DAMAGES[int(dice.integers(len(_DAMAGES)))](dice, data)
