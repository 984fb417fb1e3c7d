"""`responses`: many springs along a path, or one spring along many, with gradients by the parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..campaigns.jobs.threads import in_threads, usable_cores
from ..core.parameters import ARRAYS, SCALARS, SpringParameters
from ..errors import ModelError
from ..ground.arguments import flag, workers_of
from ..ground.options import takes
from ..kernel.arrays import FloatArray
from ..kernel.branches import require_plain
from ..kernel.many_paths import QUANTITIES, along_paths, gradient_fields, spring_rows
from ..kernel.path import as_path, warn_outside
from .common.model_source import ModelSource, model_of

Quantity: TypeAlias = Literal["force", "stiffness", "absorbed_energy"]

_HYSTERETIC = {"kappa_omega", "rho", "sigma", "n"}
_CHUNKS = 4  # for each thread, so that all finish at about the same time


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
    places = {name: gradient_fields(name, size) for name, size in _sizes(base).items()}
    names = list(places) if isinstance(by, str) and by == "all" else _chosen("by", by, places)
    paths = np.asarray(displacement, dtype=np.float64)
    if paths.ndim not in (1, 2) or not paths.size:
        raise ValueError(f"`displacement` must have shape (K,) or (S, K), got shape {paths.shape}.")
    warn_outside(as_path(paths.ravel()), base.displacement_min, base.displacement_max, stacklevel=3)
    columns = _columns(base, parameters or {}, omega_start)
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


def _sizes(base: SpringParameters) -> dict[str, int]:
    """How many values each parameter of a gradient has."""
    lists = {name: len(getattr(base, name)) for name in ARRAYS if getattr(base, name)}
    return {**lists, **dict.fromkeys((*SCALARS, "omega_start"), 1)}


def _chosen(argument: str, names: Sequence[str], known: Iterable[str]) -> list[str]:
    """The names, each once; raises ValueError for one that is not known."""
    chosen = [names] if isinstance(names, str) else list(dict.fromkeys(names))
    for name in chosen:
        if name not in known:
            raise ValueError(f"`{argument}` must be of {', '.join(known)}, got {name!r:.40}.")
    return chosen


def _columns(
    base: SpringParameters, parameters: Mapping[str, ArrayLike], omega_start: ArrayLike
) -> dict[str, FloatArray]:
    """Arrays of the parameters given, and of omega_start, all with a first axis: of length 1 where one serves all."""
    columns = {}
    sizes = _sizes(base)
    for name, given in {**parameters, "omega_start": omega_start}.items():
        if name not in sizes or (name == "omega_start" and name in parameters):
            known = ", ".join(list(sizes)[:-1])
            raise ValueError(f"`parameters` must be of {known}, got {name!r:.40}.")
        array = np.asarray(given, dtype=np.float64)
        shape = "(S, C) or (C,)" if name in ARRAYS else "(S,) or ()"
        most = 2 if name in ARRAYS else 1
        if array.ndim == most - 1:
            array = array[None]
        if array.ndim != most or (name in ARRAYS and array.shape[1] != sizes[name]):
            of_model = f" with C = {sizes[name]}" if name in ARRAYS else ""
            raise ValueError(f"`{name}` must have the shape {shape}{of_model}, got {np.shape(given)}.")
        columns[name] = array
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
