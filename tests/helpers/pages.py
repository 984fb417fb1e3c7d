"""The README and the pages of the documentation, with their commands and programs, for the tests that run them."""

from __future__ import annotations

import re
from pathlib import Path

from strandspring.docs.site import PAGES, page_text

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
TEXTS = {"README": README, **{name: page_text(name) for name in PAGES}}


def blocks(page: str, language: str) -> list[str]:
    """Contents of the fenced blocks of a language on a page, in order."""
    return re.findall(rf"```{language}\n(.*?)```", TEXTS[page], flags=re.DOTALL)
