"""A chain in short: ``repeat: {n: 16, i: {x_i: {acceleration: x_(i+1) - 2*x_i + x_(i-1)}}}`` makes x_1 to x_16.

Below the name of an index stand the coordinates that are repeated from 1 to n, with their formulas. The index stands
behind ``_``, alone or in parentheses with a number, and ``i`` alone is its value; so it may stand in outputs, terms of
an energy and initial values. What is named beyond the ends is a wall: it stays at 0, unless the section gives it.

That happens to the content of a file in front of `vibsim.experiment.repeat`, whose form it brings this one to.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from vibsim.experiment.faults import Report
from vibsim.experiment.repeat import REPEAT
from vibsim.experiment.shorthand import OF_COORDINATE
from vibsim.experiment.yaml.parse import Path_
from vibsim.models.system import MOST

COUNT = "n"
REPEATED = "outputs", "potential", "kinetic", "exact"
"""Parts of a model that may hold the index beside the coordinates."""
_BEYOND = re.compile(r"(\w+)\{\w+\s*([+-])\s*(\d{1,4})\}")


def write_out_chain(report: Report) -> None:
    """Bring a chain in the content that `report` speaks of to the form of `repeat`; faults are noted."""
    data = report.source.data
    section = data.get("model") if isinstance(data, Mapping) else None
    if not isinstance(section, Mapping):
        return
    written = section.get(REPEAT)
    if not isinstance(written, Mapping) or COUNT not in written or len(written) != 2:
        return
    (index,) = (key for key in written if key != COUNT)
    if not isinstance(written[index], Mapping) or not re.fullmatch(r"[A-Za-z]\w*", str(index)):
        return
    writer = _Writer(index, report)
    count = _count(written[COUNT], report)
    chain = writer.coordinates(written[index])
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
    given = section.get("parameters", {})
    if isinstance(given, Mapping):
        own = {**dict.fromkeys(map(str, others)), **given}
        walls = {name: 0.0 for name in _walls([chain, model], count) if name not in own}
        model["parameters"] = {**walls, **given}
    content = {**data, "model": model}
    if isinstance(data.get("initial"), Mapping):
        content["initial"] = writer.value(("initial",), data["initial"])
    origins = {**report.source.origins, **writer.origins}
    report.source = replace(report.source, data=content, origins=origins)


def _count(written: Any, report: Report) -> int:
    """Return how many coordinates there are, and as many as there may be where that is faulty."""
    if type(written) is int and 1 <= written <= MOST:
        return written
    path: Path_ = ("model", REPEAT, COUNT)
    report.add_malformed(path, f"must be a whole number from 1 to {MOST}", value=written)
    return MOST


class _Writer:
    """Writes the index in braces, and remembers where the keys with it stand in the file."""

    def __init__(self, index: str, report: Report) -> None:
        self.index = i = index
        self.report = report
        self.origins: dict[Path_, Path_] = {}
        self._behind = re.compile(rf"(?<=\w)_(?:{i}(?!\w)|\(\s*{i}\s*([+-]\s*\d+)?\s*\))")
        self._alone = re.compile(rf"(?<![\w{{]){i}(?![\w}}(])")
        self._unclear = re.compile(rf"\w_{i}[+-]\d+(?![\w.])")

    def coordinates(self, written: Mapping[str, Any]) -> dict[str, Any]:
        """Return the coordinates that are repeated, with their formulas."""
        found = {}
        for key, own in written.items():
            path: Path_ = ("model", REPEAT, self.index, key)
            name = self.text(path, str(key), always=True)
            if name == key:
                rule = f"must hold the index {self.index} behind _"
                self.report.add_malformed(path, rule, f"e.g. {key}_{self.index}", at_key=True)
                name = f"{key}_{{{self.index}}}"
            self.origins["model", "coordinates", name] = path
            found[name] = self.value(path, own, always=True)
        return found

    def value(self, path: Path_, written: Any, *, always: bool = False) -> Any:
        """Return a value with the index in braces where it stands behind a name, or `always` where it stands alone."""
        if isinstance(written, Mapping):
            found = {}
            for key, value in written.items():
                name = self.text((*path, key), str(key), always=always)
                if name != key:
                    self.origins[*path, name] = (*path, key)
                found[name] = self.value((*path, key), value, always=always or name != key)
            return found
        if isinstance(written, list | tuple):
            return [self.value((*path, i), item) for i, item in enumerate(written)]
        return self.text(path, written, always=always) if isinstance(written, str) else written

    def text(self, path: Path_, written: str, *, always: bool) -> str:
        """Return a key or a formula likewise."""
        if found := self._unclear.search(written):
            slip = found[0][found[0].rindex("_") + 1 :]
            rule = f"'_{slip}' may mean a neighbour or a difference"
            hint = f"write _({slip}), or spaces around the sign"
            self.report.add(path, rule, hint, written)
        braced = self._behind.sub(lambda at: f"_{{{self.index}{at[1] or ''}}}", written)
        if always or braced != written:
            braced = self._alone.sub(f"{{{self.index}}}", braced)
        return braced


def _walls(written: Any, count: int) -> Iterator[str]:
    """Yield the names beyond both ends that formulas of a chain of so many hold."""
    if isinstance(written, Mapping | list):
        for value in written.values() if isinstance(written, Mapping) else written:
            yield from _walls(value, count)
    for name, sign, steps in _BEYOND.findall(written) if isinstance(written, str) else ():
        beyond = range(count + 1, count + 1 + int(steps)) if sign == "+" else [0]
        yield from (f"{name}{number}" for number in beyond)
