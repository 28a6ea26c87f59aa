"""The module that is compiled: its functions and constants by name."""

from __future__ import annotations

import ast
import math
import operator
from collections import Counter
from dataclasses import dataclass
from typing import Any

from vibsim.core.errors import SimulationError

INLINE = "compiled"
"""Decorator of a function that is inlined into its callers."""
COMPILED_ALONE = ("called", "entry")
"""Decorators of functions that are compiled separately, unless LLVM decides to inline them."""

_OPERATIONS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul}
_NUMBERS = {"nan": math.nan, "inf": math.inf, "pi": math.pi, "e": math.e}


class NativeError(SimulationError):
    """Text that cannot be compiled."""


def refusal(node: ast.AST, why: str) -> NativeError:
    """Return the error for a node of the text: line, text, and why it is refused."""
    line = getattr(node, "lineno", 0)
    return NativeError(f"line {line} of the kernel: `{ast.unparse(node)}`: {why}")


@dataclass(frozen=True)
class Source:
    """Functions and constants of a module."""

    functions: dict[str, ast.FunctionDef]
    constants: dict[str, Any]
    """Floats, integers, booleans, and tuples of them."""

    @classmethod
    def read(cls, text: str) -> Source:
        """Parse the text of a module: functions with one decorator each, constants, and ``import math``."""
        functions, constants = {}, {}
        for node in ast.parse(text).body:
            match node:
                case ast.FunctionDef(name=name):
                    functions[name] = node
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call(args=parts)):
                    constants[name] = tuple(map(ast.literal_eval, parts))
                case ast.Assign(targets=[ast.Name(id=name)], value=value):
                    constants[name] = ast.literal_eval(value)
                case ast.Import(names=[ast.alias(name="math", asname=None)]):
                    pass
                case _:
                    raise refusal(node, "a kernel has functions and numbers alone")
        return cls(functions, constants)

    def constant(self, node: ast.expr, local: frozenset[str]) -> Any:
        """Return the value of a constant expression; None if it is not constant."""
        match node:
            case ast.Constant(value=bool() | int() | float() as value):
                return value
            case ast.Name(id=name) if name not in local:
                return self.constants.get(name)
            case ast.Attribute(value=ast.Name(id="math"), attr=name):
                return _NUMBERS.get(name)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                value = self.constant(operand, local)
                return -value if isinstance(value, int | float) else None
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() as op, right=right):
                a, b = self.constant(left, local), self.constant(right, local)
                if isinstance(a, int) and isinstance(b, int):
                    return _OPERATIONS[type(op)](a, b)
        return None


def is_inline(function: ast.FunctionDef) -> bool:
    """Tell whether a function is inlined into its callers."""
    match function.decorator_list:
        case [ast.Name(id=mark)] if mark == INLINE or mark in COMPILED_ALONE:
            return mark == INLINE
    raise refusal(function, f"it has to be marked as one of {', '.join((INLINE, *COMPILED_ALONE))}")


def assigned(*body: ast.AST) -> Counter[str]:
    """Return the number of assignments to each name in parts of the text."""
    nodes = (node for part in body for node in ast.walk(part) if isinstance(node, ast.Name))
    return Counter(node.id for node in nodes if isinstance(node.ctx, ast.Store))


def arguments_of(function: ast.FunctionDef) -> list[str]:
    """Return the names of the arguments, which must be positional without defaults."""
    arguments = function.args
    other = arguments.vararg or arguments.kwarg or arguments.kwonlyargs or arguments.posonlyargs
    if arguments.defaults or other:
        raise refusal(function, "a function takes arguments by their places alone")
    return [argument.arg for argument in arguments.args]


def loaded(target: ast.expr) -> ast.expr:
    """Convert the target of an assignment, a variable or an entry, to an expression that reads it."""
    match target:
        case ast.Name(id=name):
            return ast.copy_location(ast.Name(name, ast.Load()), target)
        case ast.Subscript(value=value, slice=place):
            return ast.copy_location(ast.Subscript(value, place, ast.Load()), target)
    raise refusal(target, "only a variable or an entry can be changed in place")
