"""What an FMU carries about itself besides its documentation page.

A model file, parameter sets, an experiment with its reference result, the uncertainty, and a list of hashes. The
related files and their manifest follow the layered standard FMI-LS-REF of the Modelica Association. The experiment
has the form of that standard's draft, from which MA-HS-Experiments came: stimuli and references as tables.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, astuple, dataclass, fields, replace
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from .._version import __version__
from ..core.parameters import LARGEST_DISPLACEMENT, SpringParameters
from ..errors import ModelError
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..model.coordinates import placed
from ..model.joint import JointCovariance
from ..model.modelfile import MODEL_IN_FMU, ModelFile, text_in_fmu
from .description.content import xml_file
from .description.described_variables import start_omegas
from .description.ssv import parameter_values

BUILD = "resources/strandspring/build.json"
HASHES = "resources/strandspring/sha256.json"
RELATED = "extra/org.fmi-standard.fmi-ls-ref"
STIMULI, REFERENCE = f"{RELATED}/stimuli.csv", f"{RELATED}/reference.csv"
STEP = 1e-3  # of the experiment [s]
_LAYERED = "http://fmi-standard.org/fmi-ls-manifest"
_VARIED = ("kappa_omega", "rho", "sigma", "n")
_DRAWN, _TRIES, _SEED = 3, 100, 0  # springs drawn from the joint covariance
_NOTE = """\
Related files of {name}, by FMI-LS-REF 1.0.0-alpha.1 (see fmi-ls-manifest.xml).

stimuli.csv, reference.csv: two growing slow cycles of the displacement, and what the FMU answers to them. Each row of
the reference belongs to the displacement of the same time: a host reads it that sets the displacement of the end of a
step before the step. A host that sets the displacement of the beginning of a step reads each row one step late. The
velocity, if there is one, is that of the middle between the neighbouring samples. The cycles are not a recorded path:
the FMU is made from its model file alone, which names its records and holds none of them, so that the same model gives
the same FMU. strandspring predict compares the FMU with a record, along the displacement as recorded.

