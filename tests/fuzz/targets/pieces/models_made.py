"""Model files made from pieces, sound and damaged: each seed gives one, always the same."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np

from strandspring.core.parameters import FORCE_RANGE, N_RANGE, SATURATION_RANGE, SIGMA_RANGE

HYSTERETIC = ("kappa_omega", "rho", "sigma", "n")
# Text that stands for itself in the file, since JSON libraries do not write it.
RAW = "raw:"
NUMBERS: tuple[Any, ...] = (
    0, 1, -1, 0.0, -0.0, 0.5, 1e-9, -1e-9, 1e6, 1e9, -1e9, 1e15, 1e19, 1e38, 1e77, 1e100, 1e153, -1e153, 1e154, 1e155,
    1e200, 1e300, 1e307, 1.7e308, -1.7e308, 1e-19, 1e-100, 1e-160, 1e-300, 2.3e-308, 1e-309, 1e-323, 5e-324, -5e-324,
    10**17, 10**400, -(10**400), 2**1023, 2**1024, RAW + "1e400", RAW + "-1e999", RAW + "NaN", RAW + "Infinity",
    RAW + "-Infinity", RAW + "1" + "0" * 5000, RAW + "0." + "3" * 5000, RAW + "-0", RAW + "1e-400",
)  # fmt: skip
OTHERS: tuple[Any, ...] = (
    True, False, None, "", "1.0", "nan", "=1+1", "\x00", "\x1b[31m", "\ud800", "\u202e", "ä" * 70, "x" * 3000,
    [], {}, [[]], [None], [1.0], {"a": 1}, [[1.0], [2.0, 3.0]], [0.0] * 30, [[0.0] * 40] * 40, {"": {}},
    RAW + "[" * 150 + "]" * 150, RAW + "[" * 100_000 + "]" * 100_000, RAW + '{"a":' * 5000 + "1" + "}" * 5000,
    RAW + "[" + ",".join(["0"] * 100_000) + "]",
)  # fmt: skip


def model_file(seed: int) -> bytes:
    """The model file of a seed."""
    dice = random.Random(seed)
    content = sound(dice)
    if dice.random() < 0.3:
        rescale(dice, content)
    for _ in range(dice.choice((0, 0, 1, 1, 1, 2, 3))):
        dice.choice(_CHANGES)(dice, content)
    text = written(content)
    return dice.choice(_DAMAGES)(dice, text) if dice.random() < 0.15 else text.encode("utf-8", "surrogatepass")


def sound(dice: random.Random) -> dict[str, Any]:
    """The content of a model file without a fault."""
    length, force = 10.0 ** dice.uniform(-3.0, 0.0), 10.0 ** dice.uniform(-1.0, 5.0)
    middle = dice.choice((0.0, length, -7.0 * length))
    low, high = middle - length, middle + length * dice.uniform(0.5, 2.0)
    amplifier = [1.0, *(dice.uniform(-0.3, 0.3) / (2.0 * length) ** k for k in range(1, dice.choice((1, 1, 2, 3, 5))))]
    parameters: dict[str, Any] = {}
    if dice.random() < 0.35:
        count = dice.randint(7, 25)
        knots = np.linspace(low, high, count)
        parameters["FE_knots"] = [low, *knots[1:-1].tolist(), high]
        parameters["FE_forces"] = (force * (knots - middle) / length + dice.gauss(0.0, 0.05) * force).tolist()
    else:
        parameters["kE"] = [
            dice.uniform(0.2, 1.0) * force / length**k * 0.3 ** max(k - 1, 0)
            for k in range(dice.choice((1, 2, 2, 3, 4, 6, 10, 21)))
        ]
    parameters |= {
        "kA": amplifier,
        "kappa_omega": 0.3 * force,
        "rho": 10.0 ** dice.uniform(-0.5, 2.0) / length,
        "sigma": dice.choice((0.5, 0.7, 1.0, 2.0, 30.0)),
        "n": dice.choice((0.22, 0.5, 1.0, 2.0, 7.0)),
        "displacement_offset": middle,
        "displacement_min": low,
        "displacement_max": high,
    }
    uncertainty = dice.choice((_no_uncertainty, _full_uncertainty, _full_uncertainty))(dice, parameters)
    recorded: dict[str, Any] = {"format_version": dice.choice((1, 2, 3, 4))}
    if recorded["format_version"] == 4:
        where = {"displacement": dice.choice((low, 0.0, middle)), "omega": dice.choice((-1.0, -0.3, 0.0, 1.0))}
        recorded["start"] = where | {"branch_forces": [], "at_rest": dice.random() < 0.5}
        recorded["certificate"] = {"force_min": -force, "force_max": force, "margin": 0.5 * force}
    return {
        "format": "strandspring-model",
        **recorded,
        "name": dice.choice(("spring", "mount_7", "A")),
        "description": dice.choice(("", "a mount, lot 7", "Feder <&> \u00e4")),
        "parameters": parameters,
        "fit": _fit(dice) if uncertainty else {},
        "uncertainty": uncertainty,
        "provenance": _provenance() if uncertainty else {},
    }


def _no_uncertainty(_dice: random.Random, _parameters: dict[str, Any]) -> dict[str, Any]:
    return {}


def _full_uncertainty(dice: random.Random, parameters: dict[str, Any]) -> dict[str, Any]:
    elastic = "FE_forces" if "FE_forces" in parameters else "kE"
    share = 10.0 ** dice.uniform(-4.0, -1.0)
    spread = [
        *(share * abs(value) for value in parameters[elastic]),
        *(share * abs(value) for value in parameters["kA"][1:]),
        *[share] * 4,
    ]
    errors = {name: share * parameters[name] for name in HYSTERETIC}
    names = [f"{elastic}[{i}]" for i in range(len(parameters[elastic]))]
    names += [f"kA[{i}]" for i in range(1, len(parameters["kA"]))] + [f"ln {name}" for name in HYSTERETIC]
    known: dict[str, Any] = {
        "meaning": "standard errors",
        elastic: [share * abs(value) for value in parameters[elastic]],
        "kA": [0.0, *(share * abs(value) for value in parameters["kA"][1:])],
        **errors,
        "interval_95": {
            name: [max(parameters[name] - 2.0 * error, 0.5 if name == "sigma" else 0.0), parameters[name] + 2.0 * error]
            for name, error in errors.items()
        },
        "correlation": {"kappa_omega,rho": 0.1, "kappa_omega,sigma": 0.0, "kappa_omega,n": -0.1, "rho,sigma": 0.2,
                        "rho,n": 0.3, "sigma,n": None},
        "joint": {
            "meaning": "rows",
            "parameters": names,
            "root": [[0.1 * spread[k]] * k + [spread[k]] for k in range(len(names))],
        },
        "prediction_interval": {"level": 0.95, "factor": 2.0, "additive": 0.1, "relative": 0.01, "error": 0.02,
                                "half_width": 0.2, "held_out_coverage": 0.95, "held_out_cycles": 2},
        "indistinct": ["rho and n are strongly correlated in these records (0.990)"],
    }  # fmt: skip
    for name in ("interval_95", "joint", "prediction_interval", "correlation", "indistinct"):
        if dice.random() < 0.3:
            del known[name]
    return known


def _fit(dice: random.Random) -> dict[str, Any]:
    fit: dict[str, Any] = {
        "rmse": 0.1, "rnl": 0.99, "degrees": [3, 1], "steady_share": 0.2,
        "outcomes": [{"name": "drift", "sentence": "The force drifts."}],
        "records": [{"file": "a.csv", "samples": 100, "rmse": 0.1, "rnl": 0.99}],
    }  # fmt: skip
    if dice.random() < 0.3:
        fit["effects"] = {"play": 1e-5, "delay": {"seconds": 0.001}}
    return fit


def _provenance() -> dict[str, Any]:
    return {
        "records": [{"file": "a.csv", "sha256": "0" * 64, "samples": 100, "notes": ["displacement is column 1"]}],
        "method": "refined", "options": {"degrees": "auto", "seed": 0}, "version": "0.1.0",
    }  # fmt: skip


def rescale(dice: random.Random, content: dict[str, Any]) -> None:
    """The same spring with lengths and forces of absurd size."""
    length = 10.0 ** dice.choice((0.0, dice.uniform(-8, 5), dice.uniform(-8, 5), dice.uniform(-320, 300)))
    force = 10.0 ** dice.choice((0.0, dice.uniform(-13, 9), dice.uniform(-13, 9), dice.uniform(-320, 300)))
    p = content["parameters"]
    powers = {"rho": (-1, 0), "kappa_omega": (0, 1), "FE_knots": (1, 0), "FE_forces": (0, 1)}
    powers |= dict.fromkeys(("displacement_offset", "displacement_min", "displacement_max"), (1, 0))

    def scaled(value: float, of_length: int, of_force: int) -> float:
        try:
            result = float(value * length**of_length * force**of_force)
        except (OverflowError, ZeroDivisionError):
            return 1e308
        return result if abs(result) < 1.7e308 else 1.7e308

    for name, (of_length, of_force) in powers.items():
        if name in p:
            value = p[name]
            p[name] = [scaled(v, of_length, of_force) for v in value] if isinstance(value, list) else scaled(
                value, of_length, of_force
            )  # fmt: skip
    if "kE" in p:
        p["kE"] = [scaled(v, -k, 1) for k, v in enumerate(p["kE"])]
    p["kA"] = [1.0, *(scaled(v, -k, 0) for k, v in enumerate(p["kA"][1:], start=1))]


def _places(value: Any, found: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    """Every container with every key of it."""
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        found.append((value, key))
        _places(value[key], found)
    return found


def _place(dice: random.Random, content: dict[str, Any]) -> tuple[Any, Any]:
    """A container and a key of it, most often among the parameters or in the uncertainty."""
    part = dice.choice(
        ("parameters", "parameters", "parameters", "uncertainty", "uncertainty", "start", "certificate", "fit", None)
    )
    inside = content.get(part) if part else content
    places = _places(inside if isinstance(inside, dict | list) and inside else content, [])
    return dice.choice(places) if places else (content, "name")


def _other_number(dice: random.Random, content: dict[str, Any]) -> None:
    container, key = _place(dice, content)
    container[key] = dice.choice(NUMBERS)


def _factor(dice: random.Random, content: dict[str, Any]) -> None:
    """A number times an absurd factor: it may stay possible."""
    container, key = _place(dice, content)
    value = container[key]
    if isinstance(value, float):
        container[key] = value * dice.choice((-1.0, 2.0, 1e-3, 1e3, 1e-9, 1e9, 1e30, 1e-30, 1e150, 1e-150))
        if abs(container[key]) > 1.7e308:
            container[key] = 1.7e308


def _other_scalar(dice: random.Random, content: dict[str, Any]) -> None:
    """A possible, but absurd value of a parameter."""
    p = content.get("parameters")
    if not isinstance(p, dict):
        return
    name = dice.choice(HYSTERETIC)
    size = 10.0 ** dice.choice((dice.uniform(-12, 12), dice.uniform(-300, 300)))
    p[name] = {"sigma": dice.choice((0.5, 50.0, 999.0, 1000.0)), "n": dice.choice((0.01, 0.05, 20.0, 100.0))}.get(
        name, size
    )


def _at_limits(dice: random.Random, content: dict[str, Any]) -> None:
    """Parameters at the ends of what is allowed."""
    p = content.get("parameters")
    try:
        width = p["displacement_max"] - p["displacement_min"]
        reach = max(p["displacement_max"] - p["displacement_offset"], p["displacement_offset"] - p["displacement_min"])
        ends = {
            "n": N_RANGE,
            "sigma": SIGMA_RANGE,
            "kappa_omega": FORCE_RANGE,
            "rho": tuple(limit / width for limit in SATURATION_RANGE),
        }
    except (KeyError, TypeError, ZeroDivisionError, OverflowError):
        return
    for name in dice.sample(sorted(ends), dice.randint(1, 4)):
        p[name] = dice.choice(ends[name]) * dice.choice((1.0, 1.0, 1.0001, 0.9999))
    for name in ("kE", "FE_forces"):
        if isinstance(p.get(name), list) and dice.random() < 0.5:
            k = dice.randrange(max(len(p[name]), 1))
            scale = float(np.float_power(min(reach, 1e6), k)) if name == "kE" else 1.0
            if k < len(p[name]) and 0.0 < scale < math.inf:
                p[name][k] = dice.choice((-1.0, 1.0, 1e-15)) * FORCE_RANGE[1] / scale
    if dice.random() < 0.3:
        shift = dice.choice((-1.0, 1.0)) * 10.0 ** dice.uniform(-3, 9)
        for name in ("displacement_offset", "displacement_min", "displacement_max"):
            p[name] += shift
        if isinstance(p.get("FE_knots"), list) and len(p["FE_knots"]) > 1:
            count = len(p["FE_knots"])
            p["FE_knots"] = [p["displacement_min"] + width * k / (count - 1) for k in range(count)]
            p["FE_knots"][-1] = p["displacement_max"]


def _other_range(dice: random.Random, content: dict[str, Any]) -> None:
    """A range that is absurdly narrow, wide or far away."""
    p = content.get("parameters")
    if not isinstance(p, dict):
        return
    centre = dice.choice((0.0, 1.0, -1e9, 1e9, 1e15, 1e300, 1e-300))
    width = 10.0 ** dice.choice((dice.uniform(-12, 9), dice.uniform(-323, 300)))
    p["displacement_offset"], p["displacement_min"], p["displacement_max"] = centre, centre - width, centre + width
    knots = p.get("FE_knots")
    if isinstance(knots, list) and len(knots) > 1 and dice.random() < 0.8:
        p["FE_knots"] = [centre - width + 2.0 * width * k / (len(knots) - 1) for k in range(len(knots))]
        p["FE_knots"][0], p["FE_knots"][-1] = p["displacement_min"], p["displacement_max"]


def _other_kind(dice: random.Random, content: dict[str, Any]) -> None:
    container, key = _place(dice, content)
    container[key] = dice.choice(OTHERS)


def _removed(dice: random.Random, content: dict[str, Any]) -> None:
    container, key = _place(dice, content)
    del container[key]


def _doubled(dice: random.Random, content: dict[str, Any]) -> None:
    """An element, or a field under another name, once more."""
    container, key = _place(dice, content)
    if isinstance(container, list):
        container.insert(key, container[key])
    else:
        container[dice.choice(("extra", "", "Rho", "FE_knots", "kE", "joint"))] = container[key]


def _swapped(dice: random.Random, content: dict[str, Any]) -> None:
    """Two values in each other's place."""
    (one, key), (other, place) = _place(dice, content), _place(dice, content)
    first, second = json.dumps(one[key]), json.dumps(other[place])
    if len(first) + len(second) < 100_000:
        one[key], other[place] = json.loads(second), json.loads(first)


