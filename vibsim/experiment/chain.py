"""Expand a chain: ``repeat: {n: 16, i: {x_i: {acceleration: x_(i+1) - 2*x_i + x_(i-1)}}}`` makes x_1 to x_16.

The mapping under the name of the index holds the coordinates that are repeated from 1 to n, with their formulas. The
index follows ``_``, alone or in parentheses with an offset; ``i`` alone is its value. Outputs, terms of an energy and
initial values may contain it, too. Names beyond the ends are walls: they are 0, unless the section defines them.

The chain is rewritten in the form of `vibsim.experiment.repeat`, which then expands it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from vibsim.experiment.faults import Report
from vibsim.experiment.repeat import REPEAT
from vibsim.experiment.shorthand import OF_COORDINATE
from vibsim.experiment.yaml.parse import Path_
from vibsim.models.shared.coordinates import MOST

COUNT = "n"
REPEATED = "outputs", "potential", "kinetic", "exact"  # keys of a model that may contain the index
_BEYOND = re.compile(r"(\w+)\{\w+\s*([+-])\s*(\d{1,4})\}")


def write_out_chain(report: Report) -> None:
    """Rewrite a chain in the content of `report` in the form of `repeat`, and report faults."""
    data = report.source.data
    section = data.get("model") if isinstance(data, Mapping) else None
    if not isinstance(section, Mapping):
        return
    repeat = section.get(REPEAT)
    if not isinstance(repeat, Mapping) or COUNT not in repeat or len(repeat) != 2:
        return
    (index,) = (key for key in repeat if key != COUNT)
    if not isinstance(repeat[index], Mapping) or not re.fullmatch(r"[A-Za-z]\w*", str(index)):
        return
    writer = _Writer(index, report)
    count = _count(repeat[COUNT], report)
    chain = writer.coordinates(repeat[index])
    model = {
        key: writer.value(("model", key), value) if key in REPEATED else value
        for key, value in section.items()
    }
    others = section.get("coordinates", {})
    if isinstance(others, Mapping):
        model["coordinates"] = {**chain, **others}
    else:
        rule = f"must hold formulas beside a chain of `{REPEAT}`"
        report.add_malformed(("model", "coordinates"), rule, "e.g. {y: {acceleration: -y}}")
        model = {key: value for key, value in model.items() if key not in OF_COORDINATE}
        names = others if isinstance(others, list | tuple) else ()
        model["coordinates"] = {**chain, **{str(name): {"acceleration": "0"} for name in names}}
    model[REPEAT] = {index: [1, count]}
    parameters = section.get("parameters", {})
    if isinstance(parameters, Mapping):
        defined = {**dict.fromkeys(map(str, others)), **parameters}
        walls = {name: 0.0 for name in _walls([chain, model], count) if name not in defined}
        model["parameters"] = {**walls, **parameters}
        for wall in walls:
            report.move(("model", REPEAT), ("model", "parameters", wall))
    content = {**data, "model": model}
    if isinstance(data.get("initial"), Mapping):
        content["initial"] = writer.value(("initial",), data["initial"])
    report.rewrite(content)


def _count(raw: Any, report: Report) -> int:
    """Return the number of coordinates; if it is faulty, the largest valid one."""
    if type(raw) is int and 1 <= raw <= MOST:
        return raw
    path: Path_ = ("model", REPEAT, COUNT)
    report.add_malformed(path, f"must be a whole number from 1 to {MOST}", value=raw)
    return MOST


class _Writer:
    """Puts braces around the index, and records the paths of rewritten keys in the file."""

    def __init__(self, index: str, report: Report) -> None:
        self.index = i = index
        self.report = report
        self._after_name = re.compile(rf"(?<=\w)_(?:{i}(?!\w)|\(\s*{i}\s*([+-]\s*\d+)?\s*\))")
        self._alone = re.compile(rf"(?<![\w{{]){i}(?![\w}}(])")
        self._unclear = re.compile(rf"\w_{i}[+-]\d+(?![\w.])")

    def coordinates(self, raw: Mapping[str, Any]) -> dict[str, Any]:
        """Return the repeated coordinates with their formulas."""
        coordinates = {}
        for key, formulas in raw.items():
            path: Path_ = ("model", REPEAT, self.index, key)
            name = self.text(path, str(key), always=True)
            if name == key:
                rule = f"must hold the index {self.index} behind _"
                self.report.add_malformed(path, rule, f"e.g. {key}_{self.index}", at_key=True)
                name = f"{key}_{{{self.index}}}"
            self.report.move(path, ("model", "coordinates", name))
            coordinates[name] = self.value(path, formulas, always=True)
        return coordinates

    def value(self, path: Path_, raw: Any, *, always: bool = False) -> Any:
        """Return a value with braces around the index after names and, with `always`, around the index alone."""
        if isinstance(raw, Mapping):
            rewritten = {}
            for key, value in raw.items():
                name = self.text((*path, key), str(key), always=always)
                if name != key:
                    self.report.move((*path, key), (*path, name))
                rewritten[name] = self.value((*path, key), value, always=always or name != key)
            return rewritten
        if isinstance(raw, list | tuple):
            return [self.value((*path, i), item) for i, item in enumerate(raw)]
        return self.text(path, raw, always=always) if isinstance(raw, str) else raw

    def text(self, path: Path_, raw: str, *, always: bool) -> str:
        """Return a key or a formula, rewritten in the same way."""
        if match := self._unclear.search(raw):
            slip = match[0][match[0].rindex("_") + 1 :]
            rule = f"'_{slip}' may mean a neighbour or a difference"
            hint = f"write _({slip}), or spaces around the sign"
            self.report.add(path, rule, hint, raw)
        braced = self._after_name.sub(lambda at: f"_{{{self.index}{at[1] or ''}}}", raw)
        if always or braced != raw:
            braced = self._alone.sub(f"{{{self.index}}}", braced)
        return braced


def _walls(content: Any, count: int) -> Iterator[str]:
    """Yield the names beyond both ends that the formulas of a chain of `count` coordinates contain."""
    if isinstance(content, Mapping | list):
        for value in content.values() if isinstance(content, Mapping) else content:
            yield from _walls(value, count)
    for name, sign, steps in _BEYOND.findall(content) if isinstance(content, str) else ():
        numbers = range(count + 1, count + 1 + int(steps)) if sign == "+" else [0]
        yield from (f"{name}{number}" for number in numbers)
