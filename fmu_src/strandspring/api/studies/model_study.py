"""`study`: how resonance and isolation scatter over masses, levels and the uncertainty of a model."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from ...campaigns.jobs.options import Workers
from ...campaigns.studies.definition import Study
from ...core.parameters import SpringParameters
from ...errors import IsolationError, ModelError, OptionError
from ...ground.arguments import numbers
from ...ground.files import readable
from ...ground.options import changed, refuse_given, takes
from ...model.coordinates import counted_from
from ...model.joint import JointCovariance
from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ...vibration.one_mass.options import Curve, Excitation, Levels, Mount
from ...vibration.one_mass.system import IsolatedMass, free_travel, static_equilibrium
from ...vibration.options import Part, Run, StudyRun
from ..common.model_source import OF_MODELS, OF_SYSTEMS, ModelSource, is_system, model_of, origin_of, path_of
from ..common.progress import Progress, unseen
from .study_result import StudyResult, executed

if TYPE_CHECKING:
    from ...campaigns.studies.varied import Given
    from ...vibration.description.system_file import SystemFile

_DEFAULT_SHARE = 0.01  # of the free travel
_DRAWS = 100
_CURVE = Curve(points=24)
_INSTEAD = "; give values of it to {to[vary]}, such as body.box.mass=15 kg:25 kg:5."


@takes(levels=Levels, mount=Mount, curve=_CURVE, part=Part, run=StudyRun, placing=Workers)
def study(
    model: ModelSource | SystemFile,
    mass: ArrayLike | None = None,
    *,
    vary: Mapping[str, Given] | None = None,
    levels: Levels,
    stiffness: ArrayLike = 1.0,
    mount: Mount,
    curve: Curve,
    part: Part,
    run: StudyRun,
    zero: str | float | None = None,
    placing: Workers,
    output: str | os.PathLike[str] | None = None,
    progress: Progress = unseen,
) -> StudyResult:
    """Run a model over masses, levels, stiffness factors and springs drawn from its uncertainty, or simulate a
    SYSTEM.toml over a grid of its values.

    Draw k of a seed is the same spring in every study. A refused run, for instance one whose motion leaves the
    identified range, is a row with the reason. Of a system every grid point is checked as the file is, and every run
    draws what `simulate` draws; figures are the upper ends of their ranges.

    Parameters
    ----------
    model : Spring, or path of a model file, FMU or SYSTEM.toml
    mass : float or array_like     On the mount of a model, each [kg].
    vary : mapping                 Of a system: values of each path, such as "body.box.mass"; `*` stands for all entries
                                   of a list. Text is LOW:HIGH:COUNT or a list with commas, with one unit:
                                   "15 kg:25 kg:5", "4,6,8"; percent are of what the file says. Other numbers are in
                                   what its `units` state. The value of "mount.NAME.places" is how many of the places
                                   have a mount, from the first on.
    levels : Levels                What shakes a model; or its fields as keywords. If nothing is given, a base
                                   displacement of 1 % of the free travel under the smallest mass.
    stiffness : float or array_like   Factors on all forces of the spring of a model.
    mount, curve : Mount, Curve    Of a model, as for `isolate`; or their fields as keywords.
    part : Part                    Cases and candidates of a system; or its fields as keywords.
    run : StudyRun                 Draws, their seed, and the time step of a system; or its fields as keywords.
    zero : str, float or None      Of a model, as for `isolate`.
    placing : Workers              Where the runs are executed, in this process by default; or its fields as keywords. A
                                   script that asks for more than one worker must call this below
                                   ``if __name__ == "__main__":``.
    output : path or None          File with one line for each run. Finished runs are kept beside it until all are done,
                                   and the same call continues from there.
    progress : callable            Is called with what is being done, the number of finished runs, and how many there
                                   are.

    Returns
    -------
    StudyResult or StudyResult

    Raises
    ------
    ModelError           If the model is not a physically possible spring, or has no uncertainty to draw from.
    IsolationError       If an argument is out of bounds, there is no static equilibrium from which to choose the level,
                         or the runs cannot be executed.
    MountedSystemError   If the SYSTEM.toml is wrong, or a path or a name is unknown.
    OptionError          If an option does not apply to what is given.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, study
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> result = study(spring, mass=[5.0, 6.0], base_displacement=2e-4, draws=0, points=8)
    >>> result.to_frame()[["mass", "frequency", "transmissibility"]].round(1)
       mass  frequency  transmissibility
    0   5.0        7.7               8.6
    1   6.0        7.1               8.6
    >>> import strandspring
    >>> from strandspring.examples.system_models import SYSTEMS
    >>> box = SYSTEMS / "electronics_box.toml"
    >>> result = strandspring.study(box, vary={"body.box.mass": "15 kg:25 kg:3"}, cases="drop", candidates="softer")
    >>> result.quantiles()[["body.box.mass [kg]", "verdict", "stroke_median"]].round(2)
       body.box.mass [kg]      verdict  stroke_median
    0                15.0         pass           0.65
    1                20.0         pass           0.76
    2                25.0  not decided           0.85
    """
    path = path_of(model)
    where = path or "a model"
    if output is not None and path is not None and Path(output).resolve() == Path(path).resolve():
        raise IsolationError(f"`output` {readable(path)} would overwrite the input; write elsewhere.")
    if is_system(model):
        of_model = {"mass": mass, "zero": zero, "stiffness": None if stiffness == 1.0 else stiffness, **changed(levels)}
        refuse_given(f"{OF_MODELS}{_INSTEAD}", where, **of_model, **changed(mount), **changed(curve, _CURVE))
        if vary is None:
            raise OptionError("Give values to {to[vary]} of {where}.", where=where)
        from .system_study import studied_system  # slow to import

        return studied_system(where, vary, part, Run(run.draws, run.seed, run.step), placing, output, progress)
    of_system = {"vary": vary, **changed(part), "step": run.step, "directions": levels.directions, "at": levels.at}
    refuse_given(OF_SYSTEMS, where, **of_system, base_rotation=levels.rotation)
    if mass is None:
        raise OptionError("Give the {to[mass]} on the spring of {where}.", where=where)
    content = model_of(model)  # type: ignore[arg-type]  # no SystemFile
    origin = origin_of(model, zero, content.parameters)
    spring = counted_from(origin, content.parameters)
    masses = numbers("mass", mass, "kg")
    given = levels.chosen
    if given is None:
        if not masses:
            raise IsolationError("`mass` must hold at least one mass [kg].")
        lightest = IsolatedMass(spring, min(masses), mount)
        travel = free_travel(lightest, static_equilibrium(lightest))
        given = Excitation.BASE_DISPLACEMENT, (_DEFAULT_SHARE * travel,)
    draws = _DRAWS if run.draws is None else run.draws
    planned = Study(
        spring=spring,
        excitation=given[0],
        masses=masses,
        levels=given[1],
        stiffness_factors=numbers("stiffness", stiffness),
        draws=draws,
        seed=run.seed or 0,
        spread=_spread(model, spring, content) if draws else None,
        mount=mount,
        curve=curve,
    )
    execution = executed(planned, placing, output, progress)
    return StudyResult(planned, *execution, tuple(cautions_in_use(content.name, content)), content.name, origin)


def _spread(source: object, spring: SpringParameters, content: ModelFile) -> JointCovariance:
    try:
        return JointCovariance.to_draw_from(spring, content.uncertainty)
    except ModelError as problem:
        sentence = "{where}: {problem} Or ask for no draws ({to[draws=0]})."
        raise ModelError(sentence, where=path_of(source) or content.name, problem=problem) from None