def _doubtful_joint(dice: random.Random, content: dict[str, Any]) -> None:
    """A covariance that is zero, huge, or not of full rank."""
    joint = content["uncertainty"].get("joint") if isinstance(content["uncertainty"], dict) else None
    if isinstance(joint, dict) and isinstance(joint.get("root"), list):
        factor = dice.choice((0.0, 1e-300, 1e3, 1e10, 1e150, 1e300))
        joint["root"] = [
            [min(value * factor, 1.7e308) for value in row] if isinstance(row, list) and all(
                isinstance(value, float) for value in row
            ) else row
            for row in joint["root"]
        ]  # fmt: skip


_CHANGES: tuple[Callable[[random.Random, dict[str, Any]], None], ...] = (
    _other_number, _other_number, _other_number, _factor, _factor, _factor, _other_scalar, _other_range,
    _at_limits, _at_limits, _at_limits, _at_limits,
    _other_kind, _other_kind, _removed, _doubled, _swapped, _doubtful_joint,
)  # fmt: skip


def written(content: Any) -> str:
    """The JSON of a content, with its raw parts as they are."""
    text = json.dumps(content, ensure_ascii=False, allow_nan=True)
    pieces = text.split(f'"{RAW}')
    for k, piece in enumerate(pieces[1:], start=1):
        # A raw part ends at the quote that closes it, and holds escaped quotes only.
        end = piece.replace('\\"', "__").index('"')
        pieces[k] = piece[:end].replace('\\"', '"') + piece[end + 1 :]
    return "".join(pieces)


