"""What an identified spring is good for, in words."""

from __future__ import annotations

from ..identification.campaign import campaign_verdicts
from ..identification.outcomes import Outcome
from .blocks import Level, Notice
from .engineering import EngineeringFigures
from .evaluation import Evaluation
from .quantities import number, percent, span

# Findings that say that the model does not follow its own records.
_POOR = frozenset({Outcome.POOR_FIT, Outcome.LACK_OF_FIT, Outcome.NI_MODEL})
# Findings that leave the model as good as it would be without them.
HARMLESS = frozenset({Outcome.FIRST_CYCLE_DIFFERS, Outcome.AMPLIFIER_REDUCED})
# Findings on loops that were not recorded.
_EXTRAPOLATED = frozenset({Outcome.ONE_AMPLITUDE, Outcome.SMALL_LOOPS})


def level(of: Evaluation) -> Level:
    """How far the model can be relied on."""
    findings = set(of.identification.findings)
    if findings & _POOR:
        return Level.POOR
    return Level.CARE if findings - HARMLESS else Level.GOOD


def verdict(of: Evaluation, figures: EngineeringFigures) -> tuple[Notice, tuple[str, ...]]:
    """The headline, and the sentences that support it."""
    findings = of.identification.findings
    grade = level(of)
    others = len(set(findings) - HARMLESS)
    headline = {
        Level.GOOD: "Good to use within the recorded range.",
        Level.CARE: f"Good to use with care: {others} caution{'s' if others > 1 else ''} below.",
        Level.POOR: "Do not rely on this model yet: it does not follow its own records.",
    }[grade]
    if grade is Level.CARE and set(findings) - HARMLESS <= _EXTRAPOLATED:
        headline = "Good to use at the recorded amplitudes; smaller loops are extrapolated."
    return Notice(grade, headline), (_fit(of, figures), _range(of, figures), _rate(of))


def _fit(of: Evaluation, figures: EngineeringFigures) -> str:
    whole, unit = of.identification, of.residual
    parts = [
        f"The model follows the measured force with an rms error of {number(whole.rmse * unit.factor, 3)} {unit.name}, "
        f"{percent(1.0 - whole.rnl)} of the rms force (RNL {number(whole.rnl, 4)}, 1 is perfect)"
    ]
    if whole.lack_of_fit is not None:
        lack = whole.lack_of_fit
        noise = f"{number(lack.over_noise, 2)} times the noise of the records"
        parts.append(
            f"this misfit is {noise} and {percent(lack.of_height)} of the loops' height"
            if lack.is_structured
            else f"this is what noise alone would leave ({noise})"
        )
    row = figures.largest
    if row.measured is not None and row.measured.figures.energy_per_cycle > 0.0:
        change = row.model.energy_per_cycle / row.measured.figures.energy_per_cycle - 1.0
        alone = ", the rig's effects taken out" if whole.effects else ""
        parts.append(
            f"the energy per cycle of the largest loop is {percent(change, sign=True)} from the measured one{alone}"
        )
    return "; ".join(parts) + "."


def _range(of: Evaluation, figures: EngineeringFigures) -> str:
    p, unit = of.identification.parameters, of.length
    half = 0.5 * (p.displacement_max - p.displacement_min)
    where = (
        f"It holds from {span(p.displacement_min, p.displacement_max, unit)} (amplitudes up to "
        f"{number(half * unit.factor, 3)} {unit.name}); outside it is continued linearly"
    )
    amplitudes = [row.figures.amplitude * unit.factor for row in figures.measured]
    if not amplitudes:
        return f"{where}. No full cycle was recorded."
    if amplitudes[-1] - amplitudes[0] < 0.1 * amplitudes[-1]:
        return f"{where}. Recorded amplitude: {number(amplitudes[-1], 3)} {unit.name}."
    return f"{where}. Recorded amplitudes: {number(amplitudes[0], 3)} to {number(amplitudes[-1], 3)} {unit.name}."


def _rate(of: Evaluation) -> str:
    """Whether the spring is as rate independent as the model."""
    rate, overlap = campaign_verdicts(of.identification.records)
    sentences = [
        "The model is rate independent; these records do not show whether the spring is."
        if rate is None
        else rate.sentence
    ]
    if overlap is not None:
        sentences.append(overlap.sentence)
    return " ".join(sentences)
