"""Build the matrices and loads of a structure from its section ``model``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from vibsim.experiment.data import ArraySpec, StructureSpec
from vibsim.experiment.faults import MISSING, Report
from vibsim.experiment.schema.fields import DECLARED, TABLE
from vibsim.experiment.schema.structure import LoadTable, Mode, ShapedLoad
from vibsim.experiment.tables.structure import MATRICES, assemble, with_digests
from vibsim.experiment.yaml.parse import Path_
from vibsim.models.shared.coordinates import name_fault, velocities_of
from vibsim.models.structure import HISTORY, LOAD, MOST_OBSERVED, RAYLEIGH

ROUNDED_END = 1e-9  # relative tolerance of the end of a load table, which the file may have rounded
_DOF = "must be the number of a degree of freedom, counted from 1, its name such as u2, or one that `observe` gives it"
Formulas = dict[str, tuple[str, Path_]]  # formulas by key: text, and path in the file


def read_structure(
    section: Any, folder: Path, report: Report
) -> tuple[StructureSpec | None, Formulas]:
    """Return the structure of a section with the numbers of its files, and the formulas of its loads."""
    arrays = {
        key: _array(value) for key in MATRICES if (value := getattr(section, key)) is not None
    }
    if section.stiffness is None:
        if any(section.model_fields_set - {"kind", DECLARED}):
            report.add(("model", "stiffness"), MISSING)
            return None, {}
        arrays["stiffness"] = ArraySpec(rows=((1.0,),))  # default: one mass on one spring
    observed = _observed(section, report)
    named = {name: row[0][0] for name, row in observed if [factor for _, factor in row] == [1.0]}
    formulas = _loads(section, named, arrays, report)
    for name in ("displacement", "velocity"):
        value = getattr(section.start, name) if section.start is not None else None
        if value is not None:
            arrays[f"start.{name}"] = _array(value, named)
    for key, row in arrays.items():
        if any(dof < 1 for dof, _ in row.entries):
            report.add(_place(key, report), f"each key {_DOF}", at_key=True)
    ratios = section.damping_ratios
    spec = StructureSpec(
        arrays=arrays,
        ratios=ratios if isinstance(ratios, tuple) else (),
        observe=observed,
        is_free=section.observe is None and section.start is None,
    )
    if report.has_faulty_model:
        return None, formulas
    assembled = assemble(spec, folder, ratios if isinstance(ratios, float) else None)
    if dofs := assembled.unnamed:
        rule = f"must be given above {MOST_OBSERVED} degrees of freedom, there are {dofs}"
        report.add(("model", "observe"), rule, f"e.g. {{tip: {dofs}}}")
    for key, rule, hint in assembled.faults:
        shown = arrays[key].file if key in arrays else None
        report.add(_place(key, report), rule, hint, shown)
    return (with_digests(assembled) if assembled.structure is not None else None), formulas


def _dof(text: str, named: Mapping[str, int]) -> int:
    """Return the number of a degree of freedom from its name; 0 of none."""
    number = re.fullmatch("u?([1-9][0-9]*)", text)
    return named.get(text, int(number[1]) if number else 0)


def _array(value: Any, named: Mapping[str, int] = MappingProxyType({})) -> ArraySpec:
    if isinstance(value, str):
        return ArraySpec(file=value)
    if isinstance(value, Mode):
        return ArraySpec(mode=value.mode, size=value.size)
    if isinstance(value, Mapping):
        # 0 marks an invalid degree of freedom, which is reported later
        entries = ((_dof(dof, named), number) for dof, number in value.items())
        return ArraySpec(entries=tuple(sorted(entries)))
    return ArraySpec(rows=tuple(value))


def _loads(
    section: Any, named: Mapping[str, int], arrays: dict[str, ArraySpec], report: Report
) -> Formulas:
    """Return the formulas of the loads, and add their shapes and tables to `arrays`."""
    load = section.load
    if load is None:
        return {}
    formulas: Formulas = {}

    def add_factor(number: int, factor: Any, path: Path_) -> None:
        if isinstance(factor, LoadTable):
            spec = ArraySpec(file=factor.table, columns=(factor.t, factor.p))
            arrays[f"{HISTORY}.{number}"] = spec
        else:
            formulas[f"{LOAD}.{number}"] = factor.strip(), path

    if isinstance(load, ShapedLoad):
        arrays[f"{LOAD}.0"] = _array(load.shape, named)
        add_factor(0, load.times, ("model", LOAD, "times"))
        return formulas
    for i, (name, factor) in enumerate(load.items()):
        path = ("model", LOAD, name)
        if not (dof := _dof(name, named)):
            report.add(path, _DOF, "or write {shape: ..., times: ...}", at_key=True)
            continue
        arrays[f"{LOAD}.{i}"] = ArraySpec(entries=((dof, 1.0),))
        add_factor(i, factor, path)
    return formulas


def _observed(
    section: Any, report: Report
) -> tuple[tuple[str, tuple[tuple[int, float], ...]], ...]:
    if section.observe is None:
        return ()
    if len(section.observe) > MOST_OBSERVED:
        rule = f"must not have more than {MOST_OBSERVED} names, has {len(section.observe)}"
        report.add(("model", "observe"), rule, at_key=True)
    observed = []
    used: list[str] = ["t", *(row.name for row in RAYLEIGH)]
    names = tuple(section.observe)
    for (name, what), velocity in zip(section.observe.items(), velocities_of(names), strict=True):
        fault = next((f for f in (name_fault(x, tuple(used)) for x in (name, velocity)) if f), "")
        if fault:
            report.add(("model", "observe", name), fault, "choose another name", at_key=True)
        used += [name, velocity]
        row = _array(what) if isinstance(what, Mapping) else ArraySpec(entries=((what, 1.0),))
        if any(dof < 1 for dof, _ in row.entries):
            report.add(("model", "observe", name), f"each key {_DOF}", at_key=True)
        observed.append((name, row.entries))
    return tuple(observed)


def _place(key: str, report: Report) -> Path_:
    """Return the path in the file of the array `key`, which may have a suffix for a value inside it."""
    head, *parts = key.split(".")
    if head not in (LOAD, HISTORY):
        return "model", head, *parts
    number, *suffix = parts
    load = report.source.data["model"][LOAD]
    if "shape" in load:
        return "model", LOAD, "shape" if head == LOAD else "times", *suffix
    # loads by degree of freedom
    return "model", LOAD, str(list(load)[int(number)]), *(suffix if head == HISTORY else ())


def check_histories(spec: StructureSpec, end: float, report: Report) -> None:
    """Refuse a load table that ends before the motion."""
    for number, (times, _) in spec.structure.histories:
        if end > times[-1] * (1.0 + ROUNDED_END):
            rule = f"the table ends at {times[-1]:.10g}, but the motion lasts to {end:.10g}"
            path = _place(f"{HISTORY}.{number}.{TABLE}", report)
            report.add(path, rule, "add the load at the end, 0 if there is none")
