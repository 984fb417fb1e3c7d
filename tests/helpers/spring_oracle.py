"""The force of a model file by an ODE solver: nothing of strandspring is used, so that it can be checked against this.

r = FE(x) + kappa_omega*omega*FA(x), x = displacement - displacement_offset, paper eqs. (8)-(11). omega depends on the
travel only: with u = direction*omega and s the way since the reversal

    du/ds = rho*(1 - u^n) for u >= 0,   du/ds = rho*(1 + (2*sigma - 1)*(-u)^n) for u < 0,

so that a stroke is one initial value problem over its travel, whatever is sampled of it. FE is a polynomial in x, or
the not-a-knot spline through `FE_forces` at `FE_knots`; beyond the range FE is continued along its tangent, and FA is
held.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

FloatArray = NDArray[np.float64]
_DECAYED = 40.0  # exp(-40) is below the rounding of 1


class OracleSpring:
    """A spring from the parameters of a model file.

    Parameters
    ----------
    parameters : mapping   Field `parameters` of the file.
    rtol, atol : float     Of the solver. With these omega errs by less than 1e-6, where n is small; else by 1e-8.
    """

    def __init__(self, parameters: Mapping[str, Any], rtol: float = 1e-9, atol: float = 1e-11) -> None:
        self.values = dict(parameters)
        self.tolerances = {"rtol": rtol, "atol": atol}
        self._spline = None
        if "FE_knots" in parameters:
            self._spline = CubicSpline(parameters["FE_knots"], parameters["FE_forces"], bc_type="not-a-knot")

    @classmethod
    def load(cls, path: Path) -> OracleSpring:
        """The spring of a model file."""
        return cls(json.loads(path.read_text(encoding="utf-8"))["parameters"])

    def elastic(self, displacement: FloatArray) -> FloatArray:
        """FE along a path [N]."""
        inside, p = self._inside(displacement), self.values
        if self._spline is not None:
            force, slope = self._spline(inside), self._spline(inside, 1)
        else:
            x = inside - p["displacement_offset"]
            force, slope = polyval(x, p["kE"]), polyval(x, polyder(p["kE"]))
        return np.asarray(force + slope * (displacement - inside))

    def amplifier(self, displacement: FloatArray) -> FloatArray:
        """FA along a path [-]."""
        return np.asarray(polyval(self._inside(displacement) - self.values["displacement_offset"], self.values["kA"]))

    def force(self, displacement: FloatArray, omega_start: float, time: FloatArray | None = None) -> FloatArray:
        """Force along a path that starts with this omega in each mechanism, and without force in branches [N]."""
        hysteretic = self.values["kappa_omega"] * self.omega(displacement, omega_start)
        force = self.elastic(displacement) + hysteretic * self.amplifier(displacement)
        if second := self.values.get("second"):
            place = {name: value for name, value in self.values.items() if name.startswith("displacement_")}
            force = force + OracleSpring({"kE": [0.0], **place, **second}, **self.tolerances).force(
                displacement, omega_start
            )
        for branch in self.values.get("branches", ()):
            assert time is not None
            force = force + _maxwell(branch["stiffness"], branch["time_constant"], displacement, time)
        return force

    def omega(self, displacement: FloatArray, omega_start: float) -> FloatArray:
        """omega at every sample [-], stroke by stroke between all changes of direction."""
        omega = np.full(displacement.size, float(omega_start))
        moving = np.flatnonzero(np.diff(displacement))
        signs = np.sign(np.diff(displacement)[moving])
        ends = [*moving[:-1][signs[1:] != signs[:-1]] + 1, displacement.size - 1]
        begin = 0
        for end in ends:
            if end > begin:
                sign = 1.0 if displacement[end] >= displacement[begin] else -1.0
                travel = np.abs(displacement[begin : end + 1] - displacement[begin])
                omega[begin : end + 1] = sign * self._stroke(sign * omega[begin], travel)
                begin = end
        return omega

    def _stroke(self, start: float, travel: FloatArray) -> FloatArray:
        """u at these ways from a reversal; the two branches apart, since the slope of u has a cusp at 0 for n < 1."""
        p = self.values
        n, curvature = p["n"], 2.0 * p["sigma"] - 1.0
        way = p["rho"] * travel
        u = np.ones(travel.size)
        crossing = 0.0
        if start < 0.0:

            def returning(_: float, u: FloatArray) -> FloatArray:
                return 1.0 + curvature * np.maximum(-u, 0.0) ** n

            def crosses(_: float, u: FloatArray) -> float:
                return float(u[0])

            crosses.terminal = True  # type: ignore[attr-defined]
            run = self._solved(returning, start, way[-1], crosses)
            crossing = float(run.t[-1])
            before = way <= crossing
            u[before] = run.sol(way[before])[0]
            if before.all():
                return u
            start = 0.0
        later = way >= crossing
        # 1 - u falls as exp(-n*way) in the end.
        saturation = crossing + 1.0 + _DECAYED / n
        if start < 1.0:
            run = self._solved(lambda _, u: 1.0 - np.clip(u, 0.0, 1.0) ** n, start, min(way[-1], saturation) - crossing)
            rising = later & (way <= saturation)
            if rising.any():
                u[rising] = run.sol(way[rising] - crossing)[0]
        return u

    def _solved(self, slope: Any, start: float, end: float, event: Any = None) -> Any:
        return solve_ivp(
            slope, (0.0, end), [start], method="DOP853", events=event, dense_output=True, **self.tolerances
        )

    def _inside(self, displacement: FloatArray) -> FloatArray:
        return np.clip(displacement, self.values["displacement_min"], self.values["displacement_max"])


def _maxwell(stiffness: float, tau: float, displacement: FloatArray, time: FloatArray) -> FloatArray:
    """dr/dt = stiffness*dx/dt - r/tau, at constant velocity between samples [N]."""
    forces = [0.0]
    for h, d in zip(np.diff(time).tolist(), np.diff(displacement).tolist(), strict=True):
        held = np.exp(-h / tau)
        forces.append(forces[-1] * held + stiffness * d * (1.0 if h == 0.0 else -np.expm1(-h / tau) * tau / h))
    return np.array(forces)
