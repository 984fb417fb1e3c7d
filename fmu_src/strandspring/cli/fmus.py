"""`strandspring build` (which ``build_fmu.py`` calls), `verify` and `export`: from springs to files of other tools."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import strandspring

from ..api.fmus.options import BuildOptions
from ..api.options import Fitting
from ..ground.files import readable, refuse_unwritable
from ..ground.options import refuse_given
from ..loops.reading import Reading
from ..model.names import check_name, identifier
from . import options as opt
from . import output as out

if TYPE_CHECKING:
    from ..records.record import Record


@opt.command(sources="[MODEL.json | X.fmu | SYSTEM.toml | RECORD...]")
@opt.takes_options(building=BuildOptions)
@opt.given("--candidate", metavar="NAME", group="FMU", help="Of a SYSTEM.toml: the candidate, if it has several.")
@opt.zero_option
@opt.given("--name", type=opt.Written(check_name),
           help="Name of the model identified from records.  [default: from the first record]")  # fmt: skip
@opt.given("--description", default="", help="Free text for the model identified from records.")
@opt.given("--models", default="models", show_default=True, metavar="DIR",
           help="Folder for the model file identified from records.")  # fmt: skip
@opt.given("--record", multiple=True, metavar="RECORD", group="Reading",
           help="With a model file: one of its records, along which the FMU is checked.")  # fmt: skip
@opt.takes_options(reading=Reading)
@opt.given("-o", "--output", default="dist", show_default=True, metavar="DIR", help="Folder for the FMUs.")
def build(
    sources: tuple[str, ...], output: str, record: tuple[str, ...], candidate: str | None, zero: str | float | None,
    name: str | None, description: str, models: str, building: BuildOptions, reading: Reading,
) -> None:  # fmt: skip
    """From an FMU of strandspring its model file is built again with the same settings.

    Records are read and identified as `identify` does by default, without an argument the bundled record of a rubber
    hinge on a tensile rig; with any option of `identify`, identify them first, then build the model file.

    The FMU of a SYSTEM.toml holds the bodies on the mounts of one candidate, for co-simulation: acceleration of the
    base in, motion of points and forces of mounts out. It is native.

    \b
    Examples:
      strandspring build spring.json
      strandspring build spring.json --platform linux64,win64
      strandspring build spring.json --record loop.csv
      strandspring build loop.csv --name mount_a -o dist
      strandspring build box.toml --candidate softer
    """
    from ..api.common.model_source import describes_system
    from ..api.fmus.build import build_all
    from ..model.modelfile import is_model_path, saved_model

    source, identification = sources[0] if len(sources) == 1 else "", None
    if source and (is_model_path(source) or describes_system(source)):
        sentence = "{option} can only be given with records, and {where} is none; leave it out."
        refuse_given(sentence, source, name=name, description=description or None)
        records: Sequence[Record] = opt.read_records(record, reading)
    else:
        from ..api.common.given import bundled_record  # slow to import
        from .springs import identified

        sentence = (
            "{option} does not apply to records, which are read and identified as `identify` does by default; identify "
            "them first, then build MODEL.json."
        )
        refuse_given(sentence, "", candidate=candidate, record=record, **reading.given)
        for folder in (output, models):
            refuse_unwritable(Path(folder), is_folder=True)
        if not sources:
            # Its machine position counts down while the sample is stretched.
            sources, reading = (str(bundled_record(Path(models))),), Reading(reverse="displacement")
            name, usual = name or "rubber_hinge", "native" if building.fmi == 3 else "both"
            building = replace(building, backend=building.backend or usual)
        building.kinds()
        name = name or identifier(Path(sources[0]).stem)
        model_path = Path(models) / f"{name}.json"
        out.refuse_overwriting(opt.record_files(sources), {"--models": model_path})
        identification = identified(sources, reading, Fitting())
        out.remark(identification.sentences)
        saved_model(model_path, identification.model_file(name, description))
        source, records = str(model_path), identification.records
    with out.reporting() as progress:
        built = build_all(
            source, Path(output), building, progress, zero=zero, candidate=candidate, records=records,
            claim=lambda target: out.refuse_overwriting([source], {"--output": target}),
        )  # fmt: skip
    if identification is not None:
        built = replace(built, identification=identification, findings=())
    out.present(built)


@opt.command(fmus="X.fmu...", flags=["json"])
def verify(fmus: tuple[str, ...]) -> None:
    """Compares every file with its hash, the model description with FMI's rules, and co-simulation and model exchange
    with the reference result in the FMU. An FMU with a changed file is not run; binaries that were added or compiled
    anew are named and run. The hashes show damage, not who built it: run FMUs of people you trust only.

    \b
    Examples:
      strandspring verify dist/spring.fmu
      strandspring verify dist/*.fmu --json
    """
    verifications = []
    for fmu in fmus:
        with out.reporting(f"Verifying {fmu}"):
            verifications.append(strandspring.verify(fmu))
    if out.is_asked("json"):
        out.result_json({"fmus": [verification.as_json() for verification in verifications]})
    else:
        for verification in verifications:
            out.present(verification)
    damaged = [verification for verification in verifications if not verification.ok]
    for verification in damaged:
        sentence = f"{verification.path} must not be used: {verification.problems[0].text}"
        click.echo(readable(f"strandspring: {sentence}"), err=True)
    if damaged:
        sys.exit(1)


@opt.command(model="MODEL.json", flags=["json"])
@opt.given("--ssv", is_flag=True, help="Write SSP parameter values (SSV) for the model's FMU.")
@opt.given("--ssp", is_flag=True, help="Write an SSP system: the native FMU below a mass on a shaking base.")
@opt.mass_option("Mass for --ssp", "Output")
@opt.given("--modelica", is_flag=True, help="Write the Modelica library StrandSpring with a record of the spring.")
@opt.given("--c", is_flag=True, help="Write C sources of the spring for targets without FMI.")
@opt.given("-o", "--output", default="dist", show_default=True, metavar="DIR|FILE",
           help="Folder, or file name ending in .ssv or .ssp; the Modelica library and C sources take a folder and "
           "keep other springs.")  # fmt: skip
@opt.zero_option
def export(model: str, ssp: bool, mass: float | None, output: str, **options: Any) -> None:
    """\b
    Examples:
      strandspring export spring.json --ssv -o system/resources/mount.ssv
      strandspring export spring.json --ssv --modelica -o dist
      strandspring export spring.json --ssp --mass 5
      strandspring export spring.json --c -o firmware
    """
    if not (ssp or options["ssv"] or options["modelica"] or options["c"]):
        raise click.UsageError("Nothing to write; give --ssv, --ssp, --modelica or --c.")
    if ssp != (mass is not None):
        raise click.UsageError("--ssp and --mass KG go together.")
    from ..api.fmus.build import export_files

    with out.reporting() as progress:
        exports = export_files(
            model, output, progress, ssp_mass=mass, **options,
            claim=lambda target: out.refuse_overwriting([model], {"--output": target}),
        )  # fmt: skip
    out.present(exports, {"model": model})
