"""The joint covariance of all coefficients of a spring, as a model file holds it, and springs drawn from it.

The coefficients of FE and FA and the logarithms of kappa_omega, rho, sigma and n are jointly normal about the
identified values, which is what the identification itself says: it fits ln(rho), ln(sigma) and ln(n), and its errors
follow by linear propagation. So kappa_omega, rho and n stay positive for every draw. A sigma drawn below 1/2 becomes
1/2, as the identification ends there too; n and sigma are kept in the same way within the ranges of the model. A draw
with an FA that is not positive is no spring, and is drawn again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from ..core.branches import TIME_CONSTANT_RANGE, MaxwellBranch, Mechanism
from ..core.parameters import N_RANGE, SIGMA_RANGE, SpringParameters
from ..errors import ModelError
from ..ground.result_columns import ResultColumn

if TYPE_CHECKING:
    from ..kernel.arrays import FloatArray

LEVEL = 0.95  # of intervals in model files
NORMAL_95 = 1.959964  # 97.5 % quantile
# The parameters of the hysteresis, whose logarithms have the covariance; and their units.
HYSTERETIC_PARAMETERS = (
    ResultColumn("kappa_omega", "N", "saturated hysteretic force at mid-range", "kappa_omega", "N"),
    ResultColumn("rho", "1/m", "slope of omega at its zero crossing", "rho", "1/m"),
    ResultColumn("sigma", "1", "recovery after a reversal", "sigma"),
    ResultColumn("n", "1", "smoothness of the knee", "n"),
)
HYSTERETIC_UNITS = {column.key: column.unit for column in HYSTERETIC_PARAMETERS}
# Of a standard deviation, times the power of the displacement that the coefficient belongs to: its square is a number,
# and no record leaves so much open.
LARGEST_SPREAD = 1e30
_RANGES = {"sigma": SIGMA_RANGE, "n": N_RANGE, "time_constant": TIME_CONSTANT_RANGE}
# Standard error over value beyond which a parameter counts as undetermined.
_LARGEST_RELATIVE = 10.0
# Of differences for standard errors, in standard deviations; the small ones are for an FA of nearly zero somewhere.
_STEPS = (0.01, 1e-4, 1e-6)
_TRIES = 1000  # draws before a covariance is refused that hardly holds a spring


@dataclass(frozen=True)
class ForceInterval:
    """95 % interval of a measured force F: +- sqrt(q^2*(a^2 + (b*F)^2) + z^2*max(0, e^2 - m^2)).

    a and b are the parts of the residuals, noise and misfit together, that do not grow and that grow with the force, q
    is calibrated on blocks of strokes that were held out, and the last term, of the standard error e of the prediction
    and the largest one m along the records, widens it where a path asks for more than these have shown.

    Attributes
    ----------
    factor, additive, relative : float   q [-], a [N], b [-].
    error : float                        m, the largest standard error of the prediction along the records [N].
    half_width : float                   Root mean square over the records [N].
    held_out_coverage : float or None    Share of the samples of each held-out block inside the interval that the others
                                         give; None without blocks.
    held_out_cycles : float              Number of cycles that were held out, block by block.
    """

    factor: float
    additive: float
    relative: float
    error: float
    half_width: float
    held_out_coverage: float | None
    held_out_cycles: float

    @property
    def sentence(self) -> str:
        """The interval with what it held, in words."""
        share, held = self.held_out_coverage, "not tried on held-out strokes"
        if share is not None:
            held = f"holds {100.0 * share:.0f} % of held-out strokes{': it is too narrow' if share < 0.9 else ''}"
        return f"95 % prediction interval +- {self.half_width:.2g} N, {held}"

    def reach(self, force: FloatArray, error: FloatArray) -> FloatArray:
        """Half-width [N] at predicted forces [N] of these standard errors [N]."""
        import numpy as np  # model files are read without it

        scale = self.additive**2 + (self.relative * force) ** 2
        beyond = np.maximum(error**2 - self.error**2, 0.0)
        return np.asarray(np.sqrt(self.factor**2 * scale + NORMAL_95**2 * beyond))

    def as_json(self) -> dict[str, Any]:
        """Content of the model file's field `uncertainty.prediction_interval`."""
        return {"level": LEVEL, **asdict(self)}

    @classmethod
    def from_uncertainty(cls, uncertainty: Mapping[str, Any]) -> ForceInterval | None:
        """The interval in a checked `uncertainty` of a model file; None if it holds none."""
        given = uncertainty.get("prediction_interval")
        return given and cls(**{field.name: given.get(field.name) for field in fields(cls)})


