"""Refusals that reach a user: each is one sentence that says where, what was found and what to do."""


class StrandspringError(ValueError):
    """Base of every refusal of data, models or options; its text is written for the user."""


class RecordError(StrandspringError):
    """A measured record cannot be used as it is."""


class ModelError(StrandspringError):
    """A model file or a set of parameters is not a possible spring."""


class BuildError(StrandspringError):
    """An FMU cannot be built, validated or run."""
