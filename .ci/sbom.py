"""Write a bill of materials of strandspring and all that it may be installed with, as CycloneDX 1.6 in JSON.

usage: python .ci/sbom.py FILE.json

Names and versions come from .ci/constraints.txt, licences and uses from fmu_src/THIRD_PARTY.md: what only tests need is
left out. The same commit gives the same bytes, so that there is neither a time nor a random serial number.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]


def _text(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


def versions() -> dict[str, str]:
    """The pinned version of each distribution; the highest where systems or versions of Python differ."""
    lines = _text(".ci/constraints.txt").splitlines()
    pins = [re.match(r"([\w.-]+)==([\w.]+)", line) for line in lines]
    return {pin[1]: pin[2] for pin in sorted(filter(None, pins), key=lambda pin: (pin[1], _order(pin[2])))}


def _order(version: str) -> list[int]:
    return list(map(int, re.findall(r"\d+", version)))


def licences() -> dict[str, tuple[str, str]]:
    """Licence and use of each distribution."""
    table = _text("fmu_src/THIRD_PARTY.md").partition("## All dependencies")[2]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if "|" in line]
    return {name: (licence, use) for name, licence, use in rows[2:]}


def needed() -> dict[str, list[str]]:
    """What each distribution needs; "strandspring" is the first."""
    needs: dict[str, list[str]] = {"strandspring": []}
    for line in _text(".ci/constraints.txt").splitlines():
        if not line.startswith("#"):
            pin, _, via = line.partition("# via")
            for by in re.findall(r"[\w.-]+", re.sub(r"\([^)]*\)", "", via)):
                needs.setdefault(by, []).append(pin.partition("==")[0])
    return needs


def component(name: str, version: str, licence: str, use: str) -> dict[str, Any]:
    """A library of the bill; its `scope` is that of the specification."""
    return {
        "type": "library",
        "bom-ref": f"pkg:pypi/{name}@{version}",
        "name": name,
        "version": version,
        "scope": "required" if "always" in use else "optional",
        # Expressions of SPDX are made of such words; the others are names.
        "licenses": [
            {"expression": licence} if re.fullmatch(r"[\w.+-]+( (AND|OR|WITH) [\w.+-]+)*", licence)
            else {"license": {"name": licence}}
        ],
        "purl": f"pkg:pypi/{name}@{version}",
        "properties": [{"name": "strandspring:needed-by", "value": use}],
    }  # fmt: skip


def bill() -> dict[str, Any]:
    """The whole document."""
    project = dict(re.findall(r'^(description|license) = "(.+)"$', _text("pyproject.toml"), re.MULTILINE))
    (version,) = re.findall(r'__version__ = "([^"]+)"', _text("fmu_src/strandspring/_version.py"))
    pinned = {name: text for name, text in versions().items() if licences()[name][1] != "test"}
    known = {"strandspring": version, **pinned}
    references = {name: f"pkg:pypi/{name}@{text}" for name, text in known.items()}
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": references["strandspring"],
                "name": "strandspring",
                "version": version,
                "description": project["description"],
                "licenses": [{"expression": project["license"]}],
                "purl": references["strandspring"],
            }
        },
        "components": [component(name, text, *licences()[name]) for name, text in pinned.items()],
        "dependencies": [
            {"ref": reference, "dependsOn": sorted(references[n] for n in set(needed().get(name, ())) & known.keys())}
            for name, reference in references.items()
        ],
    }


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(bill(), indent=2) + "\n", encoding="utf-8")
