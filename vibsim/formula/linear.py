"""What a formula is beside a multiple of one of its names."""

from __future__ import annotations

from vibsim.formula.tree import Binary, Expression, Name, Negate, Number, names_in, rebuilt

ZERO, ONE = Number(0.0), Number(1.0)


def start_of(node: Expression, name: str) -> Expression:
    """Return the formula with 0 in the place of the name."""
    return rebuilt(node, lambda part: ZERO if part == Name(name) else part)


def slope_of(node: Expression, name: str) -> Expression | None:
    """Return the a of a formula ``a x + b``; None where it is another one."""
    match node:
        case Negate(operand):
            inner = slope_of(operand, name)
            return None if inner is None else Negate(inner)
        case Binary("+" | "-" as symbol, left, right) if name not in names_in(left):
            inner = slope_of(right, name)
            return Negate(inner) if inner is not None and symbol == "-" else inner
        case Binary("+" | "-", left, right) if name not in names_in(right):
            return slope_of(left, name)
        case Binary("*", left, right) if name not in names_in(left):
            inner = slope_of(right, name)
            return None if inner is None else _times(left, inner)
        case Binary("*" | "/" as symbol, left, right) if name not in names_in(right):
            inner = slope_of(left, name)
            return None if inner is None else Binary(symbol, inner, right)
        case _:
            return factor_of(node, name)


def factor_of(node: Expression, name: str) -> Expression | None:
    """Return the a of a formula ``a x``; None where it is another one."""
    match node:
        case Name(own) if own == name:
            return ONE
        case Negate(operand):
            inner = factor_of(operand, name)
            return None if inner is None else Negate(inner)
        case Binary("*", left, right) if name not in names_in(left):
            inner = factor_of(right, name)
            return None if inner is None else _times(left, inner)
        case Binary("*", left, right) if name not in names_in(right):
            inner = factor_of(left, name)
            return None if inner is None else _times(right, inner)
        case Binary("/", left, right) if name not in names_in(right):
            inner = factor_of(left, name)
            return None if inner is None else Binary("/", inner, right)
        case _:
            return None


def _times(left: Expression, right: Expression) -> Expression:
    return left if right == ONE else Binary("*", left, right)
