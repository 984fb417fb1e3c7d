"""Load cases as standards state them: slopes, overall levels, axes at once, sines on random, spectra."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

from strandspring.errors import MountedSystemError
from strandspring.examples.system_models import SYSTEMS
from strandspring.ground.gravity import STANDARD_GRAVITY
from strandspring.vibration.bodies.loads import LoadCase
from strandspring.vibration.bodies.simulation import simulate_case
from strandspring.vibration.description.named_files import FilesOfFolder
from strandspring.vibration.description.system_file import SystemFile, read_description, system_of_content

G = STANDARD_GRAVITY
CONTENT = read_description(SYSTEMS / "electronics_box.toml")
# As printed: +3 dB/oct from 20 to 80 Hz, 0.04 g^2/Hz up to 350 Hz, -3 dB/oct up to 2000 Hz.
PRINTED = [["20 Hz", "+3 dB/oct"], ["80 Hz", "0.04 g^2/Hz"], ["350 Hz", "0.04 g^2/Hz"], [2000, "-3 dB/oct"]]
FLAT = [[20, "0.01 g^2/Hz"], [200, "0.01 g^2/Hz"]]


def file_of(**keys: Any) -> SystemFile:
    return system_of_content({**copy.deepcopy(CONTENT), "case": [{"name": "c", **keys}]}, FilesOfFolder(SYSTEMS))


def case_of(**keys: Any) -> LoadCase:
    (case,) = file_of(**keys).cases
    return case


def random(direction: str | None = "z", **keys: Any) -> dict[str, Any]:
    along = {} if direction is None else {"direction": direction}
    return {**along, "random": {"psd": FLAT, "duration": "5 s", **keys}}


def test_slopes_lead_to_the_levels_beside_them() -> None:
    case = case_of(**random(psd=PRINTED, grms="6.06 g"))
    density = case.channels[0].signal.density

    def level(f: float) -> float:
        # 3 dB are a factor 10^0.3 in power.
        way = 0.3 * math.log2(f / 80.0) if f < 80.0 else -0.3 * math.log2(max(f / 350.0, 1.0))
        return 0.04 * 10.0**way

    assert density.at([20.0, 40.0, 2000.0]) / G**2 == pytest.approx(
        [level(20.0), level(40.0), level(2000.0)], rel=1e-12
    )
    power = sum(quad(level, low, high)[0] for low, high in ((20.0, 80.0), (80.0, 350.0), (350.0, 2000.0)))
    assert f"{math.sqrt(power):.4g} g (6.06 g stated) rms" in case.text
    amplitudes = [["10 Hz", "+6 dB/oct"], ["40 Hz", "8 g"], ["80 Hz", "8 g"]]
    sweep = case_of(direction="z", sweep={"first": 10, "last": 80, "rate": "4 oct/min", "table": amplitudes})
    # 6 dB are a factor 10^0.3 in amplitude.
    assert sweep.channels[0].signal.amplitude.at(20.0) / G == pytest.approx(8.0 / 10.0**0.3, rel=1e-12)


def test_axes_at_once_are_uncorrelated_and_have_their_own_density() -> None:
    psd = {"x": FLAT, "y": [[20, "0.04 g^2/Hz"], [200, "0.04 g^2/Hz"]], "z": PRINTED}
    case = case_of(**random(None, psd=psd, duration="60 s", grms={"z": "6.06 g"}))
    assert [channel.direction for channel in case.channels] == [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    assert "x 1.342 g and y 2.683 g and z 6.06" in case.text
    values = np.array([channel.signal.averages(1e-4, 600_000) for channel in case.channels])
    # 180 Hz for 60 s are some 2e4 independent values.
    assert np.abs(np.corrcoef(values) - np.eye(3)).max() < 0.04
    frequency, density = welch(values[1] / G, 1e4, nperseg=5000)
    inside = (frequency > 30.0) & (frequency < 190.0)
    assert density[inside].mean() == pytest.approx(0.04, rel=0.02)  # 80 lines of 240 averages: 0.7 %


def test_sines_stand_on_random_vibration() -> None:
    tones = [{"frequency": 60, "amplitude": "3 g"}, {"first": 100, "last": 150, "amplitude": "2 g"}]
    case = case_of(**random(sine=tones, duration="20 s"))
    assert case.text.startswith(
        "random vibration of 1.342 g rms from 20 to 200 Hz for 20 s, with sines of 3 g at 60 Hz"
    )
    assert "2 g from 100 to 150 Hz along +z" in case.text.replace("along z", "along +z")
    assert all(channel.direction == (0.0, 0.0, 1.0) for channel in case.channels)
    total = case.averages(1e-4, 200_000).sum(axis=0) / G
    # Random and sines are independent: powers add. Scatter of the random part: 1/(2*sqrt(180*20)) of it.
    assert np.mean(total**2) == pytest.approx(1.8 + 0.5 * 9.0 + 0.5 * 4.0, rel=0.02)
    dft = 2.0 * abs(np.mean(total * np.exp(-2j * np.pi * 60.0 * 1e-4 * (np.arange(200_000) + 0.5))))
    assert dft == pytest.approx(3.0, rel=0.03)  # noise of sqrt(4*0.01/20) g


def test_a_shock_by_its_spectrum_states_its_fit() -> None:
    srs = {"levels": [[10, "+6 dB/oct"], [40, "20 g"], [500, "20 g"]], "q": 25, "duration": "300 ms"}
    case = case_of(direction="z", srs=srs)
    assert "from 10 to 500 Hz at Q = 25, synthesized by 69 wavelets in 0.3 s with a peak of" in case.text
    assert case.text.startswith("shock within -")
    assert case.kind == "srs"
    del srs["q"]
    damped = case_of(direction="z", srs=srs | {"damping": 0.02})
    assert damped.channels[0].signal is case.channels[0].signal


def test_constant_acceleration_gives_the_static_answer() -> None:
    """The box of which springs are known: force equals mass times level, and nothing moves at its end."""
    file = file_of(direction="x", acceleration={"level": "2 g"})
    system, (case,) = file.candidates[0][1], file.cases
    figures = simulate_case(system, case).figures
    # The board accelerates with the base: 2 g along x and 1 g against gravity are not in it, as it is absolute.
    assert figures.acceleration.max() / G == pytest.approx(2.0, rel=0.01)  # what a rise of ten periods leaves
    shearing = [abs(axis.direction[0]) > 0.5 for axis in system.axes]
    forces = figures.force.ravel()[shearing]
    assert forces.sum() == pytest.approx(20.0 * 2.0 * G, rel=0.03)  # of four mounts that tilt a little
    assert "constant acceleration of 2 g, reached within" in case.text


BAD = [
    (random(grms="9 g"), r"case\[1\].random: the density has 1.342 g rms, and `grms` states 9 g; correct"),
    (random(psd=[[20, "3 dB/oct"], [80, "-3 dB/oct"]]), "psd: .*must have a level in one row or more, got slopes"),
    (random(psd=[[9, "1 g^2/Hz"], [20, "3 dB/oct"], [80, "1 g^2/Hz"]]), "entry 2 has one; give its level"),
    (random(psd=[[0, "3 dB/oct"], [80, "1 g^2/Hz"]]), "at frequencies > 0, but entry 1 has one"),
    (random(None), "must have `direction`, such as '.x'"),
    (random(psd={"x": FLAT}), "must have no direction where"),
    (random(None, psd={"q": FLAT}), "psd"),
    (random(None, psd={"x": FLAT}, grms="1.34 g"), "`grms` must be one level where `psd` is one density"),
    (random(None, psd={"x": FLAT}, sine=[{"frequency": 9, "amplitude": "1 g"}]), "`sine` is for random vib"),
    (random(sine=[{"amplitude": "1 g"}]), r"random.sine\[1\]: must have either `frequency`, or `first` and `last`"),
    ({"direction": "z", "srs": {"levels": FLAT, "duration": "1 s"}}, "levels: .*must be an acceleration"),
    (
        {"direction": "z", "srs": {"levels": [[9, "1 g"], [99, "1 g"]], "duration": "1 s", "q": 9, "damping": 0.05}},
        "must have either `q` or `damping`, got both",
    ),
    ({"direction": "z", "acceleration": {"level": "2 g", "rise": "2 s", "duration": "1 s"}}, "rise of a constant"),
]  # fmt: skip


@pytest.mark.parametrize(("keys", "refusal"), BAD, ids=[refusal[-40:] for _, refusal in BAD])
def test_what_does_not_fit_together(keys: dict[str, Any], refusal: str) -> None:
    with pytest.raises(MountedSystemError, match=refusal) as caught:
        case_of(**keys)
    assert str(caught.value).endswith(".")
