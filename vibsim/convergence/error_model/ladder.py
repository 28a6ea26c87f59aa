"""What the error model reads of ladders."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vibsim.convergence.differences import orders_of_steps, safe_ratio
from vibsim.convergence.error_model.priors import POINTS
from vibsim.core.array_types import Flags, Floats, Integers


@dataclass(frozen=True)
class Ladder:
    """The data of ladders with n levels and m rows."""

    h: Floats  # step sizes, decreasing, shape (n,)
    # inner products (means over the points) of the n-1 differences and, if the exact solution is known, of the finest
    # level minus the exact solution, shape (ladder, m, m)
    gram: Floats
    floor: Floats  # predicted noise of each level in the same norm, shape (ladder, n)
    numbers: Flags  # whether the values are single numbers, shape (ladder,)
    exact_known: bool

    @property
    def points(self) -> Floats:
        """Number of independent points, shape (ladder,)."""
        return np.where(self.numbers, 1.0, POINTS)

    def some(self, subset: Integers) -> Ladder:
        """Return a subset of the ladders."""
        parts = {name: getattr(self, name)[subset] for name in ("gram", "floor", "numbers")}
        return replace(self, **parts)

    def without_exact(self) -> Ladder:
        """Return the ladders without the known exact solution."""
        m = len(self.h) - 1
        return replace(self, gram=self.gram[:, :m, :m], exact_known=False)


def orders_of(ladder: Ladder) -> Floats:
    """Return the order of each three successive levels, shape (ladder, n-2); NaN where there is none.

    It solves ``(h_0^p - h_1^p)/(h_1^p - h_2^p) = d_0/d_1``. Successive differences of opposite sign have none.
    """
    n = len(ladder.h)
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : n - 1]
    same_sign = np.diagonal(ladder.gram, 1, 1, 2)[:, : n - 2] > 0.0
    ratios = np.where(same_sign, safe_ratio(sizes[:, :-1], sizes[:, 1:]), np.nan)
    return orders_of_steps(ratios, ladder.h)
