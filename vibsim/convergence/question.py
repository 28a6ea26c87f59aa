"""The question about ladders: the order that they are judged by, and how exact levels are expected to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.convergence.error_model.hypotheses import ExpectedOrder
from vibsim.convergence.thresholds import (
    HALF_SPACING,
    NOISE_FACTOR,
    STATED_LIMIT_FACTOR,
    STATED_NOISE_FACTOR,
)
from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import ORDER_TOLERANCE


@dataclass(frozen=True)
class Question:
    """The order that ladders are judged by; without an expected one, any order that is certain enough passes."""

    expected: float | None = None
    """Expected order."""
    at_least: float | None = None
    """Least expected order."""
    tolerance: float = ORDER_TOLERANCE
    """Largest distance of an order from `expected`, or below `at_least`."""
    is_noise_stated: bool = False
    """Whether the user states the noise of the levels; otherwise it is predicted."""
    by_theory: bool = False
    """Whether theory promises the expected order."""
    may_be_exact: bool = True
    """Whether levels that differ by noise only are exact; otherwise the caller decides that."""

    def is_met_by(self, order: Floats, likely: Floats) -> Flags:
        """Say which measured orders are nearer to the expected one than to the next order of an expansion.

        Orders of expansions are 0.5 apart, those that theory promises are 1 apart. Where any order will do, the most
        probable power, `likely`, counts as the expected one.
        """
        margin = max(self.tolerance, (2.0 if self.by_theory else 1.0) * HALF_SPACING)
        if self.expected is None and self.at_least is not None:
            return np.asarray(order >= self.at_least - margin)
        target = likely if self.expected is None else self.expected
        return np.asarray(np.abs(order - target) <= margin)

    @property
    def noise_factor(self) -> float:
        """The largest ratio of actual noise to `Ladder.floor` for which levels count as equal."""
        return STATED_NOISE_FACTOR if self.is_noise_stated else NOISE_FACTOR

    @property
    def limit_factor(self) -> float:
        """The same for the finest level and the exact solution."""
        return STATED_LIMIT_FACTOR if self.is_noise_stated else NOISE_FACTOR

    @property
    def expected_order(self) -> ExpectedOrder | None:
        """The expected order, or the least one, which has a prior of its own."""
        order = self.at_least if self.expected is None else self.expected
        return None if order is None else ExpectedOrder(order, self.by_theory)
