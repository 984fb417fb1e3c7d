"""`Spring`: an identified spring with its response to displacement paths, loaded from and saved to a model file."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import MethodType
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from ..core.parameters import SpringParameters
from ..ground.arguments import number
from ..ground.plotfile import some_axes
from ..kernel.arrays import FloatArray
from ..kernel.branches import as_times
from ..kernel.path import OmegaStart, PathSolver, as_path, warn_outside
from ..loops.loop import steady_loop
from ..model.modelfile import ModelFile, load_model, save_model

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .comparison import compare as _compare
    from .fmus.build import build_fmu as _build_fmu
    from .fmus.export import export as _export
    from .information import info as _info
    from .information import predict as _predict
    from .records import synthesize as _synthesize
    from .responses import responses as _responses
    from .vibration.isolation import isolate as _isolate
    from .vibration.studies import study as _study


class _Function:
    """A function as a method of the same name; its module in this folder is loaded when it is asked for."""

    def __init__(self, module: str) -> None:
        self._module = module

    def __set_name__(self, owner: type[Any], name: str) -> None:
        self._name = name

    def __get__(self, spring: Any, owner: type[Any]) -> Callable[..., Any]:
        function: Callable[..., Any] = getattr(import_module(f".{self._module}", __package__), self._name)
        return function if spring is None else MethodType(function, spring)


class Spring:
    """A hysteretic spring: modified normalized Bouc-Wen model of Zhao et al. 2013 in closed form.

    Parameters
    ----------
    parameters : SpringParameters
    name : str          Identifier for the model file and the FMU.
    description : str   Free text.

    Raises
    ------
    ModelError          If the name is not an identifier, or the description has control characters.
    TypeError           If the parameters are something else.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> spring.response([0.0, 0.01, 0.0]).round(3).tolist()
    [0.0, 29.933, -9.866]
    """

    def __init__(self, parameters: SpringParameters, name: str = "spring", description: str = "") -> None:
        if not isinstance(parameters, SpringParameters):
            raise TypeError(
                f"`parameters` must be SpringParameters, got {type(parameters).__name__}; read a model file with "
                "`Spring.load`."
            )
        self._set_model(ModelFile(name, parameters, description))

    def _set_model(self, model: ModelFile) -> None:
        self.model = model
        self.parameters = model.parameters
        self._solver = PathSolver(self.parameters)

    def __eq__(self, other: object) -> bool:
        """Whether all that a model file holds is equal."""
        return self.model == other.model if isinstance(other, Spring) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.model.name, self.parameters))

    def __repr__(self) -> str:
        p = self.parameters
        shape = f"FE spline of {len(p.FE_knots)} knots" if p.FE_knots else f"FE of degree {len(p.kE) - 1}"
        second = "" if p.second is None else f", second kappa_omega {p.second.kappa_omega:.4g} N"
        branches = f", {len(p.branches)} Maxwell branches" if p.branches else ""
        return (
            f"<Spring {self.model.name}: kappa_omega {p.kappa_omega:.4g} N, rho {p.rho:.4g} 1/m, sigma {p.sigma:.4g}, "
            f"n {p.n:.4g}, {shape}, FA of degree {len(p.kA) - 1}{second}{branches}, {1e3 * p.displacement_min:.6g} to "
            f"{1e3 * p.displacement_max:.6g} mm>"
        )

    @classmethod
    def from_model(cls, model: ModelFile) -> Spring:
        """The spring of a model in memory."""
        spring = cls.__new__(cls)
        spring._set_model(model)
        return spring

    @classmethod
    def load(cls, path: str | Path) -> Spring:
        """Read a model file; raises ModelError if it is not a physically possible spring."""
        return cls.from_model(load_model(path))

    def save(self, path: str | Path) -> None:
        """Write the model file; the same spring gives the same bytes."""
        save_model(path, self.model)

    def response(
        self,
        displacement: ArrayLike,
        omega_start: OmegaStart = 0.0,
        time: ArrayLike | None = None,
        input_resolution: float = 0.0,
    ) -> FloatArray:
        """Restoring force along a displacement path, paper eqs. (10)-(11), exact for any sampling.

        With Maxwell branches (`SpringParameters.branches`) it is exact where the displacement moves at constant
        velocity between samples; they begin without force.

        Parameters
        ----------
        displacement : array_like, shape (K,)   [m]; the path starts at the first sample.
        omega_start : float or (float, float)   Normalized hysteretic variable at the start, within [-1, 1]: of all
                                                mechanisms, or of the first and the second.
        time : array_like or None, shape (K,)   Of the samples [s], none before the one that it follows; a spring with
                                                branches needs it, and others do not depend on it.
        input_resolution : float                Of a sensor that measured the displacement [m], such as its last digit
                                                or the height of its noise: friction does not follow smaller reversals.
                                                It is the friction of a displacement that is at most this far from the
                                                given one, and is that itself while the motion goes on from twice this
                                                behind a turning point.

        Returns
        -------
        ndarray, shape (K,)                     Force [N].

        Warns
        -----
        UserWarning                             If the path leaves the identified range by more than 1 % of it: FE, and
                                                with it the force, is extrapolated there.

        Raises
        ------
        ValueError                              If a displacement or time is not finite, omega_start out of bounds, the
                                                times are missing, or the resolution is not finite and >= 0.
        """
        resolution = number("input_resolution", input_resolution, "m")
        if not 0.0 <= resolution < math.inf:
            raise ValueError(f"`input_resolution` must be finite and >= 0 [m], got {resolution!r}.")
        return self._solver.force(*self._within(displacement, omega_start, time), resolution)

    def omega(self, displacement: ArrayLike, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Normalized hysteretic variable of the first mechanism, shape (K,) [-]; arguments as for `response`."""
        path, start, _ = _checked(displacement, omega_start, None)
        return self._solver.omega(path, start)

    def stiffness(self, displacement: ArrayLike, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Tangent stiffness in the direction of motion, shape (K,) [N/m]; arguments as for `response`.

        It is that of fast motion, to which each Maxwell branch adds its stiffness.
        """
        path, start, _ = self._within(displacement, omega_start, None)
        return self._solver.stiffness(path, start)

    def absorbed_energy(
        self, displacement: ArrayLike, omega_start: OmegaStart = 0.0, time: ArrayLike | None = None
    ) -> FloatArray:
        """Integral of the force over the displacement, shape (K,) [J]; arguments as for `response`."""
        return self._solver.absorbed_energy(*self._within(displacement, omega_start, time))

    def stored_energy(self, displacement: ArrayLike, time: ArrayLike | None = None) -> FloatArray:
        """The part of `absorbed_energy` that the springs of the Maxwell branches hold, shape (K,) [J]."""
        path, _, times = _checked(displacement, 0.0, time)
        return self._solver.stored_energy(path, times)

    def _within(
        self, displacement: ArrayLike, omega_start: OmegaStart, time: ArrayLike | None
    ) -> tuple[FloatArray, OmegaStart, FloatArray | None]:
        """As `_checked`, with a warning to the caller's caller where the path leaves the identified range."""
        path, start, times = _checked(displacement, omega_start, time)
        warn_outside(path, self.parameters.displacement_min, self.parameters.displacement_max, stacklevel=3)
        return path, start, times

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw steady loops over the identified range, and over three quarters, a half and a quarter of it.

        Parameters
        ----------
        ax : Axes or None   Of matplotlib; those of a new figure if None.
        """
        (axes,) = some_axes(ax)
        low, high = self.parameters.displacement_min, self.parameters.displacement_max
        for share in (0.0, 0.125, 0.25, 0.375):
            cut = share * (high - low)
            loop = steady_loop(self._solver, low + cut, high - cut)
            for branch in (loop.loading, loop.unloading):
                axes.plot(1e3 * branch.displacement, branch.force, "C0", lw=1.2)
        axes.set(xlabel="displacement [mm]", ylabel="force [N]", title=self.model.name)
        return axes

    # The functions of these names, of which the spring is the first argument.
    if TYPE_CHECKING:
        predict, info, synthesize, compare = _predict, _info, _synthesize, _compare
        isolate, study, build_fmu, export, responses = _isolate, _study, _build_fmu, _export, _responses
    else:
        predict = _Function("information")
        info = _Function("information")
        synthesize = _Function("records")
        compare = _Function("comparison")
        isolate = _Function("vibration.isolation")
        study = _Function("vibration.studies")
        build_fmu = _Function("fmus.build")
        export = _Function("fmus.export")
        responses = _Function("responses")


def _checked(
    displacement: ArrayLike, omega_start: OmegaStart, time: ArrayLike | None
) -> tuple[FloatArray, OmegaStart, FloatArray | None]:
    """A path with where it starts and its times, as a solver takes them."""
    path = as_path(displacement)
    starts = omega_start if isinstance(omega_start, tuple | list) else (omega_start,)
    values = tuple(number("omega_start", start) for start in starts)
    if len(values) not in (1, 2):
        raise ValueError(f"`omega_start` must be one number or two, got {len(values)}.")
    for value in values:
        if not -1.0 <= value <= 1.0:
            raise ValueError(f"`omega_start` must be within [-1, 1], got {value!r}.")
    times = None if time is None else as_times(time, path.size)
    return path, (values[0], values[-1]), times
