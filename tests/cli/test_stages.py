"""What an identification is doing is shown while it takes long."""

from __future__ import annotations

from strandspring import bundled_record, identify
from strandspring.identification.method import Stage, begin, heard_by


def test_stages_come_in_their_order() -> None:
    heard: list[Stage] = []
    with heard_by(heard.append):
        identify(bundled_record(), reverse="displacement")
        assert heard == [*Stage]
        heard.clear()
        identify(bundled_record(), reverse="displacement", method="two-stage")
        assert heard == [Stage.PREPARING, Stage.CHECKING]
    begin(Stage.REFINING)
    assert len(heard) == 2  # nobody listens any longer


def test_a_listener_goes_with_its_block() -> None:
    outer: list[Stage] = []
    inner: list[Stage] = []
    with heard_by(outer.append):
        with heard_by(inner.append):
            begin(Stage.SEARCHING)
        begin(Stage.REFINING)
    assert (outer, inner) == ([Stage.REFINING], [Stage.SEARCHING])
