"""The pictures of the README, drawn by the program from the bundled record: python tests/helpers/pictures.py"""

from __future__ import annotations

import tempfile
from pathlib import Path

from strandspring.cli.main import strandspring

PICTURES = Path(__file__).resolve().parents[2] / "models" / "pictures"
MASS = "0.02"  # kg, which rests on the hinge near the middle of its range


def draw(folder: Path) -> None:
    """Write `loop.svg` and `transmissibility.svg` into a folder."""
    from strandspring import bundled_record

    with tempfile.TemporaryDirectory() as place:
        model = str(Path(place) / "hinge.json")
        for command in (
            ["identify", str(bundled_record()), "--reverse", "displacement", "-o", model,
             "--figure", str(folder / "loop.svg")],
            ["isolate", model, "--mass", MASS, "--plot", str(folder / "transmissibility.svg")],
        ):  # fmt: skip
            strandspring.main(args=command, standalone_mode=False)


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    draw(PICTURES)
