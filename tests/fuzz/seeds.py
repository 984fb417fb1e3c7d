"""Where random trials begin: at the commit, so that each change tries others, or where the last long run ended."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def seed_of_commit() -> int:
    """From the hash of the commit; without git, or with STRANDSPRING_FUZZ_SEED, that of the variable or 1."""
    if given := os.environ.get("STRANDSPRING_FUZZ_SEED"):
        return int(given)
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False)
    return int(done.stdout[:7], 16) if done.returncode == 0 else 1


SEED = seed_of_commit()
