"""What README and documentation say is what happens."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest
from scipy.io import savemat

import pictures
import strandspring
from pages import README, ROOT, TEXTS, blocks, program_with
from strandspring import Spring, StrandspringError, read_record
from strandspring.cli.commands.docs import reference
from strandspring.cli.main import COMMANDS
from strandspring.cli.main import strandspring as program
from strandspring.core.parameters import SCALARS, SpringParameters
from strandspring.core.variables import variables
from strandspring.docs.site import PAGES, Reference, write_site
from strandspring.ground import strict_json, unpacking
from strandspring.loops import selection
from strandspring.model import modelfile
from strandspring.records import content as record_content
from strandspring.records.formats import reader_process
from strandspring.records.source import MAX_ROWS
from strandspring.vibration.bodies.mounted import MOST_AXES, MOST_BODIES
from strandspring.vibration.bodies.simulation import MOST_STEPS
from strandspring.vibration.description import system_file

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what a user has, with the main job done in it."""
    folder = tmp_path_factory.mktemp("readme")
    (folder / "models").mkdir()
    (folder / "models" / "records").symlink_to(ROOT / "models" / "records")
    (folder / "build_fmu.py").write_bytes((ROOT / "build_fmu.py").read_bytes())
    done = run([sys.executable, "build_fmu.py"], folder)
    assert done.returncode == 0, done.stderr
    (folder / "build.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
    return folder


def run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)


def commands(page: str) -> list[list[str]]:
    """The commands of a page, those to install and to test left out."""
    lines = [
        shlex.split(line.removeprefix("python -m "))
        for block in blocks(page, "sh")
        for line in block.replace("\\\n", "").splitlines()
    ]
    return [words for words in lines if words[0].startswith("strandspring")]


def test_the_main_job_prints_what_the_readme_shows(folder: Path) -> None:
    said = (folder / "build.txt").read_text(encoding="utf-8")
    (shown,) = blocks("README", "text")
    for line in shown.splitlines():
        pieces = [re.escape(piece) for piece in re.split(r"\s*\.\.\.,?\s*", line)]
        assert re.search(r".*".join(pieces), said), line
    for backend in ("rubber_hinge", "rubber_hinge_python"):
        assert (folder / f"dist/{backend}.fmu").stat().st_size > 50_000


def test_plan_prints_what_the_page_shows(capsys: pytest.CaptureFixture[str]) -> None:
    model = ROOT / "models" / "rubber_hinge.json"
    program(["plan", str(model), "--velocity", "10", "--sample-rate", "50"], "strandspring", standalone_mode=False)
    (shown,) = blocks("planning", "text")
    assert capsys.readouterr().out == shown


def test_simulate_prints_what_the_page_shows(tmp_path: Path) -> None:
    example = [sys.executable, "-m", "strandspring.examples.system_models", "systems"]
    assert run(example, tmp_path).returncode == 0
    again = run(example, tmp_path)  # Nothing is overwritten.
    assert (again.returncode, again.stderr) == (1, "systems: File exists; give the name of a new folder.\n")
    said = run([sys.executable, "-m", "strandspring", "simulate", "systems/electronics_box.toml"], tmp_path).stdout
    (shown,) = blocks("systems", "text")
    for line in shown.splitlines():
        assert re.search(rf"^{re.escape(line)}", said, flags=re.MULTILINE), line


def test_the_first_command_is_the_main_job_and_the_second_the_tests() -> None:
    first, second = blocks("README", "sh")[0].splitlines()
    assert first == "pip install . && python build_fmu.py"
    assert second == 'pip install ".[test]" && python -m pytest'


@pytest.mark.slow
def test_commands_run_in_order(folder: Path) -> None:
    model = folder / "models/rubber_hinge.json"
    (folder / "lot7").mkdir()
    for name, noise in (("loop.csv", "0.01"), ("other.csv", "0.02"), ("lot7/loop.csv", "0.015")):
        made = run(
            [sys.executable, "-m", "strandspring", "synthesize", "spring", str(model), "--noise", noise, "-o", name],
            folder,
        )
        assert made.returncode == 0, made.stderr
    (folder / "other.json").write_bytes(model.read_bytes())
    for page in (name for name in TEXTS if name != "gallery"):  # whose commands draw the pictures of the site
        for words in commands(page):
            done = run([sys.executable, "-m", *words], folder)
            assert done.returncode == 0, (page, words, done.stderr)
    written = (
        "spring.json", "spring.html", "loop.html", "curves.png", "candidates.png", "study.csv",
        "dist/spring.fmu", "dist/spring_python.fmu", "dist/spring.ssv", "dist/spring.ssp",
        "dist/StrandSpring/Records/spring.mo", "firmware/strandspring_c/spring_law.c", "lot7_models/springs.csv",
        "box.html", "sheet.png", "figures.csv", "masses.csv", "numbers.csv", "cradle.png", "dist/Electronics_box.fmu",
    )  # fmt: skip
    for name in written:
        assert (folder / name).stat().st_size > 0


