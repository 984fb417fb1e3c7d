"""What `strandspring export` writes, in programs of others: SSP systems, a Modelica library, and C for little targets.

rumoca, a Modelica compiler and simulator, takes the library together with ``modelica_stub.mo``, which has the few
classes of the Modelica Standard Library that the library needs. FMUs for real time are measured in test_hosts.py.
"""

from __future__ import annotations

import ctypes
import math
import re
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv
from fmpy.validation import validate_fmu

from branched_springs import BRANCHED, uneven_motion
from fmu_tools import AWKWARD, CONSTANT, LONGEST, OTHER, SPRING
from oracles import oracle_force
from pages import ROOT, TEXTS, blocks
from portable_host import run
from springs import TABLE, spring
from strandspring import Spring, SpringParameters, export
from strandspring.core.parameters import SCALARS
from strandspring.core.variables import spring_parameters, start_values, variables
from strandspring.cosimulation import FmuSpring, Jacobi, one_mass, simulate
from strandspring.errors import StrandspringError
from strandspring.exchange.c_sources import STEP_SOURCES, law_path, write_c_sources
from strandspring.exchange.modelica import EXAMPLE, record_name, record_path, record_text, write_library
from strandspring.exchange.ssp import ShakenMassValues
from strandspring.fmu.description.ssv import parameter_values
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import ModelFile, load_model
from terminal import Terminal
from tools import program, slow_but, tool, ziglang

pytestmark = pytest.mark.long
HINGE = ROOT / "models" / "rubber_hinge.json"


# SSP


@pytest.mark.parametrize("parameters", [SPRING, CONSTANT, LONGEST], ids=["spring", "constant", "longest"])
def test_ssv_holds_all_that_can_be_set_with_every_bit(parameters: SpringParameters, tmp_path: Path) -> None:
    exact = replace(parameters, kE=(0.1 + 0.2, *parameters.kE[1:]), rho=100.0 + 1e-13)
    path = tmp_path / "spring.ssv"
    path.write_text(parameter_values(ModelFile("spring", exact, AWKWARD)), encoding="utf-8", newline="\n")
    read, root = read_ssv(str(path)), ElementTree.parse(path).getroot()  # by the schema of SSP 1.0
    table = [v for v in variables(*exact.counts) if v.causality in ("input", "parameter")]
    assert (read.name, root.get("description")) == ("spring", AWKWARD)
    assert [(p.name, p.type, p.unit) for p in read.parameters] == [(v.name, "Real", v.unit) for v in table]
    values = {p.name: float(p.value) for p in read.parameters}
    assert values == start_values(exact)
    assert spring_parameters(values, len(exact.kE), len(exact.kA)) == exact


MASS, STOP, STEP = 0.01, 0.02, 5e-5


