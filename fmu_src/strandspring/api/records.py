"""Records on a page (`show`), and records computed from a model or as in the paper's experiment (`synthesize`)."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..errors import OptionError, Reader
from ..findings import Finding, Outcome, gathered
from ..ground.arguments import numbers
from ..ground.options import changed, refuse_given, takes
from ..kernel.arrays import FloatArray, IndexArray
from ..kernel.path import PathSolver
from ..loops.cycles import measured_loops
from ..loops.reading import Reading
from ..peers.ni import PAPER_NI, sine_period, steady_force, with_noise
from ..records.record import Record
from .common.given import Source, given_records, outside
from .common.model_source import ModelSource, model_of
from .common.result import Result, picked
from .common.table import Table
from .common.text import counted, loop_table
from .options import Sampling

NI = "ni"
_MOST_SAMPLES = 20_000_000
_OF_NI = ("cycles", "samples", "noise", "seed", "exponent")
_MOST_OF_NI = 0.1  # amplitude [m]


@takes(reading=Reading)
def show(
    records: Source | Sequence[Source],
    path: str | os.PathLike[str],
    *,
    reading: Reading,
) -> Path:
    """Draw loops, strokes and cycles of records on a page, which prints the options that choose a part of them.

    Parameters
    ----------
    records : path, Record, DataFrame, or a sequence of these
    path : path-like     The page to write, ending in .html; it opens offline.
    reading : Reading    How files and tables are read, and what of them is used; or its fields as keywords.

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
    """What was detected in records, with warnings for a reader: strokes, cycles, loops, samples that are left out."""

    _stated: ClassVar = {}  # beside each record

    def __init__(self, records: Sequence[Record], reader: Reader = Reader.PYTHON) -> None:
        from ..report.record_page import overview

        self.records = tuple(records)
        self._seen = [(record, overview(record, reader)) for record in records]
        self.warnings = tuple(warning for _, seen in self._seen for warning in seen.warnings)

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - the table knows
        """A line of each record, and its loops."""
        for record, seen in self._seen:
            left_out = "".join(f", {samples.size} {reason}" for reason, samples in seen.left_out.items())
            yield (
                f"{record.path}: {len(record)} samples, {counted(seen.strokes, 'stroke')}, "
                f"{counted(len(seen.cycles), 'whole cycle')}{left_out}"
            )
        yield loop_table([loop for record in self.records for loop in measured_loops([record])])

    def content(self) -> dict[str, Any]:
        """Of each record what was detected, with its cycles as `cycles` of `Reading` counts them."""
        return {
            "records": [
                {
                    "path": record.path,
                    "samples": len(record),
                    "strokes": seen.strokes,
                    "cycles": [
                        {
                            "number": k,
                            **picked(cycle, "first_sample", "last_sample", "frequency"),
                            **picked(cycle.figures, "amplitude"),
                        }
                        for k, cycle in enumerate(seen.cycles, 1)
                    ],
                    "loops": loop_table(measured_loops([record]), in_files=True),
                    "left_out": {reason: samples.size for reason, samples in seen.left_out.items()},
                    "notes": tuple(gathered(record.findings, Reader.FILE)),
                }
                for record, seen in self._seen
            ]
        }


@takes(sampling=Sampling)
def synthesize(model: ModelSource, amplitudes: ArrayLike | None = None, *, sampling: Sampling) -> Record:
    """The record of a model's spring under sinusoidal displacement, or the paper's simulated experiment.

    That is Ni's model in its steady state under x = X sin(t), paper eqs. (26)-(31). Its record holds whole periods
    without their closing sample; the periods before the steady state are omitted.

    Parameters
    ----------
    model : Spring, ModelFile or path, or "ni"   A model file, or an FMU that holds one; or the paper's experiment.
    amplitudes : float or array_like    Of the sines, one after the other [m]; that of the identified range if None. Of
                                        Ni's experiment X, at most 0.1 m; 5 mm if None.
    sampling : Sampling                 How the record is sampled and measured; or its fields as keywords.

    Returns
    -------
    Record   Its findings say the noise with its seed, and what lies outside the identified range.

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
    if isinstance(model, str) and model == NI:
        others = {name: value for name, value in changed(sampling).items() if name not in _OF_NI}
        refuse_given("{option} does not apply to {where}; leave it out.", "Ni's experiment", **others)
        (amplitude,) = given or (5e-3,)
        if amplitude > _MOST_OF_NI:
            raise OptionError(f"`amplitudes` must be one of at most {_MOST_OF_NI} [m], got {amplitude!r}.")
        sampling = replace(sampling, noise=0.03 if sampling.noise is None else sampling.noise)
        cycles = sampling.cycles or 1
        sample = _samples(cycles, sampling)
        ni = PAPER_NI if sampling.exponent is None else replace(PAPER_NI, n=sampling.exponent)
        period = sine_period(1e3 * amplitude, sampling.samples)
        force = np.tile(steady_force(ni, period), cycles)
        return _measured(
            "<Ni's model>", np.tile(period, cycles), force, 2.0 * np.pi * sample / sampling.samples, sampling
        )
    sentence = "{option} is of Ni's experiment, and {where} is given; leave it out."
    refuse_given(sentence, "a model", exponent=sampling.exponent)
    content = model_of(model)
    p, cycles = content.parameters, sampling.cycles or 3
    reaches = (0.5 * (p.displacement_max - p.displacement_min),) if given is None else given
    sample = _samples(len(reaches) * cycles, sampling)[: cycles * sampling.samples]
    centre = p.displacement_offset if sampling.mean is None else sampling.mean
    sine = np.sin(2.0 * np.pi * (sample / sampling.samples))
    path = np.concatenate([*(centre + reach * sine for reach in reaches), [centre]])
    time = np.asarray(np.arange(path.size) / (sampling.samples * sampling.frequency), dtype=np.float64)
    force = PathSolver(p).force(path, 0.0, time)
    return _measured(f"<{content.name}>", 1e3 * path, force, time, sampling, outside("", path, p))


def _samples(cycles: int, sampling: Sampling) -> IndexArray:
    """Numbers of the samples of cycles; raises OptionError if they are too many."""
    count = cycles * sampling.samples
    if count > _MOST_SAMPLES:
        raise OptionError(
            f"The record would have {count} samples, more than {_MOST_SAMPLES}; use fewer cycles or samples."
        )
    return np.arange(count)


def _measured(
    name: str,
    path: FloatArray,
    force: FloatArray,
    time: FloatArray,
    sampling: Sampling,
    findings: Iterable[Finding] = (),
) -> Record:
    """A record of a path [mm] and a force as a rig with its noise, drift and resolution has it."""
    found: list[Finding] = []
    if noise := sampling.noise:
        force = with_noise(force, noise, sampling.seed)
        found = [Finding(Outcome.NOISE, {"noise": noise, "seed": sampling.seed})]
    force = force * (1.0 + sampling.drift * np.arange(path.size) / path.size)
    steps = (sampling.displacement_resolution / 1e-3, sampling.force_resolution)
    path, force = (np.round(v / step) * step if step > 0.0 else v for v, step in zip((path, force), steps, strict=True))
    return Record(1e-3 * path, force, time, path=name, findings=(*found, *findings))
