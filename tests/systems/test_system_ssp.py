"""Time integration against co-simulation: an SSP system of a rigid plant in Python and a spring FMU per mount axis.

FMPy runs it by its own SSP simulation, so that nothing of the kernel's motion and of the system's FMU takes part.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.validation import validate_fmu
from scipy.spatial.transform import Rotation

from native_tools import OK
from strandspring.core.variables import FmiUnit, Variable
from strandspring.fmu.archive import write_archive
from strandspring.fmu.description.content import Backend, DescriptionContent
from strandspring.fmu.description.model_description import described
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.python_backed import slave_contents
from strandspring.fmu.system.system_variables import SystemFmuOptions
from strandspring.model.modelfile import ModelFile
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import Mount, MountAxis, RigidBody
from system_fmu_tools import ACROSS, ALONG, BOX, SHEAR, UP, VERTICAL, NativeSystem, system_library

# The body of BOX about its principal axes, on mounts without dampers, which spring FMUs do not have; one is inclined.
INCLINED = (0.6, 0.0, 0.8), (0.8, 0.0, -0.6)
SYSTEM = MountedSystem(
    (RigidBody("box", 20.0, (0.0, 0.0, 0.0), ((0.25, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.35))),),
    tuple(
        Mount(
            f"corner {k}",
            0,
            mount.place,
            (MountAxis(VERTICAL, down, 0.002), MountAxis(SHEAR, across, 0.0), MountAxis(SHEAR, ALONG, 0.0)),
        )
        for k, (mount, (down, across)) in enumerate(
            zip(BOX.mounts, [(UP, ACROSS)] * 3 + [(INCLINED[1], INCLINED[0])], strict=True), start=1
        )
    ),
    BOX.points[:1],
)
STEP, COUNT = 2e-5, 2500
# Of the largest; the issue asks for 5e-5. Measured: 3e-7 of sway and 4e-7 of forces, and a quarter at half the step.
TOLERANCE = 2e-6
PEAKS, DURATION = (60.0, -90.0, 120.0), 0.011  # [m/s^2], [s]

CONNECTOR = '<ssd:Connector name="{}" kind="{}"><ssc:Real unit="{}"/></ssd:Connector>'
COMPONENT = """
<ssd:Component name="{}" type="application/x-fmu-sharedlibrary" source="resources/{}.fmu">
<ssd:Connectors>{}</ssd:Connectors></ssd:Component>"""
CONNECTION = """
<ssd:Connection startElement="{}" startConnector="{}" endElement="{}" endConnector="{}"/>"""
STRUCTURE = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="box">
<ssd:System name="box"><ssd:Elements>{}</ssd:Elements><ssd:Connections>{}</ssd:Connections></ssd:System>
<ssd:Units>
<ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>
<ssc:Unit name="N"><ssc:BaseUnit kg="1" m="1" s="-2"/></ssc:Unit>
</ssd:Units></ssd:SystemStructureDescription>
"""


def plant(folder: Path, body: dict[str, Any]) -> Path:
    """The FMU of the rigid body."""
    count = len(body["springs"])
    outputs = {**{f"displacement_{k}": "m" for k in range(count)}, **dict.fromkeys(("sway_x", "sway_y", "sway_z"), "m")}
    content = DescriptionContent(
        "RigidPlant",
        "A rigid body",
        (
            *(Variable(f"force_{k}", "input", "continuous", "Force of a spring", "N") for k in range(count)),
            *(
                Variable(name, "output", "continuous", "Displacement from rest", unit, initial="calculated")
                for name, unit in outputs.items()
            ),
        ),
        (FmiUnit("m", m=1), FmiUnit("N", kg=1, m=1, s=-2)),
        {f"force_{k}": 0.0 for k in range(count)},
    )
    backend = Backend({"canNotUseMemoryManagementFunctions": "true", "needsExecutionTool": "false"})
    source = (Path(__file__).parents[1] / "helpers" / "rigid_plant.py").read_text()
    head, tail = source.split("from __future__ import annotations\n")
    module = f"{head}from __future__ import annotations\n{tail}\nBODY = {body!r}\n"
    guid, contents = slave_contents(
        "RigidPlant",
        module.replace("from pythonfmu.", "from <package>.pythonfmu."),
        described(content, "", "test", backend),
    )
    path = folder / "plant.fmu"
    return write_archive(path, {"modelDescription.xml": described(content, guid, "test", backend), **contents})


