"""Templates escape what they are given: no environment of Jinja without autoescape, and no template that undoes it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import strandspring

PACKAGE = Path(strandspring.__file__).parent


def calls(name: str) -> Iterator[ast.Call]:
    """Calls of a function or class of this name in the package, also as an attribute."""
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and (
                (isinstance(node.func, ast.Name) and node.func.id == name)
                or (isinstance(node.func, ast.Attribute) and node.func.attr == name)
            ):
                yield node


def test_every_environment_of_jinja_escapes() -> None:
    settings = [{keyword.arg: keyword.value for keyword in call.keywords} for call in calls("Environment")]
    assert len(settings) >= 2
    for given in settings:
        value = given["autoescape"]
        assert isinstance(value, ast.Constant)
        assert value.value is True
    assert not list(calls("Template"))


def test_no_template_undoes_it() -> None:
    templates = list(PACKAGE.rglob("*.j2"))
    assert len(templates) >= 4
    for template in templates:
        assert not re.search(r"\|\s*safe\b|autoescape", template.read_text(encoding="utf-8")), template.name
