"""FMU archives, sound and damaged, given to `verify` and to what reads the model inside.

An FMU is built once without its binaries, so that it is not run; each trial changes its files, its list of hashes, its
directory or its bytes. Nothing may be written outside of temporary folders.
"""

from __future__ import annotations

import hashlib
import io
import json
import random
import struct
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

from strandspring import SpringParameters, info, verify
from strandspring.fmu.python_backed import fmu_contents
from strandspring.fmu.related_files import HASHES
from strandspring.model.modelfile import MODEL_IN_FMU, ModelFile
from targets.models import model_file
from targets.mutator import ABSURD, mutated

_DESCRIPTION = "modelDescription.xml"
_SPRING = SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)
_OF: dict[str, Any] = ABSURD["archives"]


@cache
def _sound() -> dict[str, bytes]:
    return fmu_contents(ModelFile("spring", _SPRING))


def trial(dice: random.Random, folder: Path) -> str:
    """One archive."""
    files = dict(_sound())
    for _ in range(dice.choice((0, 1, 1, 2))):
        _change(dice, files)
    if dice.random() < 0.01:
        files |= {f"extra/{k}": b"" for k in range(11_000)}
    if dice.random() < 0.6:
        hashes = {name: hashlib.sha256(content).hexdigest() for name, content in files.items() if name != HASHES}
        files[HASHES] = json.dumps(hashes).encode()
    place = folder / "inner" / "spring.fmu"
    place.parent.mkdir()
    data = _packed(dice, files)
    place.write_bytes(_damaged(dice, data) if dice.random() < 0.4 else data)
    try:
        verification = verify(place)
        assert verification.summary().isascii(), verification.summary()
        info(place).summary()
        return "accepted" if verification.ok else f"accepted with findings on {verification.problems[0].about}"
    finally:
        assert sorted(path.name for path in folder.rglob("*")) == ["inner", "spring.fmu"]
        assert not Path("/tmp/strandspring_escaped").exists()


def _change(dice: random.Random, files: dict[str, bytes]) -> None:
    """Change one of the files, or add one."""
    name = dice.choice([_DESCRIPTION, MODEL_IN_FMU, *_OF["files"], *sorted(_sound())])
    strange = dice.choice(sorted(_OF["files"]))
    text = files.get(_DESCRIPTION, b"").decode("utf-8", "replace").replace("?>", "?>" + dice.choice(_OF["heads"]), 1)
    text = text.replace('description="', f'description="{dice.choice(_OF["entities"])}', 1)
    mutation = mutated(dice, files.get(name) or b"x")
    name, content = dice.choice((
        (name, None), (MODEL_IN_FMU, model_file(dice)), (strange, dice.choice(_OF["files"][strange]).encode("latin-1")),
        (dice.choice(ABSURD["names"]), b"content"), (_DESCRIPTION, text.encode()), (name, mutation), (name, mutation),
    ))  # fmt: skip
    if dice.random() < 0.03:
        name, content = "resources/big", b"\0" * dice.choice((20_000_000, 230_000_000))
    files[name] = content or b""
    if content is None:
        del files[name]


def _packed(dice: random.Random, files: dict[str, bytes]) -> bytes:
    packed = io.BytesIO()
    method = dice.choice((0, *[8] * 9, 12, 14)) if len(files) < 1000 else 8  # LZMA takes 2 ms a file
    with zipfile.ZipFile(packed, "w", method) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name[:60_000])
            entry.compress_type = method
            # A file, a symbolic link, a folder, a device, or nothing in particular.
            entry.external_attr = dice.choice((0o100644,) * 9 + (0o120777, 0o040755, 0o020666, 0)) << 16
            archive.writestr(entry, content)
        archive.comment = b"x" * (60_000 if dice.random() < 0.1 else 0)
    return packed.getvalue()


def _damaged(dice: random.Random, data: bytes) -> bytes:
    """An archive with other bytes, sizes, flags, methods or places in its directory, a second end, or a name twice."""
    end = data[data.rfind(b"PK\x05\x06") :]
    match dice.randrange(5):
        case 0:
            return dice.choice((b"", b"MZ" * 100)) + data + dice.choice((b"\0" * 1000, end, data[:1000000]))
        case 1:
            return data.replace(MODEL_IN_FMU.encode(), MODEL_IN_FMU.replace("model", "build").encode())
        case 2:
            return data[: dice.choice((0, 4, dice.randrange(len(data))))]
        case 3:
            return mutated(dice, b"\0" + data)[1:]
    content = bytearray(data)
    entries = [place for place in range(len(data) - 4) if data[place : place + 4] == b"PK\x01\x02"]
    for place in dice.sample(entries, min(len(entries), 2)):
        offset, form = dice.choice(((8, "<H"), (10, "<H"), (16, "<L"), (20, "<L"), (24, "<L"), (28, "<H"), (42, "<L")))
        most = 2 ** (8 * struct.calcsize(form))
        struct.pack_into(form, content, place + offset, dice.choice((0, 1, most - 1, dice.randrange(most))))
    return bytes(content)
