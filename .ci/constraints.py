"""Write .ci/constraints.txt: the exact version of every dependency, extras and tools of the tests included.

usage: python .ci/constraints.py, at a release and when pyproject.toml asks for something else; uv must be on the path

The newest versions that pyproject.toml allows, for every Python and system that it supports, in one resolution.
.ci/run tests with them; .ci/versions tests with the lowest and the newest.
"""

import re
import subprocess
from pathlib import Path

import tomllib

ROOT = Path(__file__).parents[1]

HEADER = """\
# Exact versions with which this release is tested, for every supported Python and system:
#     pip install -c .ci/constraints.txt strandspring[formats,cluster]
# Written by .ci/constraints.py.
"""


def main() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (oldest,) = re.findall(r">=(3\.\d+)", project["requires-python"])
    resolved = subprocess.run(
        ["uv", "pip", "compile", "--quiet", "--universal", "--python-version", oldest, "--all-extras", "--upgrade",
         "--no-header", "--annotation-style", "line", "--no-emit-index-url", "--no-emit-find-links", "pyproject.toml"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    (ROOT / ".ci" / "constraints.txt").write_text(HEADER + resolved, encoding="utf-8")


if __name__ == "__main__":
    main()
