"""Options that are declared once, in a frozen dataclass, for the command line, Python, JSON and the documentation.

The dataclass has the type, the default and the range (in ``__post_init__``) of each option. Its docstring describes the
options under ``Attributes:``.
"""

from __future__ import annotations

import inspect
import re
from collections import ChainMap
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass, make_dataclass
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from scenes.files.errors import ParameterError, did_you_mean, require_flag, require_instance, require_word, shown

PLACE = re.compile(r"^        \*\*\w+:.*(\n            .*)*", re.MULTILINE)
"""The entry ``**options`` in the arguments of a docstring."""

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")


def described(options: type) -> dict[str, str]:
    """Return the description of each option by name, from the docstrings of the dataclass and its base classes."""
    from docstring_parser import parse

    found: dict[str, str] = {}
    for each in reversed(options.__mro__):
        if is_dataclass(each):
            found |= {
                param.arg_name: param.description or "" for param in parse(vars(each).get("__doc__") or "").params
            }
    return {each.name: found.get(each.name, "") for each in fields(options)}


def taken(given: Mapping[str, Any], *kinds: type) -> list[Any]:
    """Turn the keyword arguments of a function into instances of its dataclasses of options."""
    names = {kind: {each.name for each in fields(kind)} for kind in kinds}
    known = set().union(*names.values())
    for name in given:
        if name not in known:
            found = f"found {shown(name)}; {did_you_mean(name, known)}"
            raise ParameterError(name, f"expected the name of an option, {found}")
    return [kind(**{name: value for name, value in given.items() if name in names[kind]}) for kind in kinds]


def takes(*kinds: type) -> Callable[[F], F]:
    """Decorate a function with ``**options`` so that its signature and docstring list each option."""
    from tyro.conf import Suppress

    def show(function: F) -> F:
        signature = inspect.signature(function)
        own = [each for each in signature.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        named = {each.name for each in own}
        shown_options, lines = [], []
        for kind in kinds:
            descriptions = described(kind)
            hints, plain = get_type_hints(kind, include_extras=True), get_type_hints(kind)
            for each in fields(kind):
                if Suppress in get_args(hints[each.name]):  # hidden on the command line, too
                    continue
                if each.name not in named:  # the function may name an option itself, to accept it by position
                    kind_of, annotation = inspect.Parameter.KEYWORD_ONLY, plain[each.name]
                    shown_options.append(
                        inspect.Parameter(each.name, kind_of, default=default_of(each), annotation=annotation)
                    )
                meaning = descriptions[each.name].replace("\n", "\n" + " " * 12)
                lines.append(f"{' ' * 8}{each.name}: {meaning}")
        function.__signature__ = signature.replace(parameters=[*own, *shown_options])  # type: ignore[attr-defined]
        function.__doc__ = PLACE.sub(lambda _: "\n".join(lines), function.__doc__ or "")
        return function

    return show


def check_kinds(options: Any) -> None:
    """Check the switches, words and nested settings of a dataclass, for its ``__post_init__``.

    NumPy's numbers become Python's, which JSON can hold. The ranges of numbers are left to the dataclass.
    """
    for name, kind in _hints(options.__class__).items():
        value = getattr(options, name)
        if isinstance(value, np.generic):
            value = value.item()
            object.__setattr__(options, name, value)
        if kind is bool:
            require_flag(**{name: value})
        elif get_origin(kind) is Literal:
            require_word(get_args(kind), **{name: value})
        elif isinstance(kind, type) and is_dataclass(kind):
            require_instance(kind, **{name: value})


@cache
def _hints(options: type) -> dict[str, Any]:
    hints = get_type_hints(options)
    return {each.name: hints[each.name] for each in fields(options)}


@cache
def unchecked(options: type[T]) -> type[T]:
    """Return the dataclass without its checks, for the command line. The command makes them later, by ``checked``.

    If a check failed during parsing, the parser would print a message of its own. Options of nested dataclasses have no
    prefix.
    """
    from tyro.conf import OmitArgPrefixes

    nested = [
        (name, Annotated[unchecked(kind), OmitArgPrefixes], unchecked(kind)())
        for name, kind in _nested(options).items()
    ]
    return _without_checks(options, nested)


@cache
def optional(options: type) -> Any:
    """Return the dataclass without its checks and with None as the default of each option.

    This is for options whose real default depends on something else. Switches keep their defaults, so that the command
    line has --NAME and --no-NAME for them.
    """
    hints = get_type_hints(options, include_extras=True)
    changed = [(each.name, hints[each.name] | None, None) for each in fields(options) if hints[each.name] is not bool]
    return _without_checks(options, changed)


def _without_checks(options: type[T], changed: list[tuple[str, Any, Any]]) -> type[T]:
    # Without a docstring, so that the help shows that of the base class.
    namespace = {"__post_init__": lambda self: None, "__doc__": None, "__module__": options.__module__}
    return make_dataclass(options.__name__, changed, bases=(options,), namespace=namespace, frozen=True, kw_only=True)


def checked(options: type[T], values: Any) -> T:
    """Make an instance of the dataclass, with its checks, from one of the class that ``unchecked`` returned."""
    content = {each.name: getattr(values, each.name) for each in fields(options)}  # type: ignore[arg-type]
    return options(**content | {name: checked(kind, content[name]) for name, kind in _nested(options).items()})


def changed(values: Any) -> dict[str, Any]:
    """Return the options that differ from their defaults, by name, including those of nested dataclasses."""
    differing = {
        each.name: value for each in fields(values) if differs(value := getattr(values, each.name), default_of(each))
    }
    inner = [changed(value) for value in differing.values() if is_dataclass(value)]
    return {name: value for name, value in differing.items() if not is_dataclass(value)} | dict(ChainMap(*inner))


def differs(value: Any, default: Any) -> bool:
    """Whether the value of an option is not its default. No option is an array, so that an array always differs."""
    return isinstance(value, np.ndarray) or value != default


def _nested(options: type) -> dict[str, type]:
    """Return the options that are themselves dataclasses, by name."""
    hints = get_type_hints(options)
    return {each.name: hints[each.name] for each in fields(options) if is_dataclass(hints[each.name])}


def default_of(option: Field) -> Any:
    """Return the default of a dataclass's field, or ``inspect.Parameter.empty`` if it has none."""
    if option.default is not MISSING:
        return option.default
    return option.default_factory() if option.default_factory is not MISSING else inspect.Parameter.empty
