"""Many springs along many paths, against single calls, identities and differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from springs import EXAMPLES, along, fractions, omegas, springs
from strandspring import Spring, SpringParameters, responses

ALL = ("force", "stiffness", "absorbed_energy")
# Inner loops, beyond both ends of the range, ends of strokes only.
TURNS = [0.1, 0.9, 0.3, 0.6, -0.2, 1.2, -1.3, 0.4, -0.5, 0.95]


@settings(max_examples=40)
@given(springs(), st.lists(fractions(7, 7), min_size=3, max_size=3), st.lists(omegas(), min_size=3, max_size=3))
def test_rows_have_the_bits_of_single_calls(base: SpringParameters, places: Any, starts: list[float]) -> None:
    """Of many springs, each along its path, and of one spring along all paths."""
    paths, many = along(base, places), {}
    several = [replace(base, rho=f * base.rho, n=max(f * base.n, 0.05)) for f in (0.5, 0.8, 1.0)]
    sets = {name: np.array([getattr(spring, name) for spring in several]) for name in ("rho", "n")}
    many["springs"] = responses(Spring(base), paths, sets, omega_start=starts, quantities=ALL, workers=2)
    many["paths"] = Spring(base).responses(paths, omega_start=starts, quantities=ALL)
    for kind, found in many.items():
        for k, (path, start) in enumerate(zip(paths, starts, strict=True)):
            alone = Spring(several[k] if kind == "springs" else base)
            assert np.array_equal(found.force[k], alone.response(path, start))
            assert np.array_equal(found.stiffness[k], alone.stiffness(path, start))
            assert np.array_equal(found.absorbed_energy[k], alone.absorbed_energy(path, start))


@pytest.mark.parametrize("name", EXAMPLES)
def test_gradients_are_difference_quotients(name: str) -> None:
    """Of fourth order; 1e-6 of the largest value, as tables of neighbouring n and sigma differ by rounding."""
    p = replace(EXAMPLES[name], sigma=EXAMPLES[name].sigma + 0.1)  # off its bound
    path = along(p, TURNS)[None]
    found = responses(Spring(p), path, by="all", quantities=ALL, omega_start=0.3)
    for field in ("kappa_omega", "rho", "sigma", "n"):
        steps = np.array([-2.0, -1.0, 1.0, 2.0]) * 1e-4 * getattr(p, field)
        near = responses(Spring(p), path, {field: getattr(p, field) + steps}, quantities=ALL, omega_start=0.3)
        for quantity in ALL:
            at = near.values[quantity]
            quotient = (8.0 * (at[2] - at[1]) - (at[3] - at[0])) / (12.0 * steps[2])
            by = found.gradients[quantity][field][0]
            assert by == pytest.approx(quotient, abs=1e-6 * np.abs(at).max() / getattr(p, field)), (quantity, field)


def test_what_is_no_spring_is_left_out_where_that_is_asked_for() -> None:
    mount = Spring(EXAMPLES["wire_rope"])
    many = mount.responses(along(mount.parameters, TURNS), {"rho": [400.0, -1.0, 600.0]}, by=["n"], impossible="nan")
    assert many.possible.tolist() == [True, False, True]
    with pytest.raises(AttributeError, match=r"^stiffness was not computed; ask for it by `quantities`\.$"):
        _ = many.stiffness
    for rows in (many.force, many.gradients["force"]["n"]):
        assert np.isnan(rows).all(axis=1).tolist() == [False, True, False]
        assert np.isfinite(rows[[0, 2]]).all()
