"""The page of an FMU for real time says what it refuses and costs, in figures of the documentation."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi1 import FMICallException

from fmu_tools import SPRING
from pages import TEXTS
from strandspring.fmu.checks.check import running
from strandspring.fmu.native.native_fmu import build_native_fmu, native_contents
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.model.modelfile import ModelFile

MODEL = ModelFile("spring", SPRING)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    "form", [{}, {"no_energy": True}, {"with_states": True}], ids=["with energy", "without energy", "with states"]
)
def test_documentation_of_real_time(form: dict[str, bool], fmi: int, tmp_path: Path) -> None:
    usual = native_contents(MODEL, (), fmi=fmi, with_states="with_states" in form)["documentation/index.html"].decode()
    assert "Real time" not in usual
    assert "warning is logged" in usual
    fmu = build_native_fmu(MODEL, tmp_path, chosen_platforms("host"), zero=0.0, fmi=fmi, real_time=True, **form)
    with zipfile.ZipFile(fmu) as file:
        page = file.read("documentation/index.html").decode()
    assert "warning is logged" not in page
    told = " ".join(page.partition("<h2>Real time</h2>")[2].partition("<h2>")[0].split())
    figures = re.findall(r"[\d.]+ (?:us|ms|MB)", told)
    assert len(figures) == (1 if "with_states" in form else 3)
    for figure in figures:
        assert figure in TEXTS["real-time"], figure
    assert ("no output <code>absorbed_energy</code>" in told) == ("no_energy" in form) == ("--no-energy" in told)
    # The derivatives that it says are refused, and no others.
    references = {v.name: v.valueReference for v in fmpy.read_model_description(str(fmu)).modelVariables}
    scalars = ("displacement", "velocity", "omega_start", "rho", "sigma", "n", "kappa_omega")
    refused = set()
    with running(fmu, model_exchange=True) as one:
        one.setupExperiment(startTime=0.0)
        one.enterInitializationMode()
        for name in (known for known in scalars if known in references):
            assert len(one.getDirectionalDerivative([references["force"]], [references[name]], [1.0])) == 1
        one.exitInitializationMode()
        for name in (known for known in scalars if known in references):
            try:
                one.getDirectionalDerivative([references["force"]], [references[name]], [1.0])
            except FMICallException:
                refused.add(name)
    said = re.search(r"derivatives with respect to ([\w, ]+) are refused", told)
    assert (said is None) == ("with_states" in form)
    assert set(re.split(", | and ", said[1]) if said else ()) == refused
