"""The model file: stable bytes, refusals of one sentence, the published schema, and writing all or nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from springs import EXAMPLES, TABLE, springs
from strandspring import ModelError, Spring, SpringParameters, model_schema
from strandspring.model.file_tables import Certificate, Start
from strandspring.model.modelfile import ModelFile, load_model, save_model, saved_model

# Files are rewritten example by example, so that one folder per test is enough.
LAW = settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])

HERE = Path(__file__).parent
PARAMETERS = EXAMPLES["wire_rope"]
MODEL = ModelFile(
    "wire_rope", PARAMETERS, "Isolator 7, größer als µ <&> ✓\n\twith a line and a tab",
    fit={"rmse": 2.5337, "rnl": 0.98979},
    provenance={"records": [{"path": "a.csv", "sha256": "0" * 64}], "options": None},
    start=Start(displacement=0.01, omega=-0.9, at_rest=True),
    certificate=Certificate(force_min=-80.0, force_max=90.0, margin=42.5),
)  # fmt: skip
TABLE_MODEL = ModelFile("table", TABLE)
TEXT = MODEL.to_json()


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "model.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refusal(path: Path) -> str:
    """The sentence with which a file is refused, after the checks that hold for every one."""
    with pytest.raises(ModelError) as refused:
        load_model(path)
    sentence = str(refused.value)
    assert sentence.startswith(str(path))
    assert sentence.endswith(".")
    assert not any(part in sentence for part in ("\n", "\x1b", "pydantic"))
    assert len(sentence) <= len(str(path)) + 300  # no dump: room for the path, a field and 60 characters of its value
    return sentence.removeprefix(str(path))


def is_valid(content: Any) -> bool:
    import jsonschema

    return jsonschema.Draft202012Validator(model_schema()).is_valid(content)


@LAW
@given(
    springs(),
    st.from_regex("[A-Za-z][A-Za-z0-9_]{3,63}", fullmatch=True),
    st.text(st.characters(codec="utf-8", categories=["L", "N", "P", "S", "Zs"]), max_size=2000),
)
def test_no_bit_of_a_spring_is_lost(tmp_path: Path, parameters: SpringParameters, name: str, text: str) -> None:
    model, path = ModelFile(f"m{name[:63]}", parameters, text), tmp_path / "model.json"
    save_model(path, model)
    first = path.read_bytes()
    loaded = load_model(path)
    assert loaded == model
    save_model(path, loaded)
    assert path.read_bytes() == first
    assert first.endswith(b"}\n")
    assert b"\r" not in first


@pytest.mark.parametrize("parameters", EXAMPLES.values(), ids=EXAMPLES)
def test_all_of_a_model_file_survives_and_fits_the_schema(tmp_path: Path, parameters: SpringParameters) -> None:
    for model in (MODEL, ModelFile("example", parameters, fit=MODEL.fit)):
        path = tmp_path / "model.json"
        save_model(path, model)
        assert load_model(path) == Spring.load(path).model == model
        assert is_valid(json.loads(path.read_text(encoding="utf-8")))
    assert "größer als µ <&> ✓" in TEXT  # readable, not escaped
    content = json.loads(TEXT)
    assert list(content) == list(model_schema()["properties"])
    by_hand = {key: content[key] for key in ("format", "format_version", "name", "parameters")}
    loaded = load_model(written(tmp_path, json.dumps(by_hand)))
    assert (loaded.parameters, loaded.fit, loaded.start, loaded.certificate) == (PARAMETERS, {}, None, None)


def test_a_model_that_differs_by_rounding_only_keeps_its_file(tmp_path: Path) -> None:
    path, kept = tmp_path / "hinge.json", load_model(HERE.parent / "models/rubber_hinge.json")

    def scaled(factor: float, least: float = 1e-12) -> ModelFile:
        """The model with all its figures in other last digits, or other ones."""
        parameters = replace(kept.parameters, rho=factor * kept.parameters.rho)
        fit = {**kept.fit, "small": {"values": [factor * 0.123, factor * least]}}
        return replace(kept, parameters=parameters, fit=fit)

    save_model(path, scaled(1.0))
    before = path.read_bytes()
    assert saved_model(path, scaled(1.0 + 1e-8)) == load_model(path)
    assert path.read_bytes() == before
    for other in (scaled(1.0, 1e-8), scaled(1.0 + 1e-5)):
        assert saved_model(path, other) == other
    path.write_text("{}")
    assert saved_model(path, kept) == kept == load_model(path)


def faults() -> list[Any]:
    """Group, field, value as JSON, and sentence of each row of modelfile_faults.txt."""
    groups = (HERE / "modelfile_faults.txt").read_text(encoding="utf-8").split("\n[")[1:]
    rows = ((text.partition("]")[0], line.split(" => ")) for text in groups for line in text.splitlines()[1:] if line)
    return [pytest.param(group, *change.split(": ", 1), sentence, id=change) for group, (change, sentence) in rows]


@pytest.mark.parametrize(("group", "field", "value", "sentence"), faults())
def test_faults_of_a_field_are_named(group: str, field: str, value: str, sentence: str, tmp_path: Path) -> None:
    content = json.loads((TABLE_MODEL if group == "table" else MODEL).to_json())
    assert is_valid(content)
    *owner, name = field.split(".")
    place = content[owner[0]] if owner else content
    if value == "null":
        del place[name]
    else:
        place[name] = "PLACE"
    text = json.dumps(content).replace('"PLACE"', value)
    assert sentence in refusal(written(tmp_path, text))
    if group != "reader":
        assert not is_valid(json.loads(text))


NO_JSON, NO_UTF_8 = ", line 1: not valid JSON (", ": is not UTF-8 text; give the path of a model file (JSON)."
TWICE, DEEP = ': not a valid model file (field "{}" is given twice)', "nested more than 200 levels deep"
TEXTS: dict[str | bytes, str] = {
    **dict.fromkeys(("", "{", "[1,", "// a\n{}", "a,b\n1,2\n", "\ufeff\ufeff{}"), NO_JSON),
    **dict.fromkeys(("null", "[]", "1.5", '"text"', "{}"), ': field "format" must be "strandspring-model"; give'),
    TEXT.replace('"name":', '"name": 1, "name":'): TWICE.format("name"),
    TEXT.replace('"rho":', '"rho": 1, "rho":'): TWICE.format("rho"),
    '{"a\\u001bb": 1, "a\\u001bb": 2}': "is given twice",
    TEXT.replace('"n": ', '"n": ' + "1" * 5000): "numbers must be finite, got 111",
    **{TEXT.replace("{}", f'{{"a": {"[" * depth}{"]" * depth}}}'): DEEP for depth in (300, 100_000)},
    TEXT.replace("Isolator", "x" * 2001): ": description: must have at most 2000 characters",
    **dict.fromkeys((b"\xff\xfe\x00\x01", TEXT.encode("utf-16")), NO_UTF_8),
}


@pytest.mark.parametrize("text", TEXTS, ids=lambda text: repr(text[:20]))
def test_text_that_is_no_model_file_is_refused(text: str | bytes, tmp_path: Path) -> None:
    assert TEXTS[text] in refusal(written(tmp_path, text))
