"""The methods of identification by their names."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    from ...identification.method import Method

MethodName: TypeAlias = Literal["refined", "two-stage", "paper", "ni"]


@cache
def methods() -> dict[str, type[Method]]:
    """Those with a `MethodName`, which are slow to import."""
    from ...identification.refined import RefinedOptions
    from ...peers.ni import NiOptions
    from ...peers.paper import PaperOptions
    from ...peers.two_stage import TwoStageOptions

    return {method.name: method for method in (RefinedOptions, TwoStageOptions, PaperOptions, NiOptions)}


def chosen_method(name: MethodName | None, options: Method | None) -> Method:
    """The method of a name, or that of the options; the refined method if both are None.

    Raises
    ------
    ValueError   If there is no method of this name.
    TypeError    If both are given, or the options are of no method.
    """
    from ...identification.method import checked_method

    if name is None:
        return methods()["refined"]() if options is None else checked_method(options)
    if options is not None:
        raise TypeError("`method` and `options` exclude each other; `options` say the method, too.")
    if name not in methods():
        raise ValueError(f"`method` must be {', '.join(methods())}, got {name!r:.40}; for its options give `options`.")
    return methods()[name]()
