"""Records from JSON, where every value has the type that its field declares."""

from __future__ import annotations

from dataclasses import is_dataclass
from functools import cache
from itertools import repeat
from types import UnionType
from typing import Any, TypeVar, cast, get_args, get_origin, get_type_hints

Thing = TypeVar("Thing")


def typed(kind: type[Thing], value: Any) -> Thing:
    """Return the record of type `kind` that plain data describe.

    Raises
    ------
    ValueError
        Where a field is missing or unknown, or a value is of another type.
    """
    return cast(Thing, _value(kind, value))


@cache
def _parts(kind: Any) -> tuple[Any, tuple[Any, ...], dict[str, Any]]:
    """Return the origin of a type with its arguments, and the fields of a record; a plain type is its own union."""
    if is_dataclass(kind):
        return None, (), get_type_hints(kind)
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (tuple, dict):
        return origin, inner, {}
    inner = inner if isinstance(kind, UnionType) else (kind,)
    # a whole number is written as one
    return None, (*inner, int) if float in inner else inner, {}


def _value(kind: Any, value: Any) -> Any:
    # types are compared, not tested by isinstance: for Python True is a number
    origin, inner, fields = _parts(kind)
    if fields:
        if type(value) is not dict or value.keys() != fields.keys():
            raise ValueError(f"{kind.__name__}: other fields than expected")
        return kind(**{name: _value(field, value[name]) for name, field in fields.items()})
    if origin is tuple:
        is_open = inner[-1] is ...
        if type(value) is not list or not (is_open or len(value) == len(inner)):
            raise ValueError(f"{value!r:.40}: no list of the length expected")
        return tuple(map(_value, repeat(inner[0]) if is_open else inner, value))
    if origin is dict:
        if type(value) is not dict:
            raise ValueError(f"{value!r:.40}: no mapping")
        return {key: _value(inner[1], item) for key, item in value.items()}
    if kind is not Any and type(value) not in inner:
        raise ValueError(f"{value!r:.40}: another type than expected")
    return value
