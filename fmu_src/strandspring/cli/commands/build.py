"""`strandspring build`, which ``build_fmu.py`` calls."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import click

from ...api.common.model_source import built_with, describes_system
from ...api.fmus.building import BuildOptions, Kind, build_all, checked_author, stated_of
from ...api.fmus.fmus_in_place import BuiltFmu
from ...errors import BuildError
from ...fmu.archive import binary_sizes
from ...fmu.native.platforms import PLATFORMS, chosen_platforms
from ...ground.files import refuse_unwritable
from ...model.certificate import certified
from ...model.coordinates import zero_sentence
from ...model.modelfile import is_model_path, load_model, saved_model
from ...model.stated_cautions import stated_cautions
from ...model.stated_figures import NAMES
from ..shared.cautions import note_cautions
from ..shared.descriptions import refuse_given
from ..shared.option_types import checked_by, name_option, output_options
from ..shared.options import (
    identification_options,
    identifier,
    method_options,
    read_records,
    record_files,
    record_options,
)
from ..shared.output import present, reporting
from ..shared.paths import refuse_overwriting
from ..shared.zero import origin_of, zero_option

# Of the bundled record: its machine position counts down while the sample is stretched.
EXAMPLE_NAME = "rubber_hinge"
EXAMPLE_COLUMNS = {"reverse": "displacement"}

# Options that a system does not take.
_OF_SPRINGS = (
    "backend", "states", "real_time", "no_energy", "arrays", "needs_execution_tool",
    "record", "models", "name", "description", "zero", "save_anyway",
)  # fmt: skip

# What each kind of FMU is for.
_PURPOSES = {
    "native": "native: for any simulator, with no Python on its machine",
    "states": "native with states: model exchange for optimal control, linearisation and functional importers",
    "python": "Python-backed: the model as readable Python, for simulators that run on Python",
    "system": "bodies on mounts: co-simulation in any simulator, with no Python on its machine",
}


@click.command()
@click.argument("sources", nargs=-1, metavar="[MODEL.json | X.fmu | SYSTEM.toml | RECORD...]")
@click.option("-o", "--output", default="dist", show_default=True, metavar="DIR", help="Folder for the FMUs.")
@click.option(
    "--backend",
    type=click.Choice(["native", "python", "both"]),
    help="native: NAME.fmu, which runs anywhere; python: NAME_python.fmu, for simulators on Linux x86-64 and Windows "
    "that run on Python 3.10 or newer, or have loaded its shared library."
    "  [default: native; both for the bundled record]",
)
@click.option(
    "--states",
    is_flag=True,
    help="Build also NAME_states.fmu: native model exchange with omega and absorbed_energy as continuous states and "
    "velocity as a second input, for importers that evaluate FMUs as functions, CasADi among them.",
)
@click.option(
    "--fmi",
    type=click.Choice(["2", "3"]),
    help="Version of FMI. 3: NAME_fmi3.fmu, with a flange as terminal; native only."
    "  [default: that of the FMU that is rebuilt, else 2]",
)
@click.option(
    "--real-time",
    is_flag=True,
    help="Build native FMUs, NAME_real_time.fmu, for targets with a deadline: they allocate nothing once instantiated.",
)
@click.option("--no-energy", is_flag=True, help="With --real-time: leave out the output absorbed_energy.")
@click.option("--arrays", is_flag=True, help="With --fmi 3: coefficients as arrays, which few importers read.")
@click.option(
    "--platform",
    "platforms",
    metavar="NAME,...",
    callback=checked_by(chosen_platforms),
    help=f"Of the binaries of native FMUs: host, all, or some of {', '.join(PLATFORMS)}.  "
    "[default: all in an installed package, host in a source checkout]",
)
@click.option(
    "--needs-execution-tool",
    is_flag=True,
    help="Declare in the Python-backed FMU that Python must be installed on the simulator's machine; some importers, "
    "PyFMI among them, refuse an FMU that declares it.  [default: not declared, as for a library]",
)
@click.option(
    "--record",
    multiple=True,
    metavar="RECORD",
    help="With a model file: one of the records that it was identified from, read by the options of records, along "
    "which the FMU is checked.",
)
@click.option(
    "--models",
    default="models",
    show_default=True,
    metavar="DIR",
    help="Folder for the model file identified from records.",
)
@name_option("Name of the model identified from records.  [default: from the first record]")
@click.option("--description", default="", help="Free text for the model identified from records.")
@zero_option
@click.option(
    "--author", default="", callback=checked_by(checked_author), help="Author of the FMU, for its model description."
)
@click.option("--candidate", metavar="NAME", help="Of a SYSTEM.toml: the candidate; needed if it has several.")
@record_options
@identification_options
@output_options
def build(
    sources: tuple[str, ...],
    output: str,
    states: bool,
    record: tuple[str, ...],
    models: str,
    name: str | None,
    description: str,
    zero: str | float | None,
    candidate: str | None,
    save_anyway: bool,
    as_json: bool,
    **options: Any,
) -> None:  # fmt: skip
    """Build, validate and run the FMU of a model file, of records that are identified first, or of a system.

    From an FMU of strandspring the model file that it holds is built again with the same settings, which gives the same
    bytes for the same platforms.

    The FMU of a SYSTEM.toml holds the bodies on the mounts of one candidate, for co-simulation: acceleration of the
    base in, motion of points and forces of mounts out. It is native; only --output, --fmi, --platform, --author,
    --candidate and --json apply.

    Without an argument the bundled measured record is identified, a rubber hinge on a tensile rig, and built with both
    back ends.

    \b
    Examples:
      strandspring build spring.json
      strandspring build spring.json --platform linux64,win64
      strandspring build spring.json --zero 35
      strandspring build spring.json --states
      strandspring build spring.json --fmi 3
      strandspring build spring.json --record loop.csv
      strandspring build loop.csv --name mount_a -o dist
      strandspring build box.toml --candidate softer
    """
    fmi = options.pop("fmi")
    names = [field.name for field in fields(BuildOptions) if field.name != "fmi"]
    settings = BuildOptions(**{name: options.pop(name) for name in names}, fmi=None if fmi is None else int(fmi))
    if len(sources) == 1 and describes_system(sources[0]):
        refuse_given({*_OF_SPRINGS, *options}, "a model or records", f"{sources[0]} describes a system")
        _build_system(sources[0], Path(output), candidate, settings, as_json)
        return
    if candidate is not None:
        raise click.UsageError("--candidate is for descriptions of systems (SYSTEM.toml); leave it out.")
    if len(sources) == 1:
        settings = settings.with_those_of(built_with(sources[0]))
    kinds = _kinds(settings, states, bool(sources))
    refuse_unwritable(Path(output), is_folder=True)
    of_records = {"name", "description", "save_anyway", *options}
    method = method_options(options)
    if len(sources) == 1 and is_model_path(sources[0]):
        refuse_given(of_records - set(options if record else ()), "records", f"{sources[0]} is a model file")
        model, model_path, identification = load_model(sources[0]), Path(sources[0]), None
        records = tuple(read_records(record, options)) if record else ()
        note_cautions(stated_cautions(model))
        for kind in kinds:
            refuse_overwriting(sources, {"--output": settings.target(output, model.name, kind)})
    else:
        # Slow to import.
        from ...records.given import bundled_record
        from .identify import identified

        refuse_given({"record"}, "a model file", "records are identified and followed without it")
        if not sources:
            sources, name = (str(bundled_record(Path(models))),), EXAMPLE_NAME if name is None else name
            options = {**options, **{key: options[key] or value for key, value in EXAMPLE_COLUMNS.items()}}
        chosen = name or identifier(Path(sources[0]).stem)
        refuse_unwritable(Path(models), is_folder=True)
        model_path = Path(models) / f"{chosen}.json"
        for kind in kinds:
            target = settings.target(output, chosen, kind)
            refuse_overwriting(record_files(sources), {"--models": model_path, "--output": target})
        model, identification = identified(sources, options, method, chosen, description, save_anyway)
        note_cautions(identification.findings)
        model, records = saved_model(model_path, model), identification.records
    origin = origin_of(sources[0], zero, model.parameters)
    with reporting() as progress:
        built = build_all(model, Path(output), kinds, settings, origin, stated_of(model, records), progress)
    certificate = certified(model)
    origin_lines = [f"Model file: {model_path}", f"Certificate: {certificate}", *filter(None, [zero_sentence(origin)])]
    present(
        as_json,
        lambda: {
            "model": str(model_path),
            "name": model.name,
            "parameters": model.parameters.as_dict(),
            "zero": origin,
            "certificate": certificate,
            **(dict.fromkeys(NAMES) if identification is None else identification.figures),
            "fitted": None if identification is None else identification.fitted_figures,
            "fmus": [
                _facts(fmu, settings)
                | {"real_time": settings.real_time, "no_energy": settings.no_energy, "arrays": settings.arrays}
                for fmu in built
            ],
        },
        lambda width: [
            *(() if identification is None else identification.brief(width)),
            *origin_lines,
            *(_fmu_line(fmu, settings) for fmu in built),
        ],
        lambda width: [
            *(() if identification is None else identification.text_lines(width)),
            *origin_lines,
            *(line for fmu in built for line in _fmu_lines(fmu, settings)),
        ],
    )


def _facts(built: BuiltFmu, settings: BuildOptions) -> dict[str, object]:
    """What --json says of every FMU."""
    return {
        "path": str(built.path),
        "backend": "native" if built.kind == "system" else built.kind,
        "fmi": settings.version,
        "binaries": binary_sizes(built.path),
        "check": built.check.summary,
    }


def _fmu_line(built: BuiltFmu, settings: BuildOptions) -> str:
    """An FMU in few words."""
    facts = [f"{built.path.stat().st_size / 1024:.0f} KiB", *binary_sizes(built.path), *_settings_apart(settings)]
    return f"FMU: {built.path} ({', '.join(facts)}): {built.check.verdict}"


def _fmu_lines(built: BuiltFmu, settings: BuildOptions) -> list[str]:
    """An FMU in words."""
    binaries = ", ".join(f"{platform} {size / 1024:.0f} KiB" for platform, size in binary_sizes(built.path).items())
    purpose = "; ".join((_PURPOSES[built.kind], *_settings_apart(settings)))
    return [
        f"FMU: {built.path} ({built.path.stat().st_size / 1024:.0f} KiB), {purpose}",
        f"Binaries: {binaries}",
        f"Check: {built.check.summary}",
    ]


def _settings_apart(settings: BuildOptions) -> list[str]:
    """What sets native FMUs apart from the usual ones."""
    of_energy = " without absorbed_energy" if settings.no_energy else ""
    return [
        *(["FMI 3.0" + (" with arrays" if settings.arrays else "")] if settings.version == 3 else []),
        *([f"for real time{of_energy}"] if settings.real_time else []),
    ]


def _kinds(settings: BuildOptions, states: bool, has_sources: bool) -> tuple[Kind, ...]:
    """The kinds of FMU to be built.

    Raises
    ------
    UsageError   If what is wanted does not go together.
    """
    backend = settings.backend
    if backend is None:
        backend = "native" if has_sources or settings.version == 3 or settings.real_time else "both"
    backends: tuple[Any, ...] = ("native", "python") if backend == "both" else (backend,)
    if settings.needs_execution_tool and "python" not in backends:
        raise click.UsageError("--needs-execution-tool is for the Python-backed FMU; add --backend python or both.")
    kinds = tuple(dict.fromkeys((*backends, "states"))) if states else backends
    try:
        settings.refuse_impossible(kinds)
    except BuildError as refusal:
        raise click.UsageError(str(refusal)) from None
    return kinds


def _build_system(source: str, folder: Path, candidate: str | None, settings: BuildOptions, as_json: bool) -> None:
    # Slow to import.
    from ...api.fmus.building_system import SystemToBuild
    from ...fmu.system.system_variables import system_variables

    refuse_unwritable(folder, is_folder=True)
    building = SystemToBuild.load(source, candidate, settings.author, settings.fmi)
    refuse_overwriting([source], {"--output": building.target(folder)})
    with reporting() as progress:
        built = building.build(folder, settings.platforms, progress)
    inputs = [v.name for v in system_variables(building.system, building.options) if v.causality == "input"]
    settings = replace(settings, fmi=building.options.fmi)
    step, stable = building.options.step, building.options.largest_step
    head = [
        f"System: {building.file.name}, {building.candidate}",
        f"Inputs: {', '.join(inputs)}",
        f"Internal step: at most {step:g} s; stable up to {stable:.4g} s",
    ]
    present(
        as_json,
        lambda: {
            "system": source,
            "name": building.file.name,
            "candidate": building.candidate,
            "step": step,
            "stable_step": stable,
            "inputs": inputs,
            "fmus": [_facts(built, settings)],
        },
        lambda _: [*head, _fmu_line(built, settings)],
        lambda _: [*head, *_fmu_lines(built, settings)],
    )
