"""The largest force of an axis is one that its course has, wherever steps end early."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from strandspring.vibration.bodies.simulation import run_with_histories, simulate_case
from strandspring.vibration.description.system_file import load_system_file

SYSTEM = """
format = "strandspring-system"
format_version = 1
name = "box"
units = { mass = "kg", length = "m", inertia = "kg m^2", damping = "N s/m" }
[[body]]
name = "box"
mass = 20
center = [0.03, -0.02, 0.01]
inertia = { xx = 0.25, yy = 0.30, zz = 0.35, xy = 0.02, xz = -0.03, yz = 0.01 }
[mount_type.m]
axes = [
    { direction = "-z", model = "hard.json", damping = 60 },
    { direction = "+x", model = "linear.json", damping = 20 },
    { direction = "+y", model = "linear.json" },
]
[[mount]]
name = "c"
type = "m"
places = [[0.15, 0.1, -0.12], [-0.15, 0.1, -0.12], [0.15, -0.1, -0.12], [-0.15, -0.1, -0.1]]
[[case]]
name = "s"
record = { file = "base.csv", columns = { x = 2, y = 3, z = 4, rx = 5, ry = 6, rz = 7 } }
simulate = "0.25 s"
"""


def write_model(path: Path, stiffness: float, cubic: float) -> None:
    parameters = {
        "kE": [0.0, stiffness, 0.0, cubic], "kA": [1.0], "kappa_omega": 1e-9, "rho": 100.0, "sigma": 1.0, "n": 1.0,
        "displacement_offset": 0.0, "displacement_min": -0.1, "displacement_max": 0.1,
    }  # fmt: skip
    content = {"format": "strandspring-model", "format_version": 1, "name": path.stem, "description": ""}
    path.write_text(json.dumps(content | {"parameters": parameters}))


def test_largest_forces_of_dampers_are_in_their_courses(tmp_path: Path) -> None:
    write_model(tmp_path / "hard.json", 8000.0, 3e6)
    write_model(tmp_path / "linear.json", 10000.0, 0.0)
    time = np.arange(0.0, 0.2001, 0.001)
    random, levels = np.random.default_rng(1), (44.0, 29.0, 59.0, 2.6, 1.6, 3.9)
    nodes = np.linspace(0.0, 0.2, 21)
    columns = [level * np.interp(time, nodes, random.normal(size=21)) * np.sin(np.pi * time / 0.2) for level in levels]
    head = "t [s],ax [m/s^2],ay [m/s^2],az [m/s^2],wx [rad/s],wy [rad/s],wz [rad/s]"
    np.savetxt(tmp_path / "base.csv", np.column_stack([time, *columns]), delimiter=",", header=head, comments="")
    (tmp_path / "system.toml").write_text(SYSTEM)
    file = load_system_file(tmp_path / "system.toml")
    system, case = file.candidates[0][1], file.cases[0]
    run = simulate_case(system, case, 0.0, 5e-4)
    histories = run_with_histories(system, case, run.start, run.step, 100_000)
    courses = np.abs(histories.force).max(axis=0)
    # Rows are 0.25 ms apart, over which forces of some 20 Hz stay within 0.1 % of a peak.
    np.testing.assert_allclose(run.figures.force, courses, rtol=5e-3)
