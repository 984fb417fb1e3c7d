"""Files for other tools: FMUs, built, validated and run (`build_fmu`), and verified (`verify`); others by `export`."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import BuildError, OptionError, Reader, StrandspringError
from ...exchange.c_sources import constant_bytes, law_path, write_c_sources
from ...exchange.modelica import LIBRARY, record_name, record_path, write_library
from ...findings import CAUTIONS, Finding, gathered, of_severity
from ...fmu.archive import binary_sizes, fmu_path
from ...fmu.checks.check import CheckReport, examine_fmu
from ...fmu.checks.verification import Check, verify_fmu
from ...fmu.description.ssv import parameter_values
from ...fmu.native.native_fmu import build_native_fmu
from ...fmu.python_backed import build_python_fmu
from ...fmu.related_files import BuildSettings
from ...ground.arguments import flag
from ...ground.files import existing_folder, refuse_unwritable, refused_in_words, write_text
from ...ground.options import Option, changed, refuse_given, takes
from ...ground.result_columns import ResultColumn
from ...ground.scratch import TemporaryFolder
from ...ground.strict_json import is_finite, objects
from ...model.certificate import certified
from ...model.coordinates import checked_zero, placed, zero_sentence
from ...model.modelfile import ModelFile, is_model_path
from ...model.names import check_name
from ...model.stated_cautions import stated_cautions
from ...model.stated_figures import NAMES
from ..common import model_source as sources
from ..common.model_source import ModelSource, Progress, unseen
from ..common.result import Result, Table, picked
from .options import BuildOptions

if TYPE_CHECKING:
    from ...identification.identified import IdentifiedModel
    from ...records.record import Record
    from ..common.given import Source

_RNL_TOLERANCE = 1e-6  # of sums over many samples, each within rounding
_MASS = Option("number", "Mass", "kg", least=0.0, is_open=True)
_CHECKS = tuple(ResultColumn(key, "", key) for key in ("about", "text", "is_problem"))
# What each kind of FMU is for.
_PURPOSES = {
    "native": "native: for any simulator, with no Python on its machine",
    "states": "native with states: model exchange for optimal control, linearisation and functional importers",
    "python": "Python-backed: the model as readable Python, for simulators that run on Python",
    "system": "bodies on mounts: co-simulation in any simulator, with no Python on its machine",
}


@dataclass(frozen=True, repr=False)
class Exports(Result):
    """Files that were written for a model, in words and for JSON."""

    lines: Sequence[str]
    of: Mapping[str, Any]

    def parts(self, brief: bool) -> Iterable[str | Table]:  # noqa: ARG002 - all of it is short
        """What was written."""
        return self.lines

    def content(self) -> Mapping[str, Any]:
        """The same for JSON."""
        return self.of


@dataclass(frozen=True, repr=False)
class Built(Exports):
    """FMUs that were built, by kind with their checks, and what was identified for them."""

    fmi: int
    fmus: Mapping[str, CheckReport]
    findings: Sequence[Finding] = ()
    identification: Any = None

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """What was identified, what the FMUs are of, and each with its check."""
        if self.identification is not None:
            yield from self.identification.parts(brief)
        apart = ["FMI 3.0"] if self.fmi == 3 else []
        yield from self.lines
        for kind, report in self.fmus.items():
            size, binaries = f"{report.path.stat().st_size / 1024:.0f} KiB", binary_sizes(report.path)
            if brief:
                yield f"FMU: {report.path} ({', '.join((size, *binaries, *apart))}): {report.verdict}"
                continue
            yield f"FMU: {report.path} ({size}), {'; '.join((_PURPOSES[kind], *apart))}"
            sizes = ", ".join(f"{platform} {size / 1024:.0f} KiB" for platform, size in binaries.items())
            yield from (f"Binaries: {sizes}", f"Check: {report.summary}")

    def content(self) -> dict[str, Any]:
        """The same for JSON."""
        found = self.identification
        fmus = [
            {"path": report.path, "backend": "native" if kind == "system" else kind, "fmi": self.fmi}
            | {"binaries": binary_sizes(report.path), "check": report.summary}
            for kind, report in self.fmus.items()
        ]
        figures = {} if found is None else {**found.figures, "fitted": found.fitted_figures}
        return {**self.of, **figures, "fmus": fmus}


def _build_in_place(
    target: Path, build: Callable[[Path], Path], examine: Callable[[Path], CheckReport], progress: Progress
) -> CheckReport:
    """Build an FMU by a function that writes it into a folder, check it there, and put it into its place."""
    # In the same file system as its place, so that it is moved at once or not at all.
    with TemporaryFolder(existing_folder(target.parent)) as beside:
        progress(f"Building {target.name}", 0, 2)
        fmu = build(beside)
        progress(f"Validating and running {target.name}", 1, 2)
        report = examine(fmu)
        if report.problems:
            raise BuildError(f"{target} was not written, because the FMU failed its check: {report.summary}")
        with refused_in_words(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            fmu.replace(target)
    return replace(report, path=target)


def build_all(
    source: ModelSource, folder: Path, options: BuildOptions, progress: Progress = unseen, *,
    zero: str | float | None = None, candidate: str | None = None, name: str | None = None,
    records: Sequence[Record] = (), only_last: bool = False, claim: Callable[[Path], None] = refuse_unwritable,
) -> Built:  # fmt: skip
    """Build and check the FMUs of a model, also along records from which it was identified, or of a system.

    Of several kinds all are built, or the last one only. Before that, `claim` refuses paths that must not be written.
    """
    refuse_unwritable(folder, is_folder=True)
    path = sources.path_of(source)
    if path is not None and sources.describes_system(path):
        given = changed(options) | {"zero": zero, "name": name, "record": tuple(records)}
        of_models = {option: value for option, value in given.items() if option not in ("fmi", "platforms", "author")}
        refuse_given(f"{sources.OF_MODELS}; leave it out.", path, **of_models)
        from .system_fmu import build_system  # slow to import

        place = partial(_build_in_place, progress=progress)
        return Built(*build_system(path, folder, options, candidate, claim, place))
    refuse_given(sources.OF_SYSTEMS, path or "a spring", candidate=candidate)
    options, model = options.with_those_of(sources.built_with(path)), sources.model_of(source)
    model = model if name is None else replace(model, name=name)
    kinds = options.kinds()[-1:] if only_last else options.kinds()
    targets = {kind: fmu_path(folder, model.name, kind, options.version) for kind in kinds}
    for target in targets.values():
        claim(target)
    origin, certificate, checks = sources.origin_of(source, zero, model.parameters), certified(model), {}
    for kind, target in targets.items():
        build: Callable[[Path], Path] = partial(
            build_native_fmu, model, platforms=options.chosen_platforms, zero=origin, with_states=kind == "states",
            fmi=options.version, author=options.author,
        )  # fmt: skip
        if kind == "python":
            build = partial(build_python_fmu, model, zero=origin, **picked(options, "author", "needs_execution_tool"))
        # With states the path is the host's.
        examine = partial(_examined, model=model, records=() if kind == "states" else records)
        checks[kind] = _build_in_place(target, build, examine, progress)
    lines = [f"Model file: {path}", f"Certificate: {certificate}", *filter(None, [zero_sentence(origin)])]
    of = {"model": path, "name": model.name, "parameters": model.parameters.as_dict(), "zero": origin}
    of |= {"certificate": certificate, **dict.fromkeys((*NAMES, "fitted"))}
    return Built(lines, of, options.version, checks, stated_cautions(model))


def _examined(path: Path, model: ModelFile, records: Sequence[Record]) -> CheckReport:
    """The check of an FMU, also along records from their starts: RNL has to be what the model file states."""
    report = examine_fmu(path)
    if report.problems or report.not_run or not records:
        return report
    # Slow to import.
    from ...cosimulation.prescribed import simulate_fmu
    from ...identification.figures import chosen_samples, rnl

    zero, mechanisms = BuildSettings.of_fmu(path).zero, len(model.parameters.mechanisms)
    rows = list(zip(*(objects(content.get("records")) for content in (model.provenance, model.fit)), strict=False))
    for record in records:
        sought = {"sha256": record.sha256, "samples": len(record)}.items()
        figures: dict[str, Any] = next((figures for one, figures in rows if sought <= one.items()), {})
        if not all(is_finite(figures.get(name)) for name in ("rnl", "omega_start", "first_sample")):
            raise BuildError(
                f"{record.path}: the model {model.name} states no figures of this record as it is read now; give one "
                "that it was identified from, with the same options."
            )
        starts = dict.fromkeys(("omega_start", "second_omega_start")[:mechanisms], float(figures["omega_start"]))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of samples beyond the identified range
            force = simulate_fmu(path, record.displacement - zero, record.rising_time, starts).force
        compared = chosen_samples(record, figures["first_sample"])
        found = rnl(record.force[compared], force[compared])
        if not abs(found - figures["rnl"]) <= _RNL_TOLERANCE:
            text = f"RNL along {record.path} must be {figures['rnl']:.6f}, as the model file states, but is {found:.6f}"
            return replace(report, problems=(f"{text}; read the record as for the model, or identify it again.",))
    names = ", ".join(Path(record.path).name for record in records)
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

    Records are identified with the defaults of `identify`, and cautions become warnings; along them the FMU must have
    the RNL that the model has. The FMU of a SYSTEM.toml is for co-simulation, base acceleration in, motion of points
    and forces of mounts out, and takes `fmi`, `platforms`, `author` and `candidate`.

    Parameters
    ----------
    model : Spring, Identification, path of a model file, FMU or SYSTEM.toml, or records: paths, Record, DataFrame
    folder : path
    building : BuildOptions   Back end, version of FMI, platforms and others; or its fields as keywords.
    zero : "rig", "middle", float or None
        Where displacement is counted from: a displacement of the record [m]; if None, as in an FMU that is given, else
        the rig's zero if it is within the identified range, else the middle of that.
    name : str or None        Of the model and its FMU; if None, that of the model, or after the first record.
    candidate : str or None   Of a SYSTEM.toml; needed if it has several.
    record : path, Record or DataFrame, or several, or None
                              Of those that a model was identified from; the FMU is checked along them.
    progress : callable       Takes what is being done, the number of parts done, and of all.

    Returns
    -------
    Path   The FMU, written only after it was validated and gave the force of the model.

    Raises
    ------
    BuildError            If the FMU cannot be built, or fails its check.
    OptionError           If options do not go together.
    MountedSystemError    If a SYSTEM.toml is wrong, or its bodies cannot rest.
    ModelError            If a model is not a physically possible spring, or the name is not an identifier.
    IdentificationError   If no physically possible spring can have made the records.
    StrandspringError     If the folder is not writable, or an option is out of bounds.

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
    if building.backend == "both" or (building.states and building.backend == "python"):
        raise BuildError(
            f'`backend` must be "native" or "python", and "native" with `states`, got {building.backend!r}.'
        )
    from ..common.given import as_records  # slow to import

    source: Any = model
    records: Sequence[Record] = [] if record is None else as_records(record)
    path = sources.path_of(model)
    is_file = path is not None and (is_model_path(path) or sources.describes_system(path))
    if not is_file and not isinstance(getattr(model, "model", model), ModelFile):
        if records:
            raise BuildError("`record` is for a model; an FMU of records is checked along these, so leave it out.")
        # Slow to import.
        from ...identification.identified import IdentifiedModel
        from ...identification.identify import identify_records

        if not isinstance(model, IdentifiedModel):
            source = identify_records(as_records(model))
            for sentence in gathered(of_severity(source.findings, CAUTIONS), Reader.PYTHON):
                warnings.warn(sentence, stacklevel=3)
        source, records = source.model_file(source.record_name), source.records
    built = build_all(
        source, Path(folder), building, progress,
        zero=zero, candidate=candidate, name=name, records=records, only_last=True,
    )  # fmt: skip
    (report,) = built.fmus.values()
    return report.path


@dataclass(frozen=True, repr=False)
class Verification(Result):
    """What was checked of one FMU.

    Attributes
    ----------
    path : str                Of the FMU.
    checks : tuple of Check   What was looked at, in a sentence, and whether it speaks against the FMU.
    """

    path: str
    checks: tuple[Check, ...]

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

    Compares files with their hashes, the description with FMI's rules, the spring with its certificate and records, and
    runs with the reference result. With a changed file it is not run, but new binaries are. Hashes show damage, not who
    built it: run FMUs of people you trust only.

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


def export_files(
    source: ModelSource, folder: str | os.PathLike[str], progress: Progress = unseen, *, ssv: bool, modelica: bool,
    c: bool, ssp_mass: float | None, zero: str | float | None, claim: Callable[[Path], None] = refuse_unwritable,
) -> Exports:  # fmt: skip
    """See `export`; before anything is written, `claim` refuses paths that must not be."""
    model, target = sources.model_of(source), Path(folder)
    if (modelica or c) and target.suffix and not target.is_dir():
        what = f"of the library {LIBRARY}" if modelica else "of the C sources"
        raise OptionError(f"{{to[output]}} must be the folder {what}, got {{where}}.", where=target)
    if modelica and (target / "package.mo").exists():
        raise OptionError(f"{target} is a Modelica package; give the folder that holds the library {LIBRARY}.")
    files = {
        "ssv": _file(target, f"{model.name}.ssv") if ssv else None,
        "ssp": None if ssp_mass is None else _file(target, f"{model.name}.ssp"),
        "modelica": record_path(target, model.name) if modelica else None,
        "c": law_path(target, model.name) if c else None,
    }
    origin = sources.origin_of(source, zero, model.parameters)
    for file in filter(None, files.values()):
        claim(file)
    content, _ = placed(model, origin)
    lines = [zero_sentence(origin)]
    # The library first: it may be refused.
    if modelica:
        write_library(target, content, origin)
        record = record_name(model.name)
        taken = "" if record == model.name else f", because {model.name} is taken in Modelica"
        lines.append(f"Modelica library: {target / LIBRARY}, record {LIBRARY}.Records.{record}{taken}")
    if path := files["ssv"]:
        write_text(path, parameter_values(content))
        lines.append(f"SSP parameter values: {path}")
    if (path := files["ssp"]) and ssp_mass is not None:
        from ...exchange.ssp import ShakenMassValues, write_system

        progress("Building the FMU of the system", 0, 1)
        with TemporaryFolder() as beside:
            fmu = build_native_fmu(model, beside, zero=origin)
            write_system(path, fmu, content, ShakenMassValues.suited(content, ssp_mass))
        lines.append(f"SSP system: {path}")
    if path := files["c"]:
        write_c_sources(target, content, origin)
        size = constant_bytes(model.parameters) / 1000
        lines.append(f"C sources: {path} and what it needs; {size:.0f} kB of constants")
    return Exports(list(filter(None, lines)), {"name": model.name, "zero": origin, **files})


def export(
    model: ModelSource,
    folder: str | os.PathLike[str] = "dist",
    *,
    ssv: bool = False,
    modelica: bool = False,
    c: bool = False,
    ssp_mass: float | None = None,
    zero: str | float | None = None,
) -> list[Path]:
    """Write a model as SSP parameter values, in an SSP system, into a Modelica library, or as C sources.

    Parameters
    ----------
    model : Spring, or path of a model file or FMU
    folder : path     Or the file to write, ending in .ssv or .ssp.
    ssv : bool        Write NAME.ssv, the parameter values of the model's FMU.
    modelica : bool   Write the Modelica library StrandSpring with a record of the spring, beside others.
    c : bool          Write C sources of the spring and its kernel for targets without FMI into the folder
                      strandspring_c, beside other springs.
    ssp_mass : float or None Write NAME.ssp, the native FMU below this mass [kg] on a shaking base.
    zero : "rig", "middle", float or None
        Where displacement is counted from: a displacement of the record [m]; by default as in the model's FMU.

    Returns
    -------
    list of Path   The files: NAME.ssv, NAME.ssp, the spring's record in the library and its C file, where
                   asked for.

    Raises
    ------
    StrandspringError   If nothing is asked for, an option is out of bounds, or a file cannot be written.
    BuildError          If the FMU of the system cannot be built.
    ModelError          If the model is not a physically possible spring.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import Spring, SpringParameters, export
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> with TemporaryDirectory() as folder:
    ...     print([path.name for path in export(spring, folder, ssv=True, modelica=True)])
    ['mount.ssv', 'mount.mo']
    """
    ssv, modelica, c = flag("ssv", ssv), flag("modelica", modelica), flag("c", c)
    if not (ssv or modelica or c or ssp_mass is not None):
        raise StrandspringError("Nothing to write; give `ssv`, `modelica`, `c` or `ssp_mass`.")
    if ssp_mass is not None:
        ssp_mass = _MASS.checked("ssp_mass", ssp_mass, StrandspringError)
    refuse_unwritable(Path(folder), is_folder=not Path(folder).suffix)
    made = export_files(model, folder, ssv=ssv, modelica=modelica, c=c, ssp_mass=ssp_mass, zero=zero)
    return [path for path in made.of.values() if isinstance(path, Path)]


def _file(output: Path, name: str) -> Path:
    """The file `name` in the folder `output`, or `output` itself if it has the suffix of `name`."""
    suffix = Path(name).suffix
    with refused_in_words(output):
        if output.is_dir() or not (output.suffix or output.exists()):
            return output / name
    if output.suffix != suffix:
        sentence = f"{{to[output]}} must be a folder, or a file name ending in {suffix}, got {{where}}."
        raise OptionError(sentence, where=output)
    return output
