"""`study`: how resonance and isolation scatter over masses, levels and the uncertainty of a model."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from numpy.typing import ArrayLike

from ...campaigns.jobs.cluster import Cluster, runner_of
from ...campaigns.studies.definition import Study
from ...core.parameters import SpringParameters
from ...errors import ModelError
from ...ground.arguments import flag, limits, number, numbers, optional_number, whole
from ...ground.files import readable
from ...model.coordinates import counted_from
from ...model.joint import JointCovariance
from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ...vibration.one_mass.system import Excitation, IsolatedMass, IsolationError, free_travel, static_equilibrium
from ..common.levels import given_levels
from ..common.model_source import ModelSource, model_of, origin_of, path_of
from ..common.progress import Progress, unseen
from .study_result import StudyResult, executed

_DEFAULT_SHARE = 0.01  # of the free travel


def study(
    model: ModelSource,
    mass: ArrayLike,
    *,
    base_displacement: ArrayLike | None = None,
    base_acceleration: ArrayLike | None = None,
    force: ArrayLike | None = None,
    stiffness: ArrayLike = 1.0,
    draws: int = 100,
    seed: int = 0,
    load: float | None = None,
    parallel: int = 1,
    series: int = 1,
    damping: float = 0.0,
    band: tuple[float, float] | None = None,
    points: int = 24,
    extrapolate: bool = False,
    zero: str | float | None = None,
    workers: int | None = 1,
    scheduler: str | Cluster | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress = unseen,
    notify: Callable[[str], None] = lambda _: None,
) -> StudyResult:
    """Resonance and isolation over masses, levels, stiffness factors and springs drawn from a model's uncertainty.

    Draw k of a seed is the same spring in every study. A refused run, for instance one whose motion leaves the
    identified range, is a row with the reason.

    Parameters
    ----------
    model : Spring, or path of a model file or FMU
    mass : float or array_like     Each [kg].
    base_displacement, base_acceleration, force : float, array_like or None
        One level or several of one of them [m, m/s^2, N]; if None, a base displacement of 1 % of the free travel under
        the smallest mass.
    stiffness : float or array_like   Factors on all forces of the spring.
    draws : int                    Springs drawn at each grid point; 0 for the identified spring alone.
    seed : int
    load, parallel, series, damping, band, points, extrapolate, zero   As for `isolate`.
    workers : int or None          Number of processes; as many as cores if None. A script that asks for more than one
                                   must call this below ``if __name__ == "__main__":``.
    scheduler : str, Cluster or None
        Address of a dask.distributed scheduler, instead of workers, or a `Cluster` with certificates.
    output : path or None          File with one line for each run. Finished runs are kept beside it until all are done,
                                   and the same call continues from there.
    progress : callable            Is called with what is being done, the number of finished runs, and how many there
                                   are.
    notify : callable              Is called with a sentence while no run finishes.

    Returns
    -------
    StudyResult

    Raises
    ------
    ModelError       If the model is not a physically possible spring, or has no uncertainty to draw from.
    IsolationError   If an argument is out of bounds, there is no static equilibrium from which to choose the level, or
                     the runs cannot be executed.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, study
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> result = study(spring, mass=[5.0, 6.0], base_displacement=2e-4, draws=0, points=8)
    >>> result.to_frame()[["mass", "frequency", "transmissibility"]].round(1)
       mass  frequency  transmissibility
    0   5.0        7.7               8.6
    1   6.0        7.1               8.6
    """
    runner = runner_of(workers, scheduler, notify, IsolationError)
    path = path_of(model)
    if path is not None and Path(path).suffix.lower() == ".toml":
        raise IsolationError(f"{readable(path)} must be a model file; study the system it describes by `study_system`.")
    if output is not None and path is not None and Path(output).resolve() == Path(path).resolve():
        raise IsolationError(f"`output` {path} would overwrite the model; write elsewhere.")
    content = model_of(model)
    origin = origin_of(model, zero, content.parameters)
    spring = counted_from(origin, content.parameters)
    load, damping = optional_number("load", load, "N"), number("damping", damping, "N s/m")
    parallel, series = whole("parallel", parallel), whole("series", series)
    masses = numbers("mass", mass, "kg")
    given = given_levels(base_displacement, base_acceleration, force)
    if given is None:
        if not masses:
            raise IsolationError("`mass` must hold at least one mass [kg].")
        lightest = IsolatedMass(spring, min(masses), load, parallel, series, damping)
        travel = free_travel(lightest, static_equilibrium(lightest))
        given = Excitation.BASE_DISPLACEMENT, (_DEFAULT_SHARE * travel,)
    planned = Study(
        spring=spring,
        excitation=given[0],
        masses=masses,
        levels=given[1],
        stiffness_factors=numbers("stiffness", stiffness),
        draws=whole("draws", draws),
        seed=whole("seed", seed),
        spread=_spread(model, spring, content) if draws else None,
        load=load,
        parallel=parallel,
        series=series,
        damping=damping,
        band=None if band is None else limits("band", band, "Hz"),
        points=whole("points", points),
        extrapolate=flag("extrapolate", extrapolate),
    )

    execution = executed(planned, runner, output, progress, notify)
    return StudyResult(planned, *execution, tuple(cautions_in_use(content.name, content)), content.name, origin)


def _spread(source: object, spring: SpringParameters, content: ModelFile) -> JointCovariance:
    try:
        return JointCovariance.to_draw_from(spring, content.uncertainty)
    except ModelError as problem:
        sentence = "{where}: {problem} Or ask for no draws ({to[draws=0]})."
        raise ModelError(sentence, where=path_of(source) or content.name, problem=problem) from None
