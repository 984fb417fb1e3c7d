"""`strandspring export`."""

from __future__ import annotations

from pathlib import Path

import click

from ..api.exporting import Exports, refuse_package
from ..coordinates import zero_sentence
from ..errors import StrandspringError
from ..exchange.modelica import LIBRARY, record_name
from ..files import reason_of
from ..modelfile import load_model
from .options import FiniteRange
from .output import note, reporting, result, result_json
from .paths import refuse_overwriting
from .zero import origin_of, zero_option


@click.command()
@click.argument("model", metavar="MODEL.json")
@click.option("--ssv", is_flag=True, help="Write SSP parameter values (SSV) for the model's FMU.")
@click.option("--ssp", is_flag=True, help="Write an SSP system: the native FMU below a mass on a shaking base.")
@click.option("--mass", type=FiniteRange(min=0.0, min_open=True, unit="kg"), metavar="KG", help="Mass for --ssp [kg].")
@click.option("--modelica", is_flag=True, help="Write the Modelica library StrandSpring with a record of the spring.")
@click.option(
    "-o",
    "--output",
    default="dist",
    show_default=True,
    metavar="DIR|FILE",
    help="Folder, or file name ending in .ssv or .ssp; the Modelica library takes a folder, and keeps other springs.",
)
@zero_option
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def export(
    model: str,
    ssv: bool,
    ssp: bool,
    mass: float | None,
    modelica: bool,
    output: str,
    zero: str | float | None,
    as_json: bool,
) -> None:
    """Export a model's parameters as SSP parameter values, in an SSP system, or into a Modelica library.

    \b
    Examples:
      strandspring export spring.json --ssv
      strandspring export spring.json --ssv -o system/resources/mount.ssv
      strandspring export spring.json --ssv --modelica -o dist
      strandspring export spring.json --ssp --mass 5
    """
    if not (ssv or ssp or modelica):
        raise click.UsageError("Nothing to write; give --ssv, --ssp or --modelica.")
    if ssp != (mass is not None):
        raise click.UsageError("--ssp and --mass KG go together.")
    content = load_model(model)
    # All paths are checked before anything is written.
    if modelica:
        _check_folder(output)
    exports = Exports(
        content,
        origin_of(model, zero, content.parameters),
        ssv=_output_path(output, f"{content.name}.ssv") if ssv else None,
        ssp=_output_path(output, f"{content.name}.ssp") if ssp else None,
        ssp_mass=mass,
        modelica=Path(output) if modelica else None,
    )
    refuse_overwriting([model], {"--ssv": exports.ssv, "--ssp": exports.ssp, "--modelica": exports.record})
    exports.refuse_unwritable()
    with reporting() as progress:
        exports.write(progress)
    if modelica and record_name(content.name) != content.name:
        note(f"The record is named {record_name(content.name)}, because {content.name} is taken in Modelica.")
    if as_json:
        written = {"ssv": exports.ssv, "ssp": exports.ssp, "modelica": exports.record}
        result_json(
            {
                "model": model,
                "name": content.name,
                "zero": exports.zero,
                **{kind: None if path is None else str(path) for kind, path in written.items()},
            }
        )
        return
    if sentence := zero_sentence(exports.zero):
        result(sentence)
    if exports.ssv is not None:
        result(f"SSP parameter values: {exports.ssv}")
    if exports.ssp is not None:
        result(f"SSP system: {exports.ssp}")
    if exports.modelica is not None:
        name = record_name(content.name)
        result(f"Modelica library: {exports.modelica / LIBRARY}, record {LIBRARY}.Records.{name}")


def _check_folder(output: str) -> None:
    """Refuse an output that cannot hold the folder of the Modelica library."""
    path = Path(output)
    if path.suffix and not path.is_dir():
        raise click.UsageError(f"The Modelica library {LIBRARY} is a folder; -o must be a folder, got {output}.")
    try:
        refuse_package(path)
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
