"""FMUs in other programs: C hosts without Python, threads, forks, other rounding, little stack, compilers, Windows.

What simulators make of FMUs is in tests/interop. The macOS binary cannot be run here; test_build.py looks into it.
"""

from __future__ import annotations

import ctypes
import os
import platform
import subprocess
import sys
import zipfile
from ctypes import c_double, c_int, c_size_t, c_void_p, cast
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import fmi3LogMessageCallback
from fmpy.util import create_cmake_project

from branched_springs import BRANCHED
from fmu_tools import OTHER, SPRING, check_fmu, run_python, wandering_path
from forms import FORMS, rows
from kernel_tools import HERE, build_folder, compiled
from native_tools import ERROR, FUNCTIONS, FUNCTIONS3, HEADERS, OK
from portable_host import compiled_host, environment, responses, unpacked, windows_host, wine
from strandspring import Spring
from strandspring.compiled.images import KERNEL, OF_FMUS
from strandspring.compiled.sources import PACKAGE
from strandspring.cosimulation.fmu_spring import CosimulationError, FmuSpring
from strandspring.errors import BuildError
from strandspring.exchange.c_sources import write_c_sources
from strandspring.exchange.ssp import ShakenMassValues, write_system
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms, host_folder
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile
from system_fmu3_tools import NativeSystem3, system_library3
from system_fmu_tools import BOX, NativeSystem, system_library
from system_fmu_tools import BRANCHED as BRANCHED_BOX
from tools import program, slow_but, ziglang

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc, or preloads a library")
OF_PROCESSOR = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() not in ("x86_64", "aarch64"), reason="knows these processors"
)
pytestmark = pytest.mark.long
NATIVE = FORMS["co-simulation"]


def run(command: list[str | Path], **options: Any) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False, **options)
    assert done.returncode == 0, f"{done.returncode}: {done.stdout[-500:]}{done.stderr[-2000:]}"
    return done.stdout


# In C


@cache
def calls(*flags: str) -> Path:
    output = build_folder() / f"native_calls{len(flags)}"
    return compiled(output, "-O1", *flags, f"-I{HEADERS}", HERE / "native_calls.c", "-ldl", "-lm", "-lpthread")


def test_memory_of_the_host_is_asked_for_and_given_back_and_messages_are_no_formats() -> None:
    of = NATIVE.library()
    said = run([calls(), of.path, of.guid, "memory"])
    assert "must both be given or both be NULL" in said
    assert said.count("There is not enough memory") == 1
    lines = [line.split("|") for line in run([calls(), of.path, of.guid, "messages"]).splitlines()]
    assert [line[:3] for line in lines] == [
        ["%s%n", "3", "logStatusError"], *[["50 %s%n", "3", "logStatusError"]] * 2, ["50 %s%n", "1", "logStatusWarning"]
    ]  # fmt: skip
    assert lines[0][3] == f"The GUID must be {of.guid}, got {{%s%n}}."
    assert lines[1][3].endswith("got 100 %s%n%d.")


def test_threads_share_nothing_that_changes() -> None:
    """Many instances in many threads, under the thread sanitizer, which sees what good luck hides."""
    sanitizer, of = ("-g", "-fsanitize=thread"), NATIVE.library()
    unit = of.folder / "sources" / "fmi2_all.c"
    binary = compiled(build_folder() / "sanitized.so", "-O1", "-shared", "-fPIC", *sanitizer, unit, "-lm")
    run([calls(*sanitizer), binary, of.guid, "threads"])


@pytest.mark.slow
def test_a_million_steps_give_the_force_of_the_model() -> None:
    """With trials, excursions, steps of any size, states taken back and states that go on in another instance."""
    path, of = wandering_path(SPRING, 1_000_000, seed=11), NATIVE.library()
    command = [str(calls()), str(of.path), of.guid, "path"]
    found = np.frombuffer(subprocess.run(command, input=path.tobytes(), capture_output=True, check=True).stdout)
    expected = PathSolver(SPRING).force(path)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@LINUX
