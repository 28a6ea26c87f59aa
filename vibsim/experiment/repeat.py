"""Expand repeated equations: ``repeat: {i: [1, 64]}`` makes 64 copies of every key that contains ``{i}``.

The content of a file is expanded before it is validated. In the sections ``model`` and ``initial``, keys with their
values, and entries of lists, are repeated for all values of the indices that they contain in braces: ``{i}``,
``{i+1}``, ``{i-2}``. An explicit key takes precedence over a repeated one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import product
from math import prod
from types import MappingProxyType
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.faults import Report
from vibsim.experiment.yaml.parse import Path_

REPEAT = "repeat"
MOST_VALUES = 1000  # largest number of combinations of index values
_INDEX = re.compile(r"\{\s*([A-Za-z]\w*)\s*(?:([+-])\s*(\d{1,4}))?\s*\}")
_BRACE = re.compile(r"[{}]")


def write_out_repeats(report: Report) -> None:
    """Expand all repeated keys in the content of `report`, and report faulty indices."""
    data = report.source.data
    section = data.get("model") if isinstance(data, Mapping) else None
    if not isinstance(section, Mapping) or section.get(REPEAT) is None:
        return
    indices = _indices(section[REPEAT], report)
    starts = data.get("initial")
    if not indices:
        # with faulty indices, initial values with an index cannot be expanded
        keys = starts if isinstance(starts, Mapping) else ()
        report.faulty.update(("initial", key) for key in keys if _BRACE.search(str(key)))
        return
    writer = _Writer(indices, report)
    model = {key: value for key, value in section.items() if key != REPEAT}
    expanded = {**data, "model": writer.mapping(("model",), model, ("model",))}
    if isinstance(starts, Mapping):
        expanded["initial"] = writer.mapping(("initial",), starts, ("initial",))
    report.rewrite(expanded)


def _indices(raw: Any, report: Report) -> dict[str, range]:
    """Return the values of every index; empty if one of them is faulty."""
    indices = {}
    rule = "must be a mapping of indices to [first, last], two whole numbers"
    if not isinstance(raw, Mapping) or not raw:
        report.add_malformed(("model", REPEAT), rule, "e.g. {i: [1, 64]}")
        return {}
    for name, ends in raw.items():
        path: Path_ = ("model", REPEAT, name)
        whole = isinstance(ends, list | tuple) and all(type(end) is int for end in ends)
        if not re.fullmatch(r"[A-Za-z]\w*", str(name)):
            report.add(path, "an index must be a name", "e.g. i", at_key=True)
        elif not whole or len(ends) != 2 or not 0 <= ends[0] <= ends[1]:
            report.add(path, "must be [first, last], whole numbers from 0 on", "e.g. [1, 64]")
        else:
            indices[name] = range(ends[0], ends[1] + 1)
    if len(indices) < len(raw):
        report.faulty.add(("model", REPEAT))
        return {}
    count = prod(map(len, indices.values()))
    if count > MOST_VALUES:
        rule = f"must not have more than {MOST_VALUES} values together, has {count}"
        report.add(("model", REPEAT), rule, at_key=True)
        return {}
    return indices


class _Writer:
    """Expands keys and entries that contain an index."""

    def __init__(self, indices: Mapping[str, range], report: Report) -> None:
        self.indices, self.report = indices, report

    def mapping(
        self,
        path: Path_,
        raw: Mapping[str, Any],
        out: Path_,
        above: Mapping[str, int] = MappingProxyType({}),
    ) -> dict[str, Any]:
        """Return a mapping with expanded keys, in their order; explicit keys take precedence.

        Its path is `path` in the file and `out` after expansion; `above` holds the values of indices in enclosing keys.
        """
        expanded: dict[str, Any] = {}
        for key, value in raw.items():
            for values in self._values(str(key), above):
                name = self._put((*path, key), str(key), values)
                if name == key or name not in raw:
                    if values:
                        self.report.move((*path, key), (*out, name))
                    expanded[name] = self._value((*path, key), value, values, (*out, name))
        return expanded

    def _value(self, path: Path_, value: Any, values: Mapping[str, int], out: Path_) -> Any:
        if isinstance(value, Mapping):
            return self.mapping(path, value, out, values)
        if not isinstance(value, list | tuple):
            return self._put(path, value, values) if isinstance(value, str) else value
        items: list[Any] = []
        for i, item in enumerate(value):
            for own in self._values(item, {}) if isinstance(item, str) else [{}]:
                self.report.move((*path, i), (*out, len(items)))
                items.append(self._put((*path, i), item, own) if isinstance(item, str) else item)
        return items

    def _values(self, text: str, above: Mapping[str, int]) -> Iterator[dict[str, int]]:
        """Yield `above` extended by all combinations of the further indices in a text, the last index fastest."""
        names = dict.fromkeys(match[1] for match in _INDEX.finditer(text))
        new = [name for name in names if name in self.indices and name not in above]
        for values in product(*(self.indices[name] for name in new)):
            yield {**above, **dict(zip(new, values, strict=True))}

    def _put(self, path: Path_, text: str, values: Mapping[str, int]) -> str:
        """Return a text with its indices replaced by numbers."""

        def number(match: re.Match[str]) -> str:
            name, sign, more = match.groups()
            if name not in values:
                rule = f"'{match[0]}' holds an index that the key does not have"
                hint = nearest(name, list(values)) if values else f"put {{{name}}} into the key"
                self.report.add(path, rule, hint, text)
                return "0"
            value = values[name] + int(f"{sign or '+'}{more or 0}")
            if value < 0:
                rule = f"'{match[0]}' becomes {value}, but a number in a name is at least 0"
                self.report.add(path, rule, "begin with a larger index", text)
            return str(abs(value))

        result = _INDEX.sub(number, text)
        if _BRACE.search(result):
            rule = "braces must hold an index, alone or with + or - and a number"
            self.report.add(path, rule, "e.g. {i+1}", text)
        return result
