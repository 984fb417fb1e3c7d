"""The command line: exit status, one JSON object, one sentence for bad input, nothing half-written."""

from __future__ import annotations

import html
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from strandspring import Spring
from strandspring.cli.main import COMMANDS, main
from strandspring.model import outcomes
from strandspring.model.modelfile import load_model
from synthetic import record_of, sine, spring_of
from terminal import unfolded

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
HINGE = str(ROOT / "models/records/rubber_stretch.csv")
FRICTION = str(ROOT / "tests/data/actuator/circle_3bar.csv")
SNAP = str(ROOT / "tests/data/hinge/plastic_compress.csv")


class Outcome:
    """What a run of the command line came to."""

    def __init__(self, status: int, out: str, err: str) -> None:
        self.status, self.out, self.err = status, out, err

    @property
    def refusal(self) -> str:
        """The last line on standard error, which must be the refusal."""
        assert self.status == 1, self.err
        assert "Traceback" not in self.err
        return self.err.strip().splitlines()[-1]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> Outcome:
        try:
            main(arguments)
            status = 0
        except SystemExit as leaving:
            status = int(leaving.code or 0)
        captured = capsys.readouterr()
        return Outcome(status, captured.out, unfolded(captured.err))

    return call


@pytest.fixture
def loop(tmp_path: Path) -> str:
    """A clean record in millimetres and newtons."""
    record = record_of(spring_of(1.0, 1.0), sine())
    return write_csv(tmp_path / "loop.csv", record.displacement * 1e3, record.force)


@pytest.fixture
def model(tmp_path: Path) -> str:
    Spring(spring_of(1.0, 1.0), "mount").save(tmp_path / "mount.json")
    return str(tmp_path / "mount.json")


HEADER = "Displacement (mm),Force (N)"


def write_csv(path: Path, displacement: np.ndarray, force: np.ndarray, header: str = HEADER) -> str:
    rows = "\n".join(f"{x!r},{r!r}" for x, r in zip(displacement.tolist(), force.tolist(), strict=True))
    path.write_text(f"{header}\n{rows}\n", encoding="utf-8")
    return str(path)


def test_identify_prints_one_json_object(run: Any, loop: str) -> None:
    done = run("identify", loop, "-o", "m.json", "--degrees", "3,2", "--json")
    assert done.status == 0
    told = json.loads(done.out)
    assert told["model"] == "m.json"
    assert told["parameters"] == json.loads(load_model("m.json").to_json())["parameters"]
    (record,) = told["records"]
    assert record["path"] == loop
    assert record["rnl"] > 0.99
    assert {"samples", "rmse", "energy", "predicted_energy"} <= set(record)
    assert {"rmse", "rnl", "energy", "predicted_energy"} < set(record["fitted"])
    assert {"rmse", "rnl", "energy", "predicted_energy", "fitted"} <= set(told)


def test_identify_the_same_twice_gives_the_same_bytes(run: Any, loop: str) -> None:
    for name in ("a", "b"):
        assert run("identify", loop, "-o", f"{name}/mount.json", "--report", f"{name}/mount.html").status == 0
    for name in ("mount.json", "mount.html"):
        first, second = (Path(folder, name).read_bytes() for folder in "ab")
        assert first == second