@pytest.mark.parametrize(
    ("task", "count"),
    [*((task, 3) for task in ("together", "fork", "threads", "states")),
     *(pytest.param(*one, marks=pytest.mark.slow) for one in (("reload", 1000), ("lives", 10_000)))],
)  # fmt: skip
def test_fmus_of_one_process_do_not_meet_and_leave_nothing(task: str, count: int) -> None:
    host = compiled(
        build_folder() / f"many_fmus_{task}", "-O1", f"-I{HEADERS}", HERE / "many_fmus.c", "-ldl", "-lpthread"
    )
    springs = (SPRING,) if task == "lives" else (SPRING, OTHER)
    libraries = [NATIVE.library(spring) for spring in springs]
    given = [text for of in libraries for text in (str(of.path), of.guid, (of.folder / "resources").as_uri())]
    pages = [int(line) for line in run([host, task, str(count), *given]).split()]
    # What heaps may need to settle, after a tenth of the lives.
    assert task != "lives" or (len(pages) == 10 and pages[-1] - pages[0] < 256), pages


def test_springs_linked_into_one_program_have_functions_of_their_own() -> None:
    units = []
    for prefix, spring in (("one_", SPRING), ("other_", OTHER)):
        unit = NATIVE.library(spring).folder / "sources" / "fmi2_all.c"
        flags = ("-O1", "-fPIC", f"-DFMI2_FUNCTION_PREFIX={prefix}", "-c")
        units.append(compiled(build_folder() / f"{prefix}.o", *flags, unit))
        listed = run(["nm", "-g", "--defined-only", "-P", units[-1]])
        assert {line.split()[0] for line in listed.splitlines()} == {prefix + name for name in FUNCTIONS}
    compiled(build_folder() / "linked.so", "-shared", *units, "-lm")


def test_a_host_without_python_runs_it(tmp_path: Path) -> None:
    fmu, path = NATIVE.build(tmp_path), wandering_path(SPRING, 500, seed=4)
    host = compiled_host(tmp_path)
    libraries = [unpacked(fmu, str(host_folder()), tmp_path / name) for name in ("one", "two")]
    expected = Spring(SPRING).response(path)
    for force in responses(host, fmu, libraries, path)[:, :, 0].T:
        assert np.max(np.abs(force - expected)) <= 1e-12 * np.max(np.abs(expected))
    # The binary belongs to its description.
    refused = subprocess.run([*host, "{another}", "", str(libraries[0])], capture_output=True, text=True, check=False)
    assert (refused.returncode, "fmi2Instantiate failed" in refused.stderr) == (1, True)


@pytest.mark.slow
def test_wine_runs_the_windows_binary(tmp_path: Path) -> None:
    if (found := wine()) is None:
        pytest.skip("wine is not installed: the Windows binary was looked into (test_build.py) but not run")
    fmu = build_native_fmu(ModelFile("spring", SPRING), tmp_path, chosen_platforms("win64"), zero=0.0)
    host, settings = windows_host(tmp_path, found)
    path = wandering_path(SPRING, 500, seed=4)
    # Both copies want the same address, so one of them is moved.
    libraries = [unpacked(fmu, "win64", tmp_path / name) for name in ("one", "two")]
    expected = Spring(SPRING).response(path)
    for force in responses(host, fmu, libraries, path, env=settings)[:, :, 0].T:
        assert np.max(np.abs(force - expected)) <= 1e-12 * np.max(np.abs(expected))


HOSTS = """
import gc, sys
from fmpy.fmi2 import calloc, defaultCallbacks, fmi2CallbackAllocateMemoryTYPE, fmi2CallbackFreeMemoryTYPE, free
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions

def instance(name):
    # Functions of this instance only; what they are made of goes with it.
    allocate, release = fmi2CallbackAllocateMemoryTYPE(calloc), fmi2CallbackFreeMemoryTYPE(free)
    callbacks = fmi2CallbackFunctions(defaultCallbacks.logger, allocate, release)
    slave = FMU2Slave(guid=sys.argv[2], unzipDirectory=sys.argv[1], modelIdentifier="spring", instanceName=name)
    slave.instantiate(callbacks=callbacks)
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.setReal([0], [0.02])
    slave.exitInitializationMode()
    return slave

first, second = instance("first"), instance("second")
first.freeInstance()
del first
gc.collect()
second.freeInstance()
print("all freed")
"""


