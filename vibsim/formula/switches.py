"""Where a formula has corners or jumps: as switches, between whose changes it is smooth.

A function with a corner or a jump looks at a quantity: ``abs(x)`` at x, ``min(x, y)`` at x - y, ``floor(x)`` at x,
``mod(x, y)`` at x/y. What it does with it follows from the *mode* of the quantity: the whole number below it where it
is floored, and elsewhere 0 above 0 and -1 below it. With the modes held, the formula goes on as it was beyond the
place where a mode changes: it is smooth there, if the functions in it are.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass

from vibsim.formula.algebra import is_zero
from vibsim.formula.derivative import ONE, STEPS, TWO
from vibsim.formula.tree import (
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    children,
    rebuilt,
)

HALF = Number(0.5)


@dataclass(frozen=True)
class Switch:
    """A quantity at whose changes of mode a formula has a corner or a jump."""

    quantity: Expression
    """In the names of the formula and the modes of switches before this one."""
    whole: bool
    """Whether the mode changes at every whole number, not only at 0."""
    mode: str
    """Name of its mode; no user can write it."""


def mode_name(index: int) -> str:
    """Return the name of the mode of a switch."""
    return f"_mode_{index}"


def held(
    formulas: Iterable[Expression], moving: Collection[str]
) -> tuple[tuple[Expression, ...], tuple[Switch, ...]]:
    """Return formulas with the modes of their switches in place of corners and jumps, and the switches.

    Parameters
    ----------
    moving
        Names whose values change along a motion; what is made of others alone has no switch.
    """
    found: dict[tuple[Expression, bool], Switch] = {}

    def mode(quantity: Expression, whole: bool = False) -> Name:
        key = quantity, whole
        if key not in found:
            found[key] = Switch(quantity, whole, mode_name(len(found)))
        return Name(found[key].mode)

    def change(node: Expression) -> Expression:
        return _held(node, moving, mode)

    made = tuple(rebuilt(formula, change) for formula in formulas)
    return made, tuple(found.values())


def varies(node: Expression, moving: Collection[str]) -> bool:
    """Tell whether the value changes along a motion otherwise than by jumps."""
    match node:
        case Name(name):
            return name in moving
        case Compare():
            return False
        case Call(function, _) if function in STEPS:
            return False
        case Call("where", (_, yes, no)):
            return varies(yes, moving) or varies(no, moving)
    return any(varies(child, moving) for child in children(node))


def _held(node: Expression, moving: Collection[str], mode: Callable[..., Name]) -> Expression:
    """Return a node, whose operands are held already, without its corner or jump."""
    match node:
        case Compare(symbol, left, right):
            return _compared(node, symbol, left, right, moving, mode)
        case Call("abs" | "sign" | "heaviside" as function, (x,)) if varies(x, moving):
            return _of_sign(function, x, mode(x))
        case Call("min" | "max" as function, (x, y)) if varies(Binary("-", x, y), moving):
            larger, smaller = _sides(x, y, mode)
            return Call("where", (larger, x, y) if function == "max" else (smaller, x, y))
        case Call("floor", (x,)) if varies(x, moving):
            return mode(x, whole=True)
        case Call("ceil", (x,)) if varies(x, moving):
            return Binary("+", mode(x, whole=True), ONE)
        case Call("round", (x,)) if varies(x, moving):
            return mode(Binary("+", x, HALF), whole=True)
        case Call("mod", (x, y)) if varies(Binary("/", x, y), moving):
            return Binary("-", x, Binary("*", mode(Binary("/", x, y), whole=True), y))
    return node


def _of_sign(function: str, x: Expression, mode: Name) -> Expression:
    """Return ``abs``, ``sign`` or ``heaviside`` of x on one side of 0."""
    above = Binary("+", mode, ONE)
    if function == "heaviside":
        return above
    sign = Binary("+", Binary("*", TWO, mode), ONE)
    return sign if function == "sign" else Binary("*", sign, x)


def _sides(
    left: Expression, right: Expression, mode: Callable[..., Name]
) -> tuple[Expression, Expression]:
    """Return what is 1 where `left` is larger than `right`, else 0, and the other way round."""
    if is_zero(left) and not is_zero(right):
        smaller, larger = _sides(right, left, mode)
        return larger, smaller
    side = mode(left if is_zero(right) else Binary("-", left, right))
    return Binary("+", side, ONE), Negate(side)


def _compared(
    node: Expression,
    symbol: str,
    left: Expression,
    right: Expression,
    moving: Collection[str],
    mode: Callable[..., Name],
) -> Expression:
    if not varies(Binary("-", left, right), moving):
        return node
    if symbol in ("==", "!="):
        # true, or false, at single moments only
        return Number(float(symbol == "!="))
    larger, smaller = _sides(left, right, mode)
    return larger if symbol in (">", ">=") else smaller
