"""The paper, drawn: the campaign of its spring, pictures in the manner of its figures, and its tables.

python -m strandspring.examples.paper -o FOLDER. All of it is synthetic. The spring has the paper's size, motion and
forces (section 5), but its parameters are ours, since the paper gives none.
"""

from __future__ import annotations

from strandspring import Record, Spring, SpringParameters, synthesize

# Displacement is the compression of a spring of 176 mm: one core wire, layers of 3 and 6 wires of 1.5 mm.
SPRING = SpringParameters(
    kE=(252.0, 4.6e3, 3.2e4, 5e5), kA=(1.0, 12.0), kappa_omega=42.0, rho=300.0, sigma=1.2, n=0.8,
    displacement_offset=0.057, displacement_min=0.011, displacement_max=0.103,
)  # fmt: skip
PRE_DEFORMATION = 0.057  # m
NOISE = 0.01  # of the force; the paper's Table 2 leaves 1.2 %


def campaign() -> dict[str, Record]:
    """The records of section 5: three amplitudes at the lowest and the highest frequency, and one held out."""
    tests = {"slow": ((0.013, 0.024, 0.046), 0.13), "fast": ((0.013, 0.024, 0.046), 2.12), "held_out": ((0.035,), 1.0)}
    return {
        name: synthesize(
            Spring(SPRING), amplitudes, mean=PRE_DEFORMATION, samples=200, frequency=frequency, noise=NOISE, seed=seed
        )
        for seed, (name, (amplitudes, frequency)) in enumerate(tests.items())
    }
