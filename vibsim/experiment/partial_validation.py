"""A file's content by section: checked at once, and where it has faults, what of it has none.

Malformed values are left out one by one, so that they hide no other fault of the same check or sweep.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import ConfigDict, ValidationError, create_model

from vibsim.experiment.faults import Report, plain_path
from vibsim.experiment.schema.checks import Check
from vibsim.experiment.schema.document import AnyScheme, Document
from vibsim.experiment.schema.fields import MadeSection
from vibsim.experiment.schema.published import PublishedRow, PublishedTable
from vibsim.experiment.units.convert import plain_numbers
from vibsim.experiment.yaml.parse import Path_, Source

_STAND_IN = "?"
"""Takes the place of text that cannot be left out; nothing is said about it a second time."""
_REQUIRED: dict[str | int, Any] = {
    **dict.fromkeys(("claim", "converges", "value"), _STAND_IN),
    "stable": True,
    "conserves": "energy",
    "equal": [_STAND_IN, _STAND_IN],
}
"""What takes the place of a value that makes a check what it is."""
_LISTS = ("initial", "sweep", "schemes", "checks", "published")
_SAMPLE: dict[str | int, Any] = {"method": "random", "n": 1, "seed": 0}
"""Take the place of what a sample cannot be without."""
_OPTIONAL = [name for name, field in Document.model_fields.items() if not field.is_required()]


class _Deferred(MadeSection):
    """A part whose validator is built on first use: files without fault never need it."""

    model_config = ConfigDict(defer_build=True)


def _partial_table() -> Any:
    """Return the class of a printed table without what is faulty; a faulty row is None."""
    fields: dict[str, Any] = {
        name: (field.rebuild_annotation() | None, None)
        for name, field in PublishedTable.model_fields.items()
    }
    fields["rows"] = (tuple[PublishedRow | None, ...], ())
    fields["beside"] = (tuple[str, ...], ())
    return create_model("PartialTable", __base__=_Deferred, **fields)


_ITEMS: dict[str, Any] = {"schemes": AnyScheme, "checks": Check, "published": _partial_table()}


def _part(name: str) -> tuple[Any, Any]:
    field = Document.model_fields[name]
    if name in _ITEMS:
        item: Any = _ITEMS[name]
        return (tuple[item | None, ...], ())
    if field.is_required():
        return (field.rebuild_annotation() | None, None)
    return (field.rebuild_annotation(), field.default)


_PARTS: dict[str, Any] = {name: _part(name) for name in Document.model_fields}

Partial: Any = create_model("Partial", __base__=_Deferred, **_PARTS)
"""A document without its faulty sections; faulty schemes, checks, tables and rows are None in their lists."""


def sections(source: Source, report: Report) -> Any:
    """Return the content of a file as a `Document`, or what of it has no fault as a `Partial`."""
    whole, faulty = plain_numbers(_as_written(source.data, source), report)
    data = {k: v for k, v in whole.items() if v is not None or k not in _OPTIONAL}
    try:
        document = Document.model_validate(data)
        if not faulty:
            return document
    except ValidationError as error:
        faulty += report.add_invalid(error)
    rest = _without_values(data, faulty)
    try:
        return Partial.model_validate(rest)
    except ValidationError as error:
        # what cannot be read without its faulty values is left out whole
        rows = error.errors(include_url=False, include_input=False)
        places = [plain_path(row["loc"], keep_last=False) for row in rows]
    return Partial.model_validate(_without_sections(rest, places))


def _without_sections(data: Mapping[str, Any], faulty: list[Path_]) -> dict[str, Any]:
    """Return `data` without the sections at fault; of a list, entries at fault become None."""
    whole = {path[0] for path in faulty if path[0] not in _ITEMS or len(path) == 1}
    items = {path[:2] for path in faulty if len(path) > 1}
    kept: dict[str, Any] = {}
    for key, value in data.items():
        if key in whole:
            continue
        kept[key] = value
        if key in _ITEMS:
            kept[key] = [None if (key, i) in items else item for i, item in enumerate(value)]
    return kept


def _as_written(data: Mapping[str, Any], source: Source) -> dict[str, Any]:
    """Return `data` with the printed numbers of its tables as text: their digits count, not their value."""
    kept = dict(data)
    tables = kept.get("published")
    if source.top is None or not isinstance(tables, list):
        return kept
    kept["published"] = copy.deepcopy(tables)
    for i, table in enumerate(kept["published"]):
        rows = table.get("rows") if isinstance(table, dict) else None
        for j, row in enumerate(rows if isinstance(rows, list) else ()):
            place = source.place(("published", i, "rows", j, "printed"))
            number = row.get("printed") if isinstance(row, dict) else None
            if place and isinstance(number, int | float) and not isinstance(number, bool):
                row["printed"] = place.text
    return kept


def _without_values(data: Mapping[str, Any], faulty: Iterable[Path_]) -> dict[str, Any]:
    """Return `data` without the values at the places `faulty`.

    Values of mappings (`initial`, `sweep`) are left out one by one, and so are the parts of checks and those of a
    sweep's `zip` and `sample`; an entry of `schemes`, a row of a printed table, and a check that is no mapping become
    None; any other section goes as a whole.
    """
    kept = dict(data)
    copied = {path[0] for path in faulty if path[0] in _LISTS}
    kept.update((key, copy.deepcopy(kept[key])) for key in copied if key in kept)
    for path in faulty:
        _take_out(kept, path)
    return {key: value for key, value in kept.items() if key != "sweep" or value}


def _take_out(kept: dict[str, Any], path: Path_) -> None:
    section = kept.get(str(path[0]))
    if len(path) == 1 or path[0] not in _LISTS:
        kept.pop(str(path[0]), None)
    elif path[0] == "sweep" and path[1] in ("zip", "sample") and len(path) > 2:
        _take_out_axis(section, path[1:])
    elif isinstance(section, dict):
        section.pop(path[1], None)
    elif isinstance(section, list) and isinstance(path[1], int):
        if path[0] == "schemes" or len(path) == 2:
            section[path[1]] = None
        elif path[0] == "published":
            _take_out_row(section[path[1]], path[2:])
        else:
            _take_out_part(section[path[1]], path[2:])


def _take_out_axis(sweep: Any, path: Path_) -> None:
    """Leave one value of `zip` or `sample` out; what is without keys then goes as a whole."""
    name, part, *deeper = path
    axis = sweep.get(name)
    if not isinstance(axis, dict):
        return
    if name == "sample" and part in _SAMPLE:
        axis[part] = _SAMPLE[part]
    elif deeper and part == "over":
        axis["over"].pop(deeper[0], None)
    else:
        axis.pop(part, None)
    if not axis or (name == "sample" and not axis.get("over")):
        sweep.pop(name)


def _take_out_row(table: Any, path: Path_) -> None:
    """Leave one value of a printed table out; a row goes as a whole."""
    if not isinstance(table, dict):
        return
    if path[0] == "rows" and len(path) > 1 and isinstance(path[1], int):
        table["rows"][path[1]] = None
    else:
        table.pop(path[0], None)


def _take_out_part(check: Any, path: Path_) -> None:
    """Leave one value of a check out, or put the stand-in there where it is required."""
    holder = check
    for part in path[:-1]:
        inner = _get(holder, part)
        if inner is None:
            return
        holder = inner
    last = path[-1]
    listed = isinstance(holder, list) and isinstance(last, int)
    if listed:
        holder[last] = _STAND_IN
    elif isinstance(holder, dict) and last in _REQUIRED and last in holder:
        holder[last] = copy.copy(_REQUIRED[last])
    elif isinstance(holder, dict) and last == "at" and isinstance(holder.get("at"), dict):
        # at itself is at fault where it has both best and level, or another value of best
        holder["at"] = {k: v for k, v in holder["at"].items() if k not in ("best", "level")}
    elif isinstance(holder, dict):
        holder.pop(last, None)


def _get(holder: Any, part: str | int) -> Any:
    if isinstance(holder, dict):
        return holder.get(part)
    if isinstance(holder, list) and isinstance(part, int) and part < len(holder):
        return holder[part]
    return None
