"""A linear structure in words, and as the section of an experiment file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from vibsim.models.structure import HISTORY, LOAD, Loaded
from vibsim.report import words
from vibsim.report.types import ArraySpec, StructureSpec

MOST_SHOWN = 6  # most natural frequencies and damping ratios that are listed
WORDS = {"mass": "M", "stiffness": "K", "damping": "C"}


def as_written(spec: StructureSpec, formulas: Mapping[str, str]) -> dict[str, Any]:
    """Return the content of the section ``model`` apart from kind, Rayleigh damping and parameters."""
    node: dict[str, Any] = {key: _array(row) for key, row in spec.arrays.items() if "." not in key}
    if spec.ratios:
        is_same = len(set(spec.ratios)) == 1 and len(spec.ratios) > 1
        node["damping_ratios"] = spec.ratios[0] if is_same else spec.ratios
    shapes = {key: row for key, row in spec.arrays.items() if key.startswith(f"{LOAD}.")}
    if shapes:
        factors = {key: formulas.get(key) or _table(spec, key) for key in shapes}
        rows = [(row.entries, factors[key]) for key, row in shapes.items()]
        if all(len(entries) == 1 and entries[0][1] == 1.0 for entries, _ in rows):
            node[LOAD] = {str(entries[0][0]): factor for entries, factor in rows}
        else:
            ((key, row),) = shapes.items()
            node[LOAD] = {"shape": _array(row), "times": factors[key]}
    for key, row in spec.arrays.items():
        if key.startswith("start."):
            node.setdefault("start", {})[key.removeprefix("start.")] = _array(row)
    if not spec.is_free:
        node["observe"] = {name: _entries(entries) for name, entries in spec.observe}
    return node


def _table(spec: StructureSpec, key: str) -> dict[str, Any]:
    """Return the table of a load, as the file has it."""
    row = spec.arrays[f"{HISTORY}.{key.partition('.')[2]}"]
    assert row.columns is not None
    return {"table": row.file, **dict(zip(("t", "p"), row.columns, strict=True))}


def _array(row: ArraySpec) -> Any:
    if row.file is not None:
        return row.file
    if row.mode is not None:
        return {"mode": row.mode, **({"size": row.size} if row.size != 1.0 else {})}
    if row.entries:
        return {str(dof): value for dof, value in row.entries}
    return row.rows


def _entries(entries: tuple[tuple[int, float], ...]) -> Any:
    if len(entries) == 1 and entries[0][1] == 1.0:
        return entries[0][0]
    return {str(dof): value for dof, value in entries}


def rows(spec: StructureSpec, loaded: Loaded) -> Iterator[tuple[str, str]]:
    """Yield the description of a structure as pairs of term and text."""
    structure, facts = loaded.structure, [f"{loaded.structure.dofs} degrees of freedom"]
    for key, word in WORDS.items():
        if (row := spec.arrays.get(key)) is not None and row.file is not None:
            facts.append(f"{word} from {row.file}")
    yield "Structure", ", ".join(facts)
    frequencies = structure.modes.frequencies
    listed = ", ".join(words.number(float(w)) for w in frequencies[:MOST_SHOWN])
    more = ", ..." if len(frequencies) > MOST_SHOWN or structure.dofs > len(frequencies) else ""
    tables = [row.file for key, row in spec.arrays.items() if key.startswith(f"{HISTORY}.")]
    if tables:
        yield "Loads", f"straight between the points of {', '.join(map(str, tables))}"
    yield "Natural frequencies", f"{listed}{more} (radians per unit of time)"
    parts = []
    for name, entries in spec.observe:
        sums = [f"u_{dof}" if x == 1.0 else f"{words.number(x)} u_{dof}" for dof, x in entries]
        parts.append(f"{name} = {' + '.join(sums)}")
    yield "Observed", ", ".join(parts)
    if structure.ratios:
        shown = ", ".join(words.number(x) for x in structure.ratios[:MOST_SHOWN])
        more = ", ..." if len(structure.ratios) > MOST_SHOWN else ""
        yield "Damping ratios", f"{shown}{more} of the lowest modes"
