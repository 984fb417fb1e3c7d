"""The README's picture of the architecture is that of the code."""

from __future__ import annotations

import architecture


def test_picture_in_the_readme_is_drawn_from_the_imports() -> None:
    assert architecture.picture_in_readme() == architecture.picture(), "run python tests/helpers/architecture.py"


def test_arrows_have_no_cycle_and_reach_what_travels() -> None:
    arrows = architecture.arrows()
    rooms = {room for arrow in arrows for room in arrow}
    assert rooms == set(architecture.rooms())
    assert not [lower for upper, lower in arrows if upper == "core"]
