"""The published schema of SYSTEM.toml, written from the tables that read it: python tests/helpers/system_schema.py"""

from __future__ import annotations

import json
from pathlib import Path

from strandspring.vibration.description.system_file import schema_of_tables

PUBLISHED = Path(__file__).resolve().parents[2] / "models/strandspring-system.schema.json"


def text() -> str:
    """What the file has to hold."""
    return json.dumps(schema_of_tables(), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    PUBLISHED.write_text(text(), encoding="utf-8")
