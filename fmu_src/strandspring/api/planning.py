"""`plan`: the test that a rig should run next, chosen for what is still undecided about a spring."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..campaigns.planning.blocks import Block
from ..campaigns.planning.figures import pace_of
from ..campaigns.planning.limits import Limits
from ..campaigns.planning.planned import Planned, PlannedBlock, planned
from ..campaigns.planning.prior import Prior, prior_of_model, prior_of_stiffness
from ..errors import OptionError
from ..findings import Finding, Outcome
from ..ground.arguments import number
from ..ground.files import write_csv
from ..ground.one_thread import one_thread
from ..ground.options import takes
from ..ground.result_columns import ResultColumn, columns_of
from ..identification.identified import IdentifiedModel
from ..kernel.arrays import FloatArray
from ..loops.campaign import RateVerdict, campaign_verdicts
from ..loops.reading import Reading
from ..model.modelfile import ModelFile, is_model_path
from .common.given import Source, given_records
from .common.model_source import ModelSource, model_of, path_of
from .common.result import PlottedResult, Table
from .identification import identify

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_QUIET = 4.0  # time of the largest loop where no velocity is known [s]
_BLOCKS = (
    ResultColumn("kind", "", "kind"),
    ResultColumn("cycles", "1", "cycles"),
    ResultColumn("rest", "s", "rest"),
    *columns_of(PlannedBlock),
)
_FIGURES = (
    ResultColumn("quantity", "", "quantity", "figure"),
    ResultColumn("of", "", "of what", "of"),
    *columns_of(PlannedBlock)[-2:],
)
_RATES = (RateVerdict.INDEPENDENT, RateVerdict.LITTLE, RateVerdict.DEPENDENT)


class Program(NamedTuple):
    """What a rig is to run: times at a constant step, shape (K,) [s], and displacements, shape (K,) [m]."""

    time: FloatArray
    displacement: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class TestPlan(PlottedResult, Planned):
    """A test: its blocks, what each decides, and how well the spring will be known; it has the attributes of a
    `Planned`, whose findings also say what was assumed.
    """

    __test__ = False  # no test of pytest
    _size = (9.0, 4.0)

    def program(self) -> Program:
        """The programme at the rig's sample rate; it begins and ends at rest in the middle of the range."""
        return Program(*self.path)

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the programme: time [s] and displacement [mm].

        Raises
        ------
        StrandspringError   If the file cannot be written.
        """
        time, displacement = self.program()
        rows = np.column_stack([time, 1e3 * displacement]).tolist()
        write_csv(Path(path), ["time [s]", "displacement [mm]"], ([float(f"{v:.9g}") for v in row] for row in rows))

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - all of it is short
        """The blocks with what they decide, and the intervals before and after."""
        content = self.content()
        low, high = (1e3 * end for end in content["displacement"])
        yield (
            f"Test for {self.name}: {self.duration:.4g} s, {low:.4g} to {high:.4g} mm, up to "
            f"{1e3 * content['velocity']:.3g} mm/s, {self.force[0]:.3g} to {self.force[1]:.3g} N"
        )
        yield from (content["blocks"], content["figures"])

    def content(self) -> dict[str, Any]:
        """The plan with its blocks and figures."""
        ends = [end for leg in self.legs for end in (leg.start, leg.end)]
        known = zip(self.figures, self.before.tolist(), self.after.tolist(), strict=True)
        figures = [{**vars(figure), "before": before, "after": after} for figure, before, after in known]
        blocks = [
            {**vars(block.block), **vars(block), "frequency": block.frequency or None, "block": _named(block.block)}
            for block in self.blocks
        ]
        return {
            "for": self.name,
            "duration": self.duration,
            "displacement": (min(ends), max(ends)),
            "velocity": max(block.velocity for block in self.blocks),
            "acceleration": max(leg.acceleration for leg in self.legs),
            "force": self.force,
            "sample_rate": self.limits.sample_rate,
            "speeds": {pace_of(speed): speed for speed in self.speeds},
            "blocks": Table(_BLOCKS, blocks),
            "figures": Table(_FIGURES, figures, "Half of the 95 % intervals, now and after the test:"),
        }

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw displacement over time into axes of matplotlib, those of a new figure if None."""
        (axes,) = self._axes(ax)
        time, displacement = self.program()
        for block in self.blocks:
            own = (time >= block.begin) & (time <= block.begin + block.duration)
            label = f"{block.block.kind} of {1e3 * block.amplitude:.3g} mm: {block.decides}"
            axes.plot(time[own], 1e3 * displacement[own], lw=1.0, label=label)
        axes.set(xlabel="time [s]", ylabel="displacement [mm]")
        axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
        return axes


