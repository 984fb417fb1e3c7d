"""`verify`: whether an FMU is as it was built and answers as it should."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from ...fmu.checks.verification import Check, verify_fmu
from ...ground.result_columns import ResultColumn
from ..common.result import Result
from ..common.table import Table

_CHECKS = tuple(ResultColumn(key, "", key) for key in ("about", "text", "is_problem"))


@dataclass(frozen=True, repr=False)
class Verification(Result):
    """What was checked of one FMU.

    Attributes
    ----------
    path : str                     Of the FMU.
    checks : tuple of Check   Each says what was looked at, one sentence, and whether it speaks against the FMU.
    """

    path: str
    checks: tuple[Check, ...]

    _stated: ClassVar[Mapping[str, Any]] = {}

    @property
    def problems(self) -> tuple[Check, ...]:
        """Checks that speak against the FMU."""
        return tuple(check for check in self.checks if check.is_problem)

    @property
    def ok(self) -> bool:
        """Whether nothing speaks against the FMU."""
        return not self.problems

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - all checks are worth a line
        """All checks in words, and as a table of files."""
        yield self.path
        yield from (f"  {check.about}: {check.text}" for check in self.checks)
        yield Table(_CHECKS, self.checks)

    def content(self) -> Mapping[str, Any]:
        """The path and the checks."""
        return vars(self)


def verify(fmu: str | os.PathLike[str]) -> Verification:
    """Verify an FMU on this computer.

    Compares every file with the hash that was written when the FMU was built, the model description with FMI's rules,
    the spring with its certificate, which is the range of force that its records support, and co-simulation and model
    exchange with the reference result that the FMU carries. An FMU with a changed file is not run, except for binaries
    that were added to or compiled anew from the sources of the same FMU: they are named and run. The hashes show
    damage, not who built it: run FMUs of people you trust only.

    Parameters
    ----------
    fmu : path

    Returns
    -------
    Verification

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import Spring, SpringParameters, build_fmu, verify
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> with TemporaryDirectory() as folder:
    ...     verification = verify(build_fmu(spring, folder))
    >>> verification.ok
    True
    >>> [check.about for check in verification.checks]
    ['files', 'rules', 'spring', 'run']
    """
    return Verification(os.fspath(fmu), tuple(verify_fmu(Path(fmu))))
