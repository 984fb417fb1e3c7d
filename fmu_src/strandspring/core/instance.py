"""One instance of the FMU as FMI sees it: values set and read, steps, state; independent of pythonfmu.

Setting the displacement makes a trial from the committed memory, which is computed at most once; a step commits it, and
setting another displacement drops it. Restoring a state reverts to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any

from . import whole
from .branch_variables import SECOND, STORED_ENERGY
from .branches import BRANCHES
from .parameters import LARGEST_DISPLACEMENT, SpringParameters
from .state import State
from .variables import INPUT_RESOLUTION, Variable, spring_parameters, start_values, variables
from .whole import WholeLaw, WholeMemory

# Instances with the same parameters share the law and its tables, which take milliseconds to build.
_law_of = lru_cache(maxsize=16)(WholeLaw)


class RefusedCallError(ValueError):
    """An invalid call; its text is written for the user, and nothing has changed."""


class SpringInstance:
    """The behaviour of the FMU.

    Parameters
    ----------
    identified : SpringParameters   Start values of the parameters.
    warn : callable of str          Logs a warning.
    omegas : (float, float)         Start values of omega of both mechanisms.
    """

    def __init__(self, identified: SpringParameters, warn: Callable[[str], None], omegas: tuple[float, float]) -> None:
        self._warn = warn
        self._counts = identified.counts
        self._table = variables(*self._counts)
        names = [variable.name for variable in self._table]
        self._input = names.index("displacement")
        start = start_values(identified, omegas=omegas)
        settings = [v.name for v in self._table if v.causality == "parameter"]
        self._place = {name: place for place, name in enumerate(settings)}
        self._state = State(tuple(start[name] for name in settings), start["displacement"])
        self._law: WholeLaw | None = None
        self._trial: WholeMemory | None = None
        readers: dict[str, Callable[[], float]] = {
            "displacement": lambda: self._state.displacement,
            "force": partial(self._output, whole.force),
            "stiffness": partial(self._output, whole.stiffness),
            "absorbed_energy": partial(self._output, self._absorbed_energy),
            "omega": partial(self._output, lambda _, trial: trial.mechanisms[0].omega),
            f"{SECOND}omega": partial(self._output, lambda _, trial: trial.mechanisms[1].omega),
            STORED_ENERGY: partial(self._output, whole.stored_energy),
            **{f"branch_{i}_elongation": partial(self._output, partial(_elongation, i)) for i in range(BRANCHES)},
            "extrapolating": lambda: self._side() != 0,
            **{name: partial(self._setting, name) for name in settings},
        }
        self._readers = [readers[name] for name in names]

    @property
    def state(self) -> State:
        """Everything the instance remembers."""
        return self._state

    def revert(self, state: State) -> None:
        """Return to a state of this instance or of another one of the same FMU."""
        if not (isinstance(state, State) and len(state.settings) == len(self._place) and self._fits(state.memory)):
            raise RefusedCallError("The state must come from an instance of the same FMU.")
        if state.memory is None:
            self._change(state)
        else:
            self._change_to_possible(state)
        self._trial = None

    def read(self, references: Sequence[int], kind: str) -> list[Any]:
        """Values of variables of one type.

        Outputs are those of the trial: the path from the last commit to the displacement set last.
        """
        for reference in references:
            self._variable(reference, kind)
        return [self._readers[reference]() for reference in references]

    def write(self, references: Sequence[int], values: Sequence[Any], kind: str) -> None:
        """Set variables of one type, all or none: the displacement, and parameters, after initialization the tunable
        ones.

        Tunable parameters act from the committed point on, which keeps its omega.
        """
        for reference, value in zip(references, values, strict=True):
            self._require_settable(self._variable(reference, kind), value)
        state = self._state
        for reference, value in zip(references, values, strict=True):
            if reference != self._input:
                name = self._table[reference].name
                if not math.isfinite(value):
                    raise RefusedCallError(f"`{name}` must be finite, got {value!r}; the previous value is kept.")
                place = self._place[name]
                settings = (*state.settings[:place], value, *state.settings[place + 1 :])
                state = state._replace(settings=settings)
            elif abs(value) <= LARGEST_DISPLACEMENT:
                state = state._replace(displacement=value)
            else:
                raise RefusedCallError(
                    f"`displacement` must be within +-{LARGEST_DISPLACEMENT:g} m, got {value!r}; the previous value is "
                    "kept."
                )
        if state.memory is None or state.settings == self._state.settings:
            self._change(state)
        else:
            self._tune(state, state.memory)

    def end_initialization(self) -> None:
        """Start the path at the present displacement, if the parameters are physically possible."""
        state = self._state
        if state.memory is not None:
            raise RefusedCallError("Initialization has already ended; reset the instance to initialize it again.")
        self._require_law()
        self._commit(self._current_trial())

    def step(self, time: float, size: float) -> None:
        """Commit the path to the present displacement."""
        state = self._state
        if state.memory is None:
            raise RefusedCallError(f"The step at time {time!r} s was requested before the end of initialization.")
        if not (math.isfinite(size) and size >= 0.0):
            raise RefusedCallError(f"The step size at time {time!r} s must be finite and >= 0 [s], got {size!r}.")
        law = self._require_law()
        # What branches do in a step depends on its size, and until then on none.
        path = self._path(state.memory, size) if law.branches else self._current_trial()
        self._commit(whole.integrate(law, path) if state.energy_wanted else path)

    def _fits(self, memory: WholeMemory | None) -> bool:
        """Whether the memory may be one of this FMU."""
        *_, second, branches = self._counts
        counts = (1 + (second > 0), branches)
        return memory is None or (len(memory.mechanisms), len(memory.elongations)) == counts

    def _variable(self, reference: int, kind: str) -> Variable:
        if not 0 <= reference < len(self._table):
            raise RefusedCallError(
                f"There is no variable with value reference {reference}; they run from 0 to {len(self._table) - 1}."
            )
        variable = self._table[reference]
        if variable.kind != kind:
            raise RefusedCallError(f"`{variable.name}` (value reference {reference}) is {variable.kind}, not {kind}.")
        return variable

    def _require_settable(self, variable: Variable, value: Any) -> None:
        if variable.causality not in ("input", "parameter"):
            raise RefusedCallError(f"`{variable.name}` is calculated and cannot be set.")
        is_fixed = variable.variability == "fixed" and self._state.memory is not None
        # Some hosts set all parameters to what they are.
        if is_fixed and value != self._setting(variable.name):
            raise RefusedCallError(f"`{variable.name}` is fixed after initialization; reset the instance to change it.")

    def _change(self, state: State) -> None:
        if state.settings != self._state.settings:
            self._law = self._trial = None
        if state.displacement != self._state.displacement:
            self._trial = None
        self._state = state

    def _tune(self, state: State, memory: WholeMemory) -> None:
        """Change parameters of a path that has begun, if the spring that they make is physically possible."""
        previous = self._require_law()
        resolution = self._setting(INPUT_RESOLUTION)
        law = self._change_to_possible(state)
        memory = whole.change(previous, law, memory)
        if self._setting(INPUT_RESOLUTION) != resolution:
            memory = whole.caught_up(law, memory)
        self._state = state._replace(memory=memory)

    def _change_to_possible(self, state: State) -> WholeLaw:
        """The law of a state; where its parameters make no spring, nothing has changed."""
        before = self._state
        self._change(state)
        try:
            return self._require_law()
        except RefusedCallError:
            self._change(before)
            raise

    def _require_law(self) -> WholeLaw:
        """The law of the present parameters; RefusedCallError says why they are not physically possible."""
        if self._law is None:
            for name, omega_start in self._starts().items():
                if not -1.0 <= omega_start <= 1.0:
                    raise RefusedCallError(f"`{name}` must be within [-1, 1], got {omega_start!r}.")
            values = dict(zip(self._place, self._state.settings, strict=True))
            if not 0.0 <= values[INPUT_RESOLUTION] <= LARGEST_DISPLACEMENT:
                raise RefusedCallError(
                    f"`{INPUT_RESOLUTION}` must be within [0, {LARGEST_DISPLACEMENT:g}] m, got "
                    f"{values[INPUT_RESOLUTION]!r}."
                )
            try:
                self._law = _law_of(spring_parameters(values, *self._counts))
            except ValueError as problem:
                raise RefusedCallError(str(problem)) from None
        return self._law

    def _starts(self) -> dict[str, float]:
        """Where omega of each mechanism starts."""
        names = ("omega_start", f"{SECOND}omega_start")
        return {name: self._setting(name) for name in names if name in self._place}

    def _current_trial(self) -> WholeMemory:
        """The memory after the path from the last commit to the displacement set last."""
        if self._trial is None:
            state = self._state
            if state.memory is None:
                self._trial = whole.start(state.displacement, tuple(self._starts().values()), self._counts[-1])
            else:
                self._trial = self._path(state.memory, 0.0)
        return self._trial

    def _path(self, memory: WholeMemory, duration: float) -> WholeMemory:
        """The memory after the path from a committed one to the displacement set last."""
        resolution = self._setting(INPUT_RESOLUTION)
        return whole.trial(self._require_law(), memory, self._state.displacement, duration, resolution)

    def _commit(self, memory: WholeMemory) -> None:
        side = self._side()
        if side not in (0, self._state.side):
            low, high = self._setting("displacement_min"), self._setting("displacement_max")
            self._warn(
                f"`displacement` {self._state.displacement!r} m is outside the identified range "
                f"[{low!r}, {high!r}] m; the force is extrapolated until it returns."
            )
        self._state = self._state._replace(memory=memory, side=side)
        self._trial = memory

    def _setting(self, name: str) -> float:
        return self._state.settings[self._place[name]]

    def _output(self, output: Callable[[WholeLaw, WholeMemory], float]) -> float:
        return output(self._require_law(), self._current_trial())

    def _absorbed_energy(self, law: WholeLaw, trial: WholeMemory) -> float:
        if not self._state.energy_wanted:
            self._state = self._state._replace(energy_wanted=True)
        self._trial = whole.integrate(law, trial)
        return whole.absorbed_energy(law, self._trial)

    def _side(self) -> int:
        """Where the displacement is: -1 below the identified range, +1 above it, 0 inside."""
        displacement = self._state.displacement
        above = displacement > self._setting("displacement_max")
        return above - (displacement < self._setting("displacement_min"))


def _elongation(branch: int, _: WholeLaw, trial: WholeMemory) -> float:
    return trial.elongations[branch]
