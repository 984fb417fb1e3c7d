"""modelDescription.xml of FMI 2.0 and 3.0, made from the variable table."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from datetime import date, datetime, timezone
from xml.etree.ElementTree import Element, SubElement

from ...core.variables import FmiUnit
from ...errors import BuildError
from ...model.modelfile import ModelFile
from . import fmi2, fmi3
from .content import Backend, DescriptionContent, base_unit, xml_file
from .described_variables import described_variables, nominal_values

_VERSIONS = {2: fmi2, 3: fmi3}


def model_description(model: ModelFile, guid: str, generation_tool: str, backend: Backend) -> bytes:
    """The description of one spring as UTF-8 XML; the same arguments give the same bytes."""
    variables = described_variables(model, backend.with_states, backend.fmi, backend.arrays)
    about = model.description or "Hysteretic spring: displacement in, restoring force out"
    if backend.real_time:
        about += f"; for real time{', without absorbed_energy' if backend.left_out else ''}"
    content = DescriptionContent(
        model.name,
        about,
        *variables,
        nominal_values(model.parameters, variables.table),
        date=_stated(model, "date"),
    )
    backend = replace(backend, author=backend.author or _stated(model, "author"))
    return described(content, guid, generation_tool, backend)


def described(content: DescriptionContent, guid: str, generation_tool: str, backend: Backend) -> bytes:
    """A model description as UTF-8 XML; the same arguments give the same bytes."""
    version = _VERSIONS[backend.fmi]
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": version.VERSION,
            "modelName": content.name,
            version.TOKEN: guid,
            "description": content.about,
            **({"author": backend.author} if backend.author else {}),
            "version": backend.version,
            "copyright": "Model code: strandspring maintainers; see documentation/licenses",
            "license": "MIT",
            "generationTool": generation_tool,
            **_generation_date(content.date),
            "variableNamingConvention": "flat",
        },
    )
    version.append_interfaces(root, content, backend)
    _append_units(SubElement(root, "UnitDefinitions"), content.units)
    categories = SubElement(root, "LogCategories")
    for name, text in content.log_categories.items():
        SubElement(categories, "Category", {"name": name, "description": text})
    SubElement(
        root,
        "DefaultExperiment",
        {
            "startTime": "0",
            "stopTime": "1",
            "tolerance": "1e-08" if backend.with_states else "1e-06",
            "stepSize": repr(content.step),
        },
    )
    version.append_variables(SubElement(root, "ModelVariables"), content, backend)
    version.append_structure(SubElement(root, "ModelStructure"), content, backend)
    return xml_file(root)


def _stated(model: ModelFile, name: str) -> str:
    """A printable text of the provenance by its name, else none."""
    text = model.provenance.get(name)
    return text if isinstance(text, str) and text.isprintable() else ""


def _generation_date(stated: str) -> dict[str, str]:
    """The time that SOURCE_DATE_EPOCH gives, as builds that can be repeated do, else the date that the model states.

    Without either there is none, so that the same model gives the same bytes.

    Raises
    ------
    BuildError   If it is no time.
    """
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if not given:
        with suppress(ValueError):
            return {"generationDateAndTime": f"{date.fromisoformat(stated)}T00:00:00Z"}
        return {}
    try:
        time = datetime.fromtimestamp(int(given), timezone.utc)
    except (ValueError, OverflowError, OSError):
        raise BuildError(f"SOURCE_DATE_EPOCH must be seconds since 1970, got {given[:40]!r}.") from None
    return {"generationDateAndTime": time.strftime("%Y-%m-%dT%H:%M:%SZ")}


def _append_units(parent: Element, all_units: tuple[FmiUnit, ...]) -> None:
    for unit in all_units:
        element = SubElement(parent, "Unit", {"name": unit.name})
        SubElement(element, "BaseUnit", base_unit(unit))
        for name, factor in unit.displayed:
            SubElement(element, "DisplayUnit", {"name": name, "factor": repr(factor)})
