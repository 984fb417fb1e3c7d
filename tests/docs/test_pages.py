"""What README and documentation say is what happens."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

import strandspring
from pages import README, ROOT, TEXTS, blocks
from strandspring import Spring, StrandspringError, read_record
from strandspring.cli.documentation import reference
from strandspring.cli.main import COMMANDS
from strandspring.cli.main import strandspring as program
from strandspring.cli.options import SHOWS_ALL
from strandspring.core.parameters import SCALARS, SpringParameters
from strandspring.core.variables import variables
from strandspring.docs.site import PAGES, Reference, write_site

pytestmark = pytest.mark.long


def run(folder: Path, *words: str) -> str:
    """What a program of Python prints."""
    done = subprocess.run([sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (words, done.stderr)
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what a user has, with the main job done in it."""
    folder = tmp_path_factory.mktemp("readme")
    (folder / "models").mkdir()
    (folder / "models" / "records").symlink_to(ROOT / "models" / "records")
    (folder / "build_fmu.py").write_bytes((ROOT / "build_fmu.py").read_bytes())
    (folder / "build.txt").write_text(run(folder, "build_fmu.py"), encoding="utf-8")
    return folder


def check_shown(page: str, said: str) -> None:
    """Every line of the text on a page is printed, with anything where it has dots."""
    (shown,) = blocks(page, "text")
    for line in shown.splitlines():
        pieces = [re.escape(piece) for piece in re.split(r"\s*\.\.\.,?\s*", line)]
        assert re.search(r".*".join(pieces), said), line


def test_the_first_command_is_the_main_job_and_prints_what_the_readme_shows(folder: Path) -> None:
    first, second = blocks("README", "sh")[0].splitlines()
    assert first == "pip install . && python build_fmu.py"
    assert second == 'pip install ".[test]" && python -m pytest'
    check_shown("README", (folder / "build.txt").read_text(encoding="utf-8"))
    for backend in ("rubber_hinge", "rubber_hinge_python"):
        assert (folder / f"dist/{backend}.fmu").stat().st_size > 50_000


@pytest.mark.slow
def test_plan_and_simulate_print_what_their_pages_show(tmp_path: Path) -> None:
    model = str(ROOT / "models" / "rubber_hinge.json")
    words = ["-m", "strandspring", "plan", model, "--velocity", "10", "--sample-rate", "50"]
    assert blocks("planning", "text") == [run(tmp_path, *words)]
    run(tmp_path, "-m", "strandspring.examples.system_models", "systems")
    check_shown("systems", run(tmp_path, "-m", "strandspring", "simulate", "systems/electronics_box.toml"))


@pytest.mark.slow
def test_commands_run_in_order(folder: Path) -> None:
    (folder / "lot7").mkdir()
    for name, noise in (("loop.csv", "0.01"), ("other.csv", "0.02"), ("lot7/loop.csv", "0.015")):
        spring = ("spring", "models/rubber_hinge.json", "--noise", noise)
        run(folder, "-m", "strandspring", "synthesize", *spring, "-o", name)
    (folder / "other.json").write_bytes((folder / "models/rubber_hinge.json").read_bytes())
    for page in (name for name in TEXTS if name != "gallery"):  # whose commands draw the pictures of the site
        for block in blocks(page, "sh"):
            for line in block.replace("\\\n", "").splitlines():
                words = shlex.split(line.removeprefix("python -m "))
                if words[0].startswith("strandspring"):  # neither those that install nor those that test
                    run(folder, "-m", *words)
    written = (
        "spring.json spring.html loop.html curves.png candidates.png study.csv dist/spring.fmu dist/spring_python.fmu "
        "dist/spring.ssv dist/spring.ssp dist/StrandSpring/Records/spring.mo firmware/strandspring_c/spring_law.c "
        "lot7_models/springs.csv box.html sheet.png figures.csv masses.csv numbers.csv cradle.png "
        "dist/Electronics_box.fmu"
    )
    assert [name for name in written.split() if not (folder / name).stat().st_size] == []


@pytest.mark.slow
def test_python_programs_run_in_order(folder: Path) -> None:
    from scipy.io import savemat

    (folder / "spring.json").write_bytes((folder / "models/rubber_hinge.json").read_bytes())
    record = read_record(folder / "models/records/rubber_stretch.csv", reverse="displacement")
    channels = {"displacement": 1e3 * record.displacement, "force": record.force, "time": record.time}
    savemat(folder / "rig.mat", channels)
    for page in TEXTS:
        (folder / "program.py").write_text("\n".join(blocks(page, "python")), encoding="utf-8")
        run(folder, "-W", "error", "program.py")
    written = "hinge.json hinge.html loop.svg curves.svg rig_record.html rig_report.html dist/mount.fmu drop.html"
    assert [name for name in written.split() if not (folder / name).stat().st_size] == []


