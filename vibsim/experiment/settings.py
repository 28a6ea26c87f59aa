"""Settings of the command line that override values of a file: ``model.g=1.62``, ``schemes[0].start=...``.

The value is YAML, as in a file. All other content keeps its lines, and faults name the setting that a value came from.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from vibsim.core.errors import Fault, InputError, nearest
from vibsim.core.set_option import set_in
from vibsim.experiment.faults import shorten
from vibsim.experiment.yaml.parse import Node, Path_, Source, dotted, parse

FORM = "must be KEY=VALUE, e.g. model.g=1.62 or schemes[0].kind=rk4"
_VALUE = "value"
_INDEX = re.compile(r"\[(\d{1,9})\]\.?")
_DOTTED_SECTIONS = (("sweep",), ("at",))  # sections whose keys are dotted keys of swept parameters


def with_settings(source: Source, settings: Sequence[str]) -> Source:
    """Return the content of a file with values replaced or added by all settings, in order.

    Raises `InputError` with every setting that is invalid, or whose key does not exist.
    """
    settings = [settings] if isinstance(settings, str) else settings
    faults: list[Fault] = []
    for text in settings:
        try:
            source = _with_setting(source, text)
        except InputError as error:
            faults.extend(error.faults)
    if faults:
        raise InputError(faults)
    return replace(source, settings=(*source.settings, *settings))


class _SettingError(Exception):
    """The rule that a setting breaks, and a hint."""


def _with_setting(source: Source, text: str) -> Source:
    key, is_given, value = text.partition("=")
    key = key.strip()
    file = set_in(source.file, shorten(text))
    if not is_given or not key:
        raise InputError([Fault(file, 0, "", "", FORM)])
    assert source.top is not None
    try:
        path = _path(source.top, key)
        node = replace(_node(value), setting=text)
    except _SettingError as error:
        raise InputError([Fault(file, 0, shorten(key), shorten(value), *error.args)]) from None
    top = _put(source.top, path, node, text)
    return replace(source, data=top.value, top=top)


def _node(value: str) -> Node:
    """Return the node of a value, parsed as YAML after a key."""
    try:
        source = parse(f"{_VALUE}: {value}".encode(), "")
        faults = source.faults
    except InputError as error:
        faults = error.faults
    if faults:
        raise _SettingError(faults[0].rule.partition(", first on line")[0], faults[0].hint)
    top = source.top
    if top is None or top.children is None or top.children.keys() != {_VALUE}:
        raise _SettingError("must be one value")
    return top.children[_VALUE]


def _path(top: Node, key: str) -> Path_:
    """Return the path of a dotted key in the content of a file, whose keys may themselves contain dots."""
    path: Path_ = ()
    node: Node | None = top
    tail = key
    while tail:
        if entry := _entry(node, path, tail):
            path, tail = (*path, entry[0]), entry[1]
        else:
            name = _name(node, path, tail)
            if not name:
                raise _SettingError(FORM)
            _check_name(node, path, name)
            path, tail = (*path, name), tail.removeprefix(name).removeprefix(".")
        node = (node.children or {}).get(path[-1]) if node else None
    return path


def _entry(node: Node | None, path: Path_, tail: str) -> tuple[int, str] | None:
    """Return the place of the entry of a list that `tail` begins with, by its number or its name, and what follows."""
    if index := _INDEX.match(tail):
        place = int(index[1])
        _check_index(node, path, place)
        return place, tail[index.end() :]
    entries = node.value if node is not None and isinstance(node.value, list) else ()
    for place, name in enumerate(_names(entries, path)):
        if name and (tail == name or tail.startswith(f"{name}.")):
            return place, tail[len(name) + 1 :]
    return None


def _names(entries: Sequence[object], path: Path_) -> list[str]:
    """Return the names of the entries of a list; messages count checks without a name."""
    is_check = path == ("checks",)
    return [
        _name_of(entry) or (f"check_{i}" if is_check else "") for i, entry in enumerate(entries, 1)
    ]


def _name_of(entry: object) -> str:
    """Return the name of an entry of a list: its id, label or kind, or the word itself; empty if it has none."""
    names = map(entry.get, ("id", "label", "kind")) if isinstance(entry, Mapping) else (entry,)
    return next((name for name in names if isinstance(name, str)), "")


def _name(node: Node | None, path: Path_, tail: str) -> str:
    """Return the next key of `tail`: the longest existing one, else up to the next dot (a swept key: to the end)."""
    keys = filter(None, (node.keys if node else None) or ())
    known = [key for key in keys if tail == key or tail.startswith((f"{key}.", f"{key}["))]
    end = r"[^\[]*" if path[-1:] in _DOTTED_SECTIONS else r"[^.\[]*"
    match = re.match(end, tail)
    return max(known, key=len) if known else match[0] if match else ""


def _check_index(node: Node | None, path: Path_, place: int) -> None:
    where = dotted(path)
    if node is None or not isinstance(node.value, list):
        raise _SettingError(f"{where or 'the file'} is not a list")
    count = len(node.value)
    if place >= count:
        there = f"choose from [0] to [{count - 1}]" if count else "it is empty"
        raise _SettingError(f"{where} has no entry [{place}]", there)


def _check_name(node: Node | None, path: Path_, name: str) -> None:
    where = dotted(path)
    if node is None or node.value is None or node.keys is not None or _is_scheme(path, node):
        return
    if isinstance(node.value, list):
        names = [*filter(None, _names(node.value, path))]
        by_number = f"name an entry by its number, e.g. {where}[0]"
        raise _SettingError(f"{where} is a list", nearest(name, names) if names else by_number)
    raise _SettingError(f"{where} is a value and has no keys")


def _is_scheme(path: Path_, node: Node) -> bool:
    """Tell whether an entry of `schemes` is a plain word, its kind."""
    return len(path) == 2 and path[0] == "schemes" and isinstance(node.value, str)


def _put(node: Node, path: Path_, new: Node, setting: str, above: Path_ = ()) -> Node:
    """Return a copy of a node with `new` at a path inside; a copy, because aliases may share the node."""
    if not path:
        return new
    if _is_scheme(above, node):
        kind = {"kind": node}
        node = replace(node, value={"kind": node.value}, text="", keys={"kind": node.line}, children=kind)  # fmt: skip
    first, rest = path[0], path[1:]
    inner = (node.children or {}).get(first)
    if inner is None:
        inner = Node(None, 0, setting=setting)
    inner = _put(inner, rest, new, setting, (*above, first))
    children: dict[Any, Node] = {**(node.children or {}), first: inner}
    if isinstance(first, int):
        value: Any = [inner.value if i == first else old for i, old in enumerate(node.value)]
        return replace(node, value=value, children=children)
    keys = {first: 0, **(node.keys or {})}
    return replace(
        node, value={**(node.value or {}), first: inner.value}, text="", keys=keys, children=children
    )  # fmt: skip