@takes(limits=Limits, reading=Reading)
def plan(
    source: ModelSource | IdentifiedModel | Source | Sequence[Source] | None = None,
    *,
    stiffness: float | None = None,
    limits: Limits,
    reading: Reading,
) -> TestPlan:
    """The programme that decides most of what is open about a spring, within the limits of a rig.

    Full, minor and small loops, another rate and dwells are chosen one after the other for what each decides in its
    time. The programme ends where figures are known to 5 % (energies of the smallest loops and parameters to 10 %), or
    more time would decide little.

    Parameters
    ----------
    source : Spring, ModelFile, path, Identification, Record, or a sequence of records
        A model with the uncertainty of its file, or records, which are identified first; None with a stiffness.
    stiffness : float or None   Instead of a source: the rough stiffness [N/m], with the stroke.
    limits : Limits             What the rig can do, and how long it may take; or its fields as keywords.
    reading : Reading           How records are read and cut; or its fields as keywords.

    Returns
    -------
    TestPlan

    Raises
    ------
    StrandspringError   If there is no programme within the limits, or the source is no model and no record.
    ValueError          If a limit is impossible, or not one of source and stiffness is given.

    Examples
    --------
    >>> from strandspring import plan
    >>> test = plan(stiffness=20e3, stroke=(-0.02, 0.02), velocity=0.1, duration=60.0)
    >>> time, displacement = test.program()
    >>> bool(time[-1] <= 60.0 and displacement[0] == displacement[-1])
    True
    """
    prior, assumed = _prior(source, stiffness, limits, reading), list[Finding]()
    if limits.velocity is None:
        spring = prior.springs[0]
        velocity = prior.velocity or 2.0 * (spring.displacement_max - spring.displacement_min) / _QUIET
        origin = "that of the records" if prior.velocity else f"a loop over the whole range in {_QUIET:g} s"
        assumed = [Finding(Outcome.VELOCITY_ASSUMED, {"velocity": velocity, "origin": origin})]
        limits = replace(limits, velocity=velocity)
    with one_thread():  # for matrices as small as these more threads only cost
        chosen = planned(prior, limits)
    return TestPlan(**vars(chosen) | {"findings": (*assumed, *chosen.findings)})


def _prior(source: Any, stiffness: float | None, limits: Limits, reading: Reading) -> Prior:
    """What is known before the test."""
    if (source is None) == (stiffness is None):
        raise OptionError("Give either a model or records, or {to[stiffness]} with {to[stroke]}.", stiffness=stiffness)
    if stiffness is not None:
        value = number("stiffness", stiffness, "N/m")
        if not value > 0.0:
            raise OptionError(f"`stiffness` must be > 0 [N/m], got {value!r}.")
        if limits.stroke is None:
            raise OptionError("{to[stiffness]} needs {to[stroke]}.", stiffness=value)
        return prior_of_stiffness(value, *limits.stroke)
    if not isinstance(source, IdentifiedModel):
        if isinstance(source, ModelFile) or hasattr(source, "model") or is_model_path(path_of(source) or ""):
            return prior_of_model(model_of(source))
        source = identify(given_records(source, reading=reading))
    # The records say at which rates they were recorded.
    rate, _ = campaign_verdicts(source.records)
    speeds = [4.0 * loop.figures.amplitude * loop.frequency for loop in source.recorded if loop.frequency]
    rates = rate is not None and rate.verdict in _RATES
    prior = prior_of_model(source.model_file("spring"), rates, max(speeds, default=None))
    return replace(prior, name=", ".join(PurePath(record.path).name for record in source.records))


def _named(block: Block) -> str:
    """Such as: 3+3 fast loops."""
    if block.rest:
        return f"rests of {block.rest:.3g} s"
    count = f"{block.cycles}+{block.cycles}" if block.is_beside_usual else f"{block.cycles}"
    return f"{count} {'' if block.speed == 1.0 else f'{pace_of(block.speed)} '}loops"