def help_of(name: str) -> str:
    """The help of a command and of those below it."""
    command = program.get_command(click.Context(program), name)
    assert command is not None
    below = command.commands.values() if isinstance(command, click.Group) else ()
    contexts = [(each, click.Context(each)) for each in (command, *below)]
    for _, context in contexts:
        context.meta[SHOWS_ALL] = True
    return "".join(each.get_help(context) for each, context in contexts)


def test_commands_options_functions_and_links_exist() -> None:
    options = {"--help", "--version", "--check"} | set(re.findall(r"--[a-z][a-z-]+", "".join(map(help_of, COMMANDS))))
    for page, text in TEXTS.items():
        prose = re.sub(r"```(?!sh).*?```", "", text, flags=re.DOTALL)
        if not page.startswith("figures"):  # whose options are those of benchmarks
            assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", prose)) <= options, page
        assert set(re.findall(r"`strandspring ([a-z-]+)", prose)) - {"docs"} <= set(COMMANDS), page
        base = ROOT if page == "README" else ROOT / "fmu_src/strandspring/docs/pages"
        # Pictures of the gallery are drawn where the site is built, which finds that one is missing.
        for target in re.findall(r"(?<!!)\[[^\]]*\]\(([^)#]+)\)|src=\"([^\"]+)\"", prose):
            assert (base / "".join(target)).exists(), (page, target)
    assert set(PAGES) <= set(re.findall(r"[a-z-]+", help_of("docs")))
    assert len(README.splitlines()) <= 150
    assert [page for page in PAGES if len(TEXTS[page].split()) > 1500] == []
    table = TEXTS["python"].split("| command |", 1)[1].split("\n\n", 1)[0]
    rows = re.findall(r"^\| `([a-z-]+)` \| (.*?) \| (.*?) \|$", table, flags=re.MULTILINE)
    assert {command for command, _, _ in rows} == set(COMMANDS) - {"docs"}
    assert all(hasattr(strandspring, name) for row in rows for name in re.findall(r"`(\w+)`", row[1] + row[2]))


def test_the_table_of_symbols_is_the_fmus_table() -> None:
    table = TEXTS["method"].split("| paper |", 1)[1].split("\n\n", 1)[0]
    units = {v.name: v.unit or "" for v in (*variables(1, 1), *variables(0, 1, 1))}
    known = {*SpringParameters.__dataclass_fields__, *dir(Spring), "displacement", "omega_start"}
    listed = {}
    for line in re.findall(r"^\|(.*)\|$", table, flags=re.MULTILINE)[1:]:
        _, python, fmu, unit = (cell.strip() for cell in line.split("|"))
        assert set(re.findall(r"`([^`]+)`", python)) <= known, python
        listed[re.findall(r"`([^`]+)`", fmu)[0]] = unit
    assert listed == units | {"kE_0": f"{units['kE_0']}/m^i", "kA_0": "1/m^i"}
    assert set(SCALARS) < set(listed)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # those of Sphinx are its own affair
def test_the_site_needs_no_network_and_has_the_same_bytes_again(tmp_path: Path) -> None:
    with click.Context(program, info_name="strandspring"):
        content = reference()
    written = []
    for _ in range(2):  # the second one replaces what is there
        write_site(tmp_path / "site", content)
        files = (tmp_path / "site").rglob("*.*")
        written.append({str(path.relative_to(tmp_path / "site")): path.read_bytes() for path in files})
    assert written[0] == written[1]
    assert {f"{page}.html" for page in (*PAGES[1:], "index", "commands", "api", "search")} <= set(written[0])
    shown = {f"_images/{name}" for name in re.findall(r"!\[.*?\]\((.*?)\)", TEXTS["gallery"])}
    assert shown <= set(written[0])
    loaded = re.compile(rb"""<(?:script|img|iframe)[^>]*src="https?:|<link[^>]*href="https?:""")
    assert [name for name, page in written[0].items() if loaded.search(page)] == []


def test_a_folder_with_other_files_is_not_replaced_by_the_site(tmp_path: Path) -> None:
    (tmp_path / "objects.inv").write_bytes(b"# Sphinx inventory version 2\n# Project: thesis\n# Version: 1\n")
    with pytest.raises(StrandspringError, match=r"holds other files; give a new folder\.$"):
        write_site(tmp_path, Reference({}, ()))
    with pytest.raises(StrandspringError, match=r"objects.inv cannot be written: it is a file; give a folder\.$"):
        write_site(tmp_path / "objects.inv", Reference({}, ()))
    assert [path.name for path in tmp_path.iterdir()] == ["objects.inv"]


def test_benchmarks_of_the_figures_are_run_by_one_command() -> None:
    source = (ROOT / "tests/benchmarks/run.py").read_text(encoding="utf-8")
    names = {name.replace("_", "-") for name in re.findall(r"\b[a-z_]+\.([a-z_0-9]+),", source)}
    cited = set(re.findall(r"\brun\.py ([a-z0-9-]+)", "".join(TEXTS.values())))
    cited |= set(re.findall(r"`([a-z-]+)(?: --[a-z]+ \d+)?` \|$", TEXTS["figures-speed"], flags=re.MULTILINE))
    assert len(cited) > 7
    assert cited - names == set()
