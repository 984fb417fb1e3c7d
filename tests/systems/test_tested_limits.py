"""Limits that no load case tests, files without limits or load cases, and runs of which most draws are refused."""

from __future__ import annotations

import copy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from strandspring import isolate_system, simulate, study_system
from strandspring.errors import MountedSystemError
from strandspring.examples.system_models import SYSTEMS
from strandspring.vibration.description.named_files import FilesOfFolder
from strandspring.vibration.description.system_file import SystemFile, read_description, system_of_content
from strandspring.vibration.verdicts import answers

CRADLE = read_description(SYSTEMS / "gun_cradle.toml") | {"case": []}
ROUND = {"name": "round", "direction": "-x", "force": {"pulse": "half-sine", "peak": "15 kN", "duration": "4 ms"}}
SINE = {"name": "sine", "direction": "x", "sine": {"frequency": 8, "amplitude": "0.1 g", "duration": "2 s"}}
WIDE: dict[str, Any] = {
    "three_sigma": "1000 g", "rms_acceleration": "1000 g", "srs": {"levels": [[5, "1000 g"], [50, "1000 g"]]}
}  # fmt: skip


def described(cases: list[dict[str, Any]], **changes: Any) -> SystemFile:
    content = copy.deepcopy(CRADLE) | {"case": cases, "units": {"length": "mm"}} | changes
    return system_of_content(content, FilesOfFolder(SYSTEMS))


@pytest.mark.parametrize(
    ("case", "limits", "of_case", "overall"),
    [
        (ROUND, {"three_sigma"}, "no limits", "not tested"),
        (ROUND, {"rms_acceleration", "srs"}, "pass", "not tested"),
        (SINE, {"srs"}, "no limits", "not tested"),
        (SINE, {"three_sigma", "rms_acceleration"}, "pass", "pass"),
        (ROUND, {"srs"}, "pass", "pass"),
        (ROUND, set(), "no limits", "no limits"),
    ],
)
def test_only_limits_that_a_case_tests_are_kept(
    tmp_path: Path, case: dict[str, Any], limits: set[str], of_case: str, overall: str
) -> None:
    file = described([case], limits={name: WIDE[name] for name in limits})
    found = simulate(file, candidates="five springs", draws=16, workers=1)
    assert found.verdicts().to_numpy().tolist() == [[of_case, overall]]
    json, frame, text = found.as_json(), found.to_frame(), found.summary()
    assert json["candidates"][0]["verdict"] == overall
    assert set(json["tested"]) == limits
    untested = frame[frame["verdict"] == "not tested"]
    left = {kind for kind, names in json["tested"].items() if not names}
    assert len(untested) == len(left)
    assert all(names in ((), (case["name"],)) for names in json["tested"].values())
    found.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert ("Within all limits in all load cases" in page) == (overall == "pass")
    assert ("is not tested" in text) == ("is not tested" in page) == ("not tested: " in text) == bool(left)


def test_a_spring_beyond_its_range_is_outside_without_limits() -> None:
    strong = copy.deepcopy(ROUND) | {"force": ROUND["force"] | {"peak": "30 kN"}}  # type: ignore[operator]
    found = simulate(described([strong], limits={}), candidates="five springs", draws=16, courses=False)
    assert found.verdicts().to_numpy().tolist() == [["outside", "outside"]]


def test_a_study_says_what_is_not_tested(tmp_path: Path) -> None:
    text = (
        (SYSTEMS / "gun_cradle.toml").read_text(encoding="utf-8").replace("[limits]", '[limits]\nthree_sigma = "9 g"')
    )
    (tmp_path / "gun.toml").write_text(text, encoding="utf-8")
    (tmp_path / "recoil_spring.json").write_bytes((SYSTEMS / "recoil_spring.json").read_bytes())
    found = study_system(
        tmp_path / "gun.toml", {"body.1.mass": "100%"}, cases="one round", candidates="five springs", draws=16
    )
    assert found.quantiles()["verdict"].tolist() == ["not tested"]
    assert "The limit of 3 sigma acceleration is not tested" in found.summary()


def test_a_file_without_a_load_case_has_no_verdict(tmp_path: Path) -> None:
    file = described([])
    with pytest.raises(
        MountedSystemError, match=r"^case: there is none, and without one no verdict; add a \[\[case\]\]\.$"
    ):
        simulate(file)
    path = tmp_path / "gun.toml"
    text = (SYSTEMS / "gun_cradle.toml").read_text(encoding="utf-8")
    path.write_text(text.partition("[[case]]")[0], encoding="utf-8")
    (tmp_path / "recoil_spring.json").write_bytes((SYSTEMS / "recoil_spring.json").read_bytes())
    for verdict in (lambda: simulate(path), lambda: study_system(path, {"body.1.mass": "100%"})):
        with pytest.raises(MountedSystemError, match=r"gun.toml, case: there is none"):
            verdict()
    assert isolate_system(path, directions=["x"], points=4).candidates
    with pytest.raises(MountedSystemError, match="`cases` and `candidates` must name one or more"):
        simulate(described([ROUND]), cases=[])


def test_a_case_of_which_most_draws_are_refused_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Found with 20 t on mounts for 20 kg, where it hangs on the last digits of the springs."""
    refused = SimpleNamespace(refused=12, count=16, reason="drop: the energy balance is off")
    monkeypatch.setattr(answers, "drawn_case", lambda *_: refused)
    file = system_of_content(read_description(SYSTEMS / "electronics_box.toml"), FilesOfFolder(SYSTEMS))
    with pytest.raises(MountedSystemError, match=r"^12 of 16 draws are refused, most often: drop: "):
        simulate(file, cases="drop", candidates="standard", draws=16)
