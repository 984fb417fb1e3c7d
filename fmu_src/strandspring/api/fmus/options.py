"""FMUs: how they are built (`BuildOptions`), checked beside their place, and put there together if all are good."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, TypeAlias

from ...errors import BuildError, OptionError, StrandspringError
from ...fmu.native.platforms import PLATFORMS, PYTHON_PLATFORMS, Platform, chosen_platforms
from ...ground.files import existing_folder, reason_of, refuse_unwritable
from ...ground.options import changed, check, described, option
from ...ground.scratch import TemporaryFolder
from ..common.model_source import Progress, unseen

if TYPE_CHECKING:
    from ...fmu.checks.check import CheckReport
    from ...fmu.related_files import BuildSettings

Kind: TypeAlias = Literal["native", "python", "states"]

_LONGEST_AUTHOR = 200
# What each kind of FMU is for.
_PURPOSES = {
    "native": "native: for any simulator, with no Python on its machine",
    "states": "native with states: model exchange for optimal control, linearisation and functional importers",
    "python": "Python-backed: the model as readable Python, for simulators that run on Python",
    "system": "bodies on mounts: co-simulation in any simulator, with no Python on its machine",
}


def checked_author(author: str) -> str:
    """The author; raises BuildError if it is not a short printable text."""
    if len(author) > _LONGEST_AUTHOR or not author.isprintable():
        raise BuildError(f"The author must be printable text of at most {_LONGEST_AUTHOR} characters.")
    return author


@described
@dataclass(frozen=True)
class BuildOptions:
    """How FMUs are built; what is not asked for is taken from the FMU that is the source, if it is one.

    Raises
    ------
    BuildError   If a value is none of these, or a platform is unknown.
    TypeError    If a truth value is none.
    """

    group: ClassVar[str] = "FMU"

    backend: str | None = option(
        None, "choice", "native: NAME.fmu, which runs anywhere; python: NAME_python.fmu, for simulators on Linux "
        "x86-64 and Windows that run on Python 3.10 or newer, or have loaded its shared library", otherwise="native",
        choices=("native", "python", "both", "states"),
    )  # fmt: skip
    states: bool = option(
        False, "flag", "Build NAME_states.fmu: native model exchange with omega and absorbed_energy as continuous "
        "states and velocity as a second input, for importers that evaluate FMUs as functions, CasADi among them",
    )  # fmt: skip
    fmi: int | None = option(
        None, "whole", "Version of FMI. 3: NAME_fmi3.fmu, with a flange as terminal; native only", least=2, most=3,
        otherwise="that of the FMU that is rebuilt, else 2", metavar="2|3",
    )  # fmt: skip
    real_time: bool = option(
        False, "flag", "Build native FMUs, NAME_real_time.fmu, for targets with a deadline: they allocate nothing once "
        "instantiated",
    )  # fmt: skip
    no_energy: bool = option(False, "flag", "Leave the output absorbed_energy out of an FMU for real time")
    arrays: bool = option(False, "flag", "With FMI 3: coefficients as arrays, which few importers read", rare=True)
    platforms: str | Sequence[str] | None = option(
        None, "text", f"Of the binaries of native FMUs: host, all, or some of {', '.join(PLATFORMS)}",
        otherwise="all in an installed package, host in a source checkout", metavar="NAME,...",
        checks=lambda names: chosen_platforms(names if isinstance(names, str) else ",".join(names)),
    )  # fmt: skip
    author: str = option("", "text", "Author of the FMU, for its model description", checks=checked_author)
    needs_execution_tool: bool = option(
        False, "flag", "Declare in the Python-backed FMU that Python must be installed on the simulator's machine; "
        "some importers, PyFMI among them, refuse an FMU that declares it", rare=True,
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self, BuildError)

    @property
    def chosen_platforms(self) -> Sequence[Platform] | None:
        """The platforms; None for those by default."""
        names = self.platforms
        return None if names is None else chosen_platforms(names if isinstance(names, str) else ",".join(names))

    @property
    def version(self) -> int:
        """The version of FMI that is built."""
        return self.fmi or 2

    @property
    def apart(self) -> list[str]:
        """What sets native FMUs apart from the usual ones, in words."""
        of_energy = " without absorbed_energy" if self.no_energy else ""
        return [
            *(["FMI 3.0" + (" with arrays" if self.arrays else "")] if self.version == 3 else []),
            *([f"for real time{of_energy}"] if self.real_time else []),
        ]

    def kinds(self, has_sources: bool) -> tuple[Kind, ...]:
        """The kinds of FMU to be built; of the bundled record those of both back ends. Raises OptionError if what is
        wanted does not go together.
        """
        usual = "native" if has_sources or self.version == 3 or self.real_time else "both"
        backend: Any = self.backend or usual
        backends = ("native", "python") if backend == "both" else (backend,)
        if self.needs_execution_tool and "python" not in backends:
            sentence = "{to[needs_execution_tool=True]} is for the Python-backed FMU; add {to[backend=python]}."
            raise OptionError(sentence, backends=backends)
        kinds = tuple(dict.fromkeys((*backends, "states"))) if self.states else backends
        try:
            self.refuse_impossible(kinds)
        except BuildError as refusal:
            raise OptionError(str(refusal)) from None
        return kinds

    def with_those_of(self, before: BuildSettings | None) -> BuildOptions:
        """These and, where nothing was asked for, those of the FMU that is the source, if it is one."""
        if before is None:
            return self
        names = ["backend", "author"]
        if self.backend in (None, before.backend, "both"):
            names += ["needs_execution_tool"]
        if self.backend in (None, before.backend):
            names += ["fmi", "real_time", "no_energy", *([] if self.fmi == 2 else ["arrays"])]  # FMI 2.0 has no arrays
        return replace(self, **{name: getattr(self, name) or getattr(before, name) for name in names})

    def refuse_impossible(self, kinds: Sequence[Kind]) -> None:
        """Raise BuildError if FMUs of these kinds cannot be built so."""
        has_python = "python" in kinds
        for is_impossible, sentence in (
            (has_python and self.fmi == 3, "FMI 3.0 is for the native FMU; choose the native back end."),
            (has_python and self.real_time, "Real time is for the native FMU; choose the native back end."),
            (self.arrays and self.version != 3, "Arrays are for FMI 3.0; ask for FMI 3, too."),
            (
                self.no_energy and not self.real_time,
                "Only an FMU for real time can leave out absorbed_energy; ask for real time, too.",
            ),
            (
                self.no_energy and "states" in kinds,
                "The form with states has absorbed_energy as a state, which the host integrates; build it without "
                "leaving out the energy, from the model file where the source is an FMU that leaves it out.",
            ),
            (
                set(kinds) == {"python"} and self.platforms is not None,
                f"Platforms are chosen for the native FMU; the Python-backed one has {' and '.join(PYTHON_PLATFORMS)}: "
                "build it without choosing any.",
            ),
        ):
            if is_impossible:
                raise BuildError(sentence)

    def target(self, folder: str | Path, name: str, kind: str) -> Path:
        """Where an FMU of this kind of a model of this name is written."""
        from ...fmu.archive import fmu_path  # slow to import

        return fmu_path(folder, name, kind, self.version, self.real_time)

    @property
    def of_springs(self) -> dict[str, Any]:
        """What is asked for that the FMU of a system does not have."""
        return {name: value for name, value in changed(self).items() if name not in ("fmi", "platforms", "author")}


class BuiltFmu(NamedTuple):
    """An FMU in its place, and what its check found."""

    path: Path
    kind: str
    check: CheckReport

    @property
    def binaries(self) -> dict[str, int]:
        """Bytes of the binaries by their platforms."""
        from ...fmu.archive import binary_sizes  # slow to import

        return binary_sizes(self.path)

    def facts(self, settings: BuildOptions) -> dict[str, Any]:
        """For JSON."""
        return {
            "path": str(self.path),
            "backend": "native" if self.kind == "system" else self.kind,
            "fmi": settings.version,
            "binaries": self.binaries,
            "check": self.check.summary,
        }

    def brief(self, settings: BuildOptions) -> str:
        """In few words."""
        facts = [f"{self.path.stat().st_size / 1024:.0f} KiB", *self.binaries, *settings.apart]
        return f"FMU: {self.path} ({', '.join(facts)}): {self.check.verdict}"

    def text_lines(self, settings: BuildOptions) -> list[str]:
        """In words."""
        binaries = ", ".join(f"{platform} {size / 1024:.0f} KiB" for platform, size in self.binaries.items())
        purpose = "; ".join((_PURPOSES[self.kind], *settings.apart))
        return [
            f"FMU: {self.path} ({self.path.stat().st_size / 1024:.0f} KiB), {purpose}",
            f"Binaries: {binaries}",
            f"Check: {self.check.summary}",
        ]


@dataclass(frozen=True)
class FmuJob:
    """One FMU to be built."""

    target: Path  # its place
    kind: str  # of `_PURPOSES`
    build: Callable[[Path], Path]  # writes it into a folder, under the name that its place has
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
