"""Random start values for Ni's method."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from strandspring.peers.ni import NiParameters

_SPREAD = math.log(10.0)


def random_start(generator: np.random.Generator, scale: NiParameters) -> NiParameters:
    """Each parameter is that of `scale` times a factor, log-uniform in [1/10, 10].

    Draws that are not physically possible are drawn again. B stays, since C carries the one number of the amplifier.
    """
    names = ("K1", "K2", "K3", "C", "eta", "theta", "lambda_", "n")
    while True:
        factors = np.exp(generator.uniform(-_SPREAD, _SPREAD, len(names)))
        drawn = {name: getattr(scale, name) * float(f) for name, f in zip(names, factors, strict=True)}
        try:
            return replace(scale, **drawn)
        except ValueError:
            continue
