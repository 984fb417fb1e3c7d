"""The name under which benchmarks know an oracle."""

from oracles import Shaken, shaken

__all__ = ["Shaken", "shaken"]
