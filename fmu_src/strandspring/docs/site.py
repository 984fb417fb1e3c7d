"""The documentation as a site of HTML pages with a search, which Sphinx makes of the Markdown pages in this folder.

The site is part of a release; elsewhere it is built where Sphinx is installed (the extra `docs`).
"""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from .._version import __version__
from ..errors import StrandspringError
from ..ground.children import run
from ..ground.files import existing_folder, readable, refuse_unwritable, refused_in_words, user_cache
from ..ground.scratch import TemporaryFolder

# Pages by their reader, in the order in which they are read.
CHAPTERS = {
    "Start": ("overview", "tutorial", "gallery", "limits"),
    "Test engineer": ("test-engineer", "rig-files", "findings", "planning"),
    "Simulation engineer": (
        "simulation-engineer", "fmu-kinds", "tools", "tool-tests", "coupling", "export", "real-time",
    ),
    "Designer": ("designer", "clusters"),
    "Isolator engineer": ("systems", "catalogue", "system-studies", "system-file", "load-cases"),
    "Analyst and developer": ("python",),
    "Method": ("method", "identification", "figures", "figures-methods", "figures-speed", "figures-systems"),
    "Help": ("troubleshooting", "security", "glossary"),
}  # fmt: skip
PAGES = tuple(page for pages in CHAPTERS.values() for page in pages)
# Pages that are made of commands and docstrings, after those of their chapter.
_MADE = {"Analyst and developer": ("api",), "Help": ("commands",)}
_EXTENSIONS = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
_PROJECT = "strandspring"
_SETTINGS = {
    "project": _PROJECT,
    "version": __version__,
    "release": __version__,
    "html_title": f"strandspring {__version__}",
    "html_theme": "furo",
    "html_copy_source": False,
    "html_show_sphinx": False,
    "copyright": "strandspring maintainers, MIT licence",
    "extensions": _EXTENSIONS,
    "myst_enable_extensions": ["deflist"],
    "myst_heading_anchors": 3,
    "autodoc_typehints": "none",
    "napoleon_use_rtype": False,
    "suppress_warnings": ["ref.python"],  # types are words, not names
}
_API = """\
Python reference
================

.. currentmodule:: strandspring
.. autosummary::
   :toctree: reference

"""


@dataclass(frozen=True)
class Reference:
    """What the reference pages are made of.

    Attributes
    ----------
    commands : mapping      The help of each command.
    names : sequence of str   Public names of the package, whose docstrings are shown.
    """

    commands: Mapping[str, str]
    names: Sequence[str]


def page_text(name: str) -> str:
    """The Markdown of a page.

    Raises
    ------
    StrandspringError   If there is no such page.

    Examples
    --------
    >>> page_text("limits").splitlines()[0]
    '# When not to use it'
    """
    if name not in PAGES:
        raise StrandspringError(f"There is no page {name!r}; give one of {', '.join(PAGES)}.")
    return (files(__package__) / "pages" / f"{name}.md").read_text(encoding="utf-8")


def site(reference: Reference) -> Path:
    """The folder of the site: that of the release, or one built since the package was last changed.

    Raises
    ------
    StrandspringError   If it has to be built and cannot be.
    """
    released = Path(str(files(__package__))) / "site"
    if (released / "index.html").is_file():
        return released
    folder = user_cache() / f"documentation-{__version__}"
    changed = max(path.stat().st_mtime for path in Path(str(files(__package__))).parent.rglob("*.[pm][yd]"))
    if not (_is_ours(folder) and (folder / "objects.inv").stat().st_mtime > changed):
        write_site(folder, reference)
    return folder


def write_site(folder: Path, reference: Reference) -> None:
    """Build the site in a folder, whose earlier pages it replaces; the same version gives the same bytes.

    Raises
    ------
    StrandspringError   If Sphinx is not installed, or the folder cannot be written or holds something else.
    """
    refuse_unwritable(folder, is_folder=True)
    if find_spec("sphinx") is None:
        raise StrandspringError(
            'The site is built by Sphinx, which is not installed; install it with pip install "strandspring[docs]".'
        )
    with refused_in_words(folder), TemporaryFolder(beside=existing_folder(folder.absolute().parent)) as scratch:
        if folder.exists() and not _is_ours(folder) and any(folder.iterdir()):
            raise StrandspringError(f"{readable(folder)} holds other files; give a new folder.")
        source, built = scratch / "source", scratch / "built"
        source.mkdir()
        _write_sources(source, reference)
        _draw_gallery(source)
        _build(source, built, scratch / "state")
        folder.parent.mkdir(parents=True, exist_ok=True)
        if folder.exists():
            folder.rename(scratch / "before")
        built.rename(folder)


def _is_ours(folder: Path) -> bool:
    """Whether a folder holds this site, by the inventory of Sphinx, which names the project."""
    inventory = folder / "objects.inv"
    return inventory.is_file() and f"# Project: {_PROJECT}".encode() in inventory.read_bytes().splitlines()[:4]


def _write_sources(folder: Path, reference: Reference) -> None:
    """The pages, and those that Sphinx makes of the commands and of the public names."""
    pages = {name: page_text(name) for name in PAGES}
    chapters = {name: [*listed, *_MADE.get(name, ())] for name, listed in CHAPTERS.items()}
    chapters["Start"].remove("overview")
    contents = (_contents(listed, f":hidden:\n:caption: {name}\n") for name, listed in chapters.items())
    pages["index"] = "\n".join((pages.pop("overview"), *contents))
    helps = {f"command-{name.replace(' ', '-')}": (name, text) for name, text in reference.commands.items()}
    pages["commands"] = f"# Commands\n\n{_contents(helps)}"
    pages |= {page: f"# {name}\n\n```text\n{text}\n```\n" for page, (name, text) in helps.items()}
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    (folder / "api.rst").write_text(_API + "".join(f"   {name}\n" for name in reference.names), encoding="utf-8")


def _contents(pages: Iterable[str], options: str = "") -> str:
    """A table of contents."""
    return f"```{{toctree}}\n{options}\n{chr(10).join(pages)}\n```\n"


def _draw_gallery(folder: Path) -> None:
    """Run the commands of the gallery, which draw its pictures, in a folder.

    Raises
    ------
    StrandspringError   If one of them fails.
    """
    for block in re.findall(r"```sh\n(.*?)```", page_text("gallery"), flags=re.DOTALL):
        for line in block.replace("\\\n", "").splitlines():
            words = shlex.split(line.removeprefix("python -m "))
            done = run([sys.executable, "-m", *words], folder, os.environ)
            if done.returncode:
                raise StrandspringError(f"{line!r} of the gallery failed: {done.stderr.strip()}")


def _build(source: Path, built: Path, state: Path) -> None:
    """Run Sphinx; what it warns of is an error."""
    from sphinx.application import Sphinx
    from sphinx.errors import SphinxError

    try:
        Sphinx(source, None, built, state, "html", _SETTINGS, status=None, warningiserror=True).build()
        (built / ".buildinfo").unlink()  # by which Sphinx would build part of it again
    except SphinxError as problem:
        raise StrandspringError(f"The site cannot be built: {problem}") from None
