"""The mark of the longer cases."""

from __future__ import annotations

import pytest


def pytest_configure(config: pytest.Config) -> None:
    """Known here too, so that this folder can be run by itself."""
    config.addinivalue_line("markers", "slow: takes more than about a second")
