"""The picture in ARCHITECTURE.md is that of the code, and the page speaks of every folder."""

from __future__ import annotations

import re
from pathlib import Path

import architecture

ROOT = Path(__file__).resolve().parents[2]


def test_picture_is_drawn_from_the_imports() -> None:
    assert architecture.picture_in_page() == architecture.picture(), "run python tests/helpers/architecture.py"


def test_arrows_have_no_cycle_and_reach_what_travels() -> None:
    arrows = architecture.arrows()
    rooms = {room for arrow in arrows for room in arrow}
    assert rooms == set(architecture.rooms())
    assert not [lower for upper, lower in arrows if upper == "core"]


def test_every_folder_has_its_words() -> None:
    words = architecture.PAGE.read_text(encoding="utf-8").split()
    assert [room for room in architecture.rooms() if f"**{room}**" not in words] == []


def test_files_of_tests_that_are_named_exist() -> None:
    folders = [ROOT / ".ci", ROOT / ".github", ROOT / "fmu_src"]
    files = [
        path for folder in folders for path in folder.rglob("*") if path.suffix in {"", ".md", ".py", ".h", ".yml"}
    ]
    for path in [*ROOT.glob("*.md"), *filter(Path.is_file, files)]:
        for name in re.findall(r"\btests/[\w/]+\.py\b", path.read_text()):
            assert (ROOT / name).exists(), f"{path.relative_to(ROOT)} names {name}"
