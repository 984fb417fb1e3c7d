"""FMUs in other programs: a C host without Python, threads, forks, other rounding, little stack, compilers.

What simulators make of FMUs is in tests/interop; memory is counted and withheld in tests/fuzz. The macOS binary cannot
be run here; test_build.py looks into it.
"""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import subprocess
import sys
from _ctypes import dlclose
from pathlib import Path

import numpy as np
import pytest

from branched_springs import BRANCHED
from fmu_tools import OTHER, SPRING
from forms import FORMS, SYSTEMS
from kernel_tools import build_folder, compiled
from native_tools import FUNCTIONS, HEADERS, Library, Native
from portable_host import ENVIRONMENT, host, run
from strandspring.compiled.images import KERNEL, OF_FMUS
from strandspring.compiled.sources import PACKAGE
from strandspring.cosimulation.fmu_spring import CosimulationError, FmuSpring
from strandspring.exchange.c_sources import write_c_sources
from strandspring.fmu.checks.check import examine_fmu
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile
from tools import program, ziglang

pytestmark = pytest.mark.long
NATIVE = FORMS["co-simulation"]

# In C


@pytest.mark.parametrize("task", ["fork", "threads", "little stack"])
def test_fmus_of_one_process_do_not_meet_and_threads_share_nothing_that_changes(task: str) -> None:
    """Threads under the thread sanitizer, which sees what good luck hides, or with as little stack as musl gives."""
    given: list[str | Path] = []
    flags = ("-g", "-fsanitize=thread") if task == "threads" else ()
    for of in (NATIVE.library(), NATIVE.library(OTHER)):
        binary = of.path
        if flags:
            unit = of.folder / "sources" / "fmi2_all.c"
            binary = compiled(build_folder() / f"{of.guid}.so", "-shared", "-fPIC", *flags, unit, "-lm")
        given += [binary, of.guid, of.resources.decode()]
    path = [0.02 + 1e-3 * (k * 7 % 23 - 11) for k in range(60)]
    run([host(build_folder(), *flags), task, *given], input="\n".join(map(repr, path)))


def test_a_binary_may_be_unloaded_and_loaded_again(tmp_path: Path) -> None:
    folder = shutil.copytree(NATIVE.library().folder, tmp_path / "copy")
    for _ in range(20):
        of = Library(folder)
        with Native(of) as one:
            one.begin(displacement=0.02).advance(0.03)
            assert one.get("force")[0] > 0.0
        dlclose(of.functions._handle)
        with pytest.raises(OSError, match="dlopen"):
            ctypes.CDLL(str(of.path), mode=os.RTLD_NOLOAD)


def test_springs_linked_into_one_program_have_functions_of_their_own() -> None:
    units = []
    for prefix, spring in (("one_", SPRING), ("other_", OTHER)):
        unit = NATIVE.library(spring).folder / "sources" / "fmi2_all.c"
        flags = ("-fPIC", f"-DFMI2_FUNCTION_PREFIX={prefix}", "-c")
        units.append(compiled(build_folder() / f"{prefix}.o", *flags, unit))
        listed = run(["nm", "-g", "--defined-only", "-P", units[-1]])
        assert {line.split()[0] for line in listed.splitlines()} == {prefix + name for name in FUNCTIONS}
    compiled(build_folder() / "linked.so", "-shared", *units, "-lm")


# Rounding

# Downward, upward and towards zero, as in fenv.h of the processor.
MODES = {"x86_64": (0x400, 0x800, 0xC00), "aarch64": (0x800000, 0x400000, 0xC00000)}


@pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() not in ("x86_64", "aarch64"), reason="knows these processors"
)
@pytest.mark.parametrize("name", ["co-simulation", "fmi3", "table", "branches", "python", "system"])
def test_instances_are_accurate_whatever_the_host_rounds(name: str) -> None:
    form, random = FORMS[name], np.random.default_rng(52)
    rounding, results = ctypes.CDLL("libm.so.6").fesetround, []
    starts = [
        {"rho": 310.0 * 10.0 ** random.uniform(-1.0, 1.0), "sigma": 0.5 + 10.0 ** random.uniform(-2.0, 2.99),
         "n": 10.0 ** random.uniform(-2.0, 2.0), "omega_start": random.uniform(-1.0, 1.0)} for _ in range(6)
    ]  # fmt: skip
    path, time = form.motion(60)
    for mode in (0, *MODES[platform.machine()]):
        found = []
        for start in starts[:1] if name in SYSTEMS else starts:
            with form.begun(float(path[0]), **{} if name in SYSTEMS else start) as one:
                assert rounding(mode) == 0
                try:
                    found.append(one.along(path, time, *form.outputs))
                finally:
                    rounding(0)
        results.append(np.array(found))
    usual, *others = results
    for other in others:
        assert np.any(other != usual)  # so it was rounded otherwise
        # Roundings to one side add up over a table's pieces and the path's reversals.
        assert np.max(np.abs(other - usual) / np.abs(usual).max(axis=1, keepdims=True)) < 1e-10


