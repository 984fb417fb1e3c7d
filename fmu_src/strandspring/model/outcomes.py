"""What an identification can end with: each outcome is a whole sentence with advice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from ..errors import StrandspringError


class Outcome(Enum):
    """Outcomes; the value is the sentence that travels into messages, reports and JSON.

    Cautions are reported in this order.
    """

    # Refusals
    TOO_FEW_STROKES = (
        "The displacement does not go back and forth over one full range; record at least one whole cycle."
    )
    UNDERSAMPLED = (
        "The displacement changes between samples as much as noise would, so strokes cannot be distinguished from "
        "noise; sample at least 12 times per cycle, or, if it is noise, check the column and the sensor."
    )
    TOO_LITTLE_LEFT = (
        "Too few samples of the loading or the unloading branch are left to fit; choose a larger "
        "`displacement_range=...`, more `cycles=...` or a longer `time_window=...`, or record without dwells and "
        "within the force sensor's range."
    )
    TOO_FEW_SAMPLES = (
        "There are no more samples than parameters, so nothing shows whether the model fits; sample the strokes more "
        "densely, or give lower `degrees=...`."
    )
    FORCE_REVERSED = (
        "The force falls as the displacement rises; negate a column with `reverse=displacement` or `reverse=force`."
    )
    UNITS_DIFFER = (
        "This record agrees with the others only after a factor between units; check its units, and give them in a "
        "description file if they differ from the others'."
    )
    COLUMNS_SWAPPED = (
        "The loop runs the wrong way round, as if the spring released energy; displacement and force are probably "
        "swapped: exchange `displacement=...` and `force=...`; or the force lags far behind: check the "
        "synchronisation of the two sensors and give `delay=...`."
    )
    SNAP_THROUGH = (
        "The force collapses while the displacement continues (snap-through), which no single-valued stiffness with "
        "bounded hysteresis can follow; identify a range without the snap with `displacement_range=...`."
    )
    STICK_SLIP = (
        "The force drops again and again while the displacement continues (stick-slip), which a rate-independent model "
        "cannot follow; stiffen the rig, lubricate the guide, or test faster."
    )
    BRANCHES_CROSS = (
        "The unloading branch lies above the loading branch over part of the range, so no positive amplifier FA "
        "exists; check the synchronisation of the two sensors and give a known delay with `delay=...`, or identify a "
        "smaller range with `displacement_range=...`."
    )
    NO_LOOP = (
        "The loop is no higher than the noise, so the hysteresis cannot be identified; use a plain nonlinear spring or "
        "record larger strokes."
    )
    BEYOND_LIMITS = (
        "The spring that fits best is beyond the limits of what a spring can be; check the units of displacement and "
        "force, or give lower `degrees=...`."
    )
    UNCERTIFIED = (
        "No spring that fits keeps to the recorded forces between samples and on other loops; record several "
        "amplitudes, 100 samples per cycle, or give other `degrees=...`."
    )

    PAPER_FORMULAS = (
        "The paper's formulas have no value on this record; give other `degrees=...`, `steady=...`, `smoothing=...`, "
        "`branch=...` or `levels=...`, or identify with `options=RefinedOptions()`."
    )
    SPIKES_DECIDE = (
        "Isolated outliers lie far outside all other samples, and no spring can be identified with them; correct or "
        "delete their lines, or leave out the cycles that hold them with `cycles=...` or `time_window=...`."
    )

    # Cautions: a model is returned; the most harmful first
    WORSE_THAN_LINE = (
        "Do not use this spring, which follows the records worse than a straight line: identify a part of them, or "
        "add `save_anyway=True`."
    )
    SPRING_ALONE = (
        "The saved spring follows the records less well than with what was taken out as the rig's: check zeros, drift "
        "and delay."
    )
    SIMPLER_CLASS = (
        "The best fit left the recorded forces between samples or on other loops; the next best was saved: sample "
        "more densely, at several amplitudes."
    )
    LOOP_ENERGY = (
        "The loops of the saved spring differ in energy from those recorded; allow for that where damping counts."
    )
    RECORDS_DIFFER = (
        "The loops of one record differ from the others' at like amplitude and frequency; identify it alone, or find "
        "out what changed."
    )
    INERTIA = (
        "The stiffness falls with the square of the frequency, as the inertia of a moving mass makes it; give the "
        "mass with `moving_mass=...`."
    )
    RATE_DEPENDENT = (
        "The stiffness depends on the frequency: identify each frequency alone, or use the spring as a mean."
    )
    RATE_OPEN = "Part of the force is taken to depend on the rate, which one rate does not decide: record another rate."
    BACKLASH = (
        "The force rests after reversals, or within each stroke, as in a gap: tighten the joints, or identify a range "
        "beside it."
    )
    SPIKES = (
        "Isolated outliers far outside all other samples distort the fit; correct or delete them, leave out their "
        "cycles with `cycles=...`, or identify with `robust=True`."
    )
    POOR_FIT = (
        "The model follows these records poorly (RNL below 0.9); look at the report's plot, and compare it with "
        "`options=RefinedOptions()`."
    )
    LACK_OF_FIT = (
        "Part of the force is neither described nor noise: see the residuals in the report and the usual causes on "
        "the page of findings."
    )
    NI_MODEL = (
        "Ni's method left residuals beyond the noise: Ni's model does not apply, or the minimum is a local one; "
        "compare it with `options=RefinedOptions()`."
    )
    NOT_CONVERGED = (
        "The refinement stopped at its limit of evaluations; the result is the best point reached: compare it with "
        "`options=TwoStageOptions()`."
    )
    RANGE_WITH_GAPS = (
        "The records share no displacement, and the model guesses between them: check the zeros (displacement_offset "
        "of a description file), or record what lies between."
    )
    SMALL_LOOPS = "The energy of small loops is left undecided by these records: record smaller loops too."
    FRICTION_WEAR = (
        "The hysteretic force changes from cycle to cycle (wear), and the spring is a mean: choose the cycles to "
        "describe by `state=first` or last."
    )
    STIFFNESS_WEAR = (
        "The elastic force changes from cycle to cycle (softening), and the spring is a mean: choose the cycles to "
        "describe by `state=first` or last."
    )
    DELAY = (
        "Force and displacement were not measured at the same moments; the delay was taken out: check it, and give it "
        "as `delay=...`."
    )
    DRIFT_REMOVED = (
        "The force drifts; the drift was taken out: let the sensor warm up, and choose the moment to describe by "
        "`state=first`, mean or last."
    )
    FORCE_ZERO = "The zero of the force differed between records and was shifted: zero the sensors before each record."
    GAPS = (
        "Samples are missing where the time jumps, and reversals there are lost: record again, or choose a part by "
        "`time_window=...` or `cycles=...`."
    )
    CLIPPED = (
        "The force stays at an extreme, as at the end of a sensor's range; those samples were left out: repeat with a "
        "larger range."
    )
    DWELLS = (
        "The force relaxes while the displacement rests; the dwells were left out, but the loops are lower for it: "
        "record without dwells."
    )
    TURNS_BETWEEN_SAMPLES = (
        "Reversals fall between samples, which falsifies rho, sigma, n and the energy of small loops: sample 100 "
        "times per cycle, more often at corners."
    )
    DISPLACEMENT_NOISE = (
        "The displacement is noisy, which blurs reversals and knee, and rho, sigma, n with them: take a finer "
        "resolution, or sample faster."
    )
    NO_STEADY_SECTION = (
        "The strokes end before the hysteresis saturates, so sigma, n and the split between elastic and hysteretic "
        "force are uncertain: record longer strokes."
    )
    SIGMA_RAISED = (
        "The paper's formula gave a sigma below 1/2, which no passive spring has; 1/2 was taken: compare with "
        "`options=RefinedOptions()`."
    )
    PAPER_DEGREES = (
        "A degree is above 3, where the paper has usually less than 4: compare with lower `degrees=...` and with "
        "`options=RefinedOptions()`."
    )
    SIGMA_AT_BOUND = (
        "sigma ended at its bound, so these records show little of the recovery after a reversal; sample the reversals "
        "more densely."
    )
    N_AT_BOUND = "n ended at its bound, so these records show little of the knee of the loop; sample it more densely."
    ONE_AMPLITUDE = (
        "All loops have about one amplitude; the energy of smaller ones is extrapolated: record loops of about a "
        "third of that amplitude too."
    )
    INTERVAL_TOO_NARROW = (
        "The 95 % prediction interval holds less than 90 % of the cycles left out: expect cycles outside it, and "
        "compare the recorded ones."
    )
    AMPLIFIER_REDUCED = (
        "The amplifier FA of the wanted degree was not positive over the whole range; its degree was lowered until it "
        "was."
    )
    FIRST_CYCLE_DIFFERS = "The first cycle differs from the later ones and was left out."

    @property
    def is_settled_by_a_test(self) -> bool:
        """Whether it is about what the records do not hold, and those of a planned test would."""
        return self.name in (
            "RANGE_WITH_GAPS", "SMALL_LOOPS", "RATE_OPEN", "N_AT_BOUND", "ONE_AMPLITUDE",
        )  # fmt: skip


@dataclass(frozen=True)
class Finding:
    """Something that is to be known of records or of the spring identified from them.

    Attributes
    ----------
    kind : Outcome
    numbers : mapping of str to float
    where : str    The record; "" for all.
    detail : str   The numbers in words.
    """

    kind: Outcome
    numbers: Mapping[str, float] = field(default_factory=dict)
    where: str = ""
    detail: str = ""

    @property
    def sentence(self) -> str:
        """What it is and what to do, with record and numbers."""
        beside = ", ".join(filter(None, (self.where, self.detail)))
        return f"{self.kind.value} ({beside})" if beside else self.kind.value


def by_harm(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Findings in the order of `Outcome`, in which the most harmful ones come first."""
    order = list(Outcome)
    return tuple(sorted(findings, key=lambda finding: order.index(finding.kind)))


class IdentificationError(StrandspringError):
    """The records cannot be described by a physically possible model; `outcome` says why.

    Attributes
    ----------
    outcome : Outcome
    """

    def __init__(self, outcome: Outcome, where: str, detail: str = "") -> None:
        self.outcome = outcome
        super().__init__(f"{where}: {outcome.value}{detail}")
