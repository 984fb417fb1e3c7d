"""`Spring`: a spring along paths, and its model file; `responses`: many of them, with gradients."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import MethodType
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

import strandspring as public

from ..campaigns.jobs.threads import in_threads, usable_cores
from ..core.parameters import ARRAYS, SCALARS, SpringParameters
from ..errors import ModelError
from ..ground.arguments import flag, numbers, workers_of
from ..ground.options import Option, takes
from ..ground.plotfile import some_axes
from ..kernel.arrays import FloatArray
from ..kernel.branches import as_times, require_plain
from ..kernel.many_paths import QUANTITIES, along_paths, gradient_fields, spring_rows
from ..kernel.path import OmegaStart, PathSolver, as_path, warn_outside
from ..loops.loop import steady_loop
from ..model.joint import HYSTERETIC_PARAMETERS
from ..model.modelfile import ModelFile, load_model, save_model
from .common.model_source import ModelSource, model_of
from .common.text import shape_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Made = TypeVar("Made")
Quantity: TypeAlias = Literal["force", "stiffness", "absorbed_energy"]

_HYSTERETIC = {"kappa_omega", "rho", "sigma", "n"}
_RESOLUTION = Option("number", "Resolution of the displacement", "m", least=0.0)
_OMEGA_START = Option("number", "Normalized hysteretic variable at the start", least=-1.0, most=1.0)
_CHUNKS = 4  # for each thread, so that all finish together


@dataclass(frozen=True, eq=False)
class Responses:
    """What `responses` computed; S is the number of springs or paths, K that of samples.

    Attributes
    ----------
    values : dict of ndarray, shape (S, K)   By quantity; there are properties of these names.
    gradients : dict of dict of ndarray
        By quantity and parameter, such as ``gradients["force"]["rho"]``, in the quotient of units:
        shape (S, K), or (S, C, K) of a list of C coefficients.
    possible : ndarray of bool, shape (S,)   False where the parameters are not a spring: rows are NaN.
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
    quantities : sequence of str     Of "force", "stiffness" and "absorbed_energy".
    by : sequence of str, or "all"   Parameters, and "omega_start", by which gradients are wanted.
    impossible : "refuse" or "nan"   What is done with parameters that are not a possible spring.
    coarse : bool                    Omega to 1e-8 only: tables of W take a quarter of the time.
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

    Unless `coarse`, each row has the same bits as the methods of `Spring` give. Gradients are
    derivatives of the same closed forms at a path that is held, of the energy integrals of those
    of the force. At a turning point a stiffness is that before it.

    Parameters
    ----------
    model : Spring, ModelFile or path   What `parameters` does not give is that of this spring.
    displacement : array_like, shape (K,) or (S, K)   One path for all, or one for each [m].
    parameters : mapping or None
        By names of `SpringParameters`, in SI units: numbers or arrays of shape (S,), of kE, kA, FE_knots and FE_forces
        of shape (C,) or (S, C), with as many coefficients as the model has.
    omega_start : float or array_like, shape (S,)   Normalized hysteretic variable at the start.
    computing : Computing               What is computed, and how; or its fields as keywords.

    Warns
    -----
    UserWarning  If a path leaves the model's identified range by more than 1 % of it.

    Raises
    ------
    ModelError   If a set of parameters is not a possible spring, and is not to be NaN.
    ValueError   If shapes do not agree, a name is unknown, or a number is out of bounds.

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
    base, coarse = model_of(model).parameters, flag("coarse", computing.coarse)
    require_plain(base, "`responses`")
    # Where the derivatives by the values of each parameter are in a gradient of the kernel.
    sizes = {name: len(getattr(base, name)) for name in ARRAYS if getattr(base, name)}
    sizes |= dict.fromkeys((*SCALARS, "omega_start"), 1)
    places = {name: gradient_fields(name, size) for name, size in sizes.items()}
    wanted = _chosen("quantities", computing.quantities, QUANTITIES)
    names = list(places) if computing.by == "all" else _chosen("by", computing.by, places)
    paths = np.asarray(displacement, dtype=np.float64)
    if paths.ndim not in (1, 2) or not paths.size:
        raise ValueError(f"`displacement` must have shape (K,) or (S, K), got shape {paths.shape}.")
    warn_outside(as_path(paths.ravel()), base.displacement_min, base.displacement_max, stacklevel=3)
    # With a first axis of length 1 where one serves all.
    given, columns = {"omega_start": omega_start, **(parameters or {})}, dict[str, FloatArray]()
    for name in _chosen("parameters", list(given), sizes):
        array, shape = np.asarray(given[name], dtype=np.float64), (sizes[name],) if name in ARRAYS else ()
        columns[name] = array[None] if array.ndim == len(shape) else array
        if columns[name].shape[1:] != shape:
            form = f"(S, C) or (C,) with C = {sizes[name]}" if shape else "(S,) or ()"
            raise ValueError(f"`{name}` must have the shape {form}, got {array.shape}.")
    counts = {"displacement": len(paths) if paths.ndim == 2 else 1, **{name: len(of) for name, of in columns.items()}}
    several = {name: count for name, count in counts.items() if count != 1}
    if len({*several.values()}) > 1 or 0 in several.values():
        raise ValueError(f"All arrays must have one row for each spring or path, got {several}.")
    rows = next(iter(several.values()), 1)
    starts = np.broadcast_to(columns.pop("omega_start"), rows)
    for end in (np.min, np.max):
        _OMEGA_START.checked("omega_start", float(end(starts)), ValueError)
    possible = np.resize(_possible(base, columns, computing.impossible), rows)
    springs = spring_rows(base, rows, columns)
    springs[~possible] = spring_rows(base, 1, {})
    fields = [field for name in names for field in places[name]]
    values = {name: np.empty((rows, paths.shape[-1])) for name in wanted}
    slopes = {name: np.empty((rows, len(fields), paths.shape[-1])) for name in wanted if fields}

    def fill(part: slice) -> None:
        own_path = paths if paths.ndim == 1 else paths[part]
        own, slope = ({name: array[part] for name, array in arrays.items()} for arrays in (values, slopes))
        along_paths(springs[part], own_path, starts[part], own, fields, slope, coarse)

    count = workers_of(computing.workers) or usable_cores()
    step = -(-rows // (_CHUNKS * count))
    list(in_threads((partial(fill, slice(k, k + step)) for k in range(0, rows, step)), count))
    for array in (*values.values(), *slopes.values()):
        array[~possible] = np.nan
    gradients, ends = dict[str, dict[str, FloatArray]](), np.cumsum([sizes[name] for name in names])[:-1]
    for quantity, array in slopes.items():
        parts = zip(names, np.split(array, ends, axis=1), strict=True)
        gradients[quantity] = {name: part if name in ARRAYS else part[:, 0] for name, part in parts}
    return Responses(values, gradients, possible)


def _chosen(argument: str, names: Sequence[str], known: Iterable[str]) -> list[str]:
    """The names, each once; raises ValueError for one that is not known."""
    chosen = [names] if isinstance(names, str) else list(dict.fromkeys(names))
    for name in chosen:
        if name not in known:
            raise ValueError(f"`{argument}` must be of {', '.join(known)}, got {name!r:.40}.")
    return chosen


def _possible(base: SpringParameters, columns: Mapping[str, FloatArray], impossible: str) -> NDArray[np.bool_]:
    """Whether each distinct set of parameters is a possible spring."""
    _chosen("impossible", impossible, ("refuse", "nan"))
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


@dataclass(frozen=True)
class _Method(Generic[Made]):
    """A function of the package as a method, loaded when it is asked for."""

    function: Callable[[], Callable[..., Made]]

    def __get__(self, spring: Spring | None, owner: type[Spring]) -> Callable[..., Made]:
        return self.function() if spring is None else MethodType(self.function(), spring)


class Spring:
    """A hysteretic spring: modified normalized Bouc-Wen model of Zhao et al. 2013 in closed form.

    Parameters
    ----------
    parameters : SpringParameters
    name : str          Identifier for the model file and the FMU.
    description : str   Free text.

    Raises
    ------
    ModelError          If the name is not an identifier, or the description is not plain text.
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
        self.model = ModelFile(name, parameters, description)
        self.parameters = parameters
        self._solver = PathSolver(parameters)

    def __eq__(self, other: object) -> bool:
        """Whether all that a model file holds is equal."""
        return self.model == other.model if isinstance(other, Spring) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.model.name, self.parameters))

    def __repr__(self) -> str:
        p = self.parameters
        figures = [f"{c.key} {c.text(getattr(p, c.key))} {c.shown}".strip() for c in HYSTERETIC_PARAMETERS]
        more = [] if p.is_plain else [f"{len(p.mechanisms)} mechanisms, {len(p.branches)} branches"]
        return f"<Spring {self.model.name}: {', '.join([*figures, *more, shape_of(p)])}>"

    @classmethod
    def from_model(cls, model: ModelFile) -> Spring:
        """The spring of a model in memory."""
        spring = cls(model.parameters)
        spring.model = model
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
        """Restoring force along a displacement path, paper eqs. (10)-(11), shape (K,) [N], exact for any sampling.

        Maxwell branches begin without force; theirs is exact at constant velocity between samples.

        Parameters
        ----------
        displacement : array_like, shape (K,)   [m]; the path starts at the first sample.
        omega_start : float or (float, float)
            Normalized hysteretic variable at the start, within [-1, 1], of all mechanisms or of each.
        time : array_like or None, shape (K,)   [s], not falling; a spring with branches needs it.
        input_resolution : float
            Last digit or noise of the displacement's sensor [m]: friction does not follow smaller
            reversals, and is exact from twice this behind a turning point.

        Warns
        -----
        UserWarning   If the path leaves the identified range by more than 1 % of it.

        Raises
        ------
        ValueError    If a number is not finite or out of bounds, or the times are missing.
        """
        resolution = _RESOLUTION.checked("input_resolution", input_resolution, ValueError)
        return self._solver.force(*self._path(displacement, omega_start, time), resolution)

    def omega(self, displacement: ArrayLike, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Normalized hysteretic variable of the first mechanism, shape (K,) [-]; arguments as for `response`."""
        return self._solver.omega(*self._path(displacement, omega_start, is_bounded=False)[:2])

    def stiffness(self, displacement: ArrayLike, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Tangent stiffness in the direction of motion, shape (K,) [N/m], with branches that of fast motion."""
        return self._solver.stiffness(*self._path(displacement, omega_start)[:2])

    def absorbed_energy(
        self, displacement: ArrayLike, omega_start: OmegaStart = 0.0, time: ArrayLike | None = None
    ) -> FloatArray:
        """Integral of the force over the displacement, shape (K,) [J]; arguments as for `response`."""
        return self._solver.absorbed_energy(*self._path(displacement, omega_start, time))

    def stored_energy(self, displacement: ArrayLike, time: ArrayLike | None = None) -> FloatArray:
        """The part of `absorbed_energy` that the springs of the Maxwell branches hold, shape (K,) [J]."""
        return self._solver.stored_energy(*self._path(displacement, 0.0, time, is_bounded=False)[::2])

    def _path(
        self, displacement: ArrayLike, omega_start: OmegaStart, time: ArrayLike | None = None, is_bounded: bool = True
    ) -> tuple[FloatArray, OmegaStart, FloatArray | None]:
        """What a solver takes; if bounded, the caller's caller is warned beyond the range."""
        path, given = as_path(displacement), numbers("omega_start", omega_start)
        starts = [_OMEGA_START.checked("omega_start", start, ValueError) for start in given]
        if len(starts) not in (1, 2):
            raise ValueError(f"`omega_start` must be one number or two, got {len(starts)}.")
        times = None if time is None else as_times(time, path.size)
        if is_bounded:
            warn_outside(path, self.parameters.displacement_min, self.parameters.displacement_max, stacklevel=3)
        return path, (starts[0], starts[-1]), times

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw steady loops over the identified range, and over quarters less of it; in new axes if None."""
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
    predict = _Method(lambda: public.predict)
    info = _Method(lambda: public.info)
    synthesize = _Method(lambda: public.synthesize)
    compare = _Method(lambda: public.compare)
    isolate = _Method(lambda: public.isolate)
    study = _Method(lambda: public.study)
    build_fmu = _Method(lambda: public.build_fmu)
    export = _Method(lambda: public.export)
    responses = _Method(lambda: public.responses)
