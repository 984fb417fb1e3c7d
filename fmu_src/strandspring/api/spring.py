"""`Spring`: an identified spring with its response to displacement paths, loaded from and saved to a model file; and
`responses`: many springs along a path, or one spring along many, with gradients by the parameters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from types import MethodType
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..campaigns.jobs.threads import in_threads, usable_cores
from ..core.parameters import ARRAYS, SCALARS, SpringParameters
from ..errors import ModelError
from ..ground.arguments import flag, number, workers_of
from ..ground.options import takes
from ..ground.plotfile import some_axes
from ..kernel.arrays import FloatArray
from ..kernel.branches import as_times, require_plain
from ..kernel.many_paths import QUANTITIES, along_paths, gradient_fields, spring_rows
from ..kernel.path import OmegaStart, PathSolver, as_path, warn_outside
from ..loops.loop import steady_loop
from ..model.modelfile import ModelFile, load_model, save_model
from .common.model_source import ModelSource, model_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    import strandspring as public


Quantity: TypeAlias = Literal["force", "stiffness", "absorbed_energy"]

_HYSTERETIC = {"kappa_omega", "rho", "sigma", "n"}
_CHUNKS = 4  # for each thread, so that all finish at about the same time


class _Function:
    """A function of the package as a method of the same name; its module is loaded when it is asked for."""

    def __set_name__(self, owner: type[Any], name: str) -> None:
        self._name = name

    def __get__(self, spring: Any, owner: type[Any]) -> Callable[..., Any]:
        function: Callable[..., Any] = getattr(import_module(__name__.partition(".")[0]), self._name)
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
        return self._solver.force(*self._path(displacement, omega_start, time), resolution)

    def omega(self, displacement: ArrayLike, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Normalized hysteretic variable of the first mechanism, shape (K,) [-]; arguments as for `response`."""
        path, start, _ = self._path(displacement, omega_start, is_bounded=False)
        return self._solver.omega(path, start)

    def stiffness(self, displacement: ArrayLike, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Tangent stiffness in the direction of motion, shape (K,) [N/m]; arguments as for `response`.

        It is that of fast motion, to which each Maxwell branch adds its stiffness.
        """
        path, start, _ = self._path(displacement, omega_start)
        return self._solver.stiffness(path, start)

    def absorbed_energy(
        self, displacement: ArrayLike, omega_start: OmegaStart = 0.0, time: ArrayLike | None = None
    ) -> FloatArray:
        """Integral of the force over the displacement, shape (K,) [J]; arguments as for `response`."""
        return self._solver.absorbed_energy(*self._path(displacement, omega_start, time))

    def stored_energy(self, displacement: ArrayLike, time: ArrayLike | None = None) -> FloatArray:
        """The part of `absorbed_energy` that the springs of the Maxwell branches hold, shape (K,) [J]."""
        path, _, times = self._path(displacement, 0.0, time, is_bounded=False)
        return self._solver.stored_energy(path, times)

    def _path(
        self, displacement: ArrayLike, omega_start: OmegaStart, time: ArrayLike | None = None, is_bounded: bool = True
    ) -> tuple[FloatArray, OmegaStart, FloatArray | None]:
        """A path with where it starts and its times, as a solver takes them.

        If it is bounded, the caller's caller is warned where it leaves the identified range.
        """
        path = as_path(displacement)
        starts = omega_start if isinstance(omega_start, tuple | list) else (omega_start,)
        values = tuple(number("omega_start", start) for start in starts)
        if len(values) not in (1, 2):
            raise ValueError(f"`omega_start` must be one number or two, got {len(values)}.")
        for value in values:
            if not -1.0 <= value <= 1.0:
                raise ValueError(f"`omega_start` must be within [-1, 1], got {value!r}.")
        times = None if time is None else as_times(time, path.size)
        if is_bounded:
            warn_outside(path, self.parameters.displacement_min, self.parameters.displacement_max, stacklevel=3)
        return path, (values[0], values[-1]), times

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
        predict, info, synthesize, compare = public.predict, public.info, public.synthesize, public.compare
        isolate, study, build_fmu = public.isolate, public.study, public.build_fmu
        export = public.export
        responses: Callable[..., Responses]
    else:
        predict, info, synthesize, compare = _Function(), _Function(), _Function(), _Function()
        isolate, study, build_fmu, export, responses = _Function(), _Function(), _Function(), _Function(), _Function()


@dataclass(frozen=True, eq=False)
class Responses:
    """What `responses` computed; S is the number of springs or paths, K that of samples.

    Attributes
    ----------
    values : dict of ndarray, shape (S, K)    By quantity; the properties of these names give them, too.
    gradients : dict of dict of ndarray       By quantity and parameter, such as ``gradients["force"]["rho"]``: shape
                                              (S, K) of a number, (S, C, K) of a list of C coefficients; in the unit of
                                              the quantity over that of the parameter.
    possible : ndarray of bool, shape (S,)    False where a set of parameters is not a spring: its rows are NaN.
    """

    values: dict[str, FloatArray]
    gradients: dict[str, dict[str, FloatArray]]
    possible: NDArray[np.bool_]

    @property
    def force(self) -> FloatArray:
        """Restoring force, shape (S, K) [N]."""
        return self._computed("force")

    @property
    def stiffness(self) -> FloatArray:
        """Tangent stiffness in the direction of motion, shape (S, K) [N/m]."""
        return self._computed("stiffness")

    @property
    def absorbed_energy(self) -> FloatArray:
        """Integral of the force over the displacement, shape (S, K) [J]."""
        return self._computed("absorbed_energy")

    def _computed(self, name: str) -> FloatArray:
        if name not in self.values:
            raise AttributeError(f"{name} was not computed; ask for it by `quantities`.")
        return self.values[name]


@dataclass(frozen=True)
class Computing:
    """What `responses` computes, and how.

    Parameters
    ----------
    quantities : sequence of str     "force", "stiffness" and "absorbed_energy": those to compute.
    by : sequence of str, or "all"   Parameters, and "omega_start", by which gradients are wanted. They take as much
                                     memory as all rows once for each coefficient and quantity.
    impossible : "refuse" or "nan"   What is done with a set of parameters that is not a possible spring.
    coarse : bool                    Omega to 1e-8 only, for many springs of different n or sigma: making the tables of
                                     W, which takes most of the time on short paths, takes a quarter of it.
    workers : int or None            Threads; as many as cores if None.
    """

    quantities: Sequence[Quantity] = ("force",)
    by: Sequence[str] | Literal["all"] = ()
    impossible: Literal["refuse", "nan"] = "refuse"
    coarse: bool = False
    workers: int | None = None


@takes(computing=Computing)
def responses(
    model: ModelSource,
    displacement: ArrayLike,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    omega_start: ArrayLike = 0.0,
    computing: Computing,
) -> Responses:
    """Force, stiffness and energy of many springs along a path, or of one along many, with exact gradients.

    Unless `coarse`, each row has the same bits as a call of `Spring.response`, `Spring.stiffness` or
    `Spring.absorbed_energy`: paper eqs. (10) and (22) in closed form. The gradients are derivatives of these closed
    forms at a path that is held; that of the energy is the integral of that of the force along the path. At a turning
    point a stiffness is that before it.

    Parameters
    ----------
    model : Spring, ModelFile or path   What `parameters` does not give is that of this spring.
    displacement : array_like, shape (K,) or (S, K)   One path for all, or one for each [m]; starts at its first sample.
    parameters : mapping or None
        By names of `SpringParameters`: numbers or arrays of shape (S,), and for kE, kA, FE_knots and FE_forces arrays
        of shape (C,) or (S, C), with as many coefficients as the model has; in SI units.
    omega_start : float or array_like, shape (S,)     Normalized hysteretic variable at the start, within [-1, 1].
    computing : Computing               What is computed, and how; or its fields as keywords.

    Returns
    -------
    Responses

    Warns
    -----
    UserWarning  If a path leaves the identified range of the model by more than 1 % of it: forces are extrapolated.

    Raises
    ------
    ModelError   If a set of parameters is not a possible spring, unless its rows are to be NaN; sets count from 0.
    ValueError   If shapes do not agree, a name is unknown, or a displacement or omega_start is out of bounds.

    Examples
    --------
    >>> import numpy as np
    >>> from strandspring import Spring, SpringParameters, responses
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> path = 0.02 * np.sin(np.linspace(0.0, 6.0, 100))
    >>> many = responses(spring, path, {"rho": [400.0, 500.0, 600.0]}, by=["rho", "kE"])
    >>> many.force.shape, many.gradients["force"]["kE"].shape
    ((3, 100), (3, 2, 100))
    >>> bool(np.all(many.force[1] == spring.response(path)))
    True
    """
    base = model_of(model).parameters
    require_plain(base, "`responses`")
    coarse, by = flag("coarse", computing.coarse), computing.by
    wanted = _chosen("quantities", computing.quantities, QUANTITIES)
    # How many values each parameter of a gradient has.
    sizes = {name: len(getattr(base, name)) for name in ARRAYS if getattr(base, name)}
    sizes |= dict.fromkeys((*SCALARS, "omega_start"), 1)
    places = {name: gradient_fields(name, size) for name, size in sizes.items()}
    names = list(places) if isinstance(by, str) and by == "all" else _chosen("by", by, places)
    paths = np.asarray(displacement, dtype=np.float64)
    if paths.ndim not in (1, 2) or not paths.size:
        raise ValueError(f"`displacement` must have shape (K,) or (S, K), got shape {paths.shape}.")
    warn_outside(as_path(paths.ravel()), base.displacement_min, base.displacement_max, stacklevel=3)
    columns = _columns(sizes, parameters or {}, omega_start)
    rows = _rows(columns, paths)
    starts = np.broadcast_to(columns.pop("omega_start"), rows)
    if not (np.abs(starts) <= 1.0).all():
        raise ValueError(f"`omega_start` must be within [-1, 1], got {starts[~(np.abs(starts) <= 1.0)][0]}.")
    possible = np.resize(_possible(base, columns, computing.impossible), rows)
    columns = {name: np.broadcast_to(column, (rows, *column.shape[1:])) for name, column in columns.items()}
    springs = spring_rows(base, rows, columns)
    springs[~possible] = spring_rows(base, 1, {})

    fields = [field for name in names for field in places[name]]
    values = {name: np.empty((rows, paths.shape[-1])) for name in wanted}
    slopes = {name: np.empty((rows, len(fields), paths.shape[-1])) for name in wanted if fields}

    def fill(part: slice) -> None:
        own_path = paths if paths.ndim == 1 else paths[part]
        parts = [{name: array[part] for name, array in arrays.items()} for arrays in (values, slopes)]
        along_paths(springs[part], own_path, starts[part], parts[0], fields, parts[1], coarse)

    count = workers_of(computing.workers) or usable_cores()
    step = -(-rows // (_CHUNKS * count))
    for _ in in_threads((partial(fill, slice(k, k + step)) for k in range(0, rows, step)), count):
        pass
    for array in (*values.values(), *slopes.values()):
        array[~possible] = np.nan
    ends = np.cumsum([len(places[name]) for name in names])[:-1]
    gradients = {
        quantity: {
            name: part if name in ARRAYS else part[:, 0]
            for name, part in zip(names, np.split(array, ends, axis=1), strict=True)
        }
        for quantity, array in slopes.items()
    }
    return Responses(values, gradients, possible)


def _chosen(argument: str, names: Sequence[str], known: Iterable[str]) -> list[str]:
    """The names, each once; raises ValueError for one that is not known."""
    chosen = [names] if isinstance(names, str) else list(dict.fromkeys(names))
    for name in chosen:
        if name not in known:
            raise ValueError(f"`{argument}` must be of {', '.join(known)}, got {name!r:.40}.")
    return chosen


def _columns(
    sizes: Mapping[str, int], parameters: Mapping[str, ArrayLike], omega_start: ArrayLike
) -> dict[str, FloatArray]:
    """Arrays of the parameters given, and of omega_start, all with a first axis: of length 1 where one serves all."""
    columns = {}
    for name in _chosen("parameters", list(parameters), [name for name in sizes if name != "omega_start"]):
        columns[name] = np.asarray(parameters[name], dtype=np.float64)
    columns["omega_start"] = np.asarray(omega_start, dtype=np.float64)
    for name, array in columns.items():
        is_list = name in ARRAYS
        columns[name] = array[None] if array.ndim == is_list else array
        if columns[name].ndim != 1 + is_list or (is_list and array.shape[-1] != sizes[name]):
            shape = f"(S, C) or (C,) with C = {sizes[name]}" if is_list else "(S,) or ()"
            raise ValueError(f"`{name}` must have the shape {shape}, got {array.shape}.")
    return columns


def _rows(columns: Mapping[str, FloatArray], paths: FloatArray) -> int:
    """The number of rows; raises ValueError if arrays disagree."""
    counts = {name: len(array) for name, array in columns.items()}
    if paths.ndim == 2:
        counts["displacement"] = len(paths)
    several = {name: count for name, count in counts.items() if count != 1}
    if len(set(several.values())) > 1 or 0 in several.values():
        raise ValueError(f"All arrays must have one row for each spring or path, got {several}.")
    return next(iter(several.values()), 1)


def _possible(base: SpringParameters, columns: Mapping[str, FloatArray], impossible: str) -> NDArray[np.bool_]:
    """Whether each distinct set of parameters is a possible spring."""
    if impossible not in ("refuse", "nan"):
        raise ValueError(f"`impossible` must be 'refuse' or 'nan', got {impossible!r}.")
    possible = np.ones(max((len(column) for column in columns.values()), default=1), dtype=bool)
    if _HYSTERETIC.issuperset(columns):
        # Each of them has limits of its own: if the least and the largest are possible, all are.
        with suppress(ValueError):
            for end in (np.min, np.max):
                ends: dict[str, Any] = {name: float(end(column)) for name, column in columns.items()}
                replace(base, **ends)
            return possible
    for row in range(possible.size):
        values: dict[str, Any] = {name: column[row % len(column)].tolist() for name, column in columns.items()}
        try:
            replace(base, **values)
        except ValueError as problem:
            if impossible == "refuse":
                raise ModelError(f"Set {row} of the parameters is not a possible spring: {problem}") from None
            possible[row] = False
    return possible
