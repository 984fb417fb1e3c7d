"""Findings: what is to be known of records, springs and systems besides their figures, as data.

A finding is made where something is found, and its words where a person reads it, by `words` or `gathered`. Each kind
stands here once, with its severity, its sentence, what to do, and how its numbers read; the most harmful come first in
each part.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import partial
from itertools import groupby
from pathlib import PurePath
from string import Formatter
from typing import Any, NamedTuple

from .errors import Reader, StrandspringError, worded

_WORDS = 25  # to which a finding in few words has its details
_NAMED = 3  # places that a sentence begins with


class Severity(Enum):
    """How much a finding matters."""

    REFUSAL = "refusal"
    CAUTION = "caution"
    INFORMATION = "note"  # nothing is wrong, but it is good to know
    STATED = "as stated"  # in the file or by the user, who knows it


CAUTIONS = (Severity.REFUSAL, Severity.CAUTION)
NOTES = (Severity.INFORMATION,)


class Kind(NamedTuple):
    """A kind of findings; the texts are templates of `worded` without a full stop, with its numbers as fields.

    Attributes
    ----------
    severity : Severity
    sentence : str
    remedy : str             What to do; empty where nothing is to be done.
    details : str or tuple   The numbers in words, in parts; a part is left out where one of its numbers is not known.
    measure : str            The number by which the worst stands for all of this kind; empty if each counts.
    """

    severity: Severity
    sentence: str
    remedy: str = ""
    details: str | tuple[str, ...] = ""
    measure: str = ""


_refusal = partial(Kind, Severity.REFUSAL)
_caution = partial(Kind, Severity.CAUTION)
_note = partial(Kind, Severity.INFORMATION)

# What is lost where a spring is not held to its records, see `shortcoming`.
_SHORTCOMINGS = (
    "FE reaches {elastic:.3g N}",
    "FE rises or falls by {slope:.3g} N/m, the records by {recorded_slope:.3g} N/m at most",
    "between samples the force reaches {between:.3g N}",
    "on other loops the force reaches {elsewhere:.3g N}",
    "beyond {allowed:.4g N}",
    "a loop over {loop:.4g mm} releases energy",
    "the stiffness at {infinite:.4g mm} is not finite",
)
_ENERGY = "loops of {amplitude:.3g mm} absorb {energy:.3g J} per cycle, {energies:.2g J} by {others}"
_SAMPLES = ("displacement {displacement:.6g} m in {displacement_at}", "force {force:.6g} N in {force_at}")


class Outcome(Enum):
    """Kinds of findings."""

    # Reading of records
    UNREADABLE_ROWS = _caution(
        "Some {row}s cannot be read and are left out", details="{count}, the first in {place}: {problem}"
    )
    OUTLIERS = _note(
        "Samples are far outside all others and from their neighbours", "correct or delete faulty ones", _SAMPLES
    )
    UNIT_ASSUMED = _note("The unit is assumed, as none is given", details="{quantity} in {unit}")
    NO_TIME = _note(
        "No column is named like a time, without which nothing that depends on the rate is seen",
        "name one with {to[time]} if there is one",
    )
    TIME_LEFT_OUT = _note(
        "The time is left out",
        details=("{column}", "{problem}", "{columns} could hold it", "{values} values, the others {others}"),
    )
    COLUMN_ASSUMED = _note("The {quantity} is assumed to be {column}, as there is no header")
    TABLE_CHOSEN = _note("{table} is read, which alone holds a displacement and a force")
    CLOCK = _note("Times of day or dates are read as seconds", details="{column}")
    UNIT_OVERRULED = _note("The unit of the {quantity} is {unit}, as given, though the {file} says {stated}")
    INTERPOLATED = _note(
        "A channel is interpolated linearly onto the times of the finest one", details="{column}, {times:.6g s}"
    )
    INCOMPLETE_ROWS = _note("Incomplete rows at the end are left out", details="{count}, from {row} {line}")
    EMPTY_ROWS = _note("Empty rows at the end are left out", details="{count}")
    NUL_BYTES = _note("NUL bytes at the end of the file are left out", details="{count}")
    ENCODING = _note("The text is read as {encoding}")
    DECIMAL_COMMA = _note("The decimal mark is a comma")
    UNPACKED = _note("The file is unpacked from {archive}", details="{member}")
    TABLE_GIVEN = Kind(Severity.STATED, "{table} is read, as given")
    HEADER = Kind(Severity.STATED, "The numbers begin in {row} {first}, with the header in {row} {header}")
    NO_HEADER = Kind(Severity.STATED, "The numbers begin in {row} {first}, without a header")
    COLUMN_GIVEN = Kind(Severity.STATED, "The {quantity} is {column}, as given")
    COLUMN_FOUND = Kind(Severity.STATED, "The {quantity} is {column}, by its name or unit")
    UNIT_GIVEN = Kind(Severity.STATED, "The unit of the {quantity} is {unit}, as given")
    UNIT_FOUND = Kind(Severity.STATED, "The unit of the {quantity} is {unit}, found in the {file}")
    OFFSET = Kind(Severity.STATED, "{offset:.6g} is subtracted from the {quantity}, as given")
    SCALE = Kind(Severity.STATED, "The {quantity} is multiplied by {scale:.6g}, as given")
    REVERSED = Kind(Severity.STATED, "The {quantity} is negated, as given")
    CUT = Kind(Severity.STATED, "Selected, as given: {part}", details="samples {samples} of {of}")
    WITHIN = Kind(
        Severity.STATED,
        "Selected, as given: {part}; the other samples belong to the path only",
        details="{count} of {samples} samples",
    )
    NOISE = Kind(Severity.STATED, "Noise level {noise:g}, seed {seed}")

    # Identification: refusals
    TOO_FEW_STROKES = _refusal(
        "The displacement does not go back and forth over one full range", "record at least one whole cycle"
    )
    UNDERSAMPLED = _refusal(
        "The displacement changes between samples as much as noise would, so strokes cannot be distinguished from "
        "noise",
        "sample at least 12 times per cycle, or, if it is noise, check the column and the sensor",
    )
    TOO_LITTLE_LEFT = _refusal(
        "Too few samples of the loading or the unloading branch are left to fit",
        "choose more by {to[displacement_range]}, {to[cycles]} or {to[time_window]}, or record "
        "without dwells and within the force sensor's range",
    )
    TOO_FEW_SAMPLES = _refusal(
        "There are no more samples than parameters, so nothing shows whether the model fits",
        "sample the strokes more densely, or lower {to[degrees]}",
        "{found} samples, and {needed} are needed at least",
    )
    FORCE_REVERSED = _refusal(
        "The force falls as the displacement rises",
        "negate a column with {to[reverse=displacement]} or {to[reverse=force]}",
    )
    UNITS_DIFFER = _refusal(
        "This record agrees with the others only after a factor between units",
        "check its units, and give them in a description file if they differ from the others'",
        "its {column} times {factor:.6g} agrees with {other}, as {read}",
    )
    COLUMNS_SWAPPED = _refusal(
        "The loop runs the wrong way round, as if the spring released energy; displacement and force are probably "
        "swapped: exchange {to[displacement]} and {to[force]}; or the force lags far behind",
        "check the synchronisation of the two sensors and give {to[delay]}",
        "if the force lags, then by more than {lag:.3g ms}",
    )
    SNAP_THROUGH = _refusal(
        "The force collapses while the displacement continues (snap-through), which no single-valued stiffness "
        "with bounded hysteresis can follow",
        "identify a range without the snap with {to[displacement_range]}",
    )
    STICK_SLIP = _refusal(
        "The force drops again and again while the displacement continues (stick-slip), which a rate-independent "
        "model cannot follow",
        "stiffen the rig, lubricate the guide, or test faster",
    )
    BRANCHES_CROSS = _refusal(
        "The unloading branch lies above the loading branch over part of the range, so no positive amplifier FA exists",
        "check the synchronisation of the two sensors and give a known delay with {to[delay]}, or identify a "
        "smaller range with {to[displacement_range]}",
    )
    NO_LOOP = _refusal(
        "The loop is no higher than the noise, so the hysteresis cannot be identified",
        "use a plain nonlinear spring or record larger strokes",
    )
    BEYOND_LIMITS = _refusal(
        "The spring that fits best is beyond the limits of what a spring can be",
        "check the units of displacement and force, or lower {to[degrees]}",
        "{problem}",
    )
    UNCERTIFIED = _refusal(
        "No spring that fits keeps to the recorded forces between samples and on other loops",
        "record several amplitudes, 100 samples per cycle, or change {to[degrees]}",
        _SHORTCOMINGS,
    )
    PAPER_FORMULAS = _refusal(
        "The paper's formulas have no value on this record",
        "change {to[degrees]}, {to[steady]}, {to[smoothing]}, {to[branch]} or {to[levels]}, or identify with "
        "{to[method=refined]}",
        "{problem}",
    )
    SPIKES_DECIDE = _refusal(
        "Isolated outliers lie far outside all other samples, and no spring can be identified with them",
        "correct or delete their lines, or leave out the cycles that hold them with {to[cycles]} or {to[time_window]}",
        _SAMPLES,
    )

    # Identification: a model is returned
    WORSE_THAN_LINE = _caution(
        "Do not use this spring, which follows the records worse than a straight line",
        "identify a part of them, or add {to[save_anyway=True]}",
    )
    SPRING_ALONE = _caution(
        "The saved spring follows the records less well than with what was taken out as the rig's",
        "check zeros, drift and delay",
        "error {alone:.2g %} of the force, {fitted:.2g %} as fitted",
    )
    SIMPLER_CLASS = _caution(
        "The best fit left the recorded forces between samples or on other loops; the next best was saved",
        "sample more densely, at several amplitudes",
        _SHORTCOMINGS,
    )
    LOOP_ENERGY = _caution(
        "The loops of the saved spring differ in energy from those recorded",
        "allow for that where damping counts",
        ("{difference:+.0f %} at {amplitude:.3g mm}", "no loop was recorded at {unrecorded:.3g mm}"),
    )
    RECORDS_DIFFER = _caution(
        "The loops of one record differ from the others' at like amplitude and frequency",
        "identify it alone, or find out what changed",
        "{figure} {change:+.2g %} against the others",
    )
    INERTIA = _caution(
        "The stiffness falls with the square of the frequency, as the inertia of a moving mass makes it",
        "give the mass with {to[moving_mass]}",
        "{mass:.3g kg}, {share:.2g %} of the stiffness at {frequency:.3g Hz}",
    )
    RATE_DEPENDENT = _caution(
        "The stiffness depends on the frequency",
        "identify each frequency alone, or use the spring as a mean",
        "stiffness {change:+.2g %} at {high:.3g Hz} against {low:.3g Hz}",
    )
    RATE_OPEN = _caution(
        "Part of the force is taken to depend on the rate, which one rate does not decide",
        "record another rate",
        "recorded at {frequencies:.2g Hz} only",
    )
    BACKLASH = _caution(
        "The force rests after reversals, or within each stroke, as in a gap",
        "tighten the joints, or identify a range beside it",
        ("{width:.3g mm}", "at {force:.3g N}"),
    )
    SPIKES = _caution(
        "Isolated outliers far outside all other samples distort the fit",
        "correct or delete them, leave out their cycles with {to[cycles]}, or identify with {to[robust=True]}",
        _SAMPLES,
    )
    POOR_FIT = _caution(
        "The model follows these records poorly (RNL below 0.9)",
        "look at the report's plot, and compare it with {to[method=refined]}",
        "RNL {rnl:.3g}",
    )
    LACK_OF_FIT = _caution(
        "Part of the force is neither described nor noise",
        "see the residuals in the report and the usual causes on the page of findings",
        ("the model misses {missed:.2g %} of the force that is not noise", "mostly {mostly}"),
    )
    NI_MODEL = _caution(
        "Ni's method left residuals beyond the noise: Ni's model does not apply, or the minimum is a local one",
        "compare it with {to[method=refined]}",
    )
    NOT_CONVERGED = _caution(
        "The refinement stopped at its limit of evaluations; the result is the best point reached",
        "compare it with {to[method=two-stage]}",
    )
    RANGE_WITH_GAPS = _caution(
        "The records share no displacement, and the model guesses between them",
        "check the zeros (displacement_offset of a description file), or record what lies between",
        "{gaps:.4g mm}",
    )
    SMALL_LOOPS = _caution(
        "The energy of small loops cannot be determined from these records", "record smaller loops too", _ENERGY
    )
    FRICTION_WEAR = _caution(
        "The hysteretic force changes from cycle to cycle (wear), and the spring is a mean",
        "choose the cycles to describe by {to[state=first]} or last",
        "{figure} {change:+.2g %} per cycle",
    )
    STIFFNESS_WEAR = _caution(
        "The elastic force changes from cycle to cycle (softening), and the spring is a mean",
        "choose the cycles to describe by {to[state=first]} or last",
        "{figure} {change:+.2g %} per cycle",
    )
    DELAY = _caution(
        "Force and displacement were not measured at the same moments; the delay was taken out",
        "check it, and give it as {to[delay]}",
        "{delay:.3g ms}",
    )
    DRIFT_REMOVED = _caution(
        "The force drifts; the drift was taken out",
        "let the sensor warm up, and choose the moment to describe by {to[state=first]}, mean or last",
        "{drift:+.3g N} over the test",
    )
    FORCE_ZERO = _caution(
        "The zero of the force differed between records and was shifted",
        "zero the sensors before each record",
        "{shifts:+.3g N} in {records}",
    )
    GAPS = _caution(
        "Samples are missing where the time jumps, and reversals there are lost",
        "record again, or choose a part by {to[time_window]} or {to[cycles]}",
        ("{gaps:.6g s}", "and {more} more"),
    )
    CLIPPED = _caution(
        "The force stays at an extreme, as at the end of a sensor's range; those samples were left out",
        "repeat with a larger range",
        "{count} of {samples} samples",
    )
    DWELLS = _caution(
        "The force relaxes while the displacement rests; the dwells were left out, but the loops are lower for it",
        "record without dwells",
        "by {force:.3g N}",
    )
    TURNS_BETWEEN_SAMPLES = _caution(
        "Reversals fall between samples, which falsifies rho, sigma, n and the energy of small loops",
        "sample 100 times per cycle, more often at corners",
        "{samples:.0f} samples per cycle, {share:.2g %} of the force",
    )
    DISPLACEMENT_NOISE = _caution(
        "The displacement is noisy, which blurs reversals and knee, and rho, sigma, n with them",
        "take a finer resolution, or sample faster",
        "standard deviation {share:.2g %} of the range",
    )
    NO_STEADY_SECTION = _caution(
        "The strokes end before the hysteresis saturates, so sigma, n and the split between elastic and "
        "hysteretic force are uncertain",
        "record longer strokes",
        "omega reaches {omega:.2g}",
    )
    SIGMA_RAISED = _caution(
        "The paper's formula gave a sigma below 1/2, which no passive spring has; 1/2 was taken",
        "compare with {to[method=refined]}",
        "sigma {sigma:.3g}",
    )
    PAPER_DEGREES = _caution(
        "A degree is above 3, where the paper has usually less than 4",
        "lower {to[degrees]}, and compare with {to[method=refined]}",
        "degree {degree}",
    )
    SIGMA_AT_BOUND = _caution(
        "sigma ended at its bound, so these records show little of the recovery after a reversal",
        "sample the reversals more densely",
    )
    N_AT_BOUND = _caution(
        "n ended at its bound, so these records show little of the knee of the loop", "sample it more densely"
    )
    ONE_AMPLITUDE = _caution(
        "All loops have about one amplitude; the energy of smaller ones is extrapolated",
        "record loops of about a third of that amplitude too",
        _ENERGY,
    )
    INTERVAL_TOO_NARROW = _caution(
        "The 95 % prediction interval holds less than 90 % of the cycles left out",
        "expect cycles outside it, and compare the recorded ones",
        "{held:.0f %}",
    )
    AMPLIFIER_REDUCED = _note(
        "The amplifier FA of the wanted degree was not positive over the whole range; its degree was lowered "
        "until it was"
    )
    FIRST_CYCLE_DIFFERS = _note("The first cycle differs from the later ones and was left out")
    UNUSUAL_SIZES = _note(
        "Sizes are unusual for a rig",
        "check the units of displacement and force",
        (
            "amplitude {amplitude:.3g} m, usual are {usual_amplitude:g m}",
            "force amplitude {force:.3g} N, usual are {usual_force:g N}",
            "stiffness {stiffness:.3g} N/m, usual are {usual_stiffness:g N/m}",
            "{mistakes} would explain it",
        ),
    )
    UNKNOWN_MASS = _note(
        "1 kg between load cell and spring would change the stiffness by {share:.2g %} at {frequency:.2g Hz}",
        "give such a mass as {to[moving_mass]}",
    )
    UNKNOWN_FIXTURE = _note(
        "A fixture of 10 kN/mm would change the stiffness by {share:.2g %}",
        "give what yields as {to[fixture_stiffness]}",
    )
    RESTS_LEFT_OUT = _note(
        "Samples were left out, because the displacement rests there", details="{count} of {samples} samples"
    )
    TIME_RESTS = _note(
        "The time does not rise from sample to sample, so that neither a delay nor a viscous force was sought",
        "check {to[time]}, or record times with more digits",
        "at {count} of {steps} steps",
    )
    NEXT_TEST = _note("{to[plan()]} plans a test for: {open}")

    # Use of a model, and of records without and beside it
    NO_INTERVAL = _note(
        "The model holds no 95 % prediction interval", "identify the spring again with the refined method to have it"
    )
    NO_WHOLE_CYCLE = _caution(
        "The record holds no whole cycle", "record at least one, there and back", "strokes: {strokes}"
    )
    PARAMETERS_CHANGED = _caution(
        "Parameters lie outside their 95 % intervals in the same file, so they were changed after the identification, "
        "whose figures are not theirs",
        details="{parameters}",
    )
    OF_FILE = _caution("The identification stated {name}", details="{sentence}")
    OUTSIDE_RANGE = _caution(
        "Displacements lie outside the identified range, where the model is continued linearly",
        details=(
            "{share:.3g %} of the samples",
            "loop {loop:.6g mm}",
            "{count} of {points} frequencies",
            "{frequencies:.4g Hz}",
            "{runs} of {of} runs",
            "beyond {range:.6g mm}",
        ),
    )
    OTHER_AMPLITUDES = _caution(
        "Loops differ in amplitude from those that {model} was identified from, for which its 95 % prediction interval "
        "holds",
        details="{recorded:.3g mm}, not {known:.3g mm}",
    )
    OPEN_LOOP = _caution(
        "A loop does not close, as in a first loading",
        "record at least one cycle more",
        "{loop:.6g mm}, open by {gap:.2g %} of its height",
    )
    CLIPPED_BESIDE = _caution(
        "Forces at the end of the sensor's range are left out of the errors, and measured loops are too flat",
        details="{count} of {samples} samples",
    )
    RIG_REMOVED = _caution(
        "Effects of the rig were removed from the records of the model; records that hold them too differ by them",
        details="{effects}",
    )
    RELAXED_BRANCHES = _caution(
        "Loops of the model are slow, as its Maxwell branches have relaxed; at the recorded rates stiffness and energy "
        "are larger"
    )
    IDENTIFIED_WITH_CAUTIONS = _caution("{model} was identified with cautions ({cautions})", "see {to[info()]}")
    SPEED_REMOVED = _caution(
        "The records of {model} showed {effects}, removed from the model",
        "add a damper if that is the mount's and not the rig's",
    )

    # Comparison
    SAME_RECORD = _caution(
        "Both models were identified from the same record, so that their errors are not independent, as the verdict "
        "assumes",
    )
    RIGS_DIFFER = _caution(
        "Other effects of the rig were removed from A's records than from B's, and a difference may be the rigs'",
        details="{of_a}; {of_b}",
    )
    ZERO_MOVED = _caution(
        "The ranges of A and B have different middles",
        "align them with {to[align=middle]} if the zero was moved between the tests",
        "{distance:.4g mm} apart, loops differ by {apart:.2g %} of their height, from their middles by {aligned:.2g %}",
    )
    FORMS_DIFFER = _note(
        "A has {of_a}, B {of_b}; coefficients cannot be compared one by one, and a difference counts as far as it "
        "remains with {common} in both",
        "for more, identify both with {to[degrees]} alike",
    )
    SCATTER = _note(
        "The uncertainty is that of noise and misfit in the records, without what differs from test to test (mounting, "
        "temperature, drift of the sensors)",
        "repeat a test to see that",
    )

    # Planning
    VELOCITY_ASSUMED = _note(
        "The rig is assumed to reach {velocity:.3g mm/s}, {origin}", "give its largest by {to[velocity]}"
    )
    NARROWED = _note("The {limit} leaves {range:.4g mm}")
    WITHIN_MODEL = _note("The programme stays within the range that the model was identified in")
    ONE_RATE = _note("The limits leave no loops of another rate, by which rate dependence would be seen")

    # Batches
    COPIES = _caution(
        "The content is that of another file, which medians, scatter and outliers therefore count more than once"
    )
    NOT_LIKE_RECORDS = _note("Files not named like a record are left out", details="{count}, first {first}")
    GIVEN_TWICE = _note("Files are given more than once", details="{count}, first {first}")

    # Bodies on mounts: load cases
    LIMIT_NOT_TESTED = _caution(
        "The limit of {limit} is not tested: no load case is a {needed}", "simulate one, or leave it out"
    )
    RANGE_LEFT = _caution(
        "{axes} of {of} axes leave the identified range of their springs: all figures of this case are extrapolated",
        details="{axis} by {beyond:.3g mm} beyond {range:.4g mm}, where the model is continued linearly",
        measure="beyond",
    )
    STOPS = _caution(
        "{axes} of {of} axes bottom on a stop; the stops are elastic and lossless",
        details="{axis} by {deflection:.3g mm} with {force:.4g N}",
        measure="force",
    )
    SLIDING_TOGETHER = _caution(
        "In {mounts} of {of} mounts several axes slide at once; the ranges hold friction that acts together, and alone",
        details="{mount}: omega of the second axis swings by +-{swing:.2g} of saturation; records do not tell which; "
        "in a third of the draws it acts together, which changes acceleration by {acceleration:+.2g %} and sway by "
        "{sway:+.2g %} on average",
        measure="swing",
    )
    TILT = _caution(
        "{body} tilts by {tilt:.3g degrees}, more than {limit:.3g degrees}: mounts twist at such angles, which is left "
        "out",
        details="the rotation itself is exact; springs act along the axes of their supports",
        measure="tilt",
    )
    SPRING_SPEED = _caution(
        "Springs move by up to {speed:.3g m/s}",
        "compare the speed of their records, above all for rubber",
        "{axis}; the model is rate independent, and model files do not tell that speed",
        "speed",
    )
    HISTORIES_THINNED = _caution(
        "Histories keep every {every}th step only: what is faster than {frequency:.4g Hz} is folded in power spectra",
        "shorten the case to keep more",
        "{interval:.3g s} apart",
        "interval",
    )
    NO_SHOCK_SPECTRA = _caution(
        "No shock response spectra: the rows of the histories are {interval:.3g s} apart",
        "shorten the simulated time",
        measure="interval",
    )
    SHOCK_SPECTRA_END = _caution(
        "The shock response spectra end at {frequency:.4g Hz}, as the rows of the histories are {interval:.3g s} apart",
        "shorten the simulated time to see more",
        measure="interval",
    )
    NO_POWER_SPECTRA = _caution("No power spectra", details="{reason}")
    DILUTED = _caution(
        "Root mean squares are too low: they are taken up to {end:.4g s}, the load ends at {load_end:.4g s}",
        "leave simulate out of the case",
        measure="after",
    )
    FALL = _caution(
        "Sway, tilt and stroke are counted from the pose without weight, in which the fall ends", measure="speed"
    )
    FALL_SPEED = _caution("The fall ends at {speed:.4g m/s}", "check the unit of its height or velocity")
    PULSE_SPEED = _caution(
        "The pulse changes the velocity of the base by {speed:.4g m/s}",
        "check the units of peak (g or m/s^2) and duration (ms or s)",
    )
    LEVEL = _caution(
        "The {quantity} is {level:.4g g} ({level:.4g m/s^2}), outside the usual {usual:g g}", "check the unit of {key}"
    )
    BASE_TRAVEL = _caution(
        "The base would move by +-{travel:.3g m}",
        "check the units of the {quantity} and its frequency of {frequency:.4g Hz}",
    )
    GRAVITY_RECORDED = _caution(
        "The record of base acceleration holds gravity, which acts on the bodies already",
        "subtract it, and check which axis is vertical",
        "it begins at {first:.4g g} and has a median of {median:.4g g}",
    )
    BASE_OFFSET = _caution(
        "The record of base acceleration has an offset that would move the base by {drift:.3g m}",
        "subtract it if it is that of a sensor",
        "median {median:.4g g}, over {duration:.4g s}",
    )
    BASE_TURNS = _caution(
        "The base turns at up to {rate:.4g rad/s}", "check the unit of its column, which may be deg/s"
    )
    TURNING_OFFSET = _caution(
        "The angular velocity of the base has an offset that turns it by {angle:.0f degrees}",
        "subtract it if it is that of a sensor",
        "median {median:.3g rad/s}",
    )
    SAMPLED_SLOWLY = _caution(
        "The record is sampled {rate:.4g} times per second, with a lowest natural frequency of {frequency:.3g Hz}",
        "check the unit of its times (ms or s)",
        "it lasts {duration:.4g s}",
    )
    SAMPLED_FAST = _caution(
        "The record is sampled {rate:.3g} times per second and lasts {duration:.3g s}",
        "check the unit of its times (s or ms)",
    )
    PUSH = _caution(
        "The force of {force:.4g N} is {share:.3g} times the weight of its body of {mass:.4g kg}",
        "check both units (N or kN, kg or g)",
    )
    PULSE_DURATION = _caution(
        "The pulse lasts {duration:.4g s}", "check the unit of duration, in which ms and s differ"
    )
    SHORT_RANDOM = _caution(
        "Random vibration is taken over {periods:.2g} periods of the lowest natural frequency: its figures depend on "
        "chance",
        "let it last {factor:.2g} times as long",
        "{duration:.3g s}",
    )
    FALL_UPWARD = _caution(
        "The fall goes against gravity, which slows the bodies",
        "reverse its direction, or turn gravity if the system falls on its top",
    )
    SWING_APART = _caution(
        "{axes} axes of mounts with catalogue values swing by less than half or more than twice the amplitude of these",
        details="{axis} by +-{swing:.3g mm} instead of +-{stated:.3g mm}, where a stiffness of {stiffness:.4g N/mm} "
        "and a loss factor of {loss_factor:.2g} are assumed",
        measure="factor",
    )

    # Bodies on mounts: descriptions
    OVERLOADED = _caution(
        "{axes} of {of} axes with a rated static load rest under more",
        "use more or larger mounts",
        "{axis} under {force:.4g N} of {rated:.4g N}",
    )
    MOUNTS_FAR = _caution(
        "The mounts of {body} are {reach:.4g m} from its centre of gravity",
        "check the units of place and center (mm or m)",
    )
    PLACE_FAR = _caution(
        "{place} is {distance:.4g m} from the centre of gravity of {body}, the mounts {reach:.4g m}",
        "check the unit of its place (mm or m)",
    )
    GYRATION = _caution(
        "{body} has a radius of gyration of {radius:.4g m}, with mounts {reach:.4g m} from its centre of gravity",
        "check the units of inertia and mass",
        "{inertia:.4g kg m^2} and {mass:.4g kg}; some {usual:.2g kg m^2} are usual there; inertia may be in kg mm^2, "
        "kg cm^2 or lb in^2",
    )
    STATIC_LOAD = _caution(
        "{mass:.4g kg} with {body} take {share:.2g %} of the force that the mounts below can hold",
        "check the unit of mass (g, kg or t)",
        "{weight:.3g N} of {held:.3g N} along gravity within the identified range",
    )
    NATURAL_FREQUENCY = _caution(
        "A natural frequency of {frequency:.3g Hz} is outside {usual:g Hz}",
        "check the units of mass, inertia and the model files",
        "bodies vibrate within these on mounts: masses or moments of inertia are far too {size} for these springs",
    )
    PULLED = _caution(
        "The weight of {body} pulls {axis}, which by its name is compressed as the displacement grows",
        "reverse its direction if the body stands on it",
    )
    COINCIDENT = _caution(
        "Mounts {first} and {second} act at one place along the same direction",
        "correct the place of one, or use parallel if there are two",
    )
    OVERDAMPED = _caution(
        "Dampers give a motion of {frequency:.3g Hz} a damping ratio of {ratio:.3g}: it creeps back",
        "check the unit of damping (N s/m or kN s/m)",
    )
    FEW_AXES = _caution(
        "{few} of {of} mounts have fewer than three axes: across them they have neither stiffness nor friction",
        "add axes with a shear record",
        "{mounts}",
    )
    NO_MOMENTS = _caution(
        "Mounts act on points, without resistance to rotation of their own (roll, twist): real tilt is smaller where "
        "they stand close together"
    )
    SHARED_MODEL = _caution(
        "{model} stands for perpendicular axes of the same mount",
        "check that the mount is alike along them",
        "{mounts}; a model file does not say along which axis it was measured",
    )
    CATALOGUE = _caution(
        "No loops stand behind {source}: away from their amplitudes, speed and temperature, stiffness and damping are "
        "assumed",
        "keep a margin, or record loops",
        "{direction} is stated at +-{amplitude:.4g mm}, and has {stiffness:.4g N/mm} in small motion and friction of "
        "+-{friction:.4g N}",
    )
    TAKEN_AS_KNOWN = _caution("{model} is taken as known in all draws", details="{reason}")
    NO_MODES = _caution("No {kind} modes", details="{reason}")

    # Steady vibration and studies of it
    CURVE_FOLDS = _caution(
        "The curve folds: motions between folds are unstable, and the motion jumps there",
        "a little damping removes folds far below the resonance",
        "{motions} motions; folds far below the resonance are superharmonics",
    )
    SECOND_ORDER = _caution(
        "Bodies turn by up to {tilt:.3g degrees}, kept to the second order: the exact equations differ",
        "simulate this level in time",
        "at {frequency:.4g Hz} acceleration by {acceleration:.2g %}, sway by {sway:.2g %}",
    )
    NO_EXACT_MOTION = _caution(
        "Bodies turn by up to {tilt:.3g degrees}, kept to the second order: the exact equations have no such motion",
        "simulate this level in time",
        "{frequency:.4g Hz}",
    )
    SLIDING_ALONE = _caution(
        "Several axes of {mount} slide at once, and their friction does not act together here",
        "simulate a sine of this level, whose ranges hold both",
    )
    PEAK_AT_END = _note("The peak is at an end of the band", "widen {to[band]}", "in {runs} of {of} runs")

    @property
    def severity(self) -> Severity:
        """How much it matters."""
        return self.value.severity

    @property
    def is_settled_by_a_test(self) -> bool:
        """Whether it is about what the records do not hold, and those of a planned test would."""
        return self.name in (
            "RANGE_WITH_GAPS", "SMALL_LOOPS", "RATE_OPEN", "N_AT_BOUND", "ONE_AMPLITUDE",
        )  # fmt: skip


_ORDER = {kind: place for place, kind in enumerate(Outcome)}


@dataclass(frozen=True)
class Finding:
    """Something that is to be known.

    Attributes
    ----------
    kind : Outcome
    numbers : mapping    What its words are made of: numbers in SI units, names, and sequences of these, see `worded`.
    where : str          The record, model or case; "" for all.
    """

    kind: Outcome
    numbers: Mapping[str, Any] = field(default_factory=dict)
    where: str = ""

    @property
    def name(self) -> str:
        """The name of the kind in files."""
        return self.kind.name.lower()

    @property
    def is_complete(self) -> bool:
        """Whether its sentence has all its numbers; one that was read from a file may not."""
        kind = self.kind.value
        is_measured = not kind.measure or isinstance(self.numbers.get(kind.measure), int | float)
        return is_measured and _are_known(kind.sentence + kind.remedy, self.numbers)

    @property
    def in_folder(self) -> Finding:
        """The same with the name of the file only."""
        return replace(self, where=PurePath(self.where).name)

    def as_json(self) -> dict[str, Any]:
        """The finding as an object for JSON, with its sentence."""
        sentence = words(self, Reader.FILE)
        return {"name": self.name, "sentence": sentence, "numbers": dict(self.numbers), "where": self.where}


def of_severity(findings: Iterable[Finding], severities: Container[Severity]) -> tuple[Finding, ...]:
    """The findings that matter so much, in the order of `Outcome`."""
    return by_harm(finding for finding in findings if finding.kind.severity in severities)


def by_harm(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Findings in the order of `Outcome`."""
    return tuple(sorted(findings, key=lambda finding: _ORDER[finding.kind]))


