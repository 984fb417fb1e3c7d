"""Modelica package of one spring: its parameters, the spring as equations, and flanges for its FMU.

The template ``assets/package.mo.j2`` is filled in with what depends on the spring.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files

from jinja2 import Environment, StrictUndefined

from .._version import __version__
from ..core.parameters import SCALARS, SpringParameters
from ..core.spline import Elastic
from ..core.variables import Variable, start_values, variables
from ..modelfile import ModelFile

# Keywords of Modelica 3.6, its predefined types and the outer names that the package uses: a package with such a name
# is invalid, or hides the outer name from itself.
_RESERVED = """
    algorithm and annotation block break class connect connector constant constrainedby der discrete each else elseif
    elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
    impure in initial inner input loop model not operator or outer output package parameter partial protected public
    pure record redeclare replaceable return stream then true type when while within
    AssertionLevel Boolean Clock Complex Connections ExternalObject Integer Modelica ModelicaServices Real StateSelect
    String abs assert max min noEvent smooth time
"""
_STRING_ESCAPES = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"})
_SI_TYPES = {"N": "Force", "m": "Position"}


def package_name(name: str) -> str:
    """Name of the Modelica package of the model `name`: the same, unless it is reserved."""
    return f"{name}_spring" if name in _RESERVED.split() else name


def modelica_package(model: ModelFile) -> str:
    """Text of the package; the same model gives the same text."""
    spring = model.parameters
    start = start_values(spring)
    table = variables(*spring.counts)
    # Jinja's usual delimiters are braces, of which Modelica has many.
    environment = Environment(
        variable_start_string="<<",
        variable_end_string=">>",
        block_start_string="<%",
        block_end_string="%>",
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=StrictUndefined,
    )
    template = environment.from_string((files(__package__) / "assets" / "package.mo.j2").read_text(encoding="utf-8"))
    return template.render(
        package=package_name(model.name),
        description=_string(model.description or "Hysteretic spring identified from measurement"),
        description_html=_string(escape(model.description)),
        version=__version__,
        arrays=_arrays(spring, table),
        scalars=[
            _declaration(v, start[v.name])
            for v in table
            if v.causality == "parameter" and v.name in (*SCALARS, "omega_start")
        ],
        is_table=bool(spring.FE_knots),
        FE=_spline(len(spring.FE_knots)) if spring.FE_knots else _polynomial(_elements("kE", len(spring.kE))),
        FA=_horner(_elements("kA", len(spring.kA)), "inside"),
    )


def _arrays(spring: SpringParameters, table: Sequence[Variable]) -> list[tuple[str, int, str, str, str]]:
    """Name, size, units, values and description of each array of the record."""
    about = "coefficients of ascending powers of (displacement - displacement_offset)"
    descriptions = {
        "kE": f"Elastic force FE: {about}",
        "FE_knots": "Elastic force FE: displacements at the knots of its cubic spline",
        "FE_forces": "Elastic force FE at the knots",
        "kA": f"Amplifier FA: {about}",
    }
    arrays = []
    for name, description in descriptions.items():
        values = getattr(spring, name)
        if values:
            arrays.append((name, len(values), _units(table, name), ", ".join(map(repr, values)), description))
    if spring.FE_knots:
        elastic = Elastic(spring)
        slopes = ", ".join(repr(elastic.slope(knot - spring.displacement_offset)) for knot in spring.FE_knots)
        units = ", ".join(['"N/m"'] * len(spring.FE_knots))
        about = "Slope of FE at the knots, which makes the spline twice differentiable; belongs to FE_forces"
        arrays.insert(2, ("FE_slopes", len(spring.FE_knots), units, slopes, about))
    return arrays


def _elements(name: str, count: int) -> list[str]:
    return [f"data.{name}[{i + 1}]" for i in range(count)]


def _polynomial(kE: Sequence[str]) -> str:
    """FE with these coefficients, along its tangent outside the range."""
    slope = _horner([c if i == 1 else f"{i}*{c}" for i, c in enumerate(kE)][1:], "inside")
    return _horner(kE, "inside") + (f"\n      + ({slope})*(x - inside)" if slope else "")


def _spline(knots: int) -> str:
    """FE by Hermite's form of each cubic, along its tangent outside the range."""
    pieces = []
    for i in range(1, knots):
        a, y_a, s_a = (f"data.{name}[{i}]" for name in ("FE_knots", "FE_forces", "FE_slopes"))
        b, y_b, s_b = (f"data.{name}[{i + 1}]" for name in ("FE_knots", "FE_forces", "FE_slopes"))
        width, t = f"({b} - {a})", f"(place - {a})/({b} - {a})"
        third = f"2*({y_a} - {y_b}) + {width}*({s_a} + {s_b})"
        second = f"3*({y_b} - {y_a}) - {width}*(2*{s_a} + {s_b}) + {t}*({third})"
        condition = f"if place < {b} then " if i < knots - 1 else ""
        pieces.append(f"{condition}{y_a} + {t}*({width}*{s_a} + {t}*({second}))")
    within = "\n      else".join(pieces[:-1]) + f"\n      else {pieces[-1]}"
    ends = f"if x < inside then data.FE_slopes[1] else data.FE_slopes[{knots}]"
    return f"smooth(2, noEvent({within}))\n      + noEvent({ends})*(x - inside)"


def _declaration(variable: Variable, value: float) -> str:
    """Declaration of a scalar parameter in the record."""
    si_type = _SI_TYPES.get(str(variable.unit))
    modifiers = [] if si_type else [f'final unit="{_unit(variable)}"']
    modifiers += ['displayUnit="mm"'] if variable.display_unit == "mm" else []
    modifiers += [
        f"{name}={limit!r}"
        for name, limit in (("min", variable.minimum), ("max", variable.maximum))
        if limit is not None
    ]
    modelica_type = f"Modelica.Units.SI.{si_type}" if si_type else "Real"
    description = _string(variable.description)
    return f'parameter {modelica_type} {variable.name}({", ".join(modifiers)})={value!r} "{description}";'


def _units(table: Sequence[Variable], array: str) -> str:
    return ", ".join(f'"{_unit(v)}"' for v in table if v.name.startswith(f"{array}_"))


def _unit(variable: Variable) -> str:
    """The unit in the notation of Modelica: N/m2 for N/m^2."""
    return str(variable.unit).replace("^", "")


def _horner(coefficients: Sequence[str], x: str) -> str:
    """Polynomial with these coefficients of ascending powers; empty without coefficients."""
    if not coefficients:
        return ""
    *lower, expression = coefficients
    for coefficient in reversed(lower):
        expression = f"{coefficient} + {x}*({expression})"
    return expression


def _string(text: str) -> str:
    """Text with the escapes of a Modelica string."""
    return text.translate(_STRING_ESCAPES)
