"""Compare the settings of two experiments, under the names that they have in an experiment file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from vibsim.cli.terminal import clean

_LONGEST = 48  # most characters of a value that is shown; of a longer one only the change
_NAMES = ("collection", "name", "vibsim_format")  # identify an experiment, and are no settings


class Change(NamedTuple):
    """A setting that differs; a missing value is an empty text."""

    path: str
    old: str
    new: str

    def __str__(self) -> str:
        """Return a text such as ``model.w: 2.0 -> 2.5``."""
        if not self.old or not self.new:
            return f"{self.path}: {'added' if self.new else 'removed'}"
        if max(len(self.old), len(self.new)) > _LONGEST:
            return f"{self.path}: changed"
        return f"{self.path}: {self.old} -> {self.new}"


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[Change]:
    """Return the differences between two experiments, or parts, in normal form (`vibsim.experiment.canonical`)."""
    return list(_compared("", _named(old), _named(new)))


def _named(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content with schemes, checks and axes by name, and parameters where a file has them.

    It may come from somebody else's results folder: data of an unexpected form are left as they are.
    """
    named = {key: value for key, value in content.items() if key not in _NAMES}
    model = _mapping(named.get("model"))
    if "kind" in model:
        tables = {
            key: {name: row[name] for name in ("file", "numbers") if name in row}
            for key, row in _mapping(model.get("tables")).items()
            if isinstance(row, Mapping)
        }
        flat = {**_mapping(model.get("parameters")), **_mapping(model.get("formulas"))}
        structure = _mapping(model.get("structure"))
        arrays = _without({**structure, **_mapping(structure.get("arrays"))}, "arrays")
        named["model"] = {"kind": model["kind"]} | flat | tables | arrays
    for key, name in (("schemes", "name"), ("checks", "id")):
        match named.get(key):
            case [*rows] if all(isinstance(row, Mapping) and name in row for row in rows):
                named[key] = {str(row[name]): _without(row, name) for row in rows}
    match named.get("sweep"):
        case [*axes] | {"axes": [*axes]}:
            named["sweep"] = _columns(axes)
    if "sizes" in named:
        levels = {"levels": numbers} if (numbers := named.pop("numbers", None)) else {}
        named["refine"] = levels | dict(_mapping(named.pop("sizes")))
    return named


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _without(row: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return a row without the key `name`, and with its options merged into it."""
    remaining = {key: value for key, value in row.items() if key not in (name, "options")}
    return remaining | dict(_mapping(row.get("options")))


def _columns(axes: Sequence[Any]) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    for axis in axes:
        match axis:
            case {"keys": [*keys], "values": [*values]}:
                columns |= {str(key): value for key, value in zip(keys, values, strict=False)}
    return columns


def _compared(path: str, old: Any, new: Any) -> Iterator[Change]:
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        # of another kind nothing is the same
        kinds = ("kind",) if "kind" in old and old["kind"] != new.get("kind") else (*old, *new)
        for key in dict.fromkeys(kinds):
            inner = f"{path}.{key}" if path else str(key)
            if key in old and key in new:
                yield from _compared(inner, old[key], new[key])
            else:
                yield Change(inner, shown(old[key]) if key in old else "", shown(new.get(key, "")))
    elif old != new:
        yield Change(path, shown(old), shown(new))


def shown(value: Any) -> str:
    """Return a value as text, as in an experiment file; consecutive whole numbers as ``first to last``."""
    if value is None:
        return "none"
    if isinstance(value, str):
        return clean(value)
    if isinstance(value, Sequence) and value and all(isinstance(entry, int) for entry in value):
        is_row = len(value) > 1 and list(value) == list(range(value[0], value[0] + len(value)))
        return f"{value[0]} to {value[-1]}" if is_row else ", ".join(map(str, value))
    return clean(json.dumps(value, ensure_ascii=False).replace('"', ""))
