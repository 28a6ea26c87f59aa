"""Collect every fault of an input, with its line and the text of the file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from vibsim.core.errors import Fault, InputError, likely, nearest
from vibsim.core.home import home
from vibsim.core.set_option import set_in
from vibsim.experiment.kinds import Kinds
from vibsim.experiment.schema.unit_text import split
from vibsim.experiment.yaml.parse import MAX_FAULTS, Path_, Source, dotted
from vibsim.formula import MAX_CHARACTERS, Expression, ExpressionError, parse

MAX_VALUE = 60
MISSING = "required key is missing"

_RULES = {
    "missing": MISSING,
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "literal_error": "unknown choice",
    "string_type": "must be text",
    "string_too_short": "must not be empty",
    "string_pattern_mismatch": "must consist of a to z, 0 to 9 and _",
    "too_short": "must not be empty",
    "tuple_type": "must be a list",
    "dict_type": "must be a mapping",
    "model_type": "must be a mapping",
    "model_attributes_type": "must be a mapping",
    "bool_type": "must be true or false",
}
_OF_FORM = ("tuple_type", "dict_type", "model_type", "model_attributes_type", "string_type")
_FORMS = {
    "linspace": "must be [first, last, count]",
    "logspace": "must be [first, last, count]",
    "range": "must be [first, end, step]",
}
"""Syntax of each rule for the values of a sweep."""

_EXAMPLES: Mapping[object, str] = {
    ("levels",): "e.g. [6, 7, 8, 9], or {from: 6, to: 9}",
    ("time",): "e.g. {end: 10.0}",
    ("time", "frequency"): "name the parameter: e.g. model.parameters.w",
    ("model", "start"): "e.g. {displacement: [0, 1]}",
    ("model", "input"): "e.g. {table: road.csv, at: speed*t}",
    ("model", "outputs"): "e.g. {stretch: y - x}",
    ("model", "parameters"): "e.g. {k: 2.0}",
    ("model", "equation"): "e.g. u'' + u = 0",
    ("initial",): "e.g. {u: 1.0}",
    ("model", "rayleigh"): "e.g. {alpha: 0.1, beta: 0.001}",
    ("model", "observe"): "e.g. {tip: 10, stretch: {1: -1, 2: 1}}",
    ("checks",): "begin each one with `- `",
    ("model", "events"): "begin each one with `- `",
    "expect": "e.g. {status: FAIL, reason: order_low}",
    "then": "e.g. {v: -0.8*v}",
    "at": "e.g. {level: best}",
}
"""Examples of lists and mappings for messages whose rule alone does not help; by path, or by key anywhere."""

_MEANT = {"tolerance": "atol", "tol": "atol", "at_least": "above", "at_most": "below"}
"""Keys of other programs or other checks, and the key with the same meaning here."""
_PLACES = {"schemes": "scheme", "levels": "level", "cases": "case"} | {
    name: name for name in ("t", "step", "event", "case", "level", "best", "scheme")
}
"""Keys that are often written outside of the section `at` of a check, and the key of `at` that is meant."""


class Report:
    """The faults and warnings of one input, and the models and schemes that it may name."""

    def __init__(self, source: Source, kinds: Kinds | None = None) -> None:
        self.source = source
        self.kinds = kinds or Kinds()
        self.faults: set[Fault] = set(source.faults)
        self.notes: set[Fault] = set()
        """Warnings: valid input that is probably a mistake."""
        self.faulty: set[Path_] = set()
        """Paths of malformed values; no further fault is reported there."""
        self._expanded: set[Path_] = set()
        """Paths of the file that `repeat` expanded and that have a fault already; only the first copy is reported."""
        self._moved: dict[Path_, Path_] = {}

    def add(
        self, path: Path_, rule: str, hint: str = "", value: object = None, at_key: bool = False
    ) -> None:
        """Record a fault of the value at `path`, or of the key itself with `at_key`.

        Raises `InputError` at `MAX_FAULTS` faults, because nobody reads more of them.
        """
        origin = self.source.origin(path)
        if path in self.faulty or origin in self._expanded:
            return
        if origin is not None:
            self._expanded.add(origin)
        self.faults.add(self._fault(path, rule, hint, value, at_key))
        if len(self.faults) == MAX_FAULTS:
            self.faults.add(Fault(self.source.file, 0, "", "", "has more faults than are listed"))
            self.raise_any()

    def note(self, path: Path_, rule: str, hint: str = "") -> None:
        """Record a warning: the value at `path` is valid, but probably a mistake."""
        self.notes.add(self._fault(path, rule, hint, None, False))

    def _fault(self, path: Path_, rule: str, hint: str, value: object, at_key: bool) -> Fault:
        if path and str(path[-1]).count(")") > str(path[-1]).count("("):
            # a comma between braces has cut a formula in two
            hint = "between braces a comma ends a value: write a formula with commas in quotation marks"
        place = self.source.place(path)
        file, line = self._nearest_place(path)
        if place and place.text and not (at_key or place.setting):
            line = place.line
        written, origin = "" if value is None else _as_yaml(value), self.source.origin(path)
        if place and place.text and not (written and origin):
            written = place.text
        # show keys as `repeat` expanded them, but positions in a list as in the file
        is_repeated = any("{" in str(key) for key in origin or ())
        shown = path if origin is None or (is_repeated and isinstance(path[-1], str)) else origin
        return Fault(file, line, dotted(shown), shorten(written), rule, hint)

    def is_set(self, path: Path_) -> bool:
        """Tell whether the value at `path` comes from a setting of the command line, not from the file."""
        place = self.source.place(path)
        return place is not None and bool(place.setting)

    def add_malformed(
        self, path: Path_, rule: str, hint: str = "", value: object = None, at_key: bool = False
    ) -> None:
        """Record a fault at `path` and suppress all further ones there (`faulty`)."""
        self.add(path, rule, hint, value, at_key)
        self.faulty.add(path)

    def _nearest_place(self, path: Path_) -> tuple[str, int]:
        """Return file and line of the nearest key at or above `path`; for a command-line setting, its text and 0."""
        for length in range(len(path), 0, -1):
            place = self.source.place(path[:length])
            if place is not None and place.setting:
                return set_in(self.source.file, shorten(place.setting)), 0
            if place is not None:
                return self.source.file, place.key_line
        return self.source.file, self.source.top.line if self.source.top else 0

    def add_unknown_key(self, path: Path_, value: object, known: list[str]) -> None:
        """Record a fault of a key that is not among the `known` ones of its mapping."""
        if path[0] == "sweep" and path[-1] in _FORMS:
            rule, hint = "a key of the sweep has one rule for its values", ""
        else:
            is_rule = any(name in _FORMS for name in known)
            meant = _MEANT.get(str(path[-1]), "")
            written = meant if meant in known else path[-1]
            rule, hint = "unknown key", nearest(written, list(_FORMS) if is_rule else known)
            if "take" in known and path[-1] in _PLACES:
                hint = f"write at: {{{_PLACES[str(path[-1])]}: ...}}"
            if path[:-1] == ("model",) and path[-1] in self._declared:
                hint = f"the parameter of this name is `model.parameters.{path[-1]}`"
            if value is None and str(path[-1])[0:1].isdigit():
                hint = "between braces a comma ends a value: write numbers with a decimal point"
        self.add_malformed(path, rule, hint, value, at_key=True)

    def add_invalid(self, error: ValidationError, path: Path_) -> list[Path_]:
        """Record every fault that pydantic found in the value at `path`, and return their paths."""
        paths = [self._add_row(row, path) for row in error.errors(include_url=False)]
        self.faulty.update(paths)
        return paths

    def _add_row(self, row: Any, above: Path_) -> Path_:
        kind: str = row["type"]
        # pydantic inserts the tags of unions, which are not in the file
        keys = (part for part in row["loc"] if not str(part).startswith("\0"))
        path: Path_ = (*above, *keys)
        context = row.get("ctx", {})
        message = row["msg"].replace("Input should", "must", 1)
        rule = _RULES.get(kind, "{msg}").format(**{**context, "msg": message})
        value = None if kind == "missing" else row["input"]
        hint = context.get("hint", "")
        if kind == "values" and isinstance(value, dict) and value:
            # a swept key has a mapping that is no known rule
            for name in map(str, value):
                self.add((*path, name), "unknown key", nearest(name, list(_FORMS)), at_key=True)
            return path
        if kind == "check" and isinstance(value, dict):
            known = re.split(", | or ", rule.partition(" the key ")[2])
            hint = next(filter(None, (likely(key, known) for key in value)), "")
        if kind == "tuple_type" and isinstance(value, str | int):
            hint = f"write [{value}]"
        if path[0] == "initial" and isinstance(value, str):
            named = [name for name in self._declared if re.search(rf"\b{re.escape(name)}\b", value)]
            if named:
                hint = f"an initial value cannot name {named[0]}: write the number; zip of a sweep varies both"
        if kind == "literal_error":
            hint = nearest(value, re.findall(r"'([^']*)'", context["expected"]))
        if kind in _OF_FORM:
            hint = _EXAMPLES.get(path) or _EXAMPLES.get(path[-1], hint)
        if kind in ("missing", "too_long", "tuple_type"):
            path, rule = _whole_list(path, rule)
        # pydantic counts only valid items: a list with invalid ones is not too short
        if kind != "too_short" or not value:
            self.add(path, rule, hint, value)
        return path

    def add_kind(self, path: Path_, value: object) -> None:
        """Record that the kind of a model or a scheme is missing or unknown (`faulty`)."""
        kinds = sorted(self.kinds.names(path[0]))
        if not isinstance(value, dict):
            hint = f"write {{kind: {value}}}" if value in kinds else f"e.g. {{kind: {kinds[0]}}}"
            self.add_malformed(path, "must be a mapping with the key kind", hint, value)
            return
        rule = f"unknown {path[0]}".rstrip("s") if "kind" in value else MISSING
        kind = value.get("kind")
        hint = nearest(kind if "kind" in value else "", kinds)
        if path == ("model",) and (experiment := _shipped(str(kind))):
            hint = f"`vibsim new FILE --like {experiment}` begins with a shipped experiment of this name"
        self.add((*path, "kind"), rule, hint, kind)
        self.faulty.add(path)

    @property
    def _declared(self) -> list[str]:
        """The names under `parameters` of the model."""
        model = self.source.data.get("model")
        declared = model.get("parameters") if isinstance(model, Mapping) else None
        return [str(name) for name in declared] if isinstance(declared, Mapping) else []

    @property
    def note_lines(self) -> tuple[tuple[int, str], ...]:
        """The warnings as pairs of a line of the file (0 if none) and a text."""
        lines = []
        for row in sorted(self.notes):
            setting = row.file.removeprefix(self.source.file).removeprefix(", ")
            lines.append((row.line, str(replace(row, file=setting, line=0))))
        return tuple(lines)

    @property
    def has_faulty_model(self) -> bool:
        """Whether the section ``model`` has a fault, or the events beside it."""
        sections = (re.split(r"[.\[]", fault.key)[0] for fault in self.faults)
        return not {"model", "events", "stop"}.isdisjoint(sections)

    def formula(
        self, path: Path_, text: str, names: Sequence[str], more: str = "", hint: str = ""
    ) -> Expression | None:
        """Parse a formula in the given names; record a fault and return None if it is invalid.

        `more` is appended to the rule about an unknown name; `hint` replaces the hint of the parser.
        """
        try:
            return parse(text, names)
        except ExpressionError as error:
            place = f" at character {error.position + 1}" if error.position < MAX_CHARACTERS else ""
            suffix = more if error.rule.startswith("unknown name") else ""
            hint = hint or error.hint
            if not hint and error.rule.startswith("expected") and split(text):
                hint = "a formula has no units: declare the number under `parameters:`"
            self.add(path, f"{error.rule}{place}{suffix}", hint, text)
            return None

    def move(self, before: Path_, path: Path_) -> None:
        """Record that the value at `before` is at `path` in the content that `rewrite` gets next."""
        self._moved[path] = self.source.origin(before) or before

    def rewrite(self, data: Any) -> None:
        """Replace the content."""
        origins = {**self.source.origins, **self._moved}
        self.source, self._moved = replace(self.source, data=data, origins=origins), {}

    def raise_any(self) -> None:
        """Raise `InputError` with all faults, if there are any."""
        if self.faults:
            raise InputError(self.faults)


def _as_yaml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_as_yaml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_as_yaml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return "null" if value is None else str(value)


def _shipped(name: str) -> str:
    """Return ``collection/name`` of the shipped experiment called `name`; empty if there is none."""
    if not re.fullmatch(r"\w+", name):
        return ""
    files = sorted((home() / "configs").glob(f"*/{name}.yaml"))
    return f"{files[0].parent.name}/{name}" if files else ""


def _whole_list(path: Path_, rule: str) -> tuple[Path_, str]:
    """Return the path of the list of fixed length that contains `path`, and a rule with its syntax."""
    for name, form in _FORMS.items():
        if name in path:
            return path[: path.index(name) + 1], form
    if path[:3] == ("sweep", "sample", "over") and len(path) > 3:
        return path[:4], "must be [least, largest]"
    if path[0] == "checks" and "equal" in path:
        rule = "must be [scheme, another scheme or exact or discrete]"
        return path[: path.index("equal") + 1], rule
    return path, rule


def shorten(text: str) -> str:
    """Return `text` on one line, cut to `MAX_VALUE` characters, with control characters escaped."""
    shown = (
        c if c.isprintable() or c in "\t\r\n" else repr(c)[1:-1] for c in text[: 4 * MAX_VALUE]
    )
    line = " ".join("".join(shown).split())
    return line if len(line) <= MAX_VALUE else line[: MAX_VALUE - 3] + "..."
