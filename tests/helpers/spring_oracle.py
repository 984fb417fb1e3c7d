"""`oracles.OracleSpring` for programs that see this folder only."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))

from oracles import OracleSpring

__all__ = ["OracleSpring"]
