"""Many springs along many paths, against single calls, identities and differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from springs import EXAMPLES, FloatArray, along, fractions, omegas, springs
from strandspring import Responses, Spring, SpringParameters, responses

LAW = settings(max_examples=25)
ALL = ("force", "stiffness", "absorbed_energy")
# Inner loops, beyond both ends of the range, ends of strokes only.
TURNS = [0.1, 0.9, 0.3, 0.6, -0.2, 1.2, -1.3, 0.4, -0.5, 0.95]


def same_as_single_calls(many: Responses, row: int, spring: SpringParameters, path: FloatArray, start: float) -> bool:
    """Whether a row has the bits of the methods of `Spring`."""
    alone = Spring(spring)
    single = (alone.response(path, start), alone.stiffness(path, start), alone.absorbed_energy(path, start))
    rows = (many.force, many.stiffness, many.absorbed_energy)
    return all(np.array_equal(array[row], one) for array, one in zip(rows, single, strict=True))


@LAW
@given(springs(), fractions(), st.lists(st.floats(0.5, 1.0), min_size=1, max_size=4), omegas())
def test_many_springs_along_one_path(
    base: SpringParameters, places: list[float], factors: list[float], start: float
) -> None:
    path = along(base, places)
    several = [
        replace(base, rho=f * base.rho, kE=tuple(f * c for c in base.kE), n=max(f * base.n, 0.05)) for f in factors
    ]
    given_sets = {name: np.array([getattr(spring, name) for spring in several]) for name in ("rho", "kE", "n")}
    many = responses(Spring(base), path, given_sets, omega_start=start, quantities=ALL, workers=2)
    assert many.possible.all()
    assert all(same_as_single_calls(many, k, spring, path, start) for k, spring in enumerate(several))


@LAW
@given(springs(), st.lists(fractions(7, 7), min_size=1, max_size=4), st.data())
def test_one_spring_along_many_paths(spring: SpringParameters, places: list[list[float]], data: st.DataObject) -> None:
    paths = along(spring, places)
    starts = [data.draw(omegas()) for _ in paths]
    many = Spring(spring).responses(paths, omega_start=starts, quantities=ALL)
    assert all(same_as_single_calls(many, k, spring, paths[k], starts[k]) for k in range(len(paths)))


def test_what_is_no_spring_is_left_out_where_that_is_asked_for() -> None:
    mount = Spring(EXAMPLES["wire_rope"])
    many = mount.responses(along(mount.parameters, TURNS), {"rho": [400.0, -1.0, 600.0]}, by=["n"], impossible="nan")
    assert many.possible.tolist() == [True, False, True]
    with pytest.raises(AttributeError, match=r"^stiffness was not computed; ask for it by `quantities`\.$"):
        _ = many.stiffness
    for rows in (many.force, many.gradients["force"]["n"]):
        assert np.isnan(rows).all(axis=1).tolist() == [False, True, False]
        assert np.isfinite(rows[[0, 2]]).all()
