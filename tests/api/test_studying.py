"""`study` in Python: the same engine as the command, with tables."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from springs import MOUNT
from strandspring import ModelError, Spring, StrandspringError, study
from strandspring.campaigns.studies.definition import RunRow
from strandspring.cli.main import main
from strandspring.model.modelfile import ModelFile
from studies import SPRING, UNCERTAINTY

CHEAP = {"base_displacement": 1e-4, "points": 6}


def test_rows_are_those_of_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    model = ModelFile("mount", SPRING, uncertainty=UNCERTAINTY)
    Spring.from_model(model).save("mount.json")
    options = ["--base-displacement", "0.1", "--points", "6", "--draws", "3", "--workers", "1"]
    main(["study", "mount.json", "--mass", "4", "--mass", "400", *options, "-o", "command.csv"])
    result = study(model, [4.0, 400.0], draws=3, output="python.csv", **CHEAP)
    assert Path("python.csv").read_bytes() == Path("command.csv").read_bytes()
    assert sorted(path.name for path in Path().iterdir()) == ["command.csv", "mount.json", "python.csv"]
    frame = result.to_frame()
    assert frame.columns.tolist() == list(RunRow.__dataclass_fields__)
    kept = study("mount.json", [4.0, 400.0], draws=3, **CHEAP)
    assert kept.output is None
    pd.testing.assert_frame_equal(kept.to_frame(), frame, check_exact=True)
    assert (frame["outcome"] == "done").sum() == 3
    quantiles = result.quantiles()
    assert quantiles["refused"].tolist() == [0, 3]
    assert quantiles["frequency_median"][0] == frame["frequency"].median()
    assert "3 of 3 refused, most often: The static load" in result.summary()
    assert "<table" in result._repr_html_()


def test_the_default_level_is_chosen_from_the_smallest_mass() -> None:
    result = study(Spring(MOUNT), [6.0, 5.0], draws=0, points=6)
    (level,) = result.study.levels
    assert level == pytest.approx(0.01 * 0.03, rel=0.01)  # some 30 mm to the nearer end


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"mass": []}, "must hold at least one mass"),
        ({"workers": 2, "scheduler": "tcp://localhost:1"}, "`workers` and `scheduler` exclude each other"),
        ({"stiffness": 0.0}, "Every stiffness factor must be within"),
        ({"force": 1.0}, "exclude each other"),
    ],
)
def test_what_is_out_of_bounds_is_refused(options: dict[str, object], told: str) -> None:
    given: dict[str, object] = {"mass": 5.0, "draws": 0, **options}
    if "mass" not in options:
        given |= CHEAP
    with pytest.raises(StrandspringError, match=told):
        study(Spring(MOUNT), **given)  # type: ignore[arg-type]


def test_draws_need_an_uncertainty() -> None:
    with pytest.raises(ModelError, match='mount: field "uncertainty" holds no standard errors'):
        study(Spring(MOUNT, "mount"), 5.0, **CHEAP)


def test_the_model_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "mount.json"
    Spring(MOUNT, "mount").save(path)
    with pytest.raises(StrandspringError, match="would overwrite the model; write elsewhere"):
        study(path, 5.0, draws=0, output=path, **CHEAP)
