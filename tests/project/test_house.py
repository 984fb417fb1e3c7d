"""What the sources say of themselves: the architecture, examples in docstrings, and templates."""

from __future__ import annotations

import doctest
import re
from importlib import import_module
from pathlib import Path

import pytest

import architecture
from architecture import PACKAGE


def test_the_picture_of_the_architecture_is_drawn_from_the_imports_and_every_folder_has_its_words() -> None:
    page = architecture.PAGE.read_text(encoding="utf-8")
    assert architecture.PICTURE.findall(page) == [architecture.picture()], "run python tests/helpers/architecture.py"
    assert [room for room in architecture.rooms() if f"**{room}**" not in page.split()] == []


@pytest.mark.slow
def test_examples_in_docstrings_give_what_they_show(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    files = [path for path in PACKAGE.rglob("*.py") if ">>> " in path.read_text(encoding="utf-8")]
    assert len(files) >= 3
    for path in files:
        name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
        ran = doctest.testmod(import_module(name))
        assert (ran.attempted > 0, ran.failed) == (True, 0), name
    assert list(tmp_path.iterdir()) == []


def test_templates_escape_what_they_are_given() -> None:
    """No environment of Jinja without autoescape, and no template that undoes it."""
    sources = "".join(path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))
    environments = re.findall(r"= Environment\(", sources)
    assert len(environments) == sources.count("autoescape=True") >= 2
    assert not re.search(r"\bTemplate\(", sources)
    templates = list(PACKAGE.rglob("*.j2"))
    assert len(templates) >= 4
    for template in templates:
        assert not re.search(r"\|\s*safe\b|autoescape", template.read_text(encoding="utf-8")), template.name
