"""The notebook of the workflow, made of the script: python tests/helpers/notebook.py

Cells of the script begin with ``# %%``; those with ``[markdown]`` hold text.
"""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).resolve().parents[2] / "fmu_src/strandspring/examples/workflow.py"
NOTEBOOK = SCRIPT.with_suffix(".ipynb")


def cells() -> list[dict[str, Any]]:
    """The cells of the script in the form of a notebook."""
    found = []
    for number, text in enumerate(SCRIPT.read_text(encoding="utf-8").split("# %%")[1:]):
        heading, _, body = text.partition("\n")
        common = {"id": f"cell-{number}", "metadata": {}}
        if "[markdown]" in heading:
            lines = [line.removeprefix("#").removeprefix(" ") for line in body.strip().splitlines()]
            found.append({"cell_type": "markdown", **common, "source": "\n".join(lines)})
        else:
            ast.parse(body)
            code = {"execution_count": None, "outputs": [], "source": body.strip()}
            found.append({"cell_type": "code", **common, **code})
    return found


def notebook() -> str:
    """The text of the notebook; outputs are not kept."""
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    content = {"cells": cells(), "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    NOTEBOOK.write_text(notebook(), encoding="utf-8")
