"""Formulas as text: parsed safely into an immutable expression graph, and written as source for the engine.

A formula has Python's grammar (``-x**2`` is ``-(x**2)``), restricted by an allow-list: numbers, declared names,
``+ - * / **``, comparisons, also in chains and joined by ``and``, ``or`` and ``not``, ``yes if condition else no``,
and calls of `FUNCTIONS`. Text of a user is never compiled or evaluated as Python.
"""

from vibsim.formula.algebra import is_multiple, is_zero, tidied
from vibsim.formula.arrays import bounds, values, values_of
from vibsim.formula.derivatives import derivative, is_linear
from vibsim.formula.integrals import has_rule, integral
from vibsim.formula.jumps import Pulses, Switch, first_jump, held, hidden_pulses
from vibsim.formula.parser import MAX_CHARACTERS, MAX_DEPTH, ExpressionError, parse
from vibsim.formula.render import constant, evaluate, to_formula, to_statements
from vibsim.formula.tree import (
    CONSTANTS,
    FUNCTIONS,
    ONE,
    ZERO,
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    literal,
    parts_of,
    put,
    rebuilding,
    replacing,
    walk,
)

__all__ = [
    "CONSTANTS", "FUNCTIONS", "MAX_CHARACTERS", "MAX_DEPTH", "ONE", "ZERO", "Binary", "Call",
    "Compare", "Expression", "ExpressionError", "Name", "Negate", "Number", "Pulses", "Switch",
    "bounds", "constant", "derivative", "evaluate", "first_jump", "has_rule", "held", "hidden_pulses", "integral",
    "is_linear", "is_multiple", "is_zero", "literal", "parse", "parts_of",
    "put", "rebuilding", "replacing", "tidied", "to_formula", "to_statements", "values", "values_of", "walk",
]  # fmt: skip
