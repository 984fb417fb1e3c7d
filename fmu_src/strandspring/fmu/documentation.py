"""The page that an FMU carries about itself."""

from __future__ import annotations

import math
from importlib.resources import files
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from ..core.parameters import SpringParameters
from ..errors import Reader
from ..findings import gathered
from ..ground.strict_json import objects
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..kernel.steady import steady_start
from ..model.joint import HYSTERETIC_PARAMETERS
from ..model.modelfile import MODEL_IN_FMU, ModelFile
from ..model.stated_cautions import stated_cautions
from ..model.stated_figures import StatedFit, energy_ratio, stated_fits
from .description.content import Backend
from .description.described_variables import described_variables

_SHARES = (1.0, 2.0 / 3.0, 1.0 / 3.0)  # amplitudes, as shares of half the identified range
_COLOURS = ("--first", "--second", "--third")  # of page.css
_WIDTH, _HEIGHT = 640.0, 420.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 76.0, 624.0, 14.0, 366.0
_ROUNDING = 1e-12  # span that is drawn as none, share of the larger end
_SAMPLES = 160  # per half cycle, a multiple of 2


def documentation_page(
    model: ModelFile,
    zero: float,
    platforms: tuple[str, ...] | None,
    backend: Backend,
) -> str:
    """HTML of one file: model, variables, behaviour, fit, provenance; the same arguments give the same text.

    The model's displacement is counted from `zero` [m]. `platforms` are those of a native FMU; None stands for a
    Python-backed one.
    """
    spring = model.parameters
    table, _, start = described_variables(model, backend.with_states, backend.fmi)
    return template(__package__, "documentation.html.j2").render(
        model=model,
        spring=spring,
        zero=zero,
        native=platforms is not None,
        with_states=backend.with_states,
        platforms=platforms,
        fmi=backend.fmi,
        variables=[(v, _start(start.get(v.name))) for v in table if v.name not in backend.left_out],
        # The SVG is made by ElementTree from numbers and fixed text.
        plot=Markup(loops_svg(spring)),  # noqa: S704
        followed=[_followed(fit) for fit in stated_fits(model)],
        cautions=list(gathered(stated_cautions(model), Reader.FILE)),
        hysteresis=_hysteresis(model),
        records=[entry for entry in objects(model.provenance.get("records")) if "file" in entry],
        model_path=MODEL_IN_FMU,
    )


def template(package: str, name: str) -> Template:
    """A page among the assets of a package, which needs every value that it names."""
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    environment.globals["style"] = Markup((files(__package__) / "assets" / "page.css").read_text(encoding="utf-8"))  # noqa: S704
    return environment.from_string((files(package) / "assets" / name).read_text(encoding="utf-8"))


def _followed(fit: StatedFit) -> tuple[str, ...]:
    """A row of the table of figures: of the spring alone, then as fitted."""
    alone, fitted = fit.alone, fit.fitted
    values = (
        (alone.get("rmse"), ".4g"), (alone.get("rnl"), ".4f"), (energy_ratio(alone), ".2f"),
        (fitted.get("rnl"), ".4f"), (energy_ratio(fitted), ".2f"), (fit.omega_start, ".9g"),
    )  # fmt: skip
    return (fit.name, *("" if value is None else f"{value:{digits}}" for value, digits in values))


def _start(value: float | None) -> str:
    return "" if value is None else f"{value:.9g}"


def _hysteresis(model: ModelFile) -> list[tuple[str, ...]]:
    """Rows of the hysteretic parameters whose uncertainty is stated: name, value, error, 95 % interval, unit."""
    intervals = model.uncertainty.get("interval_95") or {}
    rows: list[tuple[str, ...]] = []
    for column in HYSTERETIC_PARAMETERS:
        name = column.key
        if name not in model.uncertainty and name not in intervals:
            continue
        error = model.uncertainty.get(name)
        stated = "unknown" if error is None else f"{float(f'{error:.2g}'):g}"
        ends = ("open" if end is None else f"{end:.4g}" for end in intervals.get(name, ()))
        rows.append((name, f"{getattr(model.parameters, name):.6g}", stated, " to ".join(ends), column.unit))
    return rows


