"""The page that an FMU carries about itself."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from ..model.modelfile import ModelFile
from ..model.stated_figures import StatedFit, energy_ratio, stated_fits
from .check_plot import loops_svg
from .description.array_variables import StartValue
from .description.content import Backend
from .description.described_variables import described_variables


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
    table, _, start = described_variables(spring, backend.with_states, backend.fmi, backend.arrays)
    return template(__package__, "documentation.html.j2").render(
        model=model,
        spring=spring,
        zero=zero,
        native=platforms is not None,
        with_states=backend.with_states,
        platforms=platforms,
        fmi=backend.fmi,
        arrays=backend.arrays,
        left_out=backend.left_out,
        real_time=backend.real_time,
        variables=[(v, _start(start.get(v.name))) for v in table if v.name not in backend.left_out],
        # The SVG is made by ElementTree from numbers and fixed text.
        plot=Markup(loops_svg(spring)),  # noqa: S704
        followed=[_followed(fit) for fit in stated_fits(model)],
        facts={
            "Fit": flat(model.fit),
            "Uncertainty": flat({name: value for name, value in model.uncertainty.items() if name != "joint"}),
            "Provenance": flat(model.provenance),
        },
    )


def template(package: str, name: str) -> Template:
    """A page among the assets of a package, which needs every value that it names."""
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    return environment.from_string((files(package) / "assets" / name).read_text(encoding="utf-8"))


def _followed(fit: StatedFit) -> tuple[str, ...]:
    """A row of the table of figures: of the spring alone, then as fitted."""
    alone, fitted = fit.alone, fit.fitted
    values = (
        (alone.get("rmse"), ".4g"), (alone.get("rnl"), ".4f"), (energy_ratio(alone), ".2f"),
        (fitted.get("rnl"), ".4f"), (energy_ratio(fitted), ".2f"), (fit.omega_start, ".9g"),
    )  # fmt: skip
    return (fit.name, *("" if value is None else f"{value:{digits}}" for value, digits in values))


def _start(value: StartValue | None) -> str:
    if value is None:
        return ""
    return ", ".join(f"{number:.9g}" for number in (value if isinstance(value, tuple) else (value,)))


def flat(content: Any, name: str = "") -> list[tuple[str, str]]:
    """Nested JSON as rows of name and text, such as ("records[0].sha256", "...")."""
    if isinstance(content, dict):
        prefix = f"{name}." if name else ""
        return [row for key, value in content.items() for row in flat(value, f"{prefix}{key}")]
    if isinstance(content, list | tuple):
        if any(isinstance(value, dict | list | tuple) for value in content):
            return [row for k, value in enumerate(content) for row in flat(value, f"{name}[{k}]")]
        return [(name, ", ".join(_text(value) for value in content))]
    return [(name, _text(content))]


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
