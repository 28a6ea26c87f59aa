"""Read YAML into plain data that remembers its lines.

The tree is built from the parser's events with an explicit stack, so that no input can exhaust Python's: a small file
can be deep, and a few aliases can stand for billions of nodes.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from vibsim.core.errors import Fault, InputError
from vibsim.experiment.yaml.file_content import read_bytes
from vibsim.experiment.yaml.scalars import is_ambiguous, resolve

MAX_FAULTS = 1000
MAX_ALIASES = 50
MAX_NODES = 200_000
"""Nodes of a file when every alias is written out."""
MAX_DEPTH = 32

Path_ = tuple[str | int, ...]
"""Where a value stands: keys and list positions from the top."""

_NOT_PRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What YAML 1.2.2, section 5.1, does not allow in a file."""

_INVALID = "is not valid YAML"
_FOREIGN = "is no experiment: it has none of the keys {}"
_TAB = re.compile(" *\t")
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(slots=True)
class Node:
    """A node of the file, built event by event."""

    value: Any
    line: int
    text: str = ""
    size: int = 1
    """How many nodes it stands for when aliases are written out."""
    is_open: bool = False
    keys: dict[Any, int] | None = None
    """Line of every key of a mapping."""
    children: dict[Any, Node] | None = None
    key: str = ""
    """The present key of a mapping."""
    is_due: bool = False
    """Whether the value of the present key comes next."""


@dataclass(frozen=True)
class Place:
    """Where a value and its key stand."""

    line: int
    key_line: int
    text: str
    """The value as written, if it is a scalar."""


@dataclass(frozen=True)
class Source:
    """The content of an experiment file, as plain data."""

    file: str
    """Name of the file as the user gave it."""
    data: Any
    top: Node | None = None
    faults: tuple[Fault, ...] = ()
    """What is wrong with the file although it could be read: duplicate keys and tags."""

    def place(self, path: Path_) -> Place | None:
        """Return where the value at `path` stands, None where nothing stands there."""
        node = self.top
        key_line = 0
        for key in path:
            if node is None or node.children is None or key not in node.children:
                return None
            parent, node = node, node.children[key]
            key_line = parent.keys[key] if parent.keys is not None else node.line
        return Place(node.line, key_line, node.text) if node else None


def read(path: Path, keys: Collection[str] = ()) -> Source:
    """Read the file at `path`: see `parse`.

    Raises
    ------
    InputError
        Where there is no such file, or it is no YAML of the allowed kind.
    """
    return parse(read_bytes(path), str(path), keys)


