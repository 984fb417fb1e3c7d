"""Model files, sound, at the ends of their limits and damaged, given to all that takes one; and FMU archives.

A model that is accepted is the same again after it was saved, and finite in every output of every use.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import random
import struct
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from strandspring import Record, Spring, SpringParameters, info, verify
from strandspring.core import parameters as limits
from strandspring.fmu.python_backed import fmu_contents
from strandspring.fmu.related_files import HASHES
from strandspring.model.modelfile import MODEL_IN_FMU, ModelFile
from targets.mutator import ABSURD, CORPUS, FLOATS, finite, mutated
from targets.options import judged

_DESCRIPTION = "modelDescription.xml"
_SPRING = SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)
_OF: dict[str, Any] = ABSURD["archives"]
_INSIDE = 1.0 - 1e-12  # what is rounded stays within


@cache
def _seeds() -> list[bytes]:
    """Sound model files, of coefficients and tables, with uncertainty and without."""
    return [path.read_bytes() for path in sorted((CORPUS / "models").glob("sound_*"))]


def _model_file(dice: random.Random) -> bytes:
    """A model file, sound or not."""
    data = dice.choice(_seeds())
    if dice.random() < 0.4:
        content = json.loads(data)
        for name in ("kE", "FE_knots", "FE_forces"):
            content["parameters"].pop(name, None)
        content["parameters"] |= _corner(dice)
        if dice.random() < 0.8:
            content |= {"uncertainty": {}, "fit": {}, "provenance": {}}
        data = json.dumps(content).encode()
    return mutated(dice, data) if dice.random() < 0.5 else data


def _corner(dice: random.Random) -> dict[str, Any]:
    """Parameters at the ends of what is allowed, or between them at any size."""

    def end(low: float, high: float) -> float:
        return min(max(dice.choice((low, high, low * (high / low) ** dice.random())), low / _INSIDE), high * _INSIDE)

    def size() -> float:
        return dice.choice((-1.0, 1.0)) * dice.choice((0.0, 1.0, 1.0, 10.0 ** dice.uniform(-30.0, 0.0), 5e-324))

    width = end(*limits.WIDTH_RANGE)
    low = dice.choice((0.0, -0.5 * width, -dice.random() * width))
    if width > 1e-4 and dice.random() < 0.4:  # else it is not resolved so far away
        low = dice.choice((limits.LARGEST_DISPLACEMENT - width, -limits.LARGEST_DISPLACEMENT))
    high = low + width
    offset = dice.choice((low, high, 0.5 * (low + high)))
    reach, degree = max(high - offset, offset - low), dice.choice((0, 1, 2, limits.MAXIMUM_AMPLIFIER_DEGREE))
    powers, root = range(1, degree + 1), dice.choice((1.0 - 1e-12, 1.0 - 1e-6))
    shares = dice.choice((
        [dice.uniform(-1.0, 1.0) / degree for _ in powers], [math.comb(degree, k) * (-root) ** k for k in powers],
        [limits.LARGEST_AMPLIFIER * _INSIDE if k % 2 == 0 or offset == low else 0.0 for k in powers],
    ))  # fmt: skip
    values = {
        "kappa_omega": end(*limits.FORCE_RANGE), "rho": end(*limits.SATURATION_RANGE) / (high - low),
        "sigma": end(*limits.SIGMA_RANGE), "n": end(*limits.N_RANGE), "displacement_offset": offset,
        "displacement_min": low, "displacement_max": high,
        "kA": [1.0, *(share / reach**k for k, share in enumerate(shares, start=1))],
    }  # fmt: skip
    if dice.random() < 0.7:
        count = dice.choice((1, 2, 3, limits.MAXIMUM_DEGREE + 1))
        return values | {"kE": [size() * limits.FORCE_RANGE[1] / reach**k * _INSIDE for k in range(count)]}
    count = dice.choice((*limits.KNOTS, dice.randint(*limits.KNOTS)))
    places = dice.choice((limits.LEAST_SPACING * (1.0 + 1e-6), 1.0 / (count - 1))) * np.arange(count)
    knots = [low, *(low + places[1:-1] * (high - low)).tolist(), high]
    return values | {"FE_knots": knots, "FE_forces": [size() * limits.FORCE_RANGE[1] for _ in knots]}


def _stated(dice: random.Random, text: str) -> float:
    """A number of an uncertainty or of figures of a fit, at times of absurd size."""
    return abs(dice.choice(FLOATS[:-2])) if dice.random() < 0.06 else float(text)


def trial(dice: random.Random, folder: Path) -> str:
    """One model file given to all of its uses."""
    data = _model_file(dice)
    if dice.random() < 0.15:
        data = dice.choice(_seeds())
        content = json.loads(data, parse_float=lambda text: _stated(dice, text))
        data = json.dumps(content | {"parameters": json.loads(data)["parameters"]}).encode()
    (folder / "model.json").write_bytes(data)
    return judge(folder / "model.json", dice)


def judge(path: Path, dice: random.Random | None = None) -> str:
    """A model file given to its uses: the dearest at times, or never for a file of the corpus."""
    least, dice = (0.1, random.Random(1)) if dice is None else (0.0, dice)
    spring = Spring.load(path)
    _check_response(path, spring)
    folder, p = path.parent, spring.parameters
    (folder / "other.json").write_bytes(dice.choice(_seeds()))
    motion = _path(spring, *dice.choice(((1.1, 1.1), (1.0,), (0.5, 1.0))))
    Record(motion, spring.response(motion), np.arange(motion.size) * 1e-3, path="record").save(folder / "record.csv")
    force = np.sort(spring.response([p.displacement_min, p.displacement_max]))
    mass = (force[0] + dice.uniform(0.2, 0.8) * (force[1] - force[0])) / 9.81  # that the spring holds, or any
    refused = []
    for use, share in ABSURD["uses of models"].items():
        if share > least and dice.random() < share:
            words = use.replace("FOLDER", str(folder)).replace("MODEL", str(path)).split()
            if judged([str(mass if mass > 0.0 else 1e3) if word == "MASS" else word for word in words], folder):
                refused.append(words[0])
    return f"accepted, refused by {', '.join(refused) or 'none'}"


def _path(spring: Spring, *shares: float) -> np.ndarray:
    """Two cycles of each share of the range about its middle."""
    p = spring.parameters
    half = 0.5 * (p.displacement_max - p.displacement_min)
    wave = np.sin(np.linspace(0.0, 4.0 * np.pi, 41))
    path = np.concatenate([p.displacement_min + half + share * half * wave for share in shares])
    return np.clip(path, -limits.LARGEST_DISPLACEMENT, limits.LARGEST_DISPLACEMENT)


def _check_response(path: Path, spring: Spring) -> None:
    motion = np.append(_path(spring, 1.1), np.array([1.0, -1.0, 0.0]) * limits.LARGEST_DISPLACEMENT)
    for answer in (spring.response, spring.omega, spring.stiffness, spring.absorbed_energy):
        finite(answer.__name__, answer(motion))
    again = path.with_name("again.json")
    spring.save(again)
    content = again.read_bytes()
    assert Spring.load(again) == spring
    Spring.load(again).save(again)
    assert again.read_bytes() == content


@cache
def _sound() -> dict[str, bytes]:
    return fmu_contents(ModelFile("spring", _SPRING))


def fmus(dice: random.Random, folder: Path) -> str:
    """One FMU archive, built once without its binaries, so that it is not run; nothing may be written elsewhere."""
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
        (name, None), (MODEL_IN_FMU, _model_file(dice)), (dice.choice(ABSURD["names"]), b"content"),
        (strange, dice.choice(_OF["files"][strange]).encode("latin-1")), (_DESCRIPTION, text.encode()),
        (name, mutation), (name, mutation),
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
    if dice.random() < 0.5:
        twice = data.replace(MODEL_IN_FMU.encode(), MODEL_IN_FMU.replace("model", "build").encode())
        more = dice.choice((b"", b"MZ" * 100)) + data + data[data.rfind(b"PK\x05\x06") :]
        return dice.choice((twice, more, mutated(dice, b"\0" + data)[1:]))
    content = bytearray(data)
    entries = [place for place in range(len(data) - 4) if data[place : place + 4] == b"PK\x01\x02"]
    for place in dice.sample(entries, min(len(entries), 2)):
        offset, form = dice.choice(((8, "<H"), (10, "<H"), (16, "<L"), (20, "<L"), (24, "<L"), (28, "<H"), (42, "<L")))
        most = 2 ** (8 * struct.calcsize(form))
        struct.pack_into(form, content, place + offset, dice.choice((0, 1, most - 1, dice.randrange(most))))
    return bytes(content)