def steady_loop(parameters: SpringParameters, amplitude: float) -> tuple[FloatArray, FloatArray]:
    """Displacement [m] and force [N] of a steady cycle about the middle of the identified range."""
    middle = 0.5 * (parameters.displacement_min + parameters.displacement_max)
    path = middle - amplitude * np.cos(np.linspace(0.0, 2.0 * np.pi, 2 * _SAMPLES + 1))
    return path, PathSolver(parameters).slow.force(path, steady_start(parameters, 2.0 * amplitude))


def loops_svg(parameters: SpringParameters) -> str:
    """Steady loops at three amplitudes, displacement in mm and force in N."""
    half_range = 0.5 * (parameters.displacement_max - parameters.displacement_min)
    loops = [steady_loop(parameters, share * half_range) for share in _SHARES]
    x_ticks = _ticks(*_span([1e3 * x for x, _ in loops]))
    y_ticks = _ticks(*_span([force for _, force in loops]))

    def across(values: FloatArray) -> FloatArray:
        return np.interp(values, x_ticks[[0, -1]], [_LEFT, _RIGHT])

    def up(values: FloatArray) -> FloatArray:
        return np.interp(values, y_ticks[[0, -1]], [_BOTTOM, _TOP])

    svg = Element(
        "svg",
        {
            "viewBox": f"0 0 {_WIDTH:g} {_HEIGHT + 20.0:g}", "role": "img", "font-family": "sans-serif",
            "font-size": "13", "fill": "currentColor",
            "aria-label": "Steady force-displacement loops at three amplitudes",
        },
    )  # fmt: skip
    for value, at in zip(x_ticks, across(x_ticks), strict=True):
        _line(svg, at, _TOP, at, _BOTTOM)
        _label(svg, at, _BOTTOM + 18.0, f"{value:g}", "middle")
    for value, at in zip(y_ticks, up(y_ticks), strict=True):
        _line(svg, _LEFT, at, _RIGHT, at)
        _label(svg, _LEFT - 8.0, at + 4.0, f"{value:g}", "end")
    _label(svg, 0.5 * (_LEFT + _RIGHT), _HEIGHT - 12.0, "displacement [mm]", "middle")
    _label(svg, 16.0, 0.5 * (_TOP + _BOTTOM), "force [N]", "middle", turned=True)
    for place, (share, (x, force), colour) in enumerate(zip(_SHARES, loops, _COLOURS, strict=True)):
        points = " ".join(f"{a:.2f},{b:.2f}" for a, b in zip(across(1e3 * x), up(force), strict=True))
        stroke = {"style": f"stroke: var({colour})", "stroke-width": "1.6"}
        SubElement(svg, "polyline", {"points": points, "fill": "none", **stroke})
        left, height = _LEFT + 180.0 * place, _HEIGHT + 8.0
        ends = {"x1": f"{left:g}", "x2": f"{left + 24.0:g}", "y1": f"{height - 4.0:g}", "y2": f"{height - 4.0:g}"}
        SubElement(svg, "line", {**ends, **stroke})
        _label(svg, left + 30.0, height, f"±{1e3 * share * half_range:.3g} mm", "start")
    return tostring(svg, encoding="unicode")


def _span(curves: list[FloatArray]) -> tuple[float, float]:
    return min(float(c.min()) for c in curves), max(float(c.max()) for c in curves)


def _ticks(low: float, high: float) -> FloatArray:
    """Some five round values that enclose the span, or two where it is nothing but rounding."""
    rough = max(high - low, _ROUNDING * max(abs(low), abs(high), 1e-300)) / 5.0
    decade = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * decade for factor in (1.0, 2.0, 2.5, 5.0, 10.0) if factor * decade >= rough)
    first = math.floor(low / step)
    last = max(math.ceil(high / step), first + 1)
    return np.array([k * step for k in range(first, last + 1)])


def _line(svg: Element, x1: float, y1: float, x2: float, y2: float) -> None:
    ends = {"x1": x1, "y1": y1, "x2": x2, "y2": y2}
    SubElement(svg, "line", {**{k: f"{v:.2f}" for k, v in ends.items()}, "style": "stroke: var(--grid)"})


def _label(svg: Element, x: float, y: float, text: str, anchor: str, turned: bool = False) -> None:
    place = {"x": f"{x:.2f}", "y": f"{y:.2f}", "text-anchor": anchor}
    if turned:
        place["transform"] = f"rotate(-90 {x:g} {y:g})"
    SubElement(svg, "text", place).text = text
