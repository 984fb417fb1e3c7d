"""What an identified spring is good for, in words."""

from __future__ import annotations

from ..loops.campaign import campaign_verdicts
from ..model.outcomes import Outcome
from ..model.stated_figures import Figures, differ, energy_ratio
from .charts.engineering import EngineeringFigures
from .charts.evaluation import Evaluation
from .content.blocks import Level, Notice
from .content.quantities import number, percent, span

# Findings that say that the model does not follow its own records.
_POOR = frozenset({Outcome.POOR_FIT, Outcome.LACK_OF_FIT, Outcome.NI_MODEL, Outcome.WORSE_THAN_LINE})
# Findings that say that the spring alone does not give what was recorded.
_ALONE = frozenset({Outcome.SPRING_ALONE, Outcome.LOOP_ENERGY, Outcome.JITTER})
# Findings that leave the model as good as it would be without them.
HARMLESS = frozenset({Outcome.FIRST_CYCLE_DIFFERS, Outcome.AMPLIFIER_REDUCED})
# Findings on loops that were not recorded.
_EXTRAPOLATED = frozenset({Outcome.ONE_AMPLITUDE, Outcome.SMALL_LOOPS})


def level(evaluation: Evaluation) -> Level:
    """How far the model can be relied on."""
    findings = set(evaluation.identification.findings)
    if findings & _POOR:
        return Level.POOR
    return Level.CARE if findings - HARMLESS else Level.GOOD


def verdict(evaluation: Evaluation, figures: EngineeringFigures) -> tuple[Notice, tuple[str, ...]]:
    """The headline, and the sentences that support it."""
    findings = evaluation.identification.findings
    grade = level(evaluation)
    others = len(set(findings) - HARMLESS)
    headline = {
        Level.GOOD: "Good to use within the recorded range.",
        Level.CARE: f"Good to use with care: {others} caution{'s' if others > 1 else ''} below.",
        Level.POOR: "Do not rely on this model yet: it does not follow its own records.",
    }[grade]
    if grade is Level.CARE and set(findings) - HARMLESS <= _EXTRAPOLATED:
        headline = "Good to use at the recorded amplitudes; smaller loops are extrapolated."
    if grade is Level.CARE and findings.keys() & _ALONE:
        headline = "The saved spring alone differs from what was recorded: use it with the cautions below."
    return Notice(grade, headline), (_fit(evaluation, figures), _range(evaluation, figures), _rate(evaluation))


def _fit(evaluation: Evaluation, figures: EngineeringFigures) -> str:
    whole, unit = evaluation.identification, evaluation.residual
    parts = [
        "The saved spring alone, driven by the displacement as recorded, follows the measured force with an rms error "
        f"of {number(whole.rmse * unit.factor, 3)} {unit.name}, {percent(1.0 - whole.rnl)} of the rms force "
        f"({_figures(whole.figures)}; RNL 1 is perfect)"
    ]
    if differ(whole.figures, whole.fitted_figures):
        parts.append(f"as fitted, {evaluation.beside}, it is {_figures(whole.fitted_figures)}")
    if whole.lack_of_fit is not None:
        lack = whole.lack_of_fit
        noise = f"{number(lack.over_noise, 2)} times the noise of the records"
        parts.append(
            f"the misfit of the fit is {noise} and {percent(lack.of_height)} of the loops' height"
            if lack.is_structured
            else f"the fit leaves what noise alone would ({noise})"
        )
    row = figures.largest
    if row.measured is not None and row.measured.figures.energy_per_cycle > 0.0:
        change = row.model.energy_per_cycle / row.measured.figures.energy_per_cycle - 1.0
        parts.append(f"the energy per cycle of the largest loop is {percent(change, sign=True)} from the measured one")
    return "; ".join(parts) + "."


def _figures(figures: Figures) -> str:
    """RNL and the energy of the loops."""
    ratio = energy_ratio(figures)
    energy = "" if ratio is None else f", loop energy {number(ratio, 3, zeros=True)} of the measured"
    return f"RNL {number(figures['rnl'], 4, zeros=True)}{energy}"


def _range(evaluation: Evaluation, figures: EngineeringFigures) -> str:
    p, unit = evaluation.identification.parameters, evaluation.length
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


def _rate(evaluation: Evaluation) -> str:
    """Whether the spring is as rate independent as the model."""
    rate, overlap = campaign_verdicts(evaluation.identification.records)
    sentences = [
        "The model is rate independent; these records do not show whether the spring is."
        if rate is None
        else rate.sentence
    ]
    if overlap is not None:
        sentences.append(overlap.sentence)
    return " ".join(sentences)
