"""The published schemas, written from the tables that read the files: python tests/helpers/schemas.py"""

from __future__ import annotations

import json
from pathlib import Path

from strandspring import model_schema
from strandspring.vibration.description.system_file import system_schema

_MODELS = Path(__file__).resolve().parents[2] / "models"
PUBLISHED = {
    _MODELS / "strandspring-model.schema.json": model_schema,
    _MODELS / "strandspring-system.schema.json": system_schema,
}


def text(path: Path) -> str:
    """What a file has to hold."""
    return json.dumps(PUBLISHED[path](), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for published in PUBLISHED:
        published.write_text(text(published), encoding="utf-8")
