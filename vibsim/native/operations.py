"""Operators and library functions: the kinds of their results, and their instructions.

Every operation is rounded individually, as in IEEE 754 and Python; division by zero gives an infinity or a NaN, never
an error.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

from llvmlite import ir

from vibsim.native.kinds import (
    BIT,
    DOUBLE,
    FLOAT,
    TRUTH,
    WHOLE,
    WORD,
    Kind,
    Number,
    is_vector,
    joined,
)
from vibsim.native.source import refusal

_FLOATS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul"}
_WHOLES = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.LShift: "shl", ast.RShift: "ashr"}
_BITS = {ast.BitAnd: "and_", ast.BitOr: "or_"}
_ORDERS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


def kind_of_binary(node: ast.expr, op: ast.operator, left: Kind, right: Kind) -> Kind:
    """Return the kind of ``left op right``."""
    match op:
        case ast.Add() | ast.Sub() if is_vector(left) and left == right:
            return left
        case ast.Mult() | ast.Div() if is_vector(left) and isinstance(right, str):
            return left
        case ast.Mult() if isinstance(left, str) and is_vector(right):
            return right
    both = joined(left, right) if isinstance(left, str) and isinstance(right, str) else None
    if both is None:
        raise refusal(node, f"a {left} and a {right} have no such operation")
    if isinstance(op, ast.Div):
        return FLOAT
    if both == TRUTH and type(op) in _BITS:
        return TRUTH
    if both == FLOAT and type(op) in _FLOATS:
        return FLOAT
    if both != FLOAT and type(op) in (*_WHOLES, *_BITS, ast.FloorDiv, ast.Mod):
        return WHOLE
    raise refusal(node, f"a {left} and a {right} have no such operation")


def kind_of_unary(node: ast.expr, op: ast.unaryop, kind: Kind) -> Kind:
    """Return the kind of ``op value``."""
    if is_vector(kind) and isinstance(op, ast.USub):
        return kind
    if isinstance(kind, str):
        if isinstance(op, ast.Not):
            return TRUTH
        if isinstance(op, ast.USub):
            return FLOAT if kind == FLOAT else WHOLE
    raise refusal(node, f"a {kind} has no such operation")


def turned(builder: ir.IRBuilder, value: Number, kind: str) -> ir.Value:
    """Convert a number to a kind: booleans are 0 and 1, and every number but 0 is true."""
    if value.kind == kind:
        return value.word
    if kind == TRUTH:
        if value.kind == FLOAT:
            return builder.fcmp_unordered("!=", value.word, DOUBLE(0.0))
        return builder.icmp_signed("!=", value.word, WORD(0))
    if kind == FLOAT:
        convert = builder.uitofp if value.kind == TRUTH else builder.sitofp
        return convert(value.word, DOUBLE)
    return (
        builder.zext(value.word, WORD) if value.kind == TRUTH else builder.fptosi(value.word, WORD)
    )


def binary(
    builder: ir.IRBuilder, op: ast.operator, kind: str, left: Number, right: Number
) -> ir.Value:
    """Return ``left op right`` for an operation that gives `kind` (`kind_of_binary`)."""
    a, b = (turned(builder, value, kind) for value in (left, right))
    if isinstance(op, ast.Div):
        return builder.fdiv(a, b)
    if isinstance(op, ast.FloorDiv):
        return _floor_divided(builder, a, b)[0]
    if isinstance(op, ast.Mod):
        return _floor_divided(builder, a, b)[1]
    name = _BITS.get(type(op)) or (_FLOATS if kind == FLOAT else _WHOLES)[type(op)]
    result: ir.Value = getattr(builder, name)(a, b)
    return result


def _floor_divided(builder: ir.IRBuilder, a: ir.Value, b: ir.Value) -> tuple[ir.Value, ir.Value]:
    """Return quotient, rounded down, and remainder of two integers."""
    quotient, remainder = builder.sdiv(a, b), builder.srem(a, b)
    differs = builder.icmp_signed("<", builder.xor(remainder, b), WORD(0))
    is_low = builder.and_(builder.icmp_signed("!=", remainder, WORD(0)), differs)
    return (
        builder.select(is_low, builder.sub(quotient, WORD(1)), quotient),
        builder.select(is_low, builder.add(remainder, b), remainder),
    )


def negated(builder: ir.IRBuilder, value: Number) -> ir.Value:
    """Return ``-value``."""
    if value.kind == FLOAT:
        return builder.fneg(value.word)
    return builder.neg(turned(builder, value, WHOLE))


def norm(builder: ir.IRBuilder, vector: Sequence[Number]) -> ir.Value:
    """Return the Euclidean norm of a vector."""
    total = reduce(builder.fadd, [builder.fmul(part.word, part.word) for part in vector])
    return _intrinsic("sqrt")(builder, [Number(FLOAT, total)])


def compared(builder: ir.IRBuilder, op: ast.cmpop, left: Number, right: Number) -> ir.Value:
    """Return a comparison as a bit; with NaN only ``!=`` is true."""
    kind = joined(left.kind, right.kind)
    assert isinstance(kind, str)
    kind = WHOLE if kind == TRUTH else kind
    a, b = (turned(builder, value, kind) for value in (left, right))
    sign = _ORDERS[type(op)]
    if kind == WHOLE:
        return builder.icmp_signed(sign, a, b)
    return (builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered)(sign, a, b)


Build = Callable[[ir.IRBuilder, Sequence[Number]], ir.Value]


def _intrinsic(name: str) -> Build:
    def build(builder: ir.IRBuilder, arguments: Sequence[Number]) -> ir.Value:
        words = [turned(builder, value, FLOAT) for value in arguments]
        signature = ir.FunctionType(DOUBLE, [DOUBLE] * len(words))
        return builder.call(
            builder.module.declare_intrinsic(f"llvm.{name}", [DOUBLE], signature), words
        )

    return build


def _floor(builder: ir.IRBuilder, arguments: Sequence[Number]) -> ir.Value:
    return builder.fptosi(_intrinsic("floor")(builder, arguments), WORD)


def _absolute(builder: ir.IRBuilder, arguments: Sequence[Number]) -> ir.Value:
    if arguments[0].kind == FLOAT:
        return _intrinsic("fabs")(builder, arguments)
    value = turned(builder, arguments[0], WHOLE)
    return builder.select(builder.icmp_signed("<", value, WORD(0)), builder.neg(value), value)


def _choice(op: ast.cmpop) -> Build:
    """Return the instructions of ``min`` or ``max``, which return the first of equal arguments."""

    def build(builder: ir.IRBuilder, arguments: Sequence[Number]) -> ir.Value:
        kind = _widest([argument.kind for argument in arguments])
        best = Number(kind, turned(builder, arguments[0], kind))
        for argument in arguments[1:]:
            other = Number(kind, turned(builder, argument, kind))
            is_better = compared(builder, op, other, best)
            best = Number(kind, builder.select(is_better, other.word, best.word))
        return best.word

    return build


def _widest(kinds: Sequence[Any]) -> str:
    return next(kind for kind in (FLOAT, WHOLE, TRUTH) if kind in kinds)


def _turn(kind: str) -> Build:
    return lambda builder, arguments: turned(builder, arguments[0], kind)


def _two_to(builder: ir.IRBuilder, arguments: Sequence[Number]) -> ir.Value:
    # the low bits of 1.5 * 2^52 + 1023 + k are the biased exponent
    shifted = builder.fadd(turned(builder, arguments[0], FLOAT), DOUBLE(6755399441056767.0))
    return builder.bitcast(builder.shl(builder.bitcast(shifted, WORD), WORD(52)), DOUBLE)


def _exponent_of(builder: ir.IRBuilder, arguments: Sequence[Number]) -> ir.Value:
    bits = builder.lshr(builder.bitcast(arguments[0].word, WORD), WORD(52))
    # the biased exponent as the low bits of 2^52: no conversion from whole numbers, which AVX2 lacks
    shifted = builder.bitcast(builder.or_(bits, WORD(0x4330000000000000)), DOUBLE)
    return builder.fsub(shifted, DOUBLE(4503599627371519.0))


def _mantissa_of(builder: ir.IRBuilder, arguments: Sequence[Number]) -> ir.Value:
    bits = builder.and_(builder.bitcast(arguments[0].word, WORD), WORD(0xFFFFFFFFFFFFF))
    return builder.bitcast(builder.or_(bits, WORD(0x3FF0000000000000)), DOUBLE)


_SAME = ""
"""Marks a result with the kind of the widest argument."""

_CALLS: dict[str, tuple[int, str, Build]] = {
    "abs": (1, _SAME, _absolute),
    "float": (1, FLOAT, _turn(FLOAT)),
    "int": (1, WHOLE, _turn(WHOLE)),
    "max": (0, _SAME, _choice(ast.Gt())),
    "min": (0, _SAME, _choice(ast.Lt())),
    "math.copysign": (2, FLOAT, _intrinsic("copysign")),
    "math.fabs": (1, FLOAT, _intrinsic("fabs")),
    "math.floor": (1, WHOLE, _floor),
    "math.sqrt": (1, FLOAT, _intrinsic("sqrt")),
    "two_to": (1, FLOAT, _two_to),
    "exponent_of": (1, FLOAT, _exponent_of),
    "mantissa_of": (1, FLOAT, _mantissa_of),
}
"""Number of arguments (0: at least one), kind of the result and instructions, by name. The last three are those of
`vibsim.elementary.primitives`, in a form that LLVM can vectorise."""


def kind_of_call(node: ast.expr, name: str, arguments: Sequence[Kind]) -> Kind:
    """Return the kind of the result of a library function."""
    if name == "vector":
        return (FLOAT,) * len(arguments)
    if name == "abs" and arguments and is_vector(arguments[0]):
        return FLOAT
    if name not in _CALLS:
        raise refusal(node, f"there is no function {name}; there are {', '.join(_CALLS)}")
    count, kind, _ = _CALLS[name]
    if (
        not arguments
        or (count and len(arguments) != count)
        or not all(isinstance(one, str) for one in arguments)
    ):
        raise refusal(node, f"{name} takes {count or 'some'} number{'s' * (count != 1)}")
    widest = _widest(arguments)
    return kind or (WHOLE if widest == TRUTH else widest)


def call(builder: ir.IRBuilder, name: str, kind: str, arguments: Sequence[Number]) -> Number:
    """Return the result of a library function; `kind` is that of `kind_of_call`."""
    return Number(kind, _CALLS[name][2](builder, arguments))


def literal(value: float) -> Number:
    """Return a constant."""
    if isinstance(value, bool):
        return Number(TRUTH, BIT(int(value)))
    return Number(WHOLE, WORD(value)) if isinstance(value, int) else Number(FLOAT, DOUBLE(value))
