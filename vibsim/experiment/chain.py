"""A chain in short: ``repeat: {n: 16, i: {x_i: {acceleration: x_(i+1) - 2*x_i + x_(i-1)}}}`` makes x_1 to x_16.

Below the name of an index stand the coordinates that are repeated from 1 to n, with their formulas. There the index
stands behind ``_``, alone or in parentheses with a number, and ``i`` alone is its value. What a formula names beyond
the ends is a wall: it stays at 0, unless the section gives it.

That happens to the content of a file in front of `vibsim.experiment.repeat`, whose form it brings this one to.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from vibsim.experiment.faults import Report
from vibsim.experiment.repeat import REPEAT
from vibsim.experiment.yaml.parse import Path_, Source
from vibsim.models.system import MOST

COUNT = "n"
_BEYOND = re.compile(r"(\w+)\{\w+\s*([+-])\s*(\d{1,4})\}")


def with_chain(source: Source, report: Report) -> Source:
    """Return the content with a chain as `repeat` writes it, of which `report` then speaks; faults are noted."""
    data = source.data
    section = data.get("model") if isinstance(data, Mapping) else None
    if not isinstance(section, Mapping):
        return source
    written = section.get(REPEAT)
    if not isinstance(written, Mapping) or COUNT not in written or len(written) != 2:
        return source
    (index,) = (key for key in written if key != COUNT)
    count, chain = written[COUNT], written[index]
    if not isinstance(chain, Mapping) or not re.fullmatch(r"[A-Za-z]\w*", str(index)):
        return source
    if type(count) is not int or not 1 <= count <= MOST:
        path: Path_ = ("model", REPEAT, COUNT)
        report.add_malformed(path, f"must be a whole number from 1 to {MOST}", value=count)
        count = 1
    own, origins = {}, dict(source.origins)
    for key, value in chain.items():
        name = _with_braces(key, index)
        own[name] = _with_braces(value, index)
        origins["model", "coordinates", name] = ("model", REPEAT, index, key)
    model = dict(section)
    others = model.get("coordinates", {})
    if isinstance(others, Mapping):
        model["coordinates"] = {**own, **others}
    else:
        report.add_malformed(("model", "coordinates"), f"stands under `{REPEAT}`, too", at_key=True)
    model[REPEAT] = {index: [1, count]}
    given = model.get("parameters", {})
    if isinstance(given, Mapping):
        known = {**dict.fromkeys(map(str, others)), **given}
        walls = {name: 0.0 for name in _walls(own, count) if name not in known}
        model["parameters"] = {**walls, **given}
    content = {**data, "model": model}
    if isinstance(starts := data.get("initial"), Mapping):
        content["initial"] = {}
        for key, value in starts.items():
            name = _with_braces(key, index)
            content["initial"][name] = value if name == key else _with_braces(value, index)
            origins["initial", name] = ("initial", key)
    report.source = replace(source, data=content, origins=origins)
    return report.source


def _with_braces(written: Any, index: str) -> Any:
    """Return a text, or a mapping with its texts, with the index in braces."""
    if isinstance(written, Mapping):
        return {
            _with_braces(key, index): _with_braces(value, index) for key, value in written.items()
        }
    if not isinstance(written, str):
        return written
    behind = re.compile(rf"(?<=\w)_(?:{index}(?!\w)|\(\s*{index}\s*([+-]\s*\d+)?\s*\))")
    braced = behind.sub(lambda found: f"_{{{index}{found[1] or ''}}}", written)
    return re.sub(rf"(?<![\w{{]){index}(?![\w}}(])", f"{{{index}}}", braced)


def _walls(chain: Mapping[str, Any], count: int) -> Iterator[str]:
    """Yield the names beyond both ends that the formulas of a chain of so many hold."""
    for own in chain.values():
        for text in own.values() if isinstance(own, Mapping) else (own,):
            for name, sign, steps in _BEYOND.findall(str(text)):
                beyond = range(count + 1, count + 1 + int(steps)) if sign == "+" else [0]
                yield from (f"{name}{number}" for number in beyond)