def words(finding: Finding, reader: Reader, brief: bool = False) -> str:
    """A finding as a sentence: where it is, what it is, what to do, and its numbers.

    Parameters
    ----------
    finding : Finding
    reader : Reader
    brief : bool     Leave out the numbers, unless all is short.

    Examples
    --------
    >>> words(Finding(Outcome.DELAY, {"delay": 2e-3}, "a.csv"), Reader.COMMAND_LINE)
    'a.csv: Force and displacement were not measured at the same moments; the delay was taken out; check it, and give \
it as --delay. (2 ms)'
    """
    return next(gathered([finding], reader, brief))


def gathered(findings: Iterable[Finding], reader: Reader, brief: bool = False) -> Iterator[str]:
    """Findings as sentences in the order of `Outcome`; those that differ only in place and details are one, and of a
    kind with a measure the worst stands for all.

    Examples
    --------
    >>> units = {"displacement": "mm", "force": "N"}.items()
    >>> found = [Finding(Outcome.UNIT_ASSUMED, {"quantity": name, "unit": unit}, "a.csv") for name, unit in units]
    >>> list(gathered(found, Reader.PYTHON))
    ['a.csv: The unit is assumed, as none is given. (displacement in mm; force in N)']
    >>> found = [Finding(Outcome.SPRING_SPEED, {"speed": k, "axis": "z"}, f"case {k}") for k in (1, 3, 2)]
    >>> next(gathered(found, Reader.PYTHON, brief=True))
    'case 3 and 2 others: Springs move by up to 3 m/s; compare the speed of their records, above all for rubber.'
    """
    alike: dict[tuple[Outcome, str], dict[str, dict[str, None]]] = {}
    for finding in _worst(findings, reader):
        places = alike.setdefault((finding.kind, advised(finding, reader)), {})
        places.setdefault(finding.where, {})[detailed(finding.kind, finding.numbers, reader)] = None
    for (_, sentence), places in alike.items():
        named = list(filter(None, places))
        where = "; ".join(named) if len(named) <= _NAMED else f"{named[0]} and {len(named) - 1} others"
        same: dict[str, list[str]] = {}
        for place, parts in places.items():
            same.setdefault("; ".join(filter(None, parts)), []).append(place)
        is_said = len(named) <= _NAMED and len(same) == 1
        pairs = [("" if is_said else ", ".join(filter(None, of)), text) for text, of in same.items()]
        details = "; ".join(": ".join(filter(None, pair)) for pair in pairs if any(pair))
        text = f"{where}: {sentence}" if where else sentence
        whole = f"{text} ({details})" if details else text
        yield text if brief and len(whole.split()) > _WORDS else whole


