"""Parse a formula: the grammar is Python's (`ast`), the content is restricted by an allow-list."""

from __future__ import annotations

import ast
import math
import re
import warnings
from collections.abc import Collection
from dataclasses import dataclass
from functools import partial

from vibsim.core.errors import VibsimError, nearest
from vibsim.formula.tree import (
    CONSTANTS,
    FUNCTIONS,
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    literal,
    paired,
    walk,
)

MAX_CHARACTERS = 2000
MOST_SHOWN = 60
"""Largest number of characters of a formula in a message."""
MAX_POWER = 1024
"""Largest exponent: integer powers are expanded into multiplications."""

_BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
_COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_FOREIGN = re.compile(r"[^A-Za-z0-9_.+\-*/()<>=!, ]")
_NUMBER = re.compile(r"(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
MAX_DEPTH = 100
TERMS = 16
"""Number of terms of a long sum that are added sequentially; these partial sums are added pairwise."""
TOO_DEEP = f"must not nest deeper than {MAX_DEPTH} operations"
_JOINED = re.compile(r"(?<![A-Za-z0-9_.])(\d+\.?\d*|\.\d+)(?=[A-Za-z_])(?![eE][+-]?\d)")
"""Matches a number directly followed by a name: a missing ``*``."""
_EQUALS = re.compile(r"(?<![<>=!])=(?!=)")
_BARE = re.compile(rf"\b({'|'.join(FUNCTIONS)})\s+(?=[\w.])")
"""Matches a function whose argument has no parentheses."""
_UNFINISHED = re.compile(r"([+\-*/<>=!,(]|\b(and|or|not|if|else))$")
INSTEAD = {
    **{"^": "** for a power", "%": "mod(x, y)", "&": "and", "|": "or", "\u03c0": "pi"},
    **dict.fromkeys("\u00d7\u00b7\u22c5", "*"),
    **dict.fromkeys("\u2212\u2013", "-"),
    **{"'": "the name of the velocity, such as v", "\u2019": "the name of the velocity, such as v"},
    **{"\u00f7": "/", "\u00b2": "**2", "\u00b3": "**3"},
}
"""Replacements for characters that are not allowed."""
REFUSED: dict[type[ast.AST], str] = {
    ast.Attribute: "attribute access is not allowed",
    ast.Tuple: "a list of values is not allowed",
    ast.Lambda: "'lambda' is not allowed",
    ast.Starred: "'*' is not allowed before an argument",
    ast.NamedExpr: "':=' is not allowed",
    ast.FloorDiv: "'//' is not allowed; use floor(a/b)",
}
"""Messages for Python syntax that is refused."""
OTHER_NAMES = {
    **{f"arc{name}": f"a{name}" for name in ("cos", "cosh", "sin", "sinh", "tan", "tan2", "tanh")},
    **{"Abs": "abs", "fabs": "abs", "ln": "log", "fmod": "mod", "rint": "round", "pow": "a**b"},
    **{"step": "heaviside", "Heaviside": "heaviside"},
    **{"maximum": "max", "minimum": "min", "power": "a**b", "sgn": "sign"},
}
"""Names of functions in other programs, and their names here."""


class ExpressionError(VibsimError):
    """An invalid formula: position in its text (from 0), the rule that it breaks, and a hint."""

    def __init__(self, text: str, position: int, rule: str, hint: str = "") -> None:
        self.text, self.position, self.rule, self.hint = text, position, rule, hint
        super().__init__(text, position, rule, hint)

    def __str__(self) -> str:
        where = f"formula '{shorten(self.text)}', character {self.position + 1}"
        return ": ".join(part for part in (where, self.rule, self.hint) if part)


def parse(text: str, names: Collection[str]) -> Expression:
    """Parse a formula.

    Parameters
    ----------
    text
        The formula, at most `MAX_CHARACTERS` long.
    names
        Valid names besides `CONSTANTS` and `FUNCTIONS`: states, time, parameters.

    Raises
    ------
    ExpressionError
        If the text is not a formula, or contains anything outside the allow-list.
    """
    if len(text) > MAX_CHARACTERS:
        rule = f"must have at most {MAX_CHARACTERS} characters, has {len(text)}"
        raise ExpressionError(text, MAX_CHARACTERS, rule)
    plain = re.sub(r"[\t\r\n]", " ", text)
    if foreign := _FOREIGN.search(plain):
        character = foreign.group()
        rule = f"character {character!r} is not allowed in a formula"
        hint = f"write {INSTEAD[character]}" if character in INSTEAD else ""
        raise ExpressionError(text, foreign.start(), rule, hint)
    if not plain.strip():
        raise ExpressionError(text, 0, "is empty; expected a number, a name or '('")
    reader = _Reader(text, plain.lstrip(), frozenset(names))
    return reader.convert(reader.tree(), 0)


@dataclass(frozen=True)
class _Reader:
    """Converts Python's syntax tree of a formula to an `Expression`; holds the text for messages."""

    text: str
    body: str
    names: frozenset[str]

    def fault(self, node: ast.expr, rule: str, hint: str = "") -> ExpressionError:
        return self.at(node.col_offset, rule, hint)

    def at(self, position: int, rule: str, hint: str = "") -> ExpressionError:
        shift = len(self.text) - len(self.body)
        return ExpressionError(self.text, position + shift, rule, hint)

    def tree(self) -> ast.expr:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                return ast.parse(self.body, mode="eval").body
        except SyntaxError as error:
            raise self.at(*place_of_fault(self.body.rstrip(), error)) from None
        except (ValueError, RecursionError, MemoryError, Warning):
            raise ExpressionError(self.text, 0, "is not a formula, or nested too deeply") from None

    def convert(self, node: ast.expr, depth: int) -> Expression:
        if depth >= MAX_DEPTH:
            raise self.fault(node, TOO_DEEP, "group long products with parentheses")
        match node:
            case ast.Constant():
                return self.number(node)
            case ast.Name():
                return self.name(node)
            case ast.UnaryOp(op=ast.USub()):
                return Negate(self.convert(node.operand, depth + 1))
            case ast.UnaryOp(op=ast.UAdd()):
                return self.convert(node.operand, depth + 1)
            case ast.UnaryOp(op=ast.Not()):
                return Binary("-", Number(1.0), self.condition(node.operand, depth + 1))
            case ast.BoolOp(op=op, values=values):
                below = depth + (len(values) - 1).bit_length()
                parts = [self.condition(value, below) for value in values]
                if isinstance(op, ast.And):
                    return paired(parts, partial(Binary, "*"))
                return paired(parts, lambda left, right: Call("max", (left, right)))
            case ast.IfExp():
                arguments = (node.test, node.body, node.orelse)
                return Call("where", tuple(self.convert(part, depth + 1) for part in arguments))
            case ast.BinOp() if depth + _terms(node) > MAX_DEPTH:
                return self.long_sum(node, depth)
            case ast.BinOp() if type(node.op) in _BINARY:
                return self.binary(node, depth)
            case ast.Compare():
                return self.compare(node, depth)
            case ast.Call():
                return self.call(node, depth)
        kind = type(node.op) if isinstance(node, ast.BinOp) else type(node)
        what = REFUSED.get(kind, "this operation is not allowed")
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

    def long_sum(self, node: ast.expr, depth: int) -> Expression:
        """Convert a sum that would nest too deeply: partial sums of `TERMS` terms are added pairwise."""
        terms: list[tuple[ast.expr, bool]] = []
        while isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
            terms.append((node.right, isinstance(node.op, ast.Sub)))
            node = node.left
        terms.append((node, False))
        terms.reverse()
        below = depth + TERMS + (len(terms) // TERMS).bit_length()
        sums = []
        for first in range(0, len(terms), TERMS):
            (head, is_negative), *rest = terms[first : first + TERMS]
            total = self.convert(head, below)
            total = Negate(total) if is_negative else total
            for term, is_negative in rest:
                total = Binary("-" if is_negative else "+", total, self.convert(term, below))
            sums.append(total)
        return paired(sums, partial(Binary, "+"))

    def compare(self, node: ast.Compare, depth: int) -> Expression:
        """Convert a comparison; a chain is the product of its comparisons."""
        if any(type(operator) not in _COMPARE for operator in node.ops):
            raise self.fault(node, "'in' and 'is' are not allowed", "compare with < <= > >= == !=")
        # depth of the product
        below = depth + 1 + (len(node.ops) - 1).bit_length()
        sides = [self.convert(side, below) for side in (node.left, *node.comparators)]
        for side, source in zip(sides[1:-1], node.comparators, strict=False):
            # an inner side occurs twice, so nested chains would grow exponentially
            if any(isinstance(part, Compare) for part in walk(side)):
                hint = "join two comparisons with and"
                raise self.fault(source, "a comparison within a chain of comparisons", hint)
        signs = [_COMPARE[type(operator)] for operator in node.ops]
        return paired(list(map(Compare, signs, sides[:-1], sides[1:])), partial(Binary, "*"))

    def condition(self, node: ast.expr, depth: int) -> Expression:
        """Convert an expression that must be a condition, with value 1 or 0."""
        match node:
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
                return self.convert(node, depth)
        raise self.fault(
            node, "'and', 'or' and 'not' need comparisons", "write x != 0 for a number"
        )

    def call(self, node: ast.Call, depth: int) -> Expression:
        if not isinstance(node.func, ast.Name):
            raise self.fault(node, "only a function can be called", nearest("", sorted(FUNCTIONS)))
        function = node.func.id
        if function not in FUNCTIONS:
            rule = f"unknown function '{shorten(function)}'"
            known = OTHER_NAMES.get(function)
            hint = f"write {known}" if known else nearest(function, sorted(FUNCTIONS))
            raise self.fault(node, rule, hint)
        if node.keywords:
            raise self.fault(node, f"{function} takes no arguments by keyword")
        wanted = FUNCTIONS[function][0]
        if len(node.args) != wanted:
            raise self.fault(node, f"{function} takes {wanted} argument(s), has {len(node.args)}")
        return Call(function, tuple(self.convert(argument, depth + 1) for argument in node.args))


def _terms(node: ast.expr) -> int:
    """Return the number of terms of a sum; 0 for anything else."""
    count = 0
    while isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
        node, count = node.left, count + 1
    return count and count + 1


def shorten(text: str) -> str:
    """Return a text cut to `MOST_SHOWN` characters."""
    return text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 3] + "..."


def place_of_fault(body: str, error: SyntaxError) -> tuple[int, str, str]:
    """Return position, rule and hint of a syntax error, since Python's own messages are about programs."""
    if joined := _JOINED.search(body):
        hint = f"write {joined.group()}*{body[joined.end()]}..."
        return joined.end(), "expected an operator", hint
    unmatched = unpaired(body)
    if unmatched is not None:
        return unmatched, "has an unmatched parenthesis", ""
    if "too many nested" in str(error.msg):
        return 0, TOO_DEEP, ""
    # Python reports an unfinished text at its start, or past its end
    if _UNFINISHED.search(body):
        return len(body), "ends where a number, a name or '(' was expected", ""
    if equals := _EQUALS.search(body):
        return equals.start(), "a formula has no =", "write the difference, or == to compare"
    if bare := _BARE.search(body):
        return bare.start(), f"{bare[1]} without parentheses", f"write {bare[1]}(...)"
    position = min(max((error.offset or 1) - 1, 0), len(body) - 1)
    return position, "expected an operator, a number, a name or a parenthesis here", ""


def unpaired(text: str) -> int | None:
    """Return the position of an unmatched parenthesis, None if there is none."""
    opened: list[int] = []
    for position, character in enumerate(text):
        if character == "(":
            opened.append(position)
        elif character == ")" and not opened:
            return position
        elif character == ")":
            opened.pop()
    return opened[-1] if opened else None
