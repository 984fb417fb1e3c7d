"""The notebook of the workflow, made of the script: python tests/helpers/notebook.py

Cells of the script begin with ``# %%``; those with ``[markdown]`` hold text.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).resolve().parents[2] / "fmu_src/strandspring/examples/workflow.py"
NOTEBOOK = SCRIPT.with_suffix(".ipynb")


def notebook() -> str:
    """The text of the notebook; outputs are not kept."""
    cells: list[dict[str, Any]] = []
    for number, text in enumerate(SCRIPT.read_text(encoding="utf-8").split("# %%")[1:]):
        heading, _, source = text.partition("\n")
        cell = {"cell_type": "code", "id": f"cell-{number}", "metadata": {}, "execution_count": None, "outputs": []}
        if "[markdown]" in heading:
            cell = {"cell_type": "markdown", "id": f"cell-{number}", "metadata": {}}
            source = "\n".join(line.removeprefix("#").removeprefix(" ") for line in source.strip().splitlines())
        cells.append(cell | {"source": source.strip()})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    content = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    NOTEBOOK.write_text(notebook(), encoding="utf-8")
