"""`build_fmu`: an FMU of a model or of records, put in place after it was validated and run."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, get_args

from ...errors import BuildError, Reader
from ...findings import CAUTIONS, gathered, of_severity
from ...fmu.archive import fmu_path
from ...fmu.checks.check import CheckReport, examine_fmu
from ...fmu.native.native_fmu import build_native_fmu
from ...fmu.python_backed import build_python_fmu
from ...fmu.related_files import BuildSettings
from ...ground.files import refuse_unwritable
from ...ground.options import changed, refuse_given, takes
from ...ground.strict_json import is_finite, objects
from ...model.certificate import certified
from ...model.coordinates import checked_zero, zero_sentence
from ...model.modelfile import ModelFile, is_model_path, load_model
from ...model.names import check_name
from ...model.stated_figures import NAMES
from ..common.model_source import ModelSource, built_with, describes_system, path_of
from ..common.progress import Progress, unseen
from .fmus_in_place import BuiltFmu, FmuJob, build_in_place
from .options import BuildOptions, Kind

if TYPE_CHECKING:
    from ...identification.identified import IdentifiedModel
    from ...records.record import Record
    from ..common.given import Source

Stated: TypeAlias = "tuple[Record, dict[str, Any]]"

OF_SYSTEM = "{option} can only be given with a model or records, and {where} describes a system; leave it out."
_RNL_TOLERANCE = 1e-6  # of sums over many samples, each within rounding


def target(options: BuildOptions, folder: str | Path, name: str, kind: str) -> Path:
    """Where an FMU of this kind of a model of this name is written."""
    return fmu_path(folder, name, kind, options.version, options.real_time)


def spring_options(options: BuildOptions) -> dict[str, Any]:
    """What is asked for that the FMU of a system does not have."""
    return {name: value for name, value in changed(options).items() if name not in ("fmi", "platforms", "author")}


@dataclass(frozen=True)
class Built:
    """FMUs that were built of a model, or of records that were identified for them.

    Attributes
    ----------
    model : ModelFile
    path : Path                 Of the model file.
    zero : float                Displacement of the model file at which that of the FMUs is 0 [m].
    settings : BuildOptions
    fmus : sequence of BuiltFmu
    identification : Identification or None
    """

    model: ModelFile
    path: Path
    zero: float
    settings: BuildOptions
    fmus: Sequence[BuiltFmu]
    identification: Any  # Identification, whose spring has `build_fmu`

    def brief(self, width: int | None = None) -> list[str]:
        """In few words."""
        found = [] if self.identification is None else self.identification.brief(width)
        return [*found, *self._origin, *(fmu.brief(self.settings) for fmu in self.fmus)]

    def text_lines(self, width: int | None = None) -> list[str]:
        """In words."""
        found = [] if self.identification is None else self.identification.text_lines(width)
        return [*found, *self._origin, *(line for fmu in self.fmus for line in fmu.text_lines(self.settings))]

    @property
    def _origin(self) -> list[str]:
        lines = [f"Model file: {self.path}", f"Certificate: {certified(self.model)}", zero_sentence(self.zero)]
        return list(filter(None, lines))

    def as_json(self) -> dict[str, Any]:
        """The same for JSON."""
        found, settings = self.identification, self.settings
        of_native = {"real_time": settings.real_time, "no_energy": settings.no_energy, "arrays": settings.arrays}
        return {
            "model": str(self.path),
            "name": self.model.name,
            "parameters": self.model.parameters.as_dict(),
            "zero": self.zero,
            "certificate": certified(self.model),
            **(dict.fromkeys(NAMES) if found is None else found.figures),
            "fitted": None if found is None else found.fitted_figures,
            "fmus": [fmu.facts(settings) | of_native for fmu in self.fmus],
        }


def build_all(
    model: ModelFile,
    folder: Path,
    kinds: Sequence[Kind],
    options: BuildOptions,
    zero: str | float | None,
    stated: Sequence[Stated] = (),
    progress: Progress = unseen,
) -> list[BuiltFmu]:
    """Build FMUs of several kinds beside their place, check them, and put them in place if all are good.

    Parameters
    ----------
    model : ModelFile
    folder : Path
    kinds : sequence of Kind
    options : BuildOptions
    zero : "rig", "middle", float or None      Displacement of the model file at which that of the FMU is 0 [m]; see
                                               `chosen_zero`.
    stated : sequence of (Record, dict)        What `stated_of` gives, along which FMUs for co-simulation are checked.

    Raises
    ------
    StrandspringError   If the folder is not writable, or an FMU cannot be built.
    BuildError          If the options do not go together, or an FMU is not valid or answers otherwise than the model;
                        nothing is then left behind.
    ModelError          If the spring does not meet its certificate.
    """
    certified(model)
    options.refuse_impossible(kinds)
    mechanisms = len(model.parameters.mechanisms)
    jobs = [
        FmuJob(
            target(options, folder, model.name, kind),
            kind,
            partial(_build, model, kind=kind, options=options, zero=zero),
            # With states the path is the host's.
            partial(_examined, mechanisms=mechanisms, stated=() if kind == "states" or options.no_energy else stated),
        )
        for kind in kinds
    ]
    return build_in_place(folder, jobs, progress)


def stated_of(model: ModelFile, records: Sequence[Record]) -> list[Stated]:
    """Records, each with what the model file states of it; raises BuildError if that is nothing."""
    rows = list(zip(*(objects(content.get("records")) for content in (model.provenance, model.fit)), strict=False))
    stated = []
    for record in records:
        found = (record.sha256, len(record))
        row = next((row for row in rows if (row[0].get("sha256"), row[0].get("samples")) == found), None)
        if row is None or not all(is_finite(row[1].get(name)) for name in ("rnl", "omega_start", "first_sample")):
            raise BuildError(
                f"{record.path}: the model {model.name} states no figures of this record as it is read now; give one "
                "that it was identified from, with the same options."
            )
        rows.remove(row)
        stated.append((record, row[1]))
    return stated


def _examined(path: Path, mechanisms: int, stated: Sequence[Stated]) -> CheckReport:
    """The check of an FMU, also along records from their starts: RNL has to be what the model file states."""
    report = examine_fmu(path)
    if report.problems or report.not_run or not stated:
        return report
    # Slow to import.
    from ...cosimulation.prescribed import simulate_fmu
    from ...identification.figures import chosen_samples, rnl

    zero = BuildSettings.of_fmu(path).zero
    for record, figures in stated:
        starts = dict.fromkeys(("omega_start", "second_omega_start")[:mechanisms], float(figures["omega_start"]))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of samples beyond the identified range
            force = simulate_fmu(path, record.displacement - zero, record.rising_time, starts).force
        compared = chosen_samples(record, figures["first_sample"])
        found = rnl(record.force[compared], force[compared])
        if not abs(found - figures["rnl"]) <= _RNL_TOLERANCE:
            text = f"RNL along {record.path} must be {figures['rnl']:.6f}, as the model file states, but is {found:.6f}"
            return replace(report, problems=(f"{text}; read the record as for the model, or identify it again.",))
    return replace(
        report, followed=f"; RNL as stated along {', '.join(Path(record.path).name for record, _ in stated)}"
    )


def _build(model: ModelFile, folder: Path, kind: Kind, options: BuildOptions, zero: str | float | None) -> Path:
    author = options.author
    if kind == "python":
        return build_python_fmu(model, folder, zero, options.needs_execution_tool, author)
    return build_native_fmu(
        model, folder, options.chosen_platforms, zero, author, with_states=kind == "states", fmi=options.version,
        real_time=options.real_time, no_energy=options.no_energy, arrays=options.arrays,
    )  # fmt: skip


@takes(building=BuildOptions)
def build_fmu(
    model: ModelSource | IdentifiedModel | Source | Sequence[Source],
    folder: str | os.PathLike[str] = "dist",
    *,
    building: BuildOptions,
    zero: str | float | None = None,
    name: str | None = None,
    candidate: str | None = None,
    record: Source | Sequence[Source] | None = None,
    progress: Progress = unseen,
) -> Path:
    """Build, validate and run the FMU of a model, of records that are identified first, or of a system.

    Records are identified with the defaults of `identify`, and its cautions become warnings; along them, from where
    they start, the FMU must have the RNL that the model has. The FMU of a SYSTEM.toml
    is for co-simulation: base acceleration in, motion of points and forces of mounts out. Of the options it takes
    `fmi`, `platforms`, `author` and `candidate`.

    Parameters
    ----------
    model : Spring, Identification, path of a model file, FMU or SYSTEM.toml, or records: paths, Record, DataFrame
    folder : path
    building : BuildOptions   Back end, version of FMI, platforms and others; or its fields as keywords.
    zero : "rig", "middle", float or None
        Where displacement is counted from: a displacement of the record [m]; if None, as in the FMU if one is given,
        else the rig's zero if it lies within the identified range, else the middle of the range.
    name : str or None     Of the model and its FMU; if None, that of the model, or after the first record.
    candidate : str or None   Of a SYSTEM.toml; needed if it has several.
    record : path, Record or DataFrame, or several, or None
        With a model: of those that it was identified from; the FMU is checked along them.
    progress : callable    Is called with what is being done, the number of parts done, and how many there are.

    Returns
    -------
    Path                   The FMU, written only after it was validated and gave the force of the model.

    Raises
    ------
    BuildError             If the FMU cannot be built, or fails its check.
    MountedSystemError     If a SYSTEM.toml is wrong, or its bodies cannot rest.
    ModelError             If a model file is not a physically possible spring, or does not meet its certificate, or
                           the name is not an identifier.
    IdentificationError    If no physically possible spring can have made the records.
    StrandspringError      If the folder is not writable, or an option is out of bounds.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import Spring, SpringParameters, build_fmu, verify
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> with TemporaryDirectory() as folder:
    ...     fmu = build_fmu(spring, folder)
    ...     print(fmu.name, verify(fmu).ok)
    mount.fmu True
    """
    checked_zero(zero)
    if name is not None:
        check_name(name)
    refuse_unwritable(Path(folder), is_folder=True)
    path = path_of(model)
    if path is not None and describes_system(path):
        refuse_given(OF_SYSTEM, path, **spring_options(building), zero=zero, name=name, record=record)
        from .system_fmu import SystemToBuild  # slow to import

        wanted = SystemToBuild.load(path, candidate, building.author, building.fmi)
        return wanted.build(Path(folder), building.chosen_platforms, progress).path
    if candidate is not None:
        raise BuildError("`candidate` is for descriptions of systems (SYSTEM.toml); leave it out.")
    before = built_with(path)
    options = building.with_those_of(before)
    kind: Any = "states" if building.states else options.backend or "native"
    if kind not in get_args(Kind) or (building.states and building.backend == "python"):
        raise BuildError(
            f'`backend` must be "native" or "python", and "native" with `states`, got {building.backend!r}.'
        )
    if building.needs_execution_tool and kind != "python":
        raise BuildError('`needs_execution_tool` is for the Python-backed FMU; add backend="python".')
    content, records = _model(model, path, record)
    content = content if name is None else replace(content, name=name)
    origin = before.zero if zero is None and before else zero
    return build_all(content, Path(folder), (kind,), options, origin, stated_of(content, records), progress)[0].path


def _model(
    source: Any, path: str | None, record: Source | Sequence[Source] | None
) -> tuple[ModelFile, Sequence[Record]]:
    """The model of a spring, of the file at a path, of an identification, or of records that are identified now, and
    the records along which its FMU is checked.
    """
    held = load_model(source) if path is not None and is_model_path(path) else getattr(source, "model", source)
    if isinstance(held, ModelFile) and record is None:
        return held, ()
    # Slow to import.
    from ...identification.identified import IdentifiedModel
    from ...identification.identify import identify_records
    from ..common.given import as_records

    if isinstance(held, ModelFile) and record is not None:
        return held, as_records(record)
    if record is not None:
        raise BuildError("`record` is for a model; an FMU of records is checked along these, so leave it out.")
    if isinstance(source, IdentifiedModel):
        identification = source
    else:
        identification = identify_records(as_records(source))
        for sentence in gathered(of_severity(identification.findings, CAUTIONS), Reader.PYTHON):
            warnings.warn(sentence, stacklevel=4)
    return identification.model_file(identification.record_name), identification.records
