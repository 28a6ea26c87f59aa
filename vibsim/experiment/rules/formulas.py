"""The formulas of a section ``model``: the names that each may use, and what may replace it."""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.core.errors import nearest
from vibsim.experiment.data import TableSpec
from vibsim.experiment.faults import MISSING, Report
from vibsim.experiment.rules.crossings import read_crossings
from vibsim.experiment.schema.fields import AT, DECLARED, TABLE, Section
from vibsim.experiment.tables.content import TableError
from vibsim.experiment.tables.file import ENDINGS, read
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import (
    FUNCTIONS,
    ONE,
    Binary,
    ExpressionError,
    derivative,
    evaluate,
    is_multiple,
    is_zero,
    parse,
    values,
    walk,
)
from vibsim.models import FormulaField, Model
from vibsim.models.oscillator import COULOMB
from vibsim.models.shared.coordinates import name_fault
from vibsim.models.structure import RAYLEIGH

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
NONE = "none"
"""Word for an absent term, for fields that take words."""
MOST_NAMED = 8
"""Largest number of names listed in a message."""


def declared_parameters(section: Any, model: Model, report: Report) -> dict[str, float]:
    """Return the parameters that a section declares, without those whose name is invalid or already used."""
    used = {"t": "the time"}
    used |= {state.name: f"the {state.long_name}" for state in model.states}
    used |= {row.name: f"the {row.description} of the model" for row in model.parameters}
    if model.loaded is not None:
        # formulas of a structure name no states
        used = {"t": "the time"} | {row.name: f"the {row.description}" for row in RAYLEIGH}
    if any(row.terms and isinstance(getattr(section, row.name), Section) for row in model.formulas):
        used["b"] = "the coefficient of the damping"
    declared = {}
    for name, value in section.parameters.items():
        fault = f"'{name}' is {used[name]}" if name in used else ""
        if keyword.iskeyword(name):
            fault = f"'{name}' is a word of the grammar of formulas and cannot be a name"
        elif not NAME.fullmatch(name):
            fault = "a name must consist of letters, digits and _, and begin with a letter"
        elif name in FUNCTIONS:
            fault = f"'{name}' is a function"
        if fault:
            report.add(("model", DECLARED, name), fault, "choose another name", at_key=True)
        else:
            declared[name] = value
    return declared


def read_formulas(
    section: Any, model: Model, declared: Mapping[str, float], folder: Path, report: Report
) -> tuple[dict[str, str], dict[str, float], dict[str, TableSpec]]:
    """Return the formulas of a section, the coefficients of terms given by a word, and the tables, each by key.

    `declared` holds the parameters that the section declares.
    """
    known = (*(row.name for row in model.parameters), *declared)
    texts: dict[str, str] = {}
    coefficients: dict[str, float] = {}
    tables: dict[str, TableSpec] = {}
    looked_up = {row.name for row in model.formulas if row.tabled and getattr(section, row.name)}
    for name in looked_up & {*(state.name for state in model.states), *declared}:
        rule = "a table is looked up under that name, which is already in use"
        report.add(("model", name), rule, "rename the state or the parameter", at_key=True)
    for row in model.formulas:
        value = getattr(section, row.name)
        if row.of:
            names = (*known, *looked_up) if "t" in row.names else known
            texts |= _named_formulas(row, value, model, names, report)
        elif isinstance(value, Section) and row.table is not None:
            table = _table(row, row.table, value, folder, report)
            tables |= {row.name: table} if table is not None else {}
            at: str = getattr(value, AT, "")
            if row.tabled and _is_linear_in_time(at, ("model", row.name, AT), known, report):
                texts[row.name] = at.strip()
        elif isinstance(value, Section):
            texts |= _term(row, value, coefficients, report)
        elif value is None and row.name in section.model_fields_set:
            rule = "must be a formula, or a number"
            report.add(("model", row.name), rule, "leave the key out", at_key=True)
        elif value == NONE and row.terms and NONE not in declared:
            continue
        elif value is not None and is_valid(value, row, ("model", row.name), known, report):
            texts[row.name] = value.strip()
        _check_companions(row, section, report)
    if model.takes_events:
        texts |= read_crossings(section, model, known, report)
    for row in model.formulas:
        if row.positive:
            _check_positive(row, texts, declared, report)
    return texts, coefficients, tables