def system_of_fmus(folder: Path, pose: np.ndarray, displacements: np.ndarray) -> Path:
    """The .ssp file; each spring's displacement counts from where it is at rest."""
    body = {
        "mass": 20.0,
        "inertia": [0.25, 0.3, 0.35],
        "gravity": list(SYSTEM.gravity),
        "springs": [
            (list(mount.place), list(axis.direction))
            for mount, axis in zip(SYSTEM.axis_mounts, SYSTEM.axes, strict=True)
        ],
        "point": list(SYSTEM.points[0].place),
        "pulse": (list(PEAKS), DURATION),
        "position": pose[0, :3].tolist(),
        "rotation": Rotation.from_quat(pose[0, [4, 5, 6, 3]]).as_matrix().tolist(),
    }
    fmu = plant(folder, body)
    assert validate_fmu(str(fmu)) == []
    files = {"resources/plant.fmu": fmu.read_bytes()}
    forces = "".join(CONNECTOR.format(f"force_{k}", "input", "N") for k in range(len(SYSTEM.axes)))
    moved = "".join(CONNECTOR.format(f"displacement_{k}", "output", "m") for k in range(len(SYSTEM.axes)))
    sway = "".join(CONNECTOR.format(f"sway_{name}", "output", "m") for name in "xyz")
    elements, connections = COMPONENT.format("plant", "plant", forces + moved + sway), ""
    ends = CONNECTOR.format("displacement", "input", "m") + CONNECTOR.format("force", "output", "N")
    for k, (axis, displacement) in enumerate(zip(SYSTEM.axes, displacements.tolist(), strict=True)):
        name = f"spring_{k}"
        model = ModelFile(name, axis.spring)
        spring = build_native_fmu(model, folder, chosen_platforms("host"), zero=displacement)
        files[f"resources/{name}.fmu"] = spring.read_bytes()
        elements += COMPONENT.format(name, name, ends)
        connections += CONNECTION.format("plant", f"displacement_{k}", name, "displacement")
        connections += CONNECTION.format(name, "force", "plant", f"force_{k}")
    files["SystemStructure.ssd"] = STRUCTURE.format(elements, connections).encode()
    return write_archive(folder / "box.ssp", files)


def base_means() -> np.ndarray:
    """Mean acceleration of the base over each step, shape (3, COUNT)."""
    phase = np.pi * np.clip(STEP * np.arange(COUNT + 1) / DURATION, 0.0, 1.0)
    speed = DURATION / np.pi * (1.0 - np.cos(phase))
    return np.outer(PEAKS, np.diff(speed) / STEP)


@pytest.mark.slow
def test_time_integration_is_co_simulation_of_a_plant_and_springs(tmp_path: Path) -> None:
    motion, omega = SYSTEM.solver, np.zeros(12)
    gravity, still = np.array(SYSTEM.gravity), np.zeros(3)
    pose, _, is_found = motion.rest(gravity, omega)
    assert is_found
    channels = np.array([[*row, 0.0, 0.0, 0.0, 0.0, 0.0] for row in np.eye(3)])
    _, expected = motion.run(channels, base_means(), STEP, gravity, pose, omega, still, stride=1)
    sway = (expected.sway - expected.sway[0])[:, 0]
    assert np.abs(sway).max() > 5e-3

    ssp = system_of_fmus(tmp_path, pose, expected.displacement[0])
    # Half a step less, since FMPy adds up the time. Of two of its steps one moves the plant and the other the springs.
    rows = simulate_ssp(str(ssp), stop_time=STEP * COUNT - 0.25 * STEP, step_size=0.5 * STEP)[1::2]
    moved = np.array([rows[f"plant.sway_{name}"] for name in "xyz"]).T
    assert np.abs(moved - sway[1:]).max() <= TOLERANCE * np.abs(sway).max()
    # The forces follow one step of FMPy's later, at rest in the first row.
    forces = np.array([rows[f"spring_{k}.force"] for k in range(12)]).T
    np.testing.assert_allclose(forces[0], expected.force[0], atol=1e-9 * np.abs(expected.force).max())
    assert np.abs(forces[1:] - expected.force[1:-1]).max() <= TOLERANCE * np.abs(expected.force).max()

    # And so is the FMU of the system, under the same means.
    options = SystemFmuOptions(STEP, 1e-3)
    with NativeSystem(system_library(replace(SYSTEM, name="ssp"), options)).begin() as one:
        found = [[0.0, 0.0, 0.0]]
        for k, (x, y, z) in enumerate(base_means().T.tolist()):
            assert one.set(base_acceleration_x=x, base_acceleration_y=y, base_acceleration_z=z) == OK
            assert one.go(k * STEP, STEP) == OK
            found.append(one.get(*(f"sway_circuit_board_{name}" for name in "xyz")))
    np.testing.assert_array_equal(found, sway)
