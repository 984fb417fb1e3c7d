"""`strandspring isolate`."""

from __future__ import annotations

import math
import tempfile
from dataclasses import asdict, astuple, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..api.cautions import outside_range
from ..coordinates import counted_from, zero_sentence
from ..files import write_csv
from ..isolation.band import band_frequencies
from ..isolation.curve_points import ResponsePoint
from ..isolation.response import FrequencyResponse, frequency_response
from ..isolation.system import Excitation, IsolatedMass, StaticEquilibrium, static_equilibrium
from ..modelfile import ModelFile, load_model
from .mount import EXCITATIONS, chosen_levels, curve_options, level_options, mount_options, positive, shares_of_room
from .output import progress, result, result_json, result_table
from .paths import refuse_overwriting
from .zero import origin_of, zero_option

if TYPE_CHECKING:
    from ..cosimulation.steady_check import SteadyCheck

_DEFAULT_SHARES = (0.005, 0.01, 0.02)  # see `shares_of_room`
_HEADINGS = (
    "level", "resonance Hz", "transmissibility", "amplitude mm", "stiffness N/mm", "loss factor", "isolates from Hz",
)  # fmt: skip


@click.command()
@click.argument("model", metavar="MODEL.json")
@click.option("--mass", type=positive("kg"), required=True, metavar="KG", help="Mass on the mount [kg].")
@mount_options
@zero_option
@level_options(lambda level: level, "repeat for more levels", "  [default: 0.5, 1 and 2 % of the free travel]")
@curve_options(points=200)
@click.option("-o", "--output", metavar="OUT.csv", help="Write all points of the curves to this file.")
@click.option("--plot", metavar="FILE.png", help="Plot the curves (.png, .svg or .pdf).")
@click.option(
    "--verify",
    is_flag=True,
    help="Build the FMU, co-simulate it at three frequencies of each level from the computed motion, and compare after "
    "20 periods.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def isolate(
    model: str,
    mass: float,
    band: tuple[float, float] | None,
    points: int,
    extrapolate: bool,
    output: str | None,
    plot: str | None,
    verify: bool,
    zero: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Compute transmissibility and resonance of a mass on the spring.

    The steady response is found by harmonic balance and followed through folds, where a frequency has several motions;
    between two folds they are unstable (drawn dotted). Transmissibility is that of the first harmonic: absolute motion
    over base motion or, with --force, the force on the base over that force.

    \b
    Examples:
      strandspring isolate spring.json --mass 5
      strandspring isolate spring.json --mass 20 --parallel 4 --plot t.png
      strandspring isolate spring.json --mass 5 --base-displacement 0.5
      strandspring isolate spring.json --mass 5 --force 10 --band 2 50 -o c.csv
      strandspring isolate spring.json --mass 5 --verify
    """
    levels = {kind: options.pop(kind) for kind in EXCITATIONS}
    if plot is not None:
        from ..isolation.curves_plot import SUFFIXES

        if Path(plot).suffix.lower() not in SUFFIXES:
            raise click.UsageError(f"--plot must end in {', '.join(SUFFIXES)}, got {plot!r}.")
    refuse_overwriting([model], {"--output": output, "--plot": plot})
    content = load_model(model)
    origin = origin_of(model, zero, content.parameters)
    system = IsolatedMass(counted_from(origin, content.parameters), mass, **options)
    equilibrium = static_equilibrium(system)
    excitation, amplitudes = chosen_levels(levels) or (
        Excitation.BASE_DISPLACEMENT,
        shares_of_room(system, equilibrium, _DEFAULT_SHARES),
    )
    frequencies = band_frequencies(band, points, equilibrium)
    responses = [
        frequency_response(system, excitation, amplitude, frequencies, extrapolate)
        for amplitude in progress(amplitudes, "Balancing harmonics")
    ]
    checks = _verified(content, origin, system, responses) if verify else []
    if output is not None:
        _write(Path(output), responses)
    if plot is not None:
        from ..isolation.curves_plot import write_plot

        write_plot(Path(plot), responses, f"{content.name}: {mass:g} kg")
    if as_json:
        result_json(_json(model, origin, system, equilibrium, responses, checks, output, plot))
        return
    _print_equilibrium(system, equilibrium)
    if sentence := zero_sentence(origin):
        result(f"  {sentence}")
    _print_curves(system, responses)
    _print_checks(checks)
    for title, path in (("Curves", output), ("Plot", plot)):
        if path is not None:
            result(f"{title}: {path}")


def _verified(
    content: ModelFile, zero: float, system: IsolatedMass, responses: list[FrequencyResponse]
) -> list[tuple[FrequencyResponse, SteadyCheck]]:
    """Co-simulations of stable motions of each level: at both ends of the band and at peak transmissibility."""
    from ..cosimulation.steady_check import check_steady
    from ..fmu.python_backed import build_fmu

    runs = []
    for response in responses:
        stable = [point for point in response.points if point.stable]
        chosen = (stable[0], max(stable, key=lambda point: point.transmissibility), stable[-1])
        runs += [(response, point) for point in dict.fromkeys(chosen)]
    with tempfile.TemporaryDirectory(prefix="strandspring-", ignore_cleanup_errors=True) as folder:
        fmu = build_fmu(content, Path(folder), zero=zero)
        return [
            (response, check_steady(fmu, system, response.excitation, response.level, point))
            for response, point in progress(runs, "Simulating the FMU")
        ]


def _print_checks(checks: list[tuple[FrequencyResponse, SteadyCheck]]) -> None:
    if checks:
        result("Co-simulation of the FMU, 20 periods from the computed motion:")
    for response, check in checks:
        verdict = "agrees" if check.agrees else "DIFFERS: the computed motion is not steady or not stable"
        result(
            f"  {response.level_text}, {check.frequency:.4g} Hz: amplitude {100.0 * check.difference:+.3f} %, "
            f"phase {check.phase:+.3f} degrees, {verdict}"
        )


def _write(path: Path, responses: list[FrequencyResponse]) -> None:
    heading = {
        "frequency": "frequency [Hz]",
        "phase": "phase [deg]",
        "relative_phase": "relative phase [deg]",
        "relative": f"relative [{'m/N' if responses[0].excitation is Excitation.FORCE else '1'}]",
        "transmissibility": "transmissibility [1]",
        "amplitude": "amplitude [m]",
        "mean": "mean [m]",
        "least": "least [m]",
        "greatest": "greatest [m]",
        "force": "force on the base [N]",
        "acceleration": "acceleration [m/s^2]",
        "start_displacement": "displacement at the crest [m]",
        "start_speed": "speed at the crest [m/s]",
        "start_omega": "omega at the crest [1]",
    }
    names = [field.name for field in fields(ResponsePoint)]
    rows = ((response.level, *astuple(point)) for response in responses for point in response.points)
    write_csv(path, (f"level [{responses[0].excitation.unit}]", *(heading.get(name, name) for name in names)), rows)


def _json(
    model: str,
    zero: float,
    system: IsolatedMass,
    equilibrium: StaticEquilibrium,
    responses: list[FrequencyResponse],
    checks: list[tuple[FrequencyResponse, SteadyCheck]],
    output: str | None,
    plot: str | None,
) -> dict[str, Any]:
    described = {f.name: getattr(system, f.name) for f in fields(system) if f.name != "spring"}
    return {
        "model": model,
        "zero": zero,
        "system": {**described, "load": system.static_load},
        "rest": asdict(equilibrium),
        "excitation": responses[0].excitation.value,
        "levels": [
            {
                "level": response.level,
                "unit": response.excitation.unit,
                "resonance": asdict(response.resonance),
                "extrapolating": response.extrapolating,
                "points": [asdict(point) for point in response.points],
                "verification": [{**asdict(c), "agrees": c.agrees} for of, c in checks if of is response],
            }
            for response in responses
        ],
        "output": output,
        "plot": plot,
    }


def _print_equilibrium(system: IsolatedMass, equilibrium: StaticEquilibrium) -> None:
    springs = "1 spring" if system.parallel * system.series == 1 else f"{system.parallel} x {system.series} springs"
    friction = f"{1e3 * equilibrium.least:.4g} to {1e3 * equilibrium.greatest:.4g} mm with friction"
    sag = "" if math.isnan(equilibrium.sag) else f", static sag {1e3 * equilibrium.sag:.4g} mm"
    result(f"{system.mass:g} kg on {springs}, static load {system.static_load:.4g} N")
    result(f"  static equilibrium at {1e3 * equilibrium.displacement:.4g} mm of each spring ({friction}){sag}")
    result(f"  small motion: {1e-3 * equilibrium.stiffness:.4g} N/mm, {equilibrium.frequency:.4g} Hz")


def _print_curves(system: IsolatedMass, responses: list[FrequencyResponse]) -> None:
    rows = [
        [
            response.level_text,
            f"{r.frequency:.4g}" + ("" if r.inside else " (end of band)"),
            f"{r.transmissibility:.4g}",
            f"{1e3 * r.amplitude:.4g}",
            f"{1e-3 * r.stiffness:.4g}",
            f"{r.loss_factor:.3g}",
            "-" if math.isnan(r.isolation_frequency) else f"{r.isolation_frequency:.4g}",
        ]
        for response in responses
        for r in [response.resonance]
    ]
    result_table(_HEADINGS, rows)
    unstable = sum(not point.stable for response in responses for point in response.points)
    if unstable:
        result(
            f"  The curve folds: {unstable} points between folds are unstable, and the motion jumps there. Folds far "
            "below the resonance are superharmonics; a little --damping removes them."
        )
    for response in responses:
        outside = [point.frequency for point in response.points if point.extrapolating]
        if outside:
            result(
                f"  Caution: {response.level_text}: at {len(outside)} of {len(response.points)} points, from "
                f"{min(outside):.4g} to {max(outside):.4g} Hz, the spring moves {outside_range(system.spring)}"
            )