def _worst(findings: Iterable[Finding], reader: Reader) -> Iterator[Finding]:
    """Findings in the order of `Outcome`, of kinds with a measure the worst, and in how many places others are."""
    for kind, group in groupby(by_harm(findings), lambda finding: finding.kind):
        of_kind = list(group)
        if measure := kind.value.measure:
            worst = max(of_kind, key=lambda finding: finding.numbers[measure])
            others = tuple(dict.fromkeys(finding.where for finding in of_kind if finding.where != worst.where))
            more = f" and {len(others)} other{'s' if len(others) > 1 else ''}" if others else ""
            listed = {"others": others} if reader is Reader.FILE else {}
            of_kind = [replace(worst, numbers={**worst.numbers, **listed}, where=f"{worst.where}{more}")]
        yield from of_kind


def advised(finding: Finding, reader: Reader) -> str:
    """What is found and what to do, without place and numbers in parentheses."""
    kind = finding.kind.value
    return f"{'; '.join(worded(text, finding.numbers, reader) for text in (kind.sentence, kind.remedy) if text)}."


def detailed(kind: Outcome, numbers: Mapping[str, Any], reader: Reader) -> str:
    """The numbers of a finding in words."""
    details = kind.value.details
    parts = (details,) if isinstance(details, str) else details
    parts = (*parts, "less so in {others}") if kind.value.measure else parts
    return ", ".join(worded(part, numbers, reader) for part in parts if part and _are_known(part, numbers))


def _are_known(template: str, numbers: Mapping[str, Any]) -> bool:
    names = (name for _, name, _, _ in Formatter().parse(template) if name and not name.startswith("to["))
    values = map(numbers.get, names)
    return not any(value is None or (isinstance(value, str | list | tuple) and not value) for value in values)


class IdentificationError(StrandspringError):
    """The records cannot be described by a physically possible model.

    Parameters
    ----------
    kind : Outcome          Why.
    where : str             The record.
    numbers : mapping       Of the finding.
    beside : sequence of Finding   More records of the kind, and what may have caused it.

    Attributes
    ----------
    outcome : Outcome
    findings : tuple of Finding
    """

    def __init__(
        self, kind: Outcome, where: str = "", numbers: Mapping[str, Any] | None = None, beside: Iterable[Finding] = ()
    ) -> None:
        self.outcome, self.findings = kind, (Finding(kind, numbers or {}, where), *beside)
        super().__init__(kind.value.sentence)

    def words(self, reader: Reader) -> str:
        """Why, and what may have caused it, for a reader."""
        return " ".join(gathered(self.findings, reader))

    def __reduce__(self) -> tuple[Any, ...]:
        first, *beside = self.findings
        return type(self), (self.outcome, first.where, first.numbers, beside)
