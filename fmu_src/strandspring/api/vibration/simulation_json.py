"""Answers about systems as JSON, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from ...errors import Reader
from ...findings import gathered
from ...kernel.arrays import FloatArray
from ...vibration.bodies.modes import Mode
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.rest import mount_loads
from ...vibration.bodies.simulation import CaseRun
from ...vibration.verdicts.answers import CandidateAnswer, CaseAnswer
from ...vibration.verdicts.courses import Courses
from ...vibration.verdicts.figures import RangeUse
from ...vibration.verdicts.verdicts import CaseVerdict, Figure

Json = dict[str, Any]


def candidate_json(candidate: CandidateAnswer, verdict: CaseVerdict) -> Json:
    """The verdict on a candidate in all load cases together, its static poses and modes."""
    static = candidate.static
    form: Json = {"name": candidate.name, "verdict": verdict.value}
    form |= {"refusal": candidate.refusal or None, "cautions": [*gathered(candidate.findings, Reader.FILE)]}
    if static is None:
        return {**form, "static_equilibrium": None, "modes": None}
    names = candidate.system.axis_names
    pose, places = static.poses[0], static.places
    forces = np.array([drawn.force for drawn in static.poses])
    rest = {
        "bodies": [
            {
                "body": body.name,
                "displacement": pose.displacements[k].tolist(),
                "quaternion": pose.coordinates[k, 3:].tolist(),
                "sag": _ranged(static.sag[:, k]),
                "tilt": _ranged(static.tilt[:, k]),
            }
            for k, body in enumerate(candidate.system.bodies)
        ],
        "axes": [
            {
                "axis": name, "displacement": float(pose.displacement[k]), "force": _ranged(forces[:, k]),
                "place_in_range": _ranged(places[:, k]),
            }
            for k, name in enumerate(names)
        ],
        "mounts": [
            {"mount": mount.name, "load": load}
            for mount, load in zip(
                candidate.system.mounts, mount_loads(candidate.system, pose).tolist(), strict=True
            )
        ],
    }  # fmt: skip
    modes = {name: [_mode(mode) for mode in getattr(static, name)] for name in ("tangent", "secant")}
    return {**form, "static_equilibrium": rest, "modes": modes}


def _ranged(values: FloatArray) -> Json:
    """The nominal value, which comes first, and the least and the largest of all draws."""
    return {"value": float(values[0]), "low": float(values.min()), "high": float(values.max())}


def _mode(mode: Mode) -> Json:
    return {"frequency": mode.frequency, "damping": mode.damping, "motion": mode.words, "shape": mode.shape.tolist()}


def case_json(answer: CaseAnswer) -> Json:
    """A candidate in a load case."""
    return {
        "candidate": answer.candidate,
        "case": answer.case.name,
        "text": answer.case.text,
        "verdict": answer.verdict.value,
        "refusal": answer.refusal or None,
        "figures": [figure_json(figure) for figure in answer.figures],
        "nominal": _run(answer.system, answer.runs[0], answer.uses[0]) if answer.runs else None,
        "draws": {"count": answer.draws, "refused": answer.refused, "beyond": answer.beyond},
        "cautions": [*gathered(answer.findings, Reader.FILE)],
        "spectra": None if answer.courses is None else _spectra(answer.system, answer.courses),
    }


def figure_json(figure: Figure) -> Json:
    """A figure with its margin."""
    form = {field.name: getattr(figure, field.name) for field in fields(figure) if field.name != "quantity"}
    return {"quantity": figure.quantity.value, "unit": figure.quantity.unit, **form, "margin": figure.margin}


def _run(system: MountedSystem, run: CaseRun, use: RangeUse) -> Json:
    figures = run.figures
    return {
        "step": run.step,
        "energies": {**asdict(run.energies), "residual": run.energies.residual},
        "relative_energy_residual": run.energies.relative_residual,
        "points": [
            {
                "point": point.name,
                **_figures(figures, k, ("acceleration", "acceleration_time", "acceleration_components", "sway",
                                        "sway_components", "rms_acceleration", "rms_sway")),
            }
            for k, point in enumerate(system.points)
        ],
        "axes": [
            {
                "axis": name,
                "range_low": float(use.low[k]),
                "range_high": float(use.high[k]),
                "static_equilibrium": float(use.rest[k]),
                "share_used": float(use.share[k]),
                "stop_deflection": float(use.stop_deflection[k]),
                "stop_force": float(use.stop_force[k]),
                **_figures(figures, k, ("displacement_low", "displacement_high", "force", "rate", "omega_low",
                                        "omega_high", "absorbed")),
            }
            for k, name in enumerate(system.axis_names)
        ],
    }  # fmt: skip


def _figures(figures: Any, number: int, names: Sequence[str]) -> Json:
    return {name: np.asarray(getattr(figures, name)[number]).tolist() for name in names}


def _spectra(system: MountedSystem, courses: Courses) -> Json:
    """Shock response spectra (maximax) and power spectra of the base and the points, along x, y and z."""
    form: Json = {"interval": courses.interval, "shock": None, "power": None}
    names = [point.name for point in system.points]
    if courses.shock:
        form["shock"] = {
            "damping": courses.damping,
            "frequency": courses.shock[0][0].frequency.tolist(),
            "base": [spectrum.maximax.tolist() for spectrum in courses.base_shock],
            "points": {
                name: [spectrum.maximax.tolist() for spectrum in spectra]
                for name, spectra in zip(names, courses.shock, strict=True)
            },
        }
    if courses.power:
        first = courses.power[0][0]
        form["power"] = {
            "frequency": first.frequency.tolist(),
            "relative_error": first.relative_error,
            "base": [spectrum.density.tolist() for spectrum in courses.base_power],
            "points": {
                name: [spectrum.density.tolist() for spectrum in spectra]
                for name, spectra in zip(names, courses.power, strict=True)
            },
        }
    return form
