"""Records on a page (`show`), and records computed from a model or as in the paper (`synthesize`)."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import OptionError, Reader
from ..findings import Finding, Outcome, gathered
from ..ground.arguments import numbers
from ..ground.options import changed, refuse_given, takes
from ..kernel.path import PathSolver
from ..loops.cycles import measured_loops
from ..loops.reading import Reading
from ..peers.ni import PAPER_NI, sine_period, steady_force, with_noise
from ..records.record import Record
from .common.given import Source, given_records, outside
from .common.model_source import ModelSource, model_of
from .common.result import Result, Table, picked
from .common.text import counted, loop_table
from .options import Sampling

NI = "ni"
_MOST_SAMPLES = 20_000_000
_OF_NI = ("cycles", "samples", "noise", "seed", "exponent")
_MOST_OF_NI = 0.1  # amplitude [m]


@takes(reading=Reading)
def show(records: Source | Sequence[Source], path: str | os.PathLike[str], *, reading: Reading) -> Path:
    """Draw loops, strokes and cycles of records on a page, which prints options that choose a part.

    Parameters
    ----------
    records : path, Record, DataFrame, or a sequence of these
    path : path-like     The page to write, ending in .html.
    reading : Reading    How records are read and cut; or its fields as keywords.

    Returns
    -------
    Path                 `path`.

    Raises
    ------
    RecordError          If one of them is not a record.
    StrandspringError    If the page cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import bundled_record, show
    >>> with TemporaryDirectory() as folder:
    ...     page = show(bundled_record(), Path(folder) / "hinge.html", reverse="displacement")
    ...     page.name, "Force over displacement" in page.read_text(encoding="utf-8")
    ('hinge.html', True)
    """
    from ..report.record_page import write_record_page

    target = Path(path)
    write_record_page(target, given_records(records, reading=reading))
    return target


class Overview(Result):
    """What was detected in records: strokes, cycles and loops."""

    def __init__(self, records: Sequence[Record]) -> None:
        from ..report.record_page import RecordOverview

        self.seen = [RecordOverview(record) for record in records]
        self.findings = tuple(finding for one in self.seen for finding in (*one.refusals, *one.findings))

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - the table knows
        """A line of each record, and its loops."""
        for one in self.seen:
            left_out = "".join(f", {samples.size} {reason}" for reason, samples in one.left_out.items())
            yield (
                f"{one.record.path}: {len(one.record)} samples, {counted(one.strokes, 'stroke')}, "
                f"{counted(len(one.cycles), 'whole cycle')}{left_out}"
            )
        yield loop_table([loop for one in self.seen for loop in measured_loops([one.record])])

    def content(self) -> dict[str, Any]:
        """Of each record what was detected, with its cycles as `Reading` counts them."""
        return {
            "records": [
                {
                    "path": one.record.path,
                    "samples": len(one.record),
                    "strokes": one.strokes,
                    "cycles": [
                        {"number": k, **picked(cycle, "first_sample", "last_sample", "frequency"),
                         "amplitude": cycle.figures.amplitude}
                        for k, cycle in enumerate(one.cycles, 1)
                    ],
                    "loops": loop_table(measured_loops([one.record]), in_files=True),
                    "left_out": {reason: samples.size for reason, samples in one.left_out.items()},
                    "notes": tuple(gathered(one.record.findings, Reader.FILE)),
                }
                for one in self.seen
            ]
        }  # fmt: skip


@takes(sampling=Sampling)
def synthesize(model: ModelSource, amplitudes: ArrayLike | None = None, *, sampling: Sampling) -> Record:
    """The record of a model's spring under sinusoidal displacement, or the paper's simulated experiment.

    That is Ni's model in its steady state under x = X sin(t), paper eqs. (26)-(31), in whole periods without their
    closing sample.

    Parameters
    ----------
    model : Spring, ModelFile or path, or "ni"   A model file, or an FMU that holds one; or the paper's experiment.
    amplitudes : float or array_like  Of the sines, one after the other [m]; that of the identified range if None. Of
                                      Ni's experiment X, at most 0.1 m; 5 mm if None.
    sampling : Sampling               How the record is sampled and measured; or its fields as keywords.

    Returns
    -------
    Record   Its findings say noise and seed, and what lies outside the identified range.

    Raises
    ------
    ModelError    If the model is not a physically possible spring.
    ValueError    If a number is not possible, or the record would have more than 20000000 samples.
    OptionError   If an option does not apply.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, synthesize
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> record = synthesize(spring, amplitudes=[0.005, 0.02], noise=0.01, seed=7)
    >>> len(record), record.notes
    (6001, ('Noise level 0.01, seed 7.',))
    >>> clean = synthesize("ni", noise=0.0)
    >>> round(float((clean.force**2).mean() ** 0.5), 1)  # rms force [N], 248.2 in the paper's Table 1
    248.3
    """
    given = None if amplitudes is None else numbers("amplitudes", amplitudes, "m")
    if given is not None and not all(0.0 < reach < np.inf for reach in given or (0.0,)):
        raise OptionError(f"`amplitudes` must be finite and > 0 [m], got {amplitudes!r}.")
    is_ni = isinstance(model, str) and model == NI
    cycles, noise, findings = sampling.cycles or (1 if is_ni else 3), sampling.noise, list[Finding]()
    count = len(given or (0.0,)) * cycles * sampling.samples
    if count > _MOST_SAMPLES:
        raise OptionError(
            f"The record would have {count} samples, more than {_MOST_SAMPLES}; use fewer cycles or samples."
        )
    sample = np.arange(cycles * sampling.samples)
    if is_ni:
        others = {key: value for key, value in changed(sampling).items() if key not in _OF_NI}
        refuse_given("{option} does not apply to {where}; leave it out.", "Ni's experiment", **others)
        (reach, *more), name, noise = given or (5e-3,), "Ni's model", 0.03 if noise is None else noise
        if more or reach > _MOST_OF_NI:
            raise OptionError(f"`amplitudes` must be one of at most {_MOST_OF_NI} [m], got {amplitudes!r}.")
        ni = PAPER_NI if sampling.exponent is None else replace(PAPER_NI, n=sampling.exponent)
        period = sine_period(1e3 * reach, sampling.samples)
        time = 2.0 * np.pi * sample / sampling.samples
        path, force = np.tile(period, cycles), np.tile(steady_force(ni, period), cycles)
    else:
        sentence = "{option} is of Ni's experiment, and {where} is given; leave it out."
        refuse_given(sentence, "a model", exponent=sampling.exponent)
        content = model_of(model)
        p, name = content.parameters, content.name
        centre = p.displacement_offset if sampling.mean is None else sampling.mean
        sine = np.sin(2.0 * np.pi * (sample / sampling.samples))
        reaches = given or (0.5 * (p.displacement_max - p.displacement_min),)
        moved = np.concatenate([*(centre + reach * sine for reach in reaches), [centre]])
        time = np.arange(moved.size) / (sampling.samples * sampling.frequency)
        path, force = 1e3 * moved, PathSolver(p).force(moved, 0.0, time)
        findings += outside("", moved, p)
    if noise:
        force = with_noise(force, noise, sampling.seed)
        findings.insert(0, Finding(Outcome.NOISE, {"noise": noise, "seed": sampling.seed}))
    force = force * (1.0 + sampling.drift * np.arange(path.size) / path.size)
    steps = (sampling.displacement_resolution / 1e-3, sampling.force_resolution)
    pairs = zip((path, force), steps, strict=True)
    path, force = (np.round(values / step) * step if step > 0.0 else values for values, step in pairs)
    return Record(1e-3 * path, force, time, path=f"<{name}>", findings=tuple(findings))
