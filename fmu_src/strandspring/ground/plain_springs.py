"""Refusal of springs with a second mechanism or Maxwell branches, where what they do is not computed yet."""

from __future__ import annotations

from ..core.parameters import SpringParameters
from ..errors import StrandspringError


def require_plain(parameters: SpringParameters, where: str, instead: str = "") -> None:
    """Raise StrandspringError unless this is the paper's spring.

    Parameters
    ----------
    parameters : SpringParameters
    where : str      What cannot take others, as the subject of the sentence.
    instead : str    What to do instead, the end of the sentence.
    """
    if parameters.is_plain:
        return
    has = ["`second`, a second mechanism"] if parameters.second else []
    has += [f"`branches`, {len(parameters.branches)} of Maxwell's"] if parameters.branches else []
    raise StrandspringError(
        f"{where} cannot take a spring with {' and '.join(has)}; "
        f"{instead or 'compute its force by `Spring.response`, or identify a spring without them'}."
    )
