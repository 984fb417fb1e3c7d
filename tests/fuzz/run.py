"""All fuzz targets for a time: python tests/fuzz/run.py [--hours H | --minutes M] [--only TARGET | --scripts]

Each target first judges its files of past findings (corpus/), and then random trials for its share of the time. The
Python targets are the scripts in targets/; those that begin with "fmi" are random calls of FMI against the C sources
under sanitizers (fmi/, built by tests/helpers/fuzzing.py). A failure is printed with the command that repeats it, and
the exit status is 1; keep its file in the corpus.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = map(str, (HERE, HERE / "targets", HERE.parent / "helpers"))

import fuzzing  # noqa: E402
import harness  # noqa: E402
from seeds import SEED  # noqa: E402

SCRIPTS = (
    "corners", "identify", "journals", "models", "models_fmus", "options", "records_binary", "records_descriptions",
    "records_text", "systems",
)  # fmt: skip
FORMS = {f"fmi-{form}": form for form in fuzzing.FORMS}
TARGETS = (*SCRIPTS, *FORMS)
_ENDLESS = 10**9
_SEQUENCES = 500  # of FMI calls between two looks at the clock: some seconds


def corpus_of(target: str) -> list[Path]:
    """The files of past findings of a target."""
    return sorted((HERE / "corpus" / target).glob("*"))


def script_of(target: str) -> Path:
    """The script of a target in Python."""
    return HERE / "targets" / f"{target}.py"


def run(target: str, seconds: float, seed: int) -> tuple[int, int]:
    """Run a target for a time; returns the number of trials and of failures, which are printed."""
    if target in FORMS:
        return _run_calls(FORMS[target], seconds, seed)
    reports = [harness.run(script_of(target), 1, 1, files=corpus_of(target))] if corpus_of(target) else []
    reports.append(harness.run(script_of(target), seed, _ENDLESS, seconds=seconds))
    return sum(sum(report.outcomes.values()) for report in reports), sum(len(report.failures) for report in reports)


def _run_calls(form: str, seconds: float, seed: int) -> tuple[int, int]:
    with tempfile.TemporaryDirectory(prefix="strandspring-fuzz-") as folder:
        program = fuzzing.program_of(form, Path(folder))
        deadline, done = time.monotonic() + seconds, 0
        while True:
            outcome = fuzzing.run(program, seed + done // fuzzing.RUN, _SEQUENCES)
            done += _SEQUENCES
            if outcome.found:
                print(
                    f"FAILURE in {form}, seeds from {seed + (done - _SEQUENCES) // fuzzing.RUN} on:\n{outcome.found}",
                    flush=True,
                )
                return done, 1
            if time.monotonic() > deadline:
                return done, 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--hours", type=float, default=0.0)
    length.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--only", choices=TARGETS, action="append")
    parser.add_argument("--scripts", action="store_true", help="the targets in Python alone")
    parser.add_argument("--seed", type=int, help="of the first trial; from the commit's hash by default")
    given = parser.parse_args()
    targets = given.only or (SCRIPTS if given.scripts else TARGETS)
    seed = SEED if given.seed is None else given.seed
    print(f"seed {seed}", flush=True)
    share = (3600.0 * given.hours or 60.0 * given.minutes) / len(targets)
    results = {target: run(target, share, seed) for target in targets}
    for target, (trials, failures) in results.items():
        print(f"{target:22} {trials:9} trials {failures:5} failures")
    return int(any(failures for _, failures in results.values()))


if __name__ == "__main__":
    sys.exit(main())
