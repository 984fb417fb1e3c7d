"""Every result in all its renderings: words, JSON, table, notebook, plot and files."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from inspect import signature
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import pytest

import strandspring
from springs import MOUNT
from strandspring import Spring, SpringParameters, StrandspringError
from strandspring.examples.system_models import SYSTEMS
from strandspring.model.modelfile import ModelFile
from studies import SPRING, UNCERTAINTY
from synthetic import record_of, sine, spring_of

pytestmark = pytest.mark.long

KEPT = Path(__file__).resolve().parents[1] / "cli" / "inputs"  # model files
CRADLE = SYSTEMS / "gun_cradle.toml"
TINY = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "tiny")


def many() -> Any:
    """Two springs identified into a folder."""
    folder = Path(mkdtemp())
    for k in range(2):
        strandspring.synthesize(TINY, [0.01, 0.02], noise=0.01, seed=k, samples=100).save(folder / f"{k}.csv", "mm")
    return strandspring.identify_many(folder, folder / "models", workers=1, method="two-stage")


NAMES = {
    **{name: getattr(strandspring, name) for name in strandspring.__all__},
    "RECORD": record_of(spring_of(1.0, 1.0), sine(), 0.02, 1),
    "DRAWN": Spring.from_model(ModelFile("mount", SPRING, uncertainty=UNCERTAINTY)),
    "SOFT": Spring(MOUNT, "soft"),
    "STIFF": Spring(replace(MOUNT, kE=(50.0, 4e4, 1e5, 2e7)), "stiff"),
    **{"KEPT": KEPT, "TINY": TINY, "CRADLE": CRADLE, "many": many, "mkdtemp": mkdtemp},
}
TEXT = Path(__file__).with_name("results.txt").read_text(encoding="utf-8")
MADE = dict(line.split(" => ") for line in TEXT.splitlines()[1:])
IN_WORDS = [name for name in MADE if name not in ("Record", "Spring")]
# Every figure, in JSON too.
STATED = ("Information", "Isolation", "SystemIsolation", "Simulation", "SystemInformation", "TestPlan", "Verification")
SAVED = ("Isolation", "SystemIsolation", "StudyResult", "TestPlan")  # all by one function
ELSEWHERE = ("TestPlan",)  # the figures have other files
PLOTTED = [name for name in MADE if name not in ("Verification", "SystemInformation")]


@cache
def made(name: str) -> Any:
    return eval(MADE[name], NAMES)  # noqa: S307


def numbers(content: Any) -> Iterator[float]:
    """All numbers of JSON."""
    if isinstance(content, dict | list | tuple):
        for value in content.values() if isinstance(content, dict) else content:
            yield from numbers(value)
    elif isinstance(content, int | float):
        yield float(content)


def test_every_result_is_here() -> None:
    kinds = {name for name in dir(strandspring) if hasattr(getattr(strandspring, name), "summary")}
    assert kinds == {name.split()[0] for name in IN_WORDS}


@pytest.mark.parametrize("name", IN_WORDS)
def test_words_and_tables_say_the_same(name: str) -> None:
    result = made(name)
    lines = result.summary().splitlines()
    assert lines[: len(result.text_lines())] == result.text_lines()
    assert {f"Caution: {text}" for text in getattr(result, "cautions", ())} <= set(lines)
    shown, more = repr(result).splitlines(), len(lines) - 6
    rest = [f"({more} more line{'s' * (more > 1)}: .summary())"] if more > 0 else []
    assert shown == [*lines[:6], *rest]
    table = result.to_frame()
    assert "<table" in result._repr_html_()
    assert len(table) >= 1
    if name in STATED:
        content = json.loads(json.dumps(result.as_json()))
        stated = np.sort(list(filter(math.isfinite, numbers(content))))
        for column in table.select_dtypes("number"):
            for value in table[column].dropna():
                assert np.isclose(stated, value, rtol=1e-12, atol=0.0).any(), (column, value)


@pytest.mark.parametrize("name", IN_WORDS)
def test_few_words_and_files(name: str, tmp_path: Path) -> None:
    result = made(name)
    assert 0 < len("".join(result.text_lines(brief=True))) <= len("".join(result.text_lines()))
    json.dumps(result.as_json(), allow_nan=False)
    if name not in ELSEWHERE:
        result.save_csv(tmp_path / "table.csv")
        header, *rows = csv.reader((tmp_path / "table.csv").read_text(encoding="utf-8").splitlines())
        assert len({*header}) == len(header)
        assert len(rows) == len(result.to_frame())


@pytest.mark.parametrize("name", PLOTTED)
def test_plots_go_into_axes_or_files(name: str, tmp_path: Path) -> None:
    import matplotlib as mpl
    from matplotlib import pyplot as plt
    from matplotlib.figure import Figure

    result = made(name)
    assert list(signature(getattr(strandspring, name.split()[0]).plot).parameters) == ["self", "ax"]
    with mpl.rc_context({"backend": "agg"}):
        own = result.plot()
        shown = own if isinstance(own, list) else [own]
        assert shown[0].figure.number in plt.get_fignums()
        plt.close("all")
    given = Figure().subplots(len(shown))
    drawn = result.plot(given if len(shown) == 1 else list(given))
    for axes in np.ravel(drawn):
        assert axes.lines or axes.collections or axes.patches or axes.images
    with pytest.raises(ValueError, match=rf"`ax` must be {len(shown)} axes of matplotlib, got {len(shown) + 1}"):
        result.plot(list(Figure().subplots(len(shown) + 1)))
    if name in SAVED:
        for copy in "ab":
            result.save_plot(tmp_path / f"{copy}.svg")
        first = (tmp_path / "a.svg").read_bytes()
        assert len(first) > 5000
        assert first == (tmp_path / "b.svg").read_bytes()
        with pytest.raises(StrandspringError, match=r"must end in \.png, \.svg, \.pdf"):
            result.save_plot(tmp_path / "a.txt")


def test_what_is_drawn() -> None:
    from matplotlib.figure import Figure

    def lines(name: str) -> list[Any]:
        return list(np.ravel(made(name).plot(Figure().subplots()))[0].lines)

    record, columns, frame = made("Record"), made("Prediction").to_frame(), made("Isolation").to_frame()
    (line,) = lines("Record")
    assert np.array_equal(line.get_xydata(), np.column_stack([1e3 * record.displacement, record.force]))
    assert [loop.get_xdata()[0] for loop in lines("Spring")[::2]] == pytest.approx([-20.0, -15.0, -10.0, -5.0])
    stiffness = made("ManyResult").to_frame()["secant stiffness [N/m]"]
    assert lines("ManyResult")[0].get_xdata() == pytest.approx(1e-3 * stiffness)
    for line, name in zip(lines("Prediction"), ("force", "predicted"), strict=True):
        assert np.array_equal(line.get_xydata(), np.column_stack([1e3 * columns["displacement"], columns[name]]))
    for curve, (_, rows) in zip(lines("Isolation"), frame.groupby(["model", "level"], sort=False), strict=False):
        assert np.array_equal(curve.get_xydata(), rows[["frequency", "transmissibility"]])