@pytest.mark.slow
def test_python_programs_run_in_order(folder: Path) -> None:
    (folder / "spring.json").write_bytes((folder / "models/rubber_hinge.json").read_bytes())
    record = read_record(folder / "models/records/rubber_stretch.csv", reverse="displacement")
    channels = {"displacement": 1e3 * record.displacement, "force": record.force, "time": record.time}
    savemat(folder / "rig.mat", channels)
    for page in TEXTS:
        (folder / "program.py").write_text("\n".join(blocks(page, "python")), encoding="utf-8")
        done = run([sys.executable, "-W", "error", "program.py"], folder)
        assert done.returncode == 0, (page, done.stderr)
    for name in (
        "hinge.json",
        "hinge.html",
        "loop.svg",
        "curves.svg",
        "rig_record.html",
        "rig_report.html",
        "mount.json",
        "dist/mount.fmu",
        "drop.html",
    ):
        assert (folder / name).stat().st_size > 0
    assert "def simulate" in program_with("def simulate")


@pytest.mark.parametrize("page", TEXTS)
def test_commands_options_and_links_exist(page: str) -> None:
    options = {
        option
        for name in COMMANDS
        for option in re.findall(r"--[a-z][a-z-]+", help_of(name))
    } | {"--help", "--version", "--check"}  # fmt: skip
    prose = re.sub(r"```(?!sh).*?```", "", TEXTS[page], flags=re.DOTALL)
    if not page.startswith("figures"):  # whose options are those of benchmarks
        assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", prose)) <= options
    assert set(re.findall(r"`strandspring ([a-z-]+)", prose)) - {"docs"} <= set(COMMANDS)
    base = ROOT if page == "README" else ROOT / "fmu_src/strandspring/docs/pages"
    # Pictures of the gallery are drawn where the site is built, which finds that one is missing.
    for target in re.findall(r"(?<!!)\[[^\]]*\]\(([^)#]+)\)|src=\"([^\"]+)\"", prose):
        assert (base / "".join(target)).exists(), target


def help_of(name: str) -> str:
    """The help of a command and of those below it."""
    command = program.get_command(click.Context(program), name)
    assert command is not None
    below = command.commands.values() if isinstance(command, click.Group) else ()
    return "".join(each.get_help(click.Context(each)) for each in (command, *below))


@pytest.mark.slow
def test_the_pictures_are_drawn_by_the_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    pictures.draw(tmp_path)
    for kept in pictures.PICTURES.iterdir():
        drawn = (tmp_path / kept.name).read_text(encoding="utf-8")
        # Fonts and versions of matplotlib may differ; axes and curves are the same.
        for kind in ("axes_", "line2d_", "text_"):
            assert drawn.count(f'id="{kind}') == kept.read_text(encoding="utf-8").count(f'id="{kind}'), kept.name


def test_functions_of_the_table_exist() -> None:
    table = TEXTS["python"].split("| command |", 1)[1].split("\n\n", 1)[0]
    rows = re.findall(r"^\| `([a-z-]+)` \| (.*?) \| (.*?) \|$", table, flags=re.MULTILINE)
    assert {command for command, _, _ in rows} == set(COMMANDS) - {"docs"}
    for _, functions, result in rows:
        for name in re.findall(r"`(\w+)`", functions + result):
            assert hasattr(strandspring, name), name


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # those of Sphinx are its own affair
def test_the_site_needs_no_network_and_has_the_same_bytes_again(tmp_path: Path) -> None:
    site = tmp_path / "site"
    with click.Context(program, info_name="strandspring"):
        content = reference()
    written = []
    for _ in range(2):  # the second one replaces what is there
        write_site(site, content)
        written.append({path.relative_to(site): path.read_bytes() for path in site.rglob("*.*")})
    one, two = written
    assert one == two
    names = {str(path) for path in one}
    assert {f"{page}.html" for page in (*PAGES[1:], "index", "commands", "api", "search")} <= names
    pictures_shown = re.findall(r"!\[.*?\]\((.*?)\)", TEXTS["gallery"])
    assert {f"_images/{name}" for name in pictures_shown} <= names
    loaded = re.compile(rb"""<(?:script|img|iframe)[^>]*src="https?:|<link[^>]*href="https?:""")
    for path, page in one.items():
        assert not loaded.search(page), path
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").touch()
    with pytest.raises(StrandspringError, match=r"other holds other files; give a new folder\.$"):
        write_site(tmp_path / "other", content)
    assert [path.name for path in (tmp_path / "other").iterdir()] == ["thesis.txt"]


