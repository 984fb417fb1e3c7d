"""FMUs: built and put in place once they were validated and run (`build_fmu`), and verified (`verify`)."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, get_args

from ...errors import BuildError, Reader
from ...findings import CAUTIONS, gathered, of_severity
from ...fmu.checks.check import CheckReport, examine_fmu
from ...fmu.checks.verification import Check, verify_fmu
from ...fmu.native.native_fmu import build_native_fmu
from ...fmu.python_backed import build_python_fmu
from ...fmu.related_files import BuildSettings
from ...ground.files import refuse_unwritable
from ...ground.options import refuse_given, takes
from ...ground.result_columns import ResultColumn
from ...ground.strict_json import is_finite, objects
from ...model.certificate import certified
from ...model.coordinates import checked_zero, zero_sentence
from ...model.modelfile import ModelFile, is_model_path, load_model
from ...model.names import check_name
from ...model.stated_figures import NAMES
from ..common.model_source import ModelSource, Progress, built_with, describes_system, path_of, unseen
from ..common.result import Result
from ..common.table import Table
from .in_place import BuildOptions, BuiltFmu, FmuJob, Kind, build_in_place

if TYPE_CHECKING:
    from ...identification.identified import IdentifiedModel
    from ...records.record import Record
    from ..common.given import Source

Stated: TypeAlias = "tuple[Record, dict[str, Any]]"

OF_SYSTEM = "{option} can only be given with a model or records, and {where} describes a system; leave it out."
_RNL_TOLERANCE = 1e-6  # of sums over many samples, each within rounding
_CHECKS = tuple(ResultColumn(key, "", key) for key in ("about", "text", "is_problem"))


@dataclass(frozen=True, repr=False)
class Built(Result):
    """FMUs that were built of a model, or of records that were identified for them."""

    model: ModelFile
    path: Path  # of the model file
    zero: float  # displacement of the model file at which that of the FMUs is 0 [m]
    settings: BuildOptions
    fmus: Sequence[BuiltFmu]
    identification: Any  # Identification or None

    _stated: ClassVar[Mapping[str, Any]] = {}

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """What was identified, the model file with its certificate, and the FMUs."""
        if self.identification is not None:
            yield from self.identification.parts(brief)
        yield f"Model file: {self.path}"
        yield f"Certificate: {certified(self.model)}"
        if sentence := zero_sentence(self.zero):
            yield sentence
        for fmu in self.fmus:
            yield from [fmu.brief(self.settings)] if brief else fmu.text_lines(self.settings)

    def content(self) -> dict[str, Any]:
        """The same for JSON."""
        found = self.identification
        return {
            "model": self.path,
            "name": self.model.name,
            "parameters": self.model.parameters.as_dict(),
            "zero": self.zero,
            "certificate": certified(self.model),
            **(dict.fromkeys(NAMES) if found is None else found.figures),
            "fitted": None if found is None else found.fitted_figures,
            "fmus": [fmu.facts(self.settings) for fmu in self.fmus],
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
    """Build FMUs of several kinds beside their place, check them, those for co-simulation also along records with what
    `stated_of` gives, and put them in place if all are good.

    Raises
    ------
    StrandspringError   If the folder is not writable, or an FMU cannot be built.
    BuildError          If the options do not go together, or an FMU is not valid or answers otherwise than the model;
                        nothing is then left behind.
    ModelError          If the spring does not meet its certificate.
    """
    certified(model)
    options.refuse_impossible(kinds)

    jobs = []
    for kind in kinds:
        if kind == "python":
            execution = options.needs_execution_tool
            build = partial(build_python_fmu, model, zero=zero, needs_execution_tool=execution, author=options.author)
        else:
            build = partial(
                build_native_fmu, model, platforms=options.chosen_platforms, zero=zero, with_states=kind == "states",
                fmi=options.version, author=options.author,
            )  # fmt: skip
        # With states the path is the host's.
        along = () if kind == "states" else stated
        examine = partial(_examined, mechanisms=len(model.parameters.mechanisms), stated=along)
        jobs.append(FmuJob(options.target(folder, model.name, kind), kind, build, examine))
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
    names = ", ".join(Path(record.path).name for record, _ in stated)
    return replace(report, followed=f"; RNL as stated along {names}")


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

    Records are identified with the defaults of `identify`, and its cautions become warnings; along them the FMU must
    have the RNL that the model has. The FMU of a SYSTEM.toml is for co-simulation: base acceleration in, motion of
    points and forces of mounts out. It takes `fmi`, `platforms`, `author` and `candidate`.

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
        refuse_given(OF_SYSTEM, path, **building.of_springs, zero=zero, name=name, record=record)
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
    """The model that is given or identified now, and the records along which its FMU is checked."""
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


@dataclass(frozen=True, repr=False)
class Verification(Result):
    """What was checked of one FMU.

    Attributes
    ----------
    path : str                     Of the FMU.
    checks : tuple of Check   Each says what was looked at, one sentence, and whether it speaks against the FMU.
    """

    path: str
    checks: tuple[Check, ...]

    _stated: ClassVar[Mapping[str, Any]] = {}

    @property
    def problems(self) -> tuple[Check, ...]:
        """Checks that speak against the FMU."""
        return tuple(check for check in self.checks if check.is_problem)

    @property
    def ok(self) -> bool:
        """Whether nothing speaks against the FMU."""
        return not self.problems

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - all checks are worth a line
        """All checks in words, and as a table of files."""
        yield self.path
        yield from (f"  {check.about}: {check.text}" for check in self.checks)
        yield Table(_CHECKS, self.checks)

    def content(self) -> Mapping[str, Any]:
        """The path and the checks."""
        return vars(self)


def verify(fmu: str | os.PathLike[str]) -> Verification:
    """Verify an FMU on this computer.

    Compares every file with its hash of when the FMU was built, the model description with FMI's rules, the spring with
    its certificate, the range of force that its records support, and co-simulation and model exchange with the
    reference result that the FMU carries. An FMU with a changed file is not run; binaries that were added or compiled
    anew are named and run. The hashes show damage, not who built it: run FMUs of people you trust only.

    Parameters
    ----------
    fmu : path

    Returns
    -------
    Verification

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import Spring, SpringParameters, build_fmu, verify
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> with TemporaryDirectory() as folder:
    ...     verification = verify(build_fmu(spring, folder))
    >>> verification.ok
    True
    >>> [check.about for check in verification.checks]
    ['files', 'rules', 'spring', 'run']
    """
    return Verification(os.fspath(fmu), tuple(verify_fmu(Path(fmu))))
