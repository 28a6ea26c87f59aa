"""Build the equation of motion from the section ``model``, and check that its formulas and parameters fit together."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.experiment.data import ModelSpec, StructureSpec, TableSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.kinds import COORDINATES
from vibsim.experiment.rules.formulas import NAME, FormulaReader
from vibsim.experiment.rules.potential import NOT_FOUND, check_potential
from vibsim.experiment.rules.structure import read_structure
from vibsim.experiment.schema.fields import AT, DECLARED, Section
from vibsim.formula import ExpressionError, derivative, parts_of
from vibsim.models import FormulaField, Model, tree
from vibsim.models.base import rate
from vibsim.models.oscillator import COULOMB
from vibsim.models.shared.coordinates import coordinate_faults
from vibsim.models.shared.crossings import is_crossing
from vibsim.models.structure import RAYLEIGH

EVENTS = "events or a stop"
STICTION = "coulomb friction, which may hold the body elsewhere"
MAX_NODES = 20_000
"""Largest number of distinct subexpressions of the equation, its slopes and energies; each compiles in 1 to 2 ms."""


@dataclass(frozen=True)
class Equation:
    """The valid content of a section ``model``."""

    model: Model | None  # the equation of motion; None if the kind or a formula is faulty
    parameters: dict[str, float] = field(default_factory=dict)
    formulas: dict[str, str] = field(default_factory=dict)
    tables: dict[str, TableSpec] = field(default_factory=dict)
    terms: tuple[str, ...] = ()  # the optional terms (`Model.optional`) that the equation contains
    structure: StructureSpec | None = None

    @property
    def valued(self) -> Model | None:
        """The model, if all its parameters have values: with a faulty section there may be none at all."""
        model = self.model
        return model if model and len(self.parameters) >= len(model.parameters) else None

    def spec(self, parameters: Mapping[str, float]) -> ModelSpec:
        """Return an equation without fault as a part of an experiment, with these (scaled) parameters."""
        assert self.model is not None
        return ModelSpec(
            kind=self.model.kind,
            parameters=dict(parameters),
            formulas=self.formulas,
            coordinates=self.model.positions if self.model.named is not None else (),
            tables=self.tables,
            terms=self.terms,
            structure=self.structure,
        )


def equation(
    section: Any, model: Model | None, swept: Collection[str], folder: Path, report: Report
) -> Equation:
    """Return the equation of a section (None if malformed) of the registered `model`, with defaults filled in.

    `swept` holds the dotted keys that the file sweeps. Paths of tables are relative to `folder`.
    """
    if section is not None and model is None:
        for i, fault in enumerate(coordinate_faults(getattr(section, COORDINATES, ()))):
            if fault:
                report.add(("model", COORDINATES, i), fault, "choose another name")
    if section is None or model is None:
        # a model with formulas is known only with all of them
        return Equation(model if model is not None and model.written is None else None)
    if model.loaded is not None:
        result = _equation_of_structure(section, model, folder, report)
    elif model.written is not None:
        result = _equation_of_formulas(section, model, folder, report)
    else:
        result = Equation(model, {row.name: getattr(section, row.name) for row in model.parameters})
    if result.model is None:
        return result
    if model.written is not None:
        _note_unused(section, result.formulas, report)
    rows = {row.name: row for row in result.model.parameters}
    terms = tuple(
        name
        for name, row in ((name, rows[name]) for name in result.model.optional)
        if result.parameters[row.key] != row.neutral or f"model.{row.key}" in swept
    )
    return replace(result, model=result.model.with_terms(terms), terms=terms)


def _note_unused(section: Any, formulas: Mapping[str, str], report: Report) -> None:
    """Warn about declared parameters that no formula uses; walls of a chain are not declared."""
    used = {name for text in formulas.values() for name in NAME.findall(text)}
    for name in section.parameters:
        path = "model", DECLARED, name
        if name not in used and (report.source.origin(path) or path)[1] == DECLARED:
            report.note(path, "no formula names it", "use it, or leave it out")


def _equation_of_structure(section: Any, model: Model, folder: Path, report: Report) -> Equation:
    parameters = {
        row.key: float(getattr(section.rayleigh, row.name, row.default)) for row in RAYLEIGH
    }
    reader = FormulaReader(section, model, report)
    declared = reader.declared
    spec, loads = read_structure(section, folder, report)
    for text, path in loads.values():
        reader.is_valid(text, FormulaField("load", ("t",), "", "load"), path)
    if spec is None or report.has_faulty_model:
        return Equation(None)
    texts = {key: text for key, (text, _) in loads.items()}
    equipped = model.with_formulas(texts, tuple(declared), spec.structure)
    parameters |= {f"{DECLARED}.{name}": value for name, value in declared.items()}
    return Equation(equipped, parameters, texts, structure=spec)


def _equation_of_formulas(section: Any, model: Model, folder: Path, report: Report) -> Equation:
    reader = FormulaReader(section, model, report)
    reader.read(folder)
    declared, texts, tables = reader.declared, reader.texts, reader.tables
    parameters = {row.name: getattr(section, row.name) for row in model.parameters}
    parameters |= reader.coefficients
    exact = next((name for name in texts if name.startswith("exact")), "")
    _check_combinations(section, texts, exact, f"damping.{COULOMB}" in parameters, report)
    if report.has_faulty_model:
        return Equation(None)
    parameters |= {f"{DECLARED}.{name}": value for name, value in declared.items()}
    try:
        numbers = (spec.table for spec in tables.values())
        equipped = model.with_formulas(texts, tuple(declared), *numbers)
        _check_size(equipped)
    except ExpressionError as error:
        # an error without a text is attributed to the longest formula
        longest = max(texts, key=lambda name: len(texts[name]), default="kind")
        name = exact if error.text and exact else longest
        path = ("model", *name.split("."))
        report.add(path, error.rule, error.hint, texts.get(name, error.text))
        return Equation(None)
    keys = {row.key for row in equipped.parameters}
    for name in sorted(section.model_fields_set & (parameters.keys() - keys)):
        rule = "has no meaning beside an exact solution, on which the motion starts"
        report.add(("model", name), rule, "leave it out", parameters[name], at_key=True)
    parameters = {key: value for key, value in parameters.items() if key in keys}
    for name, value in (equipped.start(parameters) if equipped.start else {}).items():
        if not np.isfinite(value):
            rule = f"must have a finite value at t = 0, where {name} is {value:g}"
            report.add(("model", *exact.split(".")), rule, value=texts.get(exact))
            return Equation(None)
    if equipped.misses_potential:
        hint = "energies are kinetic alone; write `potential`, if the forces have one"
        if equipped.coordinates > 1 and any(name.startswith("acceleration.") for name in texts):
            hint += ", and unequal masses by `force` and `mass`"
        report.note(("model",), NOT_FOUND, hint)
    if any(row.name == "spring" for row in model.formulas):
        check_potential(equipped, parameters, texts, report)
    return Equation(equipped, parameters, texts, tables)


def _check_combinations(
    section: Any, texts: Mapping[str, str], exact: str, has_friction: bool, report: Report
) -> None:
    """Refuse invalid combinations of an exact solution, a force, friction, and events."""
    friction, is_followed = f"damping.{COULOMB}", "exact" in texts
    has_events = any(map(is_crossing, texts))
    has_force = is_followed and section.force is not None
    why_no_events = "the motion leaves the exact solution at an event"
    tabled = [name for name in texts if isinstance(getattr(section, name, None), Section)]
    tabled = [name for name in tabled if hasattr(getattr(section, name), AT)]
    other = "an exact solution" if exact else EVENTS
    pairs = (
        ("force", has_force, "exact, from which it follows", ""),
        ("exact", is_followed and has_friction, STICTION, ""),
        ("exact", has_events and exact, EVENTS, why_no_events),
        *((name, exact or has_events, other, "") for name in tabled),
        (friction, has_events and has_friction, EVENTS, "friction has events of its own"),
    )
    for key, is_invalid, other, hint in pairs:
        if is_invalid:
            rule = f"must not be given together with {other}"
            report.add(("model", *key.split(".")), rule, hint, at_key=True)


def _check_size(model: Model) -> None:
    """Raise `ExpressionError` if the equation is too long to compile: each call is a page of machine code."""
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
    rows = model.events.rows if model.events else ()
    guards = [tree(model, row.guard) for row in rows]
    formulas += (*guards, *(rate(model, guard) for guard in guards))
    formulas += tuple(tree(model, value) for row in rows for _, value in row.then)
    if len(parts_of(*formulas)) > MAX_NODES:
        rule = f"the equation that follows, with its slopes and energies, has more than {MAX_NODES} operations"
        hint = "write a simpler formula, or the energy as `potential` where the model has that"
        raise ExpressionError("", 0, rule, hint)