def _bytes(text: str) -> bytearray:
    return bytearray(text.encode("utf-8", "surrogatepass"))


def _cut(dice: random.Random, text: str) -> bytes:
    return bytes(_bytes(text)[: dice.randrange(len(text))])


def _flipped(dice: random.Random, text: str) -> bytes:
    content = _bytes(text)
    for _ in range(dice.choice((1, 2, 10))):
        content[dice.randrange(len(content))] ^= 1 << dice.randrange(8)
    return bytes(content)


def _repeated(dice: random.Random, text: str) -> bytes:
    start = dice.randrange(len(text))
    piece = text[start : start + dice.choice((1, 20, 300))]
    return bytes(_bytes(text[:start] + piece * dice.choice((2, 3, 50)) + text[start:]))


def _encoded(dice: random.Random, text: str) -> bytes:
    return text.encode(dice.choice(("utf-16", "utf-32", "utf-8-sig", "cp500", "latin-1")), "replace")


def _twice(_dice: random.Random, text: str) -> bytes:
    return bytes(_bytes(text[:-1] + ', "name": "again"}'))


def _surrounded(dice: random.Random, text: str) -> bytes:
    before, after = dice.choice((("[", "]"), ("", "\x00"), ("\n" * 1000, ""), ("", text), ("//\n", ""), ('{"a":', "}")))
    return bytes(_bytes(before + text + after))


def _escaped(dice: random.Random, text: str) -> bytes:
    return bytes(_bytes(text.replace("spring", dice.choice(("\\ud800", "\\u0000", "\\x41", "\\u00e4", "%s", "{0}")))))


_DAMAGES = (_cut, _flipped, _flipped, _repeated, _encoded, _twice, _surrounded, _escaped)
