"""The triangular scheme of `vibsim.convergence.extrapolation`, in exact fractions of the step sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from vibsim.elementary.exponential import power


@dataclass(frozen=True)
class Entry:
    """The coefficients of one entry ``T[i][j]``, j > 0, which depend only on the steps of the levels."""

    factor: float  # f of the recursion
    fall: float  # factor K by which the error of column j - 1 falls from row i - 1 to row i
    # factor by which the changes of column j - 1 fall from row i - 1 to row i; 0 if row i - 1 has no change
    change_fall: float
    coarser: float  # step ratio of the two coarsest levels to the power q: the cost of including the coarsest one
    weights: tuple[float, ...]  # absolute weights of the levels i - j to i in the combination

    def round_off(self, floors: Sequence[Any]) -> Any:
        """Return an upper bound of the round-off of the entry, from that of the levels i - j to i."""
        return sum(w * r for w, r in zip(self.weights, floors, strict=True))


Scheme = tuple[tuple[Entry, ...], ...]
"""Row i holds the entries j = 1, ..., i, up to the largest column."""


@lru_cache(maxsize=1024)
def triangular_scheme(
    steps: tuple[int, ...], p: float, q: int, columns: int | None = None
) -> Scheme:
    """Return the scheme of a ladder whose error expands in the powers p, p + q, p + 2 q, ... of the time step, p > 0.

    The numbers of steps increase; only their ratios matter. At most `columns` powers are eliminated.
    """
    n = len(steps)
    depth = n - 1 if columns is None else min(columns, n - 1)
    h = [Fraction(steps[0], count) for count in steps]
    left = [[_power(x, p + k * q) for k in range(depth)] for x in h]
    weights = [[Fraction(int(k == i)) for k in range(n)] for i in range(n)]
    rows: list[tuple[Entry, ...]] = [() for _ in steps]
    for j in range(1, depth + 1):
        size = [row[j - 1] for row in left]
        factors = {i: size[i] / (size[i - 1] - size[i]) for i in range(j, n)}
        combined = {i: _combined(weights, i, f) for i, f in factors.items()}
        for i, f in factors.items():
            changes = [size[k - 1] - size[k] for k in (i - 1, i) if k >= j]
            rows[i] += (
                Entry(
                    factor=float(f),
                    fall=float(1 + 1 / f),
                    change_fall=float(changes[0] / changes[1]) if len(changes) == 2 else 0.0,
                    coarser=float(Fraction(steps[i - j + 1], steps[i - j]) ** q),
                    weights=tuple(abs(float(w)) for w in combined[i][i - j : i + 1]),
                ),
            )
        left = [_combined(left, i, factors[i]) if i >= j else left[i] for i in range(n)]
        weights = [combined.get(i, weights[i]) for i in range(n)]
    return tuple(rows)


def _power(h: Fraction, p: float) -> Fraction:
    """Return h^p: exact for an integer p, correctly rounded for a half-integer."""
    if float(p).is_integer():
        return Fraction(h ** int(p))
    if float(2 * p).is_integer():
        return Fraction(math.sqrt(h ** int(2 * p)))
    return Fraction(power(float(h), p))


def _combined(rows: Sequence[Sequence[Fraction]], i: int, f: Fraction) -> list[Fraction]:
    return [x + f * (x - y) for x, y in zip(rows[i], rows[i - 1], strict=True)]


def next_row(
    entries: Sequence[Entry], level: Any, previous: Sequence[Any]
) -> tuple[list[Any], list[Any]]:
    """Return the row of a level, and its differences from the previous row.

    `level` is the value of the level, a float or an array; `entries` is the row of the `Scheme`.
    """
    row, changes = [level], []
    for j, coarse in enumerate(previous):
        change = row[j] - coarse
        changes.append(change)
        if j < len(entries):
            row.append(row[j] + entries[j].factor * change)
    return row, changes


def error_left(change: Any, fall: Any) -> Any:
    """Return the error of the finer of two entries that differ by `change`, if errors fall by `fall` per row."""
    return change / (fall - 1.0)


def steps_of(levels: Sequence[int]) -> tuple[int, ...]:
    """Return the numbers of steps of levels relative to the coarsest one; each level halves the step."""
    return tuple(1 << (level - levels[0]) for level in levels)
