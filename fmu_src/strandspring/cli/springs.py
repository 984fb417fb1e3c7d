"""`strandspring info`, `predict`, `compare`, `plan` and `synthesize`: what springs are, beside records."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import strandspring

from ..api.options import Comparing, Fitting, Sampling
from ..campaigns.planning.limits import Limits
from ..findings import Outcome
from ..ground.options import Option
from ..loops.reading import Reading
from . import options as opt
from .output import present, remark, remark_on, working

if TYPE_CHECKING:
    from ..records.record import Record

_STIFFNESS = Option(
    "number", "Instead of a model or a record: the rough stiffness, with --stroke", "N/m", "N/mm", 1e3, least=0.0,
    is_open=True, metavar="N/MM",
)  # fmt: skip
_NI_AMPLITUDE = Option(
    "number", "X of x = X sin(t)", "m", "mm", 1e-3, least=0.0, most=0.1, is_open=True, otherwise="5", metavar="MM"
)


@opt.command(model="MODEL.json|X.fmu", records="[RECORD...]")
@opt.amplitudes_option("Amplitude of a loop about the offset", "those of the records, or quarters of the range")
@opt.zero_option
@opt.takes_options(reading=Reading)
@opt.written("MODEL.json", "Write the model file, as out of an FMU.", "Model file", "saved", flags="--save")
def info(model: str, records: tuple[str, ...], save: str | None, reading: Reading, **options: Any) -> None:
    """For each amplitude: secant stiffness between the turning points, energy absorbed per cycle W, loss factor
    W/(2 pi Ws) with Ws = secant stiffness * amplitude^2 / 2, and with --verbose the damping ratio (half of that) and
    forces. Several records also show whether the force depends on frequency, and whether loading paths overlap.

    Of the FMU of a system it shows the candidate and its variables, where the bodies rest, and the natural modes.

    \b
    Examples:
      strandspring info spring.json
      strandspring info dist/spring.fmu --save spring.json
      strandspring info spring.json a13.csv a46.csv --json
    """
    from ..api.common.model_source import describes_system
    from ..model.modelfile import is_fmu, load_model, save_model

    if is_fmu(model) and describes_system(model):
        opt.refuse_reading(reading, "a model", f"{model} is the FMU of a whole system", save=save, **options)
        system: Any = strandspring.info(model, *records)
        present(system, {"system": model})
        return
    if save is not None:
        save_model(save, load_model(model))
    group = opt.read_records(records, reading, [model])
    with working("Measuring loops"):
        information: Any = strandspring.info(model, group, **options)
    present(information, {"model": model})


@opt.command(model="MODEL.json", records="RECORD...")
@opt.takes_options(reading=Reading)
@opt.written("OUT.csv", "Write displacement, measured and predicted force here.", "Prediction", method="save_csv")
def predict(model: str, records: tuple[str, ...], reading: Reading) -> None:
    """The hysteretic state at the start of a measured record is unknown; it is estimated as one bounded number,
    omega_start, and reported. OUT.csv holds the ends of the 95 % prediction interval, too, if the model file has one,
    as after the refined method.

    \b
    Examples:
      strandspring predict spring.json other.csv
      strandspring predict spring.json a13.csv a46.csv -o predicted.csv --json
    """
    group = opt.read_records(records, reading, [model])
    with working("Predicting"):
        prediction = strandspring.predict(model, group)
    present(prediction, {"model": model})


@opt.command(a="A.json", b="B.json", records="[RECORD...]")
@opt.takes_options(comparing=Comparing, reading=Reading)
@opt.plot_option("Plot loops, stiffness, energy and loss factor")
def compare(a: str, b: str, records: tuple[str, ...], comparing: Comparing, reading: Reading) -> None:
    """Parameters, figures of loops and transmissibility are compared over the range that both share, and judged by the
    uncertainty in the model files, all together at the 5 % level; z is the difference over its standard deviation. With
    records: which of both follows each one better.

    \b
    Examples:
      strandspring compare new.json worn.json
      strandspring compare lot1.json lot2.json loop.csv --mass 5 --plot lots.png
    """
    group = opt.read_records(records, reading, [a, b])
    with working("Comparing"):
        comparison = strandspring.compare(a, b, group, comparing=comparing)
    present(comparison)


@opt.command(sources="[MODEL.json | X.fmu | RECORD...]")
@opt.option_of("stiffness", _STIFFNESS, group="Rig")
@opt.takes_options(limits=Limits, reading=Reading)
@opt.written("PROGRAM.csv", "Write the programme: time [s], displacement [mm].", "Programme", "program", "save_csv")
@opt.plot_option("Plot the programme")
def plan(sources: tuple[str, ...], stiffness: float | None, limits: Limits, reading: Reading) -> None:
    """From a model file with its uncertainty, from a first record, which is identified on the way, or from a rough
    stiffness and stroke. Blocks are chosen one after the other for the most that they decide in their time. Each row
    says what a block decides most: half of the 95 % interval before and after it, in % of the value.

    \b
    Examples:
      strandspring plan spring.json --velocity 50 -o program.csv
      strandspring plan loop.csv --velocity 50 --duration 120 -o program.csv
      strandspring plan --stiffness 20 --stroke -20:20 -o program.csv
    """
    from ..model.modelfile import is_model_path, load_model
    from .records import identified

    if not sources or (len(sources) == 1 and is_model_path(sources[0])):
        opt.read_records((), reading)
        source: Any = load_model(sources[0]) if sources else None
    else:
        source = identified(sources, reading, Fitting())
        remark(source.sentences)
    with working("Planning"):
        test = strandspring.plan(source, stiffness=stiffness, limits=limits)
    present(test)


@click.group()
def synthesize() -> None:
    """Compute records: a spring's response, or the paper's experiment."""


@opt.command(synthesize, flags=(), model="MODEL.json")
@opt.amplitudes_option("Amplitude of the sine", "the identified range")
@opt.takes_options(sampling=Sampling)
@opt.written("RECORD.csv", "Record to write.", "Record", is_required=True)
def spring(model: str, output: str, amplitudes: tuple[float, ...] | None, sampling: Sampling) -> None:
    """Compute the record of a model's spring under sinusoidal displacement.

    \b
    Example:
      strandspring synthesize spring spring.json --noise 0.03 -o loop.csv
    """
    from ..model.modelfile import load_model

    record = strandspring.synthesize(load_model(model), amplitudes, sampling=sampling)
    remark_on(replace(record, path=output).found)
    _write(output, record)


@opt.command(synthesize, flags=())
@opt.option_of("amplitude", _NI_AMPLITUDE, group="Loop")
@opt.takes_options(sampling=Sampling)
@opt.written("RECORD.csv", "Record to write.", "Record", is_required=True)
@opt.written("FILE.csv", "Also write the record without noise.", "Without noise", "clean", flags="--clean")
def ni(output: str, clean: str | None, amplitude: float | None, sampling: Sampling) -> None:
    """Compute the paper's simulated experiment: Ni's model in its steady state under x = X sin(t).

    The record holds whole periods without their closing sample; the periods before the steady state are omitted.

    \b
    Examples:
      strandspring synthesize ni -o table1.csv --clean true.csv
    """
    record = strandspring.synthesize("ni", amplitude, sampling=sampling)
    _write(output, record)
    if clean is not None:
        strandspring.synthesize("ni", amplitude, sampling=replace(sampling, noise=0.0)).save(Path(clean), "mm")
        click.echo(f"Without noise: {clean}")


def _write(output: str, record: Record) -> None:
    noise = [finding.numbers for finding in record.findings if finding.kind is Outcome.NOISE]
    facts = [f"{len(record)} samples", *("noise level {noise:g}, seed {seed}".format(**of) for of in noise)]
    record.save(output, "mm")
    click.echo(f"Record: {output} ({', '.join(facts)})")
