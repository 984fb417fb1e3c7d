"""`compare`: two springs against each other and against the uncertainty of both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...errors import OptionError, StrandspringError
from ...findings import Finding
from ...ground.options import takes
from ...ground.result_columns import ResultColumn
from ...identification.figures import RecordFit, predict_record
from ...kernel.path import PathSolver
from ...loops.loop import PANELS, Loop, steady_loop
from ...loops.reading import Reading
from ...model.modelfile import ModelFile
from ...records.record import Record
from ..common.given import records_of
from ..common.model_source import ModelSource, model_of, source_of
from ..common.result import PlottedResult
from ..common.table import Table
from ..options import Align, Comparing
from ..vibration.isolation import SharedMass, shared_mass
from .comparison_words import (
    ComparisonVerdict,
    aligned,
    apart,
    comparison_findings,
    difference_table,
    joint_sentence,
    percent,
    shared_range,
    verdict_sentence,
)
from .differences import (
    FIGURES,
    HysteresisTest,
    SpringDifference,
    common_form,
    drawn,
    figure_differences,
    in_form,
    judged,
    loop_figures,
    parameter_differences,
    quantiles,
    spreads_of,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_SHARES = (0.25, 0.5, 0.75, 1.0)  # of the shared half range
_SLACK = 1e-3  # share of the shared range by which an amplitude may pass it, as cycles differ by as much
_AS_WELL = 0.05  # records are followed equally well if the errors differ by less
_COLORS = ("C0", "C3")
_FOLLOWED = (
    ResultColumn("record", "", "record", "record"),
    ResultColumn("better", "", "followed better by", "followed better by"),
    ResultColumn("a_rmse", "N", "rms error of A", "rmse of A", "N"),
    ResultColumn("b_rmse", "N", "rms error of B", "of B", "N"),
    ResultColumn("a_rnl", "1", "RNL of A", "RNL of A"),
    ResultColumn("b_rnl", "1", "RNL of B", "of B"),
)


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(PlottedResult):
    """Two springs against each other.

    Attributes
    ----------
    sources : (str, str)                   Path of each model file, or the model's name.
    models : (ModelFile, ModelFile)        A and B.
    align : "record" or "middle"           Where both count displacement from: as their records do, or each from the
                                           middle of its own range.
    low, high : float                      The range that both share, so counted [m].
    verdict : ComparisonVerdict
    unknown : str                          Why nothing can be judged, in words; else empty.
    draws, seed : int                      Springs drawn of each model, and the seed.
    parameters : tuple of SpringDifference Of kappa_omega in the middle of the shared range, rho, sigma and n, and of
                                           those of a second mechanism and branches if both springs have as many.
    test : HysteresisTest or None          Of these together.
    figures : tuple of SpringDifference    Of steady loops about the middle of the shared range.
    bands : (ndarray, ndarray) or None     5 % and 95 % of the figures of A and of B, each of shape
                                           (2, amplitudes, 4): secant stiffness, energy, loss factor, mean force.
    loops : (Loop, Loop)                   Steady loops over the shared range.
    mass : SharedMass                      Transmissibility of a mass on either spring.
    records : tuple of Record
    followed : tuple of (RecordFit, RecordFit)   How well A and B follow each record.
    findings : tuple of Finding
    """

    _size, _grid = (13.0, 8.0), (2, 3)

    sources: tuple[str, str]
    models: tuple[ModelFile, ModelFile]
    align: Align
    low: float
    high: float
    verdict: ComparisonVerdict
    unknown: str
    draws: int
    seed: int
    parameters: tuple[SpringDifference, ...]
    test: HysteresisTest | None
    figures: tuple[SpringDifference, ...]
    bands: tuple[Any, Any] | None
    loops: tuple[Loop, Loop]
    mass: SharedMass
    records: tuple[Record, ...]
    followed: tuple[tuple[RecordFit, RecordFit], ...]
    findings: tuple[Finding, ...]

    @property
    def loop_difference(self) -> tuple[float, float]:
        """rms difference of force along the loop over the shared range [N], and its share of the loop's height."""
        return apart(*self.loops)

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        return verdict_sentence(self.verdict, self.unknown, self.figures, self.parameters, self.test)

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """What is compared, the verdict, the differences (if brief at the largest amplitude), and which spring follows
        the records better.
        """
        for label, model, source in zip("AB", self.models, self.sources, strict=True):
            yield f"{label}: {model.name} ({source})"
        yield self.sentence
        figures = self.figures
        if brief:
            largest = max(difference.amplitude or 0.0 for difference in figures)
            figures = tuple(difference for difference in figures if difference.amplitude == largest)
        else:
            yield self._compared
            yield difference_table("parameter", self.parameters)
        yield difference_table("figure", figures)
        if not brief:
            yield from self._beside
        yield Table(_FOLLOWED, [_followed(*fits) for fits in self.followed])

    @property
    def _compared(self) -> str:
        """Over which range, and by which draws."""
        centring = "" if self.align == "record" else ", each counted from the middle of its own range"
        of_each = (
            f"; {self.draws} springs drawn of each, seed {self.seed}; * beyond the uncertainty (single parameters and "
            "loss factors are not judged)"
            if self.bands
            else ""
        )
        return f"Compared over the shared range {1e3 * self.low:.6g} to {1e3 * self.high:.6g} mm{centring}{of_each}."

    @property
    def _beside(self) -> Iterator[str]:
        """Joint test, loops and transmissibility."""
        for difference in self.parameters:
            if difference.reason and not self.unknown:
                yield f"{difference.quantity}: {difference.reason}."
        if self.test is not None:
            yield joint_sentence(self.test)
        rms, share = self.loop_difference
        yield (
            f"Along the loop over the shared range the forces differ by {rms:.3g} N (rms), {percent(share)} % of "
            "the loop's height."
        )
        yield from self.mass.lines()

    def to_frame(self) -> pd.DataFrame:
        """A parameter, or a figure of one amplitude, in each row, in SI units: fields of `SpringDifference`, and p."""
        import pandas as pd

        frame = pd.DataFrame([difference.as_json() for difference in (*self.parameters, *self.figures)])
        return frame.drop(columns="words").astype({"amplitude": float, "differs": "boolean"})

    def content(self) -> dict[str, Any]:
        """All of it."""
        rms, share = self.loop_difference
        return {
            "a": {"model": self.sources[0], "name": self.models[0].name},
            "b": {"model": self.sources[1], "name": self.models[1].name},
            "verdict": self.verdict.name.lower(),
            "sentence": self.sentence,
            "align": self.align,
            "range": [self.low, self.high],
            "draws": self.draws if self.bands else 0,
            "seed": self.seed,
            "parameters": [difference.as_json() for difference in self.parameters],
            "hysteresis_test": self.test,
            "figures": [difference.as_json() for difference in self.figures],
            "loop": {"rms_difference": rms, "share_of_height": share},
            "transmissibility": self.mass.as_json(),
            "records": [
                {"path": a.path, "a": a.figures, "b": b.figures, "better": _better(a, b)} for a, b in self.followed
            ],
        }

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw loops, the difference of force along them, secant stiffness, energy and loss factor over the amplitude
        with their 5 to 95 % bands, and transmissibility; returns the six axes, those of a new figure if None.
        """
        from ...vibration.one_mass.curves_plot import decimal_ticks  # loads matplotlib

        panels = self._axes(ax)
        top, difference, *middle, last = panels
        for side, style in (("loading", "-"), ("unloading", "--")):
            a, b = branches = [getattr(loop, side) for loop in self.loops]
            for label, color, branch in zip("AB", _COLORS, branches, strict=True):
                top.plot(1e3 * branch.displacement, branch.force, color, label=f"{label}, {side}", ls=style)
            difference.plot(1e3 * a.displacement, b.force - a.force, "k", ls=style, label=side)
        top.set(xlabel="displacement [mm]", ylabel="force [N]", title="steady loops over the shared range")
        difference.axhline(0.0, color="0.7", lw=0.8)
        difference.set(xlabel="displacement [mm]", ylabel="force of B less that of A [N]", title="difference of force")
        for axis, column in zip(middle, PANELS, strict=True):
            rows = [row for row in self.figures if row.quantity == column.key]
            amplitudes = [1e3 * (row.amplitude or 0.0) for row in rows]
            for side, color, band in zip("ab", _COLORS, self.bands or (None, None), strict=True):
                axis.plot(amplitudes, [column.factor * getattr(row, side) for row in rows], f"{color}o-", ms=4)
                if band is not None:
                    low, high = column.factor * band[:, :, [*FIGURES].index(column.key)]
                    axis.fill_between(amplitudes, low, high, color=color, alpha=0.2, lw=0.0)
            axis.set(xlabel="amplitude [mm]", ylabel=column.label, title="5 to 95 % shaded" if self.bands else "")
        last.set(xlabel="frequency [Hz]", ylabel="transmissibility [-]", title="mass on the spring")
        if self.mass.responses:
            for label, color, response in zip("AB", _COLORS, self.mass.responses, strict=True):
                last.plot(response.column("frequency"), response.column("transmissibility"), color, label=label)
            last.set(xscale="log", yscale="log")
            decimal_ticks(last.xaxis, *last.get_xlim())
            decimal_ticks(last.yaxis, *last.get_ylim())
            last.axhline(1.0, color="0.7", lw=0.8)
        else:
            last.text(0.5, 0.5, "not compared", ha="center", transform=last.transAxes)
        for axis in panels:
            axis.grid(True, which="both", color="0.93")
        for axis in (top, difference, *([last] if self.mass.responses else [])):
            axis.legend()
        return panels


@takes(comparing=Comparing, reading=Reading)
def compare(
    a: ModelSource,
    b: ModelSource,
    *data: Any,
    comparing: Comparing,
    reading: Reading,
) -> Comparison:
    """Compare two springs, such as two lots, or one spring before and after fatigue.

    Functions are compared, not coefficients: stiffness, energy and mean force of loops over the range that both share,
    so that an elastic force as a table stands against a polynomial. All judgements together are made at the 5 % level,
    as far as the uncertainty of the model files holds; of 150 pairs of records of one spring, all of one amplitude, 5
    were found to differ.

    Parameters
    ----------
    a, b : Spring, ModelFile or path   Model files, or FMUs that hold one.
    *data : Source, or arrays          Records that both should follow; or arrays of displacement and force, and time.
    comparing : Comparing              Loops, mass and draws; or its fields as keywords.
    reading : Reading                   How records are read, and what of them is used; or its fields as keywords.

    Returns
    -------
    Comparison

    Raises
    ------
    ModelError          If a model is not a physically possible spring.
    RecordError         If the data are no records.
    StrandspringError   If the springs share too little of their ranges.
    ValueError          If a number is not possible.

    Examples
    --------
    >>> from strandspring import compare, identify, Spring, SpringParameters, synthesize
    >>> new = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> worn = Spring(SpringParameters((0.0, 2000.0), (1.0,), 9.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> tests = [synthesize(new, noise=0.01, seed=1), synthesize(worn, noise=0.01, seed=2)]
    >>> before, after = (identify(test).spring() for test in tests)
    >>> comparison = compare(before, after)
    >>> comparison.verdict.name
    'DIFFERENT'
    >>> comparison.sentence.split(":")[0]
    'The springs differ beyond their uncertainty'
    >>> frame = comparison.to_frame()
    >>> frame[(frame["quantity"] == "energy_per_cycle") & frame["differs"]]["change"].round(2).tolist()
    [-0.1, -0.1, -0.1, -0.1]
    """
    align, draws, seed = comparing.align, comparing.draws, comparing.seed
    models = (model_of(a), model_of(b))
    springs = aligned(models, align)
    low, high = shared_range(springs, align)
    middle = 0.5 * (low + high)
    reaches = _amplitudes(comparing.amplitudes, 0.5 * (high - low))
    spreads, unknown = (None, "No springs were drawn.") if draws == 0 else spreads_of(models)
    records = records_of(data, reading)
    is_same = models[0].parameters == models[1].parameters
    plain, scatter = springs, None
    if spreads is not None and not is_same:
        try:
            form = common_form(*springs)
            in_one_form = (in_form(springs[0], form), in_form(springs[1], form))
            scatter = (
                drawn(springs[0], spreads[0], middle, reaches, seed, range(draws)),
                # Other numbers, or the errors of both models would be drawn alike.
                drawn(springs[1], spreads[1], middle, reaches, seed, range(draws, 2 * draws)),
            )
            plain = in_one_form
        except StrandspringError as problem:
            unknown = str(problem)
    parameters, test = parameter_differences(
        springs,
        plain,
        (models[0].uncertainty, models[1].uncertainty),
        spreads or (None, None),
        ("A", "B"),
        middle,
    )
    of_each, of_plain = (
        (loop_figures(pair[0], middle, reaches), loop_figures(pair[1], middle, reaches)) for pair in (springs, plain)
    )
    figures = figure_differences(of_each, of_plain, reaches, scatter)
    if scatter is not None and all(math.isnan(difference.z) for difference in figures):
        scatter, unknown = None, "The springs drawn from the uncertainty are all alike; identify both again."
    if is_same:
        verdict, test = ComparisonVerdict.IDENTICAL, None
    elif scatter is None:
        verdict = ComparisonVerdict.UNKNOWN
    else:
        figures, test = judged(figures, test)
        beyond = any(difference.differs for difference in figures) or (test is not None and test.differs)
        verdict = ComparisonVerdict.DIFFERENT if beyond else ComparisonVerdict.NOT_FOUND
    loops = (steady_loop(PathSolver(springs[0]).slow, low, high), steady_loop(PathSolver(springs[1]).slow, low, high))
    solvers = [PathSolver(model.parameters) for model in models]  # each in the coordinates of its own records
    followed = tuple((predict_record(solvers[0], record), predict_record(solvers[1], record)) for record in records)
    return Comparison(
        (source_of(a), source_of(b)), models, align, low, high, verdict, unknown, draws, seed,
        tuple(parameters), test, tuple(figures),
        None if scatter is None else (quantiles(scatter[0]), quantiles(scatter[1])),
        loops,
        shared_mass(springs, low, high, comparing.mass),
        tuple(records),
        followed,
        tuple(comparison_findings(models, records, align, loops, verdict)),
    )  # fmt: skip


def _amplitudes(given: Any, most: float) -> list[float]:
    reaches = [share * most for share in _SHARES] if given is None else sorted(given)
    for reach in reaches:
        if reach > most * (1.0 + _SLACK):
            raise OptionError(
                f"An amplitude must be > 0 and at most {1e3 * most:.6g} mm, half of the range that both springs share, "
                f"got {1e3 * reach:.6g} mm."
            )
    return reaches


def _better(a: RecordFit, b: RecordFit) -> str | None:
    """A or B, by the errors along a record; None if these differ by less than 5 %."""
    least, most = sorted((a.rmse, b.rmse))
    return None if most - least <= _AS_WELL * most else "A" if a.rmse < b.rmse else "B"


def _followed(a: RecordFit, b: RecordFit) -> dict[str, Any]:
    """A row of the table of records."""
    of_both = {"a_rmse": a.rmse, "b_rmse": b.rmse, "a_rnl": a.rnl, "b_rnl": b.rnl}
    return {"record": a.path, "better": _better(a, b) or "both alike", **of_both}
