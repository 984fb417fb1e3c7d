"""Recorded files of all formats, as other programs write them."""

from __future__ import annotations

import tarfile
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files of `samples.tar.gz`: of those without a suffix each holds the record of `plain.csv`.

    They were written by SciPy, h5py, openpyxl, xlwt, odfpy, npTDMS, asammdf, pyuff, pyarrow, pandas and NumPy.
    """
    folder = tmp_path_factory.mktemp("samples")
    with tarfile.open(Path(__file__).with_name("samples.tar.gz")) as archive:
        archive.extractall(folder, filter="data")
    return folder
