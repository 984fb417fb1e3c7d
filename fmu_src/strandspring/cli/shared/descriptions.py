"""Commands that take a model file or a SYSTEM.toml: which options belong to which."""

from __future__ import annotations

from collections.abc import Iterable

import click
from click.core import ParameterSource


def is_system(path: str) -> bool:
    """Whether a path is that of a description, by its ending."""
    return path.lower().endswith(".toml")


def refuse_mixed(
    context: click.Context,
    path: str,
    of_models: Iterable[str],
    of_systems: Iterable[str],
    needed: tuple[str, str | None],
    instead: str = "leave it out",
) -> None:
    """Refuse options that do not apply to what is given, and ask for one that it needs.

    Parameters
    ----------
    context : click.Context
    path : str
    of_models, of_systems : iterable of str   Names of the options of models only, and of descriptions only.
    needed : (str, str or None)               Names of the options that a model and a description cannot do without.
    instead : str                             What to do where a description says it itself.

    Raises
    ------
    click.UsageError                          With the option.
    """
    options = {option.name: option for option in context.command.params}
    for name in of_models if is_system(path) else of_systems:
        if context.get_parameter_source(name) is ParameterSource.DEFAULT:
            continue
        if is_system(path):
            raise click.UsageError(
                f"{options[name].opts[0]} does not apply to {path}, which describes masses, mounts and springs itself; "
                f"{instead}."
            )
        raise click.UsageError(f"{options[name].opts[0]} applies to a SYSTEM.toml only, got {path}; leave it out.")
    required = needed[is_system(path)]
    if required is not None and not context.params[required]:
        raise click.MissingParameter(ctx=context, param=options[required])


def refuse_given(names: set[str], needed: str, reason: str) -> None:
    """Refuse options of the command that were given although they say nothing about the source."""
    context = click.get_current_context()
    given = [
        parameter.opts[0]
        for parameter in context.command.params
        if parameter.name in names and context.get_parameter_source(parameter.name) is ParameterSource.COMMANDLINE
    ]
    if given:
        raise click.UsageError(f"{', '.join(given)} can only be given with {needed}, and {reason}; leave that out.")
