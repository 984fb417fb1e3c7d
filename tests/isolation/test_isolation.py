"""Harmonic balance: textbook systems, folds, figures, refusals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shaken import shaken
from springs import MOUNT
from strandspring import Spring, SpringParameters
from strandspring.kernel.balance import BalancedSystem
from strandspring.model.conversions import NormalizedBoucWen
from strandspring.peers.ni import PAPER_NI
from strandspring.vibration.one_mass.harmonic_balance import largest_of_period
from strandspring.vibration.one_mass.response import FrequencyResponse, frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, IsolationError, static_equilibrium
from verlet import Verlet

ROOT = Path(__file__).resolve().parents[2]
FORCES = {
    Excitation.BASE_DISPLACEMENT: 1e-3,
    Excitation.BASE_ACCELERATION: 2.0,
    Excitation.FORCE: 3.0,
}


@pytest.mark.parametrize("excitation", list(Excitation))
def test_a_linear_spring_is_the_textbook(excitation: Excitation) -> None:
    spring = SpringParameters((0.0, 2000.0), (1.0,), 1e-9, 100.0, 1.0, 1.0, 0.0, -1.0, 1.0)
    system = IsolatedMass(spring, 2.0, load=0.0, parallel=3, series=2, damping=12.0)
    stiffness = 2000.0 * 3 / 2
    level = FORCES[excitation]
    found = frequency_response(system, excitation, level, np.geomspace(0.5, 40.0, 40))
    wanted = found.column("requested") > 0.0
    assert wanted.sum() == 40
    circular = 2.0 * np.pi * found.column("frequency")
    dynamic = stiffness - 2.0 * circular**2 + 12.0j * circular
    transmissibility = (stiffness + 12.0j * circular) / dynamic
    relative = 1.0 / dynamic if excitation is Excitation.FORCE else 2.0 * circular**2 / dynamic
    assert found.column("transmissibility") == pytest.approx(np.abs(transmissibility), rel=1e-6)
    assert found.column("relative") == pytest.approx(np.abs(relative), rel=1e-6)
    for name, expected in (("phase", transmissibility), ("relative_phase", relative)):
        off = (found.column(name) - np.degrees(np.angle(expected)) + 180.0) % 360.0 - 180.0
        assert np.abs(off).max() < 1e-4, name  # degrees; 1e-6 of a radian
    resonance = found.resonance
    assert resonance.stiffness == pytest.approx(stiffness, rel=1e-6)
    assert resonance.loss_factor == pytest.approx(12.0 * 2.0 * np.pi * resonance.frequency / stiffness, rel=1e-6)
    # Textbook: isolation begins at sqrt(2) of the undamped natural frequency; between points that are 12 % apart
    # damping makes the difference.
    assert resonance.isolation_frequency == pytest.approx(np.sqrt(2.0 * stiffness / 2.0) / (2.0 * np.pi), rel=3e-4)


def test_time_stepping_in_c_arrives_at_the_same_motion() -> None:
    """The baseline of `tests/benchmarks/isolation.py`; its 512 steps a period err by 6e-5 and 0.003 degrees there."""
    system = IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0)
    stepping = Verlet(system)
    for point in frequency_response(system, Excitation.BASE_DISPLACEMENT, 6e-4, np.array([4.0, 8.0, 25.0])).points:
        if point.requested:
            stepped = stepping.run(6e-4, point.frequency)
            assert point.amplitude == pytest.approx(stepped.amplitude, rel=2e-4)
            assert point.relative_phase == pytest.approx(np.degrees(np.angle(stepped.relative)), abs=0.02)


@pytest.mark.parametrize("excitation", [Excitation.BASE_DISPLACEMENT, Excitation.FORCE])
def test_mounts_of_several_springs_are_scaled_ones(excitation: Excitation) -> None:
    """P rows of S springs: P/S the stiffness, S the stroke; so mass, load and damping by P/S, levels by S or P."""
    band = np.geomspace(4.0, 30.0, 15)
    level = 4e-4 if excitation is Excitation.BASE_DISPLACEMENT else 8.0
    one = frequency_response(IsolatedMass(MOUNT, 5.0, 50.0, damping=6.0), excitation, level, band)
    parallel, series = 6, 2
    ratio = parallel / series
    many_level = level * (series if excitation is Excitation.BASE_DISPLACEMENT else parallel)
    many = frequency_response(
        IsolatedMass(MOUNT, 5.0 * ratio, 50.0 * parallel, parallel, series, 6.0 * ratio), excitation, many_level, band
    )
    assert many.column("transmissibility") == pytest.approx(one.column("transmissibility"), rel=1e-7)
    assert many.column("amplitude") == pytest.approx(series * one.column("amplitude"), rel=1e-7)
    assert many.column("mean") == pytest.approx(one.column("mean"), rel=1e-7)
    assert many.column("force") == pytest.approx(parallel * one.column("force"), rel=1e-7)


def test_excitations_of_the_same_strength_move_the_mass_alike() -> None:
    frequency = 9.0
    circular = 2.0 * np.pi * frequency
    system = IsolatedMass(MOUNT, 5.0, 50.0)
    band = [frequency, 10.0]
    levels = {
        Excitation.BASE_DISPLACEMENT: 5e-4,
        Excitation.BASE_ACCELERATION: 5e-4 * circular**2,
        Excitation.FORCE: 5.0 * 5e-4 * circular**2,
    }
    points = [frequency_response(system, kind, level, band).points[0] for kind, level in levels.items()]
    assert points[1].amplitude == pytest.approx(points[0].amplitude, rel=1e-8)
    assert points[2].amplitude == pytest.approx(points[0].amplitude, rel=1e-8)
    assert points[1].transmissibility == pytest.approx(points[0].transmissibility, rel=1e-8)
    assert points[1].phase == pytest.approx(points[0].phase, abs=1e-6)


def test_the_papers_normalized_spring_softens_and_damps_more_as_the_level_grows() -> None:
    ni = PAPER_NI
    plain = NormalizedBoucWen(1e3 * ni.K1, ni.z0, 1e3 * ni.rho, ni.sigma, ni.n)
    system = IsolatedMass(plain.to_parameters(-0.05, 0.05), 5.0, load=0.0)
    band = np.geomspace(8.0, 60.0, 80)
    found = [
        frequency_response(system, Excitation.BASE_DISPLACEMENT, level, band).resonance
        for level in (1e-6, 1e-5, 1e-4, 5e-4)
    ]
    for quantity, falls in (("frequency", True), ("stiffness", True), ("loss_factor", False), ("amplitude", False)):
        values = [getattr(one, quantity) for one in found]
        assert values == sorted(values, reverse=falls), quantity
    # From all of kappa_x + rho*kappa_omega towards kappa_x.
    assert found[0].stiffness > 0.8 * (plain.kappa_x + plain.rho * plain.kappa_omega)
    assert found[-1].stiffness < 0.5 * (plain.kappa_x + plain.rho * plain.kappa_omega)
    for one in found:
        # A resonance of loss factor eta amplifies by sqrt(1 + 1/eta^2), of a linear spring exactly.
        assert one.transmissibility == pytest.approx(np.hypot(1.0, 1.0 / one.loss_factor), rel=0.15)


def folded() -> FrequencyResponse:
    """A hardening mount shaken so hard that its resonance leans over."""
    system = IsolatedMass(MOUNT, 5.1, damping=20.0)
    band = np.geomspace(5.0, 25.0, 100)
    return frequency_response(system, Excitation.BASE_DISPLACEMENT, 2e-3, band, extrapolate=True)


def test_the_curve_is_followed_through_folds() -> None:
    found = folded()
    frequency, stable = found.column("frequency"), found.column("stable") > 0.0
    assert not stable.all()
    # Rising, back between the folds, rising again; neighbours on the curve are near each other.
    direction = np.sign(np.diff(frequency))
    assert np.count_nonzero(np.diff(direction)) == 2
    unstable = frequency[~stable]
    three = (frequency > unstable.min()) & (frequency < unstable.max()) & (found.column("requested") > 0.0)
    values, counts = np.unique(frequency[three], return_counts=True)
    assert values.size >= 3
    assert (counts == 3).mean() > 0.6  # next to a fold one of the three may be missed
    amplitude = found.column("amplitude")
    assert np.abs(np.diff(np.log(amplitude))).max() < 0.6
    assert found.resonance.frequency == pytest.approx(unstable.max(), rel=0.01)


def test_every_wanted_frequency_is_there_once_without_folds() -> None:
    band = np.geomspace(3.0, 40.0, 60)
    found = frequency_response(IsolatedMass(MOUNT, 5.0, 50.0), Excitation.BASE_DISPLACEMENT, 5e-4, band)
    assert found.column("frequency")[found.column("requested") > 0.0] == pytest.approx(band, rel=1e-12)
    peak = found.resonance
    near = frequency_response(
        IsolatedMass(MOUNT, 5.0, 50.0),
        Excitation.BASE_DISPLACEMENT,
        5e-4,
        np.linspace(0.97 * peak.frequency, 1.03 * peak.frequency, 201),
    )
    # The peak is found between the points of the band.
    assert peak.transmissibility == pytest.approx(near.column("transmissibility").max(), rel=1e-4)


@pytest.mark.slow
def test_more_harmonics_and_samples_change_little() -> None:
    system, band = IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0), np.geomspace(3.0, 30.0, 12)
    few, many = (
        frequency_response(system, Excitation.BASE_DISPLACEMENT, 1e-3, band, harmonics=h, samples=k)
        for h, k in ((11, 256), (31, 1024))
    )
    first, second = (
        r.column("transmissibility")[r.column("requested") > 0.0] for r in (few, many)
    )  # fmt: skip
    # What 11 harmonics leave out is below a thousandth; the mark is 0.5 %.
    assert first == pytest.approx(second, rel=1e-3)


def test_the_rest_carries_the_load() -> None:
    system = IsolatedMass(MOUNT, 6.0, parallel=2, series=3)
    rest = static_equilibrium(system)
    each = 6.0 * 9.80665 / 2
    x = rest.displacement - MOUNT.displacement_offset
    assert 50.0 + 20_000.0 * x + 1e5 * x**2 + 2e7 * x**3 == pytest.approx(each, abs=1e-3)  # between grid points
    assert rest.min < rest.displacement < rest.max
    # Loaded slowly up to the load and down to it from above, the spring stays within the band.
    low, high = rest.min, rest.max
    loaded = Spring(MOUNT).response([0.02, low])[-1]
    unloaded = Spring(MOUNT).response([0.08, high])[-1]
    # omega starts at 0 and is within 1e-3 of saturation, which is 15 N.
    assert loaded == pytest.approx(each, abs=0.05)
    assert unloaded == pytest.approx(each, abs=0.05)
    # A backbone that falls between its humps: from above the spring stays on the other side of them.
    humps = replace(MOUNT, kE=(0.0, -1500.0, 0.0, 1e7), kA=(1.0,), kappa_omega=2.0, rho=500.0, sigma=1.0, n=1.0,
                    displacement_offset=0.0, displacement_min=-0.02, displacement_max=0.02)  # fmt: skip
    both = static_equilibrium(IsolatedMass(humps, 1.0, load=0.0))
    for omega, stop in ((1.0, both.min), (-1.0, both.max)):
        way = np.linspace(-omega * 0.02, stop, 2001)
        crossed = np.sign(Spring(humps).response(way, omega)[:-1]) != -omega
        assert not crossed.any()
        assert Spring(humps).response(way, omega)[-1] == pytest.approx(0.0, abs=1e-2)
    soft = static_equilibrium(IsolatedMass(MOUNT, 6.0, parallel=2))
    assert rest.sag == pytest.approx(3.0 * soft.sag)
    assert rest.frequency == pytest.approx(soft.frequency / np.sqrt(3.0))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"mass": 0.0}, r"`mass` must be within \[1e-09, 1e\+09\] kg, got 0.0"),
        ({"mass": float("nan")}, r"`mass` must be within \[1e-09, 1e\+09\] kg, got nan"),
        ({"mass": 1e-200}, r"`mass` must be within \[1e-09, 1e\+09\] kg, got 1e-200; check its unit"),
        ({"mass": 1e200}, r"`mass` must be within \[1e-09, 1e\+09\] kg"),
        ({"load": float("inf")}, "`load` must be finite"),
        ({"parallel": 0}, "`parallel` must be a whole number from 1 to"),
        ({"parallel": 1.5}, "`parallel` must be a whole number from 1 to"),
        ({"series": 0}, "`series` must be a whole number"),
        ({"damping": -1.0}, "`damping` must be finite and >= 0"),
    ],
)
def test_impossible_systems_are_refused(change: dict[str, float], told: str) -> None:
    with pytest.raises(IsolationError, match=told):
        IsolatedMass(**{"spring": MOUNT, "mass": 5.0, **change})  # type: ignore[arg-type]


def test_impossible_operating_points_are_refused() -> None:
    with pytest.raises(IsolationError, match="must lie within the forces of the identified range"):
        static_equilibrium(IsolatedMass(MOUNT, 1000.0))
    with pytest.raises(IsolationError, match="where no mass can rest; use another mass"):
        static_equilibrium(IsolatedMass(replace(MOUNT, kE=(-2000.0, 20_000.0)), 5.0))
    falling = replace(MOUNT, kE=(50.0, -20_000.0))
    with pytest.raises(IsolationError, match="is not stable"):
        static_equilibrium(IsolatedMass(falling, 5.0, 50.0))
    system = IsolatedMass(MOUNT, 5.0, 50.0)
    with pytest.raises(IsolationError, match=r"of 1 mm .* outside the identified range of 20 to 80 mm; use a lower"):
        frequency_response(system, Excitation.BASE_DISPLACEMENT, 1e-3, np.geomspace(3.0, 30.0, 50))


@pytest.mark.parametrize(
    ("frequencies", "told"),
    [
        ([0.0, 1.0], "Every frequency must be finite and > 0"),
        ([1.0, float("nan")], "Every frequency must be finite and > 0"),
        ([2.0, 1.0], "`frequencies` must rise"),
        ([1.0], "must be at least two"),
    ],
)
def test_impossible_bands_are_refused(frequencies: list[float], told: str) -> None:
    with pytest.raises(IsolationError, match=told):
        frequency_response(IsolatedMass(MOUNT, 5.0, 50.0), Excitation.FORCE, 1.0, frequencies)


@pytest.mark.parametrize("level", [0.0, -1.0, float("nan")])
def test_impossible_levels_are_refused(level: float) -> None:
    with pytest.raises(IsolationError, match="`level` must be finite and > 0"):
        frequency_response(IsolatedMass(MOUNT, 5.0, 50.0), Excitation.FORCE, level, [1.0, 2.0])


@pytest.mark.parametrize(
    ("system", "excitation", "level", "frequencies"),
    [
        (IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0), Excitation.BASE_DISPLACEMENT, 1e-3, (4.0, 10.4, 14.0)),
        (IsolatedMass(MOUNT, 30.0, None, 4, 2, 60.0), Excitation.BASE_ACCELERATION, 1.0, (5.0, 6.3)),
        (IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0), Excitation.FORCE, 20.0, (11.5, 30.0)),
    ],
    ids=["base displacement", "base acceleration, 4 x 2 springs", "force"],
)
def test_time_integration_gives_the_same_steady_motion(
    system: IsolatedMass, excitation: Excitation, level: float, frequencies: tuple[float, ...]
) -> None:
    found = frequency_response(system, excitation, level, frequencies)
    for point in (one for one in found.points if one.requested):
        reference = shaken(system, excitation, level, point.frequency)
        # The mark is 0.5 % and 1 degree. Both err by some 1e-5: what the solver's tolerance and the end of the
        # transient leave; a tenfold margin.
        assert point.amplitude == pytest.approx(reference.amplitude, rel=2e-4)
        base = {Excitation.BASE_DISPLACEMENT: level, Excitation.FORCE: level}.get(
            excitation, -level / (2.0 * np.pi * point.frequency) ** 2
        )
        off = np.degrees(np.angle(reference.relative / base)) - point.relative_phase
        assert abs((off + 180.0) % 360.0 - 180.0) < 0.02
        assert point.relative == pytest.approx(abs(reference.relative / base), rel=2e-4)
        # Its peak lies at a reversal, up to half of 256 samples of a period from the nearest of them.
        assert point.acceleration == pytest.approx(reference.acceleration, rel=5e-3)


@pytest.mark.parametrize("order", [1, 5])
def test_peaks_between_samples_of_a_period(order: int) -> None:
    """Of 256 samples the largest misses up to (pi*order/256)^2/2, 8e-5 and 2e-3; a parabola its fourth power."""
    phases = np.linspace(0.0, 0.1, 7)[:, None]
    samples = np.abs(np.cos(order * (2.0 * np.pi * np.arange(256) / 256 + phases)))
    assert largest_of_period(samples) == pytest.approx(np.ones(7), abs=(np.pi * order / 256) ** 4)


def test_a_closed_curve_beside_the_followed_one_is_passed_over() -> None:
    """A draw of the hinge with a polynomial FE: near 7.15 Hz arclength steps land on a closed superharmonic curve."""
    hinge = Spring.load(ROOT / "tests" / "golden" / "rubber_hinge.json").parameters
    drawn = replace(
        hinge,
        kappa_omega=0.06395164797191956,
        rho=1766.9740459124064,
        sigma=0.8874243050051873,
        n=3.421727778814006,
    )
    band = [3.29255384, 6.09510679, 11.28313418, 20.88710195, 38.66576617, 71.57725745]
    response = frequency_response(IsolatedMass(drawn, 0.02), Excitation.BASE_DISPLACEMENT, 8.538063896930848e-05, band)
    assert [point.frequency for point in response.points if point.requested] == pytest.approx(band, rel=1e-12)
    assert response.resonance.frequency == pytest.approx(13.56, rel=5e-3)  # 64th parts of the way between two points


def test_a_curve_crossed_piece_by_piece_comes_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Almost pure dry friction, of which every motion looks like a spike: each crossing was a part of what remained."""
    spring = SpringParameters(
        (2121.4871911254922, 1.2246346645083803), (1.0, -0.19150558578713112), 999900000000000.0, 669822208639.3677,
        0.5, 0.010001, -4.734543938765586, -5.410907358589241, -3.9179738799705883,
    )  # fmt: skip
    sweeps = []
    sweep = BalancedSystem.sweep

    def counted(*arguments: Any) -> Any:
        sweeps.append(arguments)
        assert len(sweeps) < 100, "no end"
        return sweep(*arguments)

    monkeypatch.setattr(BalancedSystem, "sweep", counted)
    system = IsolatedMass(spring, 216.34024280265245, 2121.5730420806317)
    band = np.geomspace(0.23, 0.24, 20) * static_equilibrium(system).frequency
    found = frequency_response(system, Excitation.BASE_DISPLACEMENT, 0.0074646673930932606, band, True)
    assert found.column("requested").sum() == 20
