"""Collect every fault of an input, each with its line, in the words of the person who wrote it."""

from __future__ import annotations

import re
from typing import Any, cast

from pydantic import ValidationError

from vibsim.core.errors import Fault, InputError, nearest
from vibsim.experiment.schema.checks import CLASSES, At, Expect, ValueCheck
from vibsim.experiment.schema.document import (
    MODEL_SECTIONS,
    SCHEME_SECTIONS,
    Document,
    Every,
    LevelRange,
    TimeSection,
)
from vibsim.experiment.schema.fields import TABLE, Section
from vibsim.experiment.schema.published import PublishedAt, PublishedRow, PublishedTable
from vibsim.experiment.schema.sweep_section import Sample
from vibsim.experiment.yaml.parse import MAX_FAULTS, Path_, Source, dotted
from vibsim.models import MODELS

MAX_VALUE = 60

_RULES = {
    "missing": "required key is missing",
    "extra_forbidden": "unknown key",
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
    "union_tag_invalid": "unknown kind",
    "union_tag_not_found": "must be a mapping with the key kind",
}
_FORMS = {
    "linspace": "must be [first, last, count]",
    "logspace": "must be [first, last, count]",
    "range": "must be [first, end, step]",
}
"""How each rule for the values of a sweep is written."""
_INTERVAL = "must be [least, largest]"
_PAIR = "must be [scheme, another scheme or exact or discrete]"


class Report:
    """The faults of one input."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.faults: set[Fault] = set(source.faults)
        self.faulty: set[Path_] = set()
        """Places of malformed values; nothing more is said about them."""

    def add(
        self, path: Path_, rule: str, hint: str = "", value: object = None, at_key: bool = False
    ) -> None:
        """Note a fault of the value at `path`, or with `at_key` of the key itself.

        Raises
        ------
        InputError
            Where there are `MAX_FAULTS` already: nobody reads more of them.
        """
        if path in self.faulty:
            return
        place = self.source.place(path)
        nested = place is not None and not place.text
        line = (
            self.line(path) if place is None else place.key_line if at_key or nested else place.line
        )
        written = place.text if place and place.text else "" if value is None else str(value)
        self.faults.add(Fault(self.source.file, line, dotted(path), shorten(written), rule, hint))
        if len(self.faults) == MAX_FAULTS:
            self.faults.add(Fault(self.source.file, 0, "", "", "has more faults than are listed"))
            self.raise_any()

    def line(self, path: Path_) -> int:
        """Return the line of the nearest key above `path` that the file has, 0 without one."""
        for length in range(len(path), 0, -1):
            place = self.source.place(path[:length])
            if place is not None:
                return place.key_line
        return self.source.top.line if self.source.top else 0

    def add_invalid(self, error: ValidationError) -> list[Path_]:
        """Note every fault that pydantic found; return their places."""
        paths = [self._add_row(row) for row in error.errors(include_url=False)]
        self.faulty.update(paths)
        return paths

    def _add_row(self, row: Any) -> Path_:
        kind: str = row["type"]
        path = plain_path(row["loc"], keep_last=kind == "extra_forbidden")
        context = row.get("ctx", {})
        rule = _RULES.get(kind, "{msg}").format(**{**context, "msg": worded(row["msg"])})
        value = None if kind == "missing" else row["input"]
        hint = context.get("hint", "")
        match kind:
            case "extra_forbidden":
                hint = nearest(path[-1], known_keys(path[:-1], self.source.data))
                if path[-1] in _FORMS:
                    rule, hint = "a key of the sweep has one rule for its values", ""
            case "values":
                return self._add_values(path, rule, value)
            case "literal_error":
                hint = nearest(value, re.findall(r"'([^']*)'", context["expected"]))
            case "union_tag_invalid" | "union_tag_not_found":
                return self._add_kind(path, value)
        if kind in ("missing", "too_long", "tuple_type"):
            path, rule = _whole_list(path, rule)
        # a list with wrong items is too short only for pydantic, which counts the right ones
        if kind != "too_short" or not value:
            self.add(path, rule, hint, value, at_key=kind == "extra_forbidden")
        return path

    def _add_values(self, path: Path_, rule: str, value: object) -> Path_:
        """Note that the values of a key of the sweep are no list and follow no rule."""
        names = [str(name) for name in value] if isinstance(value, dict) else []
        for name in names:
            self.add((*path, name), "unknown key", nearest(name, list(_FORMS)), at_key=True)
        if not names:
            self.add(path, rule, value=value)
        return path

    def _add_kind(self, path: Path_, value: object) -> Path_:
        """Note that a model or a scheme has no kind that exists."""
        kinds = sorted(MODEL_SECTIONS if path[0] == "model" else SCHEME_SECTIONS)
        if not isinstance(value, dict):
            hint = f"e.g. {{kind: {kinds[0]}}}"
            self.add(path, "must be a mapping with the key kind", hint, value)
        elif "kind" in value:
            self.add(
                (*path, "kind"),
                f"unknown {path[0]}".rstrip("s"),
                nearest(value["kind"], kinds),
                value["kind"],
            )
        else:
            self.add((*path, "kind"), _RULES["missing"], nearest("", kinds))
        return path

    def raise_any(self) -> None:
        """Raise `InputError` with every fault, if there is one."""
        if self.faults:
            raise InputError(self.faults)


def plain_path(loc: tuple[str | int, ...], keep_last: bool) -> Path_:
    """Return a place without the names of union members, which no file contains."""
    last = len(loc) - 1 if keep_last else len(loc)
    named = [
        part
        for index, part in enumerate(loc)
        if index == last or not (isinstance(part, str) and part.startswith("\0"))
    ]
    return tuple(named)


def _whole_list(path: Path_, rule: str) -> tuple[Path_, str]:
    """Return where a list of fixed length stands of which too little or too much is there, and how it is written."""
    for name, form in _FORMS.items():
        if name in path:
            return path[: path.index(name) + 1], form
    if path[:3] == ("sweep", "sample", "over") and len(path) > 3:
        return path[:4], _INTERVAL
    if path[0] == "checks" and "equal" in path:
        return path[: path.index("equal") + 1], _PAIR
    return path, rule


def worded(message: str) -> str:
    """Return one of pydantic's messages in the imperative of the others."""
    return message.replace("Input should", "must", 1)


