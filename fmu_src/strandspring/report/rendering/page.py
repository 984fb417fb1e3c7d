"""`write`: content as one page that opens offline, or as a document for print.

A page holds everything: text, styles, figures as SVG, and a script that lets them be read, zoomed and chosen from. Its
content security policy lets it load nothing else and run no other script.
"""

from __future__ import annotations

import base64
import hashlib
import json
from importlib import resources
from pathlib import Path
from typing import Any

from ...ground.files import write_text
from ..content.blocks import PageContent
from ..content.quantities import bound
from .palette import DARK, LIGHT
from .report_path import check_report_path


def write(path: str | Path, content: PageContent) -> None:
    """Write content as a page, or as a document if the name ends in .pdf.

    Raises
    ------
    StrandspringError       If the ending does not suit, the package `typst` is missing for a PDF, or the file cannot
                            be written.
    """
    path = Path(path)
    check_report_path(path)
    if path.suffix.lower() == ".pdf":
        from .document import write_document

        write_document(path, content)
    else:
        write_page(path, content)


def write_page(
    path: Path, content: PageContent, template: str = "base.html.j2", script: str = "", choice: Any = None
) -> None:
    """Write content as one HTML file.

    Parameters
    ----------
    path : Path
    content : PageContent
    template : str      In report/assets; one that extends base.html.j2.
    script : str        In report/assets; "" for none.
    choice : object     What that script reads as "choice" from the element "page-data", as JSON.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    from .panels import panels_of  # loads matplotlib

    environment = Environment(
        loader=PackageLoader("strandspring", "report/assets"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["bound"] = bound
    environment.filters["panels"] = panels_of
    scripts = [_asset("figures.js")] if content.figures else []
    scripts += [_asset(script)] if script else []
    data = {"noun": content.noun, "records": content.records, "first": content.first, "choice": choice}
    page = environment.get_template(template).render(
        content=content,
        light=LIGHT,
        dark=DARK,
        # Files of the package, JSON that cannot end its element, and hashes.
        style=Markup(_asset("page.css")),  # noqa: S704
        data=Markup(script_json(data)),  # noqa: S704
        scripts=[Markup(script) for script in scripts],  # noqa: S704
        script_hashes=Markup(" ".join(map(_hash, scripts)) or "'none'"),  # noqa: S704
    )
    write_text(path, page)


def script_json(value: Any) -> str:
    """JSON that may stand in a script element: nothing in it can end the element.

    Examples
    --------
    >>> script_json("</script>")
    '"\\\\u003c/script\\\\u003e"'
    """
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _asset(name: str) -> str:
    return resources.files("strandspring").joinpath("report/assets", name).read_text(encoding="utf-8")


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
