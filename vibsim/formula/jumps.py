"""Where a formula jumps: its derivative leaves jumps out, so that its integral is not the difference of the formula.

Over a piece of time [a, b] the difference D of ``f(b) - f(a)`` and the integral of f' vanishes for a continuous f and
a piece that is short enough. At a jump it stays what it is, however short the piece becomes. So pieces with a D are
halved, on the side where more of it lies, until it has gone or nothing is left to halve. Where a pulse lies between the
ends of a piece (`vibsim.formula.pulses`), the piece ends within it: its jumps would cancel.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibsim.formula.arrays import values
from vibsim.formula.derivative import derivative
from vibsim.formula.pulses import hidden_pulses
from vibsim.formula.tree import Call, Compare, Expression, walk

Floats = NDArray[np.float64]

PIECES = 1024
"""Of the whole interval."""
MOST_PULSES = 8
"""So many pulses between the ends of pieces are looked at."""
UNEVEN = 0.37
"""How far their ends are moved, in pieces, so that they do not keep step with a square wave."""
HALVINGS = 50
SMALL = 1e-6
"""A jump is larger than this part of the formula's largest value."""
GENTLE = frozenset(
    ("sin", "cos", "exp", "expm1", "sinh", "cosh", "tanh", "atan", "asinh", "erf", "erfc")
)
"""Functions that are smooth wherever they are taken."""


def first_jump(formula: Expression, numbers: Mapping[str, float], end: float) -> float | None:
    """Return the time of the first jump of a formula in ``t`` from 0 to `end`; None where it has none.

    Parameters
    ----------
    numbers
        Values of its other names.
    """
    if not _may_jump(formula):
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
    edges = end / PIECES * (k + np.where(k % PIECES == 0.0, 0.0, UNEVEN * np.sin(1.7 * k)))
    edges = _with_pulses(formula, numbers, edges)
    with np.errstate(all="ignore"):
        size = np.abs(np.broadcast_to(values(formula, {**numbers, "t": edges}), edges.shape))
        least = SMALL * float(np.max(size, initial=0.0, where=np.isfinite(size)))
        a, b = edges[:-1], edges[1:]
        kept = missing(a, b) > least
        a, b = a[kept], b[kept]
        for _ in range(HALVINGS):
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


def _may_jump(formula: Expression) -> bool:
    """Tell whether a formula has a function or a comparison that can jump."""
    return any(
        isinstance(part, Compare) or (isinstance(part, Call) and part.function not in GENTLE)
        for part in walk(formula)
    )
