"""Write fmu_src/THIRD_PARTY.md: the licences of all dependencies, from the metadata of what is installed.

usage: python .ci/licences.py, after .ci/constraints.py, where strandspring[dev] is installed by constraints.txt
"""

import re
from collections.abc import Iterable, Mapping
from importlib import metadata
from pathlib import Path

import tomllib
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]

# Where metadata say nothing, or not enough, or where a distribution is for other systems or versions of Python; read
# from the licence that the distribution carries.
KNOWN = {
    "appnope": "BSD-2-Clause",
    "canmatrix": "BSD-2-Clause",
    "cffi": "MIT-0",
    "clang-tidy": "Apache-2.0 WITH LLVM-exception",
    "decorator": "BSD-2-Clause",
    "exceptiongroup": "MIT",
    "fmpy": "BSD-2-Clause",
    "matplotlib": "matplotlib (PSF-2.0 style)",
    "numba": "BSD-2-Clause",
    "odfpy": "Apache-2.0 OR GPL-2.0-or-later OR LGPL-2.1-or-later",
    "pycparser": "BSD-3-Clause",
    "pytz": "MIT",
    "six": "MIT",
    "tomli": "MIT",
    "types-pytz": "Apache-2.0",
}
# Extras that only tests and checks of the sources need.
OF_TESTS = {"browser", "checkers", "dev", "notebooks", "simulators", "test"}
# Names that metadata of old form use for licences of the SPDX list.
SPDX = {
    "Apache 2.0": "Apache-2.0",
    "Apache License 2.0": "Apache-2.0",
    "Apache License, Version 2.0": "Apache-2.0",
    "Apache Software License": "Apache-2.0",
    "BSD": "BSD-3-Clause",
    "BSD License": "BSD-3-Clause",
    "BSD 3-Clause License": "BSD-3-Clause",
    "GNU Lesser General Public License v3 or later (LGPLv3+)": "LGPL-3.0-or-later",
    "LGPLv3+": "LGPL-3.0-or-later",
    "MIT License": "MIT",
    "BSD 2-Clause License": "BSD-2-Clause",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
}
COPYLEFT = re.compile("GPL|MPL|EPL")

# Why pyproject.toml, or a file for the tests, allows no later version.
PINNED = {
    "pythonfmu": "its interface of slaves is below 1.0, and the Python-backed FMU carries parts of it",
    "ziglang": "a newer compiler warns of more, and sources that it warns of do not compile; binaries differ, too",
    "rumoca": "below 1.0 every minor version changes what of Modelica it reads (tests only)",
}
COFMUPY = (
    "| `cofmupy`, exact, in `tests/interop/cofmupy.txt` | asks for older versions of what others need: it is installed "
    "without its requirements, for one test |"
)


def constrained() -> dict[str, set[str]]:
    """Names in constraints.txt, and the distributions that need each."""
    needed: dict[str, set[str]] = {}
    for line in (ROOT / ".ci" / "constraints.txt").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            pin, _, via = line.partition("# via")
            needed.setdefault(pin.partition("==")[0], set()).update(re.findall(r"[\w.-]+", via))
    return needed


def project() -> dict[str, list[str]]:
    """Requirements of strandspring, and of each extra."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return {"": declared["dependencies"], **declared["optional-dependencies"]}


def closure(requirements: Iterable[str], needed: Mapping[str, set[str]]) -> set[str]:
    """Names of what requirements need, all the way down, on any system."""
    found = {canonicalize_name(Requirement(text).name) for text in requirements}
    while more := {name for name, needing in needed.items() if name not in found and needing & found}:
        found |= more
    return found


def licence(name: str) -> str:
    """In the words of SPDX, where there are such.

    Raises
    ------
    SystemExit   If neither metadata nor this file know it.
    """
    if name in KNOWN:
        return KNOWN[name]
    try:
        given = metadata.metadata(name)
    except metadata.PackageNotFoundError:
        raise SystemExit(f"{name} is not installed, and its licence is not in KNOWN.") from None
    classifiers = [
        text.rpartition(" :: ")[2] for text in given.get_all("Classifier") or [] if text.startswith("License")
    ]
    for text in (given["License-Expression"], given["License"], *classifiers):
        if text and "\n" not in text and text not in ("OSI Approved", "UNKNOWN"):
            return SPDX.get(text, text)
    raise SystemExit(f"{name} does not declare its licence; add it to KNOWN.")


def page() -> str:
    """The content of THIRD_PARTY.md."""
    needed = constrained()
    uses: dict[str, list[str]] = {name: [] for name in sorted(needed)}
    for extra, requirements in project().items():
        if extra not in OF_TESTS:
            for name in closure(requirements, needed):
                uses[name].append(extra or "always")
    rows = {name: (licence(name), ", ".join(found) or "test") for name, found in uses.items()}
    copyleft = [f"- {name} ({text}), {use}" for name, (text, use) in rows.items() if COPYLEFT.search(text)]
    upper = [Requirement(text) for requirements in project().values() for text in requirements]
    limits = sorted({(one.name, str(one.specifier)) for one in upper if "<" in str(one.specifier)})
    pinned = [f"| `{name}{specifier}` | {PINNED[name]} |" for name, specifier in limits]
    table = ["| distribution | licence | needed by |", "| --- | --- | --- |"]
    table += [f"| {name} | {text} | {use} |" for name, (text, use) in rows.items()]
    template = (ROOT / ".ci/third_party.txt").read_text(encoding="utf-8")
    text = template.format(copyleft="\n".join(copyleft), pinned="\n".join([*pinned, COFMUPY]))
    return text + "\n".join(table) + "\n"


if __name__ == "__main__":
    (ROOT / "fmu_src" / "THIRD_PARTY.md").write_text(page(), encoding="utf-8")
