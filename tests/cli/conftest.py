"""A folder with models, records and descriptions that commands read."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from many_springs import measured, write, write_batch
from strandspring import Spring, build_fmu, bundled_record, synthesize
from strandspring.examples.system_models import SYSTEMS
from synthetic import record_of, sine, spring_of
from terminal import Terminal

HERE = Path(__file__).parent
TRUE = spring_of(1.0, 1.0)


@pytest.fixture(scope="session")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Model files and a description that are kept, the examples, and records of known springs."""
    folder = tmp_path_factory.mktemp("inputs")
    for source in (HERE / "inputs", SYSTEMS):
        shutil.copytree(source, folder, dirs_exist_ok=True)
    for path in (Path(bundled_record()), HERE.parents[1] / "models" / "rubber_hinge.json"):
        shutil.copy(path, folder)
    write_batch(folder / "springs", 8, 360)
    write(folder / "springs" / "stiff.csv", measured(100, 360, stiffness=2.0))
    (folder / "none").mkdir()
    for name, kappa, seed in (("new", 25.0, 1), ("worn", 22.5, 2)):
        record_of(replace(TRUE, kappa_omega=kappa), sine(), 0.02, seed).save(folder / f"{name}.csv", "mm")
    for amplitude, frequency in ((8, 0.5), (20, 0.5), (20, 2.0)):
        path = folder / f"a{amplitude}f{frequency:g}.csv"
        synthesize(Spring(TRUE), [1e-3 * amplitude], frequency=frequency, noise=0.01, seed=1).save(path, "mm")
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
