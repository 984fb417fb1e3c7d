"""The page that an FMU carries about itself."""

from __future__ import annotations

from importlib.resources import files

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from ..ground.strict_json import objects
from ..model.joint import HYSTERETIC_PARAMETERS
from ..model.modelfile import MODEL_IN_FMU, ModelFile
from ..model.stated_cautions import stated_cautions
from ..model.stated_figures import StatedFit, energy_ratio, stated_fits
from .check_plot import loops_svg
from .description.content import Backend
from .description.described_variables import StartValue, described_variables


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
    table, _, start = described_variables(model, backend.with_states, backend.fmi, backend.arrays)
    return template(__package__, "documentation.html.j2").render(
        model=model,
        spring=spring,
        zero=zero,
        native=platforms is not None,
        with_states=backend.with_states,
        platforms=platforms,
        fmi=backend.fmi,
        arrays=backend.arrays,
        no_energy="absorbed_energy" in backend.left_out,
        real_time=backend.real_time,
        variables=[(v, _start(start.get(v.name))) for v in table if v.name not in backend.left_out],
        # The SVG is made by ElementTree from numbers and fixed text.
        plot=Markup(loops_svg(spring)),  # noqa: S704
        followed=[_followed(fit) for fit in stated_fits(model)],
        cautions=list(stated_cautions(model).values()),
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


def _start(value: StartValue | None) -> str:
    if value is None:
        return ""
    return ", ".join(f"{number:.9g}" for number in (value if isinstance(value, tuple) else (value,)))


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
