"""From the section ``model`` of a structure to its equation of motion."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from vibsim.experiment.data import ArraySpec, StructureSpec
from vibsim.experiment.faults import MISSING, Report
from vibsim.experiment.schema.fields import DECLARED
from vibsim.experiment.schema.structure import Mode, ShapedLoad
from vibsim.experiment.tables.structure import MATRICES, Assembly, assemble, with_digests
from vibsim.models import Model
from vibsim.models.structure import LOAD, MOST_OBSERVED, RAYLEIGH
from vibsim.models.system import name_fault, velocities_of

Formulas = dict[str, tuple[str, tuple[str | int, ...]]]
"""By key the text of a formula, and where it stands."""


def read_structure(
    section: Any, folder: Path, report: Report
) -> tuple[StructureSpec | None, Formulas]:
    """Return what a section says of a structure, with the numbers of its files, and the formulas of its loads."""
    arrays = {
        key: _array(value) for key in MATRICES if (value := getattr(section, key)) is not None
    }
    if section.stiffness is None:
        if any(section.model_fields_set - {"kind", DECLARED}):
            report.add(("model", "stiffness"), MISSING)
            return None, {}
        # nothing but the kind: one mass on one spring
        arrays["stiffness"] = ArraySpec(rows=((1.0,),))
    formulas = _loads(section, arrays, report)
    for name in ("displacement", "velocity"):
        value = getattr(section.start, name) if section.start is not None else None
        if value is not None:
            arrays[f"start.{name}"] = _array(value)
    _check_numbers(arrays, report)
    spec = StructureSpec(
        arrays=arrays,
        observe=_observed(section, report),
        is_free=section.observe is None and section.start is None,
    )
    if report.faults and any(fault.key.split(".")[0] == "model" for fault in report.faults):
        return None, formulas
    if section.observe is None or isinstance(section.damping_ratios, float):
        spec = _completed(section, spec, folder, report)
    elif section.damping_ratios is not None:
        spec = spec.model_copy(update={"ratios": tuple(section.damping_ratios)})
    own = assemble(spec, folder)
    _tell(own, report)
    return (with_digests(spec, own) if own.structure is not None else None), formulas


def _array(value: Any) -> ArraySpec:
    if isinstance(value, str):
        return ArraySpec(file=value)
    if isinstance(value, Mode):
        return ArraySpec(mode=value.mode, size=value.size)
    if isinstance(value, Mapping):
        # what is no number of a degree of freedom is told of later
        entries = ((int(dof) if dof.isdigit() else 0, number) for dof, number in value.items())
        return ArraySpec(entries=tuple(sorted(entries)))
    return ArraySpec(rows=tuple(value))


def _check_numbers(arrays: Mapping[str, ArraySpec], report: Report) -> None:
    """Refuse a key that is no number of a degree of freedom."""
    for key, row in arrays.items():
        if any(dof < 1 for dof, _ in row.entries):
            rule = "the keys must be numbers of degrees of freedom, counted from 1"
            report.add(("model", *_path(key)), rule, at_key=True)


def _loads(section: Any, arrays: dict[str, ArraySpec], report: Report) -> Formulas:
    """Return the formulas of the loads, and put their shapes among the arrays."""
    load = section.load
    if load is None:
        return {}
    if isinstance(load, ShapedLoad):
        arrays[f"{LOAD}.0"] = _array(load.shape)
        return {f"{LOAD}.0": (load.times.strip(), ("model", LOAD, "times"))}
    found: Formulas = {}
    for i, (dof, text) in enumerate(load.items()):
        path = ("model", LOAD, dof)
        if not dof.isdigit() or int(dof) < 1:
            rule = "must be the number of a degree of freedom, counted from 1"
            report.add(path, rule, "or write {shape: ..., times: ...}", at_key=True)
            continue
        arrays[f"{LOAD}.{i}"] = ArraySpec(entries=((int(dof), 1.0),))
        found[f"{LOAD}.{i}"] = text.strip(), path
    return found


def _observed(
    section: Any, report: Report
) -> tuple[tuple[str, tuple[tuple[int, float], ...]], ...]:
    if section.observe is None:
        return ()
    if len(section.observe) > MOST_OBSERVED:
        rule = f"must not have more than {MOST_OBSERVED} names, has {len(section.observe)}"
        report.add(("model", "observe"), rule, at_key=True)
    found = []
    taken: list[str] = ["t", *(row.name for row in RAYLEIGH)]
    names = tuple(section.observe)
    for (name, what), velocity in zip(section.observe.items(), velocities_of(names), strict=True):
        fault = next((f for f in (name_fault(x, tuple(taken)) for x in (name, velocity)) if f), "")
        if fault:
            report.add(("model", "observe", name), fault, "choose another name", at_key=True)
        taken += [name, velocity]
        row = _array(what) if isinstance(what, Mapping) else ArraySpec(entries=((what, 1.0),))
        if any(dof < 1 for dof, _ in row.entries):
            rule = "the keys must be numbers of degrees of freedom, counted from 1"
            report.add(("model", "observe", name), rule, at_key=True)
        found.append((name, row.entries))
    return tuple(found)


def _completed(section: Any, spec: StructureSpec, folder: Path, report: Report) -> StructureSpec:
    """Name every degree of freedom where nothing is observed by name, and give every mode its damping ratio."""
    only = spec.model_copy(
        update={
            "arrays": type(spec.arrays)(
                {key: row for key, row in spec.arrays.items() if key == "stiffness"}
            ),
        }
    )
    matrices = Assembly(only, folder).matrices()
    size = matrices["stiffness"].size if matrices else 0
    update: dict[str, Any] = {}
    if section.observe is None:
        if size > MOST_OBSERVED:
            rule = f"must be given above {MOST_OBSERVED} degrees of freedom, there are {size}"
            report.add(("model", "observe"), rule, f"e.g. {{tip: {size}}}")
        names = ("u",) if size == 1 else tuple(f"u{i}" for i in range(1, size + 1))
        each = (((i, 1.0),) for i in range(1, size + 1))
        update["observe"] = tuple(zip(names, each, strict=True))[:MOST_OBSERVED]
    ratios = section.damping_ratios
    if ratios is not None:
        update["ratios"] = (ratios,) * size if isinstance(ratios, float) else tuple(ratios)
    return spec.model_copy(update=update)


def _path(key: str) -> tuple[str | int, ...]:
    """Return where an array stands in the section ``model``."""
    head, *rest = key.split(".")
    return (LOAD, "shape", *rest[1:]) if head == LOAD else (head, *rest)


def _tell(own: Assembly, report: Report) -> None:
    """Put the faults of a structure where they belong."""
    for key, rule, hint in own.faults:
        path: tuple[str | int, ...] = ("model", *_path(key))
        if key.startswith(f"{LOAD}.") and report.source.place(("model", LOAD, "shape")) is None:
            # a load of one degree of freedom, under its number
            path = ("model", LOAD, key.rpartition(".")[2])
        row = own.spec.arrays.get(key)
        report.add(path, rule, hint, row.file if row is not None else None)


def terms_of_damping(
    model: Model, parameters: Mapping[str, float], swept: Collection[str]
) -> tuple[str, ...]:
    """Return the names of the parameters of Rayleigh damping that are in the equation."""
    keys = {row.name: row.key for row in RAYLEIGH if row.name in model.optional}
    return tuple(name for name, key in keys.items() if parameters[key] or f"model.{key}" in swept)