def test_a_shared_table_outlives_the_host_of_the_first_instance() -> None:
    assert run_python(HOSTS, NATIVE.library().folder, NATIVE.library().guid) == "all freed\n"


# Rounding

# By name as in fenv.h of the processor.
MODES = {
    "x86_64": {"downward": 0x400, "upward": 0x800, "towards zero": 0xC00},
    "aarch64": {"downward": 0x800000, "upward": 0x400000, "towards zero": 0xC00000},
}


@OF_PROCESSOR
@pytest.mark.parametrize("mode", slow_but(["downward", "upward", "towards zero"], ("upward",)))
def test_instances_are_accurate_whatever_the_host_rounds(mode: str, tmp_path: Path) -> None:
    """Of drawn springs, and of a system."""
    random, count = np.random.default_rng(52), 10
    springs = np.column_stack([
        310.0 * 10.0 ** random.uniform(-1.0, 1.0, count), 0.5 + 10.0 ** random.uniform(-2.0, 2.99, count),
        10.0 ** random.uniform(-2.0, 2.0, count), random.uniform(-1.0, 1.0, count),
    ])  # fmt: skip
    low, width = SPRING.displacement_min, SPRING.displacement_max - SPRING.displacement_min
    fmus = {"fmi2": NATIVE, "fmi3": FORMS["fmi3"], "fmi2 real time": FORMS["real time"]}
    given = {
        "springs": springs, "paths": low + width * random.uniform(-0.2, 1.2, (count, 60)),
        "python": str(FORMS["python"].build(tmp_path)), **{k: str(form.library().folder) for k, form in fmus.items()},
        "system2": str(system_library(BOX).folder), "system3": str(system_library3(BOX).folder),
    }  # fmt: skip
    found = []
    for number in (0, MODES[platform.machine()][mode]):
        np.savez(tmp_path / "given.npz", allow_pickle=False, mode=number, **given)  # type: ignore[arg-type]
        run([sys.executable, HERE / "rounded.py", tmp_path / "given.npz", tmp_path / "found.npz"])
        found.append(dict(np.load(tmp_path / "found.npz")))
    usual, other = found
    assert any(np.any(other[name] != usual[name]) for name in usual)  # so it was rounded otherwise
    for name, expected in usual.items():
        size = np.abs(expected).max(axis=-2, keepdims=True)
        error = np.abs(other[name] - expected) / np.where(size > 0.0, size, 1.0)
        # Roundings to one side add up over a table's pieces and the path's reversals.
        assert np.max(error) < 1e-10, name


# Stack

MOST_STACK = 32768  # of any call [B]: threads of hosts may have 128 kB, as by default with musl, or less


class Measured:
    """The functions of a library, of which each call's stack is measured; `taken` has the most bytes by name."""

    def __init__(self, functions: ctypes.CDLL, shim: ctypes.CDLL) -> None:
        self._functions, self._shim, self.taken = functions, shim, dict[str, int]()

    def __getattr__(self, name: str) -> Any:
        function = getattr(self._functions, name)

        def call(*arguments: Any) -> int:
            words = (c_size_t * 14)(*(_word(a) for a in arguments if not isinstance(a, c_double)))
            reals = (c_double * 3)(*(a.value for a in arguments if isinstance(a, c_double)))
            answer = c_size_t()
            given = map(ctypes.addressof, (words, reals, answer))
            used = self._shim.stack_of_call(cast(function, c_void_p), *given)
            self.taken[name] = max(used, self.taken.get(name, 0))
            return answer.value if "Instantiate" in name else c_int(answer.value).value

        return call


