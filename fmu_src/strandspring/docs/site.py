"""The documentation as a site of HTML pages with a search, which Sphinx makes of the Markdown pages in this folder.

The site is part of a release; elsewhere it is built where Sphinx is installed (the extra `docs`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from .._version import __version__
from ..errors import StrandspringError
from ..ground.files import existing_folder, readable, refuse_unwritable, refused_in_words, user_cache
from ..ground.scratch import TemporaryFolder

# In the order in which they are read.
PAGES = (
    "overview", "test-engineer", "simulation-engineer", "tools", "real-time", "designer", "systems", "system-file",
    "python", "limits", "troubleshooting", "security", "method", "figures",
)  # fmt: skip
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
    """The folder of the site: that of the release, or one built now for this version.

    Raises
    ------
    StrandspringError   If it has to be built and cannot be.
    """
    released = Path(str(files(__package__))) / "site"
    if (released / "index.html").is_file():
        return released
    folder = user_cache() / f"documentation-{__version__}"
    write_site(folder, reference)
    return folder


def write_site(folder: Path, reference: Reference) -> None:
    """Build the site in a folder, whose earlier pages it replaces; the same version gives the same bytes.

    Raises
    ------
    StrandspringError   If Sphinx is not installed, or the folder cannot be written or holds something else.
    """
    refuse_unwritable(folder, is_folder=True)
    with refused_in_words(folder), TemporaryFolder(beside=existing_folder(folder.absolute().parent)) as scratch:
        if folder.exists() and not _is_ours(folder) and any(folder.iterdir()):
            raise StrandspringError(f"{readable(folder)} holds other files; give a new folder.")
        source, built = scratch / "source", scratch / "built"
        source.mkdir()
        _write_sources(source, reference)
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
    contents = "\n".join((*PAGES[1:], "commands", "api"))
    pages["index"] = f"{pages.pop('overview')}\n```{{toctree}}\n:hidden:\n\n{contents}\n```\n"
    helps = (f"## {name}\n\n```text\n{text}\n```\n" for name, text in reference.commands.items())
    pages["commands"] = "\n".join(("# Commands\n", *helps))
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    (folder / "api.rst").write_text(_API + "".join(f"   {name}\n" for name in reference.names), encoding="utf-8")


def _build(source: Path, built: Path, state: Path) -> None:
    """Run Sphinx; what it warns of is an error."""
    try:
        from sphinx.application import Sphinx
        from sphinx.errors import SphinxError
    except ImportError:
        raise StrandspringError(
            'The site is built by Sphinx, which is not installed: pip install "strandspring[docs]".'
        ) from None
    try:
        Sphinx(source, None, built, state, "html", _SETTINGS, status=None, warningiserror=True).build()
    except SphinxError as problem:
        raise StrandspringError(f"The site cannot be built: {problem}") from None