def test_the_system_holds_what_its_structure_names_and_fmpy_moves_it_as_our_own_master(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from strandspring.examples import ssp_system

    ssp = tmp_path / "system.ssp"
    Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(ssp))
    system = read_ssd(str(ssp)).system  # checked by the schema of SSP 1.0
    with zipfile.ZipFile(ssp) as archive:
        names, structure = set(archive.namelist()), archive.read("SystemStructure.ssd")
        archive.extractall(tmp_path / "system")
    sources = {component.source for component in system.elements}
    sets = {f"resources/{name}.ssv" for name in ("system", *(component.name for component in system.elements))}
    assert names == {"SystemStructure.ssd", *sources, *sets}
    values = {p.name: float(p.value) for p in read_ssv(str(ssp), "resources/plant.ssv").parameters}
    # Without it OMSimulator 3 aborts.
    place = ".//{*}Annotation[@type='org.openmodelica']//{*}FixedStepMaster"
    (master,) = ElementTree.fromstring(structure).iterfind(place)
    assert 3000.0 < 1.0 / (values["frequency"] * float(master.attrib["stepSize"])) < 10000.0
    assert (master.attrib["description"], values["mass"]) == ("oms-ma", MASS)
    for name in ("spring", "plant"):
        assert validate_fmu(str(tmp_path / f"system/resources/{name}.fmu")) == []
    with pytest.raises(FMICallException, match="fatal"):
        simulate_ssp(str(ssp))  # steps of 10 ms by FMPy's default: 7 in a period
    assert "Steps of 10 ms are too long for forces that are held over them; take 1.187 ms" in capsys.readouterr().err
    plant = ShakenMassValues.suited(placed(load_model(HINGE), None)[0], MASS)

    def base(t: float) -> float:
        return plant.amplitude * math.sin(2.0 * math.pi * plant.frequency * t)

    with FmuSpring(build_native_fmu(load_model(HINGE), tmp_path)) as one:
        motion = simulate(one_mass(MASS, plant.load, base), [one], STOP, STEP, Jacobi())
    times, position, force = ssp_system.run(ssp, STEP, STOP)
    np.testing.assert_allclose(times, motion.times, rtol=0.0, atol=1e-12)
    for found, expected in ((position, motion.q[:, 0]), (force[1:], motion.force[1:, 0])):
        # Rounding of 400 steps of the same arithmetic.
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.ptp(expected))
    edited = read_ssv(str(ssp), "resources/system.ssv")
    for parameter in edited.parameters:
        parameter.value = str(2.0 * MASS) if parameter.name == "plant.mass" else parameter.value
    rows = simulate_ssp(str(ssp), stop_time=STOP - 0.5 * STEP, step_size=STEP, parameter_set=edited)
    with FmuSpring(build_native_fmu(load_model(HINGE), tmp_path)) as one:
        motion = simulate(one_mass(2.0 * MASS, plant.load, base), [one], STOP, STEP, Jacobi())
    expected = motion.q[1:, 0]
    np.testing.assert_allclose(rows["plant.position"], expected, rtol=0.0, atol=1e-9 * np.ptp(expected))


# Modelica

BENCH = """within ;
package Bench
  model Mover
    parameter Real middle=0, reach=1;
    Modelica.Mechanics.Translational.Interfaces.Flange_b flange;
  equation
    flange.s = middle + reach*sin(6*time)*(1 + 0.3*cos(17*time));
  end Mover;

  model System
    Modelica.Mechanics.Translational.Components.Fixed ground;
    {system}
  end System;
end Bench;
"""
DRIVEN = """
    StrandSpring.Components.Spring spring(data=StrandSpring.Records.{record}({changes}));
    Mover mover(middle={middle!r}, reach={reach!r});
  equation
    connect(ground.flange, spring.flange_a);
    connect(mover.flange, spring.flange_b);"""


def library_of(folder: Path, model: ModelFile) -> Any:
    """With the exported library and the stub, read from files as a Modelica tool reads them."""
    stub = folder / "Modelica.mo"
    stub.write_bytes((ROOT / "tests" / "helpers" / "modelica_stub.mo").read_bytes())
    return tool("rumoca").Session(roots=[str(write_library(folder, model, 0.0)), str(stub)])


def compiled(folder: Path, model: ModelFile, more: str = "", **fields: Any) -> Any:
    """The exported spring, driven by `Mover`."""
    folder.mkdir(exist_ok=True)
    system = DRIVEN.format(**{"changes": "", "record": "mount", "middle": 0.0, "reach": 1.0} | fields)
    (folder / "Bench.mo").write_text(BENCH.format(system=more + system), encoding="utf-8")
    return library_of(folder, model).load(folder / "Bench.mo", model="Bench.System")


def driven(t: Any) -> tuple[Any, Any]:
    """What `Bench.Mover` does about its middle, in units of its reach, and the rate of that."""
    wave, rate = np.sin(6.0 * t), 6.0 * np.cos(6.0 * t)
    return wave * (1.0 + 0.3 * np.cos(17.0 * t)), rate * (1.0 + 0.3 * np.cos(17.0 * t)) - 5.1 * wave * np.sin(17.0 * t)


# Springs, and shares of their ranges.
DRIVEN_SPRINGS = {
    "n 0.2": (SPRING, 1.0), "n 1.6": (OTHER, 1.0), "constant": (CONSTANT, 0.7), "longest": (LONGEST, 0.9),
    "square": (spring(n=20.0, sigma=0.5, saturations=5.0), 1.0), "table": (TABLE, 1.0),
    **{f"branched {name}": (p, 0.7) for name, p in BRANCHED.items()},
}  # fmt: skip