def _table(
    row: FormulaField, keys: tuple[str, str], section: Section, folder: Path, report: Report
) -> TableSpec | None:
    """Return the table that replaces a formula; report a fault and return None if it cannot be read.

    The section holds the path, relative to `folder`, and under `keys` the names of the columns of abscissae and values.
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


def _is_linear_in_time(text: str, path: Path_, known: Collection[str], report: Report) -> bool:
    """Tell whether the abscissa formula of a table is a constant times t; report a fault otherwise."""
    if not is_valid(text, FormulaField(AT, ("t",), "", ""), path, known, report):
        return False
    place = parse(text, ("t", *known))
    speed = derivative(place, "t")
    if is_zero(speed) or not is_multiple(place, speed, "t"):
        report.add(path, "must be a number times t, from the place 0 on", "e.g. speed*t", text)
        return False
    return True


def _term(
    row: FormulaField, value: Section, coefficients: dict[str, float], report: Report
) -> dict[str, str]:
    """Return the formula of a term ``{word: coefficient}``, and add its coefficient to `coefficients`."""
    given = {word: getattr(value, word) for word in row.terms if getattr(value, word) is not None}
    if len(given) != 1:
        rule = f"must have one of {', '.join(row.terms)}, or be a formula"
        report.add(("model", row.name), rule)
        return {}
    ((word, coefficient),) = given.items()
    if word == COULOMB and coefficient < 0.0:
        rule = "must be at least 0: friction opposes the motion"
        report.add(("model", row.name, word), rule, value=coefficient)
    coefficients[f"{row.name}.{word}"] = coefficient
    return {row.name: row.terms[word]}


def _named_formulas(
    row: FormulaField, written: Any, model: Model, known: Collection[str], report: Report
) -> dict[str, str]:
    """Return the formulas of a field with one per coordinate or output, by field and name: ``acceleration.x``."""
    if written is None:
        return {}
    path: Path_ = ("model", row.name)
    if row.of == "term":
        is_list = isinstance(written, tuple)
        formulas: dict[str, str] = {}
        for i, text in enumerate(written if is_list else (written,)):
            if is_valid(text, row, (*path, i) if is_list else path, known, report):
                formulas[f"{row.name}.{i}"] = text.strip()
        return formulas
    if not isinstance(written, Mapping):
        if model.coordinates > 1 and not row.beside:
            rule = f"must have a formula for each of {shortlist(model.positions)}"
            report.add(path, rule, f"e.g. {{{model.position}: ...}}")
            return {}
        if not is_valid(written, row, path, known, report):
            return {}
        return {f"{row.name}.{name}": written.strip() for name in model.positions}
    if row.paired:
        return _pair_formulas(row, written, model, known, report)
    formulas = {}
    used = [*(state.name for state in model.states), *known]
    for name, text in written.items():
        if row.of == "coordinate" and name not in model.positions:
            hint = nearest(name, list(model.positions))
            report.add((*path, name), "unknown coordinate", hint, at_key=True)
        elif row.of == "output" and (fault := name_fault(name, tuple(used))):
            report.add((*path, name), fault, "choose another name", at_key=True)
        elif is_valid(text, row, (*path, name), known, report):
            formulas[f"{row.name}.{name}"] = text.strip()
        used.append(name)
    missing = [name for name in model.positions if name not in written]
    # a misspelt name is already reported
    is_reported = any(name not in model.positions for name in written)
    if row.of == "coordinate" and missing and not is_reported:
        rule = f"must have a formula for each coordinate, has none for {shortlist(missing)}"
        report.add(path, rule)
    return formulas


def _pair_formulas(
    row: FormulaField,
    written: Mapping[str, Any],
    model: Model,
    known: Collection[str],
    report: Report,
) -> dict[str, str]:
    """Return the formulas of a field with one per pair of coordinates, by field and names: ``mass.x.y``."""
    formulas: dict[tuple[str, ...], str] = {}
    for name, value in written.items():
        if isinstance(value, Mapping):
            formulas |= {(name, other): text for other, text in value.items()}
        else:
            formulas[name,] = value
    valid: dict[str, str] = {}
    for names, text in formulas.items():
        path: Path_ = ("model", row.name, *names)
        unknown = [name for name in names if name not in model.positions]
        if unknown:
            hint = nearest(unknown[0], list(model.positions))
            report.add(path, "unknown coordinate", hint, at_key=True)
        elif names[0] != names[-1] and names[::-1] in formulas and names > names[::-1]:
            rule = f"is that of {names[1]} and {names[0]}, which is given already"
            report.add(path, rule, "leave it out", at_key=True)
        elif is_valid(text, row, path, known, report):
            valid[".".join((row.name, *names))] = text.strip()
    return valid


def shortlist(names: Sequence[str]) -> str:
    """List names for a message, at most `MOST_NAMED`."""
    return ", ".join(names if len(names) <= MOST_NAMED else [*names[: MOST_NAMED - 1], "..."])


def _check_companions(row: FormulaField, section: Any, report: Report) -> None:
    """Report a field given together with one that it replaces, or without one that it needs."""
    keys = section.model_fields_set
    if row.instead_of and not {row.name, row.instead_of} & keys:
        alone = ": `potential` alone makes no forces" if "potential" in keys else ""
        hint = f"write {row.instead_of} or {row.name}{alone}"
        report.add(("model", row.instead_of), MISSING, hint)
    elif row.instead_of and {row.name, row.instead_of} <= keys:
        rule = f"must not be given together with {row.instead_of}"
        report.add(("model", row.name), rule, at_key=True)
    elif row.beside and row.name in keys and row.beside not in keys:
        rule = f"has a meaning beside {row.beside} only"
        report.add(("model", row.name), rule, at_key=True)


def _check_positive(
    row: FormulaField, texts: Mapping[str, str], declared: Mapping[str, float], report: Report
) -> None:
    """Refuse constant formulas whose value is not positive; those of pairs of coordinates may have any sign."""
    for key, text in texts.items():
        field, *names = key.split(".")
        if field == row.name and len(set(names)) == 1:
            formula = parse(text, (*row.names, *declared))
            if not set(formula.names).issubset(declared):
                continue
            value = float(values(formula, declared))
            if not 0.0 < value < np.inf:
                rule = f"must be greater than 0, is {value:g}"
                report.add(("model", *key.split(".")), rule, value=text)


def is_valid(
    text: str, row: FormulaField, path: Path_, known: Collection[str], report: Report
) -> bool:
    """Tell whether a formula of the variables of `row` and `known` parameters is valid; report its fault if not."""
    more = f"; it may name {f'{shortlist(row.names)} and ' if row.names else ''}parameters"
    is_file = row.table is not None and text.lower().endswith(ENDINGS)
    hint = f"for a table write {{{TABLE}: {text}}}" if is_file else ""
    is_oscillator = report.source.data.get("model", {}).get("kind") == "oscillator"
    if is_oscillator and ({"u", "v"} - set(row.names)) & set(NAME.findall(text)):
        hint = (
            "`spring` takes u, `damping` takes v; a force that depends on both takes `kind: system`"
        )
    formula = report.formula(path, text, (*row.names, *known), more, hint)
    if formula is None:
        return False
    if row.terms and not is_zero(formula) and set(row.names).isdisjoint(formula.names):
        rule = f"does not depend on {row.names[0]}: it is a constant force, and no {row.name}"
        report.add(path, rule, f"write ({text})*{row.names[0]}", text)
        return False
    try:
        for node in walk(formula):
            if not node.names:
                evaluate(node, {})
            if isinstance(node, Binary) and node.operator == "/" and not node.right.names:
                # u/0 is not constant, but its divisor is
                evaluate(Binary("/", ONE, node.right), {})
    except ExpressionError as error:
        report.add(path, f"a constant in it {error.rule}", error.hint, text)
        return False
    return True
