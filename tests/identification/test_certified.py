"""Certified cases: what each method must reach on records whose answers are known, see `certified.toml`."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomllib

from strandspring import (
    Identification,
    IdentificationError,
    NiOptions,
    PaperOptions,
    Record,
    RecordError,
    RefinedOptions,
    TwoStageOptions,
    identify,
    read_record,
    synthesize,
)  # fmt: skip

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
CERTIFIED = tomllib.loads(Path(__file__).with_name("certified.toml").read_text("utf-8"))
CASES: dict[str, dict[str, Any]] = {case["name"]: case for case in CERTIFIED["case"]}
METHODS: dict[str, Any] = {
    "refined": RefinedOptions, "two_stage": TwoStageOptions, "paper": PaperOptions, "ni": NiOptions,
}  # fmt: skip


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@cache
def truth(name: str) -> Any:
    """The oracle of a case's spring."""
    from oracles import OracleSpring

    return OracleSpring(CERTIFIED["base"] | CASES[name]["spring"])


def sines(case: dict[str, Any], rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and displacement [m]."""
    base, cycles, samples = CERTIFIED["base"], case.get("cycles", 2), case.get("samples", 200)
    unit = np.sin(2.0 * np.pi * np.arange(cycles * samples) / samples)
    share = np.concatenate([*(amplitude * unit for amplitude in case.get("amplitudes", (1.0, 0.7, 0.4))), [0.0]])
    half = base["displacement_offset"] - base["displacement_min"]
    return np.arange(share.size) / (samples * rate), base["displacement_offset"] + half * share


@cache
def records(name: str) -> tuple[Record, ...]:
    case, made = CASES[name], []
    if "file" in case:
        return (read_record(ROOT / case["file"], **case["options"]),)
    if "table1" in case:
        amplitude, n = case["table1"]
        return (synthesize("ni", 1e-3 * amplitude, exponent=n, seed=1),)
    for seed, rate in enumerate(case.get("rates", (1.0,))):
        time, path = sines(case, rate)
        force = truth(name).force(path, 0.0, time)
        noise = case.get("noise", 0.0) * np.std(force) * np.random.default_rng(seed).standard_normal(path.size)
        made.append(Record(path, force + noise, time if "rates" in case else None, f"{seed}.csv"))
    return tuple(made)


def value(found: Any, name: str) -> float:
    """Of "rho", "second.rho" of the mechanism with the larger rho, or "branches.0.stiffness"."""
    if (second := found.get("second")) and second["rho"] < found["rho"]:
        found = found | second | {"second": found}
    for step in name.split("."):
        found = found[int(step) if step.isdigit() else step]
    return float(found)


def error(name: str, found: Identification, figure: str) -> float:
    """Of one figure of a case, as `certified.toml` says."""
    case, spring = CASES[name], found.spring()
    if figure == "rms":
        return 1.0 - found.rnl
    if figure == "energy":
        loop = max(found.recorded, key=lambda loop: loop.figures.energy_per_cycle)
        return abs(loop.predicted.energy_per_cycle / case.get("energy", loop.figures.energy_per_cycle) - 1.0)
    if figure == "steady":
        amplitude, n = case["table1"]
        clean = synthesize("ni", 1e-3 * amplitude, exponent=n, noise=0.0)
        return rms(spring.response(np.tile(clean.displacement, 5))[-len(clean) :] - clean.force)
    if figure == "loops":
        time, path = sines({"amplitudes": (0.9, 0.55, 0.3), "cycles": 3, "samples": 117}, case.get("rates", [1.0])[0])
        path = path + 0.1 * (path - path[0]) * np.cos(time)
        expected = truth(name).force(path, 0.0, time)
        force = spring.response(path, time=time if spring.parameters.branches else None)
        return rms(force - expected) / float(np.std(expected))
    return abs(value(found.parameters.as_dict(), figure) / value(truth(name).values, figure) - 1.0)


@pytest.mark.parametrize(("name", "method"), [(case, way) for case in CASES for way in METHODS if way in CASES[case]])
def test_certified(name: str, method: str) -> None:
    case = CASES[name]
    options = METHODS[method](**case.get(f"{method}_options", {}))
    if case[method] == "refused":
        with pytest.raises((RecordError, IdentificationError)):
            identify(records(name), options)
        return
    found = identify(records(name), options)
    errors = {figure: error(name, found, figure) for figure in case[method]}
    assert {figure: size for figure, size in errors.items() if not size <= case[method][figure]} == {}