# Compilers


@pytest.mark.slow
@pytest.mark.parametrize("name", ["co-simulation", "fmi3", *SYSTEMS])
def test_sources_are_c99_and_what_fmpy_compiles(name: str, tmp_path: Path) -> None:
    """Whatever customary macros a tool defines, and for 32 bits."""
    form = FORMS[name]
    files = {2: "fmu/system/c/system_all.c", 3: "fmu/system/c/system_all3.c"} if name in SYSTEMS else {}
    unit = form.library().folder / "sources" / files.get(form.fmi, f"fmi{form.fmi}_all.c")
    for target in ("x86_64-linux-gnu", "x86-linux-gnu"):
        for macros in (("MODEL_EXCHANGE",), ("CO_SIMULATION",), ("MODEL_EXCHANGE", "CO_SIMULATION")):
            flags = ["-target", target, "-std=c99", "-c", "-o", str(tmp_path / "unit.o"), *(f"-D{m}" for m in macros)]
            run([*ziglang("cc"), *flags, f"-I{HEADERS}", unit])
    if name not in SYSTEMS:
        bare = build_native_fmu(ModelFile("spring", SPRING), tmp_path / "bare", (), fmi=form.fmi)
        assert "no binary" in str(examine_fmu(bare).not_run)
        run([sys.executable, "-m", "fmpy", "compile", "--all-warnings", bare], cwd=tmp_path, env=ENVIRONMENT)
        assert (examine_fmu(bare).not_run, examine_fmu(bare).problems) == (None, ())


def test_sources_refuse_flags_with_which_a_nan_passes_for_a_number(tmp_path: Path) -> None:
    for model in (ModelFile("plain", SPRING), ModelFile("branched", BRANCHED["both"])):
        exported = write_c_sources(tmp_path, model, 0.0).parent
    laws = [path for path in sorted(exported.glob("*.c")) if not path.name.endswith("_example.c")]
    units = [*(PACKAGE / file for unit in (KERNEL, *OF_FMUS) for file in unit.files), *laws]
    cc = program("cc", package="gcc libc6-dev")
    commands = [([cc], flag, source) for flag in ("-ffast-math", "-ffinite-math-only") for source in units]
    for command, flag, source in (*commands, ([cc], "-Ofast", units[0]), (ziglang("cc"), "-ffast-math", units[0])):
        arguments = [*command, "-std=c11", flag, f"-I{HEADERS}", "-fsyntax-only", str(source)]
        done = subprocess.run(arguments, capture_output=True, text=True, check=False)
        assert done.returncode != 0, (flag, source)
        assert "Compile without -ffast-math" in done.stderr, (flag, source)


# The Python-backed FMU

ALONE = """
import sys
sys.path.insert(0, sys.argv[1])
name = open(sys.argv[1] + "/slavemodule.txt").read()
one = __import__(name).Spring(instance_name="one", resources=sys.argv[1])
one.set_real([0], [0.02])
one.exit_initialization_mode()
one.set_real([0], [0.03])
assert one.do_step(0.0, 1.0)
print(one.get_real([1])[0].hex())
package = name.removesuffix("_slave")
others = {m.split(".")[0] for m in sys.modules} - set(sys.stdlib_module_names) - {package, name, "__main__"}
assert not others, others
"""


def test_a_python_backed_fmu_imports_no_package() -> None:
    said = run([sys.executable, "-S", "-I", "-c", ALONE, FORMS["python"].library().folder / "resources"])
    assert float.fromhex(said) == pytest.approx(PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1], rel=1e-12)


def test_folders_that_its_binary_cannot_read_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without that the binary ends the process."""
    fmu = FORMS["python"].build(tmp_path)
    for name in ("Üben", "a#b", "50%25"):
        (tmp_path / name).mkdir()
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path / name))
        with pytest.raises(CosimulationError, match=f"cannot read the folder .*{name}.*; set TMPDIR to one named"):
            FmuSpring(fmu)
