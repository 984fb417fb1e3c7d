"""Names of a package whose modules are loaded when they are first asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any


def load_lazily(content: dict[str, Any], names: Mapping[str, Sequence[str]]) -> None:
    """Give a package, by its globals, names by module, which is loaded when the first of its names is asked for."""
    package = content["__name__"]
    modules = {name: module for module, of_module in names.items() for name in of_module}

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        content[name] = getattr(import_module(f".{modules[name]}", package), name)
        return content[name]

    content |= {"__getattr__": load, "__dir__": lambda: sorted(modules), "__all__": sorted(modules)}
