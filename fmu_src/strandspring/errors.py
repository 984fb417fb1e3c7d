"""Errors that reach the user; each message is one sentence with the place, the value and the remedy."""


class StrandspringError(ValueError):
    """Base class of errors in data, models and options; the message is written for the user."""


class RecordError(StrandspringError):
    """A measured record cannot be used."""


class ModelError(StrandspringError):
    """A model file or a set of parameters is not a physically possible spring."""


class BuildError(StrandspringError):
    """An FMU cannot be built, validated or run."""


class MountedSystemError(StrandspringError):
    """Bodies on mounts that cannot be, or cannot be simulated as asked."""
