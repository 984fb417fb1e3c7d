"""Shared by the tests of FMUs: springs, paths and files."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from strandspring.core.parameters import SpringParameters

SPRING = SpringParameters(
    kE=(3.0, 1.1e4, -2.0e4, 1.0e6), kA=(1.0, 2.0, 30.0), kappa_omega=21.7, rho=310.0, sigma=1.3, n=0.22,
    displacement_offset=0.02, displacement_min=0.001, displacement_max=0.05,
)  # fmt: skip
OTHER = SpringParameters(
    kE=(0.0, 4.0e3), kA=(1.0,), kappa_omega=150.0, rho=90.0, sigma=0.7, n=1.6,
    displacement_offset=-0.01, displacement_min=-0.1, displacement_max=0.1,
)  # fmt: skip
# A name from anywhere, and the shortest and the longest spring.
AWKWARD = (
    "\"quoted\" 'single' <b>bold</b> </html> & \\ \\n ]]> <!-- \nnew line\ttab\rreturn äöü 弹簧 %s {name} ../../up "
    '"; end mount; */ int evil = 1; #error << 7*7 >> <% x %> {{ 7*7 }} // /* \\'
)
CONSTANT = SpringParameters((2.0,), (1.0,), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)
LONGEST = SpringParameters((0.0, 1e4, *[1e5] * 19), (1.0, *[1.0] * 8), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)


def contents_of(fmu: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def wandering_path(parameters: SpringParameters, samples: int, seed: int) -> np.ndarray:
    """Random path with many reversals, uneven steps, standstills and excursions out of the range."""
    random = np.random.default_rng(seed)
    low, high = parameters.displacement_min, parameters.displacement_max
    turns = random.uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), samples // 8)
    path = [parameters.displacement_offset]
    for turn in turns:
        shares = np.sort(random.uniform(0.0, 1.0, 6))
        path += [*(path[-1] + shares * (turn - path[-1])), turn, turn]
    return np.array(path)
