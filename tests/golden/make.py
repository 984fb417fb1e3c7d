"""Write `inputs.json` and `golden.json.gz`; run with the version whose answers are to be kept.

The figures kept here come from commit 2c58de3, the last one before the refactoring of November 2026, but for those of
identification (README.md):

    PYTHONPATH=fmu_src python tests/golden/make.py [--only identify]

`inputs.json` holds drawn springs and paths as numbers, so that no other generator of random numbers changes them; with
`--inputs` they are drawn anew. `--only` and kinds of cases leaves the figures of all other kinds as they are.
"""

from __future__ import annotations

import gzip
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strandspring.core.parameters import MAXIMUM_AMPLIFIER_DEGREE

HERE = Path(__file__).parent
SEED = 20261121
SPRINGS = 25
LARGEST = 1_000_000  # half the range in the unit of paths


def main() -> None:
    """Draw inputs where there are none, compute all cases, write them."""
    if "--inputs" in sys.argv[1:] or not (HERE / "inputs.json").exists():
        write_inputs()
    from cases import CASES, Workshop  # reads the inputs

    only = sys.argv[sys.argv.index("--only") + 1 :] if "--only" in sys.argv else []
    kept = json.loads(gzip.decompress((HERE / "golden.json.gz").read_bytes()))["cases"] if only else {}
    with tempfile.TemporaryDirectory(prefix="golden-") as folder:
        workshop = Workshop(Path(folder))
        outputs = {
            name: kept[name] if name in kept and case.kind not in only else case.run(workshop)
            for name, case in CASES.items()
        }
    text = json.dumps({"commit": "2c58de3", "cases": outputs}, allow_nan=False, separators=(",", ":"))
    # Without a time stamp the same figures give the same bytes.
    (HERE / "golden.json.gz").write_bytes(gzip.compress(text.encode(), mtime=0))


def write_inputs() -> None:
    """Draw springs and paths; one line for each of them."""
    random = np.random.default_rng(SEED)
    parts = []
    for kind, members in (("springs", springs(random)), ("paths", paths(random))):
        lines = [f"    {json.dumps(name)}: {json.dumps(member)}" for name, member in members.items()]
        parts.append(f"  {json.dumps(kind)}: {{\n" + ",\n".join(lines) + "\n  }")
    (HERE / "inputs.json").write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")


def springs(random: np.random.Generator) -> dict[str, dict[str, object]]:
    """Springs over the whole supported range: n, sigma, rho and the degrees vary independently of each other."""
    ns = [0.01, 100.0, *np.geomspace(0.05, 20.0, SPRINGS - 2)]
    sigmas = [1000.0, 0.5, 0.5, *np.geomspace(0.52, 50.0, SPRINGS - 3)]
    saturations = np.geomspace(0.05, 1e4, SPRINGS)  # rho * range
    degrees = [(0, 0), (1, 0), (0, 2), (3, 2), (8, 6), (20, 20), (5, 0), (20, 1), (2, 12), (4, 4)]
    degrees += [(int(a), int(b)) for a, b in random.integers(0, 21, (SPRINGS - len(degrees), 2))]
    columns = zip(ns, random.permutation(sigmas), random.permutation(saturations), degrees, strict=True)
    return {f"{k:02}": spring(random, *row) for k, row in enumerate(columns)}


def spring(
    random: np.random.Generator, n: float, sigma: float, saturation: float, degrees: tuple[int, int]
) -> dict[str, object]:
    """One spring; FA is positive because the other coefficients, over the range, sum up to less than 1."""
    half = float(random.choice([1e-4, 0.02, 3.0]))
    low = float(random.choice([0.0, 0.05, -0.3])) - half
    offset = low + half if random.uniform() < 0.5 else _rounded(low + 2.0 * half * random.uniform())
    reach = max(offset - low, low + 2.0 * half - offset)
    force = _rounded(10.0 ** random.uniform(-2.0, 4.0))
    elastic = random.uniform(-1.0, 1.0, degrees[0] + 1) * 10.0 ** random.uniform(-1.0, 1.0)
    amplifier = random.uniform(-1.0, 1.0, degrees[1])
    amplifier *= 0.9 / max(1.0, np.abs(amplifier).sum())
    amplifier = amplifier[:MAXIMUM_AMPLIFIER_DEGREE]
    return {
        "kE": [_rounded(force * c / reach**i) for i, c in enumerate(elastic)],
        "kA": [1.0, *(_rounded(c / reach ** (i + 1)) for i, c in enumerate(amplifier))],
        "kappa_omega": force,
        "rho": _rounded(saturation / (2.0 * half)),
        "sigma": _rounded(sigma),
        "n": _rounded(n),
        "displacement_offset": offset,
        "displacement_min": low,
        "displacement_max": low + 2.0 * half,
    }


def paths(random: np.random.Generator) -> dict[str, list[int]]:
    """Paths in millionths of half the range from its middle; whole numbers, so that they are exact everywhere."""
    turns = random.integers(-LARGEST, LARGEST, 60)
    zigzag = turns.copy()  # every sample turns
    zigzag[0::2], zigzag[1::2] = -np.abs(zigzag[0::2]), np.abs(zigzag[1::2])
    steps = np.arange(300)
    loops = -600_000 + 4_000 * steps + 25_000 * np.array([0, 2, 1, -1])[steps % 4]
    small = np.cumsum(np.tile([1_100, -1_000], 300))
    tiny = np.cumsum(np.tile([2, -1], 300))
    reversals = np.concatenate([[0], 200_000 + small, 200_000 + small[-1] - tiny])
    dwells = np.repeat(random.integers(-LARGEST, LARGEST, 25), random.integers(1, 5, 25))
    outside = random.integers(-16 * LARGEST // 10, 16 * LARGEST // 10, 40)
    return {
        "sweep": _whole(LARGEST * np.sin(2.0 * np.pi * np.arange(241) / 96)),
        "zigzag": _whole(zigzag),
        "loops": _whole(np.concatenate([[0, LARGEST, -LARGEST], loops])),
        "reversals": _whole(reversals),
        "dwells": _whole(np.concatenate([np.repeat(dwells[:1], 3), dwells])),
        "outside": _whole(outside),
        "wander": _whole(np.clip(np.cumsum(random.normal(0.0, 1e5, 180)), -LARGEST, LARGEST)),
    }


def _rounded(value: float) -> float:
    return float(f"{value:.7g}")


def _whole(values: NDArray[np.float64] | NDArray[np.int64]) -> list[int]:
    return [round(float(value)) for value in values]


if __name__ == "__main__":
    main()
