"""How FMUs are built, as users say it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

from ...errors import BuildError, OptionError
from ...fmu.native.platforms import PLATFORMS, PYTHON_PLATFORMS, Platform, chosen_platforms
from ...ground.options import check, described, option

if TYPE_CHECKING:
    from ...fmu.related_files import BuildSettings

Kind: TypeAlias = Literal["native", "python", "states"]

_LONGEST_AUTHOR = 200


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
    def apart(self) -> list[str]:
        """What sets native FMUs apart from the usual ones, in words."""
        of_energy = " without absorbed_energy" if self.no_energy else ""
        return [
            *(["FMI 3.0" + (" with arrays" if self.arrays else "")] if self.version == 3 else []),
            *([f"for real time{of_energy}"] if self.real_time else []),
        ]

    def kinds(self, has_sources: bool) -> tuple[Kind, ...]:
        """The kinds of FMU to be built; of the bundled record those of both back ends.

        Raises
        ------
        OptionError   If what is wanted does not go together.
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

    @property
    def version(self) -> int:
        """The version of FMI that is built."""
        return 2 if self.fmi is None else self.fmi

    def with_those_of(self, before: BuildSettings | None) -> BuildOptions:
        """These and, where nothing was asked for, those of the FMU that is the source, if it is one."""
        if before is None:
            return self
        options = replace(self, backend=self.backend or before.backend, author=self.author or before.author)
        if self.backend not in (None, before.backend, "both"):
            return options
        options = replace(options, needs_execution_tool=self.needs_execution_tool or before.needs_execution_tool)
        if self.backend == "both":
            return options
        return replace(
            options,
            fmi=self.fmi or before.fmi,
            real_time=self.real_time or before.real_time,
            no_energy=self.no_energy or before.no_energy,
            # FMI 2.0 has none.
            arrays=self.arrays or (before.arrays and self.fmi != 2),
        )

    def refuse_impossible(self, kinds: Sequence[Kind]) -> None:
        """Raise BuildError if FMUs of these kinds cannot be built so."""
        if "python" in kinds and self.fmi == 3:
            raise BuildError("FMI 3.0 is for the native FMU; choose the native back end.")
        if "python" in kinds and self.real_time:
            raise BuildError("Real time is for the native FMU; choose the native back end.")
        if self.arrays and self.version != 3:
            raise BuildError("Arrays are for FMI 3.0; ask for FMI 3, too.")
        if self.no_energy and not self.real_time:
            raise BuildError("Only an FMU for real time can leave out absorbed_energy; ask for real time, too.")
        if self.no_energy and "states" in kinds:
            raise BuildError(
                "The form with states has absorbed_energy as a state, which the host integrates; build it without "
                "leaving out the energy, from the model file where the source is an FMU that leaves it out."
            )
        if set(kinds) == {"python"} and self.platforms is not None:
            raise BuildError(
                f"Platforms are chosen for the native FMU; the Python-backed one has {' and '.join(PYTHON_PLATFORMS)}: "
                "build it without choosing any."
            )
