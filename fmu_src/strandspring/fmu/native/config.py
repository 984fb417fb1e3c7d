"""spring_config.h, the one C header that differs from model to model, made from the variable table."""

from __future__ import annotations

import string

from ...core.variables import Variable, start_values, variables
from ...modelfile import ModelFile

# Written as they are; anything else, and with it every quote, backslash and trigraph, as an octal escape.
_PLAIN = set(string.ascii_letters + string.digits + " {}[]().,:;-_+=/*")

_HEADER = """\
/* The variables of one spring, written by strandspring; all other sources are the same for every spring. */
#ifndef SPRING_CONFIG_H
#define SPRING_CONFIG_H

#define SPRING_GUID {guid}

/* Value references; those of the coefficients begin at KE and KA, and parameters follow one another to the end. */
enum {{
{references}
}};

enum {{ SPRING_ELASTIC = {elastic}, SPRING_AMPLIFIER = {amplifier} }};

/* By value reference: name, type, causality and start value. */
#define SPRING_VARIABLE_TABLE(VARIABLE) \\
{table}

#endif
"""


def configuration(model: ModelFile, guid: str) -> str:
    """The text of spring_config.h.

    Parameters
    ----------
    model : ModelFile
    guid : str          The GUID in the model description.
    """
    spring = model.parameters
    elastic, amplifier = len(spring.kE), len(spring.kA)
    table = variables(elastic, amplifier)
    place = {variable.name: reference for reference, variable in enumerate(table)}
    named = [name for name in place if "[" not in name]
    references = {
        **{f"SPRING_{name.upper()}": place[name] for name in named},
        "SPRING_KE": place["kE[0]"],
        "SPRING_KA": place["kA[0]"],
        "SPRING_FIRST_PARAMETER": min(place[v.name] for v in table if v.causality == "parameter"),
        "SPRING_VARIABLES": len(table),
    }
    start = start_values(spring)
    return _HEADER.format(
        guid=c_string(guid),
        references=",\n".join(f"    {name} = {value}" for name, value in references.items()),
        elastic=elastic,
        amplifier=amplifier,
        table=" \\\n".join(f"    {_entry(variable, start.get(variable.name, 0.0))}" for variable in table),
    )


def c_string(text: str) -> str:
    """A string literal of C with the UTF-8 bytes of any text."""
    return '"' + "".join(chr(b) if chr(b) in _PLAIN else f"\\{b:03o}" for b in text.encode("utf-8")) + '"'


def _entry(variable: Variable, start: float) -> str:
    # Hexadecimal floats give every compiler the same bits.
    typed = f"VARIABLE_{variable.kind.upper()}, VARIABLE_{variable.causality.upper()}"
    return f"VARIABLE({c_string(variable.name)}, {typed}, {start.hex()})"
