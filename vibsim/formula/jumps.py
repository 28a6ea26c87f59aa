"""Find corners and jumps of a formula, and pulses between the times at which it is sampled.

*Pulses.* Between two sample times the formula deviates by far from its values at these and the adjacent times. Bounds
of the formula over intervals of time (`vibsim.formula.arrays`) show where that is possible. These intervals are
bisected until a sample hits the pulse, or the bounds exclude one.

*Jumps.* The derivative of a formula ignores jumps. So over an interval [a, b] the defect D, which is ``f(b) - f(a)``
minus the integral of f', tends to 0 with the length of the interval for a continuous f, but stays constant across a
jump. Intervals with a defect are bisected, towards the larger defect, until it vanishes or the interval is tiny. An
interval that contains a pulse is split inside it, because the two jumps of the pulse would cancel.

*Switches.* A function with a corner or a jump depends on a quantity: ``abs(x)`` on x, ``min(x, y)`` on x - y,
``floor(x)`` on x, ``mod(x, y)`` on x/y. Its branch is given by the *mode* of the quantity: its floor for rounding
functions and ``mod``, otherwise 0 above 0 and -1 below. With modes held constant, the formula continues its branch
beyond the point where the mode changes, and is smooth there if the functions in it are.
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
"""Largest number of intervals that are kept: those with the largest possible deviations."""
MOST_GAPS = 2**21
"""Largest number of gaps between sample times that are searched at once; larger runs have wider gaps first."""
PULSE_RATIO = 2.0
"""A pulse deviates from the values around it by more than this multiple of their range, ..."""
SMALLEST_PULSE = 1e-9
"""... plus this fraction of the largest value at all times."""
HEIGHT_AT_ENDS = 0.5
"""Fraction of the height of a pulse at which its width is measured."""

PIECES = 1024
"""Number of intervals into which the whole time is divided."""
MOST_PULSES = 8
"""Largest number of pulses inside intervals that are searched for."""
UNEVEN = 0.37
"""Amplitude by which the ends of intervals are shifted, in intervals, so that no square wave is in phase with them."""
JUMP_HALVINGS = 50
SMALLEST_JUMP = 1e-6
"""Smallest jump, relative to the largest value of the formula."""
GENTLE = frozenset(
    ("sin", "cos", "exp", "expm1", "sinh", "cosh", "tanh", "atan", "asinh", "erf", "erfc")
)
"""Functions that are smooth for all arguments."""


@dataclass(frozen=True)
class Pulses:
    """At most one pulse of every member, shape (case,)."""

    time: Floats
    """A time within the pulse; NaN if the member has none."""
    width: Floats

    def and_others(self, other: Pulses) -> Pulses:
        """Return these pulses, and those of `other` for members without one."""
        none = np.isnan(self.time)
        return Pulses(
            np.where(none, other.time, self.time), np.where(none, other.width, self.width)
        )


def hidden_pulses(formula: Expression, numbers: Mapping[str, Floats], t: Floats) -> Pulses:
    """Find a pulse of every member between its sample times.

    Parameters
    ----------
    formula
        A formula in ``t`` and other names.
    numbers
        Values of the other names, of shape (case, gap) or (case, 1): those that apply after each sample time.
    t
        The sample times, shape (case, gap + 1), ascending; NaN after the last time of a member.
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
        """Return by how much values at times in some gaps exceed the limits; positive in a pulse only."""
        parameters = {name: x[row] for name, x in flat.items()}
        value = np.broadcast_to(values(formula, {**parameters, "t": at}), at.shape)
        return np.maximum(low[row] - value, value - high[row])

    def width_of(row: Integers, at: Floats) -> float:
        """Return the width at half height of the pulse around a time, to a factor of 2."""
        reach = float(end[row][0] - begin[row][0]) * 0.5 ** np.arange(HALVINGS)
        rows, lowest = np.broadcast_to(row, reach.shape), HEIGHT_AT_ENDS * excess(row, at)[0]
        sides = (excess(rows, at + side * reach) >= lowest for side in (-1.0, 1.0))
        return sum(float(reach[np.argmax(high)]) if high.any() else 0.0 for high in sides)

    with np.errstate(all="ignore"):
        low, high = _limits(formula, numbers, t)
        row = np.flatnonzero(np.isfinite(low + high + end))
        a, b = begin[row], end[row]
        for _ in range(HALVINGS):
            parameters = {name: x[row] for name, x in flat.items()}
            lowest, highest = bounds(formula, {**parameters, "t": (a, b)})
            bound = np.broadcast_to(np.maximum(low[row] - lowest, highest - high[row]), a.shape)
            candidates = np.flatnonzero((bound > 0.0) & np.isnan(time[case[row]]))
            if len(candidates) > MOST_INTERVALS:
                largest = np.argsort(-bound[candidates], kind="stable")[:MOST_INTERVALS]
                candidates = candidates[largest]
            row, a, b = row[candidates], a[candidates], b[candidates]
            if not len(row):
                break
            middle = 0.5 * (a + b)
            hits = np.flatnonzero(excess(row, middle) > 0.0)
            # the earliest of several hits is written last
            for i in hits[np.argsort(-middle[hits], kind="stable")]:
                time[case[row[i]]] = middle[i]
                width[case[row[i]]] = width_of(row[i : i + 1], middle[i : i + 1])
            row, a, b = np.tile(row, 2), np.append(a, middle), np.append(middle, b)
    return Pulses(time, width)