def _word(argument: Any) -> int:
    """What is passed in a register: a number, or an address of what ctypes holds."""
    if isinstance(argument, bytes):
        return cast(ctypes.c_char_p(argument), c_void_p).value or 0
    if hasattr(argument, "_obj"):  # by reference
        return ctypes.addressof(argument._obj)
    if isinstance(argument, ctypes.Array | ctypes.Structure):
        return ctypes.addressof(argument)
    if hasattr(argument, "argtypes"):  # a callback
        return cast(argument, c_void_p).value or 0
    return int(getattr(argument, "value", argument) or 0)


@pytest.fixture
def shim(monkeypatch: pytest.MonkeyPatch) -> ctypes.CDLL:
    """Measures calls, and hears messages in C, for no Python may run on the stack that is measured."""
    source = HERE / "stack_calls.c"
    made = ctypes.CDLL(str(compiled(build_folder() / "stack_calls.so", "-O1", "-shared", "-fPIC", source)))
    made.stack_of_call.argtypes = [c_void_p] * 4
    callbacks = fmi2CallbackFunctions(logger=cast(made.hear2, fmi2CallbackLoggerTYPE))
    monkeypatch.setattr("native_tools.callbacks_into", lambda *_: callbacks)
    for module in ("forms", "system_fmu3_tools"):
        monkeypatch.setattr(f"{module}.fmi3LogMessageCallback", lambda _: cast(made.hear3, fmi3LogMessageCallback))
    return made


