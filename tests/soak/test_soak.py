"""A small share of the soak: soak.py does the whole."""

from __future__ import annotations

import mmap
import subprocess
import sys
from pathlib import Path

import pytest

import soak

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")


def test_growth_of_memory_is_noticed() -> None:
    kept = []

    def grow(_: int) -> None:
        # From the system, whatever else this process has freed.
        kept.append(mmap.mmap(-1, 300_000))
        kept[-1].write(b"x" * 300_000)

    growing = soak.soak(grow, 200)
    assert growing.second_half > soak.LIMIT
    assert growing.per_thousand == pytest.approx(300_000.0, rel=0.2)
    assert soak.soak(lambda _: bytearray(7300), 2000).second_half < 200


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "count"), [("native-steps", 100_000), ("native-lives", 1000), ("python-steps", 10_000)]
)
def test_memory_stays_flat(task: str, count: int) -> None:
    command = [sys.executable, Path(__file__).with_name("soak.py"), task, "--count", str(count)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
