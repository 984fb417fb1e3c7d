"""FMUs are built beside their place, checked, and put there together if all are good."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from ...errors import BuildError, StrandspringError
from ...fmu.archive import binary_sizes
from ...fmu.checks.check import CheckReport
from ...ground.files import existing_folder, reason_of, refuse_unwritable
from ...ground.scratch import TemporaryFolder
from ..common.progress import Progress, unseen
from .options import BuildOptions

# What each kind of FMU is for.
_PURPOSES = {
    "native": "native: for any simulator, with no Python on its machine",
    "states": "native with states: model exchange for optimal control, linearisation and functional importers",
    "python": "Python-backed: the model as readable Python, for simulators that run on Python",
    "system": "bodies on mounts: co-simulation in any simulator, with no Python on its machine",
}


class BuiltFmu(NamedTuple):
    """An FMU in its place, and what its check found."""

    path: Path
    kind: str
    check: CheckReport

    def facts(self, settings: BuildOptions) -> dict[str, Any]:
        """For JSON."""
        return {
            "path": str(self.path),
            "backend": "native" if self.kind == "system" else self.kind,
            "fmi": settings.version,
            "binaries": binary_sizes(self.path),
            "check": self.check.summary,
        }

    def brief(self, settings: BuildOptions) -> str:
        """In few words."""
        facts = [f"{self.path.stat().st_size / 1024:.0f} KiB", *binary_sizes(self.path), *settings.apart]
        return f"FMU: {self.path} ({', '.join(facts)}): {self.check.verdict}"

    def text_lines(self, settings: BuildOptions) -> list[str]:
        """In words."""
        binaries = ", ".join(f"{platform} {size / 1024:.0f} KiB" for platform, size in binary_sizes(self.path).items())
        purpose = "; ".join((_PURPOSES[self.kind], *settings.apart))
        return [
            f"FMU: {self.path} ({self.path.stat().st_size / 1024:.0f} KiB), {purpose}",
            f"Binaries: {binaries}",
            f"Check: {self.check.summary}",
        ]


@dataclass(frozen=True)
class FmuJob:
    """One FMU to be built.

    Attributes
    ----------
    target : Path         Its place.
    kind : str            What it is, for people.
    build : callable      Writes it into a folder, under the name that its place has.
    examine : callable    Its check.
    """

    target: Path
    kind: str
    build: Callable[[Path], Path]
    examine: Callable[[Path], CheckReport]


def build_in_place(folder: Path, jobs: Sequence[FmuJob], progress: Progress = unseen) -> list[BuiltFmu]:
    """Build FMUs, check them, and put them into a folder if all are good.

    Raises
    ------
    StrandspringError   If the folder is not writable, or an FMU cannot be built.
    BuildError          If an FMU is not valid or answers otherwise than the model; nothing is then left behind.
    """
    refuse_unwritable(folder, is_folder=True)
    for job in jobs:
        refuse_unwritable(job.target)
    built = []
    # In the same file system as its place, so that it is moved at once or not at all.
    with TemporaryFolder(existing_folder(folder)) as beside:
        for count, job in enumerate(jobs):
            progress(f"Building {job.target.name}", 2 * count, 2 * len(jobs))
            fmu = job.build(beside)
            progress(f"Validating and running {job.target.name}", 2 * count + 1, 2 * len(jobs))
            report = job.examine(fmu)
            if report.problems:
                raise BuildError(f"{job.target} was not written, because the FMU failed its check: {report.summary}")
            built.append((fmu, BuiltFmu(job.target, job.kind, replace(report, path=job.target))))
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for fmu, built_fmu in built:
                fmu.replace(built_fmu.path)
        except OSError as problem:
            raise StrandspringError(
                f"{folder} cannot be written: {reason_of(problem)}; check the rights there."
            ) from None
    return [built_fmu for _, built_fmu in built]