@OF_PROCESSOR
@pytest.mark.parametrize("name", rows(lambda form: not form.python))
def test_no_call_takes_much_stack(name: str, shim: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> None:
    form = FORMS[name]
    library, low = form.library(), form.spring.displacement_min
    measured, usual = Measured(library.functions, shim), library.functions
    monkeypatch.setattr(library, "functions", measured)
    with form.begun(form.spring.displacement_offset) as one:
        for k, share in enumerate((0.2, 0.9, -0.5, 6.0, 0.4)):  # out of the range, too, which is a warning
            one.advance(low + share * (form.spring.displacement_max - low), 1e-3 * (k + 1))
            one.get(*form.outputs)
            if "real_time" not in form.options:
                assert one.directional(["force"], {"displacement": 1.0, "n": 1.0}) == OK
        assert one.tune(rho=70.0, n=0.7) == OK  # a new table
        one.get("force")
        assert one.restore(one.serialized()) == OK
        for rest in sorted({2: FUNCTIONS, 3: FUNCTIONS3}[form.fmi] - measured.taken.keys()):
            if "Instantiate" not in rest and "FreeInstance" not in rest and hasattr(usual, rest):
                getattr(measured, rest)(c_void_p(one.component))  # refused for want of arguments, or in this mode
        assert one.Reset() == OK
        one.enter_initialization()
        assert one.set(rho=-1.0) == OK
        assert one.ExitInitializationMode() == ERROR
        assert one.Terminate() == OK
    assert len(measured.taken) > 30
    assert max(measured.taken.values()) <= MOST_STACK, measured.taken


@OF_PROCESSOR
@pytest.mark.parametrize("fmi", [2, 3])
def test_no_call_of_a_system_takes_much_stack(fmi: int, shim: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> None:
    library = (system_library if fmi == 2 else system_library3)(BRANCHED_BOX)
    measured = Measured(library.functions, shim)
    monkeypatch.setattr(library, "functions", measured)
    with (NativeSystem if fmi == 2 else NativeSystem3)(library) as one:
        one.begin()
        for k in range(3):
            assert one.go(1e-3 * k, 1e-3) == OK
            one.outputs()
        assert one.restore(one.serialized()) == OK
    assert max(measured.taken.values()) <= MOST_STACK, measured.taken


# Compilers

UNITS = {"co-simulation": "fmi2_all.c", "fmi3": "fmi3_all.c"}


@pytest.mark.slow
@pytest.mark.parametrize("name", UNITS)
def test_sources_are_c99_and_a_project_of_fmpy(name: str, tmp_path: Path) -> None:
    """Whatever customary macros a tool defines, and for 32 bits; a project that FMPy makes gives the same forces."""
    form, of_system = FORMS[name], system_library if name == "co-simulation" else system_library3
    system = of_system(BOX).folder / "sources" / f"fmu/system/c/system_all{'3' * (form.fmi == 3)}.c"
    units = (form.library().folder / "sources" / UNITS[name], system)
    for target in ("x86_64-linux-gnu", "x86-linux-gnu"):
        for macros in (("MODEL_EXCHANGE",), ("CO_SIMULATION",), ("MODEL_EXCHANGE", "CO_SIMULATION")):
            flags = ["-target", target, "-std=c99", "-c", "-o", str(tmp_path / "unit.o"), *(f"-D{m}" for m in macros)]
            include = f"-I{Path(fmpy.__file__).parent / 'c-code'}"
            for unit in units:
                run([*ziglang("cc"), *flags, include, str(unit)])
    fmu, project = form.build(tmp_path), tmp_path / "project"
    create_cmake_project(str(fmu), str(project))
    (binary,) = project.glob("binaries/*/*")
    binary.unlink()
    run(["cmake", "-B", "build", "-S", "."], cwd=project)
    run(["cmake", "--build", "build"], cwd=project)
    with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(tmp_path / "rebuilt.fmu", "w") as other:
        for entry in archive.namelist():
            other.writestr(entry, binary.read_bytes() if entry.startswith("binaries/") else archive.read(entry))
    assert check_fmu(tmp_path / "rebuilt.fmu").force_difference == 0.0
    bare = build_native_fmu(ModelFile("spring", SPRING), tmp_path / "bare", (), fmi=form.fmi)
    assert "no binary" in str(check_fmu(bare).not_run)
    run([sys.executable, "-m", "fmpy", "compile", "--all-warnings", str(bare)], cwd=tmp_path, env=environment())
    assert (check_fmu(bare).not_run, check_fmu(bare).problems) == (None, ())


def test_sources_refuse_flags_with_which_a_nan_passes_for_a_number(tmp_path: Path) -> None:
    for model in (ModelFile("plain", SPRING), ModelFile("branched", BRANCHED["both"])):
        exported = write_c_sources(tmp_path, model, 0.0).parent
    laws = [path for path in sorted(exported.glob("*.c")) if not path.name.endswith("_example.c")]
    units = [*(PACKAGE / file for unit in (KERNEL, *OF_FMUS) for file in unit.files), *laws]
    cc = program("cc", package="gcc libc6-dev")
    commands = [([cc], flag, source) for flag in ("-ffast-math", "-Ofast", "-ffinite-math-only") for source in units]
    for command, flag, source in (*commands, (ziglang("cc"), "-ffast-math", units[0])):
        arguments = [*command, "-std=c11", flag, f"-I{HEADERS}", "-fsyntax-only", str(source)]
        done = subprocess.run(arguments, capture_output=True, text=True, check=False)
        assert done.returncode != 0, (flag, source)
        assert "Compile without -ffast-math" in done.stderr, (flag, source)


# The Python-backed FMU

LIFE = """
import gc, math, os, sys
from pathlib import Path
from fmu_tools import instance, status_of
fmu, folder = Path(sys.argv[1]), Path(sys.argv[2])
os.chdir("/")
before = list(sys.path)
with instance(fmu, folder) as one, instance(fmu, folder) as two:
    s = one.slave
    one.set("rho", -1.0)
    wrong = [(s.getReal, [999]), (s.setInteger, [0], [1]), (s.setReal, [1], [1.0]), (s.getString, [0]),
             (s.setFMUstate, s.deSerializeFMUstate(b"x")), (s.exitInitializationMode,)]
    for _ in range(20):
        for call in wrong:
            assert status_of(*call) == 4, call
        gc.collect()
    s.reset()
    one.initialize()
    two.initialize()
    for _ in range(20):
        assert [status_of(*call) for call in (*wrong, (one.set, "displacement", math.nan))] == [4] * 7
    print(one.step(0.03, "force")[0].hex(), two.step(0.03, "force")[0].hex())
for _ in range(5):
    with instance(fmu, folder) as again:
        again.initialize()
        again.step(0.03, "force")
    gc.collect()
assert sys.path == before
"""


def test_the_host_of_a_python_backed_fmu_survives_many_errors(tmp_path: Path) -> None:
    """Whatever its folder and locale; its path of modules stays as it was."""
    settings = {**os.environ, "LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0"}
    said = run_python(LIFE, FORMS["python"].build(tmp_path), tmp_path / "with space", environment=settings)
    expected = PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1]
    assert [float.fromhex(word) for word in said.split()[:2]] == pytest.approx([expected] * 2, rel=1e-12)


LIVES = """
import gc, sys
from pathlib import Path
from fmu_tools import instance
for k in range(int(sys.argv[3])):
    with instance(Path(sys.argv[1]), Path(sys.argv[2])) as one:
        one.initialize()
        one.step(0.03)
    if k % 100 == 0:
        gc.collect()
print(open("/proc/self/statm").read().split()[1])
"""


@LINUX
@pytest.mark.slow
def test_each_of_its_lives_leaves_as_little_as_is_said(tmp_path: Path) -> None:
    fmu = FORMS["python"].build(tmp_path)
    few, many = (int(run_python(LIVES, fmu, tmp_path, count)) for count in (100, 2100))
    assert 4096 * (many - few) / 2000 < 8e3  # bytes; 7 kB are said


ALONE = """
import sys
sys.path.insert(0, sys.argv[1])
name = open(sys.argv[1] + "/slavemodule.txt").read()
one = __import__(name).Spring(instance_name="one", resources=sys.argv[1])
one.set_real([0], [0.02])
one.exit_initialization_mode()
one.set_real([0], [0.03])
assert one.do_step(0.0, 1.0)
print(one.get_real([1])[0])
package = name.removesuffix("_slave")
others = {m.split(".")[0] for m in sys.modules} - set(sys.stdlib_module_names) - {package, name, "__main__"}
assert not others, others
"""


def test_it_imports_no_package_at_run_time() -> None:
    resources = FORMS["python"].library().folder / "resources"
    force = float(run([sys.executable, "-S", "-I", "-c", ALONE, str(resources)]))
    assert force == pytest.approx(PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1], rel=1e-12)


