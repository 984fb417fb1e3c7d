"""Directional and adjoint derivatives of FMI 3.0 by FMPy, and states that are saved: against FMI 2.0 and each other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, wandering_path
from springs import TABLE
from strandspring.core.parameters import SpringParameters
from strandspring.fmu.checks.check import running
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.model.modelfile import ModelFile

SPRINGS = {"polynomial": SPRING, "table": TABLE, "other": OTHER}
STEP = 1e-3


def built(folder: Path, spring: SpringParameters, fmi: int, **form: bool) -> tuple[Path, dict[str, Any]]:
    """An FMU and its variables by name."""
    model = ModelFile("spring", spring)
    fmu = build_native_fmu(model, folder, chosen_platforms("host"), zero=0.0, fmi=fmi, **form)
    return fmu, {v.name: v for v in fmpy.read_model_description(str(fmu)).modelVariables}


def size(variable: Any) -> int:
    return int(variable.dimensions[0].start) if variable.dimensions else 1


def prepared(one: Any, variables: dict[str, Any], path: np.ndarray, with_states: bool) -> None:
    """Take an instance along a path, or to a point of the form with states."""
    references = {name: variable.valueReference for name, variable in variables.items()}
    one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.setReal([references["displacement"]], [path[0]])
    if with_states:
        one.setReal([references["velocity"], references["omega"]], [0.3, -0.4])
    one.exitInitializationMode()
    for k, displacement in enumerate([] if with_states else path[1:].tolist()):
        one.setReal([references["displacement"]], [displacement])
        one.doStep(k * STEP, STEP)


def jacobian(one: Any, unknowns: list[int], knowns: list[Any]) -> np.ndarray:
    """By unit seeds, one element after the other."""
    columns = []
    for known in knowns:
        for unit in np.eye(size(known)).tolist():
            columns.append(one.getDirectionalDerivative(unknowns, [known.valueReference], unit))
    return np.array(columns).T


@pytest.mark.parametrize("arrays", [False, True], ids=["scalars", "arrays"])
@pytest.mark.parametrize("with_states", [False, True], ids=["usual", "states"])
@pytest.mark.parametrize("spring", SPRINGS)
def test_derivatives(spring: str, with_states: bool, arrays: bool, tmp_path: Path) -> None:
    path = wandering_path(SPRINGS[spring], 160, seed=11)
    found = {}
    for fmi in (2, 3):
        fmu, variables = built(tmp_path, SPRINGS[spring], fmi, with_states=with_states, arrays=arrays and fmi == 3)
        inputs = ["displacement", "velocity", "omega"] if with_states else ["displacement"]
        outputs = ["force", "stiffness", *(["der(absorbed_energy)", "der(omega)"] if with_states else [])]
        knowns = [
            *(variables[name] for name in inputs),
            *(v for v in variables.values() if v.causality == "parameter" and v.name != "input_resolution"),
        ]
        unknowns = [variables[name].valueReference for name in outputs]
        with running(fmu, model_exchange=with_states) as one:
            prepared(one, variables, path, with_states)
            found[fmi] = jacobian(one, unknowns, knowns)
            if fmi == 3:
                references = [known.valueReference for known in knowns]
                rows = [
                    one.getAdjointDerivative(unknowns, references, seed, found[3].shape[1])
                    for seed in np.eye(len(unknowns)).tolist()
                ]
                # All at once, with seeds of whole arrays.
                generator = np.random.default_rng(1)
                forward, backward = generator.normal(size=found[3].shape[1]), generator.normal(size=len(unknowns))
                along = one.getDirectionalDerivative(unknowns, references, forward.tolist())
                across = one.getAdjointDerivative(unknowns, references, backward.tolist(), found[3].shape[1])
    np.testing.assert_array_equal(found[3], found[2])
    assert np.all(np.any(found[3] != 0.0, axis=1))
    scale = np.max(np.abs(found[3]), axis=1, keepdims=True)
    assert np.max(np.abs(np.array(rows) - found[3]) / scale) <= 1e-12
    np.testing.assert_allclose(along, found[3] @ forward, rtol=1e-12, atol=1e-12 * np.max(np.abs(along)))
    np.testing.assert_allclose(across, backward @ found[3], rtol=1e-12, atol=1e-12 * np.max(np.abs(across)))
    # The scalar that both are: seed of unknowns times Jacobian times seed of knowns.
    assert np.dot(backward, along) == pytest.approx(np.dot(across, forward), rel=1e-11)


def test_output_derivatives_follow_the_last_step(tmp_path: Path) -> None:
    outputs = ("force", "stiffness", "absorbed_energy")
    path = SPRING.displacement_max * np.array([0.2, 0.7, 0.3, 0.32])
    fmu, variables = built(tmp_path, SPRING, 3, with_states=False)
    with running(fmu) as one:
        prepared(one, variables, path, with_states=False)
        references = [variables[name].valueReference for name in outputs]
        found = one.getOutputDerivatives(references, [1] * len(references))
        by_displacement = jacobian(one, references, [variables["displacement"]])[:, 0]
    expected = (path[-1] - path[-2]) / STEP * by_displacement
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert len(set(np.abs(expected))) == len(outputs)


def test_derivatives_exist_where_the_structure_says_so(tmp_path: Path) -> None:
    """A derivative that is not 0 belongs to a dependency; one that is 0 may, too."""
    fmu, variables = built(tmp_path, SPRING, 3, with_states=True)
    description = fmpy.read_model_description(str(fmu))
    knowns = [v for v in variables.values() if v.causality in ("parameter", "input") or v.name == "omega"]
    with running(fmu, model_exchange=True) as one:
        prepared(one, variables, np.array([0.3 * SPRING.displacement_max]), with_states=True)
        for unknown in (*description.outputs, *description.derivatives):
            depends = {v.name for v in unknown.dependencies}
            for known in knowns:
                row = jacobian(one, [unknown.variable.valueReference], [known])
                if np.any(row != 0.0):
                    assert known.name in depends, (unknown.variable.name, known.name)


def test_states_come_back(tmp_path: Path) -> None:
    fmu, variables = built(tmp_path, SPRING, 3, with_states=False)
    path = wandering_path(SPRING, 80, seed=2)
    outputs = [variables[name].valueReference for name in ("force", "stiffness", "absorbed_energy")]
    displacement = [variables["displacement"].valueReference]
    with running(fmu) as one:
        prepared(one, variables, path, with_states=False)
        state = one.getFMUState()
        found = []
        for _ in range(2):
            one.setReal(displacement, [path[0] + 0.004])
            one.doStep(1.0, STEP)
            found.append(one.getReal(outputs))
            one.setFMUState(state)
        one.freeFMUState(state)
    assert found[0] == found[1]
