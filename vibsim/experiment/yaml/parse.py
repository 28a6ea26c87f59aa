"""Read YAML as plain data with line numbers.

The tree is built from the events of the parser. Its depth and size are bounded meanwhile, because a small file can be
deep, and a few aliases can expand to billions of nodes.

Plain scalars follow the core schema of YAML 1.2: `1e-3`, `1.`, `.5` and `1E5` are numbers; `yes`, `no`, `on`, `off`,
`1_000` and `1:30` are text; `0o10` is 8 and `0x10` is 16. `010`, which is 10 in YAML 1.2 and 8 in 1.1, is refused.
Source: YAML 1.2.2 (2021), section 10.3.2.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from vibsim.core.errors import Fault, InputError
from vibsim.experiment.yaml.file_content import read_bytes

MAX_FAULTS = 1000
MAX_ALIASES = 50
MAX_NODES = 200_000  # largest number of nodes of a file with all aliases expanded
MAX_DEPTH = 32

Path_ = tuple[str | int, ...]  # path of a value: keys and list positions from the top

_NOT_PRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that YAML 1.2.2, section 5.1, does not allow."""

MAX_DIGITS = 1000  # integers with more digits are read as floats: as infinity, which is refused

_NULL = frozenset({"", "~", "null", "Null", "NULL"})
_TRUE = frozenset({"true", "True", "TRUE"})
_FALSE = frozenset({"false", "False", "FALSE"})
_INTEGER = re.compile(r"[-+]?[0-9]+")
_ZERO = re.compile(r"[-+]?0[0-9]")
_OTHER_BASE = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITY = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NAN = frozenset({".nan", ".NaN", ".NAN"})
_INVALID = "is not valid YAML"
_TAB = re.compile(" *\t")
_TIGHT_COLON = re.compile(r"\s*(- )?\w+:[^\s:/]")
_INDEX = re.compile(r"\w\{\w+([+-]\d+)?\}")  # matches a name with an index of `repeat`
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(slots=True)
class Node:
    """A node of the YAML tree."""

    value: Any
    line: int
    text: str = ""
    size: int = 1  # number of nodes in it, with all aliases expanded
    is_open: bool = False
    keys: dict[Any, int] | None = None  # line of every key of a mapping
    children: dict[Any, Node] | None = None
    setting: str = ""  # the command-line setting that it comes from; empty if it is in the file


@dataclass(frozen=True)
class Place:
    """The lines of a value and its key."""

    line: int
    key_line: int
    text: str  # the text of the value in the file, if it is a scalar
    setting: str = ""  # the command-line setting that it comes from; empty if it is in the file


@dataclass(frozen=True)
class Source:
    """The content of an experiment file, as plain data."""

    file: str  # name of the file, as given by the user
    data: Any
    top: Node | None = None
    faults: tuple[Fault, ...] = ()  # faults that did not prevent reading: duplicate keys and tags
    settings: tuple[str, ...] = ()  # overrides of the command line, as ``KEY=VALUE``
    origins: Mapping[Path_, Path_] = field(default_factory=dict)
    """Path in the file of every value that `repeat` expanded, by its path in the data."""

    def origin(self, path: Path_) -> Path_ | None:
        """Return the path in the file from which `repeat` expanded the value at `path`; None if it was not expanded."""
        for length in range(len(path), 0, -1):
            if path[:length] in self.origins:
                return self.origins[path[:length]] + path[length:]
        return None

    def place(self, path: Path_) -> Place | None:
        """Return the place of the value at `path`, None if there is no value."""
        node = self.top
        key_line, setting = 0, ""
        for key in self.origin(path) or path:
            if node is None or node.children is None or key not in node.children:
                return None
            parent, node = node, node.children[key]
            key_line = parent.keys[key] if parent.keys is not None else node.line
            setting = node.setting or setting
        return Place(node.line, key_line, node.text, setting) if node else None


def read(path: Path, keys: Collection[str] = ()) -> Source:
    """Read the file at `path`; raise `InputError` if it cannot be read, or is not valid YAML (see `parse`)."""
    return parse(read_bytes(path), str(path), keys)


