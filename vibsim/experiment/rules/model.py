"""From the section ``model`` to an equation of motion: what formulas may name, and whether they fit together."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.experiment.data import TableSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.fields import DECLARED, TABLE, Section
from vibsim.experiment.schema.model_and_schemes import name_fault
from vibsim.experiment.tables.file import ENDINGS, TableError, read
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import (
    MAX_CHARACTERS,
    ONE,
    Binary,
    Expression,
    ExpressionError,
    derivative,
    evaluate,
    is_zero,
    names_in,
    parse,
    size,
    values,
    walk,
)
from vibsim.formula.integral import has_rule
from vibsim.models import FormulaField, Model, tree
from vibsim.models.oscillator import COULOMB

NONE = "none"
"""Stands for a term that is left out, where others have words as well."""
AMPLITUDES = (-6, 8)
"""Powers of 2, from and to, of the amplitudes at which a potential energy is compared with its spring."""
MAX_NODES = 5000
"""Operations and names of an equation with its slopes and energies: compiling takes about 3 ms of each."""
PANELS, POINTS = 32, 16
"""Panels of an amplitude, and points of each."""
AGREE = 1e-9
"""How far both may differ, relative to the largest energy."""


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


def equation(
    section: Any, model: Model | None, swept: Collection[str], folder: Path, report: Report
) -> Equation:
    """Check the section of a `model` of the registry, and fill in what it leaves out.

    Parameters
    ----------
    section
        As pydantic read it; None where that found a fault.
    swept
        Dotted keys that the file sweeps.
    folder
        Where the paths of tables begin.
    """
    if section is None or model is None:
        # what follows from formulas is known only with all of them
        return Equation(model if model is not None and model.written is None else None)
    parameters = {row.name: getattr(section, row.name) for row in model.parameters}
    found = Equation(model, parameters)
    if model.written is not None:
        found = _written(section, model, parameters, folder, report)
    if found.model is None or found.model.variant is None or not found.parameters:
        return found
    neutral = {row.name: row.neutral for row in found.model.parameters}
    terms = tuple(
        name
        for name in found.model.optional
        if found.parameters[name] != neutral[name] or f"model.{name}" in swept
    )
    return replace(found, model=found.model.variant(frozenset(terms)), terms=terms)


def _written(
    section: Any, model: Model, parameters: dict[str, float], folder: Path, report: Report
) -> Equation:
    assert model.written is not None
    declared = _declared(section, model, report)
    texts: dict[str, str] = {}
    tables: dict[str, TableSpec] = {}
    for row in model.formulas:
        value = getattr(section, row.name)
        path: Path_ = ("model", row.name)
        if isinstance(value, Section) and row.table is not None:
            table = _table(row, row.table, value, folder, report)
            tables |= {row.name: table} if table is not None else {}
        elif isinstance(value, Section):
            texts |= _term(row, value, parameters, report)
        elif value is None and row.name in section.model_fields_set:
            report.add(path, "must be a formula, or a number", "leave the key out", at_key=True)
        elif value == NONE and row.terms and NONE not in declared:
            continue
        elif value is not None and _is_sound(value, row, model, declared, path, report):
            texts[row.name] = value.strip()
    if "exact" in texts and section.force is not None:
        rule = "must not be given together with exact, from which it follows"
        report.add(("model", "force"), rule, at_key=True)
    if "exact" in texts and f"damping.{COULOMB}" in parameters:
        rule = "must not be given together with coulomb friction, which may hold the body elsewhere"
        report.add(("model", "exact"), rule, at_key=True)
    if any(fault.key.split(".")[0] == "model" for fault in report.faults):
        return Equation(None)
    parameters |= {f"{DECLARED}.{name}": value for name, value in declared.items()}
    exact = next((name for name in texts if name.startswith("exact")), "exact")
    try:
        found = model.written(texts, tuple(declared))
        for spec in tables.values():
            assert found.with_table is not None
            found = found.with_table(spec.table, False)
        _check_length(found)
    except ExpressionError as error:
        # an error without a text speaks of the longest formula
        longest = max(texts, key=lambda name: len(texts[name]), default="kind")
        name = exact if error.text else longest
        report.add(("model", name), error.rule, error.hint, texts.get(name, error.text))
        return Equation(None)
    keys = {row.key for row in found.parameters}
    for name in sorted(section.model_fields_set & (parameters.keys() - keys)):
        rule = "has no meaning beside an exact solution, on which the motion starts"
        report.add(("model", name), rule, "leave it out", parameters[name], at_key=True)
    parameters = {key: value for key, value in parameters.items() if key in keys}
    for name, value in (found.start(parameters) if found.start else {}).items():
        if not np.isfinite(value):
            rule = f"must have a finite value at t = 0, where {name} is {value:g}"
            report.add(("model", exact), rule, value=texts.get(exact))
            return Equation(None)
    if any(row.name == "spring" for row in model.formulas):
        _check_potential(found, parameters, texts, report)
    return Equation(found, parameters, texts, tables)


def _table(
    row: FormulaField, keys: tuple[str, str], section: Section, folder: Path, report: Report
) -> TableSpec | None:
    """Return the table that stands in place of a formula; None, and a fault, where it cannot be had.

    The section holds the path, from `folder`, and under `keys` the names of the columns of places and values.
    """
    written: str = getattr(section, TABLE)
    place, value = (getattr(section, key) for key in keys)
    if Path(written).is_absolute():
        rule = "must be a path relative to the folder of the experiment file"
        report.add(("model", row.name, TABLE), rule, value=written)
        return None
    try:
        table, content = read(folder / written, keys, (place, value))
    except TableError as error:
        shown = written if error.key == TABLE else getattr(section, error.key)
        report.add(("model", row.name, error.key), error.rule, error.hint, shown)
        return None
    spec = TableSpec(file=written, place=place, value=value, numbers=table.digest)
    spec.hold(table, content)
    return spec


def _check_length(model: Model) -> None:
    """Refuse an equation that would take long to compile: each call of a function is a page of machine code."""
    accelerations = [tree(model, formula) for formula in model.accelerations]
    states = (*model.positions, *model.velocities)
    slopes = [derivative(formula, name) for formula in accelerations for name in states]
    energies = [tree(model, formula) for formula in (model.kinetic_energy, model.potential_energy)]
    formulas = (*accelerations, *slopes, *energies)
    if sum(size(formula, MAX_NODES) for formula in formulas) > MAX_NODES:
        rule = f"the equation that follows, with its slopes and energies, has more than {MAX_NODES} operations"
        hint = "write a simpler formula, or the energy as `potential` where the model has that"
        raise ExpressionError("", 0, rule, hint)


def _declared(section: Any, model: Model, report: Report) -> dict[str, float]:
    taken = {state.name: f"the {state.long_name}" for state in model.states}
    taken |= {"t": "the time"}
    taken |= {row.name: f"the {row.description} of the model" for row in model.parameters}
    if any(row.terms and isinstance(getattr(section, row.name), Section) for row in model.formulas):
        taken["b"] = "the coefficient of the damping"
    found = {}
    for name, value in section.parameters.items():
        fault = name_fault(name, taken)
        if fault:
            report.add(("model", "parameters", name), fault, "choose another name", at_key=True)
        else:
            found[name] = value
    return found


def _term(
    row: FormulaField, value: Section, parameters: dict[str, float], report: Report
) -> dict[str, str]:
    """Return the formula of ``{word: coefficient}``, and put the coefficient among the parameters."""
    given = {word: getattr(value, word) for word in row.terms if getattr(value, word) is not None}
    if len(given) != 1:
        rule = f"must have one of {', '.join(row.terms)}, or be a formula"
        report.add(("model", row.name), rule)
        return {}
    ((word, coefficient),) = given.items()
    if word == COULOMB and coefficient < 0.0:
        rule = "must be at least 0: friction opposes the motion"
        report.add(("model", row.name, word), rule, value=coefficient)
    parameters[f"{row.name}.{word}"] = coefficient
    return {row.name: row.terms[word]}


def _is_sound(
    text: str,
    row: FormulaField,
    model: Model,
    declared: Mapping[str, float],
    path: Path_,
    report: Report,
) -> bool:
    """Tell whether a formula can be read; note its fault otherwise."""
    known = (*row.names, *(own.name for own in model.parameters), *declared)
    try:
        read_tree = parse(text, known)
    except ExpressionError as error:
        place = f" at character {error.position + 1}" if error.position < MAX_CHARACTERS else ""
        rule = f"{error.rule}{place}"
        if error.rule.startswith("unknown name"):
            rule += f"; it may name {', '.join(row.names)} and parameters"
        is_file = row.table is not None and text.lower().endswith(ENDINGS)
        hint = f"for a table write {{{TABLE}: {text}}}" if is_file else error.hint
        report.add(path, rule, hint, text)
        return False
    if row.terms and not is_zero(read_tree) and set(row.names).isdisjoint(names_in(read_tree)):
        rule = f"does not depend on {row.names[0]}: it is a constant force, and no {row.name}"
        report.add(path, rule, f"write ({text})*{row.names[0]}", text)
        return False
    try:
        for part in walk(read_tree):
            if not names_in(part):
                evaluate(part, {})
            if isinstance(part, Binary) and part.operator == "/" and not names_in(part.right):
                # u/0, which is no constant
                evaluate(Binary("/", ONE, part.right), {})
    except ExpressionError as error:
        report.add(path, f"a constant in it {error.rule}", error.hint, text)
        return False
    return True


def _check_potential(
    model: Model, parameters: Mapping[str, float], texts: Mapping[str, str], report: Report
) -> None:
    """Compare the potential energy with the work of the spring between half and whole amplitudes."""
    names = (model.position, *(row.name for row in model.parameters))
    numbers = {row.name: parameters[row.key] for row in model.parameters}
    spring = parse(texts.get("spring", model.position), names)
    potential = tree(model, model.potential_energy)
    is_given = "potential" in texts
    size = 2.0 ** np.arange(*AMPLITUDES)
    u = np.concatenate([-size, size])
    with np.errstate(all="ignore"):
        coarse, work = (_work(spring, numbers, model.position, u, n) for n in (PANELS, 2 * PANELS))
        energy = [values(potential, {**numbers, model.position: x}) for x in (u, 0.5 * u)]
        scale = np.abs(work) + np.abs(energy[0]) + np.abs(energy[1])
        # the work across a corner or a pole is not known so well
        is_known = np.abs(work - coarse) <= 0.1 * AGREE * scale
        is_right = np.abs(energy[0] - energy[1] - work) <= AGREE * scale
    is_compared = is_known & np.isfinite(energy).all(axis=0)
    wrong = is_compared & ~is_right
    if is_given and wrong.any():
        rule = f"is not the integral of the spring: its slope differs near u = {u[wrong][0]:.3g}"
        report.add(("model", "potential"), rule, value=texts["potential"])
    elif is_given and not is_compared.any():
        rule = "cannot be compared with the spring: one of them has a value nowhere"
        report.add(("model", "potential"), rule, value=texts["potential"])
    elif not is_given and not has_rule(spring, model.position):
        wrong = np.isfinite(work) & ~(is_known & is_right)
        if wrong.any():
            rule = "its potential energy cannot be worked out: it has corners, is singular or varies fast"
            hint = "write the energy as `potential`, a formula whose slope is the spring"
            report.add(("model", "spring"), rule, hint)


def _work(
    spring: Expression, numbers: Mapping[str, float], position: str, u: Floats, panels: int
) -> Floats:
    """Return the integral of the spring from u/2 to u, by Gauss and Legendre's rule in every panel."""
    place, weight = np.polynomial.legendre.leggauss(POINTS)
    middle = (2.0 * np.arange(panels)[:, None] + 1.0 + place) / (2.0 * panels)
    places = u[:, None, None] * (0.5 + 0.5 * middle)
    force = np.broadcast_to(values(spring, {**numbers, position: places}), places.shape)
    found: Floats = 0.5 / (2.0 * panels) * u * np.sum(weight * force, axis=(1, 2))
    return found
