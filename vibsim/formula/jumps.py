"""Where a formula has corners, jumps, and pulses between the times at which it is looked at, which no step knows of.

A pulse is recognised by what steps see: between two times the formula leaves, by far, all values that it has at these
and at those beside them. Bounds of the formula over intervals of time (`vibsim.formula.arrays`) say where that may be:
these are halved until a value is found there, or none can be.

The derivative of a formula leaves jumps out, so that its integral is not the difference of the formula. Over a piece of
time [a, b] the difference D of ``f(b) - f(a)`` and the integral of f' vanishes for a continuous f and a piece that is
short enough. At a jump it stays what it is, however short the piece becomes. So pieces with a D are halved, on the side
where more of it lies, until it has gone or nothing is left to halve. Where a pulse lies between the ends of a piece,
the piece ends within it: its jumps would cancel.

As *switches*: a function with a corner or a jump looks at a quantity: ``abs(x)`` at x, ``min(x, y)`` at x - y,
``floor(x)`` at x, ``mod(x, y)`` at x/y. What it does with it follows from the *mode* of the quantity: the whole number
below it where it is floored, and elsewhere 0 above 0 and -1 below it. With the modes held, the formula goes on as it
was beyond the place where a mode changes: it is smooth there, if the functions in it are.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats, Integers
from vibsim.elementary import on_arrays
from vibsim.formula.algebra import filled, is_zero
from vibsim.formula.arrays import bounds, values
from vibsim.formula.derivatives import derivative
from vibsim.formula.tree import (
    STEPS,
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    folded,
    rebuilding,
    walk,
)

HALVINGS = 48
MOST_INTERVALS = 2**14
"""Intervals that are looked at together, at most: those that may hold the largest values."""
PULSE_RATIO = 2.0
"""A pulse leaves the values around it by more than so many times their range, ..."""
SMALLEST_PULSE = 1e-9
"""... and by this part of the largest value at all times."""
HEIGHT_AT_ENDS = 0.5
"""What a pulse still has of its height at its ends."""

PIECES = 1024
"""Of the whole interval."""
MOST_PULSES = 8
"""So many pulses between the ends of pieces are looked at."""
UNEVEN = 0.37
"""How far their ends are moved, in pieces, so that they do not keep step with a square wave."""
JUMP_HALVINGS = 50
SMALLEST_JUMP = 1e-6
"""A jump is larger than this part of the formula's largest value."""
GENTLE = frozenset(
    ("sin", "cos", "exp", "expm1", "sinh", "cosh", "tanh", "atan", "asinh", "erf", "erfc")
)
"""Functions that are smooth wherever they are taken."""


@dataclass(frozen=True)
class Pulses:
    """One pulse of every member that has any, shape (case,)."""

    time: Floats
    """A time within it; NaN where there is none."""
    width: Floats

    def and_others(self, other: Pulses) -> Pulses:
        """Return these, and others of members that have none of these."""
        none = np.isnan(self.time)
        return Pulses(
            np.where(none, other.time, self.time), np.where(none, other.width, self.width)
        )


def hidden_pulses(formula: Expression, numbers: Mapping[str, Floats], t: Floats) -> Pulses:
    """Find a pulse of every member between the times at which it is looked at.

    Parameters
    ----------
    formula
        In ``t`` and other names.
    numbers
        Values of these, each of shape (case, gap) or (case, 1): what they are behind each of the times but the last.
    t
        The times, shape (case, gap + 1), ascending; NaN behind the last one of a member.
    """
    cases, count = len(t), t.shape[1] - 1
    time, width = np.full(cases, np.nan), np.full(cases, np.nan)
    if "t" not in formula.names or count < 1:
        return Pulses(time, width)
    # gaps between successive times, flat over members
    flat = {name: np.broadcast_to(x, (cases, count)).ravel() for name, x in numbers.items()}
    case = np.repeat(np.arange(cases), count)
    begin, end = t[:, :-1].ravel(), t[:, 1:].ravel()

    def excess(row: Integers, at: Floats) -> Floats:
        """Return how far values at times in some gaps are from being none of a pulse; 0 or less where they are none."""
        own = {name: x[row] for name, x in flat.items()}
        value = np.broadcast_to(values(formula, {**own, "t": at}), at.shape)
        return np.maximum(low[row] - value, value - high[row])

    def width_of(row: Integers, at: Floats) -> float:
        """Return the time over which the pulse around a time has half its height or more, to a factor of 2."""
        reach = float(end[row][0] - begin[row][0]) * 0.5 ** np.arange(HALVINGS)
        rows, least = np.broadcast_to(row, reach.shape), HEIGHT_AT_ENDS * excess(row, at)[0]
        sides = (excess(rows, at + side * reach) >= least for side in (-1.0, 1.0))
        return sum(float(reach[np.argmax(high)]) if high.any() else 0.0 for high in sides)

    with np.errstate(all="ignore"):
        low, high = _limits(formula, numbers, t)
        row = np.flatnonzero(np.isfinite(low + high + end))
        a, b = begin[row], end[row]
        for _ in range(HALVINGS):
            own = {name: x[row] for name, x in flat.items()}
            least, most = bounds(formula, {**own, "t": (a, b)})
            largest = np.broadcast_to(np.maximum(low[row] - least, most - high[row]), a.shape)
            left = np.flatnonzero((largest > 0.0) & np.isnan(time[case[row]]))
            if len(left) > MOST_INTERVALS:
                left = left[np.argsort(-largest[left], kind="stable")[:MOST_INTERVALS]]
            row, a, b = row[left], a[left], b[left]
            if not len(row):
                break
            middle = 0.5 * (a + b)
            hits = np.flatnonzero(excess(row, middle) > 0.0)
            # of several the first one in time stays
            for i in hits[np.argsort(-middle[hits], kind="stable")]:
                time[case[row[i]]] = middle[i]
                width[case[row[i]]] = width_of(row[i : i + 1], middle[i : i + 1])
            row, a, b = np.tile(row, 2), np.append(a, middle), np.append(middle, b)
    return Pulses(time, width)


