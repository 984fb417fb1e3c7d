"""Identifications for the tests of reports, each made once."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np

from strandspring import Identification, Record, RefinedOptions, TwoStageOptions, identify, read_record
from synthetic import MEAN, record_of, spring_of

ROOT = Path(__file__).resolve().parents[2]
RTL, EMOJI = "\N{RIGHT-TO-LEFT OVERRIDE}\N{HEBREW LETTER ALEF}\N{HEBREW LETTER BET}", "\N{GRINNING FACE}"
HOSTILE = f"</script><script>alert(1)</script>&\"'`{{{{x}}}}$_$ {RTL} {EMOJI} {{#}} #let [*b*]"
FOLDER = "/srv/secret/customer"


def sine_record(name: str, frequency: float, amplitude: float, seed: int) -> Record:
    """Four cycles of a known spring with 2 % of noise."""
    t = np.arange(1201) / (300.0 * frequency)
    record = record_of(spring_of(0.6, 1.5), MEAN + amplitude * np.sin(2.0 * np.pi * frequency * t), 0.02, seed)
    return replace(record, time=t, path=f"{FOLDER}/{name}")


@functools.cache
def hinge() -> Identification:
    """The bundled record."""
    return identify(read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement"))


@functools.cache
def campaign() -> Identification:
    """Two amplitudes at two frequencies, in files of one name."""
    return identify(
        [sine_record("a/loop.csv", 0.5, 0.02, 1), sine_record("b/loop.csv", 2.0, 0.008, 2)], RefinedOptions((3, 2))
    )


@functools.cache
def hostile() -> Identification:
    """Records with names that break what is not escaped; one has no times."""
    names = ("x$_$y.csv", HOSTILE.replace("/", "\N{FRACTION SLASH}"), "n" * 200 + ".csv")
    records = [sine_record(name, 1.0, 0.02 - 0.005 * k, k) for k, name in enumerate(names)]
    return identify([replace(records[0], time=None), *records[1:]], RefinedOptions((3, 2)))


@functools.cache
def plain() -> Identification:
    """By a method that knows no uncertainty."""
    return identify(sine_record("plain.csv", 0.5, 0.02, 3), TwoStageOptions())
