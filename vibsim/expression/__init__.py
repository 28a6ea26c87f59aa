"""Formulas as text: read safely, kept as a frozen tree, written out for the engine.

A formula is read with Python's grammar (``**`` binds tighter than a sign on its left, ``-x**2`` is ``-(x**2)``) and an
allow-list of what it may hold: numbers, declared names, ``+ - * / **``, comparisons, also in chains and joined by
``and``, ``or`` and ``not``, ``yes if condition else no``, and calls of `FUNCTIONS`. Text of a user is never compiled or
evaluated as Python.
"""

from vibsim.expression.algebra import (
    is_multiple,
    is_smooth,
    is_zero,
    minus,
    over,
    plus,
    put,
    tidied,
    times,
)
from vibsim.expression.arrays import values
from vibsim.expression.derivative import ONE, ZERO, derivative
from vibsim.expression.faults import MAX_DEPTH, ExpressionError
from vibsim.expression.integral import integral
from vibsim.expression.parser import (
    MAX_CHARACTERS,
    MAX_POWER,
    literal,
    parse,
)
from vibsim.expression.render import (
    constant,
    evaluate,
    to_formula,
    to_python,
    to_statements,
)
from vibsim.expression.switches import Switch, held
from vibsim.expression.tree import (
    CONSTANTS,
    FUNCTIONS,
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    names_in,
    rebuilt,
    walk,
)

__all__ = [
    "CONSTANTS",
    "FUNCTIONS",
    "MAX_CHARACTERS",
    "MAX_DEPTH",
    "MAX_POWER",
    "ONE",
    "ZERO",
    "Binary",
    "Call",
    "Compare",
    "Expression",
    "ExpressionError",
    "Name",
    "Negate",
    "Number",
    "Switch",
    "constant",
    "derivative",
    "evaluate",
    "held",
    "integral",
    "is_multiple",
    "is_smooth",
    "is_zero",
    "literal",
    "minus",
    "names_in",
    "over",
    "parse",
    "plus",
    "put",
    "rebuilt",
    "tidied",
    "times",
    "to_formula",
    "to_python",
    "to_statements",
    "values",
    "walk",
]
