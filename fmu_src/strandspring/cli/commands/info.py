"""`strandspring info`."""

from __future__ import annotations

from typing import Any

import click

from ...api.common.model_source import describes_system
from ...api.identifying.information import info as information_of
from ...model.modelfile import is_fmu, load_model, save_model
from ..shared.cautions import note_cautions, note_records
from ..shared.descriptions import refuse_given
from ..shared.option_types import loop_amplitudes, output_options
from ..shared.options import read_records, record_files, record_options
from ..shared.output import present, working
from ..shared.paths import FileNamed, refuse_overwriting
from ..shared.zero import zero_option


@click.command()
@click.argument("model", metavar="MODEL.json|X.fmu")
@click.argument("records", nargs=-1, metavar="[RECORD...]")
@loop_amplitudes("offset", "those of the records, or quarters of the identified range")
@zero_option
@click.option(
    "--save", type=FileNamed(".json"), metavar="MODEL.json", help="Write the model file to this file, as out of an FMU."
)
@record_options
@output_options
def info(
    model: str,
    records: tuple[str, ...],
    amplitudes: tuple[float, ...],
    zero: str | float | None,
    save: str | None,
    as_json: bool,
    **columns: Any,
) -> None:
    """Show a model's parameters and loop figures, beside those of records.

    For each amplitude: secant stiffness between the turning points, energy absorbed per cycle W, loss factor
    W/(2 pi Ws) with Ws = secant stiffness * amplitude^2 / 2, equivalent viscous damping ratio (half of that), mean
    force and peak forces. Several records also show whether the force depends on the frequency and whether the
    loading paths of different amplitudes overlap.

    Of the FMU of a system it shows the candidate and its variables, where the bodies rest, and the natural modes.

    \b
    Examples:
      strandspring info spring.json
      strandspring info dist/spring.fmu --save spring.json
      strandspring info spring.json --amplitude 13 --amplitude 46
      strandspring info spring.json a13.csv a46.csv --json
    """
    if is_fmu(model) and describes_system(model):
        from ...api.fmus.system_information import info_system  # slow to import

        refuse_given(
            {"records", "amplitudes", "zero", "save", *columns}, "a model", f"{model} is the FMU of a whole system"
        )
        system = info_system(model)
        present(as_json, lambda: {"system": model, **system.as_json()}, system.text_lines)
        return
    refuse_overwriting([model, *record_files(records)], {"--save": save}, ".json")
    content = load_model(model)
    if save is not None:
        save_model(save, content)
    group = read_records(records, columns)
    note_records(group)
    with working("Measuring loops"):
        information = information_of(model, group, amplitudes=amplitudes, zero=zero)
    note_cautions(information.findings)
    present(
        as_json,
        lambda: {"model": model, **information.as_json()},
        information.brief,
        information.text_lines,
        saved=("Model file", save),
    )
