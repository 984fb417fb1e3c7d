"""Model files of springs with a second mechanism or branches, and what refuses such springs in one sentence."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from branched_springs import BASE, BRANCHED
from springs import EXAMPLES
from strandspring import ModelError, Record, Spring, SpringParameters, StrandspringError, info
from strandspring.core.law import SpringLaw
from strandspring.kernel.path import packed
from strandspring.loops.loop import relaxed_branches
from strandspring.model.modelfile import model_of_text, model_schema


@pytest.mark.parametrize("name", BRANCHED)
def test_a_saved_spring_is_loaded_as_it_was(name: str, tmp_path: Path) -> None:
    spring = Spring(BRANCHED[name], name)
    spring.save(tmp_path / "model.json")
    content = json.loads((tmp_path / "model.json").read_text(encoding="utf-8"))
    assert content["format_version"] == 4
    jsonschema.Draft202012Validator(model_schema()).validate(content)
    assert Spring.load(tmp_path / "model.json") == spring


@pytest.mark.parametrize("spring", [BASE, EXAMPLES["table"]])
def test_springs_without_them_may_be_files_of_any_version(spring: SpringParameters) -> None:
    content = json.loads(Spring(spring).model.to_json())
    assert not {"second", "branches"} & set(content["parameters"])
    for other in (1, 2, 3, 4):
        by_hand = model_of_text(json.dumps({**content, "format_version": other}), "model.json")
        assert by_hand.to_json() == Spring(spring).model.to_json()


@pytest.mark.parametrize("field", ["second", "branches"])
def test_version_1_has_none_of_them(field: str) -> None:
    content = json.loads(Spring(BRANCHED[field]).model.to_json())
    with pytest.raises(
        ModelError, match=f'"parameters.{field}" is for files from format_version 3 on, and this is one of'
    ):
        model_of_text(json.dumps({**content, "format_version": 1}), "model.json")


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        (("branches", 0, "time_constant"), -1.0, r"`branches\[0\].time_constant` must be within \[1e-09, 1e\+09\] s"),
        (("branches", 0, "viscosity"), 1.0, r"parameters.branches\[0\]: 'viscosity' is not a key here"),
        (("second", "n"), 0.0, r"`second.n` must be within \[0.01, 100\], got 0.0"),
        (("second", "kE"), [1.0], "parameters.second: 'kE' is not a key here"),
    ],
)
def test_bad_fields_are_named(place: tuple[str | int, ...], value: object, sentence: str) -> None:
    content = json.loads(Spring(BRANCHED["both"]).model.to_json())
    table = content["parameters"]
    for key in place[:-1]:
        table = table[key]
    table[place[-1]] = value
    with pytest.raises(ModelError, match=sentence):
        model_of_text(json.dumps(content), "model.json")


PATH = 0.01 * np.sin(np.linspace(0.0, 9.0, 200)) + 0.05


def test_a_prediction_with_branches_needs_times() -> None:
    time = np.linspace(0.0, 9.0, 200)
    spring = Spring(BRANCHED["branches"])
    record = Record(PATH, spring.response(PATH, 0.2, time), time)
    assert spring.predict(record).rmse < 1e-6 * np.ptp(record.force)  # omega_start is found to 1e-6
    with pytest.raises(StrandspringError, match=r"depends on the times of the displacements, and none are given"):
        spring.predict(Record(PATH, record.force))
    assert np.isfinite(Spring(BRANCHED["second"]).predict(record).rmse)


def test_a_system_of_the_fmu_rests_where_branches_have_relaxed(tmp_path: Path) -> None:
    files = [Spring(BRANCHED[name], "mount").export(tmp_path / name, ssp_mass=2.0) for name in ("second", "both")]
    values = []
    for (path,) in files:
        with zipfile.ZipFile(path) as archive:
            values.append(archive.read("resources/plant.ssv"))
    assert values[0] == values[1]


@pytest.mark.parametrize("name", ["second", "branches"])
def test_many_responses_at_once_refuse_it(name: str) -> None:
    with pytest.raises(StrandspringError, match=r"`second`|`branches`") as refused:
        Spring(BRANCHED[name]).responses(PATH)
    assert str(refused.value).count("; ") >= 1  # says what to do


def test_info_names_all_parts() -> None:
    text = Spring(BRANCHED["both"]).info().summary()
    assert "second mechanism: kappa_omega 9 N, rho 2500 1/m, sigma 0.8, n 1.7, FA degree 2" in text
    assert text.count("Maxwell branch: stiffness") == 3


def test_a_synthesized_record_is_the_response_at_its_times() -> None:
    spring = Spring(BRANCHED["both"])
    record = spring.synthesize(frequency=3.0)
    path, time = record.displacement, record.time
    assert record.force == pytest.approx(spring.response(path, time=time), rel=1e-12)
    slower = spring.synthesize(frequency=0.01)
    # The branch of 700 N/m and 30 ms follows 20 mm at 3 Hz, and hardly at 0.01 Hz.
    assert np.abs(slower.force - record.force).max() > 5.0


@pytest.mark.parametrize("name", ["second", "branches"])
def test_the_structure_of_the_kernel_that_has_no_room_for_them_refuses_it(name: str) -> None:
    with pytest.raises(StrandspringError, match=r"cannot take a spring with `(second|branches)`"):
        packed(BRANCHED[name])
    with pytest.raises(ValueError, match="must be without a second mechanism and branches"):
        SpringLaw(BRANCHED[name])


def test_figures_of_loops_say_that_branches_have_relaxed() -> None:
    said = {name: info(Spring(p)).cautions for name, p in BRANCHED.items()}
    slow = "Loops of the model are slow: its Maxwell branches have relaxed."
    assert {name: any(slow in caution for caution in cautions) for name, cautions in said.items()} == {
        name: bool(p.branches) for name, p in BRANCHED.items()
    }
    assert len(relaxed_branches(BRANCHED["both"])[0].split()) <= 25
