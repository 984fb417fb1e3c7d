"""SYSTEM.toml: what it says is what is built; mistakes are refused in one sentence that names file and field.

Values in another unit than they are read in are refused or get a caution.
"""

from __future__ import annotations

import copy
import json
import math
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kept import changes, plain
from springs import EXAMPLES
from strandspring import model_schema
from strandspring.docs.site import page_text
from strandspring.errors import MountedSystemError, Reader
from strandspring.examples.system_models import SYSTEMS
from strandspring.findings import words
from strandspring.ground.gravity import STANDARD_GRAVITY as G
from strandspring.ground.strict_toml import parse_toml
from strandspring.model.modelfile import ModelFile, save_model
from strandspring.vibration.description import quantity_text as quantities
from strandspring.vibration.description.named_files import FilesOfFolder
from strandspring.vibration.description.quantity_text import QuantityError, in_si, measured, stated_units, unit_in_si
from strandspring.vibration.description.system_file import (
    SystemFile,
    load_system_file,
    read_description,
    system_of_content,
    system_schema,
)
from strandspring.vibration.verdicts.implausible_loads import implausible_loads
from strandspring.vibration.verdicts.implausible_values import implausible_values

Content = dict[str, Any]
HARDENING = EXAMPLES["hardening"]  # 0 N at 50 mm, within 30 and 70 mm
HERE = Path(__file__).parent
DESCRIBED = HERE / "described.json"
EXAMPLE = read_description(SYSTEMS / "electronics_box.toml")
BASES = {"box": read_description(HERE / "box.toml"), "example": EXAMPLE}
STATED = parse_toml((HERE / "catalogues.toml").read_text(encoding="utf-8"))
BASES |= {name: STATED[name] | {"loss_factor": 0.3} for name in ("linear", "curve")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Models and records that the files name."""
    path = tmp_path_factory.mktemp("systems")
    for name in ("hardening", "wire_rope"):
        save_model(path / f"{name}.json", ModelFile(name, EXAMPLES[name]))
    (path / "damaged.json").write_text("{")
    pressed = {**HARDENING.as_dict(), "kE": (900.0, *HARDENING.kE[1:2])}
    save_model(path / "pressed.json", ModelFile("pressed", type(HARDENING)(**pressed)))
    rows = "\n".join(f"{0.001 * k:.3f},{k % 7},{k % 5},{k % 3}" for k in range(200))
    (path / "base.csv").write_text(f"t [s],ax [g],wz [deg/s],F [kN]\n{rows}\n")
    (path / "levels.csv").write_text("f [Hz],level\n10,0.01\n20,0.04\n100,0.04\n")
    shutil.copytree(SYSTEMS, path, dirs_exist_ok=True)
    time = 2e-3 * np.arange(5000)
    shaken = 20.0 * np.sin(2.0 * np.pi * 12.0 * time)
    columns = time, shaken * np.minimum(time, 1.0) + 9.7, shaken + 0.3, shaken, 90.0 * np.sin(time)
    header = "time [s],tilted [m/s^2],offset [m/s^2],shaken [m/s^2],turning [rad/s]"
    np.savetxt(path / "recorded.csv", np.transpose(columns), "%.17g", ",", header=header, comments="")
    return path


def toml(value: Any) -> str:
    """A value as TOML writes it inline."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value)


def loaded(content: Content, folder: Path) -> SystemFile:
    path = folder / "system.toml"
    path.write_text("\n".join(f"{json.dumps(key)} = {toml(value)}" for key, value in content.items()), encoding="utf-8")
    return load_system_file(path)


def built(content: Content, folder: Path) -> Any:
    """All that a file says, its signals as averages over shares of their time and the density of random ones."""
    file, signals = loaded(content, folder), []
    for one in file.cases:
        step = max(1e-3, one.duration / 12.0)
        for channel in one.channels:
            densities = getattr(getattr(channel.signal, "density", None), "points", ())
            averages = () if densities else channel.signal.averages(step, math.ceil(one.duration / step))
            signals.append([densities, averages])
    return plain([file.name, sorted(file.models), file.candidates, file.limits, file.options, file.cases, signals])


def test_what_files_say_is_built_read_or_refused_in_a_sentence(folder: Path) -> None:
    """As kept in described.json, whose figures were compared with values by hand when they were recorded.

    Its keys are changes of a description, a place, counted from 0, and its value as JSON; null leaves it out. Several
    are separated by semicolons, and of a case only its keys are given.
    """
    found = {name: described(*name.split(" ", 1), folder) for name in json.loads(DESCRIBED.read_text(encoding="utf-8"))}
    assert changes(DESCRIBED, found, 1e-6) == []
    for name, sentences in found.items():
        assert sentences, name
        for one in sentences if name.startswith("refused") else ():
            assert one.endswith((".", ")")), one
            assert not any(word in one for word in ("\n", "pydantic", "Input should", "[type=", "=table", "=quantity"))


def described(group: str, text: str, folder: Path) -> Any:
    """What is built of a file, what is said of one, or the value of "QUANTITY text" in SI."""
    first, _, rest = text.partition(" ")
    if group == "files":
        return built(changed("box", text), folder)
    if group == "refused":
        return refused(first[:-1], rest, folder)
    try:
        return in_si(rest, getattr(quantities, first))
    except QuantityError as refusal:
        return str(refusal)


def changed(base: str, changes: str) -> Content:
    """A description with its changes."""
    content = copy.deepcopy(BASES[base])
    for one in changes.split("; "):
        path, _, text = one.partition(": ")
        *parents, last = (int(key) if key.isdigit() else key for key in path.split("."))
        place, value = content, json.loads(text)
        for key in parents:
            place = place[key]
        if path == "case" and isinstance(value, dict):
            value = [{"name": "c", **value}]
        if value is None:
            del place[last]
        elif isinstance(place, list) and last == len(place):
            place.append(value)
        else:
            place[last] = value
    if base in ("linear", "curve"):
        axis = {"direction": "-z", "catalogue": content}
        content = copy.deepcopy(BASES["box"])
        content["mount_type"]["corner"]["axes"][0] = axis
    return content


def all_sentences(content: Content, folder: Path = SYSTEMS) -> list[str]:
    """The refusal of a description, or else all cautions of its first candidate."""
    try:
        file = system_of_content(content, FilesOfFolder(folder))
    except MountedSystemError as refusal:
        return [str(refusal)]
    _, system = file.candidates[0]
    found = [*implausible_values(system), *(one for case in file.cases for one in implausible_loads(system, case))]
    return [words(finding, Reader.PYTHON) for finding in found]


def refused(base: str, changes: str, folder: Path) -> list[str]:
    """What is said of a description with changes: the example is refused or gets cautions, all others are refused."""
    content = changed(base, changes)
    if base == "example":
        return all_sentences(content, folder)
    with pytest.raises(MountedSystemError) as refusal:
        loaded(content, folder)
    return [str(refusal.value).replace(f"{folder}/", "")]


NO_TOML = {
    "a = [": "is not valid TOML",
    "a = " + "9" * 5000: "an integer has too many digits",
    "a = " + "[" * 4000: "nested",
    "a = " + "[" * 100 + "]" * 100: "nested more than 60 levels deep",
    ".".join(["a"] * 100_000) + " = 1": "dotted keys have more than 1000 parts",
    ".".join(['"a"'] * 100_000) + " = 1": "dotted keys have more than 1000 parts",
    "#" * 1_000_001: "may have at most 1000000",
}


def test_what_is_no_toml_or_too_much(tmp_path: Path) -> None:
    for text, refusal in NO_TOML.items():
        (tmp_path / "system.toml").write_text(text)
        with pytest.raises(MountedSystemError, match=refusal):
            load_system_file(tmp_path / "system.toml")


def test_units_that_are_stated_hold_where_none_is_given() -> None:
    rates = quantities.OCTAVE_RATE, quantities.FREQUENCY_RATE
    assert measured("6 oct/min", *rates) == (pytest.approx(0.1), rates[0])
    assert measured("6 Hz/s", *rates) == (6.0, rates[1])
    with stated_units({"acceleration": G}):
        assert (in_si(10, quantities.ACCELERATION), in_si("10 m/s^2", quantities.ACCELERATION)) == (10 * G, 10.0)
    for quantity in quantities.QUANTITIES[:-1]:
        assert in_si(f"1 {quantity.unit}", quantity) == 1.0
        if quantity.key:
            with pytest.raises(QuantityError, match=r"write '3.5 (.*)' or '3.5 (.*)'") as caught:
                in_si(3.5, quantity)
            units = re.findall(r"'3.5 (.*?)'", str(caught.value))
            assert len({unit_in_si(unit, quantity) for unit in units}) == 2
    for value, refusal in ((True, "got true or false"), ([1], "got a list"), (10**400, "not finite")):
        with pytest.raises(QuantityError, match=refusal):
            in_si(value, quantities.LENGTH)


# ---- the schema, the pages and the examples -------------------------------------------------------


def test_published_schemas_are_those_of_the_tables_that_read() -> None:
    import jsonschema

    for name, made in (("model", model_schema()), ("system", system_schema())):
        path = Path(__file__).parents[2] / "models" / f"strandspring-{name}.schema.json"
        text = json.dumps(made, indent=2, ensure_ascii=False) + "\n"
        if "STRANDSPRING_KEEP" in os.environ:
            path.write_text(text, encoding="utf-8")
        assert path.read_text(encoding="utf-8") == text
        jsonschema.Draft202012Validator.check_schema(made)


def test_documentation_names_every_key_and_its_example_loads() -> None:
    import jsonschema

    schema = system_schema()
    validator = jsonschema.Draft202012Validator(schema)
    validator.validate(BASES["box"])
    page = "".join(page_text(name) for name in ("system-file", "catalogue", "load-cases"))
    parts = re.split(r"```(?:toml)?\n", page)
    texts, (example, _, of_catalogue) = parts[::2], parts[1::2]
    content = parse_toml(example)
    assert len(system_of_content(content, FilesOfFolder(SYSTEMS)).cases) == 3
    content["mount_type"]["corner"]["axes"][0] = parse_toml(of_catalogue)["mount_type"]["wire_rope"]["axes"][0]
    axes = system_of_content(content, FilesOfFolder(SYSTEMS)).candidates[0][1].axes
    assert "catalogue values of Example Ropes WR4-200, page 12, -z" in {axis.model for axis in axes}
    words = set(re.findall(r"[a-z][a-z_-]*", " ".join(re.findall(r"`([^`]+)`", "".join(texts)))))
    keys = {key for table in schema["$defs"].values() for key in table["properties"]} | set(schema["properties"])
    shapes = set(schema["$defs"]["PulseCase"]["properties"]["pulse"]["enum"])
    assert (keys | shapes) - words == set()
    for path in sorted(SYSTEMS.glob("*.toml")):
        content = read_description(path)
        validator.validate(content)
        file = load_system_file(path)
        assert len(file.candidates) * len(file.cases) > 1
        assert all_sentences(content) == []
