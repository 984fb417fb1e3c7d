"""What an identification can end with: each outcome is a whole sentence with advice."""

from __future__ import annotations

from enum import Enum

from ..errors import StrandspringError


class Outcome(Enum):
    """Outcomes; the value is the sentence that travels into messages, reports and JSON."""

    # Refusals
    TOO_FEW_STROKES = (
        "The displacement does not go back and forth over one full range; record at least one whole cycle."
    )
    UNDERSAMPLED = (
        "The displacement changes between samples as much as noise would, so strokes cannot be distinguished from "
        "noise; sample at least 12 times per cycle, or, if it is noise, check the column and the sensor."
    )
    TOO_LITTLE_LEFT = (
        "Too few samples of the loading or the unloading branch are left to fit; choose a larger --displacement-range, "
        "more --cycles or a longer --time, or record without dwells and within the force sensor's range."
    )
    TOO_FEW_SAMPLES = (
        "There are no more samples than parameters, so nothing shows whether the model fits; sample the strokes more "
        "densely, or give lower --degrees."
    )
    FORCE_REVERSED = (
        "The force falls as the displacement rises; negate a column with --reverse displacement or --reverse force."
    )
    COLUMNS_SWAPPED = (
        "The loop runs the wrong way round, as if the spring released energy; displacement and force are probably "
        "swapped: exchange --displacement and --force; or the force lags far behind: check the synchronisation of the "
        "two sensors and give --delay."
    )
    SNAP_THROUGH = (
        "The force collapses while the displacement goes on (snap-through), which no single-valued stiffness with "
        "bounded hysteresis can follow; identify a range without the snap with --displacement-range."
    )
    STICK_SLIP = (
        "The force drops again and again while the displacement goes on (stick-slip), which a rate-independent model "
        "cannot follow; stiffen the rig, lubricate the guide, or test faster."
    )
    BRANCHES_CROSS = (
        "The unloading branch lies above the loading branch over part of the range, so no positive amplifier FA "
        "exists; check the synchronisation of the two sensors and give a known delay with --delay, or identify a "
        "smaller range with --displacement-range."
    )
    NO_LOOP = (
        "The loop is no higher than the noise, so the hysteresis cannot be identified; use a plain nonlinear spring or "
        "record larger strokes."
    )
    BEYOND_LIMITS = (
        "The spring that fits best is beyond the limits of what a spring can be; check the units of displacement and "
        "force, or give lower --degrees."
    )

    SPIKES_DECIDE = (
        "Isolated outliers lie far outside all other samples, and no spring can be identified with them; correct or "
        "delete their lines, or leave out the cycles that hold them with --cycles or --time."
    )

    TOO_FEW_TO_DRAW = (
        "A bootstrap draws from at least two steady strokes in each direction, and there are fewer; record more "
        "cycles, or go without --bootstrap."
    )

    # Cautions: a model is returned
    SPIKES = (
        "Isolated outliers lie far outside all other samples and distort the fit; correct or delete their lines, "
        "leave out their cycles with --cycles, or identify with --robust."
    )
    NO_STEADY_SECTION = (
        "The strokes end before the hysteresis saturates, so there is no steady section; sigma, n and the split "
        "between elastic and hysteretic force are uncertain: record longer strokes."
    )
    FIRST_CYCLE_DIFFERS = "The first cycle differs from the later ones and was left out."
    DRIFT = (
        "The force drifts from cycle to cycle; the model describes the mean of the cycles: use the steady ones with "
        "--cycles, warm up or exercise the specimen first, or check the force sensor's zero."
    )
    RANGE_WITH_GAPS = (
        "The records have no displacement in common, and between them the model is a guess: check the zeros of the "
        "displacement (displacement_offset of a description file), or record what lies between, too."
    )
    CLIPPED = (
        "The force stays at an extreme for many samples, as a sensor or amplifier at the end of its range does; those "
        "samples were left out: repeat the test with a larger range."
    )
    DWELLS = (
        "The displacement rests for a while and the force relaxes meanwhile, which a rate-independent model does not "
        "do; the samples of the dwells were left out, but the loops are lower for it: record without dwells."
    )
    GAPS = (
        "Samples are missing where the time column jumps; a reversal within a gap is lost, and with it the memory of "
        "the spring up to the next ones: record again, or identify from a part without gaps with --time or --cycles."
    )
    TURNS_BETWEEN_SAMPLES = (
        "The samples are so few that the displacement turns between them; what it travels there is lost, which can "
        "look like a delay or wear and falsifies rho, sigma, n and the energy of small loops: sample 100 times in a "
        "cycle."
    )
    TURNS_RESTORED = (
        "The samples are so few that the displacement turns between them; its reversals were estimated from the "
        "samples about them, and what is wrong with that falsifies rho, sigma, n and the energy of small loops: sample "
        "100 times in a cycle, and more often where it turns at corners."
    )
    DISPLACEMENT_NOISE = (
        "The noise of the displacement is large; it was smoothed out between the reversals, but what is left of it "
        "still blurs the reversals and the knee of the loop, and with them rho, sigma and n: take a sensor with less "
        "noise or a finer resolution, or sample faster."
    )
    BAND_LIMITED = (
        "The records were low-pass filtered before they were saved, which rounds the loop at its reversals; record "
        "again without the filter, or with a far higher cutoff."
    )
    RECORDS_DIFFER = (
        "The loops of one record differ from those of the others at like amplitude and frequency; identify that "
        "record alone, or find out what changed between the tests."
    )
    INERTIA = (
        "The stiffness falls with the square of the frequency, as the inertia of a moving mass makes it; give the "
        "mass with --moving-mass."
    )
    RATE_DEPENDENT = (
        "The force depends on the frequency, which the model does not describe; identify each frequency alone, or use "
        "the model as a mean."
    )
    HUM = (
        "One sinusoid runs through the whole force, as mains or a machine make it; shield or ground the load cell, or "
        "filter that frequency out of both columns alike."
    )
    DELAY = (
        "The force and the displacement were not measured at the same moments; the delay between the columns was "
        "taken out: check it with a stiff plain spring in the rig, and give it as --delay."
    )
    VISCOSITY = (
        "Part of the force grows with the velocity; it was taken out as viscous damping, which the model does not "
        "hold: repeat one amplitude at another frequency to tell it from a delay or a filter on the force channel."
    )
    BACKLASH = (
        "Within each stroke the force rests while the displacement goes on, as in a gap; the model cannot follow that: "
        "tighten the joints, or identify a range beside the gap."
    )
    PLAY = (
        "After each reversal the spring rests until a play (backlash) in the rig is used up; it was taken out as far "
        "as the records show it: remove it from the rig and measure again."
    )
    FORCE_ZERO = (
        "The zero of the force differs from record to record; the shifts against the first record were taken out: "
        "a shift of the displacement's zero would look much alike, so zero both sensors before each record."
    )
    DISPLACEMENT_ZERO = (
        "The zero of the displacement differs from record to record; the shifts against the first record were taken "
        "out: a shift of the force's zero would look much alike, so zero both sensors before each record."
    )
    DRIFT_REMOVED = (
        "The force drifts; the drift was taken out, so that the model describes the force at the first sample: let "
        "the sensor warm up, or check its zero."
    )
    FRICTION_WEAR = (
        "The hysteretic force changes from cycle to cycle (wear or running in); the change was taken out, so that the "
        "model describes the first cycle: use later ones with --cycles, or exercise the specimen first, if it is to "
        "describe those."
    )
    STIFFNESS_WEAR = (
        "The elastic force changes from cycle to cycle (softening or wear); the change was taken out, so that the "
        "model describes the first cycle: use later ones with --cycles, or exercise the specimen first, if it is to "
        "describe those."
    )
    SIGMA_AT_BOUND = (
        "sigma ended at its bound, so these records show little of the recovery after a reversal; sample the "
        "reversals more densely."
    )
    N_AT_BOUND = "n ended at its bound, so these records show little of the knee of the loop; sample it more densely."
    AMPLIFIER_REDUCED = (
        "The amplifier FA of the wanted degree was not positive over the whole range; its degree was lowered until "
        "it was."
    )
    NOT_CONVERGED = (
        "The refinement stopped at its limit of evaluations; the result is the best point reached: compare it with "
        "--method two-stage."
    )
    ONE_AMPLITUDE = (
        "All loops have about one amplitude: the energy of smaller ones is extrapolated by the model, which these "
        "records do not check; record loops of about a third of that amplitude too."
    )
    SMALL_LOOPS = "The energy of small loops is left undecided by these records."
    INDISTINCT = (
        "Some parameters are strongly correlated in these records, though the force is predicted as given: see the "
        "standard errors and correlations in the model file; record larger strokes or several amplitudes."
    )
    INTERVAL_TOO_NARROW = (
        "The 95 % prediction interval holds less than 90 % of the cycles that were left out of the fit, since these "
        "differ from the others; expect further cycles outside it, and compare the recorded ones with each other."
    )
    NI_MODEL = (
        "Ni's method converged, but its residuals exceed the noise: Ni's model does not describe this spring, or its "
        "start values led to a local minimum; compare it with --method refined."
    )
    OTHER_CLASS = (
        "Another class of models predicts what it was not fitted to clearly better than this one, see the table of "
        "--rivals; where loops unlike the recorded ones matter, record such a loop and compare both with it, or use "
        "that class."
    )
    LACK_OF_FIT = (
        "The model leaves more misfit than the noise explains, and it is not small against the hysteretic force; do "
        "not trust the loops' energies beyond that."
    )
    POOR_FIT = (
        "The model follows these records poorly (RNL below 0.9); look at the report's plot, and compare it with "
        "--method refined."
    )


class IdentificationError(StrandspringError):
    """The records cannot be described by a physically possible model; `outcome` says why.

    Attributes
    ----------
    outcome : Outcome
    """

    def __init__(self, outcome: Outcome, where: str, detail: str = "") -> None:
        self.outcome = outcome
        super().__init__(f"{where}: {outcome.value}{detail}")