@dataclass(frozen=True)
class JointCovariance:
    """Covariance L*L' of kE or FE_forces, of kA without kA[0], and of ln(kappa_omega), ln(rho), ln(sigma) and ln(n).

    Parameters
    ----------
    root : tuple of tuples of float   Rows of the lower triangular matrix L: 1 number, 2 numbers, and so on.
    """

    root: tuple[tuple[float, ...], ...]

    @classmethod
    def from_uncertainty(cls, spring: SpringParameters, uncertainty: Mapping[str, Any]) -> JointCovariance | None:
        """The covariance in a model file's `uncertainty`; None if it holds none.

        Parameters
        ----------
        spring : SpringParameters
        uncertainty : mapping       Of the types of `file_tables.Uncertainty`.

        Raises
        ------
        ModelError                  If it is not that of the spring.
        """
        given = uncertainty.get("joint")
        if given is None:
            return None
        names = names_of(spring)
        if given["parameters"] != names:
            raise ModelError(
                f'field "uncertainty.joint.parameters" must be {names}; identify the spring again, or remove the field '
                '"uncertainty.joint".'
            )
        rows = given["root"]
        if [len(row) for row in rows] != list(range(1, len(names) + 1)):
            raise ModelError(
                'field "uncertainty.joint.root" must hold the rows of a lower triangular matrix: lists of 1 to '
                f'{len(names)} numbers; identify the spring again, or remove the field "uncertainty.joint".'
            )
        reach = max(-spring.x_min, spring.x_max)
        for name, power, row in zip(names, _powers(spring), rows, strict=True):
            largest = max(map(abs, row))
            if not largest * reach**power <= LARGEST_SPREAD:
                raise ModelError(
                    f'field "uncertainty.joint.root" must hold standard deviations of at most {LARGEST_SPREAD:g} over '
                    f"the identified range, got {largest:g} for {name}; identify the spring again, or remove the field "
                    '"uncertainty.joint".'
                )
        return cls(tuple(tuple(float(value) for value in row) for row in rows))

    @classmethod
    def to_draw_from(cls, spring: SpringParameters, uncertainty: Mapping[str, Any]) -> JointCovariance:
        """The covariance, if springs can be drawn from it.

        Raises
        ------
        ModelError   If there is none, or if a parameter is hardly known.
        """
        joint = cls.from_uncertainty(spring, uncertainty)
        if joint is None:
            raise ModelError(
                'field "uncertainty" holds no joint covariance of the coefficients to draw from; identify with the '
                "refined method."
            )
        for name, row in zip(HYSTERETIC_UNITS, joint.root[-len(HYSTERETIC_UNITS) :], strict=True):
            share = math.hypot(*row)
            if share > _LARGEST_RELATIVE:
                raise ModelError(
                    f'field "uncertainty.joint" says that {name} is known to {100.0 * share:.0f} % only, too little '
                    "to draw from; identify from records that determine it."
                )
        return joint

    def draw(self, spring: SpringParameters, seed: int, number: int) -> SpringParameters:
        """Draw a spring; the same seed and number give the same spring, whatever was drawn before.

        Raises
        ------
        ModelError   If hardly any draw is a physically possible spring.
        """
        import numpy as np  # model files are read without it

        generator = np.random.default_rng((seed, number))
        for _ in range(_TRIES):
            with suppress(ValueError):
                return self.moved(spring, generator.standard_normal(len(self.root)).tolist())
        raise ModelError(
            f"None of {_TRIES} springs drawn from the model's uncertainty is physically possible (FA > 0); identify "
            "from records that determine FA, or with a lower degree of FA."
        )

    def errors(self, spring: SpringParameters, of: Callable[[SpringParameters], FloatArray]) -> FloatArray:
        """Standard errors of what a function makes of a spring; see `changes`."""
        errors: FloatArray = (self.changes(spring, of) ** 2).sum(axis=0) ** 0.5
        return errors

    def changes(self, spring: SpringParameters, of: Callable[[SpringParameters], FloatArray]) -> FloatArray:
        """Derivatives of what a function makes of a spring by each column of L, by differences, shape (m, ...); raises
        ModelError if the covariance is so large that no neighbour of the spring is physically possible.
        """
        import numpy as np  # model files are read without it

        changes = []
        for unit in np.eye(len(self.root)):
            for step in _STEPS:
                with suppress(ValueError):  # FA not positive: no spring
                    up, down = (of(self.moved(spring, (side * step * unit).tolist())) for side in (1.0, -1.0))
                    changes.append((up - down) / (2.0 * step))
                    break
            else:
                raise ModelError(
                    f'field "uncertainty.joint" is not possible: at {_STEPS[-1]:g} standard deviations from the spring '
                    'there is no other; identify the spring again, or remove the field "uncertainty.joint".'
                )
        return np.asarray(changes)

    def moved(self, spring: SpringParameters, direction: Sequence[float]) -> SpringParameters:
        """The spring at L*direction from the identified one; n and sigma are kept within the ranges of the model.

        Parameters
        ----------
        spring : SpringParameters
        direction : sequence of float   As many numbers as L has rows, in standard deviations.

        Raises
        ------
        ValueError                      If that is not a physically possible spring.
        """
        changes = [math.fsum(a * z for a, z in zip(row, direction, strict=False)) for row in self.root]
        of_elastic = getattr(spring, spring.elastic_name)
        elastic, amplifier = len(of_elastic), len(spring.kA) - 1
        added = len(changes) - amplifier - len(HYSTERETIC_UNITS)
        logarithms = dict(zip(HYSTERETIC_UNITS, changes[added + amplifier :], strict=True))
        further = dict(zip(further_names(spring), changes[elastic:added], strict=True))
        values: dict[str, Any] = {spring.elastic_name: tuple(map(sum, zip(of_elastic, changes[:elastic], strict=True)))}
        for name, change in logarithms.items():
            values[name] = _grown(name, getattr(spring, name), change)
        return replace(
            spring,
            kA=(1.0, *map(sum, zip(spring.kA[1:], changes[added : added + amplifier], strict=True))),
            second=spring.second and _moved_second(spring.second, further),
            branches=tuple(
                MaxwellBranch(
                    *(
                        _grown(name, getattr(branch, name), further[f"ln branches[{j}].{name}"])
                        for name in ("stiffness", "time_constant")
                    )
                )
                for j, branch in enumerate(spring.branches)
            ),
            **values,
        )