def parse(content: bytes, file: str, keys: Collection[str] = ()) -> Source:
    """Return the data of one YAML document, whose name in messages is `file`.

    Of `keys` an experiment file has at least one. Messages show no content of any other file, which may be private.
    Without `keys` any file is accepted.

    Raises `InputError` at the first syntax error, together with the duplicate keys and tags before it.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError([Fault(file, line, "", "", "must be UTF-8 text")]) from None
    if foreign := _NOT_PRINTABLE.search(text):
        line = text.count("\n", 0, foreign.start()) + 1
        hint = f"it holds character U+{ord(foreign.group()):04X}"
        raise InputError([Fault(file, line, "", "", "must be plain text", hint)])
    reader = _Reader(file, text)
    try:
        source = reader.source()
        if not keys or source.data.keys() & set(keys):
            return source
        rule = f"is not an experiment: it has none of the keys {', '.join(keys)}"
        raise InputError([Fault(file, 0, "", "", rule)])
    except InputError as error:
        faults = error.faults
    except yaml.MarkedYAMLError as error:
        faults = (_syntax(error, text, file),)
    except (yaml.YAMLError, ValueError) as error:
        faults = (Fault(file, 0, "", "", _INVALID, str(error).partition("\n")[0]),)
    finally:
        reader.loader.dispose()
    shown = {*reader.faults, *faults}
    if keys and not set(reader.top.keys or () if reader.top else ()) & set(keys):
        shown = {replace(fault, key="", value="") for fault in faults}
    raise InputError(shown)


def _syntax(error: yaml.MarkedYAMLError, text: str, file: str) -> Fault:
    mark: Any = error.problem_mark or error.context_mark
    problem, line = str(error.problem or error.context or ""), mark.line + 1 if mark else 0
    if _TAB.match("".join(text.splitlines()[line - 1 : line])):
        rule = f"{_INVALID}: tabs are not allowed for indentation"
        return Fault(file, line, "", "", rule, "use spaces")
    opened = error.context_mark.line + 1 if error.context_mark else line
    if "expected key" in problem:
        problem = f"line {line} begins in another column than the lines of its section"
    elif "'-' indicator" in problem:
        problem = (
            f"line {line} is in a list: begin it with `- `, in the column of the entries above"
        )
    elif "mapping values" in problem:
        problem = _stray_colon(text.splitlines(), line)
    elif opened < line and ("flow" in str(error.context) or "quoted" in str(error.context)):
        what = "quotation mark" if "quoted" in str(error.context) else "bracket"
        comma = (
            "" if "quoted" in str(error.context) else f", or a comma is missing before line {line}"
        )
        problem = f"the {what} that opens on line {opened} is not closed{comma}"
    if _INDEX.search("".join(text.splitlines()[line - 1 : line])):
        problem += '; YAML reads braces inside [...] and {...} itself: write "q{i}" there, in quotation marks'
    return Fault(file, line, "", "", _INVALID, problem)


def _stray_colon(lines: list[str], line: int) -> str:
    """Return the most likely cause of an unexpected colon."""
    above = next((k for k in range(line - 1, 0, -1) if lines[k - 1].strip()), 0)
    if any(_TIGHT_COLON.match(lines[k - 1]) for k in (above, line) if k):
        number = above if above and _TIGHT_COLON.match(lines[above - 1]) else line
        return f"a colon needs a blank behind it, on line {number}"
    indents = [
        len(row) - len(row.lstrip()) for row in (lines[above - 1] if above else "", lines[line - 1])
    ]
    if indents[1] > indents[0]:
        return f"it is indented further than line {above}: keys of one section begin in the same column"
    return "a text with a colon and a blank in it needs quotation marks"


def resolve(text: str) -> str | int | float | bool | None:
    """Return the value of a plain (unquoted) scalar."""
    if text in _NULL:
        return None
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    is_short = len(text) <= MAX_DIGITS
    if is_short and (_INTEGER.fullmatch(text) or _OTHER_BASE.fullmatch(text)):
        return int(text, 0 if text[:2] in ("0o", "0x") else 10)
    if _FLOAT.fullmatch(text) or _INTEGER.fullmatch(text):
        return float(text)
    if _INFINITY.fullmatch(text):
        return float("-inf" if text[0] == "-" else "inf")
    return float("nan") if text in _NAN else text


class _Reader:
    """Builds the nodes of one document from the parser's events; no deeper than `MAX_DEPTH`."""

    def __init__(self, file: str, text: str) -> None:
        self.file, self.loader = file, _Loader(text)
        self.anchors: dict[str, Node] = {}
        self.top: Node | None = None
        self.aliases = 0
        self.faults: list[Fault] = []

    def source(self) -> Source:
        while not self.loader.check_event(yaml.DocumentStartEvent, yaml.StreamEndEvent):
            self.loader.get_event()
        if self.loader.check_event(yaml.DocumentStartEvent):
            self.loader.get_event()
            self.top = self.node((), 0)
            self.loader.get_event()
            if self.loader.check_event(yaml.DocumentStartEvent):
                raise self.refuse(self.loader.get_event(), (), "must hold one YAML document only")
        self.loader.get_event()
        if self.top is None or not isinstance(self.top.value, dict):
            line = self.top.line if self.top else 0
            rule = "must be a mapping of keys to values"
            raise InputError([Fault(self.file, line, "", "", rule)])
        return Source(self.file, self.top.value, self.top, tuple(self.faults))

    def node(self, path: Path_, depth: int, *, is_key: bool = False) -> Node:
        """Read the node at `path` (for a key: the path of its mapping) at nesting `depth`."""
        event = self.loader.get_event()
        if is_key and not isinstance(event, yaml.ScalarEvent):
            raise self.refuse(event, path, "a key must be plain text")
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event, path)
        if event.tag is not None:
            rule = "YAML tags are not allowed"
            self.note(Fault(self.file, _line(event), dotted(path), event.tag[:60], rule))
        if isinstance(event, yaml.ScalarEvent):
            value = event.value if event.style else resolve(event.value)
            is_number = not event.style and isinstance(value, int | float)
            if is_number and not is_key and _ZERO.match(event.value):
                rule = "a number must not begin with 0, which some read as octal"
                hint = "leave the 0 out; octal numbers are written 0o10"
                raise self.refuse(event, path, rule, event.value[:60], hint)
            node = Node(value, _line(event), event.value)
        else:
            if depth >= MAX_DEPTH:
                raise self.refuse(event, path, f"must not nest deeper than {MAX_DEPTH} levels")
            node = Node([], _line(event), is_open=True, children={})
        if event.anchor is not None:
            self.anchors[event.anchor] = node
        if not path and not is_key:
            self.top = node
        if isinstance(event, yaml.MappingStartEvent):
            self.mapping(node, path, depth + 1)
        elif isinstance(event, yaml.SequenceStartEvent):
            while not self.loader.check_event(yaml.SequenceEndEvent):
                position = len(node.value)
                self.keep(node, position, self.node((*path, position), depth + 1), path)
            self.loader.get_event()
        node.is_open = False
        return node

    def mapping(self, node: Node, path: Path_, depth: int) -> None:
        node.value, node.keys = {}, {}
        while not self.loader.check_event(yaml.MappingEndEvent):
            key = self.node(path, depth, is_key=True)
            self.grow(node, key, path)
            if key.text in node.keys:
                rule = f"duplicate key, first on line {node.keys[key.text]}"
                self.note(Fault(self.file, key.line, dotted((*path, key.text)), "", rule))
            else:
                node.keys[key.text] = key.line
            self.keep(node, key.text, self.node((*path, key.text), depth), path)
        self.loader.get_event()

    def keep(self, parent: Node, key: str | int, node: Node, path: Path_) -> None:
        """Add a node to its parent; of duplicate keys the first counts."""
        self.grow(parent, node, path)
        assert parent.children is not None
        parent.children.setdefault(key, node)
        if isinstance(key, int):
            parent.value.append(node.value)
        else:
            parent.value.setdefault(key, node.value)

    def grow(self, parent: Node, node: Node, path: Path_) -> None:
        parent.size += node.size
        if parent.size > MAX_NODES:
            rule = f"must not hold more than {MAX_NODES} values"
            raise InputError([Fault(self.file, node.line, dotted(path), "", rule)])

    def alias(self, event: Any, path: Path_) -> Node:
        self.aliases += 1
        if self.aliases > MAX_ALIASES:
            raise self.refuse(event, path, f"must not have more than {MAX_ALIASES} aliases")
        node = self.anchors.get(event.anchor)
        if node is None or node.is_open:
            rule = "an alias must name a finished anchor before it"
            raise self.refuse(event, path, rule, f"*{event.anchor}")
        return node

    def refuse(
        self, event: Any, path: Path_, rule: str, value: str = "", hint: str = ""
    ) -> InputError:
        return InputError([Fault(self.file, _line(event), dotted(path), value, rule, hint)])

    def note(self, fault: Fault) -> None:
        """Record a fault that does not prevent further reading; its node counts as valid."""
        self.faults.append(fault)
        if len(self.faults) >= MAX_FAULTS:
            raise InputError([Fault(self.file, 0, "", "", "has more faults than are listed")])


def _line(event: Any) -> int:
    return int(event.start_mark.line) + 1


def dotted(path: Path_) -> str:
    """Return a path in the notation of messages: ``checks[2].order``."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text and part else part
    return text
