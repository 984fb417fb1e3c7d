"""How FMUs are built: `BuildOptions`; light to import, as commands are made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

from ...errors import BuildError, OptionError
from ...fmu.native.platforms import PLATFORMS, PYTHON_PLATFORMS, Platform, chosen_platforms
from ...ground.options import check, described, option

if TYPE_CHECKING:
    from ...fmu.related_files import BuildSettings

_LONGEST_AUTHOR = 200


def _checked_author(author: str) -> None:
    if len(author) > _LONGEST_AUTHOR or not author.isprintable():
        raise BuildError(f"The author must be printable text of at most {_LONGEST_AUTHOR} characters.")


def _platforms(names: str | Sequence[str]) -> tuple[Platform, ...]:
    return chosen_platforms(names if isinstance(names, str) else ",".join(names))


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
        None,
        "choice",
        "native: NAME.fmu, which runs anywhere; python: NAME_python.fmu, for simulators on Linux "
        "x86-64 and Windows that run on Python 3.10 or newer, or have loaded its shared library",
        otherwise="native",
        choices=("native", "python", "both", "states"),
    )
    states: bool = option(
        False,
        "flag",
        "Build NAME_states.fmu: native model exchange with omega and absorbed_energy as continuous "
        "states and velocity as a second input, for importers that evaluate FMUs as functions, CasADi among them",
    )
    fmi: int | None = option(
        None,
        "whole",
        "Version of FMI. 3: NAME_fmi3.fmu, with a flange as terminal; native only",
        least=2,
        most=3,
        otherwise="that of the FMU that is rebuilt, else 2",
        metavar="2|3",
    )
    platforms: str | Sequence[str] | None = option(
        None,
        "text",
        f"Of the binaries of native FMUs: host, all, or some of {', '.join(PLATFORMS)}",
        otherwise="all in an installed package, host in a source checkout",
        metavar="NAME,...",
        checks=_platforms,
    )
    author: str = option("", "text", "Author of the FMU, for its model description", checks=_checked_author)
    needs_execution_tool: bool = option(
        False,
        "flag",
        "Declare in the Python-backed FMU that Python must be installed on the simulator's machine; "
        "some importers, PyFMI among them, refuse an FMU that declares it",
        rare=True,
    )

    def __post_init__(self) -> None:
        check(self, BuildError)

    @property
    def chosen_platforms(self) -> Sequence[Platform] | None:
        """The platforms; None for those by default."""
        return None if self.platforms is None else _platforms(self.platforms)

    @property
    def version(self) -> int:
        """The version of FMI that is built."""
        return self.fmi or 2

    def kinds(self) -> tuple[str, ...]:
        """The kinds of FMU to be built.

        Raises
        ------
        OptionError   If such FMUs cannot be built so.
        """
        kinds = ("native", "python") if self.backend == "both" else (self.backend or "native",)
        kinds = tuple(dict.fromkeys((*kinds, "states"))) if self.states else kinds
        if self.needs_execution_tool and "python" not in kinds:
            name, what = "needs_execution_tool", "the Python-backed FMU; add {to[backend=python]}"
        elif self.version == 3 and "python" in kinds:
            name, what = "fmi=3", "the native FMU; choose that back end"
        elif self.platforms and kinds == ("python",):
            name, what = "platforms", f"native FMUs (others have {' and '.join(PYTHON_PLATFORMS)}); build such"
        else:
            return kinds
        raise OptionError(f"{{to[{name}]}} is for {what}, or leave it out.", kinds=kinds)

    def with_those_of(self, before: BuildSettings | None) -> BuildOptions:
        """These and, where nothing was asked for, those of the FMU that is the source, if it is one."""
        if before is None:
            return self
        names = ["backend", "author"]
        if self.backend in (None, before.backend, "both"):
            names += ["needs_execution_tool"]
        if self.backend in (None, before.backend):
            names += ["fmi"]
        return replace(self, **{name: getattr(self, name) or getattr(before, name) for name in names})