def _grown(name: str, value: float, change: float) -> float:
    """A parameter whose logarithm has changed, within the range of the model."""
    low, high = _RANGES.get(name, (0.0, math.inf))
    return min(max(value * math.exp(min(change, 700.0)), low), high)


def _moved_second(second: Mechanism, changes: Mapping[str, float]) -> Mechanism:
    """A second mechanism whose coefficients and logarithms have changed, by name."""
    kA = (1.0, *(value + changes[f"second.kA[{k}]"] for k, value in enumerate(second.kA[1:], start=1)))
    values = {name: _grown(name, getattr(second, name), changes[f"ln second.{name}"]) for name in HYSTERETIC_UNITS}
    return Mechanism(kA, **values)


def further_names(spring: SpringParameters) -> list[str]:
    """Names of the coefficients of a second mechanism and of branches, in the order of the joint covariance."""
    names = []
    if spring.second is not None:
        names += [f"second.kA[{k}]" for k in range(1, len(spring.second.kA))]
        names += [f"ln second.{name}" for name in HYSTERETIC_UNITS]
    for j in range(len(spring.branches)):
        names += [f"ln branches[{j}].stiffness", f"ln branches[{j}].time_constant"]
    return names


def further_columns(spring: SpringParameters) -> tuple[ResultColumn, ...]:
    """The parameters of a second mechanism and of branches whose logarithms have the covariance, named as there."""
    columns = [replace(c, key=f"second.{c.key}", short=f"second.{c.key}") for c in HYSTERETIC_PARAMETERS]
    columns = columns if spring.second is not None else []
    for j in range(len(spring.branches)):
        columns += [
            ResultColumn(name, unit, words, name, unit)
            for name, unit, words in (
                (f"branches[{j}].stiffness", "N/m", "stiffness of a branch"),
                (f"branches[{j}].time_constant", "s", "time constant of a branch"),
            )
        ]
    return tuple(columns)


def joint_names(elastic_name: str, elastic: int, amplifier: int, further: Sequence[str] = ()) -> list[str]:
    """Names of the coefficients in their order, for so many of kE or FE_forces and this degree of FA, those of a second
    mechanism and branches (`further_names`) between them.
    """
    return [
        *(f"{elastic_name}[{i}]" for i in range(elastic)),
        *further,
        *(f"kA[{i}]" for i in range(1, amplifier + 1)),
        *(f"ln {name}" for name in HYSTERETIC_UNITS),
    ]


def names_of(spring: SpringParameters) -> list[str]:
    """`joint_names` of a spring."""
    elastic = len(getattr(spring, spring.elastic_name))
    return joint_names(spring.elastic_name, elastic, len(spring.kA) - 1, further_names(spring))


def _powers(spring: SpringParameters) -> list[int]:
    """The power of the displacement that each of `joint_names` belongs to."""
    elastic = list(range(len(spring.kE))) or [0] * len(spring.FE_forces)
    further = [int(name[10:-1]) if name.startswith("second.kA") else 0 for name in further_names(spring)]
    amplifier = list(range(1, len(spring.kA)))
    return [*elastic, *further, *amplifier, *[0] * len(HYSTERETIC_UNITS)]