@pytest.mark.parametrize("name", ["Üben", "a#b", "50%25"])
def test_folders_that_its_binary_cannot_read_are_named(name: str, tmp_path: Path, monkeypatch: Any) -> None:
    """Without that the binary ends the process."""
    fmu = FORMS["python"].build(tmp_path)
    (tmp_path / name).mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / name))
    with pytest.raises(BuildError, match=f"cannot read the folder .*{name}.*; set TMPDIR to one named"):
        check_fmu(fmu)
    with pytest.raises(CosimulationError, match="set TMPDIR"):
        FmuSpring(fmu)


END = """
import atexit, sys
from pathlib import Path
from fmu_tools import instance
with instance(Path(sys.argv[1]), Path(sys.argv[2])) as one:
    one.slave.terminate()
if sys.argv[3] == "without":
    atexit._clear()
"""


@LINUX
@pytest.mark.parametrize(("care", "status"), [("with", 0), ("without", 86)])
@pytest.mark.parametrize("slave", ["spring", "plant"])
def test_the_end_of_the_process_frees_nothing_twice(slave: str, care: str, status: int, tmp_path: Path) -> None:
    preloaded = compiled(build_folder() / "freed_twice.so", "-O1", "-shared", "-fPIC", HERE / "freed_twice.c")
    fmu, values = FORMS["python"].build(tmp_path), ShakenMassValues(1.0, 0.0, 0.0, 1.0)
    with zipfile.ZipFile(write_system(tmp_path / "s.ssp", fmu, ModelFile("spring", SPRING), values)) as archive:
        file = archive.extract(f"resources/{slave}.fmu", tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", END, file, str(tmp_path / "unpacked"), care], cwd=HERE, capture_output=True, text=True,
        env={**os.environ, "LD_PRELOAD": str(preloaded)}, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == status, done.stderr
