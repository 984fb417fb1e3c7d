"""The model file: stable bytes, refusals of one sentence, the published schema, and writing all or nothing."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from springs import EXAMPLES, TABLE, springs
from strandspring import ModelError, Spring, SpringParameters, StrandspringError
from strandspring.core.parameters import (
    FORCE_RANGE,
    KNOTS,
    LARGEST_DISPLACEMENT,
    MAXIMUM_AMPLIFIER_DEGREE,
    MAXIMUM_DEGREE,
    N_RANGE,
    SIGMA_RANGE,
    problems,
)
from strandspring.ground.quoting import shown
from strandspring.model.file_tables import Certificate, Start
from strandspring.model.modelfile import MAXIMUM_BYTES, ModelFile, load_model, save_model, saved_model
from strandspring.model.names import NAME_PATTERN

pytestmark = pytest.mark.long

# Files are rewritten example by example, so that one folder per test is enough.
LAW = settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])

SCHEMA = Path(__file__).resolve().parents[1] / "models/strandspring-model.schema.json"
PARAMETERS = EXAMPLES["wire_rope"]
MODEL = ModelFile(
    "wire_rope",
    PARAMETERS,
    "Isolator 7, größer als µ <&> ✓",
    fit={"rmse": 2.5337, "rnl": 0.98979},
    provenance={"records": [{"path": "a.csv", "sha256": "0" * 64}], "options": None},
    start=Start(displacement=0.01, omega=-0.9, at_rest=True),
    certificate=Certificate(force_min=-80.0, force_max=90.0, margin=42.5),
)
Content = dict[str, Any]


@pytest.fixture
def content() -> Content:
    """A valid model file as JSON gives it."""
    return json.loads(MODEL.to_json())


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "model.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    return path


def refusal(path: Path) -> str:
    """The sentence with which a file is refused, after the checks that hold for every one."""
    with pytest.raises(ModelError) as refused:
        load_model(path)
    sentence = str(refused.value)
    assert sentence.startswith(str(path))
    assert sentence.endswith(".")
    assert "\n" not in sentence
    assert "pydantic" not in sentence
    # A sentence, not a dump: room for the path, a field and 60 characters of its value.
    assert len(sentence) <= len(str(path)) + 300
    return sentence.removeprefix(str(path))


@pytest.mark.parametrize("parameters", EXAMPLES.values(), ids=EXAMPLES)
def test_saving_and_loading_gives_the_same_spring_and_bytes(tmp_path: Path, parameters: SpringParameters) -> None:
    first, second, third = (tmp_path / name for name in ("1.json", "2.json", "3.json"))
    spring = Spring(parameters, "example", "text")
    spring.save(first)
    spring.save(second)
    loaded = Spring.load(first)
    loaded.save(third)
    assert loaded.parameters == parameters
    assert loaded.model == spring.model
    assert first.read_bytes() == second.read_bytes() == third.read_bytes()
    assert first.read_bytes().endswith(b"}\n")
    assert b"\r" not in first.read_bytes()


@LAW
@given(parameters=springs())
def test_no_bit_of_a_parameter_is_lost(tmp_path: Path, parameters: SpringParameters) -> None:
    path = tmp_path / "model.json"
    save_model(path, ModelFile("any", parameters))
    assert load_model(path).parameters == parameters


def test_all_of_a_model_file_survives(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    save_model(path, MODEL)
    assert load_model(path) == MODEL
    written_content = json.loads(path.read_text(encoding="utf-8"))
    assert list(written_content) == [
        "format", "format_version", "name", "description", "parameters", "start", "certificate", "fit",
        "uncertainty", "provenance",
    ]  # fmt: skip
    assert list(written_content["parameters"]) == [
        "kE", "kA", "kappa_omega", "rho", "sigma", "n", "displacement_offset", "displacement_min", "displacement_max"
    ]  # fmt: skip
    assert "größer als µ <&> ✓" in path.read_text(encoding="utf-8")  # readable, not escaped


def test_a_file_written_by_hand_needs_the_parameters_only(tmp_path: Path, content: Content) -> None:
    by_hand = {key: content[key] for key in ("format", "format_version", "name", "parameters")}
    by_hand["parameters"] |= {"kA": [1], "displacement_offset": 0, "displacement_min": -1, "displacement_max": 1}
    model = load_model(written(tmp_path, json.dumps(by_hand)))
    assert model.parameters.kA == (1.0,)
    assert model.description == ""
    assert model.fit == model.uncertainty == model.provenance == {}
    assert model.start is model.certificate is None
    assert set(json.loads(model.to_json())) == {*by_hand, "description", "fit", "uncertainty", "provenance"}


PARAMETER_NAMES = list(PARAMETERS.as_dict())
POSITIVE = ["kappa_omega", "rho", "sigma", "n"]
SCALARS = [name for name in PARAMETER_NAMES if name not in {"kE", "kA"}]


@pytest.mark.parametrize("field", PARAMETER_NAMES)
def test_a_missing_parameter_is_named(tmp_path: Path, content: Content, field: str) -> None:
    del content["parameters"][field]
    assert refusal(written(tmp_path, json.dumps(content))) == f": parameters.{field}: is missing; add it."


@pytest.mark.parametrize("field", ["name", "parameters"])
def test_a_missing_field_is_named(tmp_path: Path, content: Content, field: str) -> None:
    del content[field]
    assert refusal(written(tmp_path, json.dumps(content))) == f": {field}: is missing; add it."


def test_unknown_fields_are_named(tmp_path: Path, content: Content) -> None:
    wrong = copy.deepcopy(content)
    wrong["colour"] = "red"
    assert refusal(written(tmp_path, json.dumps(wrong))).startswith(
        ": 'colour' is not a key here; use one of 'format', "
    )
    content["parameters"]["kappa"] = 1.0
    expected = ": parameters: 'kappa' is not a key here; use 'kappa_omega' if you mean that."
    assert refusal(written(tmp_path, json.dumps(content))) == expected


@pytest.mark.parametrize("field", SCALARS)
@pytest.mark.parametrize("value", ["1.0", True, None, [1.0], {}], ids=repr)
def test_a_parameter_that_is_no_number_is_named(tmp_path: Path, content: Content, field: str, value: object) -> None:
    content["parameters"][field] = value
    remedy = "write 1" if isinstance(value, str) else "correct it, or identify the spring again"
    expected = f": parameters.{field}: must be a number, got {shown(value)}; {remedy}."
    assert refusal(written(tmp_path, json.dumps(content))) == expected


@pytest.mark.parametrize("field", ["kE", "kA"])
@pytest.mark.parametrize("value", ["1.0", True, None, 1.0, [], [1.0] * 22, ["1.0"], [True], [[1.0]], [None]], ids=repr)
def test_coefficients_that_are_none_are_named(tmp_path: Path, content: Content, field: str, value: object) -> None:
    content["parameters"][field] = value
    assert refusal(written(tmp_path, json.dumps(content))).startswith(f": parameters.{field}")


@pytest.mark.parametrize("field", POSITIVE)
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_a_parameter_that_is_not_positive_is_named(tmp_path: Path, content: Content, field: str, value: float) -> None:
    content["parameters"][field] = value
    sentence = refusal(written(tmp_path, json.dumps(content)))
    assert sentence.startswith(f": `{field}` must be ")
    assert sentence.endswith(f"got {value}; correct the parameters or identify again.")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"kA": [2.0]}, "`kA[0]` must be 1 (kappa_omega carries the scale), got 2.0"),
        ({"kA": [1.0, 50.0]}, "the amplifier FA (coefficients `kA`) must be > 0 over the identified range"),
        ({"displacement_min": 0.08}, "`displacement_min` must be below `displacement_max` [m], got 0.08 and 0.07"),
        ({"displacement_offset": 0.0}, "`displacement_offset` must lie between"),
    ],
)
def test_springs_that_are_not_possible_are_refused(
    tmp_path: Path, content: Content, change: Content, said: str
) -> None:
    content["parameters"] |= change
    sentence = refusal(written(tmp_path, json.dumps(content)))
    assert sentence.startswith(f": {said}")
    assert sentence.endswith("; correct the parameters or identify again.")


@pytest.mark.parametrize("field", SCALARS)
@pytest.mark.parametrize("literal", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "1" * 400])
def test_numbers_that_are_not_finite_are_refused(tmp_path: Path, content: Content, field: str, literal: str) -> None:
    content["parameters"][field] = "LITERAL"
    sentence = refusal(written(tmp_path, json.dumps(content).replace('"LITERAL"', literal)))
    assert "finite" in sentence
    assert literal[:40] in sentence


def test_an_integer_of_thousands_of_digits_is_refused(tmp_path: Path, content: Content) -> None:
    content["parameters"]["rho"] = "LITERAL"
    sentence = refusal(written(tmp_path, json.dumps(content).replace('"LITERAL"', "1" * 5000)))
    assert "numbers must be finite, got 111" in sentence
    assert len(sentence) < 300


@pytest.mark.parametrize("field", ["name", "parameters.rho"])
def test_a_field_given_twice_is_refused(tmp_path: Path, content: Content, field: str) -> None:
    name = field.rpartition(".")[2]
    text = json.dumps(content).replace(f'"{name}":', f'"{name}": 1, "{name}":')
    assert refusal(written(tmp_path, text)) == (
        f': not a valid model file (field "{name}" is given twice); correct it, or give a model file written by '
        "`strandspring identify`."
    )


@pytest.mark.parametrize(
    "text", ["", "{", "[1,", "// comment\n{}", "displacement,force\n1,2\n", "\ufeff\ufeff{}", "{'a': 1}"]
)
def test_text_that_is_not_json_is_refused_with_its_line(tmp_path: Path, text: str) -> None:
    sentence = refusal(written(tmp_path, text))
    assert sentence.startswith(", line 1: not valid JSON (")
    assert sentence.endswith("); give a model file written by `strandspring identify`.")


@pytest.mark.parametrize("text", ["null", "[]", "1.5", '"text"', "{}", '{"format": "other"}', '{"format": ["x"]}'])
def test_json_of_something_else_is_refused(tmp_path: Path, text: str) -> None:
    assert refusal(written(tmp_path, text)) == (
        ': field "format" must be "strandspring-model"; give a model file written by `strandspring identify`.'
    )


@pytest.mark.parametrize("version", [0, -1, "1", None, [1]], ids=repr)
def test_another_format_version_is_refused(tmp_path: Path, content: Content, version: object) -> None:
    content["format_version"] = version
    sentence = refusal(written(tmp_path, json.dumps(content)))
    assert sentence.startswith(": format_version: must be ")
    assert f", got {shown(version)}; " in sentence


@pytest.mark.parametrize("version", [5, 10**30])
def test_a_newer_format_version_asks_for_an_upgrade(tmp_path: Path, content: Content, version: int) -> None:
    # A newer file may hold fields that this version does not know.
    content |= {"format_version": version, "temperature": 20.0}
    sentence = refusal(written(tmp_path, json.dumps(content)))
    assert "newer strandspring" in sentence
    assert sentence.endswith("upgrade strandspring.")


def test_bytes_that_are_not_text_are_refused(tmp_path: Path, content: Content) -> None:
    for data in (b"\xff\xfe\x00\x01", json.dumps(content).encode("utf-16"), b'{"name": "\xe9"}'):
        assert refusal(written(tmp_path, data)) == ": is not UTF-8 text; give the path of a model file (JSON)."


@pytest.mark.parametrize("depth", [300, 100_000])
def test_deep_nesting_is_refused(tmp_path: Path, content: Content, depth: int) -> None:
    text = json.dumps(content).replace('"uncertainty": {}', f'"uncertainty": {{"a": {"[" * depth}{"]" * depth}}}')
    assert "nested more than 200 levels deep" in refusal(written(tmp_path, text))


def test_what_is_nested_too_deeply_for_a_file_is_refused_before(tmp_path: Path) -> None:
    deep: Any = 1.0
    for _ in range(190):
        deep = [deep]
    save_model(tmp_path / "model.json", ModelFile("a", PARAMETERS, fit={"a": deep}))
    assert load_model(tmp_path / "model.json").fit == {"a": deep}
    for _ in range(20):
        deep = [deep]
    with pytest.raises(ModelError, match="fit"):
        ModelFile("a", PARAMETERS, fit={"a": deep})


def test_directories_and_missing_files_are_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path) == ": is a folder; give the path of a model file (JSON)."
    assert refusal(tmp_path / "missing.json") == ": no such file; check the path."
    (tmp_path / "file").write_text("x", encoding="utf-8")
    assert refusal(tmp_path / "file" / "model.json").startswith(": cannot be read (")
    assert refusal(tmp_path / ("x" * 300)).startswith(": cannot be read (")


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    path = written(tmp_path, "{}")
    os.truncate(path, MAXIMUM_BYTES + 1)
    assert refusal(path).startswith(f": has {MAXIMUM_BYTES + 1} bytes, and a model file (JSON) may have at most ")


BAD_NAMES = [
    "", "../x", "a/b", "a\\b", "a b", "a.b", "a-b", "1a", "_a", "größe", "<xml/>", "a&b", 'a"b', "a\n", "a\0", "a" * 65,
    "con", "NUL", "Aux", "prn", "com1", "LPT9",
]  # fmt: skip


@pytest.mark.parametrize("name", BAD_NAMES, ids=repr)
def test_a_name_that_is_no_identifier_is_refused(tmp_path: Path, content: Content, name: str) -> None:
    content["name"] = name
    sentence = refusal(written(tmp_path, json.dumps(content)))
    assert "name must be a letter followed by at most 63 letters, digits or underscores" in sentence
    assert repr(name[:60])[:-1] in sentence
    with pytest.raises(ModelError, match="name must be a letter followed by"):
        Spring(PARAMETERS, name)


@pytest.mark.parametrize("name", [7, None, ["a"], {"a": 1}, True], ids=repr)
def test_a_name_that_is_no_text_is_refused(tmp_path: Path, content: Content, name: object) -> None:
    content["name"] = name
    assert refusal(written(tmp_path, json.dumps(content))).startswith(": name: must be text")


@pytest.mark.parametrize("name", ["a", "Z9_", "a" * 64, "console", "com10", "nul_"])
def test_identifiers_are_allowed(name: str) -> None:
    assert ModelFile(name, PARAMETERS).name == name


@pytest.mark.parametrize("character", ["\0", "\x08", "\x0b", "\x1b", "\x1f", "\ufffe", "\uffff"], ids=ascii)
def test_a_description_with_control_characters_is_refused(tmp_path: Path, content: Content, character: str) -> None:
    content["description"] = f"a{character}b"
    sentence = refusal(written(tmp_path, json.dumps(content)))
    assert sentence.startswith(": description: must not contain control characters, got ")
    with pytest.raises(ModelError, match="control characters"):
        Spring(PARAMETERS, "name", f"a{character}b")


def test_half_a_surrogate_pair_is_refused(tmp_path: Path, content: Content) -> None:
    content["description"] = "a\ud800b"
    refusal(written(tmp_path, json.dumps(content)))
    with pytest.raises(ModelError, match="description"):
        Spring(PARAMETERS, "name", "a\ud800b")


def test_a_description_may_have_lines_and_2000_characters(tmp_path: Path, content: Content) -> None:
    content["description"] = "two\nlines\tand a tab"
    assert load_model(written(tmp_path, json.dumps(content))).description == "two\nlines\tand a tab"
    content["description"] = "x" * 2000
    load_model(written(tmp_path, json.dumps(content)))
    content["description"] = "x" * 2001
    assert refusal(written(tmp_path, json.dumps(content))).startswith(
        ": description: must have at most 2000 characters"
    )


@pytest.mark.parametrize("field", ["fit", "uncertainty", "provenance"])
@pytest.mark.parametrize("value", [None, [], "text", 1.0], ids=repr)
def test_figures_that_are_no_object_are_refused(tmp_path: Path, content: Content, field: str, value: object) -> None:
    content[field] = value
    assert refusal(written(tmp_path, json.dumps(content))).startswith(f": {field}: must be a table of keys")


json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=True, allow_infinity=True)
    | st.text(st.characters(blacklist_categories=["Cs"]), max_size=8),
    lambda children: st.lists(children, max_size=3) | st.dictionaries(st.text(max_size=4), children, max_size=3),
    max_leaves=6,
)


def loads_or_is_refused(path: Path) -> None:
    outcome: ModelFile | str
    try:
        outcome = load_model(path)
    except ModelError as refused:
        outcome = str(refused)
    if isinstance(outcome, ModelFile):
        assert problems(outcome.parameters) == []
    else:
        assert outcome.startswith(str(path))


@LAW
@given(st.data())
def test_any_value_in_any_field_is_loaded_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    content = json.loads(data.draw(st.sampled_from([MODEL, ModelFile("table", TABLE)])).to_json())
    for _ in range(data.draw(st.integers(1, 2))):
        owner = content.get(data.draw(st.sampled_from(["parameters", "start", "certificate", None])), content)
        if not isinstance(owner, dict) or not owner:
            break
        field = data.draw(st.sampled_from(sorted(owner)))
        owner[field] = data.draw(json_values)
    loads_or_is_refused(written(tmp_path, json.dumps(content)))


@LAW
@given(st.data())
def test_any_damage_to_the_bytes_is_loaded_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    save_model(tmp_path / "good.json", MODEL)
    damaged = bytearray((tmp_path / "good.json").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(damaged)))
        length = data.draw(st.integers(0, 5))
        damaged[at : at + length] = data.draw(
            st.binary(max_size=5) | st.sampled_from([b'"', b"{", b"}", b",", b"9", b"-"])
        )
    loads_or_is_refused(written(tmp_path, bytes(damaged)))


def checker() -> jsonschema.Draft202012Validator:
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_the_schema_accepts_saved_files(tmp_path: Path) -> None:
    for name, parameters in EXAMPLES.items():
        Spring(parameters, name).save(tmp_path / "model.json")
        checker().validate(json.loads((tmp_path / "model.json").read_text(encoding="utf-8")))
    checker().validate(json.loads(MODEL.to_json()))
    rounded = replace(MODEL, uncertainty={"correlation": {"rho,n": 1.0, "sigma,n": None}})
    checker().validate(json.loads(rounded.to_json()))
    checker().validate(json.loads((SCHEMA.parent / "rubber_hinge.json").read_text(encoding="utf-8")))


def test_the_schema_has_the_fields_and_limits_of_the_code() -> None:
    schema = checker().schema
    assert list(schema["properties"]) == list(json.loads(MODEL.to_json()))
    assert schema["properties"]["name"]["pattern"] == NAME_PATTERN
    parameters = schema["$defs"]["Parameters"]
    assert [name for name in parameters["properties"] if name not in ("second", "branches")] == parameters["required"]
    assert set(parameters["required"]) == set(PARAMETER_NAMES)
    for name, limits in (("sigma", SIGMA_RANGE), ("n", N_RANGE)):
        assert (parameters["properties"][name]["minimum"], parameters["properties"][name]["maximum"]) == limits
    assert parameters["properties"]["rho"]["exclusiveMinimum"] == 0.0
    of_lengths = (-LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT)
    lengths = dict.fromkeys(("displacement_offset", "displacement_min", "displacement_max"), of_lengths)
    for name, limits in {"kappa_omega": FORCE_RANGE, **lengths}.items():
        assert (parameters["properties"][name]["minimum"], parameters["properties"][name]["maximum"]) == limits
    for name, degree in {"kE": MAXIMUM_DEGREE, "kA": MAXIMUM_AMPLIFIER_DEGREE}.items():
        assert parameters["properties"][name]["maxItems"] == degree + 1
    table = schema["$defs"]["TableParameters"]
    assert [name for name in table["properties"] if name not in ("second", "branches")] == table["required"]
    assert set(table["required"]) == set(TABLE.as_dict())
    for name in ("FE_knots", "FE_forces"):
        assert (table["properties"][name]["minItems"], table["properties"][name]["maxItems"]) == KNOTS
    assert [table["properties"][name] for name in SCALARS] == [parameters["properties"][name] for name in SCALARS]


WRONG: dict[str, Callable[[Content], object]] = {
    "another format": lambda c: c.update(format="other"),
    "a start without omega": lambda c: c["start"].pop("omega"),
    "a start beyond saturation": lambda c: c["start"].update(omega=-1.01),
    "a start far away": lambda c: c["start"].update(displacement=1.1e9),
    "a start neither at rest nor not": lambda c: c["start"].update(at_rest=1),
    "more than a start": lambda c: c["start"].update(velocity=0.0),
    "a negative margin": lambda c: c["certificate"].update(margin=-1.0),
    "another version": lambda c: c.update(format_version=0),
    "unknown field": lambda c: c.update(colour="red"),
    "unknown parameter": lambda c: c["parameters"].update(kappa=1.0),
    "no name": lambda c: c.pop("name"),
    "no parameters": lambda c: c.pop("parameters"),
    "no rho": lambda c: c["parameters"].pop("rho"),
    "name with a path": lambda c: c.update(name="../x"),
    "empty name": lambda c: c.update(name=""),
    "text for a number": lambda c: c["parameters"].update(rho="1"),
    "truth for a number": lambda c: c["parameters"].update(rho=True),
    "negative rho": lambda c: c["parameters"].update(rho=-1.0),
    "no friction": lambda c: c["parameters"].update(kappa_omega=0.0),
    "small sigma": lambda c: c["parameters"].update(sigma=0.4),
    "large sigma": lambda c: c["parameters"].update(sigma=1001.0),
    "small n": lambda c: c["parameters"].update(n=0.0),
    "no coefficients": lambda c: c["parameters"].update(kE=[]),
    "too many coefficients": lambda c: c["parameters"].update(kA=[1.0] * 22),
    "text as coefficient": lambda c: c["parameters"].update(kE=["1"]),
    "long description": lambda c: c.update(description="x" * 2001),
    "list as fit": lambda c: c.update(fit=[]),
}


@pytest.mark.parametrize("spoil", WRONG.values(), ids=WRONG)
def test_the_schema_refuses_what_loading_refuses(
    tmp_path: Path, content: Content, spoil: Callable[[Content], object]
) -> None:
    assert checker().is_valid(content)
    spoil(content)
    assert not checker().is_valid(content)
    refusal(written(tmp_path, json.dumps(content)))


BEYOND_ONE_FIELD: dict[str, tuple[Callable[[Content], object], str]] = {
    "a start in an older file": (
        lambda c: c.update(format_version=3),
        'field "start" is for files from format_version 4 on, and this is one of version 3; write 4 there',
    ),
    "a certificate in an older file": (
        lambda c: (c.pop("start"), c.update(format_version=1)),
        'field "certificate" is for files from format_version 4 on, and this is one of version 1',
    ),
    "a start of another spring": (
        lambda c: c["start"].update(second_omega=0.5),
        "start.second_omega: must be given where there is a second mechanism only, got 0.5",
    ),
    "a start with a branch": (
        lambda c: c["start"].update(branch_forces=[0.0]),
        "start.branch_forces: must have 0 numbers",
    ),
    "a range turned round": (
        lambda c: c["certificate"].update(force_min=91.0),
        "certificate: `force_min` must be at most `force_max`, got 91 and 90",
    ),
}


@pytest.mark.parametrize(("spoil", "sentence"), BEYOND_ONE_FIELD.values(), ids=BEYOND_ONE_FIELD)
def test_fields_that_do_not_fit_together_are_refused(
    tmp_path: Path, content: Content, spoil: Callable[[Content], object], sentence: str
) -> None:
    spoil(content)
    assert sentence in refusal(written(tmp_path, json.dumps(content)))


WRONG_TABLES: dict[str, tuple[Callable[[Content], object], str]] = {
    "both": (
        lambda c: c["parameters"].update(kE=[0.0, 1.0]),
        "parameters: 'kE' is not a key here; use one of 'kA', 'kappa_omega', 'rho', 'sigma', 'n', "
        "'displacement_offset', 'displacement_min', 'displacement_max', 'second', 'branches', 'FE_knots', 'FE_forces'.",
    ),
    "no forces": (
        lambda c: c["parameters"].pop("FE_forces"),
        "parameters.FE_forces: is missing; add it.",
    ),
    "few knots": (
        lambda c: c["parameters"].update(FE_knots=[0, 1]),
        "parameters.FE_knots: must have at least 7 entries, got 2; correct it, or identify the spring again.",
    ),
    "text as force": (
        lambda c: c["parameters"].update(FE_forces=["1"] * 7),
        "parameters.FE_forces[0]: must be a number, got '1'; write 1.",
    ),
}


@pytest.mark.parametrize(("spoil", "expected"), WRONG_TABLES.values(), ids=WRONG_TABLES)
def test_what_is_wrong_with_a_table_is_refused_by_schema_and_code(
    tmp_path: Path, spoil: Callable[[Content], object], expected: str
) -> None:
    content = json.loads(ModelFile("table", TABLE).to_json())
    assert checker().is_valid(content)
    spoil(content)
    assert not checker().is_valid(content)
    assert refusal(written(tmp_path, json.dumps(content))) == f": {expected}"


def test_a_force_too_few_is_named(tmp_path: Path) -> None:
    content = json.loads(ModelFile("table", TABLE).to_json())
    content["parameters"]["FE_forces"].pop()
    assert refusal(written(tmp_path, json.dumps(content))) == (
        ": `FE_forces` must have one force for each of the 10 knots, got 9; correct the parameters or identify again."
    )


class Failure:
    """Stands in for a method of Path when the disk fails."""

    def __call__(self, *_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")


@pytest.mark.parametrize("step", ["write_bytes", "replace"])
def test_a_write_that_fails_leaves_the_old_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    path = tmp_path / "model.json"
    save_model(path, MODEL)
    before = path.read_bytes()
    with monkeypatch.context() as broken:
        broken.setattr(Path, step, Failure())
        with pytest.raises(StrandspringError, match=r"model\.json cannot be written: No space left on device; check "):
            save_model(path, ModelFile("other", EXAMPLES["exponential"]))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["model.json"]


def test_a_write_that_is_interrupted_leaves_the_old_file_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "model.json"
    save_model(path, MODEL)
    before = path.read_bytes()

    def interrupted(part: Path, data: bytes) -> None:
        with part.open("wb") as stream:
            stream.write(data[:50])
        raise KeyboardInterrupt

    with monkeypatch.context() as broken:
        broken.setattr(Path, "write_bytes", interrupted)
        with pytest.raises(KeyboardInterrupt):
            save_model(path, ModelFile("other", EXAMPLES["exponential"]))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["model.json"]


def test_writing_makes_folders_and_replaces_files(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "model.json"
    save_model(path, MODEL)
    save_model(path, ModelFile("other", EXAMPLES["exponential"]))
    assert load_model(path).name == "other"
    assert [p.name for p in path.parent.iterdir()] == ["model.json"]


def test_places_that_cannot_be_written_are_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    for path in (tmp_path / "file" / "model.json", tmp_path / "folder"):
        with pytest.raises(StrandspringError) as refused:
            save_model(path, MODEL)
        assert str(refused.value).startswith(f"{path} cannot be written: ")
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "folder"]


@pytest.mark.parametrize("field", ["fit", "uncertainty", "provenance"])
def test_free_fields_hold_finite_numbers_only(tmp_path: Path, content: Content, field: str) -> None:
    text = json.dumps({**content, field: {"a": 1.0}}).replace('"a": 1.0', '"a": 1e999')
    assert "finite" in refusal(written(tmp_path, text))
    assert "finite" in refusal(written(tmp_path, json.dumps({**content, field: {"a": 10**400}})))
    for value in (float("nan"), object(), 10**400, 10**5000):
        with pytest.raises(ModelError, match="finite"):
            ModelFile("a", PARAMETERS, **{field: {"a": value}})


# What the program reads in the uncertainty, and a value that it cannot be.
WRONG_UNCERTAINTY: dict[str, tuple[Content, str]] = {
    "error as text": ({"rho": "x"}, "rho"),
    "negative error": ({"n": -1.0}, "n"),
    "true as error": ({"sigma": True}, "sigma"),
    "too few errors": ({"kA": [0.0] * 9}, "kA"),
    "an infinite error in a list": ({"kE": [10**400] * 3}, ""),
    "no object": ({"interval_95": 3}, "interval_95"),
    "no list": ({"interval_95": {"n": 3}}, "interval_95.n"),
    "three ends": ({"interval_95": {"n": [1.0, 2.0, 3.0]}}, "interval_95.n"),
    "ends exchanged": ({"interval_95": {"n": [2.0, 1.0]}}, "interval_95.n"),
    "correlation as a list": ({"correlation": [1.0]}, "correlation"),
    "correlation above 1": ({"correlation": {"rho,n": 1.5}}, "correlation.rho,n"),
    "true as correlation": ({"correlation": {"rho,n": True}}, "correlation.rho,n"),
    "sentences as numbers": ({"indistinct": [1.0]}, "indistinct"),
    "interval of another level": ({"prediction_interval": {"level": 0.9}}, "prediction_interval.level"),
    "interval as a number": ({"prediction_interval": 7}, "prediction_interval"),
    "joint covariance of something else": ({"joint": {"parameters": ["rho"], "root": [[1.0]]}}, "joint.parameters"),
}


# What depends on other fields, or on the numbers that a double holds, a schema cannot say.
BEYOND_THE_SCHEMA = (
    "too few errors", "an infinite error in a list", "ends exchanged", "joint covariance of something else"
)  # fmt: skip


@pytest.mark.parametrize("case", WRONG_UNCERTAINTY)
def test_uncertainty_that_cannot_be_read_is_refused_on_load(tmp_path: Path, content: Content, case: str) -> None:
    uncertainty, field = WRONG_UNCERTAINTY[case]
    assert checker().is_valid({**content, "uncertainty": uncertainty}) == (case in BEYOND_THE_SCHEMA)
    sentence = refusal(written(tmp_path, json.dumps({**content, "uncertainty": uncertainty})))
    assert f"uncertainty.{field}" in sentence or not field
    with pytest.raises(ModelError, match="uncertainty"):
        ModelFile("a", PARAMETERS, uncertainty=uncertainty)


@pytest.mark.parametrize("version", [True, 1.0], ids=repr)
def test_what_python_takes_for_one_is_not_a_version(tmp_path: Path, content: Content, version: object) -> None:
    assert "format_version" in refusal(written(tmp_path, json.dumps({**content, "format_version": version})))


@pytest.mark.parametrize("field", ["format", "format_version"])
def test_the_format_must_be_stated(tmp_path: Path, content: Content, field: str) -> None:
    del content[field]
    assert "format" in refusal(written(tmp_path, json.dumps(content)))
    assert not checker().is_valid(content)


def test_control_characters_of_a_file_do_not_reach_the_terminal(tmp_path: Path, content: Content) -> None:
    for text in (json.dumps({**content, "a\nb\x1b": 1}), '{"a\\u001bb": 1, "a\\u001bb": 2}'):
        sentence = refusal(written(tmp_path, text))
        assert "\x1b" not in sentence
        assert "\n" not in sentence


def test_an_impossible_path_is_refused() -> None:
    with pytest.raises(ModelError, match="not a possible path"):
        load_model("a\0b.json")


def test_a_model_that_differs_by_rounding_only_keeps_its_file(tmp_path: Path) -> None:
    path, kept = tmp_path / "hinge.json", load_model(SCHEMA.with_name("rubber_hinge.json"))

    def scaled(factor: float) -> ModelFile:
        """The model with all its figures in other last digits, or other ones."""
        parameters = replace(kept.parameters, rho=factor * kept.parameters.rho)
        fit = {**kept.fit, "small": {"values": [factor * 0.123, 1e-12 * factor]}}
        return replace(kept, parameters=parameters, fit=fit)

    save_model(path, scaled(1.0))
    before = path.read_bytes()
    assert saved_model(path, scaled(1.0 + 1e-8)) == load_model(path)
    assert path.read_bytes() == before
    assert saved_model(path, scaled(1.0 + 1e-5)) == scaled(1.0 + 1e-5)
    assert path.read_bytes() != before
    path.write_text("{}")
    assert saved_model(path, kept) == kept == load_model(path)
