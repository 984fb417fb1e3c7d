"""How far each number may lie from the kept one, and why.

The version that wrote the figures repeats itself to the bit, whatever the number of threads. Rounded otherwise - NumPy
and OpenBLAS without AVX, or exp, log, expm1 and log1p of the model off by one unit in the last place at random - its
figures move by less than a quarter of these tolerances (README.md beside this file).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from cases import Case, Outputs
from numpy.typing import NDArray

Tolerance = float | NDArray[np.float64]


def tolerance(case: Case, name: str, kept: Outputs) -> Tolerance:
    """Tolerance of the number or numbers `name` of a case; the kept outputs give the scales."""
    return _RULES[case.kind](case, name, kept)


def numbers(values: Any) -> NDArray[np.float64]:
    """Numbers as an array; nan where there is none."""
    return np.array(values, dtype=np.float64)


# Where W was off by more than 1e-12 in that version: against 30 digits its omega errs by 4e-13 to 4e-12 along these
# paths, the kernel's by 2e-14 at most (tests/kernel/test_exact_paths.py).
_CORRECTED = ("18/loops", "01/reversals", "19/reversals", "21/reversals")


def _path(case: Case, name: str, kept: Outputs) -> Tolerance:
    """1e-12 of what can be seen, and two units in the last place of the displacement; four times it where W was off."""
    return (4.0 if case.name in _CORRECTED else 1.0) * _along_path(case, name, kept)


def _along_path(case: Case, name: str, kept: Outputs) -> Tolerance:
    assert case.spring is not None
    p = case.spring
    rounding = 2.0 * np.spacing(kept["farthest"])
    force, stiffness = _largest(kept["force"]), _largest(kept["stiffness"])
    if name == "force":
        return 1e-12 * force + rounding * stiffness
    if name == "omega":
        return 1e-12 + 2.0 * p.sigma * p.rho * rounding
    if name == "stiffness":
        # d(stiffness)/d(omega): without bound at omega = 0 where n < 1, and that is left out.
        omega = np.abs(numbers(kept["omega"]))
        with np.errstate(divide="ignore"):
            bend = np.maximum(1.0, 2.0 * p.sigma - 1.0) * p.n * omega ** (p.n - 1.0)
        cusp = (omega < 1e-6) & (p.n < 1.0)
        # FA is at most 2 in these springs.
        return np.where(cusp, np.inf, 1e-12 * (stiffness + 2.0 * p.kappa_omega * p.rho * bend))
    if name == "absorbed_energy":
        # The difference of antiderivatives over the range, which on a short path are larger than the work; 5 instead of
        # 1, because 1200 small strokes add up the rounding of each.
        way = max(kept["travel"], p.displacement_max - p.displacement_min)
        return force * (5e-12 * way + rounding)
    return 1e-15 * _largest(kept[name])  # the displacement itself


def _isolate(_case: Case, name: str, kept: Outputs) -> Tolerance:
    """1e-9 of each value. Phases: of 180 degrees; speed and omega at the crest: of the largest; positions: of the
    largest stroke, since they are small motions about a large displacement."""
    if "points." not in name and not name.startswith("csv."):
        return 1e-9 * np.abs(numbers(kept[name]))
    where, _, quantity = name.rpartition(".")
    if "phase" in quantity:
        return 1e-9 * 180.0
    if "speed" in quantity or "omega" in quantity:
        return 1e-9 * _largest(kept[name])
    if quantity.startswith(("mean", "least", "greatest", "start_displacement", "displacement")):
        unit = " [m]" if where == "csv" else ""
        stroke = numbers(kept[f"{where}.greatest{unit}"]) - numbers(kept[f"{where}.least{unit}"])
        return 1e-9 * _largest(stroke)
    return 1e-9 * np.abs(numbers(kept[name]))


def _relative(share: float) -> Callable[[Case, str, Outputs], Tolerance]:
    def rule(_case: Case, name: str, kept: Outputs) -> Tolerance:
        return share * np.abs(numbers(kept[name]))

    return rule


def _info(_case: Case, name: str, kept: Outputs) -> Tolerance:
    """1e-9; forces of a loop, of which the mean may be zero, and 1e-12 of the greatest of the loop."""
    loop, _, figure = name.rpartition(".")
    floor = 1e-12 * abs(kept[f"{loop}.greatest_force"]) if figure.endswith("_force") else 0.0
    return 1e-9 * np.abs(numbers(kept[name])) + floor


def _synthesize(_case: Case, name: str, kept: Outputs) -> Tolerance:
    return 1e-12 * _largest(kept[name])


def _predict(_case: Case, name: str, kept: Outputs) -> Tolerance:
    """omega_start is looked for until it is known to 1e-6; the misfit is level there."""
    if name.endswith("omega_start"):
        return 3e-6
    if name == "csv.predicted force [N]":
        return 3e-6 * _largest(kept[name])
    return 1e-9 * np.abs(numbers(kept[name]))


# Loops without hysteresis: n is at its bound 100, and kappa_omega moves by a hundredth with the last digit of exp.
_HARDLY_KNOWN = {"drowned, ni": 5e-2}
# Ni's method differentiates by differences of 1e-6 and stops there: parameters repeat to 3e-6 when rounding changes.
_NI = 3e-5
_STATED = 1e-6  # two-stage does not iterate
_NO_NOISE = 1e-9  # standard errors below this share of the parameter are rounding


def _identify(case: Case, name: str, kept: Outputs) -> Tolerance:
    """Refined: a hundredth of each standard error; the others as stated above."""
    share = _HARDLY_KNOWN.get(case.name, _NI if kept["method"] == "ni" else _STATED)
    group, _, parameter = name.partition(".")
    of_misfit = group == "lack_of_fit" or name.endswith("held_out_coverage")
    if of_misfit and kept["rmse"] < _NO_NOISE * kept["parameters.kappa_omega"]:
        return np.inf  # what a misfit consists of that is rounding, and how much of it an interval holds
    if group == "lack_of_fit":
        return 1e-3 * np.abs(numbers(kept[name]))  # what it consists of moves more than how large it is
    if group == "parameters":
        return _of_parameter(parameter, share, kept)
    if group == "uncertainty":
        return _of_error(parameter, kept)
    if parameter.endswith("omega_start"):
        return max(share, 1e-3)  # hardly matters after the first stroke
    if name.endswith("rmse"):
        # The refinement stops where the squared misfit changes by less than 1e-5.
        return 1e-5 * kept[name] + _NO_NOISE * kept["parameters.kappa_omega"]
    if name.endswith("rnl"):
        return 1e-5 * (1.0 - kept[name]) + _NO_NOISE
    return 1e-6 * np.abs(numbers(kept[name]))  # figures of the campaign


def _of_parameter(name: str, share: float, kept: Outputs) -> Tolerance:
    value = np.abs(numbers(kept[f"parameters.{name}"]))
    if name.startswith("displacement"):
        return 1e-12 * value
    error = kept.get(f"uncertainty.{name}")
    if error is not None:
        return 1e-2 * numbers(error) + _NO_NOISE * value
    if name in ("kE", "kA"):
        # Coefficients that hardly matter: against a thousandth of what the largest one adds over half the range.
        half = 0.5 * (kept["parameters.displacement_max"] - kept["parameters.displacement_min"])
        powers = half ** np.arange(value.size)
        value = np.maximum(value, 1e-3 * np.max(value * powers) / powers)
    return share * value


def _of_error(name: str, kept: Outputs) -> Tolerance:
    value = np.abs(numbers(kept[f"uncertainty.{name}"]))
    if name.startswith("correlation"):
        return 1e-2
    of = f"parameters.{name}"
    scale = np.abs(numbers(kept[of if of in kept else "parameters.kappa_omega"]))
    return 1e-2 * value + _NO_NOISE * scale


def _largest(values: Any) -> float:
    return float(np.nanmax(np.abs(numbers(values))))


_RULES: dict[str, Callable[[Case, str, Outputs], Tolerance]] = {
    "path": _path,
    "isolate": _isolate,
    "study": _relative(1e-9),
    "synthesize": _synthesize,
    "predict": _predict,
    "info": _info,
    "identify": _identify,
}
