"""`plan`: the test that a rig should run next, chosen for what is still undecided about a spring."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, NamedTuple

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
from ..ground.result_columns import ResultColumn
from ..identification.identified import IdentifiedModel
from ..kernel.arrays import FloatArray
from ..loops.campaign import RateVerdict, campaign_verdicts
from ..loops.cycles import MeasuredLoop
from ..loops.reading import Reading
from ..model.modelfile import ModelFile, is_model_path
from .common.given import Source, given_records
from .common.model_source import ModelSource, model_of
from .common.result import PlottedResult
from .common.table import Table
from .identification import identify

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LARGEST_STIFFNESS = 1e15  # [N/m]
_QUIET = 4.0  # time of the largest loop where no velocity is known [s]
_UNDECIDED = 0.995  # interval from which nothing is known, below which two digits say it
_INTERVALS = (
    ResultColumn("before", "1", "half of the 95 % interval before, over the value"),
    ResultColumn("after", "1", "half of the 95 % interval after, over the value"),
    ResultColumn("now", "1", "", "now", "%"),
    ResultColumn("then", "1", "", "then", "%"),
)
_BLOCKS = (
    ResultColumn("block", "", "", "block"),
    ResultColumn("kind", "", "kind"),
    ResultColumn("amplitude", "m", "amplitude", "+-", "mm", 1e3, 3),
    ResultColumn("centre", "m", "centre", "at", "mm", 1e3),
    ResultColumn("cycles", "1", "cycles"),
    ResultColumn("velocity", "m/s", "mean velocity"),
    ResultColumn("frequency", "Hz", "frequency"),
    ResultColumn("rest", "s", "rest"),
    ResultColumn("begin", "s", "begin"),
    ResultColumn("duration", "s", "duration", "time", "s", digits=3),
    ResultColumn("decides", "", "what it decides most", "decides most"),
    *_INTERVALS,
)
_FIGURES = (
    ResultColumn("quantity", "", "quantity", "figure"),
    ResultColumn("of", "", "of what", "of"),
    *_INTERVALS,
)
_RATES = (RateVerdict.INDEPENDENT, RateVerdict.LITTLE, RateVerdict.DEPENDENT)


class Program(NamedTuple):
    """What a rig is to run: times from 0 at a constant step, shape (K,) [s], and displacements, shape (K,) [m]."""

    time: FloatArray
    displacement: FloatArray


class TestPlan(PlottedResult):
    """A test: its blocks, what each of them decides, and how well the figures of the spring will be known.

    Attributes
    ----------
    plan : Planned
    findings : tuple of Finding   What was assumed of the rig, and what its limits leave.
    """

    __test__ = False  # no test of pytest
    _size = (9.0, 4.0)

    def __init__(self, plan: Planned, assumed: tuple[Finding, ...] = ()) -> None:
        self.plan = plan
        self.findings = (*assumed, *plan.findings)

    @property
    def blocks(self) -> tuple[PlannedBlock, ...]:
        """The blocks in their order."""
        return self.plan.blocks

    def program(self) -> Program:
        """The programme at the rig's sample rate; it begins and ends at rest in the middle of the range."""
        return Program(*self.plan.path)

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the programme: time [s] and displacement [mm].

        Raises
        ------
        StrandspringError   If the file cannot be written.
        """
        time, displacement = self.program()
        rows = zip(time.tolist(), (1e3 * displacement).tolist(), strict=True)
        write_csv(Path(path), ["time [s]", "displacement [mm]"], (map(_rounded, row) for row in rows))

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - all of it is short
        """The blocks with what they decide, and the intervals before and after."""
        plan = self.plan
        low, high = (1e3 * end for end in self._ends)
        fastest = 1e3 * max(block.velocity for block in plan.blocks)
        yield (
            f"Test for {plan.name}: {plan.duration:.4g} s, {low:.4g} to {high:.4g} mm, up to {fastest:.3g} mm/s, "
            f"{plan.force[0]:.3g} to {plan.force[1]:.3g} N"
        )
        yield Table(_BLOCKS, [_row(block) for block in plan.blocks])
        yield self._figures

    @property
    def _ends(self) -> tuple[float, float]:
        """Least and greatest displacement [m]."""
        ends = [end for leg in self.plan.legs for end in (leg.start, leg.end)]
        return min(ends), max(ends)

    @property
    def _figures(self) -> Table:
        """How well the figures of the spring are known, and will be."""
        plan = self.plan
        rows = [
            {"quantity": figure.quantity, "of": figure.of, **_known(float(before), float(after))}
            for figure, before, after in zip(plan.figures, plan.before, plan.after, strict=True)
        ]
        return Table(_FIGURES, rows, "Half of the 95 % intervals, now and after the test:")

    def content(self) -> dict[str, Any]:
        """The plan with its blocks and figures."""
        plan = self.plan
        return {
            "for": plan.name,
            "duration": plan.duration,
            "displacement": self._ends,
            "velocity": max(block.velocity for block in plan.blocks),
            "acceleration": max(leg.acceleration for leg in plan.legs),
            "force": plan.force,
            "sample_rate": plan.limits.sample_rate,
            "speeds": {pace_of(speed): speed for speed in plan.speeds},
            "blocks": self.table,
            "figures": self._figures,
        }

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw displacement over time into axes of matplotlib, those of a new figure if None."""
        (axes,) = self._axes(ax)
        time, displacement = self.program()
        for block in self.plan.blocks:
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
    """The displacement programme that decides most of what is open about a spring, within the limits of a rig.

    Blocks are chosen one after the other, each for the most that it decides in its time: full loops, minor loops at
    several places, small loops, another rate, dwells. Judged are the energy and stiffness of loops of 10 to 100 % of
    the amplitude and the parameters, by a prior that allows for further friction mechanisms, an amplifier of any form
    and relaxation. Where figures are known to 5 % (energies of the smallest loops and parameters to 10 %), or more
    time would decide little, the programme ends.

    Parameters
    ----------
    source : Spring, ModelFile, path, Identification, Record, or a sequence of records
        A model with the uncertainty of its file, or records, which are identified first; None with a stiffness.
    stiffness : float or None           Instead of a source: the rough stiffness [N/m], with the stroke.
    limits : Limits                     What the rig can do, and how long it may take; or its fields as keywords.
    reading : Reading                   How records are read, and what of them is used; or its fields as keywords.

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
    prior = _prior(source, stiffness, limits, reading)
    assumed: tuple[Finding, ...] = ()
    if limits.velocity is None:
        spring = prior.springs[0]
        width = spring.displacement_max - spring.displacement_min
        velocity = prior.velocity or 2.0 * width / _QUIET
        origin = "that of the records" if prior.velocity else f"a loop over the whole range in {_QUIET:g} s"
        assumed = (Finding(Outcome.VELOCITY_ASSUMED, {"velocity": velocity, "origin": origin}),)
        limits = replace(limits, velocity=velocity)
    with one_thread():  # for matrices as small as these more threads only cost
        return TestPlan(planned(prior, limits), assumed)


def _prior(source: Any, stiffness: float | None, limits: Limits, reading: Reading) -> Prior:
    """What is known before the test."""
    if (source is None) == (stiffness is None):
        raise OptionError("Give either a model or records, or {to[stiffness]} with {to[stroke]}.", stiffness=stiffness)
    if stiffness is not None:
        value = number("stiffness", stiffness, "N/m")
        if not 0.0 < value <= _LARGEST_STIFFNESS:
            raise OptionError(f"`stiffness` must be > 0 and at most {_LARGEST_STIFFNESS:g} [N/m], got {value!r}.")
        if limits.stroke is None:
            raise OptionError("{to[stiffness]} needs {to[stroke]}, over which the spring is tested.", stiffness=value)
        return prior_of_stiffness(value, *limits.stroke)
    if isinstance(source, IdentifiedModel):
        return _of_identified(source)
    if isinstance(source, ModelFile) or hasattr(source, "model") or is_model_path(_path(source)):
        return prior_of_model(model_of(source))
    return _of_identified(identify(given_records(source, reading=reading)))


def _path(source: Any) -> str:
    return os.fspath(source) if isinstance(source, str | os.PathLike) else ""


def _of_identified(identified: IdentifiedModel) -> Prior:
    """Of an identification, whose records say at which rates they were recorded."""
    rate = campaign_verdicts(identified.records)[0]
    rates = rate is not None and rate.verdict in _RATES
    names = ", ".join(PurePath(record.path).name for record in identified.records)
    prior = prior_of_model(identified.model_file("spring"), rates, _velocity(identified.recorded))
    return replace(prior, name=names)


def _velocity(loops: Sequence[MeasuredLoop]) -> float | None:
    """Largest mean velocity of the loops [m/s]; None without times."""
    return max((4.0 * loop.figures.amplitude * loop.frequency for loop in loops if loop.frequency), default=None)


def _row(block: PlannedBlock) -> dict[str, Any]:
    """Of the table of blocks."""
    of_block = block.block
    kind = "loops" if of_block.speed == 1.0 else f"{pace_of(of_block.speed)} loops"
    count = f"{of_block.cycles}+{of_block.cycles}" if of_block.is_beside_usual else f"{of_block.cycles}"
    return {
        "block": f"rests of {of_block.rest:.3g} s" if of_block.rest else f"{count} {kind}",
        "kind": of_block.kind,
        "amplitude": block.amplitude,
        "centre": block.centre,
        "cycles": of_block.cycles,
        "velocity": block.velocity,
        "frequency": block.frequency or None,
        "rest": of_block.rest,
        "begin": block.begin,
        "duration": block.duration,
        "decides": block.decides,
        **_known(block.before, block.after),
    }


def _known(before: float, after: float) -> dict[str, Any]:
    """Half-widths of 95 % intervals, also in percent."""
    return {"before": before, "after": after, "now": _percent(before), "then": _percent(after)}


def _rounded(value: float) -> float:
    return float(f"{value:.9g}")


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g}" if share < _UNDECIDED else ">100"
