"""Where the model files of strandspring.examples come from; run as a script, it makes them again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import strandspring as ss
from strandspring.examples.paper import campaign
from strandspring.examples.system_models import SYSTEMS

NOISE, SEED = 0.01, 15
AMPLITUDES = (0.15, 0.4, 0.7, 1.0)  # shares of the half range

# Positive in compression, where it hardens.
CORNER_COMPRESSION = ss.SpringParameters(
    kE=(0.0, 2.2e4, 1.5e5, 1.2e7), kA=(1.0, 8.0), kappa_omega=60.0, rho=350.0, sigma=1.2, n=0.8,
    displacement_offset=0.005, displacement_min=-0.022, displacement_max=0.032,
)  # fmt: skip
CORNER_SHEAR = ss.SpringParameters(
    kE=(0.0, 2.0e4, 0.0, 9e6), kA=(1.0,), kappa_omega=45.0, rho=300.0, sigma=1.1, n=0.7,
    displacement_offset=0.0, displacement_min=-0.03, displacement_max=0.03,
)  # fmt: skip


def softer(p: ss.SpringParameters) -> ss.SpringParameters:
    """A spring with 0.6 of the forces."""
    return replace(p, kE=tuple(0.6 * force for force in p.kE), kappa_omega=0.6 * p.kappa_omega)


SPRINGS = {
    "corner_compression": CORNER_COMPRESSION,
    "corner_shear": CORNER_SHEAR,
    "corner_soft_compression": softer(CORNER_COMPRESSION),
    "corner_soft_shear": softer(CORNER_SHEAR),
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