def _limits(formula: Expression, numbers: Mapping[str, Floats], t: Floats) -> tuple[Floats, Floats]:
    """Return the limits beyond which a value is a pulse, for every gap, flattened over members."""
    count = t.shape[1] - 1
    indices = np.arange(count)[:, None] + np.array([-1, 0, 1, 2])
    times = np.take(t, np.clip(indices, 0, count), axis=1)
    columns = {name: np.broadcast_to(x, (len(t), count))[..., None] for name, x in numbers.items()}
    samples = np.broadcast_to(values(formula, {**columns, "t": times}), times.shape)
    # no values after the last time of a member
    samples = np.where(np.isfinite(times), samples, samples[..., 1:2])
    low, high = np.min(samples, axis=-1), np.max(samples, axis=-1)
    size = np.nanmax(
        np.abs(np.where(np.isfinite(samples), samples, np.nan)), axis=(1, 2), initial=0.0
    )
    margin = PULSE_RATIO * (high - low) + SMALLEST_PULSE * size[:, None]
    return (low - margin).ravel(), (high + margin).ravel()


def first_jump(formula: Expression, numbers: Mapping[str, float], end: float) -> float | None:
    """Return the time of the first jump of a formula in ``t`` between 0 and `end`; None if it has none.

    Parameters
    ----------
    numbers
        Values of the other names.
    """
    if not any(
        isinstance(part, Compare) or (isinstance(part, Call) and part.function not in GENTLE)
        for part in walk(formula)
    ):
        return None
    slope = derivative(formula, "t")
    node, weight = np.polynomial.legendre.leggauss(3)

    def defect(a: Floats, b: Floats) -> Floats:
        """Return the defect D of intervals."""
        t = a + 0.5 * (b - a) * (1.0 + node[:, None])
        mean = 0.5 * weight @ np.broadcast_to(values(slope, {**numbers, "t": t}), t.shape)
        ends = [np.broadcast_to(values(formula, {**numbers, "t": x}), x.shape) for x in (a, b)]
        result: Floats = np.abs(ends[1] - ends[0] - (b - a) * mean)
        return np.where(np.isfinite(result), result, 0.0)

    k = np.arange(PIECES + 1.0)
    edges = end / PIECES * (k + np.where(k % PIECES == 0.0, 0.0, UNEVEN * on_arrays.sin(1.7 * k)))
    edges = _with_pulses(formula, numbers, edges)
    with np.errstate(all="ignore"):
        size = np.abs(np.broadcast_to(values(formula, {**numbers, "t": edges}), edges.shape))
        threshold = SMALLEST_JUMP * float(np.max(size, initial=0.0, where=np.isfinite(size)))
        a, b = edges[:-1], edges[1:]
        has_defect = defect(a, b) > threshold
        a, b = a[has_defect], b[has_defect]
        for _ in range(JUMP_HALVINGS):
            middle = 0.5 * (a + b)
            left, right = defect(a, middle), defect(middle, b)
            is_left = left >= right
            a, b = np.where(is_left, a, middle), np.where(is_left, middle, b)
            has_defect = np.maximum(left, right) > threshold
            a, b = a[has_defect], b[has_defect]
    return float(b[0]) if len(b) else None


