"""Where the model files of strandspring.examples come from; run as a script, it makes them again."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import strandspring as ss
from strandspring.examples.paper import campaign
from strandspring.examples.system_models import SYSTEMS

NOISE, SEED = 0.01, 15
AMPLITUDES = (0.15, 0.4, 0.7, 1.0)  # shares of the half range

# Positive in compression, where it hardens.
CORNERS: dict[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
SPRINGS = {name: ss.SpringParameters(**given) for name, given in CORNERS.items()}
# With 0.6 of the forces.
SPRINGS |= {
    name.replace("corner", "corner_soft"): replace(p, kE=[0.6 * k for k in p.kE], kappa_omega=0.6 * p.kappa_omega)
    for name, p in SPRINGS.items()
}


def records(name: str) -> tuple[list[ss.Record], str]:
    """What a spring is identified from, and the description of its model file."""
    if name == "recoil_spring":
        of_paper = campaign()
        return [of_paper["slow"], of_paper["fast"]], (
            "Synthesized, not measured: see strandspring.examples.paper. It has the size of the paper's stranded wire "
            "helical spring: free length 176 mm, one core wire and layers of 3 and 6 wires of 1.5 mm. Displacement is "
            "the compression."
        )
    true = SPRINGS[name]
    half = 0.5 * (true.displacement_max - true.displacement_min)
    amplitudes, middle = [share * half for share in AMPLITUDES], true.displacement_min + half
    record = ss.synthesize(ss.Spring(true), amplitudes=amplitudes, mean=middle, samples=200, noise=NOISE, seed=SEED)
    return [record], "Synthesized, not measured: see strandspring.examples.system_models."


def write_models(folder: Path, names: Iterable[str] = (*SPRINGS, "recoil_spring")) -> None:
    """Write the model files of these springs."""
    for name in names:
        measured, description = records(name)
        ss.identify(measured).spring(name, description).save(folder / f"{name}.json")


if __name__ == "__main__":
    write_models(SYSTEMS)