nominal.ssv: the parameters as they are. lower.ssv, upper.ssv: kappa_omega, rho, sigma and n at the lower and upper ends
of their 95 % intervals, all at once, which is farther out than 95 %. drawn_*.ssv: springs drawn from the joint
covariance. uncertainty.json: the uncertainty of the model file.
"""


class Related(NamedTuple):
    """A related file: content, media type and role by FMI-LS-REF, and description."""

    content: bytes
    media_type: str
    role: str
    description: str


def related_files(of_record: ModelFile, settings: BuildSettings) -> dict[str, bytes]:
    """These files by their path in the FMU; the same arguments give the same bytes.

    Parameters
    ----------
    of_record : ModelFile   In the record's coordinates.
    settings : BuildSettings
    """
    related = dict(_related(of_record, settings))
    build = {"format": "strandspring-build", "version": __version__, **asdict(settings)}
    return {
        MODEL_IN_FMU: of_record.to_json().encode("utf-8"),
        BUILD: (json.dumps(build, indent=2, ensure_ascii=False) + "\n").encode("utf-8"),
        "documentation/fmi-ls-ref.txt": _NOTE.format(name=of_record.name).encode("utf-8"),
        **with_manifest(related, (MODEL_IN_FMU, "application/json", "Model file, in the coordinates of the record")),
    }


def with_manifest(related: Mapping[str, Related], source: tuple[str, str, str] | None) -> dict[str, bytes]:
    """Related files and their manifest by their path in the FMU.

    Parameters
    ----------
    related : mapping            By name.
    source : tuple or None       Path in the FMU, media type and description of what it is made of.
    """
    return {
        f"{RELATED}/fmi-ls-manifest.xml": _manifest(related, source),
        **{f"{RELATED}/{name}": file.content for name, file in related.items()},
    }


def experiment(
    name: str, about: str, step: float, inputs: Mapping[str, FloatArray], outputs: Mapping[str, FloatArray]
) -> dict[str, Related]:
    """An experiment with its reference result, as related files by name.

    Parameters
    ----------
    name, about : str    Of the experiment, and its description.
    step : float         Between samples [s].
    inputs, outputs : mapping of ndarray, shape (K,)   By the names of variables.
    """
    time = step * np.arange(len(next(iter(outputs.values()))), dtype=np.float64)
    exp = "application/x-ma-hs-experiments"
    return {
        "experiments.exp": Related(_experiments(name, float(time[-1]), step), exp, "experiment/smoke-test", about),
        "stimuli.csv": Related(_table(time, inputs), "text/csv", "testcase", "Inputs of the experiment"),
        "reference.csv": Related(_table(time, outputs), "text/csv", "result", "Reference result of the experiment"),
    }


@dataclass(frozen=True)
class BuildSettings:
    """What an FMU of a model file was built with.

    Attributes
    ----------
    backend : str                 native, states or python.
    zero : float                  Displacement of the record at which that of the FMU is 0 [m].
    author : str
    needs_execution_tool : bool   Of the Python-backed FMU.
    fmi : int                     Version of FMI, 2 or 3.
    """

    backend: str
    zero: float
    author: str
    needs_execution_tool: bool = False
    fmi: int = 2

    @classmethod
    def of_fmu(cls, fmu: Path) -> BuildSettings:
        """Those of an FMU of ours.

        Raises
        ------
        ModelError   If it holds none.
        """
        text = text_in_fmu(fmu, BUILD)
        try:
            content = json.loads(text)
            settings = cls(**{field.name: content[field.name] for field in fields(cls)})
            types = [type(value).__name__ for value in astuple(settings)]
        except (ValueError, RecursionError, KeyError, TypeError):
            types = []
        is_sound = types == [field.type for field in fields(cls)] and settings.fmi in (2, 3)
        if not is_sound or not abs(settings.zero) <= LARGEST_DISPLACEMENT:
            raise ModelError(f"{fmu}: {BUILD} is damaged; build the FMU from its model file again.")
        return settings


def version_of(text: str) -> str:
    """The version of an FMU: that of this program, and the beginning of the SHA-256 of what the FMU is made of."""
    return f"{__version__}+{hashlib.sha256(text.encode('utf-8')).hexdigest()[:12]}"


def sealed(contents: Mapping[str, bytes]) -> dict[str, bytes]:
    """The files of an FMU with a list of their hashes."""
    hashes = {name: hashlib.sha256(content).hexdigest() for name, content in sorted(contents.items())}
    return {**contents, HASHES: (json.dumps(hashes, indent=2) + "\n").encode("utf-8")}


def slow_cycles(parameters: SpringParameters) -> FloatArray:
    """Two growing cycles that start at 0, or at the end of the identified range next to it, and reach over the range.

    Returns
    -------
    ndarray, shape (K,)   Displacement [m].
    """
    low, high = parameters.displacement_min, parameters.displacement_max
    start = min(max(0.0, low), high)
    phase = np.linspace(0.0, 4.0 * np.pi, 401)
    swing = np.sin(phase) * np.where(phase < 2.0 * np.pi, 0.5, 1.0)
    return np.asarray(start + np.where(swing > 0.0, (high - start) * swing, (start - low) * swing), dtype=np.float64)


def times_of(path: FloatArray) -> FloatArray:
    """When a host that takes a step of `STEP` for each sample of a path reaches it [s]."""
    return np.asarray(STEP * np.arange(path.size), dtype=np.float64)


def _related(of_record: ModelFile, settings: BuildSettings) -> Iterator[tuple[str, Related]]:
    """The related files by their name."""
    with_states = settings.backend == "states"
    model, _ = placed(of_record, settings.zero)
    spring, omegas = model.parameters, start_omegas(model)
    path = slow_cycles(spring)
    solver = PathSolver(spring)
    inputs = {"displacement": path}
    if with_states:
        inputs["velocity"] = np.gradient(path, STEP)
    times = times_of(path)
    answers = {
        "force": solver.force(path, omegas, times),
        "stiffness": solver.stiffness(path, omegas),
        "absorbed_energy": solver.absorbed_energy(path, omegas, times),
    }
    yield from experiment("slow cycles", "Two growing slow cycles", STEP, inputs, answers).items()
    for name, (variant, about) in _variants(spring, of_record.uncertainty).items():
        of_variant = ModelFile(of_record.name, variant, about, start=model.start)
        text = parameter_values(of_variant, with_states, settings.fmi)
        yield f"{name}.ssv", Related(text.encode("utf-8"), "application/x-ssp-parameter-set", "parameter", about)
    if of_record.uncertainty:
        text = json.dumps(of_record.uncertainty, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        yield "uncertainty.json", Related(text.encode("utf-8"), "application/json", "meta-data",
                                          "Uncertainty of the identification")  # fmt: skip


def _variants(spring: SpringParameters, uncertainty: Mapping[str, Any]) -> dict[str, tuple[SpringParameters, str]]:
    """Nominal, lower, upper and drawn springs with a description each, by name."""
    variants = {"nominal": (spring, "Nominal values")}
    intervals = uncertainty.get("interval_95") or {}
    for end, name in enumerate(("lower", "upper")):
        ends = {key: intervals[key][end] for key in _VARIED if key in intervals}
        values: dict[str, Any] = {key: float(value) for key, value in ends.items() if value is not None}
        if values:
            about = f"{', '.join(values)} at the {name} ends of their 95 % intervals"
            try:
                variants[name] = (replace(spring, **values), about)
            except ValueError as problem:
                raise ModelError(
                    f'field "uncertainty.interval_95": its {name} ends are no spring: {problem} Correct the field, or '
                    "remove it."
                ) from None
    joint = JointCovariance.from_uncertainty(spring, uncertainty)
    drawn = () if joint is None else islice(_draws(joint, spring), _DRAWN)
    for number, sample in enumerate(drawn, start=1):
        variants[f"drawn_{number}"] = (sample, f"Drawn from the joint covariance, number {number} of seed {_SEED}")
    return variants


def _draws(joint: JointCovariance, spring: SpringParameters) -> Iterator[SpringParameters]:
    generator = np.random.default_rng(_SEED)
    for _ in range(_TRIES):
        with suppress(ValueError):  # FA not positive: no spring
            yield joint.moved(spring, generator.standard_normal(len(joint.root)).tolist())


def _table(time: FloatArray, columns: Mapping[str, FloatArray]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("time", *columns))
    writer.writerows(zip(*(map(repr, column.tolist()) for column in (time, *columns.values())), strict=True))
    return text.getvalue().encode("ascii")


def _experiments(name: str, stop: float, step: float) -> bytes:
    root = Element("Experiments", {"name": "Smoke test", "description": "Whether the FMU answers as it should"})
    experiment = SubElement(
        root, "Experiment", {"name": name, "startTime": "0.0", "stopTime": repr(stop), "stepSize": repr(step)}
    )
    SubElement(experiment, "Stimuli", {"source": "stimuli.csv"})
    SubElement(experiment, "References", {"source": "reference.csv"})
    return xml_file(root)


def _manifest(related: Mapping[str, Related], source: tuple[str, str, str] | None) -> bytes:
    root = Element(
        "fmiReferences",
        {
            "xmlns:fmi-ls": _LAYERED,
            "fmi-ls:fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
            "fmi-ls:fmi-ls-version": "1.0.0-alpha.1",
            "fmi-ls:fmi-ls-description": "Layered Standard providing information on related files included in an FMU.",
        },
    )
    if source is not None:
        path, media_type, about = source
        attributes = {"type": media_type, "source": f"../../{path}", "role": "model", "description": about}
        SubElement(root, "Related", attributes)
    for name, file in related.items():
        attributes = {"type": file.media_type, "source": name, "role": file.role, "description": file.description}
        SubElement(root, "Related", attributes)
    return xml_file(root)