def parse(content: bytes, file: str, keys: Collection[str] = ()) -> Source:
    """Build the data of one YAML document.

    Parameters
    ----------
    file
        Its name in messages.
    keys
        Keys of which a file has one at least: else it is no file for vibsim, and no message shows what is in it. None
        means that any file will do.

    Raises
    ------
    InputError
        At the first fault of syntax, with the duplicate keys and the tags before it.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise _refusal(file, line, "", "must be UTF-8 text") from None
    if foreign := _NOT_PRINTABLE.search(text):
        line = text.count("\n", 0, foreign.start()) + 1
        character = f"character U+{ord(foreign.group()):04X}"
        raise _refusal(file, line, "", "must be plain text", f"it holds {character}")
    builder = _Builder(file)
    try:
        for event in _events(text):
            builder.take(event)
        source = builder.source()
        if not keys or source.data.keys() & set(keys):
            return source
        builder.faults.clear()
        raise _refusal(file, 0, "", _FOREIGN.format(", ".join(keys)))
    except InputError as error:
        faults = error.faults
    except yaml.MarkedYAMLError as error:
        faults = (_syntax(error, text, file),)
    except (yaml.YAMLError, ValueError) as error:
        faults = (Fault(file, 0, "", "", _INVALID, str(error).partition("\n")[0]),)
    found = {*builder.faults, *faults}
    if keys and not builder.keys & set(keys):
        found = {replace(fault, key="", value="") for fault in faults}
    raise InputError(found)


def _syntax(error: yaml.MarkedYAMLError, text: str, file: str) -> Fault:
    mark: Any = error.problem_mark or error.context_mark
    if mark is None:
        return Fault(file, 0, "", "", _INVALID, str(error.problem or error.context or ""))
    found = text.splitlines()[mark.line : mark.line + 1]
    if found and _TAB.match(found[0]):
        rule = "tabs are not allowed for indentation"
        return Fault(file, mark.line + 1, "", "", f"{_INVALID}: {rule}", "use spaces")
    return Fault(file, mark.line + 1, "", "", _INVALID, str(error.problem or error.context or ""))


def _events(text: str) -> Iterator[Any]:
    loader = _Loader(text)
    try:
        while loader.check_event():
            yield loader.get_event()
    finally:
        loader.dispose()


def _line(event: Any) -> int:
    return int(event.start_mark.line) + 1


def _refusal(
    file: str, line: int, key: str, rule: str, hint: str = "", value: str = ""
) -> InputError:
    return InputError([Fault(file, line, key, value, rule, hint)])


class _Builder:
    """Takes the events of one document in turn."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.stack: list[Node] = []
        self.anchors: dict[str, Node] = {}
        self.top: Node | None = None
        self.documents = 0
        self.aliases = 0
        self.faults: list[Fault] = []

    @property
    def keys(self) -> set[str]:
        """Keys at the top of the document, as far as it was read."""
        return set(self.top.keys or ()) if self.top else set()

    def refuse(self, event: Any, rule: str, value: str = "", hint: str = "") -> InputError:
        return _refusal(self.file, _line(event), self.where(), rule, hint, value)

    def where(self) -> str:
        """Name the place of the next value."""
        parents = (n.key if n.keys is not None else len(n.value) - 1 for n in self.stack[:-1])
        return dotted((*parents, *map(position, self.stack[-1:])))

    def take(self, event: Any) -> None:
        match event:
            case yaml.DocumentStartEvent():
                self.documents += 1
                if self.documents > 1:
                    raise self.refuse(event, "must hold one YAML document only")
            case yaml.AliasEvent():
                self.add(event, self.alias(event))
            case yaml.ScalarEvent():
                self.check(event)
                self.check_number(event)
                value = event.value if event.style else resolve(event.value)
                self.add(event, Node(value, _line(event), event.value))
            case yaml.CollectionStartEvent():
                self.start(event)
            case yaml.CollectionEndEvent():
                node = self.stack.pop()
                node.is_open = False
                self.grow(event, node.size)

    def check(self, event: Any) -> None:
        if event.tag is not None:
            rule = "YAML tags are not allowed"
            self.note(Fault(self.file, _line(event), self.where(), event.tag[:60], rule))

    def check_number(self, event: Any) -> None:
        is_key = bool(self.stack) and self.stack[-1].keys is not None and not self.stack[-1].is_due
        if not event.style and not is_key and is_ambiguous(event.value):
            rule = "a number must not begin with 0, which some read as octal"
            hint = "leave the 0 out; octal numbers are written 0o10"
            raise self.refuse(event, rule, event.value[:60], hint)

    def note(self, fault: Fault) -> None:
        """Keep a fault that does not hinder reading on; its node counts as if it were sound."""
        self.faults.append(fault)
        if len(self.faults) >= MAX_FAULTS:
            raise _refusal(self.file, 0, "", "has more faults than are listed")

    def start(self, event: Any) -> None:
        self.check(event)
        if len(self.stack) >= MAX_DEPTH:
            raise self.refuse(event, f"must not nest deeper than {MAX_DEPTH} levels")
        node = Node([], _line(event), is_open=True, children={})
        if isinstance(event, yaml.MappingStartEvent):
            node.value, node.keys = {}, {}
        self.add(event, node)
        self.stack.append(node)

    def alias(self, event: Any) -> Node:
        self.aliases += 1
        if self.aliases > MAX_ALIASES:
            raise self.refuse(event, f"must not have more than {MAX_ALIASES} aliases")
        node = self.anchors.get(event.anchor)
        if node is None or node.is_open:
            rule = "an alias must name a finished anchor before it"
            raise self.refuse(event, rule, f"*{event.anchor}")
        return node

    def grow(self, event: Any, size: int) -> None:
        total = (self.stack[-1].size if self.stack else 0) + size
        if total > MAX_NODES:
            raise self.refuse(event, f"must not hold more than {MAX_NODES} values")
        if self.stack:
            self.stack[-1].size = total

    def add(self, event: Any, node: Node) -> None:
        if not isinstance(event, yaml.AliasEvent) and event.anchor is not None:
            self.anchors[event.anchor] = node
        if not node.is_open:
            self.grow(event, node.size)
        if not self.stack:
            self.top = node
            return
        parent = self.stack[-1]
        if parent.keys is not None and not parent.is_due:
            self.add_key(event, parent, node)
            return
        place = position(parent)
        # of two values of one key the first counts
        if parent.children is not None:
            parent.children.setdefault(place, node)
        if parent.keys is None:
            parent.value.append(node.value)
        else:
            parent.value.setdefault(place, node.value)
            parent.is_due = False

    def add_key(self, event: Any, parent: Node, node: Node) -> None:
        if not isinstance(event, yaml.ScalarEvent):
            raise self.refuse(event, "a key must be plain text")
        parent.key, parent.is_due = str(event.value), True
        keys = parent.keys if parent.keys is not None else {}
        if parent.key in keys:
            rule = f"duplicate key, first on line {keys[parent.key]}"
            self.note(Fault(self.file, node.line, self.where(), "", rule))
        else:
            keys[parent.key] = node.line

    def source(self) -> Source:
        if self.top is None or not isinstance(self.top.value, dict):
            line = self.top.line if self.top else 0
            raise _refusal(self.file, line, "", "must be a mapping of keys to values")
        return Source(self.file, self.top.value, self.top, tuple(self.faults))


def position(node: Node) -> str | int:
    """Return the key or the list position of the value that comes next in `node`."""
    if node.keys is None:
        return len(node.value)
    return node.key if node.is_due else ""


def dotted(path: Path_) -> str:
    """Write a path as in messages: ``checks[2].order``."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text and part else part
    return text