def _limits(formula: Expression, numbers: Mapping[str, Floats], t: Floats) -> tuple[Floats, Floats]:
    """Return the least and the largest value in every gap that are no pulse, flat over members."""
    count = t.shape[1] - 1
    around = np.arange(count)[:, None] + np.array([-1, 0, 1, 2])
    places = np.take(t, np.clip(around, 0, count), axis=1)
    own = {name: np.broadcast_to(x, (len(t), count))[..., None] for name, x in numbers.items()}
    beside = np.broadcast_to(values(formula, {**own, "t": places}), places.shape)
    # behind the last time of a member nothing is known
    beside = np.where(np.isfinite(places), beside, beside[..., 1:2])
    low, high = np.min(beside, axis=-1), np.max(beside, axis=-1)
    size = np.nanmax(
        np.abs(np.where(np.isfinite(beside), beside, np.nan)), axis=(1, 2), initial=0.0
    )
    room = PULSE_RATIO * (high - low) + SMALLEST_PULSE * size[:, None]
    return (low - room).ravel(), (high + room).ravel()


def first_jump(formula: Expression, numbers: Mapping[str, float], end: float) -> float | None:
    """Return the time of the first jump of a formula in ``t`` from 0 to `end`; None where it has none.

    Parameters
    ----------
    numbers
        Values of its other names.
    """
    if not any(
        isinstance(part, Compare) or (isinstance(part, Call) and part.function not in GENTLE)
        for part in walk(formula)
    ):
        return None
    slope = derivative(formula, "t")
    place, weight = np.polynomial.legendre.leggauss(3)

    def missing(a: Floats, b: Floats) -> Floats:
        """Return D of some pieces."""
        t = a + 0.5 * (b - a) * (1.0 + place[:, None])
        mean = 0.5 * weight @ np.broadcast_to(values(slope, {**numbers, "t": t}), t.shape)
        ends = [np.broadcast_to(values(formula, {**numbers, "t": x}), x.shape) for x in (a, b)]
        found: Floats = np.abs(ends[1] - ends[0] - (b - a) * mean)
        return np.where(np.isfinite(found), found, 0.0)

    k = np.arange(PIECES + 1.0)
    edges = end / PIECES * (k + np.where(k % PIECES == 0.0, 0.0, UNEVEN * on_arrays.sin(1.7 * k)))
    edges = _with_pulses(formula, numbers, edges)
    with np.errstate(all="ignore"):
        size = np.abs(np.broadcast_to(values(formula, {**numbers, "t": edges}), edges.shape))
        least = SMALLEST_JUMP * float(np.max(size, initial=0.0, where=np.isfinite(size)))
        a, b = edges[:-1], edges[1:]
        kept = missing(a, b) > least
        a, b = a[kept], b[kept]
        for _ in range(JUMP_HALVINGS):
            middle = 0.5 * (a + b)
            left, right = missing(a, middle), missing(middle, b)
            is_left = left >= right
            a, b = np.where(is_left, a, middle), np.where(is_left, middle, b)
            kept = np.maximum(left, right) > least
            a, b = a[kept], b[kept]
    return float(b[0]) if len(b) else None


def _with_pulses(formula: Expression, numbers: Mapping[str, float], edges: Floats) -> Floats:
    """Return the ends of pieces with times in and around the pulses between them."""
    columns = {name: np.full((1, 1), float(value)) for name, value in numbers.items()}
    for _ in range(MOST_PULSES):
        found = hidden_pulses(formula, columns, edges[None])
        if np.isnan(found.time[0]):
            break
        around = found.time[0] + found.width[0] * np.array([-1.0, 0.0, 1.0])
        edges = np.unique(np.append(edges, np.clip(around, edges[0], edges[-1])))
    return edges


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

    made = tuple(map(rebuilding(change), formulas))
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

    def does(part: Expression, *operands: bool) -> bool:
        match part:
            case Name(name):
                return name in moving
            case Compare():
                return False
            case Call(function, _) if function in STEPS:
                return False
            case Call("where", _):
                return any(operands[1:])
        return any(operands)

    return folded([node], does)[0]
