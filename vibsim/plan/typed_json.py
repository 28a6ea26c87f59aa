"""Records from JSON, where every value has the type that its field declares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from types import UnionType
from typing import Any, TypeVar, cast, get_args, get_origin, get_type_hints

Thing = TypeVar("Thing")
Reader = Callable[[Any], Any]


def typed(kind: type[Thing], value: Any) -> Thing:
    """Return the record of type `kind` that plain data describe.

    Raises
    ------
    ValueError
        Where a field is missing or unknown, or a value is of another type.
    """
    read: Callable[[Any], Thing] = _reader(cast(Any, kind))
    return read(value)


@cache
def _reader(kind: Any) -> Reader:
    """Return what takes a value of `kind` from plain data, or raises ValueError."""
    if is_dataclass(kind):
        return _record(kind)
    if kind is Any:
        return lambda value: value
    origin, inner = get_origin(kind), get_args(kind)
    if origin is tuple:
        return _items(inner)
    if origin is dict:
        return _mapping(inner)
    allowed = set(inner) if isinstance(kind, UnionType) else {kind}
    # a whole number is written as one
    allowed |= {int} if float in allowed else set()
    return _plain(allowed)


def _plain(allowed: set[Any]) -> Reader:
    def read(value: Any) -> Any:
        # not isinstance: for Python True is a number
        if type(value) not in allowed:
            raise ValueError(f"{value!r:.40}: another type than expected")
        return value

    return read


def _items(inner: tuple[Any, ...]) -> Reader:
    def read(value: Any) -> tuple[Any, ...]:
        if type(value) is not list or (inner[-1] is not ... and len(value) != len(inner)):
            raise ValueError(f"{value!r:.40}: no list of the length expected")
        readers = [_reader(inner[0])] * len(value) if inner[-1] is ... else map(_reader, inner)
        return tuple(reader(item) for reader, item in zip(readers, value, strict=True))

    return read


def _mapping(inner: tuple[Any, ...]) -> Reader:
    def read(value: Any) -> dict[str, Any]:
        if type(value) is not dict:
            raise ValueError(f"{value!r:.40}: no mapping")
        return {key: _reader(inner[1])(item) for key, item in value.items()}

    return read


def _record(kind: Any) -> Reader:
    hints = get_type_hints(kind)
    readers = {field.name: _reader(hints[field.name]) for field in fields(kind)}

    def read(value: Any) -> Any:
        if type(value) is not dict or value.keys() != readers.keys():
            raise ValueError(f"{kind.__name__}: other fields than expected")
        return kind(**{name: reader(value[name]) for name, reader in readers.items()})

    return read