def shorten(text: str) -> str:
    """Return `text` on one line, cut to `MAX_VALUE` characters; control characters are spelled out."""
    shown = (
        c if c.isprintable() or c in "\t\r\n" else repr(c)[1:-1] for c in text[: 4 * MAX_VALUE]
    )
    line = " ".join("".join(shown).split())
    return line if len(line) <= MAX_VALUE else line[: MAX_VALUE - 3] + "..."


def known_keys(path: Path_, data: Any) -> list[str]:
    """Name the keys that a mapping at `path` may have."""
    value: Any = data
    for part in path:
        value = cast(Any, value)[part]
    if path[:1] == ("sweep",) and path != ("sweep", "sample"):
        return list(_FORMS)
    if path[:1] == ("model",) and len(path) > 1:
        formulas = MODELS[data["model"]["kind"]].formulas
        row = next((row for row in formulas if row.name == path[1]), None)
        return [*row.terms, *((TABLE, *row.table) if row.table else ())] if row else []
    fields = _section(path, value).model_fields
    return [field.alias or name for name, field in fields.items()]


def _section(path: Path_, value: Any) -> type[Section]:
    match path:
        case ():
            return Document
        case ("model",):
            return MODEL_SECTIONS[value["kind"]]
        case ("time",):
            return TimeSection
        case ("levels",):
            return LevelRange
        case ("samples",):
            return Every
        case ("sweep", "sample"):
            return Sample
        case ("schemes", _):
            return SCHEME_SECTIONS[value["kind"]]
        case ("published", _):
            return PublishedTable
        case ("published", _, "rows", _):
            return PublishedRow
        case ("published", *_, "at"):
            return PublishedAt
        case (*_, "at"):
            return At
        case (*_, "expect"):
            return Expect
    return next((row for key, row in CLASSES.items() if key in value), ValueCheck)
