"""Where a formula has corners or jumps: as switches, between whose changes it is smooth.

A function with a corner or a jump looks at a quantity: ``abs(x)`` at x, ``min(x, y)`` at x - y, ``floor(x)`` at x,
``mod(x, y)`` at x/y. What it does with it follows from the *mode* of the quantity: the whole number below it where it
is floored, and elsewhere 0 above 0 and -1 below it. With the modes held, the formula goes on as it was beyond the
place where a mode changes: it is smooth there, if the functions in it are.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from vibsim.formula.algebra import filled, is_zero
from vibsim.formula.tree import (
    STEPS,
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


@dataclass(frozen=True)
class Switch:
    """A quantity at whose changes of mode a formula has a corner or a jump."""

    quantity: Expression
    """In the names of the formula and the modes of switches before this one."""
    whole: bool
    """Whether the mode changes at every whole number, not only at 0."""
    mode: str
    """Name of its mode; no user can write it."""


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
            found[key] = Switch(quantity, whole, f"_mode_{len(found)}")
        return Name(found[key].mode)

    def sides(left: Expression, right: Expression) -> tuple[Expression, Expression]:
        """Return what is 1 where `left` is larger than `right`, else 0, and the other way round."""
        if is_zero(left) and not is_zero(right):
            smaller, larger = sides(right, left)
            return larger, smaller
        side = mode(left if is_zero(right) else Binary("-", left, right))
        return filled("side + 1", side=side), Negate(side)

    def change(node: Expression) -> Expression:
        """Return a node, whose operands are held already, without its corner or jump."""
        match node:
            case Compare("==" | "!=" as symbol, left, right) if moves("-", left, right):
                # true, or false, at single moments only
                return Number(float(symbol == "!="))
            case Compare(symbol, left, right) if moves("-", left, right):
                larger, smaller = sides(left, right)
                return larger if symbol in (">", ">=") else smaller
            case Call("min" | "max" as function, (x, y)) if moves("-", x, y):
                larger, smaller = sides(x, y)
                return Call("where", (larger, x, y) if function == "max" else (smaller, x, y))
            case Call("mod", (x, y)) if moves("/", x, y):
                return filled("x - mode*y", x=x, y=y, mode=mode(Binary("/", x, y), whole=True))
            case Call(function, (x,)) if function in _HELD and varies(x, moving):
                is_rounded = function in ("floor", "ceil", "round")
                quantity = filled("x + 0.5", x=x) if function == "round" else x
                return filled(_HELD[function], x=x, mode=mode(quantity, is_rounded))
        return node

    def moves(symbol: str, left: Expression, right: Expression) -> bool:
        return varies(Binary(symbol, left, right), moving)

    made = tuple(rebuilt(formula, change) for formula in formulas)
    return made, tuple(found.values())


_HELD = {
    "abs": "(2*mode + 1)*x",
    "sign": "2*mode + 1",
    "heaviside": "mode + 1",
    "floor": "mode",
    "ceil": "mode + 1",
    "round": "mode",
}
"""Functions of one argument x, with the mode of what they look at."""


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
