"""The command line as a test runs it."""

from __future__ import annotations

import re

import pytest

from strandspring.cli.main import main


def unfolded(text: str) -> str:
    """Sentences on standard error, each in one line."""
    return re.sub(r"\n {2,}", " ", text)


class Terminal:
    """The command line in a folder of its own, with what it printed last."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys
        self.out = self.err = self.printed = ""

    def __call__(self, *arguments: str, status: int = 0) -> str:
        self._capsys.readouterr()
        left = 0
        try:
            main(arguments)
        except SystemExit as leaving:
            left = int(leaving.code or 0)
        self.out, err = self._capsys.readouterr()
        self.printed, self.err = self.out + err, unfolded(err)
        assert left == status, self.err
        assert "Traceback" not in self.err
        return self.out
