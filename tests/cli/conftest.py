"""A folder with models, records and descriptions that commands read."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from many_springs import measured, write, write_batch
from springs import MOUNT, TABLE
from strandspring import Spring, bundled_record, synthesize
from strandspring.examples.system_models import SYSTEMS
from strandspring.model.modelfile import ModelFile, save_model
from studies import SPRING, UNCERTAINTY
from synthetic import record_of, sine, spring_of
from terminal import Terminal

HERE = Path(__file__).parent
TRUE = spring_of(1.0, 1.0)


def _rows(path: Path, header: str, *columns: np.ndarray) -> None:
    np.savetxt(path, np.column_stack(columns), fmt="%.6g", delimiter=",", header=header, comments="")


@pytest.fixture(scope="session")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Model files, of which new.json and worn.json are kept as identified, a description, and records."""
    from strandspring import build_fmu
    from strandspring.examples.rigid_platform import STIFF

    folder = tmp_path_factory.mktemp("inputs")
    for name, parameters in {"mount": MOUNT, "stiff": STIFF, "table": TABLE, "spring": TRUE}.items():
        Spring(parameters, name, f"a {name}").save(folder / f"{name}.json")
    falling = replace(TRUE, kE=(0.0, -1e5))
    Spring(falling, "falling").save(folder / "falling.json")
    far = replace(TRUE, displacement_offset=0.45, displacement_min=0.4, displacement_max=0.5)
    Spring(far, "far").save(folder / "far.json")
    shutil.copytree(SYSTEMS, folder, dirs_exist_ok=True)
    bundled = HERE.parents[1] / "models" / "rubber_hinge.json"
    for source in (HERE / "new.json", HERE / "worn.json", Path(bundled_record()), bundled):
        shutil.copy(source, folder)
    save_model(folder / "drawn.json", ModelFile("mount", SPRING, uncertainty=UNCERTAINTY))
    write_batch(folder / "springs", 8, 360)
    write(folder / "springs" / "stiff.csv", measured(100, 360, stiffness=2.0))
    (folder / "none").mkdir()
    for name, kappa, seed in (("new", 25.0, 1), ("worn", 22.5, 2)):
        record_of(replace(TRUE, kappa_omega=kappa), sine(), 0.02, seed).save(folder / f"{name}.csv", "mm")
    for amplitude, frequency in ((8, 0.5), (20, 0.5), (20, 2.0)):
        path = folder / f"a{amplitude}f{frequency:g}.csv"
        synthesize(Spring(TRUE), [1e-3 * amplitude], frequency=frequency, noise=0.01, seed=1).save(path, "mm")
    few = record_of(spring_of(0.4, 2.0), sine(3, 90), noise=0.03)
    times = 0.1 * np.arange(90) + np.where(np.arange(90) > 40, 5.0, 0.0)
    clipped = few.force.clip(None, np.quantile(few.force, 0.9))
    _rows(folder / "few.csv", "time [s],displacement [mm],force [N]", times, 1e3 * few.displacement, clipped)
    steps = np.arange(50.0)
    _rows(folder / "one_way.csv", "x [mm],F [N]", steps, steps)
    (folder / "campaign.toml").write_text('[[record]]\nfile = "a8*.csv"\ncycles = "1:2"\n', encoding="utf-8")
    build_fmu(folder / "mount.json", folder)
    build_fmu(folder / "gun_cradle.toml", folder, candidate="five springs").rename(folder / "cradle.fmu")
    return folder


@pytest.fixture
def terminal(
    inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Terminal:
    """The command line in a copy of that folder."""
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return Terminal(capsys)