def test_a_site_of_another_project_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "objects.inv").write_bytes(b"# Sphinx inventory version 2\n# Project: thesis\n# Version: 1\n")
    with pytest.raises(StrandspringError, match=r"holds other files; give a new folder\.$"):
        write_site(tmp_path, Reference({}, ()))
    assert (tmp_path / "objects.inv").is_file()
    (tmp_path / "page").touch()
    with pytest.raises(StrandspringError, match=r"page cannot be written: it is a file; give a folder\.$"):
        write_site(tmp_path / "page", Reference({}, ()))


def test_the_table_of_symbols_is_the_fmus_table() -> None:
    table = TEXTS["method"].split("| paper |", 1)[1].split("\n\n", 1)[0]
    lines = re.findall(r"^\|(.*)\|$", table, flags=re.MULTILINE)[1:]
    rows = [[cell.strip() for cell in line.split("|")] for line in lines]
    units = {v.name: v.unit for v in (*variables(1, 1), *variables(0, 1, 1))}
    listed = {}
    for _, python, fmu, unit in rows:
        names = re.findall(r"`([^`]+)`", fmu)
        listed[names[0]] = unit
        if python:
            (name,) = re.findall(r"`([^`]+)`", python)
            known = {*SpringParameters.__dataclass_fields__, *dir(Spring), "displacement", "omega_start"}
            assert name in known, name
    assert set(listed) == set(units)
    assert set(SCALARS) < set(listed)
    for name, unit in listed.items():
        expected = units[name] or ""
        assert unit == (f"{expected}/m^i" if name == "kE_0" else "1/m^i" if name == "kA_0" else expected), name


def test_the_bounds_of_files_are_those_of_the_program() -> None:
    bounds = (
        f"{record_content.MAX_BYTES // 2**30} GiB, {record_content.MAX_UNPACKED_BYTES // 2**20} MiB unpacked, "
        f"{MAX_ROWS // 10**6} million rows",
        f"{reader_process._MEMORY // 2**20} MiB of memory",
        f"{reader_process._SECONDS:g} s of processor time plus 1 s for each "
        f"{reader_process._BYTES_PER_SECOND / 1e6:g} MB",
        f"at most {strict_json._MAX_NESTING} levels",
        f"| {modelfile.MAXIMUM_BYTES // 10**6} MB |",
        f"{modelfile.MAXIMUM_FMU_BYTES // 10**6} MB packed or unpacked, {unpacking._MOST_FILES:_} files",
        f"| {selection._MAX_BYTES // 10**6} MB, {selection._MAX_FILES:_} files |",
        f"| {system_file._MAX_BYTES // 10**6} MB, {system_file._MOST_MODELS} model files, {MOST_BODIES} bodies, "
        f"{MOST_AXES} axes of mounts, {MOST_STEPS // 10**6} million steps of a case |",
    )
    for bound in bounds:
        assert bound.replace("_", " ") in TEXTS["security"], bound


def test_help_lists_all_pages() -> None:
    assert set(PAGES) <= set(re.findall(r"[a-z-]+", help_of("docs")))


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) <= 150


@pytest.mark.parametrize("page", PAGES)
def test_pages_are_short(page: str) -> None:
    assert len(TEXTS[page].split()) <= 1500


def test_benchmarks_of_the_figures_are_run_by_one_command() -> None:
    source = (ROOT / "tests/benchmarks/run.py").read_text(encoding="utf-8")
    names = {name.replace("_", "-") for name in re.findall(r"\b[a-z_]+\.([a-z_0-9]+),", source)}
    cited = set(re.findall(r"\brun\.py ([a-z0-9-]+)", "".join(TEXTS.values())))
    cited |= set(re.findall(r"`([a-z-]+)(?: --[a-z]+ \d+)?` \|$", TEXTS["figures-speed"], flags=re.MULTILINE))
    assert len(cited) > 10
    assert cited - names == set()
