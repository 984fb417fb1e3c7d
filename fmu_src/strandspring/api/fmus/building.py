"""`build_fmu`: an FMU of a model or of records, put in place after it was validated and run."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

from ...errors import BuildError, Reader
from ...findings import CAUTIONS, gathered, of_severity
from ...fmu.archive import fmu_path
from ...fmu.checks.check import CheckReport, examine_fmu
from ...fmu.native.native_fmu import build_native_fmu
from ...fmu.native.platforms import Platform, chosen_platforms
from ...fmu.python_backed import PYTHON_PLATFORMS, build_python_fmu
from ...fmu.related_files import BuildSettings
from ...ground.arguments import flag
from ...ground.files import refuse_unwritable
from ...ground.strict_json import is_finite, objects
from ...model.certificate import certified
from ...model.coordinates import checked_zero
from ...model.modelfile import ModelFile, is_model_path, load_model
from ...model.names import check_name
from ..common.model_source import ModelSource, built_with, describes_system, path_of
from ..common.progress import Progress, unseen
from .fmus_in_place import BuiltFmu, FmuJob, build_in_place

if TYPE_CHECKING:
    from ...identification.identified import IdentifiedModel
    from ...records.given import Source
    from ...records.record import Record

Kind: TypeAlias = Literal["native", "python", "states"]
Stated: TypeAlias = "tuple[Record, dict[str, Any]]"

_LONGEST_AUTHOR = 200
_RNL_TOLERANCE = 1e-6  # of sums over many samples, each within rounding


@dataclass(frozen=True)
class BuildOptions:
    """How FMUs are built; what is not asked for is taken from the FMU that is the source, if it is one.

    Parameters
    ----------
    backend : str or None           native, python, both, or states of an FMU that is the source.
    author : str
    needs_execution_tool : bool     Of the Python-backed FMU.
    fmi : int or None               Version of FMI, 2 or 3.
    real_time : bool                Nothing is allocated after instantiation.
    no_energy : bool                The output absorbed_energy is left out.
    arrays : bool                   Coefficients are arrays, in FMI 3.0.
    platforms : sequence of Platform or None   Those of the binaries of native FMUs.
    """

    backend: str | None = None
    author: str = ""
    needs_execution_tool: bool = False
    fmi: int | None = None
    real_time: bool = False
    no_energy: bool = False
    arrays: bool = False
    platforms: Sequence[Platform] | None = None

    @property
    def version(self) -> int:
        """The version of FMI that is built."""
        return 2 if self.fmi is None else self.fmi

    def target(self, folder: str | Path, name: str, kind: str) -> Path:
        """Where an FMU of this kind of a model of this name is written."""
        return fmu_path(folder, name, kind, self.version, self.real_time)

    def with_those_of(self, before: BuildSettings | None) -> BuildOptions:
        """These and, where nothing was asked for, those of the FMU that is the source, if it is one."""
        if before is None:
            return self
        options = replace(self, backend=self.backend or before.backend, author=self.author or before.author)
        if self.backend not in (None, before.backend, "both"):
            return options
        options = replace(options, needs_execution_tool=self.needs_execution_tool or before.needs_execution_tool)
        if self.backend == "both":
            return options
        return replace(
            options,
            fmi=self.fmi or before.fmi,
            real_time=self.real_time or before.real_time,
            no_energy=self.no_energy or before.no_energy,
            # FMI 2.0 has none.
            arrays=self.arrays or (before.arrays and self.fmi != 2),
        )

    def refuse_impossible(self, kinds: Sequence[Kind]) -> None:
        """Raise BuildError if FMUs of these kinds cannot be built so."""
        if not isinstance(self.version, int) or self.version not in (2, 3):
            raise BuildError(f"The version of FMI must be 2 or 3, got {self.fmi!r}.")
        if "python" in kinds and self.fmi == 3:
            raise BuildError("FMI 3.0 is for the native FMU; choose the native back end.")
        if "python" in kinds and self.real_time:
            raise BuildError("Real time is for the native FMU; choose the native back end.")
        if self.arrays and self.version != 3:
            raise BuildError("Arrays are for FMI 3.0; ask for FMI 3, too.")
        if self.no_energy and not self.real_time:
            raise BuildError("Only an FMU for real time can leave out absorbed_energy; ask for real time, too.")
        if self.no_energy and "states" in kinds:
            raise BuildError(
                "The form with states has absorbed_energy as a state, which the host integrates; build it without "
                "leaving out the energy, from the model file where the source is an FMU that leaves it out."
            )
        if set(kinds) == {"python"} and self.platforms is not None:
            raise BuildError(
                f"Platforms are chosen for the native FMU; the Python-backed one has {' and '.join(PYTHON_PLATFORMS)}: "
                "build it without choosing any."
            )


def checked_author(author: str) -> str:
    """The author; raises BuildError if it is not a short printable text."""
    if len(author) > _LONGEST_AUTHOR or not author.isprintable():
        raise BuildError(f"The author must be printable text of at most {_LONGEST_AUTHOR} characters.")
    return author


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
            options.target(folder, model.name, kind),
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
        model, folder, options.platforms, zero, author, with_states=kind == "states", fmi=options.version,
        real_time=options.real_time, no_energy=options.no_energy, arrays=options.arrays,
    )  # fmt: skip


def build_fmu(
    model: ModelSource | IdentifiedModel | Source | Sequence[Source],
    folder: str | os.PathLike[str] = "dist",
    *,
    backend: Literal["native", "python"] | None = None,
    states: bool = False,
    fmi: Literal[2, 3] | None = None,
    real_time: bool = False,
    no_energy: bool = False,
    arrays: bool = False,
    platforms: str | Sequence[str] | None = None,
    zero: str | float | None = None,
    author: str = "",
    needs_execution_tool: bool = False,
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
    backend : "native", "python" or None
        native: runs anywhere; python: readable, for simulators on Linux x86-64 and Windows that run on Python. If None,
        that of the FMU if one is given, else native.
    states : bool
        The native form with omega and absorbed_energy as continuous states, NAME_states.fmu, for model exchange.
    fmi : 2, 3 or None
        Version of FMI; NAME_fmi3.fmu is an FMU of FMI 3.0, which only the native back end can be. If None, that of the
        FMU if one is given, else 2.
    real_time : bool
        A native FMU that allocates nothing after instantiation, for targets with a deadline.
    no_energy : bool
        Leave the output absorbed_energy out of an FMU for real time.
    arrays : bool
        With FMI 3.0: kE and kA, or FE_knots, FE_forces and kA, as arrays, which few importers read.
    platforms : str, sequence of str or None
        Of the binaries of native FMUs, such as "linux64" or "win64", or "host" or "all"; those that the installed
        package carries if None.
    zero : "rig", "middle", float or None
        Where displacement is counted from: a displacement of the record [m]; if None, as in the FMU if one is given,
        else the rig's zero if it lies within the identified range, else the middle of the range.
    author : str
    needs_execution_tool : bool
        Declare in the Python-backed FMU that Python must be installed on the simulator's computer.
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
    checked_author(author)
    # FMUs hold these as JSON, which knows no bool of NumPy.
    states, needs_execution_tool = flag("states", states), flag("needs_execution_tool", needs_execution_tool)
    real_time, no_energy, arrays = flag("real_time", real_time), flag("no_energy", no_energy), flag("arrays", arrays)
    if name is not None:
        check_name(name)
    refuse_unwritable(Path(folder), is_folder=True)
    names = [platforms] if isinstance(platforms, str) else platforms
    chosen = None if names is None else chosen_platforms(",".join(names))
    path = path_of(model)
    if path is not None and describes_system(path):
        others = {"backend": backend, "states": states, "real_time": real_time, "no_energy": no_energy,
                  "arrays": arrays, "needs_execution_tool": needs_execution_tool, "zero": zero,
                  "name": name, "record": record}  # fmt: skip
        if given := [f"`{option}`" for option, value in others.items() if value is not None and value is not False]:
            raise BuildError(f"{', '.join(given)} cannot be given with a description of a system; leave that out.")
        from .building_system import SystemToBuild  # slow to import

        wanted_system = SystemToBuild.load(path, candidate, author, fmi)
        return wanted_system.build(Path(folder), chosen, progress).path
    if candidate is not None:
        raise BuildError("`candidate` is for descriptions of systems (SYSTEM.toml); leave it out.")
    before = built_with(path)
    wanted = BuildOptions(backend, author, needs_execution_tool, fmi, real_time, no_energy, arrays, chosen)
    options = wanted.with_those_of(before)
    kind: Any = "states" if states else options.backend or "native"
    if kind not in get_args(Kind) or (states and backend == "python"):
        raise BuildError(f'`backend` must be "native" or "python", and "native" with `states`, got {backend!r}.')
    if needs_execution_tool and kind != "python":
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
    from ...records.given import as_records

    if isinstance(held, ModelFile) and record is not None:
        return held, as_records(record)
    if record is not None:
        raise BuildError("`record` is for a model; an FMU of records is checked along these, so leave it out.")
    if isinstance(source, IdentifiedModel):
        identification = source
    else:
        identification = identify_records(as_records(source))
        for sentence in gathered(of_severity(identification.findings, CAUTIONS), Reader.PYTHON):
            warnings.warn(sentence, stacklevel=3)
    return identification.model_file(identification.record_name), identification.records
