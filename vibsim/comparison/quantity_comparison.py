"""One quantity compared between levels: its series, and the numbers derived from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from vibsim.apriori.formal_orders import (
    even_powers,
    orders_on_oscillator,
    special_orders,
)
from vibsim.apriori.roundoff_floor import norm_of_floor
from vibsim.comparison import thresholds as th
from vibsim.comparison.rescaled_differences import coincidence
from vibsim.convergence import differences
from vibsim.convergence.extrapolation.series import extrapolate_series
from vibsim.convergence.thresholds import ROUND_OFF_SAFETY
from vibsim.convergence.verdict import Judgement
from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.observe.member_block import MemberBlock, by_level


@dataclass(frozen=True)
class InNorm:
    """A quantity in a norm over time."""

    difference: Floats  # norm of the differences of successive levels, shape (scheme, case, pair)
    error: Floats  # norm of exact minus computed, shape (scheme, case, level); NaN if unknown
    extrapolation: Floats  # norm of exact minus extrapolated, shape (scheme, case); NaN if unknown


def interleaved(parts: Sequence[Floats]) -> Floats:
    """Return the series of a vector: those of its coordinates, one after the other at each time."""
    by_time = np.stack([np.moveaxis(series, -1, 0) for series in parts], axis=1)
    return np.moveaxis(by_time.reshape(-1, *by_time.shape[2:]), 0, -1)


def root_mean_square(numbers: Sequence[Floats]) -> Floats:
    """Return the noise, size or bound of a vector at one point, from those of its coordinates."""
    return np.asarray(differences.length(np.stack(numbers, axis=-1)) / np.sqrt(len(numbers)))


@dataclass(frozen=True)
class Comparison:
    """One quantity at each level, on the common grid; series have the shape (scheme, case, t).

    Those of a vector have every coordinate at each time (`interleaved`).
    """

    block: MemberBlock
    name: str
    long_name: str
    units: str
    values: list[Floats]  # per level, coarse to fine
    exact: Floats | None  # broadcasts against a series
    order: Floats  # formal order, shape (scheme, 1 or case)
    floor: Floats  # predicted round-off at one point, shape (scheme, case, level)
    scale: Floats  # size that round-off is relative to, shape (scheme, case)
    blur: Floats  # measurement error without rounding, shape (scheme, case, level)
    parts: tuple[Comparison, ...] = ()  # the coordinates of a vector
    # cached judgements with the usual tolerance, by norm and expected order
    judged: dict[tuple[str, float | str], Judgement] = field(default_factory=dict, repr=False)
    _norms: dict[str, InNorm] = field(default_factory=dict, repr=False)

    @property
    def power(self) -> Floats:
        """Order by which differences are rescaled: 0 if the quantity is promised to be exact."""
        return np.where(np.isinf(self.order), 0.0, self.order)

    @cached_property
    def special(self) -> Floats:
        """Highest order of the scheme in a special case, shape (scheme, 1 or case)."""
        return special_orders(self.block.experiment, self.name, self.block.columns)

    @cached_property
    def lowest(self) -> Floats:
        """The promised order, or that of the scheme on the linear oscillator if that is lower but converges."""
        found = orders_on_oscillator(self.block.experiment, self.name, self.block.columns)
        is_lower = (found >= 1.0) & (found < self.order) & np.isfinite(self.order)
        return np.where(is_lower, found, self.order)

    @cached_property
    def differences(self) -> list[Floats]:
        """Level minus next level; NaN for adaptive schemes, which have no levels."""
        # the difference of two infinite values is NaN
        with np.errstate(over="ignore", invalid="ignore"):
            results = [coarse - fine for coarse, fine in pairwise(self.values)]
        if self.block.adaptive.any():
            for d in results:
                d[self.block.adaptive] = np.nan
        return results

    @cached_property
    def errors(self) -> list[Floats] | None:
        """Exact minus level; None if the exact solution is unknown."""
        if self.exact is None:
            return None
        with np.errstate(over="ignore", invalid="ignore"):
            return [self.exact - u for u in self.values]

    @cached_property
    def extrapolation(self) -> tuple[Floats, Floats]:
        """Extrapolation to a vanishing step, and its error bound; if lean, or of a vector, only the largest one."""
        block = self.block
        if self.parts:
            values = interleaved([q.extrapolation[0] for q in self.parts])
            return values, root_mean_square([q.largest_bound for q in self.parts])[..., None]
        even = even_powers(block.experiment, self.name, block.columns)
        order = np.where(np.isinf(self.order), th.EXACT_ORDER, self.order)
        value, bound = extrapolate_series(
            self.values, block.grid.levels, order, even, largest=block.lean
        )
        bound = block.safety(th.IRREGULAR)[:, None] * bound
        unseen = block.unseen_at_corner(self.scale)[..., None]
        return value, bound + ROUND_OFF_SAFETY * self.floor[..., -1:] + unseen

    @property
    def is_motion(self) -> bool:
        """Whether this is a state or a vector of states."""
        return bool(self.parts) or self.name in (state.name for state in self.block.model.states)

    @property
    def points(self) -> int:
        """Number of points of a series."""
        return len(self.block.grid.t) * self.width

    @property
    def width(self) -> int:
        """Number of coordinates of a vector, else 1."""
        return max(len(self.parts), 1)

    @property
    def end_included(self) -> int:
        """Number of points at the end of the run, 0 if that is not a common time."""
        return self.block.grid.end_included * self.width

    @property
    def largest_bound(self) -> Floats:
        """The largest bound over time, shape (scheme, case)."""
        # a bound never decreases with time
        return self.extrapolation[1][..., -1]

    @cached_property
    def beyond_the_bound(self) -> Floats:
        """Largest distance of the extrapolated series from the exact one; 0 where its bound may allow it.

        If storage is bounded it is the root mean square.
        """
        if self.exact is None:
            return np.zeros(self.block.shape)
        norm = TYPICAL_NORM if self.block.lean else "linf"
        size = norm_of_floor(np.ones(1), norm, self.points, self.block.grid.spacing)
        with np.errstate(invalid="ignore", over="ignore"):
            distance = self.in_norm(norm).extrapolation / size
            allowed = th.WRONG_LIMIT * (self.largest_bound + self.blur[..., -1])
            return np.where(distance > allowed, distance, 0.0)

    @property
    def bound_of_length(self) -> Floats:
        """The largest bound over time; for a vector, that of its length."""
        return np.asarray(self.largest_bound * np.sqrt(self.width))

    @cached_property
    def are_numbers(self) -> Flags:
        """Whether the levels differ at no more than two points, shape (scheme, case)."""
        if not self.differences:
            return np.zeros(self.block.shape, dtype=bool)
        d = self.differences[-1]
        threshold = th.VANISHING_POINT * differences.largest(d)[..., None]
        count = np.count_nonzero((d > threshold) | (d < -threshold), axis=-1)
        return np.asarray(count <= th.SHAPELESS_POINTS)

    def in_norm(self, kind: str) -> InNorm:
        """Measure the quantity in a norm."""
        if kind not in self._norms:
            self._norms[kind] = self._measured(kind)
        return self._norms[kind]

    def cosines(self, kind: str) -> Floats:
        """Return the cosines between the differences and, if known, the last error, (scheme, case, row, row)."""
        rows = self.differences + ([] if self.errors is None else [-self.errors[-1]])
        if not rows:
            # a single level whose error is unknown
            return np.zeros((*self.block.shape, 0, 0))
        return differences.cosines(rows, kind, self.end_included)

    def combined(self, kind: str, rows: Flags, first: int, weights: Floats) -> Floats:
        """Return the norm of a weighted sum of successive differences, starting with index `first`.

        `rows` selects schemes and members, shape (scheme, case); the result is flat.
        """
        terms = zip(weights, self.differences[first:], strict=False)
        combination = sum((w * d[rows] for w, d in terms), np.zeros(1))
        spacing = np.broadcast_to(self.block.grid.spacing, self.block.shape)[rows]
        return differences.norm(combination, kind, spacing, self.end_included)

    def _measured(self, kind: str) -> InNorm:
        grid, shape, errors = self.block.grid, self.block.shape, self.errors

        def by_levels(rows: list[Floats]) -> Floats:
            return by_level(rows) if rows else np.empty((*shape, 0))

        def norm(series: Floats) -> Floats:
            return differences.norm(series, kind, grid.spacing, self.end_included)

        unknown = np.full((*shape, len(grid.levels)), np.nan)
        error_of_limit = None if self.exact is None else self.exact - self.extrapolation[0]
        return InNorm(
            difference=by_levels([norm(x) for x in self.differences]),
            error=unknown if errors is None else by_levels([norm(e) for e in errors]),
            extrapolation=unknown[..., 0] if error_of_limit is None else norm(error_of_limit),
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
        return by_level([coincidence(a, b, ratio) for (a, b), ratio in pairs])

    def ratios(self, kind: str) -> Floats:
        """Return the ratio of successive differences in a norm, shape (scheme, case, triple)."""
        norms = self.in_norm(kind).difference
        return differences.safe_ratio(norms[..., :-1], norms[..., 1:])

    def observed_orders(self, kind: str) -> Floats:
        """Return the order of each triple in a norm, shape (scheme, case, triple)."""
        return differences.local_orders(self.ratios(kind), self.block.grid.levels)


Compared = Mapping[str, Comparison]
"""Quantities of a block, compared between levels, by name."""
