"""What is installed with the package: declared, pinned for a release, and its licences listed."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import strandspring

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = Path(strandspring.__file__).parent

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
REQUIREMENTS = [
    Requirement(text)
    for texts in (PROJECT["dependencies"], *PROJECT["optional-dependencies"].values())
    for text in texts
    if not text.startswith("strandspring[")
]
LINES = (ROOT / ".ci" / "constraints.txt").read_text(encoding="utf-8").splitlines()
PINS = [Requirement(line.partition("#")[0]) for line in LINES if not line.startswith("#")]

# Distributions whose modules are not called like them.
MODULES = {"charset-normalizer": "charset_normalizer", "markdown-it-py": "markdown_it", "nptdms": "nptdms",
           "python-calamine": "python_calamine"}  # fmt: skip

ENVIRONMENTS = [
    {
        "python_version": f"3.{minor}", "python_full_version": f"3.{minor}.1", "sys_platform": system,
        "platform_machine": machine, "platform_system": system.capitalize(), "implementation_name": "cpython",
        "platform_python_implementation": "CPython", "os_name": "nt" if system == "win32" else "posix",
    }
    for minor in range(10, 15)
    for system, machine in (("linux", "x86_64"), ("linux", "aarch64"), ("darwin", "arm64"), ("win32", "AMD64"))
]  # fmt: skip


def applies(requirement: Requirement, environment: dict[str, str]) -> bool:
    return requirement.marker is None or requirement.marker.evaluate(environment)


def test_a_release_pins_every_requirement_on_every_system_within_its_bounds() -> None:
    for environment in ENVIRONMENTS:
        pinned: dict[str, str] = {}
        for pin in PINS:
            if applies(pin, environment):
                assert pin.name not in pinned, (pin.name, environment)
                (only,) = pin.specifier
                pinned[pin.name] = only.version
        for requirement in REQUIREMENTS:
            if applies(requirement, environment):
                version = pinned[canonicalize_name(requirement.name)]
                assert requirement.specifier.contains(version, prereleases=True), (requirement, version, environment)


def test_pins_are_exact_and_name_no_place() -> None:
    for pin in PINS:
        assert re.fullmatch(r"==[\w.]+", str(pin.specifier)), pin
        assert pin.url is None
    assert not re.search(r"://|--|sha256", "\n".join(LINES[len(LINES) - len(PINS) :]))
    assert [pin.name for pin in PINS] == sorted(pin.name for pin in PINS)


def test_every_module_that_the_package_imports_is_required() -> None:
    declared = {MODULES.get(name, name) for name in (canonicalize_name(one.name) for one in REQUIREMENTS)}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules: list[str] = []
            if isinstance(node, ast.Import):
                modules = [name.name for name in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                modules = [node.module or ""]
            for module in {module.partition(".")[0] for module in modules}:
                known = module in sys.stdlib_module_names or module == "strandspring"
                # setuptools runs the build; tomllib came with Python 3.11.
                assert known or module.lower() in declared | {"setuptools", "tomllib"}, (path, module)


@pytest.fixture(scope="module")
def listed() -> dict[str, tuple[str, str]]:
    """Licence and use by distribution, in THIRD_PARTY.md."""
    table = (ROOT / "fmu_src" / "THIRD_PARTY.md").read_text(encoding="utf-8").partition("## All dependencies")[2]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if "|" in line]
    return {name: (licence, use) for name, licence, use in rows[2:]}


def test_licences_of_all_dependencies_are_listed(listed: dict[str, tuple[str, str]]) -> None:
    assert set(listed) == {pin.name for pin in PINS}
    assert all(licence for licence, _ in listed.values())
    for name in PROJECT["dependencies"]:
        assert "always" in listed[canonicalize_name(Requirement(name).name)][1]
    # Nothing that every user installs asks for more than to be named.
    assert not [name for name, (licence, use) in listed.items() if "GPL" in licence and "always" in use]


def test_listed_licences_are_those_of_what_is_installed(listed: dict[str, tuple[str, str]]) -> None:
    compared = 0
    for pin in PINS:
        try:
            installed = metadata.metadata(pin.name)
        except metadata.PackageNotFoundError:
            continue
        expression = installed.get("License-Expression")  # the backport of importlib.metadata raises KeyError
        if expression and f"=={installed['Version']}" == str(pin.specifier):
            assert listed[pin.name][0] == expression, pin.name
            compared += 1
    assert compared > 10


@pytest.fixture(scope="module")
def bill(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The bill of materials, written by its script."""
    file = tmp_path_factory.mktemp("bill") / "bill.json"
    subprocess.run([sys.executable, ROOT / ".ci" / "sbom.py", file], check=True)
    first = file.read_bytes()
    subprocess.run([sys.executable, ROOT / ".ci" / "sbom.py", file], check=True)
    assert file.read_bytes() == first
    content: dict[str, Any] = json.loads(first)
    return content


def test_the_bill_of_materials_has_the_form_of_cyclonedx(bill: dict[str, Any]) -> None:
    # What the schema of CycloneDX 1.6 requires, and the types and values of what is used of it.
    assert (bill["bomFormat"], bill["specVersion"], bill["version"]) == ("CycloneDX", "1.6", 1)
    components = [bill["metadata"]["component"], *bill["components"]]
    for component in components:
        assert component["type"] in ("application", "library")
        assert component.get("scope", "required") in ("required", "optional")
        assert component["name"]
        assert component["version"]
        assert component["purl"] == component["bom-ref"] == f"pkg:pypi/{component['name']}@{component['version']}"
        (licence,) = component["licenses"]
        assert licence.keys() in ({"expression"}, {"license"})
    references = [component["bom-ref"] for component in components]
    assert len(set(references)) == len(references)
    assert [entry["ref"] for entry in bill["dependencies"]] == references
    assert all(set(entry["dependsOn"]) <= set(references) for entry in bill["dependencies"])


def test_the_bill_of_materials_lists_what_users_install(
    bill: dict[str, Any], listed: dict[str, tuple[str, str]]
) -> None:
    components = {component["name"]: component for component in bill["components"]}
    assert components.keys() == {name for name, (_, use) in listed.items() if use != "test"}
    assert {name for name, component in components.items() if component["scope"] == "required"} == {
        name for name, (_, use) in listed.items() if "always" in use
    }
    of_package = next(entry for entry in bill["dependencies"] if entry["ref"].startswith("pkg:pypi/strandspring@"))
    direct = {reference.partition("/")[2].partition("@")[0] for reference in of_package["dependsOn"]}
    assert {canonicalize_name(Requirement(text).name) for text in PROJECT["dependencies"]} <= direct


def test_every_upper_bound_has_its_reason() -> None:
    text = (ROOT / "fmu_src" / "THIRD_PARTY.md").read_text(encoding="utf-8")
    bounded = [requirement for requirement in REQUIREMENTS if "<" in str(requirement.specifier)]
    assert len(bounded) >= 3
    for requirement in bounded:
        assert f"| `{requirement.name}{requirement.specifier}` | " in text


def test_the_citation_names_the_version() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {strandspring.__version__}\n" in citation
