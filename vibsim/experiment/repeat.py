"""Equations that are alike, written once: ``repeat: {i: [1, 64]}`` makes as many of every key with ``{i}`` in it.

That happens to the content of a file before anything else reads it. In the sections ``model`` and ``initial`` a key
with its value, and an entry of a list, are repeated for all values of the indices that they hold in braces: ``{i}``,
``{i+1}``, ``{i-2}``. A key that is written out takes the place of a repeated one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from math import prod
from types import MappingProxyType
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.faults import Report
from vibsim.experiment.yaml.parse import Path_

REPEAT = "repeat"
MOST_VALUES = 1000
"""Values of all indices together, at most."""
_INDEX = re.compile(r"\{\s*([A-Za-z]\w*)\s*(?:([+-])\s*(\d{1,4}))?\s*\}")
_BRACE = re.compile(r"[{}]")


def write_out_repeats(report: Report) -> None:
    """Write out every repeated key of the content that `report` speaks of; what is wrong with an index is noted."""
    source, data = report.source, report.source.data
    section = data.get("model") if isinstance(data, Mapping) else None
    if not isinstance(section, Mapping) or section.get(REPEAT) is None:
        return
    indices = _indices(section[REPEAT], report)
    starts = data.get("initial")
    if not indices:
        # what holds an index is no formula then
        held = starts if isinstance(starts, Mapping) else ()
        report.faulty.update(("initial", key) for key in held if _BRACE.search(str(key)))
        return
    writer = _Writer(indices, report)
    model = {key: value for key, value in section.items() if key != REPEAT}
    found = {**data, "model": writer.mapping(("model",), model, ("model",))}
    if isinstance(starts, Mapping):
        found["initial"] = writer.mapping(("initial",), starts, ("initial",))
    written = {out: source.origin(path) or path for out, path in writer.origins.items()}
    report.source = replace(source, data=found, origins={**source.origins, **written})


def _indices(written: Any, report: Report) -> dict[str, range]:
    """Return the values of every index; none where one of them is faulty."""
    found = {}
    rule = "must be a mapping of indices to [first, last], two whole numbers"
    if not isinstance(written, Mapping) or not written:
        report.add_malformed(("model", REPEAT), rule, "e.g. {i: [1, 64]}")
        return {}
    for name, ends in written.items():
        path: Path_ = ("model", REPEAT, name)
        whole = isinstance(ends, list | tuple) and all(type(end) is int for end in ends)
        if not re.fullmatch(r"[A-Za-z]\w*", str(name)):
            report.add(path, "an index must be a name", "e.g. i", at_key=True)
        elif not whole or len(ends) != 2 or not 0 <= ends[0] <= ends[1]:
            report.add(path, "must be [first, last], whole numbers from 0 on", "e.g. [1, 64]")
        else:
            found[name] = range(ends[0], ends[1] + 1)
    if len(found) < len(written):
        report.faulty.add(("model", REPEAT))
        return {}
    count = prod(map(len, found.values()))
    if count > MOST_VALUES:
        rule = f"must not have more than {MOST_VALUES} values together, has {count}"
        report.add(("model", REPEAT), rule, at_key=True)
        return {}
    return found


class _Writer:
    """Writes out what holds an index."""

    def __init__(self, indices: Mapping[str, range], report: Report) -> None:
        self.indices, self.report = indices, report
        self.origins: dict[Path_, Path_] = {}
        """Where what was written out stands in the file."""

    def mapping(
        self,
        path: Path_,
        written: Mapping[str, Any],
        out: Path_,
        above: Mapping[str, int] = MappingProxyType({}),
    ) -> dict[str, Any]:
        """Return a mapping with its keys written out, in their order; those without an index take precedence.

        It stands at `path` in the file, and at `out` in what is written out. Indices of the keys above have their
        values already.
        """
        found: dict[str, Any] = {}
        for key, value in written.items():
            for values in self._values(str(key), above):
                own = self._put((*path, key), str(key), values)
                if own == key or own not in written:
                    if values:
                        self.origins[*out, own] = (*path, key)
                    found[own] = self._value((*path, key), value, values, (*out, own))
        return found

    def _value(self, path: Path_, value: Any, values: Mapping[str, int], out: Path_) -> Any:
        if isinstance(value, Mapping):
            return self.mapping(path, value, out, values)
        if not isinstance(value, list | tuple):
            return self._put(path, value, values) if isinstance(value, str) else value
        found: list[Any] = []
        for i, item in enumerate(value):
            for own in self._values(item, {}) if isinstance(item, str) else [{}]:
                self.origins[*out, len(found)] = (*path, i)
                found.append(self._put((*path, i), item, own) if isinstance(item, str) else item)
        return found

    def _values(self, text: str, above: Mapping[str, int]) -> Iterator[dict[str, int]]:
        """Yield the values of the indices in a text and above it, the last one fastest; once those above alone."""
        names = dict.fromkeys(match[1] for match in _INDEX.finditer(text))
        own = [name for name in names if name in self.indices and name not in above]
        for values in product(*(self.indices[name] for name in own)):
            yield {**above, **dict(zip(own, values, strict=True))}

    def _put(self, path: Path_, text: str, values: Mapping[str, int]) -> str:
        """Return a text with numbers in the places of its indices."""

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

        found = _INDEX.sub(number, text)
        if _BRACE.search(found):
            rule = "braces must hold an index, alone or with + or - and a number"
            self.report.add(path, rule, "e.g. {i+1}", text)
        return found
