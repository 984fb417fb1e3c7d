"""Options shared by the commands about a mass on a mount, or bodies on mounts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import click

from ...vibration.one_mass.band import checked_limits
from ...vibration.one_mass.system import MOST_SPRINGS, Excitation
from .option_types import Command, FiniteRange, checked_by, together
from .option_types import positive as positive
from .paths import PLOT_FILE

EXCITATIONS = tuple(excitation.value.replace(" ", "_") for excitation in Excitation)

# Options of the mount and its load, named as in `IsolatedMass`.
mount_options = together(
    click.option("--load", type=FiniteRange(unit="N"), metavar="N",
                 help="Static load along the axis [N].  [default: the weight]"),
    click.option("--parallel", type=click.IntRange(1, MOST_SPRINGS), default=1, show_default=True,
                 help="Rows of springs side by side."),
    click.option("--series", type=click.IntRange(1, MOST_SPRINGS), default=1, show_default=True,
                 help="Springs in series in each row."),
    click.option("--damping", type=FiniteRange(min=0.0, unit="N s/m"), default=0.0, show_default=True,
                 metavar="N*S/M", help="Viscous damping in parallel with the springs [N s/m]."),
)  # fmt: skip


def level_options(values: Callable[[FiniteRange], Any], how: str, default: str = "") -> Callable[[Command], Command]:
    """Options of the three excitations, for `chosen_levels`.

    Parameters
    ----------
    values : callable     Makes the type of the option from the type of one level.
    how : str             How to give several levels, for the help.
    default : str         The default, for the help.
    """
    return together(
        click.option("--base-displacement", type=values(positive("mm", 1e-3)), multiple=True, metavar="MM",
                     help=f"Displacement amplitude of the base [mm]; {how}.{default}"),
        click.option("--base-acceleration", type=values(positive("m/s^2")), multiple=True, metavar="M/S2",
                     help=f"Acceleration amplitude of the base [m/s^2]; {how}."),
        click.option("--force", type=values(positive("N")), multiple=True, metavar="N",
                     help=f"Amplitude of a force on the mass [N]; {how}."),
    )  # fmt: skip


def curve_options(points: int) -> Callable[[Command], Command]:
    """Options of the frequency band, with the default number of points."""
    return together(
        click.option("--band", type=(float, float), metavar="LOW HIGH", callback=checked_by(checked_limits),
                     help="Frequency band [Hz].  [default: 0.23 to 5 times the natural frequency of small "
                     "motion]"),
        click.option("--points", type=click.IntRange(2, 100_000), default=points, show_default=True,
                     help="Number of frequencies, logarithmically spaced."),
        click.option("--extrapolate", is_flag=True,
                     help="Continue where the motion leaves the identified range, instead of refusing."),
    )  # fmt: skip


def system_options(of: str = "") -> Callable[[Command], Command]:
    """Options of how a SYSTEM.toml is simulated; `of` stands before the help of each."""
    return together(
        click.option("--case", "cases", multiple=True, metavar="NAME",
                     help=f"{of}Only this load case, in all its directions; repeat for more."),
        click.option("--candidate", "candidates", multiple=True, metavar="NAME",
                     help=f"{of}Only this candidate; repeat for more."),
        click.option("--step", type=positive("s"), metavar="S",
                     help=f"{of}Time step of the coarser of two runs [s].  [default: the file's, or found for errors "
                     "of 0.1 %]"),
        click.option("--plot", type=PLOT_FILE, metavar="FILE.png",
                     help=f"{of}Plot acceleration against stroke, with verdicts (.png, .svg or .pdf)."),
    )  # fmt: skip


def chosen_levels(given: Mapping[str, Sequence[float]]) -> dict[str, Any]:
    """The levels of the one excitation that has some, by its name; raises click.UsageError if several have."""
    chosen: dict[str, Any] = {option: levels for option, levels in given.items() if levels}
    if len(chosen) > 1:
        names = " and ".join("--" + option.replace("_", "-") for option in chosen)
        raise click.UsageError(f"{names} exclude each other; give one of them.")
    return chosen
