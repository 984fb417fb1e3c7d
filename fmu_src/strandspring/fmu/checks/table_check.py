"""Whether an FMU for co-simulation answers a table of inputs with a table of outputs."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

import fmpy
import numpy as np

from ...ground.endings import kept_endings
from ...kernel.arrays import FloatArray
from .check import FORCE_TOLERANCE, CheckReport, running, why_not_here
from .fmpy_host import fmi_version


def compare_table(
    path: Path, step: float, inputs: Mapping[str, FloatArray], outputs: Mapping[str, FloatArray]
) -> CheckReport:
    """Run a valid FMU and compare its outputs, each kind within rounding of its largest value.

    Parameters
    ----------
    path : Path
    step : float         Of co-simulation [s].
    inputs : mapping     Values of each input by name, shape (K,), each over the step that begins with it.
    outputs : mapping    Values of each output by name, shape (K,), at the beginning of each step. Names that are alike
                         up to the first "_" are of one kind.
    """
    description = fmpy.read_model_description(str(path))
    not_run = why_not_here(path, fmi_version(description))
    if not_run:
        return CheckReport(path, (), not_run)
    references = {v.name: v.valueReference for v in description.modelVariables}
    if missing := [name for name in (*inputs, *outputs) if name not in references]:
        return CheckReport(path, (f"It has no variable {missing[0]!a}.",))
    given, asked = ([references[name] for name in names] for names in (inputs, outputs))
    rows = np.array(list(inputs.values())).T.tolist() if inputs else [[]] * len(next(iter(outputs.values())))
    answers = []
    began = time.perf_counter()
    try:
        with kept_endings(), running(path) as slave:
            slave.setupExperiment(startTime=0.0)
            slave.enterInitializationMode()
            slave.setReal(given, rows[0])
            slave.exitInitializationMode()
            for k, values in enumerate(rows):
                slave.setReal(given, values)
                answers.append(slave.getReal(asked))
                slave.doStep(k * step, step)
            slave.terminate()
    except Exception as problem:  # FMPy raises plain exceptions
        return CheckReport(path, (f"It cannot be run: {problem}",))
    seconds = time.perf_counter() - began
    differences = _differences(np.array(answers), outputs)
    problems = tuple(
        f"Its {kind} must be that of the reference, but differs by up to {difference:.3g} of {largest:.3g}."
        for kind, (difference, largest) in differences.items()
        if not difference <= FORCE_TOLERANCE * largest  # so that NaN is a problem
    )
    force = differences.get("force", (0.0, 0.0))[0]
    return CheckReport(path, problems, None, ("co-simulation",), len(rows), force, seconds)


def _differences(answers: FloatArray, outputs: Mapping[str, FloatArray]) -> dict[str, tuple[float, float]]:
    """Largest difference and largest value of each kind."""
    kinds: dict[str, tuple[float, float]] = {}
    for column, (name, expected) in zip(answers.T, outputs.items(), strict=True):
        kind = name.split("_")[0]
        before = kinds.get(kind, (0.0, 0.0))
        # NaN counts as the greater one.
        now = np.max(np.abs(column - expected)), np.max(np.abs(expected))
        kinds[kind] = float(np.maximum(before[0], now[0])), float(np.maximum(before[1], now[1]))
    return kinds
