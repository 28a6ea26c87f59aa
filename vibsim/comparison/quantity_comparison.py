"""One quantity compared between levels: its series, and the numbers that are made of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from vibsim.apriori.formal_orders import even_powers, special_orders
from vibsim.comparison import thresholds as th
from vibsim.convergence import differences
from vibsim.convergence.extrapolation import extrapolate_series
from vibsim.convergence.thresholds import ROUND_OFF_SAFETY
from vibsim.convergence.verdict import Judgement
from vibsim.core.array_types import Flags, Floats
from vibsim.observe.member_block import MemberBlock, by_level


@dataclass(frozen=True)
class InNorm:
    """A quantity in a norm over time."""

    difference: Floats  # of successive levels, shape (scheme, case, pair)
    error: Floats  # exact less computed, shape (scheme, case, level); NaN where not known
    extrapolation: Floats  # exact less extrapolated, shape (scheme, case)


@dataclass(frozen=True)
class Comparison:
    """One quantity at every level, on the common grid; series have the shape (scheme, case, t)."""

    block: MemberBlock
    name: str
    long_name: str
    units: str
    values: list[Floats]  # per level, coarse to fine
    exact: Floats | None  # broadcasts against a series
    order: Floats  # formal order, shape (scheme, 1 or case)
    floor: Floats  # predicted round-off at one point, shape (scheme, case, level)
    scale: Floats  # size that round-off is relative to, shape (scheme, case)
    blur: Floats  # what it is measured wrong by, rounding apart, shape (scheme, case, level)
    # judgements with the usual tolerance that were made so far, by norm and expected order
    judged: dict[tuple[str, float | str], Judgement] = field(default_factory=dict, repr=False)
    _norms: dict[str, InNorm] = field(default_factory=dict, repr=False)

    @property
    def power(self) -> Floats:
        """Order by which differences are rescaled: 0 where the quantity is promised to be exact."""
        return np.where(np.isinf(self.order), 0.0, self.order)

    @cached_property
    def special(self) -> Floats:
        """Highest order of the scheme in a special case, shape (scheme, 1 or case)."""
        return special_orders(self.block.experiment, self.name, self.block.columns)

    @cached_property
    def differences(self) -> list[Floats]:
        """Level minus next level; NaN for a scheme that has no levels."""
        # two levels without bound have no difference
        with np.errstate(over="ignore", invalid="ignore"):
            found = [coarse - fine for coarse, fine in pairwise(self.values)]
        if self.block.adaptive.any():
            for d in found:
                d[self.block.adaptive] = np.nan
        return found

    @cached_property
    def errors(self) -> list[Floats] | None:
        """Exact minus level; None where the exact solution is not known."""
        if self.exact is None:
            return None
        with np.errstate(over="ignore", invalid="ignore"):
            return [self.exact - u for u in self.values]

    @cached_property
    def extrapolation(self) -> tuple[Floats, Floats]:
        """Extrapolation to a vanishing step, and the bound of its error; for a lean part its largest value only."""
        block = self.block
        even = even_powers(block.experiment, self.name, block.columns)
        order = np.where(np.isinf(self.order), th.EXACT_ORDER, self.order)
        value, bound = extrapolate_series(
            self.values, block.grid.levels, order, even, largest=block.lean
        )
        bound = block.safety(th.IRREGULAR)[:, None] * bound
        unseen = block.unseen_at_corner(self.scale)[..., None]
        return value, bound + ROUND_OFF_SAFETY * self.floor[..., -1:] + unseen

    @property
    def largest_bound(self) -> Floats:
        """The largest bound over time, shape (scheme, case)."""
        # a bound never falls with time
        return self.extrapolation[1][..., -1]

    @cached_property
    def are_numbers(self) -> Flags:
        """Whether the levels differ at no more than two points, shape (scheme, case)."""
        if not self.differences:
            return np.zeros(self.block.shape, dtype=bool)
        d = self.differences[-1]
        least = th.VANISHING_POINT * differences.largest(d)[..., None]
        count = np.count_nonzero((d > least) | (d < -least), axis=-1)
        return np.asarray(count <= th.SHAPELESS_POINTS)

    def in_norm(self, kind: str) -> InNorm:
        """Measure the quantity in a norm."""
        if kind not in self._norms:
            self._norms[kind] = self._measured(kind)
        return self._norms[kind]

    def cosines(self, kind: str) -> Floats:
        """Return cosines between the differences, and the last error where known, shape (scheme, case, row, row)."""
        rows = self.differences + ([] if self.errors is None else [-self.errors[-1]])
        if not rows:
            # of a single level whose error is not known
            return np.zeros((*self.block.shape, 0, 0))
        return differences.cosines(rows, kind, self.block.grid.end_included)

    def combined(self, kind: str, rows: Flags, first: int, weights: Floats) -> Floats:
        """Return the norm of a weighted sum of successive differences from a first one on, shape (count of rows,).

        `rows` says of which schemes and members, shape (scheme, case).
        """
        grid = self.block.grid
        parts = zip(weights, self.differences[first:], strict=False)
        whole = sum((w * d[rows] for w, d in parts), np.zeros(1))
        spacing = np.broadcast_to(grid.spacing, self.block.shape)[rows]
        return differences.norm(whole, kind, spacing, grid.end_included)

    def _measured(self, kind: str) -> InNorm:
        grid, shape, errors = self.block.grid, self.block.shape, self.errors

        def stacked(rows: list[Floats]) -> Floats:
            return by_level(rows) if rows else np.empty((*shape, 0))

        def size(of: Floats) -> Floats:
            return differences.norm(of, kind, grid.spacing, grid.end_included)

        unknown = np.full((*shape, len(grid.levels)), np.nan)
        of_limit = None if self.exact is None else self.exact - self.extrapolation[0]
        return InNorm(
            difference=stacked([size(x) for x in self.differences]),
            error=unknown if errors is None else stacked([size(e) for e in errors]),
            extrapolation=unknown[..., 0] if of_limit is None else size(of_limit),
        )

    @cached_property
    def coincidence(self) -> Floats:
        """Relative distance of the rescaled differences, shape (scheme, case, triple); NaN without a finite order."""
        levels = self.block.grid.levels
        order = np.where(np.isinf(self.order), np.nan, self.order)
        ratios = [
            differences.target_ratio(order, levels[i : i + 3]) for i in range(len(levels) - 2)
        ]
        pairs = zip(pairwise(self.differences), ratios, strict=True)
        return by_level([differences.coincidence(a, b, ratio) for (a, b), ratio in pairs])

    def ratios(self, kind: str) -> Floats:
        """Return the ratio of successive differences in a norm, shape (scheme, case, triple)."""
        norms = self.in_norm(kind).difference
        return differences.safe_ratio(norms[..., :-1], norms[..., 1:])

    def observed_orders(self, kind: str) -> Floats:
        """Return the order of every triple in a norm, shape (scheme, case, triple)."""
        return differences.local_orders(self.ratios(kind), self.block.grid.levels)


Compared = Mapping[str, Comparison]
"""Quantities by name, compared between the levels of a block."""
