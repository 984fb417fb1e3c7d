"""What is installed with the package: declared, pinned for a release, and its licences listed."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

import strandspring
from strandspring.ground import strict_toml

ROOT = Path(__file__).resolve().parents[2]
PROJECT = strict_toml.tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def requirements(texts: Iterable[str]) -> list[Any]:
    from packaging.requirements import Requirement

    return [Requirement(text.partition("#")[0]) for text in texts if not text.startswith(("#", "strandspring["))]


@pytest.fixture(scope="module")
def required() -> list[Any]:
    return requirements([*PROJECT["dependencies"], *chain(*PROJECT["optional-dependencies"].values())])


@pytest.fixture(scope="module")
def pins() -> list[Any]:
    return requirements((ROOT / ".ci" / "constraints.txt").read_text(encoding="utf-8").splitlines())


def name_of(requirement: Any) -> str:
    return re.sub(r"[-_.]+", "-", requirement.name).lower()


def test_a_release_pins_every_requirement_on_every_system_within_its_bounds(
    required: list[Any], pins: list[Any]
) -> None:
    machines = (("linux", "x86_64"), ("linux", "aarch64"), ("darwin", "arm64"), ("win32", "AMD64"))
    for system, machine, minor in ((*one, minor) for one in machines for minor in range(10, 15)):
        environment = {
            "python_version": f"3.{minor}", "python_full_version": f"3.{minor}.1", "sys_platform": system,
            "platform_machine": machine, "platform_system": system.capitalize(), "implementation_name": "cpython",
            "platform_python_implementation": "CPython", "os_name": "nt" if system == "win32" else "posix",
        }  # fmt: skip
        applying = [pin for pin in pins if pin.marker is None or pin.marker.evaluate(environment)]
        pinned = {pin.name: re.fullmatch(r"==([\w.]+)", str(pin.specifier))[1] for pin in applying}  # type: ignore[index]
        assert len(pinned) == len(applying)
        for one in required:
            if one.marker is None or one.marker.evaluate(environment):
                assert one.specifier.contains(pinned[name_of(one)], prereleases=True), (one, environment)
    assert [pin.url for pin in pins] == [None] * len(pins)


def test_every_module_that_the_package_imports_is_required(required: list[Any]) -> None:
    # setuptools runs the build; tomllib came with Python 3.11.
    known = {name_of(one).replace("-", "_").removesuffix("_py") for one in required}
    known |= {"setuptools", "tomllib", "strandspring"}
    for path in Path(strandspring.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [name.name for name in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            for module in {name.partition(".")[0] for name in names}:
                assert module in sys.stdlib_module_names or module.lower() in known, (path, module)


@pytest.fixture(scope="module")
def listed() -> dict[str, tuple[str, str]]:
    """Licence and use by distribution, in THIRD_PARTY.md."""
    table = (ROOT / "fmu_src" / "THIRD_PARTY.md").read_text(encoding="utf-8").partition("## All dependencies")[2]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if "|" in line]
    return {name: (licence, use) for name, licence, use in rows[2:]}


def test_licences_of_all_dependencies_are_listed(
    required: list[Any], pins: list[Any], listed: dict[str, tuple[str, str]]
) -> None:
    assert f"\nversion: {strandspring.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert set(listed) == {pin.name for pin in pins}
    assert all(licence for licence, _ in listed.values())
    for one in required[: len(PROJECT["dependencies"])]:
        assert "always" in listed[name_of(one)][1]
    # Nothing that every user installs asks for more than to be named.
    assert not [name for name, (licence, use) in listed.items() if "GPL" in licence and "always" in use]


def test_the_bill_of_materials_lists_what_users_install(listed: dict[str, tuple[str, str]], tmp_path: Path) -> None:
    for name in ("one", "other"):
        subprocess.run([sys.executable, ROOT / ".ci" / "sbom.py", tmp_path / name], check=True)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()
    bill = json.loads((tmp_path / "one").read_bytes())
    assert (bill["bomFormat"], bill["specVersion"], bill["version"]) == ("CycloneDX", "1.6", 1)
    components = [bill["metadata"]["component"], *bill["components"]]
    references = [f"pkg:pypi/{one['name']}@{one['version']}" for one in components]
    assert references == [one["purl"] for one in components] == [one["bom-ref"] for one in components]
    assert references == [entry["ref"] for entry in bill["dependencies"]]
    assert all(set(entry["dependsOn"]) <= set(references) for entry in bill["dependencies"])
    uses = {name: use for name, (_, use) in listed.items() if use != "test"}
    expected = {name: "required" if "always" in use else "optional" for name, use in uses.items()}
    assert {one["name"]: one["scope"] for one in bill["components"]} == expected