def test_report_stands_alone_and_escapes(run: Any, loop: str) -> None:
    text = "<script>alert('x')</script> & \"quotes\""
    assert run("identify", loop, "-o", "m.json", "--description", text, "--report", "r.html").status == 0
    page = Path("r.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "&lt;script&gt;" in page
    assert "default-src 'none'" in page


def test_the_verdict_comes_first_and_the_most_harmful_findings_after_it(
    run: Any, loop: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = run("identify", loop, "-o", "m.json", "--degrees", "3,2", "--report", "r.html")
    verdict = load_model("m.json").fit["verdict"]
    assert done.out.startswith("usable: ")
    assert unfolded(done.out).startswith(verdict["sentence"])
    page = html.unescape(Path("r.html").read_text(encoding="utf-8")).replace("\N{NO-BREAK SPACE}", " ")
    assert all(name in page for name in ("this spring", *verdict["plain"]))
    told = json.loads(run("identify", loop, "-o", "m.json", "--degrees", "3,2", "--json").out)
    assert told["verdict"] == verdict
    assert verdict["sentence"] in run("info", "m.json").out
    monkeypatch.setattr("strandspring.api.identification.Identification.cautions", tuple("abcde"))
    done = run("identify", loop, "-o", "m.json", "--degrees", "3,2")
    assert [line for line in done.err.splitlines() if "assumed" not in line] == [
        "Caution: a", "Caution: b", "Caution: c", "and 2 more: see the report, --verbose or --json"
    ]  # fmt: skip


def test_predict_tells_figures_and_writes_the_prediction(run: Any, loop: str, model: str) -> None:
    done = run("predict", model, loop, "-o", "p.csv", "--json")
    told = json.loads(done.out)
    # The record was made by this very model, from omega = 0.
    assert told["records"][0]["rnl"] > 0.99999
    assert told["records"][0]["samples"] == 1500
    rows = Path("p.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "record,displacement [mm],force [N],predicted force [N]"
    assert len(rows) == 1501
    assert f"{model} holds no prediction interval, so p.csv has no columns lower and upper" in done.err


def test_predict_writes_the_interval_that_identify_prints(run: Any, tmp_path: Path) -> None:
    x = sine(4, 2000)
    force = Spring(spring_of(1.0, 1.0)).response(x) + np.random.default_rng(0).standard_normal(x.size)
    record = write_csv(tmp_path / "noisy.csv", x * 1e3, force)
    printed = run("identify", record, "--degrees", "3,2", "-o", "n.json", "--verbose").out
    assert re.search(r"95 % prediction interval \+- (1\.9|2|2\.\d) N, holds 9[3-7] % of held-out strokes", printed)
    done = run("predict", "n.json", record, "-o", "p.csv")
    assert "no columns" not in done.err
    header, *_ = Path("p.csv").read_text(encoding="utf-8").splitlines()
    assert header.endswith("predicted force [N],lower [N],upper [N]")
    rows = np.loadtxt("p.csv", delimiter=",", skiprows=1)
    inside = (rows[:, 4] <= rows[:, 2]) & (rows[:, 2] <= rows[:, 5])
    assert np.mean(inside) == pytest.approx(0.95, abs=0.02)
    content = json.loads(Path("n.json").read_text(encoding="utf-8"))
    content["uncertainty"]["joint"]["root"][2] = [1.0]
    Path("bad.json").write_text(json.dumps(content), encoding="utf-8")
    refused = run("predict", "bad.json", record, "-o", "q.csv")
    assert refused.status == 1
    assert 'bad.json: field "uncertainty.joint.root" must hold the rows of a lower triangular matrix' in refused.err


def test_predict_writes_the_path_that_it_used(run: Any, tmp_path: Path) -> None:
    clean = sine(4, 2000)
    stiff = Spring(replace(spring_of(1.0, 1.0), rho=5000.0), "stiff")
    stiff.save("stiff.json")
    jitter = clean + 2e-4 * np.random.default_rng(0).standard_normal(clean.size)
    record = write_csv(tmp_path / "jitter.csv", jitter * 1e3, stiff.response(clean))
    done = run("predict", "stiff.json", record, "-o", "p.csv", "--json")
    (told,) = json.loads(done.out)["records"]
    assert {"rmse", "rnl", "energy", "predicted_energy"} < set(told)
    rows = np.loadtxt("p.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 1], jitter * 1e3, rtol=1e-15)
    np.testing.assert_allclose(rows[:, 3], stiff.response(rows[:, 1] * 1e-3, told["omega_start"]), rtol=1e-9)
    assert np.sqrt(np.mean((rows[:, 3] - rows[:, 2]) ** 2)) == pytest.approx(told["rmse"])


def test_a_spring_worse_than_a_line_is_refused_unless_saved_anyway(
    run: Any, loop: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # No record is known of which a fit is worse than a line.
    worse = outcomes.Finding(outcomes.Outcome.WORSE_THAN_LINE)
    monkeypatch.setattr("strandspring.identification.identify._of_saved", lambda *_: iter([worse]))
    assert "--save-anyway" in run("identify", loop, "-o", "m.json").refusal
    assert not Path("m.json").exists()
    assert "--save-anyway" in run("build", loop, "--models", "kept").refusal
    told = json.loads(run("identify", loop, "-o", "m.json", "--save-anyway", "--json").out)
    assert "worse_than_line" in {outcome["name"] for outcome in told["outcomes"]}
    assert load_model("m.json").fit["outcomes"] == told["outcomes"]
    done = run("build", loop, "--models", "kept", "--save-anyway")
    assert "worse than a straight line" in done.err
    assert Path("kept/loop.json").exists()
    assert run("build", "m.json", "--save-anyway").status == 2
    assert run("identify-many", loop, "-o", "many", "--workers", "1").status == 1
    assert run("identify-many", loop, "-o", "many", "--workers", "1", "--save-anyway").status == 0


def test_predict_says_when_a_record_leaves_the_range(run: Any, tmp_path: Path, model: str) -> None:
    x = sine(amplitude=0.025)
    wide = write_csv(tmp_path / "wide.csv", x * 1e3, Spring(spring_of(1.0, 1.0)).response(x))
    assert "outside the identified range" in run("predict", model, wide).err


def test_synthesize_round_trip(run: Any, model: str) -> None:
    done = run("synthesize", "spring", model, "--amplitude", "10", "--amplitude", "20", "--cycles", "2", "-o", "s.csv")
    assert done.status == 0
    told = json.loads(run("predict", model, "s.csv", "--json").out)
    assert told["records"][0]["samples"] == 4001
    assert told["records"][0]["rnl"] > 0.999999
    again = run("synthesize", "spring", model, "--noise", "0.03", "--seed", "5", "-o", "n.csv")
    assert "seed 5" in again.err
    first = Path("n.csv").read_bytes()
    run("synthesize", "spring", model, "--noise", "0.03", "--seed", "5", "-o", "n.csv")
    assert Path("n.csv").read_bytes() == first


def test_a_synthesized_campaign_has_drift_and_coarse_sensors(run: Any, model: str) -> None:
    arguments = ["synthesize", "spring", model, "--amplitude", "8", "--amplitude", "20", "--noise", "0.03"]
    arguments += ["--drift", "0.02", "--displacement-resolution", "0.02", "--force-resolution", "0.5", "-o", "c.csv"]
    assert run(*arguments).status == 0
    rows = np.loadtxt("c.csv", delimiter=",", skiprows=1)
    for column, step in ((1, 0.02), (2, 0.5)):
        assert np.max(np.abs(rows[:, column] / step - np.round(rows[:, column] / step))) < 1e-6
    told = json.loads(run("identify", "c.csv", "-o", "m.json", "--json").out)
    assert told["method"] == "refined"
    assert told["uncertainty"]["rho"] > 0.0
    assert told["rnl"] > 0.95


@pytest.mark.parametrize("method", ["refined", "two-stage", "paper", "ni"])
def test_every_method_can_be_asked_for(run: Any, loop: str, method: str) -> None:
    told = json.loads(run("identify", loop, "-o", "m.json", "--method", method, "--json").out)
    assert told["method"] == method
    assert load_model("m.json").provenance["method"] == method


def test_build_a_model_and_a_record(run: Any, model: str, loop: str) -> None:
    told = json.loads(run("build", model, "-o", "out", "--json").out)
    assert [Path(fmu["path"]) for fmu in told["fmus"]] == [Path("out/mount.fmu")]
    told = json.loads(run("build", model, "-o", "out", "--backend", "both", "--json").out)
    assert [fmu["backend"] for fmu in told["fmus"]] == ["native", "python"]
    assert [Path(fmu["path"]) for fmu in told["fmus"]] == [Path("out/mount.fmu"), Path("out/mount_python.fmu")]
    done = run("build", loop, "--models", "kept", "--degrees", "3,2")
    assert done.status == 0
    assert Path("kept/loop.json").exists()
    assert Path("dist/loop.fmu").exists()
    assert "valid, agrees with the model" in done.out
    assert "valid;" in run("build", model, "-o", "out", "--verbose").out


def test_friction_record_by_column_numbers(run: Any) -> None:
    done = run("identify", FRICTION, "--displacement", "5", "--force", "7", "-o", "friction.json", "--json")
    told = json.loads(done.out)
    assert told["rnl"] > 0.99


def test_snap_through_is_refused_with_the_reason(run: Any) -> None:
    assert "snap-through" in run("identify", SNAP, "-o", "m.json").refusal
    assert not Path("m.json").exists()


@pytest.mark.parametrize(
    ("content", "arguments", "expected"),
    [
        ("", [], "empty"),
        ("Displacement (mm),Force (N)\n1,2\n2,oops\n3,4\n4,5\n5,6\n6,7\n", [], "line 3"),
        ("Displacement (mm),Force (N)\n1,2\n2,nan\n3,4\n4,5\n5,6\n6,7\n", [], "line 3"),
        ("Displacement (mm),Force (N)\n1,2\n", [], "at least 2 rows"),
        ("Displacement (mm),Force (N)\n" + "1,2\n1,3\n1,4\n" * 9, [], "must change"),
        ("Displacement (mm),Force (N)\n" + "1,2\n2,3\n3,4\n2,2\n" * 9, ["--force", "Kraft"], "Kraft"),
        ("Displacement (mm),Force (N)\n" + "1,2\n2,3\n3,4\n2,2\n" * 9,
         ["--displacement", "2", "--force", "1"], "swapped"),
    ],
    ids=["empty", "text", "nan", "one sample", "constant", "no such column", "swapped"],
)  # fmt: skip
def test_bad_records_get_one_sentence(run: Any, content: str, arguments: list[str], expected: str) -> None:
    Path("bad.csv").write_text(content, encoding="utf-8")
    refusal = run("identify", "bad.csv", *arguments, "-o", "out.json").refusal
    assert "bad.csv" in refusal
    assert expected in refusal
    assert sorted(path.name for path in Path().iterdir()) == ["bad.csv"]


def test_swapped_columns_without_units_are_noticed_by_the_loop(run: Any) -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    write_csv(Path("bare.csv"), record.displacement * 1e3, record.force / 100.0, header="0,0")
    assert "swapped" in run("identify", "bare.csv", "--displacement", "2", "--force", "1", "-o", "o.json").refusal


@pytest.mark.parametrize("command", ["identify", "predict", "build"])
def test_a_directory_or_a_missing_file_is_refused(run: Any, model: str, command: str) -> None:
    first = [model] if command == "predict" else []
    output = ["-o", "out.json"] if command == "identify" else []
    for wrong in (".", "missing.csv"):
        assert wrong in run(command, *first, wrong, *output).refusal


@pytest.mark.parametrize("field", ["missing", "extra", "negative", "infinite"])
@pytest.mark.parametrize("command", ["build", "predict", "synthesize"])
def test_bad_model_files_are_refused(run: Any, model: str, loop: str, field: str, command: str) -> None:
    content = json.loads(Path(model).read_text(encoding="utf-8"))
    if field == "missing":
        del content["parameters"]["rho"]
    elif field == "extra":
        content["parameters"]["rho2"] = 1.0
    else:
        content["parameters"]["rho"] = -1.0 if field == "negative" else float("inf")
    Path("bad.json").write_text(json.dumps(content), encoding="utf-8")
    before = sorted(Path().rglob("*"))
    arguments = {
        "build": ["build", "bad.json"],
        "predict": ["predict", "bad.json", loop, "-o", "p.csv"],
        "synthesize": ["synthesize", "spring", "bad.json", "-o", "s.csv"],
    }[command]
    refusal = run(*arguments).refusal
    assert "bad.json" in refusal
    assert ("rho" in refusal) or ("Infinity" in refusal)
    assert sorted(Path().rglob("*")) == before


@pytest.mark.parametrize("name", ["../x", "a b", "1a", "<x/>", "a;b", "", "nul", "x" * 65])
def test_bad_names_are_refused(run: Any, loop: str, name: str) -> None:
    done = run("identify", loop, "-o", "sub/m.json", f"--name={name}")
    assert done.status == 2
    assert "Invalid value for '--name': The name must be a letter" in done.err
    assert not Path("sub").exists()


def test_the_state_travels_into_the_model_file(run: Any, loop: str) -> None:
    assert run("identify", loop, "-o", "m.json", "--degrees", "3,2", "--state", "last").status == 0
    assert load_model("m.json").provenance["options"]["state"] == "last"


def test_names_are_derived_from_files(run: Any, loop: str) -> None:
    assert run("identify", loop, "-o", "2nd mount-a.json").status == 0
    assert load_model("2nd mount-a.json").name == "spring_2nd_mount_a"


def test_wrong_usage_is_status_2(run: Any, loop: str, model: str) -> None:
    for arguments in (
        ["identify", loop],
        ["identify", loop, "-o", "m.json", "--degrees", "3"],
        ["identify", loop, "-o", "m.json", "--degrees", "0,0"],
        ["identify", loop, "-o", "m.json", "--method", "magic"],
        ["identify", loop, "-o", "m.json", "--reverse", "time"],
        ["identify", loop, "-o", "m.json", "--report", "r.docx"],
        ["identify", loop, "-o", "m.json", "--figure", "f.jpg"],
        ["synthesize", "spring", model, "-o", "s.csv", "--cycles", "100000", "--samples", "1000000"],
        ["synthesize", "spring", model, "-o", "s.csv", "--amplitude", "nan"],
        ["synthesize", "spring", model, "-o", "s.csv", "--mean", "inf"],
        ["identify", loop, "-o", "m.json", "--method", "two-stage", "--robust"],
        ["identify", loop, "-o", "m.json", "--method", "refined", "--smoothing", "3"],
        ["identify", loop, "-o", "m.json", "--moving-mass", "-1"],
        ["identify", loop, "-o", "m.json", "--state", "middle"],
        ["identify", loop, "-o", "m.json", "--fixture-stiffness", "0"],
        ["identify", loop, "-o", "m.json", "--delay", "nan"],
        ["identify", loop, "-o", "m.json", "--method", "paper", "--moving-mass", "1"],
        ["build", model, "--backend", "cobol"],
        ["nonsense"],
    ):
        done = run(*arguments)
        assert done.status == 2, arguments
        assert "Traceback" not in done.err


def test_help_has_an_example_for_each_command(run: Any) -> None:
    for command in ([], ["identify"], ["predict"], ["build"], ["synthesize", "spring"]):
        told = run(*command, "--help")
        assert told.status == 0
        assert "strandspring " in told.out.split("Example", 1)[1]


def test_an_output_that_cannot_be_written_is_refused(run: Any, loop: str, model: str) -> None:
    Path("file").write_text("kept", encoding="utf-8")
    assert "file" in run("identify", loop, "-o", "file/m.json").refusal
    assert "file" in run("build", model, "-o", "file").refusal
    assert Path("file").read_text(encoding="utf-8") == "kept"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ("identify loop.csv -o loop.csv", "--output loop.csv would overwrite the input loop.csv"),
        ("identify loop.csv -o ./loop.csv --report r.html", "--output ./loop.csv would overwrite the input loop.csv"),
        ("identify link.csv -o loop.csv", "--output loop.csv would overwrite the input link.csv"),
        ("identify loop.csv -o new.html --report sub/../new.html", "--report must be another file than --output"),
        ("identify l.html -o new.json --report ./l.html", "--report ./l.html would overwrite the input l.html"),
        ("identify loop.csv -o x.json --report x.pdf --figure ./x.pdf", "--figure must be another file than --report"),
        (
            "identify loop.csv -o x.json --operator me",
            "--date, --operator, --specimen, --field and --report-mass belong to --report.",
        ),
        (
            "identify loop.csv -o x.json --report x.html --field T",
            "Invalid value for '--field': must be LABEL=TEXT, got 'T'.",
        ),
        ("predict mount.json loop.csv -o link.csv", "--output link.csv would overwrite the input loop.csv"),
        ("predict mount.json loop.csv -o mount.json", "--output mount.json would overwrite the input mount.json"),
        ("isolate mount.json --mass 5 -o mount.json", "--output mount.json would overwrite the input mount.json"),
        ("isolate mount.json --mass 5 -o x.png --plot ./x.png", "--plot must be another file than --output"),
        ("study mount.json --mass 5 -o ./mount.json", "--output ./mount.json would overwrite the input mount.json"),
        ("study r.csv.part.sqlite --mass 5 -o r.csv", "--output's journal r.csv.part.sqlite would overwrite the input"),
        ("synthesize spring mount.json -o mount.json", "--output mount.json would overwrite the input mount.json"),
        ("synthesize ni -o x.csv --clean ./x.csv", "--clean must be another file than --output"),
        ("export mount.ssv --ssv -o .", "--ssv mount.ssv would overwrite the input mount.ssv"),
        ("build loop.json loop.csv --models .", "--models loop.json would overwrite the input loop.json"),
        ("build fmu.json -o .", "--output mount.fmu would overwrite the input fmu.json"),
    ],
)
def test_no_output_takes_the_place_of_an_input_or_another_output(
    run: Any, loop: str, model: str, arguments: str, told: str
) -> None:
    for copy, of in (("loop.json", loop), ("mount.fmu", model), ("mount.ssv", model), ("r.csv.part.sqlite", model)):
        Path(copy).write_bytes(Path(of).read_bytes())
    Path("link.csv").symlink_to("loop.csv")
    Path("fmu.json").symlink_to("mount.fmu")
    before = {path: path.read_bytes() for path in Path().iterdir()}
    done = run(*arguments.split())
    assert done.status == 2
    assert f"Error: {told}" in done.err.strip().splitlines()[-1]
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ("--name other", "--name can only be given with records"),
        ("--description text --branch loading", "--description, --branch can only be given with records"),
        ("--reverse force --force-unit kN", "--force-unit, --reverse can only be given with records"),
        ("--degrees 3,2 --method ni", "--degrees, --method can only be given with records"),
    ],
)
def test_what_concerns_records_is_refused_for_a_model_file(run: Any, model: str, arguments: str, told: str) -> None:
    done = run("build", model, *arguments.split())
    assert done.status == 2
    assert f"Error: {told}, and {model} is a model file; leave that out." in done.err
    assert not Path("dist").exists()


def test_two_columns_to_reverse_are_refused(run: Any, loop: str, model: str) -> None:
    for command in (["identify", loop, "-o", "m.json"], ["info", model, loop], ["predict", model, loop]):
        done = run(*command, "--reverse", "displacement", "--reverse", "force")
        assert done.status == 2
        assert "'--reverse': must be one column, got displacement and force; negate the other one" in done.err
    done = run("info", model, loop, "--reverse", "force", "--reverse", "force")
    assert done.err.count("force negated, as given") == 1


def test_a_forgotten_reverse_is_reported(run: Any, loop: str, model: str) -> None:
    for command in ("predict", "info"):
        assert "Caution" not in run(command, model, loop).err
        told = run(command, model, loop, "--reverse", "force").err
        assert "The force falls as the displacement rises; negate a column with --reverse" in told


def test_a_synthesized_record_beyond_the_identified_range_is_reported(run: Any, model: str) -> None:
    done = run("synthesize", "spring", model, "--amplitude", "25", "--mean", "50", "-o", "wide.csv")
    assert done.status == 0
    # |sin| > 0.8 for 1 - 2*asin(0.8)/pi of the time.
    assert "Caution: wide.csv: 41 % of the samples lie outside the identified range 30 to 70 mm, where" in done.err
    assert run("synthesize", "spring", model, "-o", "within.csv").err == ""


def program(*arguments: str) -> list[str]:
    """The command line as a process of its own."""
    return [sys.executable, "-W", "error", "-m", "strandspring", *arguments]


@pytest.mark.parametrize(
    "arguments",
    ["info mount.json", "info mount.json --json", "identify loop.csv -o m.json", "--help",
     "study mount.json --mass 5 --draws 0 --points 2 --workers 1 --force 0.1 -o r.csv"],
)  # fmt: skip
def test_standard_output_that_cannot_be_written_is_one_sentence(
    loop: str, model: str, tmp_path: Path, arguments: str
) -> None:
    assert Path(loop).parent == Path(model).parent == tmp_path
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            program(*arguments.split()), cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, timeout=120,
            check=False,
        )  # fmt: skip
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1] == (
        "strandspring: Standard output cannot be written: No space left on device; send it elsewhere."
    )


