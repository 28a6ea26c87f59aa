"""Which settings of two experiments differ, by the names that they have in an experiment file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from vibsim.cli.terminal import clean

_LONGEST = 48
"""Characters of a value that is shown; of a longer one it is only said that it changed."""
_NAMES = ("collection", "name", "vibsim_format")
"""What an experiment is called, which is no setting."""


class Change(NamedTuple):
    """A setting that differs; the text of a value that is not there is empty."""

    path: str
    old: str
    new: str

    def __str__(self) -> str:
        """Say it as in ``model.w: 2.0 -> 2.5``."""
        if not self.old or not self.new:
            return f"{self.path}: {'added' if self.new else 'removed'}"
        if max(len(self.old), len(self.new)) > _LONGEST:
            return f"{self.path}: changed"
        return f"{self.path}: {self.old} -> {self.new}"


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[Change]:
    """Compare two experiments in normal form (`vibsim.experiment.canonical`), or the same part of both."""
    return list(_compared("", _named(old), _named(new)))


def _named(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content with schemes, checks and axes by name, and parameters where a file has them.

    It may come from a results folder of somebody else: what has another form is left as it is.
    """
    found = {key: value for key, value in content.items() if key not in _NAMES}
    model = _mapping(found.get("model"))
    if "kind" in model:
        tables = {
            key: {name: row[name] for name in ("file", "numbers") if name in row}
            for key, row in _mapping(model.get("tables")).items()
            if isinstance(row, Mapping)
        }
        flat = {**_mapping(model.get("parameters")), **_mapping(model.get("formulas"))}
        structure = _mapping(model.get("structure"))
        own = {**structure, **_mapping(structure.get("arrays"))}
        found["model"] = {"kind": model["kind"]} | flat | tables | _without(own, "arrays")
    for key, name in (("schemes", "name"), ("checks", "id")):
        match found.get(key):
            case [*rows] if all(isinstance(row, Mapping) and name in row for row in rows):
                found[key] = {str(row[name]): _without(row, name) for row in rows}
    match found.get("sweep"):
        case [*axes]:
            found["sweep"] = _columns(axes)
    return found


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _without(row: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return a row without its name, with its options beside the rest."""
    rest = {key: value for key, value in row.items() if key not in (name, "options")}
    return rest | dict(_mapping(row.get("options")))


def _columns(axes: Sequence[Any]) -> dict[str, Any]:
    """Return the values of a sweep by key."""
    found: dict[str, Any] = {}
    for axis in axes:
        match axis:
            case {"keys": [*keys], "values": [*values]}:
                found |= {str(key): value for key, value in zip(keys, values, strict=False)}
    return found


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
    """Write a value as a file may have it; whole numbers in a row by the first and the last."""
    if value is None:
        return "none"
    if isinstance(value, str):
        return clean(value)
    if isinstance(value, Sequence) and value and all(isinstance(entry, int) for entry in value):
        is_row = len(value) > 1 and list(value) == list(range(value[0], value[0] + len(value)))
        return f"{value[0]} to {value[-1]}" if is_row else ", ".join(map(str, value))
    return clean(json.dumps(value, ensure_ascii=False).replace('"', ""))
