"""Options, declared once: fields of frozen dataclasses that say what they are.

By what a field says, the class checks itself (`check`) and has the Parameters of its docstring (`described`), functions
take the object or its fields as keywords (`takes`), and the command line has its options. Those of a class may stand
for fields of others, its `parts` by what they are, or for several of its own; its method `with_options` takes them.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import wraps
from textwrap import wrap
from typing import Any, Literal, TypeAlias, TypeVar

from ..errors import OptionError
from . import arguments

Kind: TypeAlias = Literal["number", "numbers", "limits", "whole", "flag", "choice", "text", "texts"]
Class = TypeVar("Class", bound=type[Any])
Result = TypeVar("Result")

_KEY = "option"  # of a field's metadata
_MOST_VALUES = 10_000  # of one LOW:HIGH:COUNT
_WIDTH = 112  # columns of a docstring


@dataclass(frozen=True)
class Option:
    """What a field is.

    Attributes
    ----------
    kind : Kind
    help : str                    What it is, without unit and default; it ends without a full stop.
    unit : str                    In SI.
    shown : str                   Unit for people, where it is another.
    factor : float                From that to SI.
    least, most : float or None   Bounds [unit].
    is_open : bool                Whether the least itself is out of bounds.
    may_be_infinite : bool
    choices : tuple of str
    otherwise : str               What is taken where there is no default.
    metavar : str                 What stands for the value in the help of commands.
    flag : str or None            Name on the command line, if not that of the field; none if empty.
    group : str                   In the help; that of the class if empty.
    rare : bool                   Whether it is shown by ``--help-all`` only.
    repeated : str or None        What the help says of giving one value again; None where the last one counts.
    parse : callable or None      Makes the value of a text; raises ValueError if it is none.
    checks : callable or None     Raises an error if a value is wrong.
    """

    kind: Kind
    help: str
    unit: str = ""
    shown: str = ""
    factor: float = 1.0
    least: float | None = None
    most: float | None = None
    is_open: bool = False
    may_be_infinite: bool = False
    choices: tuple[str, ...] = ()
    otherwise: str = ""
    metavar: str = ""
    flag: str | None = None
    group: str = ""
    rare: bool = False
    repeated: str | None = None
    parse: Callable[[str], Any] | None = None
    checks: Callable[[Any], object] | None = None

    def must_be(self, is_shown: bool = False) -> str:
        """The condition on a value, in words; in the unit for people."""
        name, factor = (self.shown or self.unit, self.factor) if is_shown else (self.unit, 1.0)
        unit = f" [{name}]" if name else ""
        low, high = (None if end is None else end / factor for end in (self.least, self.most))
        if self.choices:
            *others, last = map(repr, self.choices)
            return f"{', '.join(others)} or {last}"
        if self.kind == "whole":
            return f">= {self.least}" if high is None else f"a whole number from {self.least} to {self.most}"
        if low is not None and high is not None:
            return f"above {low:g} and at most {high:g}{unit}" if self.is_open else f"within [{low:g}, {high:g}]{unit}"
        finite = [] if self.may_be_infinite else ["finite"]
        bound = [] if low is None else [f"{'>' if self.is_open else '>='} {low:g}"]
        return f"{' and '.join(finite + bound)}{unit}"

    def checked(self, name: str, value: Any, error: type[Exception]) -> Any:
        """A value as a plain one of Python; raises TypeError if it is none of the kind, and `error` out of bounds."""
        if self.kind == "flag":
            return arguments.flag(name, value)
        if self.kind == "limits":
            value = arguments.limits(name, value, self.unit)
        if self.checks is not None:
            self.checks(value)
        if self.kind in ("text", "texts", "limits"):
            return value
        plain: Any = value
        values: tuple[Any, ...] = (value,)
        if self.kind == "numbers":
            plain = values = arguments.numbers(name, value, self.unit)
        elif self.kind != "choice":
            plain = arguments.whole(name, value) if self.kind == "whole" else arguments.number(name, value, self.unit)
            values = (plain,)
        if not values or not all(map(self.allows, values)):
            every = f"Every level of {name.replace('_', ' ')}" if self.kind == "numbers" else f"`{name}`"
            raise error(f"{every} must be {self.must_be()}, got {value!r}.")
        return plain

    def read(self, text: str) -> Any:
        """The value of a text as people write it: in their unit; a tuple where LOW:HIGH:COUNT may stand for several.

        Raises
        ------
        ValueError   If it is none.
        """
        if self.parse is not None:
            return self.parse(text)
        if self.kind == "number":
            return self._number(text)
        if self.kind == "numbers":
            low, *rest = text.split(":")
            if not rest:
                return (self._number(low),)
            if len(rest) != 2 or not rest[1].isdecimal() or not 2 <= int(rest[1]) <= _MOST_VALUES:
                form = f"LOW:HIGH:COUNT with COUNT from 2 to {_MOST_VALUES}"
                raise ValueError(f"{text!r} is neither a number nor {form}.")
            first, last, steps = self._number(low), self._number(rest[0]), int(rest[1]) - 1
            return (*(first + k * ((last - first) / steps) for k in range(steps)), last)
        if self.checks is not None:
            self.checks(text)
        return text

    def _number(self, text: str) -> float:
        try:
            number = self.factor * float(text)
        except ValueError:
            number = math.nan
        if not self.allows(number):
            raise ValueError(f"must be {self.must_be(True)}, got {text}.")
        return number

    def allows(self, value: Any) -> bool:
        """Whether a value of the kind is within the bounds, or one of the choices."""
        if self.choices:
            return value in self.choices
        is_above = self.least is None or (value > self.least if self.is_open else value >= self.least)
        return is_above and (self.most is None or value <= self.most) and (self.may_be_infinite or math.isfinite(value))


def option(default: Any, kind: Kind, text: str, **more: Any) -> Any:
    """A field with a default, and what it is; see `Option`."""
    return field(default=default, metadata={_KEY: Option(kind, text, **more)})


def options_of(kind: Any) -> dict[str, Option]:
    """What the fields of a class or an object are, by their names, but for those that are given in Python only."""
    return {each.name: each.metadata[_KEY] for each in fields(kind) if _KEY in each.metadata}


def described(kind: Class) -> Class:
    """Give a dataclass a docstring with its fields as Parameters, before what it raises; that is usual if not said."""
    summary, raises, rest = inspect.cleandoc(kind.__doc__ or "").partition("\n\nRaises\n")
    lines = [summary, "", "Parameters", "----------"]
    for each in fields(kind):
        lines.append(f"{each.name} : {each.type}")
        if said := each.metadata.get(_KEY):
            lines += wrap(_sentence(said), _WIDTH, initial_indent="    ", subsequent_indent="    ")
    if not raises and hasattr(kind, "__post_init__"):
        rest = "\n\nRaises\n------\nValueError   If a value is out of bounds.\nTypeError    If it is of another kind."
    kind.__doc__ = "\n".join(lines) + raises + rest
    return kind


def _sentence(said: Option) -> str:
    """What an option is, in a sentence for Python users."""
    unit = f" [{said.unit}]" if said.unit else ""
    return f"{said.help}{unit}{f'; {said.otherwise} if None' if said.otherwise else ''}."


def check(made: Any, error: type[Exception] = ValueError) -> None:
    """Check the fields of an object by what they are, and make their values plain ones of Python.

    Raises
    ------
    error       If a value is out of bounds.
    TypeError   If it is of another kind.
    """
    for each in fields(made):
        said: Option | None = each.metadata.get(_KEY)
        value = getattr(made, each.name)
        if said is not None and not (value is None and (each.default is None or said.otherwise)):
            object.__setattr__(made, each.name, said.checked(each.name, value, error))


def changed(made: Any, default: Any = None) -> dict[str, Any]:
    """The fields of an object that are not what they are by default, or in another object."""
    usual = type(made)() if default is None else default
    names = [each.name for each in fields(made)]
    return {name: value for name in names if (value := getattr(made, name)) != getattr(usual, name)}


def refuse_given(sentence: str, where: str, **options: Any) -> None:
    """Raise OptionError for the first of some options that is given, although it does not apply.

    Parameters
    ----------
    sentence : str   What applies instead, with the fields `option` and `where`.
    where : str      What is given.
    **options        Values by name; None, False and () are not given.
    """
    for name, value in options.items():
        if value is not None and value is not False and value != ():
            raise OptionError(sentence.replace("{option}", f"{{to[{name}]}}"), where=where)


def takes(**kinds: Any) -> Callable[[Callable[..., Result]], Callable[..., Result]]:
    """Give a function objects of options, which callers give as such or as keywords of their fields.

    Parameters
    ----------
    **kinds    Class of each argument, or an object with the defaults of this function. Arguments of the function that
               have the name of a field take precedence.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Mount:
    ...     '''A mount.'''
    ...
    ...     series: int = option(1, "whole", "Springs in series", least=1)
    >>> @takes(mount=Mount)
    ... def stiffness(spring, *, mount):
    ...     return spring / mount.series
    >>> stiffness(8.0, series=2), stiffness(8.0, mount=Mount(4)), stiffness(8.0)
    (4.0, 2.0, 8.0)
    """
    defaults = {name: kind() if isinstance(kind, type) else kind for name, kind in kinds.items()}

    def decorate(function: Callable[..., Result]) -> Callable[..., Result]:
        own = inspect.signature(function)
        owners = {
            parameter: name
            for name, default in defaults.items()
            for parameter in inspect.signature(type(default)).parameters
            if parameter not in own.parameters
        }

        @wraps(function)
        def call(*args: Any, **keywords: Any) -> Result:
            given: dict[str, dict[str, Any]] = {name: {} for name in defaults}
            for name in [name for name in keywords if name in owners]:
                given[owners[name]][name] = keywords.pop(name)
            for name, default in defaults.items():
                made, fields_given = keywords.get(name), given[name]
                if made is not None and fields_given:
                    raise TypeError(f"`{name}` and `{next(iter(fields_given))}` exclude each other; give one of them.")
                if made is not None and not isinstance(made, type(default)):
                    wanted = f"{type(default).__name__}(...)"
                    raise TypeError(f"`{name}` must be {wanted}, or its fields as keywords, got {made!r:.60}.")
                keywords[name] = made or (replace(default, **fields_given) if fields_given else default)
            return function(*args, **keywords)

        call.__signature__ = own.replace(parameters=_shown(own, defaults, owners))  # type: ignore[attr-defined]
        return call

    return decorate


def _shown(own: inspect.Signature, defaults: Mapping[str, Any], owners: Mapping[str, str]) -> list[inspect.Parameter]:
    """The parameters of a function that takes objects or keywords."""
    shown = [parameter for name, parameter in own.parameters.items() if name not in defaults]
    rest = [shown.pop()] if shown and shown[-1].kind is inspect.Parameter.VAR_KEYWORD else []
    for name, default in defaults.items():
        of_kind = inspect.signature(type(default)).parameters
        for parameter in (of_kind[each] for each in of_kind if owners.get(each) == name):
            value = getattr(default, parameter.name, parameter.default)
            shown.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, default=value))
        annotation = f"{type(default).__name__} | None"
        shown.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation))
    return [*shown, *rest]
