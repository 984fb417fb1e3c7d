"""Cautions and effects of a rig in a model file are repeated wherever the model is used."""

from __future__ import annotations

from dataclasses import replace

import pytest

from strandspring import Spring, info, isolate, predict, study, synthesize
from strandspring.model.modelfile import ModelFile
from strandspring.model.stated_cautions import cautions_in_use
from synthetic import spring_of

FIT = {
    "outcomes": [
        {"name": "small_loops", "sentence": "The energy of small loops is undecided."},
        *({"name": "spikes", "sentence": f"Outliers ({name}.csv)."} for name in "ab"),
    ],
    "verdict": {"sentence": "usable: 4.7 % on held-out strokes", "error": 0.047, "plain": {}},
    "effects": {"viscosity": 12.0, "drift": 0.3},
}
MODEL = ModelFile("mount", spring_of(1.0, 1.0), fit=FIT)
SPRING = Spring.from_model(MODEL)


def test_a_record_beside_a_model_without_the_effects_of_its_rig_is_cautioned() -> None:
    record = synthesize(SPRING, samples=100)
    expected = "mount: drift, viscosity was removed from the records of the model, as an effect of the rig"
    assert any(sentence.startswith(expected) for sentence in predict(SPRING, record).cautions)
    assert any(sentence.startswith(expected) for sentence in info(SPRING, record).cautions)
    assert predict(Spring(spring_of(1.0, 1.0)), record).cautions == ()


def test_info_shows_what_the_identification_asked_to_be_careful_with() -> None:
    summary = info(SPRING).summary()
    assert "usable: 4.7 % on held-out strokes" in summary
    for sentence in ("The energy of small loops is undecided.", "Outliers (a.csv).", "Outliers (b.csv)."):
        assert f"Caution: Of the identification: {sentence}" in summary
    assert "removed from the records, as effects of the rig: drift, viscosity" in summary


def test_isolation_and_studies_say_which_cautions_a_model_has() -> None:
    mass = 5.0 / 9.81
    expected = "Caution: mount was identified with cautions (small_loops, spikes); see `strandspring info`."
    assert expected in isolate(SPRING, mass, points=4).summary()
    assert expected in study(SPRING, mass, draws=0, points=4).summary()


@pytest.mark.parametrize(
    "fit", [{}, {"outcomes": "none", "effects": [1]}, {"outcomes": [3, {"name": "x"}], "verdict": 1}]
)
def test_what_is_not_stated_is_no_caution(fit: dict[str, object]) -> None:
    assert list(cautions_in_use("mount", ModelFile("mount", spring_of(1.0, 1.0), fit=fit))) == []


def test_a_viscous_force_that_was_taken_out_asks_for_a_damper() -> None:
    assert "showed viscosity, removed from the model" in list(cautions_in_use("mount", MODEL))[-1]


def test_parameters_that_were_changed_by_hand_are_cautioned() -> None:
    spring = spring_of(1.0, 1.0)
    intervals = {"rho": [0.9 * spring.rho, 1.1 * spring.rho], "n": [None, 1.0], "sigma": [1.0, None]}
    as_identified = ModelFile("mount", spring, uncertainty={"interval_95": intervals})
    assert info(Spring.from_model(as_identified)).cautions == ()
    assert info(Spring.from_model(replace(as_identified, uncertainty={"interval_95": None}))).cautions == ()
    for change in ({"rho": 1.2 * spring.rho}, {"n": 1.01}, {"sigma": 0.99}):
        changed = replace(as_identified, parameters=replace(spring, **change))
        (caution,) = info(Spring.from_model(changed)).cautions
        assert f"{next(iter(change))} lies outside the 95 % interval" in caution
        (named,) = cautions_in_use("mount", changed)
        assert "parameters_changed" in named
