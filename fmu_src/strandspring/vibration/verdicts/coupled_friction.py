"""What changes where the friction of the axes of one mount acts together, which records along one axis do not tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..bodies.mounted import MountedSystem
from ..bodies.simulation import CaseRun
from .case_cautions import Caution, CautionKind
from .draws import DrawnRun

_SWUNG = 0.5  # half the swing of omega from which an axis' friction is saturated in good part


def coupled_friction(system: MountedSystem, nominal: CaseRun, draws: Sequence[DrawnRun]) -> Iterator[Caution]:
    """A caution if several axes of a mount slide at once: by how much coupled friction changes the largest figures."""
    swing = 0.5 * (nominal.figures.omega_high - nominal.figures.omega_low)
    together = []
    for mount, axes in zip(system.mounts, system.axis_slices, strict=True):
        swings = sorted(swing[axes].tolist(), reverse=True)
        if len(swings) > 1 and swings[1] >= _SWUNG:
            together.append((swings[1], mount.name))
    coupled = [draw.run for draw in draws if draw.system.coupled]
    if not together or not coupled:
        return
    uncoupled = [draw.run for draw in draws if not draw.system.coupled]
    changes = [
        f"{name} by {100.0 * (_largest(coupled, name) / _largest(uncoupled, name) - 1.0):+.2g} %"
        for name in ("acceleration", "sway")
        if _largest(uncoupled, name) > 0.0
    ]
    largest, name = max(together)
    yield Caution(
        CautionKind.COUPLED,
        largest,
        f"In {len(together)} of {len(system.mounts)} mounts several axes slide at once ({name}: omega of the second "
        f"axis swings by +-{largest:.2g} of saturation). Whether their friction acts together, records do not tell; it "
        f"does in a third of the draws, which changes {' and '.join(changes)} on average, and ranges hold both.",
    )


def _largest(runs: Sequence[CaseRun], name: str) -> float:
    """Of all points, the mean of the runs."""
    return float(np.mean([getattr(run.figures, name).max(initial=0.0) for run in runs]))
