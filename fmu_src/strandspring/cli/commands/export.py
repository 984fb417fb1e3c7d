"""`strandspring export`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

from ...api.fmus.exporting import Exports, refuse_package
from ...errors import StrandspringError
from ...exchange.c_sources import constant_bytes
from ...exchange.modelica import LIBRARY, record_name
from ...ground.files import reason_of
from ...model.coordinates import zero_sentence
from ...model.modelfile import load_model
from ..shared.option_types import json_option, positive
from ..shared.output import note, present, reporting
from ..shared.paths import refuse_overwriting
from ..shared.zero import origin_of, zero_option


@click.command()
@click.argument("model", metavar="MODEL.json")
@click.option("--ssv", is_flag=True, help="Write SSP parameter values (SSV) for the model's FMU.")
@click.option("--ssp", is_flag=True, help="Write an SSP system: the native FMU below a mass on a shaking base.")
@click.option("--mass", type=positive("kg"), metavar="KG", help="Mass for --ssp [kg].")
@click.option("--modelica", is_flag=True, help="Write the Modelica library StrandSpring with a record of the spring.")
@click.option("--c", "as_c", is_flag=True, help="Write C sources of the spring for targets without FMI.")
@click.option(
    "-o",
    "--output",
    default="dist",
    show_default=True,
    metavar="DIR|FILE",
    help="Folder, or file name ending in .ssv or .ssp; the Modelica library and C sources take a folder and keep other "
    "springs.",
)
@zero_option
@json_option
def export(
    model: str,
    ssv: bool,
    ssp: bool,
    mass: float | None,
    modelica: bool,
    as_c: bool,
    output: str,
    zero: str | float | None,
    as_json: bool,
) -> None:
    """Export a model as SSP parameter values, in an SSP system, into a Modelica library, or as C sources.

    \b
    Examples:
      strandspring export spring.json --ssv
      strandspring export spring.json --ssv -o system/resources/mount.ssv
      strandspring export spring.json --ssv --modelica -o dist
      strandspring export spring.json --ssp --mass 5
      strandspring export spring.json --c -o firmware
    """
    if not (ssv or ssp or modelica or as_c):
        raise click.UsageError("Nothing to write; give --ssv, --ssp, --modelica or --c.")
    if ssp != (mass is not None):
        raise click.UsageError("--ssp and --mass KG go together.")
    content = load_model(model)
    # All paths are checked before anything is written.
    if modelica:
        _check_folder(output, f"The Modelica library {LIBRARY} is")
        _refuse_package(output)
    if as_c:
        _check_folder(output, "The C sources are")
    exports = Exports(
        content,
        origin_of(model, zero, content.parameters),
        ssv=_output_path(output, f"{content.name}.ssv") if ssv else None,
        ssp=_output_path(output, f"{content.name}.ssp") if ssp else None,
        ssp_mass=mass,
        modelica=Path(output) if modelica else None,
        c=Path(output) if as_c else None,
    )
    refuse_overwriting([model], {f"--{kind}": path for kind, path in exports.files.items()})
    exports.refuse_unwritable()
    with reporting() as progress:
        exports.write(progress)
    if modelica and record_name(content.name) != content.name:
        note(f"The record is named {record_name(content.name)}, because {content.name} is taken in Modelica.")
    files = {kind: None if path is None else str(path) for kind, path in exports.files.items()}
    facts = {"model": model, "name": content.name, "zero": exports.zero, **files}
    present(as_json, lambda: facts, lambda _: _lines(exports))


def _lines(exports: Exports) -> Iterator[str]:
    """What was written, in words."""
    if sentence := zero_sentence(exports.zero):
        yield sentence
    if exports.ssv is not None:
        yield f"SSP parameter values: {exports.ssv}"
    if exports.ssp is not None:
        yield f"SSP system: {exports.ssp}"
    if exports.modelica is not None:
        name = record_name(exports.model.name)
        yield f"Modelica library: {exports.modelica / LIBRARY}, record {LIBRARY}.Records.{name}"
    if exports.c is not None:
        size = constant_bytes(exports.model.parameters) / 1000
        yield f"C sources: {exports.files['c']} and what it needs; {size:.0f} kB of constants"


def _check_folder(output: str, what: str) -> None:
    """Refuse an output that cannot hold a folder."""
    path = Path(output)
    if path.suffix and not path.is_dir():
        raise click.UsageError(f"{what} a folder; -o must be a folder, got {output}.")


def _refuse_package(output: str) -> None:
    try:
        refuse_package(Path(output))
    except StrandspringError as refusal:
        raise click.UsageError(str(refusal)) from None


def _output_path(output: str, name: str) -> Path:
    """The file `name` in the folder `output`, or `output` itself if it has the suffix of `name`."""
    path, suffix = Path(output), Path(name).suffix
    try:
        if path.is_dir() or not (path.suffix or path.exists()):
            return path / name
    except OSError as problem:
        raise StrandspringError(f"{path} cannot be written: {reason_of(problem)}; check the rights there.") from None
    if path.suffix != suffix:
        raise click.UsageError(f"-o must be a folder, or a file name ending in {suffix}, got {output}.")
    return path
