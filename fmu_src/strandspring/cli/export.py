"""`strandspring export`."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import StrandspringError
from ..export.modelica import modelica_package, package_name
from ..export.ssv import parameter_values
from ..files import write_text
from ..modelfile import load_model
from .output import note, result, result_json
from .paths import refuse_overwriting


@click.command()
@click.argument("model", metavar="MODEL.json")
@click.option("--ssv", is_flag=True, help="Write SSP parameter values (SSV), to be applied to the model's FMU.")
@click.option("--modelica", is_flag=True, help="Write a Modelica package: parameters, spring, flanges for the FMU.")
@click.option(
    "-o",
    "--output",
    default="dist",
    show_default=True,
    metavar="DIR|FILE",
    help="Folder, or file name that ends in .ssv or .mo; a .mo file is called like its package.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def export(model: str, ssv: bool, modelica: bool, output: str, as_json: bool) -> None:
    """Write a model's parameters for other tools: SSP parameter values, a Modelica package, or both.

    \b
    Examples:
      strandspring export spring.json --ssv
      strandspring export spring.json --ssv -o system/resources/mount.ssv
      strandspring export spring.json --ssv --modelica -o dist
    """
    if not (ssv or modelica):
        raise click.UsageError("Say what to write: --ssv, --modelica or both.")
    content = load_model(model)
    package = package_name(content.name)
    # Both places are settled before anything is written.
    ssv_path = _place(output, f"{content.name}.ssv") if ssv else None
    modelica_path = _place(output, f"{package}.mo") if modelica else None
    if modelica_path is not None and modelica_path.stem != package:
        raise click.UsageError(
            f"Modelica wants the file of package {package} to be called {package}.mo, got {modelica_path.name}."
        )
    refuse_overwriting([model], {"--ssv": ssv_path, "--modelica": modelica_path})
    if ssv_path is not None:
        write_text(ssv_path, parameter_values(content))
    if modelica_path is not None:
        write_text(modelica_path, modelica_package(content))
        if package != content.name:
            note(f"The package is called {package}, because {content.name} is a word of Modelica.")
    if as_json:
        written = {"ssv": ssv_path, "modelica": modelica_path}
        result_json(
            {
                "model": model,
                "name": content.name,
                **{kind: None if path is None else str(path) for kind, path in written.items()},
            }
        )
        return
    if ssv_path is not None:
        result(f"SSP parameter values: {ssv_path}")
    if modelica_path is not None:
        result(f"Modelica package: {modelica_path}")


def _place(output: str, name: str) -> Path:
    """Where the file `name` goes: into the folder `output`, or to `output` itself if it ends as `name` does."""
    path, suffix = Path(output), Path(name).suffix
    try:
        if path.is_dir() or not (path.suffix or path.exists()):
            return path / name
    except OSError as problem:
        raise StrandspringError(f"{path} cannot be written: {problem.strerror}.") from None
    if path.suffix != suffix:
        raise click.UsageError(f"-o must be a folder, or for this file a name that ends in {suffix}, got {output}.")
    return path
