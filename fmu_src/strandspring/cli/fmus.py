"""`strandspring build` (which ``build_fmu.py`` calls), `verify` and `export`: from springs to files of other tools."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import strandspring

from ..api.fmus.options import BuildOptions
from ..api.options import Fitting
from ..errors import flag_of
from ..ground.files import readable, refuse_unwritable
from ..loops.reading import Reading
from ..model.names import check_name, identifier
from . import options as opt
from . import output as out

if TYPE_CHECKING:
    from ..records.record import Record

_IDENTIFY_FIRST = "identify the records first, then build MODEL.json"


class _Build(opt.OptionsCommand):
    """The command, to which options of `identify` are wrong usage with advice."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The arguments."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as problem:
            if problem.option_name not in {flag_of(name) for name, _ in opt.options_of_object(Fitting())}:
                raise
            advice = f"{problem.option_name} is an option of `identify`; {_IDENTIFY_FIRST}."
            raise click.UsageError(advice, ctx) from None


@opt.command(cls=_Build, sources="[MODEL.json | X.fmu | SYSTEM.toml | RECORD...]")
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
    from ..api.common.model_source import built_with, describes_system, origin_of
    from ..api.fmus.build import build_all, build_system
    from ..model.modelfile import is_model_path, load_model, saved_model
    from ..model.stated_cautions import stated_cautions

    folder, source = Path(output), sources[0] if len(sources) == 1 else None
    refuse_unwritable(folder, is_folder=True)
    of_records = {"name": name, "description": description or None}
    if source is not None and describes_system(source):
        others = {**building.of_springs, **of_records, "zero": zero, "record": record}
        opt.refuse_reading(reading, "a model or records", f"{source} describes a system", **others)
        from ..api.fmus.system_fmu import SystemToBuild  # slow to import

        wanted = SystemToBuild.load(source, candidate, building.author, building.fmi)
        out.refuse_overwriting([source], {"--output": wanted.target(folder)})
        with out.reporting() as progress:
            of_system = build_system(wanted, folder, building, progress)
        out.present(of_system, {"system": source})
        return
    if candidate is not None:
        raise click.UsageError("--candidate is for descriptions of systems (SYSTEM.toml); leave it out.")
    settings = building.with_those_of(built_with(source))
    kinds = settings.kinds(bool(sources))
    identification = None
    if source is not None and is_model_path(source):
        opt.refuse_reading(Reading() if record else reading, "records", f"{source} is a model file", **of_records)
        model, model_path = load_model(source), Path(source)
        records: Sequence[Record] = opt.read_records(record, reading)
        out.remark_on(stated_cautions(model))
        for kind in kinds:
            out.refuse_overwriting(sources, {"--output": settings.target(folder, model.name, kind)})
    else:
        from ..api.common.given import bundled_record  # slow to import
        from .records import identified

        opt.refuse_reading(Reading(), "a model file", "records are followed without it", record=record)
        opt.refuse_reading(reading, "--record", f"records are read as `identify` does by default; {_IDENTIFY_FIRST}")
        if not sources:
            # Its machine position counts down while the sample is stretched.
            sources, reading = (str(bundled_record(Path(models))),), Reading(reverse="displacement")
            name = name or "rubber_hinge"
        chosen = name or identifier(Path(sources[0]).stem)
        refuse_unwritable(Path(models), is_folder=True)
        model_path = Path(models) / f"{chosen}.json"
        out.refuse_overwriting(opt.record_files(sources), {"--models": model_path})
        identification = identified(sources, reading, Fitting())
        out.remark(identification.sentences)
        model = saved_model(model_path, identification.model_file(chosen, description))
        records = identification.records
    origin = origin_of(source, zero, model.parameters)
    with out.reporting() as progress:
        built = build_all(
            model, folder, settings, origin, records, progress,
            kinds=kinds, path=model_path, identification=identification,
        )  # fmt: skip
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
        with out.working(f"Verifying {fmu}"):
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
    from ..api.fmus.export import Exports

    exports = Exports.planned(model, output, ssp_mass=mass, **options)
    out.refuse_overwriting([model], {f"--{kind}": path for kind, path in exports.files.items()})
    with out.reporting() as progress:
        exports.write(progress)
    out.present(exports, {"model": model})
