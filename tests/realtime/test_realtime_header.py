"""The public header and what `export --c` writes: the example as it stands, in C and in C++, whatever the name."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from branched_springs import BRANCHED, oracle_force, uneven_motion
from fmu_tools import SPRING
from pages import blocks
from realtime_tools import FLAGS, cc, exported, steps
from springs import TABLE
from strandspring import Spring, export
from strandspring.core.parameters import N_RANGE
from strandspring.exchange import c_sources
from strandspring.model.modelfile import ModelFile
from tools import slow_but, ziglang

HEADER = (files("strandspring.exchange") / "assets" / "strandspring.h").read_text(encoding="utf-8")


def test_the_example_in_the_header_runs_as_it_stands_there(tmp_path: Path) -> None:
    law = exported(tmp_path, SPRING)
    block = re.findall(r"(?:^ \*(?:     .*)?\n)+", HEADER, re.MULTILINE)[0]
    text = "".join(f"{line[7:]}\n" for line in block.splitlines()[1:-1])
    example = law.parent / "mount_example.c"
    assert example.read_text() == text == blocks("real-time", "c")[0]
    assert len([line for line in text.splitlines() if line.startswith("    ")]) == 5
    for standard in ("-std=c11", "-std=gnu17", "-std=c2x"):
        program = cc(tmp_path / "example", standard, example, law, *steps(law))
        assert subprocess.run([program], check=False).returncode == 0


def test_the_example_in_cpp(tmp_path: Path) -> None:
    law = exported(tmp_path, SPRING)
    zig_cc, zig_cpp = ziglang("cc"), ziglang("c++")
    flags = ("-O1", *FLAGS)
    kernel = [cc(tmp_path / f"{path.stem}.o", *flags, "-c", path, compiler=zig_cc) for path in (law, *steps(law))]
    example = law.parent / "mount_example.c"
    main = cc(tmp_path / "main.o", "-O1", "-std=c++17", "-x", "c++", "-c", example, compiler=zig_cpp)
    # Linked as C: ziglang would compile the whole library of C++, of which the example uses nothing.
    program = cc(tmp_path / "cpp", "-O1", main, *kernel, compiler=zig_cc)
    assert subprocess.run([program], check=False).returncode == 0


@pytest.mark.parametrize(
    "name", ["int", "class", "spring", "SPRING", "strandspring", "memcpy", "linux", "main", "NULL", "a__b"]
)
def test_any_name_compiles_and_takes_the_place_of_no_other_file(name: str, tmp_path: Path) -> None:
    alone = {path.name.lower() for path in exported(tmp_path / "other", SPRING, "mount").parent.iterdir()}
    law = exported(tmp_path, SPRING, name)
    own = {f"{name}_law.c".lower(), f"{name}_law.h".lower(), f"{name}_example.c".lower()}
    kernel = {path for path in alone if not path.startswith("mount_")}
    assert not own & kernel
    assert {path.name.lower() for path in law.parent.iterdir()} == own | kernel
    cc(tmp_path / "none", "-std=gnu11", "-fsyntax-only", law.parent / f"{name}_example.c", law)


def test_same_model_same_bytes_and_springs_stand_beside_each_other(tmp_path: Path) -> None:
    first = exported(tmp_path, SPRING, "one")
    before = {path.name: path.read_bytes() for path in first.parent.iterdir()}
    exported(tmp_path, TABLE, "two")
    exported(tmp_path, SPRING, "one")
    after = {path.name: path.read_bytes() for path in first.parent.iterdir()}
    assert {name: content for name, content in after.items() if not name.startswith("two")} == before
    code = "import sys, fmu_tools as f, realtime_tools as r; r.exported(r.Path(sys.argv[1]), f.SPRING, 'one')"
    environment = {**os.environ, "PYTHONHASHSEED": "7", "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "again")], check=True, env=environment)
    again = tmp_path / "again" / first.parent.name
    assert {path.name: path.read_bytes() for path in again.iterdir()} == before


def test_a_table_of_other_sources_does_not_compile(tmp_path: Path) -> None:
    law = exported(tmp_path, SPRING)
    local = law.parent / "spring_local.h"
    local.write_text(re.sub(r"SPRING_KERNEL 0x\w{8}", "SPRING_KERNEL 0x0", local.read_text()))
    with pytest.raises(RuntimeError, match="export the spring again"):
        cc(tmp_path / "law.o", *FLAGS, "-c", law)


def test_a_description_does_not_reach_the_sources(tmp_path: Path) -> None:
    model = ModelFile("mount", SPRING, "*/ #error planted /* äöü")
    c_sources.write_c_sources(tmp_path, model, 0.0)
    texts = [path.read_text(encoding="ascii") for path in (tmp_path / c_sources.FOLDER).iterdir()]
    assert not any("planted" in text for text in texts)


def test_the_exported_spring_answers_as_the_package(tmp_path: Path) -> None:
    law = exported(tmp_path, SPRING)
    path = SPRING.displacement_offset + 0.01 * np.sin(np.linspace(0.0, 12.0, 200)) * np.linspace(0.1, 1.0, 200)
    values = ", ".join(float(x).hex() for x in path)
    host = tmp_path / "host.c"
    host.write_text(
        f'#include "mount_law.h"\n#include <stdio.h>\nstatic const double path[] = {{{values}}};\n'
        "int main(void)\n{\n    SpringMemory memory = spring_start(path[0], 0.0);\n"
        "    for (int i = 0; i < 200; i++) {\n        spring_commit(&mount_law, &memory, NULL, path[i]);\n"
        '        printf("%a %a %a %a\\n", memory.omega, spring_force(&mount_law, &memory), '
        "spring_stiffness(&mount_law, &memory), spring_absorbed_energy(&mount_law, &memory));\n    }\n}\n"
    )
    program = cc(tmp_path / "host", "-O2", *FLAGS, f"-I{law.parent}", host, law, *steps(law))
    said = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    found = np.array([[float.fromhex(word) for word in line.split()] for line in said.splitlines()]).T
    response = Spring(SPRING).response(path)
    np.testing.assert_allclose(found[1], response, rtol=0.0, atol=1e-12 * np.abs(response).max())


@pytest.mark.parametrize("name", slow_but(BRANCHED, ("both",)))
def test_second_mechanisms_and_branches_beside_a_plain_spring(name: str, tmp_path: Path) -> None:
    """Against an ODE solver and branches in closed form with 60 digits, and `Spring`; both springs in one program."""
    p = BRANCHED[name]
    plain = exported(tmp_path, SPRING, "plain")
    law = exported(tmp_path, p)
    kernel = [*steps(law), law.with_name("branches.c")]
    example = cc(tmp_path / "example", "-O2", *FLAGS, law.with_name("mount_example.c"), law, *kernel)
    assert subprocess.run([example], check=False).returncode == 0
    time, path = uneven_motion()
    host = tmp_path / "host.c"
    rows = ", ".join(
        f"{{{float(h).hex()}, {float(x).hex()}}}" for h, x in zip(np.diff(time, prepend=0.0), path, strict=True)
    )
    host.write_text(
        '#include "mount_law.h"\n#include "plain_law.h"\n#include <stdio.h>\n'
        f"static const double motion[][2] = {{{rows}}};\n"
        "int main(void)\n{\n    const SpringAdded *has = &mount_law_added;\n"
        "    SpringMemory first = spring_start(motion[0][1], 0.2);\n"
        "    SpringAddedMemory added = spring_added_start(motion[0][1], -0.4);\n"
        f"    for (int i = 0; i < {path.size}; i++) {{\n"
        "        SpringDecay decays[SPRING_MAXWELLS];\n"
        "        for (int j = 0; j < has->branches; j++)\n"
        "            decays[j] = spring_decay(motion[i][0] / has->time_constant[j]);\n"
        "        spring_added_commit(has, &mount_law_second, &added, 0, first.displacement, motion[i][1],\n"
        "            motion[i][0], decays);\n"
        "        spring_commit(&mount_law_first, &first, NULL, motion[i][1]);\n"
        '        printf("%a %a %a\\n", spring_force(&mount_law_first, &first)\n'
        "            + spring_added_force(has, &mount_law_second, &added),\n"
        "            spring_absorbed_energy(&mount_law_first, &first)\n"
        "            + spring_added_energy(has, &mount_law_second, &added), spring_added_stored(has, &added));\n"
        "    }\n    return plain_law.parameters.n > 0.0 ? 0 : 1;\n}\n"
    )
    program = cc(tmp_path / "host", "-O2", *FLAGS, f"-I{law.parent}", host, law, plain, *kernel)
    said = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    force, absorbed, stored = np.array([[float.fromhex(word) for word in line.split()] for line in said.splitlines()]).T
    # The ODE solver's tolerance is 3e-14 for each of 119 steps; branches alone err by rounding.
    assert force == pytest.approx(oracle_force(p, path, time, (0.2, -0.4)), abs=1e-10 * float(np.abs(force).max()))
    python = Spring(p)
    starts = (0.2, -0.4) if p.second else 0.2
    assert force == pytest.approx(python.response(path, starts, time=time), abs=1e-12 * float(np.abs(force).max()))
    work = python.absorbed_energy(path, starts, time=time)
    assert absorbed == pytest.approx(work, abs=1e-11 * float(np.abs(work).max()))  # rounding of sums
    assert stored == pytest.approx(python.stored_energy(path, time=time), rel=1e-10, abs=1e-15)


def test_a_spring_with_branches_has_no_law_that_leaves_them_out(tmp_path: Path) -> None:
    header = exported(tmp_path, BRANCHED["branches"]).with_suffix(".h").read_text()
    assert re.findall(r"\bextern const \w+ (\w+);", header) == [
        "mount_law_first",
        "mount_law_second",
        "mount_law_added",
    ]


def test_tables_can_be_made_on_a_target_with_a_mathematics_library(tmp_path: Path) -> None:
    law = exported(tmp_path, SPRING)
    local = law.parent / "spring_local.h"
    text = local.read_text()
    assert text.count("#define SPRING_STEPS_ONLY\n") == 1
    local.write_text(text.replace("#define SPRING_STEPS_ONLY\n", ""))
    host = tmp_path / "host.c"
    host.write_text(
        '#include "mount_law.h"\nstatic SpringTable table;\nstatic SpringLaw made;\nint main(void)\n{\n'
        "    spring_tabulate(&table, mount_law.parameters.n, mount_law.parameters.sigma, SPRING_WITH_ENERGIES);\n"
        "    spring_prepare(&made, &mount_law.parameters, &table);\n"
        "    SpringMemory a = spring_start(0.0, 0.0), b = a;\n"
        "    spring_commit(&mount_law, &a, NULL, 0.01);\n    spring_commit(&made, &b, NULL, 0.01);\n"
        "    double difference = spring_force(&made, &b) / spring_force(&mount_law, &a) - 1.0;\n"
        "    return difference < 1e-12 && difference > -1e-12 ? 0 : 1;\n}\n"
    )
    assert N_RANGE == (0.01, 100.0)  # as the header says
    inputs = (host, law, *steps(law), law.parent / "saturation_table.c", "-lm")
    program = cc(tmp_path / "host", "-O2", *FLAGS, f"-I{law.parent}", *inputs)
    assert subprocess.run([program], check=False).returncode == 0


def test_export_by_the_package(tmp_path: Path) -> None:
    written = export(Spring(SPRING, "mount"), tmp_path, c=True)
    assert [path.name for path in written] == ["mount_law.c"]
