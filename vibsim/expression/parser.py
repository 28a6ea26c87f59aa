"""Read a formula: Python's `ast` for the grammar, an allow-list for the content."""

from __future__ import annotations

import ast
import math
import re
import warnings
from collections.abc import Collection

from vibsim.errors import VibsimError, nearest
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
    children,
)

MAX_CHARACTERS = 2000
MAX_DEPTH = 100
MAX_POWER = 1024
"""Largest whole exponent: it is written out as multiplications."""

_BINARY: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}
_COMPARE: dict[type[ast.cmpop], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
_FOREIGN = re.compile(r"[^A-Za-z0-9_.+\-*/()<>=!, ]")
_NUMBER = re.compile(r"(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_JOINED = re.compile(r"(?<![A-Za-z0-9_.])(\d+\.?\d*|\.\d+)(?=[A-Za-z_])(?![eE][+-]?\d)")
"""A number that runs into a name: a forgotten ``*``."""
_UNFINISHED = "+-*/<>=!,("
_INSTEAD = {
    "^": "write ** for a power",
    "\u00d7": "write *",
    "\u00b7": "write *",
    "\u22c5": "write *",
    "\u2212": "write -",
    "\u2013": "write -",
    "\u00f7": "write /",
    "\u00b2": "write **2",
    "\u00b3": "write **3",
    "\u03c0": "write pi",
}
_REFUSED: dict[type[ast.AST], str] = {
    ast.Attribute: "attribute access is not allowed",
    ast.BoolOp: "'and' and 'or' are not allowed",
    ast.IfExp: "'if' is not allowed; use where(condition, yes, no)",
    ast.Tuple: "a list of values is not allowed",
    ast.Lambda: "'lambda' is not allowed",
    ast.Starred: "'*' is not allowed before an argument",
    ast.NamedExpr: "':=' is not allowed",
}


class ExpressionError(VibsimError):
    """A formula that is refused.

    Parameters
    ----------
    text
        The formula.
    position
        Where in `text`, from 0.
    rule
        What is wrong, or what was expected there.
    hint
        The nearest valid choice; may be empty.
    """

    def __init__(self, text: str, position: int, rule: str, hint: str = "") -> None:
        self.text = text
        self.position = position
        self.rule = rule
        self.hint = hint
        where = f"formula '{shorten(text)}', character {position + 1}"
        super().__init__(": ".join(part for part in (where, rule, hint) if part))


def shorten(text: str, length: int = 60) -> str:
    """Return `text`, cut to `length` characters."""
    return text if len(text) <= length else text[: length - 3] + "..."


def parse(text: str, names: Collection[str]) -> Expression:
    """Read a formula.

    Parameters
    ----------
    text
        The formula, at most `MAX_CHARACTERS` long.
    names
        What it may name besides `CONSTANTS` and `FUNCTIONS`: states, time, parameters.

    Raises
    ------
    ExpressionError
        Where the text is no formula, or holds anything outside the allow-list.
    """
    if len(text) > MAX_CHARACTERS:
        rule = f"must have at most {MAX_CHARACTERS} characters, has {len(text)}"
        raise ExpressionError(text, MAX_CHARACTERS, rule)
    plain = re.sub(r"[\t\r\n]", " ", text)
    if foreign := _FOREIGN.search(plain):
        character = foreign.group()
        rule = f"character {character!r} is not allowed in a formula"
        raise ExpressionError(text, foreign.start(), rule, _INSTEAD.get(character, ""))
    if not plain.strip():
        raise ExpressionError(text, 0, "is empty; expected a number, a name or '('")
    reader = _Reader(text, plain, frozenset(names))
    return reader.convert(reader.tree(), 0)


class _Reader:
    """One formula on its way from Python's tree to ours; remembers the text for messages."""

    def __init__(self, text: str, plain: str, names: frozenset[str]) -> None:
        self.text = text
        self.names = names
        self.body = plain.lstrip()
        self.shift = len(plain) - len(self.body)

    def fault(self, node: ast.expr, rule: str, hint: str = "") -> ExpressionError:
        return self.at(node.col_offset, rule, hint)

    def tree(self) -> ast.expr:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                return ast.parse(self.body, mode="eval").body
        except SyntaxError as error:
            raise self.syntax(error) from None
        except (ValueError, RecursionError, MemoryError, Warning):
            raise ExpressionError(self.text, 0, "is not a formula, or nested too deeply") from None

    def syntax(self, error: SyntaxError) -> ExpressionError:
        """Say what was expected where; Python's own messages speak of programs."""
        body = self.body.rstrip()
        if joined := _JOINED.search(body):
            hint = f"write {joined.group()}*{body[joined.end()]}..."
            return self.at(joined.end(), "expected an operator", hint)
        lonely = unpaired(body)
        if lonely is not None:
            return self.at(lonely, "has a parenthesis without its partner")
        if "too many nested" in str(error.msg):
            return self.at(0, f"must not nest deeper than {MAX_DEPTH} operations")
        # a text that is cut short is reported at its beginning, or past its end
        if body[-1] in _UNFINISHED:
            return self.at(len(body), "ends where a number, a name or '(' was expected")
        position = min(max((error.offset or 1) - 1, 0), len(body) - 1)
        return self.at(position, "expected an operator, a number, a name or a parenthesis here")

    def at(self, position: int, rule: str, hint: str = "") -> ExpressionError:
        return ExpressionError(self.text, position + self.shift, rule, hint)

    def convert(self, node: ast.expr, depth: int) -> Expression:
        if depth >= MAX_DEPTH:
            rule = f"must not nest deeper than {MAX_DEPTH} operations"
            raise self.fault(node, rule, "group long sums with parentheses")
        match node:
            case ast.Constant():
                return self.number(node)
            case ast.Name():
                return self.name(node)
            case ast.UnaryOp(op=ast.USub()):
                return Negate(self.convert(node.operand, depth + 1))
            case ast.UnaryOp(op=ast.UAdd()):
                return self.convert(node.operand, depth + 1)
            case ast.BinOp() if type(node.op) in _BINARY:
                return self.binary(node, depth)
            case ast.Compare():
                return self.compare(node, depth)
            case ast.Call():
                return self.call(node, depth)
        what = _REFUSED.get(type(node), "this operation is not allowed")
        raise self.fault(node, what, "a formula has numbers, names, + - * / ** and functions")

    def number(self, node: ast.Constant) -> Number:
        text = self.body[node.col_offset : node.end_col_offset]
        if not _NUMBER.fullmatch(text):
            raise self.fault(node, f"'{shorten(text)}' is not a number")
        value = float(text)
        if not math.isfinite(value):
            raise self.fault(node, f"the number {shorten(text)} is too large")
        return Number(value)

    def name(self, node: ast.Name) -> Expression:
        if node.id in self.names:
            return Name(node.id)
        if node.id in CONSTANTS:
            return Number(CONSTANTS[node.id])
        if node.id in FUNCTIONS:
            raise self.fault(node, f"'{node.id}' is a function", f"write {node.id}(...)")
        rule = f"unknown name '{shorten(node.id)}'"
        raise self.fault(node, rule, nearest(node.id, sorted({*self.names, *CONSTANTS})))

    def binary(self, node: ast.BinOp, depth: int) -> Expression:
        left = self.convert(node.left, depth + 1)
        right = self.convert(node.right, depth + 1)
        exponent = literal(right) if isinstance(node.op, ast.Pow) else None
        if exponent is not None and abs(exponent) > MAX_POWER:
            raise self.fault(
                node.right, f"an exponent must be at most {MAX_POWER}, is {exponent:g}"
            )
        return Binary(_BINARY[type(node.op)], left, right)

    def compare(self, node: ast.Compare, depth: int) -> Expression:
        if len(node.ops) > 1:
            raise self.fault(node, "comparisons cannot be chained")
        operator = _COMPARE.get(type(node.ops[0]))
        if operator is None:
            raise self.fault(node, "'in' and 'is' are not allowed", "compare with < <= > >= == !=")
        left = self.convert(node.left, depth + 1)
        return Compare(operator, left, self.convert(node.comparators[0], depth + 1))

    def call(self, node: ast.Call, depth: int) -> Expression:
        if not isinstance(node.func, ast.Name):
            raise self.fault(node, "only a function can be called", nearest("", sorted(FUNCTIONS)))
        function = node.func.id
        if function not in FUNCTIONS:
            rule = f"unknown function '{shorten(function)}'"
            raise self.fault(node, rule, nearest(function, sorted(FUNCTIONS)))
        if node.keywords:
            raise self.fault(node, f"{function} takes no arguments by keyword")
        wanted = FUNCTIONS[function][0]
        if len(node.args) != wanted:
            raise self.fault(node, f"{function} takes {wanted} argument(s), has {len(node.args)}")
        return Call(function, tuple(self.convert(argument, depth + 1) for argument in node.args))


def unpaired(text: str) -> int | None:
    """Return where a parenthesis without its partner stands, None where there is none."""
    opened: list[int] = []
    for position, character in enumerate(text):
        if character == "(":
            opened.append(position)
        elif character == ")" and not opened:
            return position
        elif character == ")":
            opened.pop()
    return opened[-1] if opened else None


def literal(node: Expression) -> float | None:
    """Return the value of a number with signs before it, None for anything else."""
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Negate):
        value = literal(children(node)[0])
        return None if value is None else -value
    return None
