"""The methods of identification by their names."""

from __future__ import annotations

from typing import Literal, TypeAlias

from ...identification.methods.method import Method, checked_method
from ...identification.methods.refined import RefinedOptions
from ...identification.methods.scan_options import ScanOptions
from ...peers.ni_method import NiOptions
from ...peers.two_stage_options import TwoStageOptions

MethodName: TypeAlias = Literal["refined", "two-stage", "scan", "ni"]

METHODS: dict[str, type[Method]] = {
    method.name: method for method in (RefinedOptions, TwoStageOptions, ScanOptions, NiOptions)
}


def chosen_method(name: MethodName | None, options: Method | None) -> Method:
    """The method of a name, or that of the options; the refined method if both are None.

    Raises
    ------
    ValueError   If there is no method of this name.
    TypeError    If both are given, or the options are of no method.
    """
    if name is None:
        return RefinedOptions() if options is None else checked_method(options)
    if options is not None:
        raise TypeError("`method` and `options` exclude each other; `options` say the method, too.")
    if name not in METHODS:
        raise ValueError(f"`method` must be {', '.join(METHODS)}, got {name!r:.40}; for its options give `options`.")
    return METHODS[name]()