def test_a_reader_that_leaves_early_is_no_error_to_tell(model: str, tmp_path: Path) -> None:
    process = subprocess.Popen(
        program("info", model, "--json"), cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    assert process.stderr.read() == b""
    process.stderr.close()
    process.wait(timeout=120)


def test_a_failure_that_is_not_of_standard_output_is_not_called_so(
    run: Any, model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError("the disk is gone")

    monkeypatch.setattr("strandspring.api.fmus.building.build_native_fmu", fail)
    outcome = run("build", model)
    assert outcome.status == 1
    assert outcome.err.startswith("strandspring: the disk is gone; check the path, ")


@pytest.mark.slow
def test_json_goes_alone_to_standard_output_of_the_real_program(loop: str, tmp_path: Path) -> None:
    command = program("identify", loop, "-o", "m.json", "--json")
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["model"] == "m.json"
    assert done.stderr.startswith("Caution: ")


def test_an_interrupt_ends_in_one_sentence(run: Any, model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("strandspring.api.fmus.building.build_native_fmu", interrupt)
    done = run("build", model)
    assert done.status == 130
    assert done.err.strip() == "strandspring: interrupted; no output file is half written."


def test_bundled_model_is_what_the_bundled_record_gives(run: Any) -> None:
    run("identify", HINGE, "--reverse", "displacement", "-o", "rubber_hinge.json")
    kept = Spring.load(ROOT / "models/rubber_hinge.json")
    fresh = Spring.load("rubber_hinge.json")
    p = kept.parameters
    path = np.linspace(p.displacement_min, p.displacement_max, 200)
    loop = np.concatenate([path, path[::-1], path])
    # Another processor or LAPACK rounds differently, and n is picked from a fine but finite scan.
    assert fresh.response(loop) == pytest.approx(kept.response(loop), abs=0.02)
    assert kept.model.provenance["records"] == fresh.model.provenance["records"]


def test_the_help_lists_every_command_without_loading_it(run: Any) -> None:
    code = "import sys, strandspring.cli.main as m; m.strandspring.get_help(m.click.Context(m.strandspring)); "
    code += "print(*({'numpy', 'rich', 'scipy', 'pandas', 'pydantic', 'matplotlib', 'fmpy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout.strip() == ""
    text = run("--help").out
    assert "..." not in text.split("Commands:")[1]
    for name, summary in COMMANDS.items():
        assert f"  {name}" in text
        assert summary.endswith(".")
        assert "Usage" in run(name, "--help").out


def test_identifying_a_small_record_loads_no_pandas_rich_or_matplotlib(loop: str, tmp_path: Path) -> None:
    code = (
        "import sys\nfrom strandspring.cli.main import main\n"
        f"main(['identify', {loop!r}, '-o', 'm.json', '--degrees', '1,0'])\n"
        "print('loaded:', *({'pandas', 'rich', 'matplotlib', 'jinja2', 'fmpy', 'dask', 'pint'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.splitlines()[-1] == "loaded:"


def test_what_is_known_of_the_rig_is_taken_out_and_shown(run: Any) -> None:
    time = np.linspace(0.0, 3.0, 601)
    x = 0.02 * np.sin(2.0 * np.pi * time)
    force = Spring(spring_of(1.0, 1.0)).response(0.05 + x) - 0.5 * (2.0 * np.pi) ** 2 * x
    np.savetxt("rig.csv", np.column_stack([time, 50.0 + 1e3 * x, force]), delimiter=",", header="t [s],x [mm],F [N]",
               comments="")  # fmt: skip
    columns = ("--time", "1", "--displacement", "2", "--force", "3")
    plain = run("identify", "rig.csv", "-o", "a.json", *columns)
    assert "Note: 1 kg between load cell and spring would change the stiffness by" in unfolded(plain.out)
    given = ("--moving-mass", "0.5", "--fixture-stiffness", "1e6", "--delay", "0")
    done = run("identify", "rig.csv", "-o", "b.json", *columns, *given, "--verbose")
    assert "removed as the rig's: moving mass 0.5 kg; fixture stiffness 1e+06 N/mm; delay 0 ms" in done.out
    assert "kg between" not in done.out
    effects = {"moving_mass": 0.5, "fixture_stiffness": 1e9, "delay": 0.0}
    model = load_model("b.json")
    assert model.fit["effects"] == effects
    assert model.provenance["options"].items() >= effects.items()
    found = json.loads(run("identify", "rig.csv", "-o", "c.json", *columns, "--json", "--delay", "0").out)
    assert sum("kg between" in note for note in found["notes"]) == 1
    np.savetxt("timeless.csv", np.column_stack([x, force]), delimiter=",", header="x [m],F [N]", comments="")
    assert "--time" in run("identify", "timeless.csv", "-o", "d.json", *given).refusal
