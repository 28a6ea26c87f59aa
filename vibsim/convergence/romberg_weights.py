"""What the steps of a ladder alone say about its tableau (`vibsim.convergence.romberg`), in whole fractions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache


@dataclass(frozen=True)
class Entry:
    """What the steps of the levels say about one entry ``T[i][j]``, j > 0."""

    factor: float
    """f of the recursion."""
    fall: float
    """Factor K by which the error of column j - 1 falls from row i - 1 to row i."""
    change_fall: float
    """Factor by which the changes of column j - 1 fall from row i - 1 to row i; 0 where row i - 1 has none."""
    coarser: float
    """What the coarsest of the levels costs: the ratio of steps to the next coarser level to the power q."""
    round_off: float
    """Round-off of the entry: of the levels, times the weights of the combination."""


@dataclass(frozen=True)
class Tableau:
    """What the steps of the levels say; one for every scheme with its options."""

    entries: tuple[tuple[Entry, ...], ...]
    """Row i holds the entries j = 1, ..., i."""
    amplification: tuple[float, ...]
    """Row i: times the change of its level and ``1/(w end)^p`` this is the response of the motion to a lasting relative
    disturbance of its equation: the scheme itself disturbs it by ``(w h)^p / (2 (p+1)!)``, for central differences."""


@lru_cache(maxsize=256)
def tableau(steps: tuple[int, ...], p: int, q: int, round_off: tuple[float, ...]) -> Tableau:
    """Return the tableau of a ladder.

    Parameters
    ----------
    steps
        Number of steps of every level, strictly increasing.
    p, q
        The error expands in the powers p, p + q, p + 2 q, ... of the time step.
    round_off
        Relative round-off of every level.
    """
    h = [Fraction(steps[0], n) for n in steps]
    left = [[x ** (p + k * q) for k in range(len(steps))] for x in h]
    weights = [[Fraction(int(k == i)) for k in range(len(steps))] for i in range(len(steps))]
    rows: list[tuple[Entry, ...]] = [() for _ in steps]
    for j in range(1, len(steps)):
        factors = {
            i: left[i][j - 1] / (left[i - 1][j - 1] - left[i][j - 1]) for i in range(j, len(steps))
        }
        for i, f in factors.items():
            changes = [left[k - 1][j - 1] - left[k][j - 1] for k in (i - 1, i) if k >= j]
            rows[i] += (
                Entry(
                    factor=float(f),
                    fall=float(1 + 1 / f),
                    change_fall=float(changes[0] / changes[1]) if len(changes) == 2 else 0.0,
                    coarser=float(Fraction(steps[i - j + 1], steps[i - j]) ** q),
                    round_off=_sum(_combined(weights, i, f), round_off),
                ),
            )
        left = [_combined(left, i, factors[i]) if i >= j else left[i] for i in range(len(steps))]
        weights = [
            _combined(weights, i, factors[i]) if i >= j else weights[i] for i in range(len(steps))
        ]
    amplification = [0.0] + [
        2.0 * math.factorial(p + 1) * (1.0 + row[0].factor) * float(n) ** p
        for row, n in zip(rows[1:], steps[:-1], strict=True)
    ]
    return Tableau(tuple(rows), tuple(amplification))


def _combined(rows: Sequence[Sequence[Fraction]], i: int, f: Fraction) -> list[Fraction]:
    return [x + f * (x - y) for x, y in zip(rows[i], rows[i - 1], strict=True)]


def _sum(weights: Sequence[Fraction], round_off: Sequence[float]) -> float:
    return sum(abs(float(w)) * r for w, r in zip(weights, round_off, strict=True))