def _with_pulses(formula: Expression, numbers: Mapping[str, float], edges: Floats) -> Floats:
    """Return the ends of intervals, with further ones inside and next to pulses."""
    columns = {name: np.full((1, 1), float(value)) for name, value in numbers.items()}
    for _ in range(MOST_PULSES):
        pulses = hidden_pulses(formula, columns, edges[None])
        if np.isnan(pulses.time[0]):
            break
        around = pulses.time[0] + pulses.width[0] * np.array([-1.0, 0.0, 1.0])
        edges = np.unique(np.append(edges, np.clip(around, edges[0], edges[-1])))
    return edges


@dataclass(frozen=True)
class Switch:
    """A quantity whose changes of mode are corners or jumps of a formula."""

    quantity: Expression
    """A formula in the names of the original formula and the modes of earlier switches."""
    whole: bool
    """Whether the mode changes at every integer, not only at 0."""
    mode: str
    """Name of its mode, which is not valid in formulas of users."""


def held(
    formulas: Iterable[Expression], moving: Collection[str]
) -> tuple[tuple[Expression, ...], tuple[Switch, ...]]:
    """Return formulas in which modes replace corners and jumps, and the switches of these modes.

    Parameters
    ----------
    moving
        Names whose values change during a motion. Quantities in other names have no switch.
    """
    switches: dict[tuple[Expression, bool], Switch] = {}

    def mode(quantity: Expression, whole: bool = False) -> Name:
        key = quantity, whole
        if key not in switches:
            switches[key] = Switch(quantity, whole, f"_mode_{len(switches)}")
        return Name(switches[key].mode)

    def sides(left: Expression, right: Expression) -> tuple[Expression, Expression]:
        """Return the indicators of ``left > right`` and of ``left < right``."""
        if is_zero(left) and not is_zero(right):
            smaller, larger = sides(right, left)
            return larger, smaller
        side = mode(left if is_zero(right) else Binary("-", left, right))
        return filled("side + 1", side=side), Negate(side)

    def change(node: Expression) -> Expression:
        """Return a node without its corner or jump; its operands are already converted."""
        match node:
            case Compare("==" | "!=" as symbol, left, right) if moves("-", left, right):
                # its value differs at isolated times only
                return Number(float(symbol == "!="))
            case Compare(symbol, left, right) if moves("-", left, right):
                larger, smaller = sides(left, right)
                return larger if symbol in (">", ">=") else smaller
            case Call("min" | "max" as function, (x, y)) if moves("-", x, y):
                larger, smaller = sides(x, y)
                return Call("where", (larger, x, y) if function == "max" else (smaller, x, y))
            case Call("mod", (x, y)) if moves("/", x, y):
                return filled("x - mode*y", x=x, y=y, mode=mode(Binary("/", x, y), whole=True))
            case Call(function, (x,)) if function in _WITH_MODE and varies(x, moving):
                is_rounded = function in ("floor", "ceil", "round")
                quantity = filled("x + 0.5", x=x) if function == "round" else x
                return filled(_WITH_MODE[function], x=x, mode=mode(quantity, is_rounded))
        return node

    def moves(symbol: str, left: Expression, right: Expression) -> bool:
        return varies(Binary(symbol, left, right), moving)

    converted = tuple(map(rebuilding(change), formulas))
    return converted, tuple(switches.values())


_WITH_MODE = {
    "abs": "(2*mode + 1)*x",
    "sign": "2*mode + 1",
    "heaviside": "mode + 1",
    "floor": "mode",
    "ceil": "mode + 1",
    "round": "mode",
}
"""Functions of one argument x, given the mode of their quantity."""


def varies(node: Expression, moving: Collection[str]) -> bool:
    """Tell whether the value changes continuously during a motion, not only by jumps."""

    def changes(part: Expression, *operands: bool) -> bool:
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

    return folded([node], changes)[0]
