"""From the section ``model`` to an equation of motion: whether its formulas and parameters fit together."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.experiment.data import StructureSpec, TableSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.kinds import COORDINATES
from vibsim.experiment.rules.formulas import NAME, declared_parameters, is_sound, read_formulas
from vibsim.experiment.rules.potential import NOT_FOUND, check_potential, note_potential
from vibsim.experiment.rules.structure import read_structure, terms_of_damping
from vibsim.experiment.schema.fields import AT, DECLARED, Section
from vibsim.formula import (
    ExpressionError,
    derivative,
    parts_of,
)
from vibsim.models import FormulaField, Model, tree
from vibsim.models.base import rate
from vibsim.models.events import Crossings
from vibsim.models.oscillator import COULOMB
from vibsim.models.shared.crossings import is_crossing
from vibsim.models.structure import RAYLEIGH
from vibsim.models.system import coordinate_faults

EVENTS = "events or a stop"
HOLDS = "coulomb friction, which may hold the body elsewhere"
MAX_NODES = 20_000
"""Distinct parts of an equation with its slopes and energies: compiling takes 1 to 2 ms for each."""


@dataclass(frozen=True)
class Equation:
    """What a section says, as far as it is sound."""

    model: Model | None
    """The equation of motion; None where it is not known, because the kind or a formula is at fault."""
    parameters: dict[str, float] = field(default_factory=dict)
    formulas: dict[str, str] = field(default_factory=dict)
    tables: dict[str, TableSpec] = field(default_factory=dict)
    terms: tuple[str, ...] = ()
    """Which of `Model.optional` the equation has."""
    structure: StructureSpec | None = None


def are_known(model: Model, parameters: Mapping[str, float]) -> bool:
    """Tell whether every parameter of a model has a value; without some it may have none at all."""
    return len(parameters) >= len(model.parameters)


def equation(
    section: Any, model: Model | None, swept: Collection[str], folder: Path, report: Report
) -> Equation:
    """Check the section of a `model` of the registry (None where it is malformed), and fill in what it leaves out.

    `swept` holds the dotted keys that the file sweeps; the paths of tables begin in `folder`.
    """
    if section is not None and model is None:
        for i, fault in enumerate(coordinate_faults(getattr(section, COORDINATES, ()))):
            if fault:
                report.add(("model", COORDINATES, i), fault, "choose another name")
    if section is None or model is None:
        # what follows from formulas is known only with all of them
        return Equation(model if model is not None and model.written is None else None)
    if model.loaded is not None:
        found = _structure(section, model, swept, folder, report)
        _note_unused(section, found, report)
        return found
    parameters = {row.name: getattr(section, row.name) for row in model.parameters}
    found = Equation(model, parameters)
    if model.written is not None:
        found = _written(section, model, parameters, folder, report)
        _note_unused(section, found, report)
    if found.model is None:
        return found
    neutral = {row.name: row.neutral for row in found.model.parameters}
    terms = tuple(
        name
        for name in found.model.optional
        if found.parameters[name] != neutral[name] or f"model.{name}" in swept
    )
    return replace(found, model=found.model.with_terms(terms), terms=terms)


def _note_unused(section: Any, found: Equation, report: Report) -> None:
    """Note declared parameters that no formula names."""
    if found.model is None:
        return
    used = {name for text in found.formulas.values() for name in NAME.findall(text)}
    for name in section.parameters:
        if name not in used:
            report.note(("model", DECLARED, name), "no formula names it", "leave it out")


def _structure(
    section: Any, model: Model, swept: Collection[str], folder: Path, report: Report
) -> Equation:
    """Return the equation of a structure."""
    parameters = {
        row.key: float(getattr(section.rayleigh, row.name, row.default)) for row in RAYLEIGH
    }
    declared = declared_parameters(section, model, report)
    spec, loads = read_structure(section, folder, report)
    field = FormulaField("load", ("t",), "", "load")
    known = (*(row.name for row in RAYLEIGH), *declared)
    for text, path in loads.values():
        is_sound(text, field, path, known, report)
    if spec is None or report.doubts_model:
        return Equation(None)
    texts = {key: text for key, (text, _) in loads.items()}
    found = model.with_formulas(texts, tuple(declared), spec.structure)
    parameters |= {f"{DECLARED}.{name}": value for name, value in declared.items()}
    terms = terms_of_damping(found, parameters, swept)
    return Equation(found.with_terms(terms), parameters, texts, terms=terms, structure=spec)


def _written(
    section: Any, model: Model, parameters: dict[str, float], folder: Path, report: Report
) -> Equation:
    """Return the equation of a model whose formulas the section has."""
    declared = declared_parameters(section, model, report)
    texts, coefficients, tables = read_formulas(section, model, declared, folder, report)
    parameters = parameters | coefficients
    exact = next((name for name in texts if name.startswith("exact")), "")
    _check_together(section, texts, exact, f"damping.{COULOMB}" in parameters, report)
    if report.doubts_model:
        return Equation(None)
    parameters |= {f"{DECLARED}.{name}": value for name, value in declared.items()}
    try:
        numbers = (spec.table for spec in tables.values())
        found = model.with_formulas(texts, tuple(declared), *numbers)
        _check_length(found)
    except ExpressionError as error:
        # an error without a text speaks of the longest formula
        longest = max(texts, key=lambda name: len(texts[name]), default="kind")
        name = exact if error.text and exact else longest
        path = ("model", *name.split("."))
        report.add(path, error.rule, error.hint, texts.get(name, error.text))
        return Equation(None)
    keys = {row.key for row in found.parameters}
    for name in sorted(section.model_fields_set & (parameters.keys() - keys)):
        rule = "has no meaning beside an exact solution, on which the motion starts"
        report.add(("model", name), rule, "leave it out", parameters[name], at_key=True)
    parameters = {key: value for key, value in parameters.items() if key in keys}
    for name, value in (found.start(parameters) if found.start else {}).items():
        if not np.isfinite(value):
            rule = f"must have a finite value at t = 0, where {name} is {value:g}"
            report.add(("model", *exact.split(".")), rule, value=texts.get(exact))
            return Equation(None)
    if found.misses_potential:
        hint = "energies are kinetic alone; write `potential`, if the forces have one"
        report.note(("model",), NOT_FOUND, hint)
    if any(row.name == "spring" for row in model.formulas):
        check_potential(found, parameters, texts, report)
    elif any(name.startswith("potential.") for name in texts):
        note_potential(found, parameters, report)
    return Equation(found, parameters, texts, tables)


def _check_together(
    section: Any, texts: Mapping[str, str], exact: str, has_friction: bool, report: Report
) -> None:
    """Refuse what cannot stand side by side: an exact solution, a force, friction, and events."""
    friction, is_followed = f"damping.{COULOMB}", "exact" in texts
    has_events = any(map(is_crossing, texts))
    has_force = is_followed and section.force is not None
    leaves = "the motion leaves the exact solution at an event"
    tabled = [name for name in texts if isinstance(getattr(section, name, None), Section)]
    tabled = [name for name in tabled if hasattr(getattr(section, name), AT)]
    other = "an exact solution" if exact else EVENTS
    pairs = (
        ("force", has_force, "exact, from which it follows", ""),
        ("exact", is_followed and has_friction, HOLDS, ""),
        ("exact", has_events and exact, EVENTS, leaves),
        *((name, exact or has_events, other, "") for name in tabled),
        (friction, has_events and has_friction, EVENTS, "friction has events of its own"),
    )
    for key, are_together, other, why in pairs:
        if are_together:
            rule = f"must not be given together with {other}"
            report.add(("model", *key.split(".")), rule, why, at_key=True)


def _check_length(model: Model) -> None:
    """Refuse an equation that would take long to compile: each call of a function is a page of machine code."""
    accelerations = [tree(model, formula) for formula in model.accelerations]
    states = {*model.positions, *model.velocities}
    slopes = [
        derivative(formula, name)
        for formula in accelerations
        for name in formula.names
        if name in states
    ]
    energies = [tree(model, formula) for formula in (model.kinetic_energy, model.potential_energy)]
    formulas = (*accelerations, *slopes, *energies)
    if isinstance(model.events, Crossings):
        rows = model.events.rows
        guards = [tree(model, row.guard) for row in rows]
        formulas += (*guards, *(rate(model, guard) for guard in guards))
        formulas += tuple(tree(model, value) for row in rows for _, value in row.then)
    if len(parts_of(*formulas)) > MAX_NODES:
        rule = f"the equation that follows, with its slopes and energies, has more than {MAX_NODES} operations"
        hint = "write a simpler formula, or the energy as `potential` where the model has that"
        raise ExpressionError("", 0, rule, hint)