@pytest.mark.parametrize("name", slow_but(DRIVEN_SPRINGS, ("n 0.2", "n 1.6", "table", "branched both")))
def test_the_modelica_spring_follows_the_equations_and_holds_every_bit(name: str, tmp_path: Path) -> None:
    """Against an ODE solver on a path with ten reversals."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    p, share = DRIVEN_SPRINGS[name]
    low, high = p.displacement_min, p.displacement_max
    middle, reach = 0.5 * (low + high), 0.5 * share * (high - low)
    changes = "omega_start=0.2" + ", second_omega_start=-0.4" * bool(p.second)
    model = compiled(tmp_path, ModelFile("mount", p), changes=changes, middle=middle, reach=reach)
    config = tool("rumoca").SimConfig(solver="bdf", rtol=1e-10, atol=1e-13)
    found = model.simulate((0.0, 1.5), dt=1e-3, config=config)
    times = np.asarray(found.time)

    def rate(t: float) -> float:
        return float(driven(t)[1])

    # The turning points belong to the path, wherever the samples fall.
    signs = np.flatnonzero(driven(times[:-1])[1] * driven(times[1:])[1] < 0.0)
    every = np.union1d(times, [brentq(rate, times[k], times[k + 1], xtol=1e-15) for k in signs])
    path, sampled = middle + reach * driven(every)[0], np.searchsorted(every, times)
    assert found["spring.displacement"] == pytest.approx(path[sampled], rel=1e-12)  # rounding of the sine
    outside = (path < low) | (path > high)
    assert np.array_equal(np.asarray(found["spring.extrapolating"]) > 0.5, outside[sampled])
    expected = oracle_force(replace(p, branches=()), path, every, (0.2, -0.4))[sampled]
    for branch in p.branches:

        def stretched(t: float, e: Any, tau: float = branch.time_constant) -> Any:
            return reach * rate(t) - e / tau

        elongation = solve_ivp(stretched, (0.0, 1.5), [0.0], "LSODA", np.unique(times), rtol=1e-11, atol=1e-14)
        expected += branch.stiffness * elongation.y[0][np.searchsorted(elongation.t, times)]
    # The simulator's error adds up over its steps.
    assert found["spring.f"] == pytest.approx(expected, abs=2e-8 * float(np.abs(expected).max()))
    text = record_text(ModelFile("mount", p), "mount", "")
    for array in ("kE", "kA"):  # the compiler does not tell their values
        (declared,) = re.findall(rf"^    {array}=(?:\{{(.*?)\}}|fill\(0\.0, 0\))", text, re.DOTALL | re.MULTILINE)
        assert tuple(map(float, declared.split(",") if declared else ())) == getattr(p, array)
    of = {v.name: v for v in variables(*p.counts)}
    for name in (*SCALARS, "omega_start"):
        found, value = model.parameters[f"spring.data.{name}"], getattr(p, name, 0.2)
        assert (found.value, found.unit, found.min) == (value, of[name].unit, of[name].minimum)
        assert found.description == of[name].description


def test_whatever_a_model_and_its_text_are_called_it_is_modelica(tmp_path: Path) -> None:
    for name in ("model", "Real", "SpringData", "strandedwiremount", "Spring", "Components", "data", "s_rel", "Model"):
        record = record_name(name)
        assert (record == f"_{name}") == (name in ("model", "Real", "SpringData", "strandedwiremount"))
        assert compiled(tmp_path / name, ModelFile(name, SPRING), record=record).states.names
        assert [d for d in tool("rumoca").validate(record_path(tmp_path / name, name)) if d.level != "warning"] == []
    model = ModelFile("mount", SPRING, AWKWARD)
    text = record_text(model, "mount", "")
    (literal,) = re.findall(r"^record mount (\".*\")$", text, re.MULTILINE)
    (page,) = re.findall(r"^<p>\n(.*quoted.*)\n</p>$", text, re.MULTILINE)
    system = f'parameter Real a=1 {literal};\n    parameter Real b=1 "{page}";'
    found = compiled(tmp_path, model, system.replace("{{", "{ {")).parameters
    assert found["a"].description.replace("{ {", "{{") == AWKWARD
    assert not re.search("<b>|</html>", found["b"].description)
    assert found["b"].description.startswith("&quot;quoted&quot; &#x27;single&#x27; &lt;b&gt;bold&lt;/b&gt; &lt;/html")


def test_springs_share_one_library_whose_folders_list_their_classes(tmp_path: Path) -> None:
    models = {name: ModelFile(name, SPRING) for name in ("first", "second", "First")}
    contents = []
    for folder, names in (("one", ["second", "first"]), ("two", ["first", "second", "first"])):
        for name in names:
            root = write_library(tmp_path / folder, models[name], 0.0)
        contents.append({path.relative_to(root): path.read_bytes() for path in root.rglob("*") if path.is_file()})
    assert contents[0] == contents[1]
    assert (root / "Records/package.order").read_text() == "SpringData\nStrandedWireMount\nfirst\nsecond\n"
    for order in root.rglob("package.order"):
        classes = {
            p.stem for p in order.parent.iterdir() if p.is_dir() or (p.suffix == ".mo" and p.name != "package.mo")
        }
        assert sorted(order.read_text(encoding="utf-8").split()) == sorted(classes), order
    with pytest.raises(StrandspringError, match=r"First\.mo would take the place of first\.mo where file names ignore"):
        write_library(tmp_path / "one", models["First"], 0.0)


def test_the_loop_of_the_documentation_is_modelica(tmp_path: Path) -> None:
    library = library_of(tmp_path, EXAMPLE)
    # Without a parameter of it, rumoca does not look for the library Modelica.
    unused = "  parameter Modelica.Units.SI.Mass unused=1;\nend"
    source = f"within ;\nmodel Run\n  extends StrandSpring.Examples.QuasiStaticLoop;\n{unused} Run;\n"
    assert np.ptp(library.loads(source, model="Run").simulate((0.0, 1.0), dt=0.1)["spring.f"]) > 0.0


# C

HERE = Path(__file__).with_name("targets")
# FA as wild as a polynomial of degree 8 can be: a Chebyshev polynomial.
WILD = spring(
    n=0.22, sigma=3.0, saturations=20.0,
    amplifier=(0.0, -288.0 / 19.0, 0.0, 1440.0 / 19.0, 0.0, -2304.0 / 19.0, 0.0, 1152.0 / 19.0),
)  # fmt: skip
MOST_STACK = 512  # of a step, as strandspring.h says [B]
FLAGS = ("-std=c11", "-ffp-contract=off")
# Compilers call these by themselves; those of Arm's ABI are the same.
MEMORY = {"memcpy", "memmove", "memset"} | {
    f"__aeabi_mem{what}{width}" for what in ("cpy", "set", "clr", "move") for width in ("", "4", "8")
}


def cc(output: Path, *arguments: str | Path, compiler: tuple[str, ...] = ("cc",)) -> Path:
    """Run a C compiler; a warning is an error."""
    compiler = program(compiler[0], package="gcc libc6-dev"), *compiler[1:]
    run([*compiler, "-Wall", "-Wextra", "-Wpedantic", "-Werror", *arguments, "-o", output])
    return output


def exported(folder: Path, parameters: SpringParameters, name: str = "mount") -> Path:
    """The C file of a spring, with what it needs beside it."""
    write_c_sources(folder, ModelFile(name, parameters), 0.0)
    return law_path(folder, name)


def steps(sources: Path) -> list[Path]:
    """What steps are compiled of."""
    return [sources.parent / name for name in STEP_SOURCES]


def test_the_example_in_the_header_runs_as_it_stands_there_by_any_name(tmp_path: Path) -> None:
    """In C and in C++; without a description of the model, and in the same bytes beside other springs."""
    (law,) = export(Spring(SPRING, "mount", "*/ #error planted /* äöü"), tmp_path, c=True, zero=0.0)
    header = (law.parent / "strandspring.h").read_text(encoding="utf-8")
    block = re.findall(r"(?:^ \*(?:     .*)?\n)+", header, re.MULTILINE)[0]
    text = "".join(f"{line[7:]}\n" for line in block.splitlines()[1:-1])
    example = law.parent / "mount_example.c"
    assert example.read_text() == text == blocks("real-time", "c")[0]
    for standard in ("-std=c11", "-std=c2x"):
        run([cc(tmp_path / "example", standard, example, law, *steps(law))])
    cpp = ziglang("c++")
    cc(tmp_path / "main.o", "-O1", "-std=c++17", "-x", "c++", "-c", example, compiler=cpp)
    before = {path.name: path.read_bytes() for path in law.parent.iterdir()}
    assert not any(b"planted" in content for content in before.values())
    for name in ("two", "int", "SPRING", "memcpy", "NULL"):
        other = exported(tmp_path, TABLE, name)
        cc(tmp_path / "none", "-std=gnu11", "-fsyntax-only", other.parent / f"{name}_example.c", other)
    write_c_sources(tmp_path, ModelFile("mount", SPRING), 0.0)
    assert {name: (law.parent / name).read_bytes() for name in before} == before
    local = law.parent / "spring_local.h"
    local.write_text(re.sub(r"SPRING_KERNEL 0x\w{8}", "SPRING_KERNEL 0x0", local.read_text()))
    with pytest.raises(AssertionError, match="export the spring again"):
        cc(tmp_path / "law.o", *FLAGS, "-c", law)


C_HOST = """
#include "mount_law.h"
#ifdef ADDED
#include "plain_law.h" /* beside it */
#endif
void follow(int count, const double *h, const double *x, double (*found)[3])
{
    SpringMemory memory = spring_start(x[0], 0.2);
#ifdef ADDED
    const SpringAdded *has = &mount_law_added;
    SpringAddedMemory added = spring_added_start(x[0], -0.4);
#endif
    for (int k = 0; k < count; k++) {
#ifdef ADDED
        SpringDecay decays[SPRING_MAXWELLS];
        for (int j = 0; j < has->branches; j++)
            decays[j] = spring_decay(h[k] / has->time_constant[j]);
        spring_added_commit(has, &mount_law_second, &added, 0, memory.displacement, x[k], h[k], decays);
        spring_commit(&mount_law_first, &memory, NULL, x[k]);
        found[k][0] = spring_added_force(has, &mount_law_second, &added) + spring_force(&mount_law_first, &memory);
        found[k][1] = spring_added_energy(has, &mount_law_second, &added);
        found[k][1] += spring_absorbed_energy(&mount_law_first, &memory);
        found[k][2] = spring_added_stored(has, &added);
#else
        (void)h;
        spring_commit(&mount_law, &memory, NULL, x[k]);
        found[k][0] = spring_force(&mount_law, &memory);
        found[k][1] = spring_absorbed_energy(&mount_law, &memory);
        found[k][2] = spring_stiffness(&mount_law, &memory);
#endif
    }
}
"""


@pytest.mark.parametrize("name", slow_but(["plain", "plain table", *BRANCHED], ("plain", "both")))
def test_the_exported_spring_answers_as_the_package(name: str, tmp_path: Path) -> None:
    """One with a second mechanism and branches beside a plain one."""
    p = {"plain": SPRING, "plain table": TABLE, **BRANCHED}[name]
    time, path = uneven_motion()
    path = p.displacement_min + (path - path.min()) / np.ptp(path) * (p.displacement_max - p.displacement_min)
    law = exported(tmp_path, p)
    plain, sources, flags = exported(tmp_path, SPRING, "plain"), [law, *steps(law)], [*FLAGS, "-O2", f"-I{law.parent}"]
    if not p.is_plain:
        sources, flags = [*sources, law.with_name("branches.c"), plain], [*flags, "-DADDED"]
        run([cc(tmp_path / "example", *flags, law.with_name("mount_example.c"), *sources)])
    host = tmp_path / "host.c"
    host.write_text(C_HOST)
    functions = ctypes.CDLL(str(cc(tmp_path / "host.so", "-shared", "-fPIC", *flags, host, *sources)))
    steps_of_time, found = np.diff(time, prepend=0.0), np.empty((path.size, 3))
    functions.follow(path.size, *(array.ctypes.data_as(ctypes.c_void_p) for array in (steps_of_time, path, found)))
    force, energy, third = found.T
    spring, starts = Spring(p), (0.2, -0.4) if p.second else 0.2
    assert force == pytest.approx(spring.response(path, starts, time), abs=1e-12 * np.abs(force).max())
    work = spring.absorbed_energy(path, starts, time=time)
    assert energy == pytest.approx(work, abs=1e-11 * np.abs(work).max())  # rounding of sums
    if p.is_plain:
        assert third == pytest.approx(spring.stiffness(path, 0.2), rel=1e-11)
    else:
        assert third == pytest.approx(spring.stored_energy(path, time=time), rel=1e-10, abs=1e-15)


def for_target(output: Path, *arguments: str | Path) -> Path:
    """Compiled for a Cortex-M7 with a unit for double precision, without a C library and an operating system."""
    target = ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m7+fp_armv8d16", "-Os")
    freestanding = ("-ffreestanding", "-nostdlib", "-fno-unwind-tables")
    return cc(output, *target, *FLAGS, *freestanding, *arguments, compiler=ziglang("cc"))


def sizes(*paths: Path) -> tuple[set[str], dict[str, int]]:
    """Names that object files in ELF lack, and bytes of code, constants and variables."""
    import lief

    lacks, sizes = set[str](), {".text": 0, ".rodata": 0, ".data": 0, ".bss": 0}
    for path in paths:
        parsed = lief.parse(path)
        assert isinstance(parsed, lief.ELF.Binary)
        for section, kind in ((one, kind) for one in parsed.sections for kind in sizes):
            sizes[kind] += section.size if str(section.name).startswith(kind) else 0
        local = lief.ELF.Symbol.BINDING.LOCAL
        lacks |= {str(one.name) for one in parsed.symbols if one.name and one.shndx == 0 and one.binding != local}
    return {name for name in lacks if not name.startswith("spring_")} - MEMORY, sizes


@pytest.mark.parametrize("name", slow_but(["usual", "wild", "table"], ("wild",)))
def test_targets_need_no_library_and_give_the_bits_of_the_host(name: str, tmp_path: Path) -> None:
    law = exported(tmp_path, {"usual": SPRING, "wild": WILD, "table": TABLE}[name])
    files, include = [*steps(law), law.parent / "saturation_table.c"], f"-I{law.parent}"
    lacks, code = sizes(*(for_target(tmp_path / f"{path.stem}.o", include, "-c", path) for path in files))
    constant = sizes(for_target(tmp_path / "law.o", "-c", law))[1]
    # The table is constant and needs no start code; a pointer to it is not relocated before main.
    assert (lacks, code[".data"] + code[".bss"]) == (set(), 0)
    assert constant[".text"] == constant[".data"] == constant[".bss"] == 0
    said = re.findall(r"\| Cortex-M7\b.*? \| (\d+) kB \| (\d+) kB \|", TEXTS["real-time"])
    for size, stated in zip((code[".text"] + code[".rodata"], constant[".rodata"]), *said, strict=True):
        assert 0.8 < size / (1000.0 * int(stated)) <= 1.0  # as the documentation says
    sources = (HERE / "steps.c", law, *steps(law))
    here = run([cc(tmp_path / "steps", "-O2", *FLAGS, include, *sources)])
    link = ("-T", HERE / "cortex_m7.ld", HERE / "semihosting.c")
    image = for_target(tmp_path / "image.elf", include, *link, *sources, "-lcompiler_rt")
    command = [program("qemu-system-arm", package="qemu-system-arm"), "-M", "mps2-an500", "-nographic"]
    command += ["-semihosting-config", "enable=on,target=native", "-kernel", str(image)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, stdin=subprocess.DEVNULL)
    there = done.stdout + done.stderr  # semihosting writes where errors go
    *digests, _ = here.split()
    assert (len(digests), len(set(digests))) == (48, 48)
    assert there.split()[:-1] == digests, there[:2000]
    assert all(0 < int(text.split()[-1], 16) < MOST_STACK for text in (here, there))
