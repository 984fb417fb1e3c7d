"""Many short responses of different springs in one call: python tests/benchmarks/bulk.py

1024 springs along a path of 1000 samples, on one core; each figure is the best of several, in processor time.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from strandspring import Spring, SpringParameters, responses

SPRING = Spring(SpringParameters((5.0, 3000.0, 2e4, 1e6), (1.0, 10.0, 100.0), 25.0, 400.0, 1.0, 0.5, 0.05, 0.03, 0.07))
PATH = 0.05 + 0.02 * np.sin(np.linspace(0.0, 6.0 * np.pi, 1000))
SPRINGS, ROUNDS = 1024, 3
BY = ("rho", "sigma", "n")
CASES: dict[str, dict[str, Any]] = {
    "force": {},
    "force, coarse": {"coarse": True},
    "force and gradients by rho, sigma, n": {"by": BY},
    "force and gradients, coarse": {"by": BY, "coarse": True},
}


def main() -> None:
    draw = np.random.default_rng(0)
    rates = {"rho": draw.uniform(300.0, 500.0, SPRINGS)}
    drawn = rates | {"n": draw.uniform(0.2, 2.0, SPRINGS), "sigma": draw.uniform(0.6, 2.0, SPRINGS)}
    responses(SPRING, PATH, {"rho": rates["rho"][:2]}, by=BY)
    for name, sets, options in (*((name, drawn, case) for name, case in CASES.items()), ("one n and sigma", rates, {})):
        times = []
        for _ in range(ROUNDS):
            begin = time.process_time()
            responses(SPRING, PATH, sets, workers=1, **options)
            times.append(time.process_time() - begin)
        print(f"{name}: {1e6 * min(times) / SPRINGS:.0f} us a spring")


if __name__ == "__main__":
    main()
