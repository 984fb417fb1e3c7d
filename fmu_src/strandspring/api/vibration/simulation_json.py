"""Answers about systems as JSON, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from ...vibration.bodies.axis_names import axis_names
from ...vibration.bodies.modes import Mode
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.simulation import CaseRun
from ...vibration.verdicts.answers import CandidateAnswer, CaseAnswer
from ...vibration.verdicts.courses import SRS_DAMPING, Courses
from ...vibration.verdicts.range_use import RangeUse
from ...vibration.verdicts.verdicts import Figure

Json = dict[str, Any]


def candidate_json(candidate: CandidateAnswer) -> Json:
    """Static poses and modes of a candidate."""
    static = candidate.static
    form: Json = {"name": candidate.name, "refusal": candidate.refusal or None, "cautions": list(candidate.cautions)}
    if static is None:
        return {**form, "static_equilibrium": [], "modes": None}
    names = axis_names(candidate.system)
    rest = [
        {
            "omega": pose.share,
            "bodies": [
                {
                    "body": body.name,
                    "displacement": pose.displacements[k].tolist(),
                    "quaternion": pose.coordinates[k, 3:].tolist(),
                    "sag": float(static.sag[at, k]),
                    "tilt": float(static.tilt[at, k]),
                }
                for k, body in enumerate(candidate.system.bodies)
            ],
            "axes": [
                {"axis": name, "displacement": float(x), "force": float(force), "place_in_range": float(place)}
                for name, x, force, place in zip(names, pose.displacement, pose.force, static.places[at], strict=True)
            ],
        }
        for at, pose in enumerate(static.poses)
    ]
    modes = {name: [_mode(mode) for mode in getattr(static, name)] for name in ("tangent", "secant")}
    return {**form, "static_equilibrium": rest, "modes": modes}


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
        "runs": [_run(answer.system, run, use) for run, use in zip(answer.runs, answer.uses, strict=True)],
        "spread": None if answer.spread is None else asdict(answer.spread),
        "cautions": [caution.text for caution in answer.cautions],
        "spectra": None if answer.courses is None else _spectra(answer.system, answer.courses),
    }


def figure_json(figure: Figure) -> Json:
    """A figure with its margin."""
    form = {
        field.name: getattr(figure, field.name) for field in fields(figure) if field.name not in ("quantity", "spread")
    }
    return {
        "quantity": figure.quantity.value,
        "unit": figure.quantity.unit,
        **form,
        "margin": figure.margin,
        "spread": None if figure.spread is None else asdict(figure.spread),
    }


def _run(system: MountedSystem, run: CaseRun, use: RangeUse) -> Json:
    figures = run.figures
    return {
        "omega": run.start.share,
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
            for k, name in enumerate(axis_names(system))
        ],
    }  # fmt: skip


def _figures(figures: Any, number: int, names: Sequence[str]) -> Json:
    return {name: np.asarray(getattr(figures, name)[number]).tolist() for name in names}


def _spectra(system: MountedSystem, courses: Courses) -> Json:
    """Shock response spectra (maximax) and power spectra of the base and the points, along x, y and z."""
    form: Json = {"omega": courses.run.start.share, "interval": courses.interval, "shock": None, "power": None}
    names = [point.name for point in system.points]
    if courses.shock:
        form["shock"] = {
            "damping": SRS_DAMPING,
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
