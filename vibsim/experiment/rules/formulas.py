"""The formulas of a section ``model``: the names that each may use, and what may replace it."""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
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
NONE = "none"  # word for an absent term, for fields that take words
MOST_NAMED = 8  # largest number of names listed in a message


def shortlist(names: Sequence[str]) -> str:
    """List names for a message, at most `MOST_NAMED`."""
    return ", ".join(names if len(names) <= MOST_NAMED else [*names[: MOST_NAMED - 1], "..."])


@dataclass
class FormulaReader:
    """Reads the parameters and formulas of a section ``model``; reports faulty ones and leaves them out."""

    section: Any
    model: Model
    report: Report
    texts: dict[str, str] = field(default_factory=dict)  # formulas by key
    coefficients: dict[str, float] = field(default_factory=dict)  # of terms given by a word
    tables: dict[str, TableSpec] = field(default_factory=dict)  # those that replace formulas

    @cached_property
    def declared(self) -> dict[str, float]:
        """The parameters that the section declares, without those whose name is invalid or already used."""
        section, model = self.section, self.model
        used = {"t": "the time"}
        used |= {state.name: f"the {state.long_name}" for state in model.states}
        used |= {row.name: f"the {row.description} of the model" for row in model.parameters}
        if model.loaded is not None:
            # formulas of a structure name no states
            used = {"t": "the time"} | {row.name: f"the {row.description}" for row in RAYLEIGH}
        terms = (getattr(section, row.name) for row in model.formulas if row.terms)
        if any(isinstance(term, Section) for term in terms):
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
                path = "model", DECLARED, name
                self.report.add(path, fault, "choose another name", at_key=True)
            else:
                declared[name] = value
        return declared

    @cached_property
    def known(self) -> tuple[str, ...]:
        """The names of all parameters."""
        return (*(row.name for row in self.model.parameters), *self.declared)

    def read(self, folder: Path) -> None:
        """Read all formulas; paths of tables are relative to `folder`."""
        section, model, report = self.section, self.model, self.report
        fields = model.formulas
        looked_up = {row.name for row in fields if row.tabled and getattr(section, row.name)}
        for name in looked_up & {*(state.name for state in model.states), *self.declared}:
            rule = "a table is looked up under that name, which is already in use"
            report.add(("model", name), rule, "rename the state or the parameter", at_key=True)
        for row in fields:
            path, value = ("model", row.name), getattr(section, row.name)
            if row.of:
                if value is not None:
                    self._read_named(row, value, looked_up if "t" in row.names else set())
            elif isinstance(value, Section) and row.table is not None:
                self._read_table(row, row.table, value, folder)
                at: str = getattr(value, AT, "")
                if row.tabled and self._is_linear_in_time(at, (*path, AT)):
                    self.texts[row.name] = at.strip()
            elif isinstance(value, Section):
                self._read_term(row, value)
            elif value is None and row.name in section.model_fields_set:
                rule = "must be a formula, or a number"
                report.add(path, rule, "leave the key out", at_key=True)
            elif value is not None and not (
                value == NONE and row.terms and NONE not in self.declared
            ):
                self._keep(row.name, value, row, path)
            self._check_companions(row)
        if model.takes_events:
            self.texts |= read_crossings(section, model, self.known, report)
        for row in fields:
            if row.positive:
                self._check_positive(row)

    def _keep(
        self, key: str, text: str, row: FormulaField, path: Path_, more: Collection[str] = ()
    ) -> None:
        """Add a formula to `texts` if it is valid; it may also name `more`."""
        if self.is_valid(text, row, path, more):
            self.texts[key] = text.strip()

    def _read_table(
        self, row: FormulaField, keys: tuple[str, str], section: Section, folder: Path
    ) -> None:
        """Read the table that replaces a formula.

        The section holds the path, relative to `folder`, and under `keys` the columns of abscissae and values.
        """
        written: str = getattr(section, TABLE)
        place, value = (getattr(section, key) for key in keys)
        if Path(written).is_absolute():
            rule = "must be a path relative to the folder of the experiment file"
            self.report.add(("model", row.name, TABLE), rule, value=written)
            return
        try:
            table, content = read(folder / written, keys, (place, value))
        except TableError as error:
            shown = written if error.key == TABLE else getattr(section, error.key)
            self.report.add(("model", row.name, error.key), error.rule, error.hint, shown)
            return
        spec = TableSpec(file=written, place=place, value=value, numbers=table.digest)
        spec.hold(table, content)
        self.tables[row.name] = spec

    def _is_linear_in_time(self, text: str, path: Path_) -> bool:
        """Tell whether the abscissa formula of a table is a constant times t; report a fault otherwise."""
        if not self.is_valid(text, FormulaField(AT, ("t",), "", ""), path):
            return False
        place = parse(text, ("t", *self.known))
        speed = derivative(place, "t")
        if is_zero(speed) or not is_multiple(place, speed, "t"):
            rule = "must be a number times t, from the place 0 on"
            self.report.add(path, rule, "e.g. speed*t", text)
            return False
        return True

    def _read_term(self, row: FormulaField, value: Section) -> None:
        """Read a term ``{word: coefficient}``."""
        given = {word: x for word in row.terms if (x := getattr(value, word)) is not None}
        if len(given) != 1:
            rule = f"must have one of {', '.join(row.terms)}, or be a formula"
            self.report.add(("model", row.name), rule)
            return
        ((word, coefficient),) = given.items()
        if word == COULOMB and coefficient < 0.0:
            rule = "must be at least 0: friction opposes the motion"
            self.report.add(("model", row.name, word), rule, value=coefficient)
        self.coefficients[f"{row.name}.{word}"] = coefficient
        self.texts[row.name] = row.terms[word]

    def _read_named(self, row: FormulaField, written: Any, more: Collection[str]) -> None:
        """Read a field with a formula for each coordinate, output or term: ``acceleration.x``; it may name `more`."""
        path: Path_ = ("model", row.name)
        model, report = self.model, self.report
        if row.of == "term":
            is_list = isinstance(written, tuple)
            for i, text in enumerate(written if is_list else (written,)):
                self._keep(f"{row.name}.{i}", text, row, (*path, i) if is_list else path, more)
            return
        if not isinstance(written, Mapping):
            if model.coordinates > 1 and not row.beside:
                rule = f"must have a formula for each of {shortlist(model.positions)}"
                report.add(path, rule, f"e.g. {{{model.position}: ...}}")
            elif self.is_valid(written, row, path, more):
                self.texts |= {f"{row.name}.{name}": written.strip() for name in model.positions}
            return
        if row.paired:
            self._read_pairs(row, written)
            return
        used = [*(state.name for state in model.states), *self.known, *more]
        for name, text in written.items():
            if row.of == "coordinate" and name not in model.positions:
                hint = nearest(name, list(model.positions))
                report.add((*path, name), "unknown coordinate", hint, at_key=True)
            elif row.of == "output" and (fault := name_fault(name, tuple(used))):
                report.add((*path, name), fault, "choose another name", at_key=True)
            else:
                self._keep(f"{row.name}.{name}", text, row, (*path, name), more)
            used.append(name)
        missing = [name for name in model.positions if name not in written]
        # a misspelt name is already reported
        is_reported = any(name not in model.positions for name in written)
        if row.of == "coordinate" and missing and not is_reported:
            rule = f"must have a formula for each coordinate, has none for {shortlist(missing)}"
            report.add(path, rule)

    def _read_pairs(self, row: FormulaField, written: Mapping[str, Any]) -> None:
        """Read a field with a formula for each pair of coordinates: ``mass.x.y``."""
        formulas: dict[tuple[str, ...], str] = {}
        for name, value in written.items():
            if isinstance(value, Mapping):
                formulas |= {(name, other): text for other, text in value.items()}
            else:
                formulas[name,] = value
        positions = self.model.positions
        for names, text in formulas.items():
            path: Path_ = ("model", row.name, *names)
            unknown = [name for name in names if name not in positions]
            if unknown:
                hint = nearest(unknown[0], list(positions))
                self.report.add(path, "unknown coordinate", hint, at_key=True)
            elif names[0] != names[-1] and names[::-1] in formulas and names > names[::-1]:
                rule = f"is that of {names[1]} and {names[0]}, which is given already"
                self.report.add(path, rule, "leave it out", at_key=True)
            else:
                self._keep(".".join((row.name, *names)), text, row, path)

    def _check_companions(self, row: FormulaField) -> None:
        """Report a field given together with one that it replaces, or without one that it needs."""
        keys = self.section.model_fields_set
        if row.instead_of and not {row.name, row.instead_of} & keys:
            alone = ": `potential` alone makes no forces" if "potential" in keys else ""
            hint = f"write {row.instead_of} or {row.name}{alone}"
            self.report.add(("model", row.instead_of), MISSING, hint)
        elif row.instead_of and {row.name, row.instead_of} <= keys:
            rule = f"must not be given together with {row.instead_of}"
            self.report.add(("model", row.name), rule, at_key=True)
        elif row.beside and row.name in keys and row.beside not in keys:
            rule = f"has a meaning beside {row.beside} only"
            self.report.add(("model", row.name), rule, at_key=True)

    def _check_positive(self, row: FormulaField) -> None:
        """Refuse constant formulas whose value is not positive; those of pairs of coordinates may have any sign."""
        for key, text in self.texts.items():
            field, *names = key.split(".")
            if field == row.name and len(set(names)) == 1:
                formula = parse(text, (*row.names, *self.declared))
                if not set(formula.names).issubset(self.declared):
                    continue
                value = float(values(formula, self.declared))
                if not 0.0 < value < np.inf:
                    rule = f"must be greater than 0, is {value:g}"
                    self.report.add(("model", *key.split(".")), rule, value=text)

    def is_valid(
        self, text: str, row: FormulaField, path: Path_, more: Collection[str] = ()
    ) -> bool:
        """Tell whether a formula in the variables of `row`, the parameters and `more` is valid; report its fault."""
        may = f"; it may name {f'{shortlist(row.names)} and ' if row.names else ''}parameters"
        is_file = row.table is not None and text.lower().endswith(ENDINGS)
        hint = f"for a table write {{{TABLE}: {text}}}" if is_file else ""
        is_oscillator = self.model.kind == "oscillator"
        if is_oscillator and ({"u", "v"} - set(row.names)) & set(NAME.findall(text)):
            hint = "`spring` takes u, `damping` takes v; a force that depends on both takes `kind: system`"
        formula = self.report.formula(path, text, (*row.names, *self.known, *more), may, hint)
        if formula is None:
            return False
        if row.terms and not is_zero(formula) and set(row.names).isdisjoint(formula.names):
            rule = f"does not depend on {row.names[0]}: it is a constant force, and no {row.name}"
            self.report.add(path, rule, f"write ({text})*{row.names[0]}", text)
            return False
        try:
            for node in walk(formula):
                if not node.names:
                    evaluate(node, {})
                if isinstance(node, Binary) and node.operator == "/" and not node.right.names:
                    # u/0 is not constant, but its divisor is
                    evaluate(Binary("/", ONE, node.right), {})
        except ExpressionError as error:
            self.report.add(path, f"a constant in it {error.rule}", error.hint, text)
            return False
        return True
