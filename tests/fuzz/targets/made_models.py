"""Model files made from pieces, sound, at the corners of their limits, and damaged."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np

from strandspring.core.parameters import (
    FORCE_RANGE,
    KNOTS,
    LARGEST_AMPLIFIER,
    LARGEST_DISPLACEMENT,
    LEAST_SPACING,
    MAXIMUM_AMPLIFIER_DEGREE,
    MAXIMUM_DEGREE,
    N_RANGE,
    SATURATION_RANGE,
    SIGMA_RANGE,
    WIDTH_RANGE,
)
from targets.made import JSON_ONLY, OTHERS, as_json, changed, damaged_text

HYSTERETIC = ("kappa_omega", "rho", "sigma", "n")
_INSIDE = 1.0 - 1e-12  # what is rounded stays within
_RESOLVED = 1e-4  # [m], of a range as far away as may be
# Of errors and figures that a model file states, which are no parameters.
_STATED = (0.0, 5e-324, 1e-300, 1e-160, 1e-30, 1.0, 1e30, 1e160, 1e300, 1.7976931348623157e308)


def model_file(dice: random.Random) -> bytes:
    """A model file, sound or not."""
    content = sound(dice)
    if dice.random() < 0.3:
        _rescale(dice, content)
    if dice.random() < 0.3:
        _at_limits(dice, content["parameters"])
    for _ in range(dice.choice((0, 0, 0, 1, 1, 1, 2))):
        part = dice.choice(("parameters", "parameters", "uncertainty", "uncertainty", "start", "fit", None))
        inside = content.get(part) if part and isinstance(content, dict) else None
        changed(dice, content, (*OTHERS, *JSON_ONLY), inside)
    text = as_json(content)
    return damaged_text(dice, text) if dice.random() < 0.15 else text.encode("utf-8", "surrogatepass")


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
    uncertainty = _uncertainty(dice, parameters) if dice.random() < 0.7 else {}
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


def _uncertainty(dice: random.Random, parameters: dict[str, Any]) -> dict[str, Any]:
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


def _rescale(dice: random.Random, content: dict[str, Any]) -> None:
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


def _at_limits(dice: random.Random, parameters: dict[str, Any]) -> None:
    """Some of the parameters, or all with the range, at the ends of what is allowed or just beyond."""
    of_corner = corner(dice)
    if dice.random() < 0.3:
        for name in ("kE", "FE_knots", "FE_forces"):
            parameters.pop(name, None)
        parameters |= of_corner
        return
    width = parameters["displacement_max"] - parameters["displacement_min"]
    of_corner["rho"] = dice.choice(SATURATION_RANGE) / width if width else 1.0
    for name in dice.sample(HYSTERETIC, dice.randint(1, 4)):
        parameters[name] = of_corner[name] * dice.choice((1.0, 1.0, 1.0001, 0.9999))


def corner(dice: random.Random) -> dict[str, Any]:
    """The parameters of a spring by their names."""
    width = _end(dice, WIDTH_RANGE)
    low = dice.choice((0.0, 0.0, -0.5 * width, -dice.random() * width))
    if width > _RESOLVED and dice.random() < 0.4:
        low = dice.choice((LARGEST_DISPLACEMENT - width, -LARGEST_DISPLACEMENT))
    high = low + width
    offset = dice.choice((low, high, 0.5 * (low + high), min(max(dice.uniform(low, high), low), high)))
    width, reach = high - low, max(high - offset, offset - low)
    values: dict[str, Any] = {
        "kappa_omega": _end(dice, FORCE_RANGE),
        "rho": _within(_end(dice, SATURATION_RANGE), SATURATION_RANGE) / width,
        "sigma": _end(dice, SIGMA_RANGE),
        "n": _end(dice, N_RANGE),
        "displacement_offset": offset,
        "displacement_min": low,
        "displacement_max": high,
        "kA": _amplifier(dice, reach, offset == low),
    }
    if dice.random() < 0.3:
        return values | _table(dice, low, high)
    count = dice.choice((1, 2, 3, MAXIMUM_DEGREE + 1, dice.randint(1, MAXIMUM_DEGREE + 1)))
    return values | {"kE": [_size(dice) * FORCE_RANGE[1] / reach**k * _INSIDE for k in range(count)]}


def stated(dice: random.Random, content: Any) -> Any:
    """The same uncertainty or figures of a fit with a few numbers of absurd size."""
    if isinstance(content, dict):
        return {key: stated(dice, value) for key, value in content.items()}
    if isinstance(content, list):
        return [stated(dice, value) for value in content]
    if isinstance(content, float) and dice.random() < 0.06:
        return dice.choice(_STATED)
    return content


def _end(dice: random.Random, limits: tuple[float, float]) -> float:
    """An end of limits, or a number between them of any size."""
    low, high = limits
    return dice.choice((low, high, low, high, low * (high / low) ** dice.random()))


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0] / _INSIDE), limits[1] * _INSIDE)


def _size(dice: random.Random) -> float:
    """A share of a limit, of either sign."""
    return dice.choice((-1.0, 1.0)) * dice.choice((0.0, 1.0, 1.0, 10.0 ** dice.uniform(-30.0, 0.0), 5e-324))


def _amplifier(dice: random.Random, reach: float, is_one_sided: bool) -> list[float]:
    """kA of an FA that is positive, or nearly zero at an end of the range."""
    degree = dice.choice((0, 1, 2, MAXIMUM_AMPLIFIER_DEGREE))
    match dice.choice(("small", "large", "touching")):
        case "small":
            shares = [dice.uniform(-1.0, 1.0) / max(degree, 1) for _ in range(degree)]
        case "large":
            shares = [LARGEST_AMPLIFIER * _INSIDE if k % 2 == 0 or is_one_sided else 0.0 for k in range(1, degree + 1)]
        case _:
            root = dice.choice((1.0 - 1e-12, 1.0 - 1e-11, 1.0 - 1e-6))
            shares = [math.comb(degree, k) * (-root) ** k for k in range(1, degree + 1)]
    return [1.0, *(share / reach**k for k, share in enumerate(shares, start=1))]


def _table(dice: random.Random, low: float, high: float) -> dict[str, Any]:
    """Knots that are even, random, or all but the last as close to the first as they may be, and forces."""
    count = dice.choice((KNOTS[0], KNOTS[1], dice.randint(*KNOTS)))
    match dice.choice(("even", "random", "close")):
        case "even":
            shares = [k / (count - 1) for k in range(count)]
        case "random":
            shares = sorted(dice.random() for _ in range(count))
        case _:
            shares = [k * LEAST_SPACING * (1.0 + 1e-6) for k in range(count)]
    knots = [low, *(low + share * (high - low) for share in shares[1:-1]), high]
    return {"FE_knots": knots, "FE_forces": [_size(dice) * FORCE_RANGE[1] for _ in knots]}
