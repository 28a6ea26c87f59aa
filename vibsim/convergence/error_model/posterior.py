"""The posterior of ladders: the probabilities of powers, windows and limits, summed over all hypotheses."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import (
    ExpectedOrder,
    Table,
    Terms,
    hypotheses_of,
    two_powers,
)
from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.error_model.likelihood import (
    TINY,
    WindowRows,
    finest_noise_log_priors,
    log_bound,
    log_sum_exp,
    scale_free,
    single_power,
    weigh_table,
    window_rows,
)
from vibsim.convergence.error_model.matrices import matvec
from vibsim.convergence.error_model.rows import Rows
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays

LEFT_OUT = 1e-11
"""Largest part of all evidence that may be skipped: it changes error bounds by less than a digit."""
MOST_TABLES, MOST_HYPOTHESES = 10, 8400
"""Upper limits of the numbers of tables and of hypotheses on a window."""
LARGEST_LOG = 600.0
"""Log evidence relative to that of no expansion is clipped here, against overflow."""
LIKELY = 1e-3
"""A window contributes to the limit if its probability, relative to the most probable window, exceeds this."""


@dataclass
class Posterior:
    """Posterior probabilities of ladders, of shape (ladder,) unless another shape is given."""

    powers: Floats  # the powers considered, increasing, shape (power,)
    grid: Floats  # these, and powers considered for other ladders only
    # The interval that each of `powers` stands for, shape (2, power): a power of an expansion stands for itself, any
    # other for the interval between its neighbours on the grid, since a second power shifts the measured order.
    reach: Floats
    orders: Floats  # order of each three successive levels, shape (ladder, n-2); see `orders_of`
    windows: list[tuple[int, int]]  # coarsest and finest level
    dominant: Floats  # this power dominates, shape (ladder, power)
    lowest: Floats  # this is the lowest power that matters, shape (ladder, power)
    highest: Floats  # this is the highest power that matters, shape (ladder, power)
    mixed: Floats  # two powers matter and neither dominates, shape (ladder, pair)
    # these two powers, shape (pair, 2); both are the same if the second one has a logarithm
    pairs: Floats
    window: Floats  # the expansion holds in this window, shape (ladder, window)
    alternating: Floats  # the sign of the error alternates from level to level
    scattered: Floats  # there is neither an expansion nor noise alone
    noise: Floats  # all levels, except some coarse ones, are noise
    # Limit minus finest level, given an expansion: mean as weights of the differences, shape (ladder, row), and mean
    # square. NaN if the exact solution is known.
    limit_weights: Floats
    limit_square: Floats

    @property
    def expansion(self) -> Floats:
        """Return the probability of an expansion in one or two powers."""
        return np.asarray(np.sum(self.window, axis=-1))

    @property
    def with_logarithm(self) -> Floats:
        """Return the probabilities of a power and the same power times a logarithm, shape (ladder, power)."""
        lower, higher = self.pairs.T
        sums = np.zeros_like(self.dominant)
        for pair in np.flatnonzero(lower == higher):
            sums[:, np.searchsorted(self.powers, lower[pair])] += self.mixed[:, pair]
        return sums

    def some(self, subset: Integers) -> Posterior:
        """Return the posterior of a subset of the ladders."""
        return replace(self, **{name: getattr(self, name)[subset] for name in self.per_ladder()})

    def update(self, ladders: Integers, source: Posterior, rows: Flags) -> None:
        """Overwrite some ladders with rows of another posterior, whose powers are a subset of these."""
        columns = np.searchsorted(self.powers, source.powers)
        for name in self.per_ladder():
            values = getattr(source, name)[rows]
            if name in ("dominant", "lowest", "highest"):
                padded = np.zeros((len(values), len(self.powers)))
                padded[:, columns] = values
                values = padded
            getattr(self, name)[ladders] = values

    def per_ladder(self) -> list[str]:
        """Return the names of the fields with one row per ladder."""
        shared = "powers", "grid", "reach", "windows", "pairs"
        return [field.name for field in fields(self) if field.name not in shared]


Subset = slice | Integers
"""Index of some ladders, or of all."""


class _Grid:
    """The powers that probabilities are counted at: those of expansions, and others next to measured orders."""

    def __init__(self, orders: Floats, terms: Terms) -> None:
        usual = np.concatenate([terms.lower, terms.higher])
        grid = np.unique(
            np.concatenate([usual, np.arange(priors.SPACING, priors.MAX_POWER, priors.SPACING)])
        )
        # of the other powers of the grid, only those nearest to a measured order are used
        nearest = np.searchsorted(0.5 * (grid[1:] + grid[:-1]), orders)
        # and both ends, which are the interval of an unknown order
        ends = np.array([0, len(grid) - 1])
        used = np.unique(np.concatenate([np.searchsorted(grid, usual), nearest.ravel(), ends]))
        neighbours = np.stack([np.append(grid[0], grid[:-1]), np.append(grid[1:], grid[-1])])
        self.grid, self.powers = grid, grid[used]
        self.reach = np.where(np.isin(grid, usual), grid, neighbours)[:, used]
        self.nearest = np.searchsorted(used, nearest)
        """Index in `powers` of each measured order, shape (ladder, n-2)."""

    def sum_by_power(self, values: Floats, powers: Floats) -> Floats:
        """Sum values of pairs, shape (ladder, pair), by the given power of each pair; shape (ladder, power)."""
        order = np.argsort(powers, kind="stable")
        distinct, start = np.unique(powers[order], return_index=True)
        sums = np.zeros((len(values), len(self.powers)))
        columns = np.searchsorted(self.powers, distinct)
        sums[:, columns] = np.add.reduceat(values[:, order], start, axis=1)
        return sums


class _Sum:
    """The sum of the evidence of all hypotheses on ladders, relative to that of rows with unrelated sizes."""

    def __init__(self, ladder: Ladder, expected: ExpectedOrder | None, left_out: float) -> None:
        self.rows, self.expected, self.exact_known = Rows(ladder), expected, ladder.exact_known
        self.terms, count, n = two_powers((1.0,), expected), len(ladder.gram), len(ladder.h)
        self.grid = _Grid(self.rows.orders, self.terms)
        self.windows = [
            (last - length, last)
            for last in range(n - 1, 1, -1)
            for length in range(min(priors.LONGEST_WINDOW, last), 1, -1)
        ]
        # of the evidence that may be skipped, half is for whole tables and half for single hypotheses
        part = 0.5 * left_out / len(self.windows)
        self.log_table = on_arrays.log(part / MOST_TABLES)
        self.log_single = on_arrays.log(part / MOST_HYPOTHESES)
        self.log_unit, self.total = self.rows.unrelated(), np.ones(count)
        self.index = np.arange(count)
        # the parts of the total that the fields of a `Posterior` are made of
        pairs, windows = len(self.terms.first_of_pairs), len(self.windows)
        self.noise, self.alternating = np.zeros(count), np.zeros(count)
        self.pairs = np.zeros((count, 3, pairs))
        self.any_power = np.zeros((count, len(self.grid.powers)))
        self.window, self.limit_square = np.zeros((2, count, windows))
        self.limit_weights = np.zeros((count, windows, n - 1))

    def add_no_expansion(self) -> None:
        """Add the hypotheses that all rows from some level on are noise, and coarser rows have unrelated sizes."""
        for level in range(len(self.rows.ladder.h) - 1):
            self.noise += self.add(slice(None), self.rows.noise_from(level))

    def add_window(self, index: int) -> None:
        """Add the hypotheses that the expansion holds on the levels of this window and on no others."""
        (start, end), rows, ladder = self.windows[index], self.rows, self.rows.ladder
        smallest = rows.differences[:, end - 1, end - 1]
        sizes = ladder.h[start : end + 1] / ladder.h[end]
        gram = rows.gram(start, end, with_exact=self.exact_known)
        if self.exact_known:
            smallest = np.minimum(smallest, gram[:, -1, -1])
            sizes, finer = np.append(sizes, 0.0), np.empty((len(smallest), 0))
        else:
            finer = rows.finer_products(start, end)
        outside = rows.outside(start, end)
        log_priors = [outside + x for x in finest_noise_log_priors(ladder.floor[:, end], smallest)]
        # rounding the sizes makes windows with equal ratios share their hypotheses
        hypotheses = hypotheses_of(tuple(np.round(sizes, 12)), self.expected)
        whole, split = (window_rows(gram, rows.points, split=x) for x in (False, True))
        for table, log_prior in zip(hypotheses.two_shapes, log_priors, strict=True):
            self.add_table(index, table, log_prior, whole, finer)
        for table, log_prior in hypotheses.of_one_shape(rows.points, log_priors[0]):
            self.add_table(index, table, log_prior, split, finer)
        self.add_any_power(index, sizes, gram, finer, log_priors[0], hypotheses.any_power_log_bound)
        for table, log_prior in zip(hypotheses.alternating, log_priors, strict=True):
            log_prior = log_prior + on_arrays.log(priors.ALTERNATING_PRIOR)
            self.add_table(None, table, log_prior, whole, finer[:, :0])

    def relevant(self, bound: Floats) -> tuple[Subset, Floats]:
        """Return the ladders for which evidence up to this bound matters, and the least that a hypothesis needs."""
        total = self.log_unit + on_arrays.log(self.total)
        keep = bound > total + self.log_table
        subset = slice(None) if np.all(keep) else np.flatnonzero(keep)
        return subset, total + self.log_single

    def add_table(
        self, index: int | None, table: Table, log_prior: Floats, rows: WindowRows, finer: Floats
    ) -> None:
        """Add the hypotheses of a table on the rows of a window; no window stands for alternating errors."""
        subset, least = self.relevant(log_prior + log_bound(table, rows))
        part = rows if isinstance(subset, slice) else WindowRows._make(x[subset] for x in rows)
        if not len(part.last_square):
            return
        log, pairs, limit, squared = weigh_table(
            table, part, finer[subset], (least - log_prior)[subset]
        )
        if not np.any(np.isfinite(log)):
            return
        if index is None:
            self.alternating[subset] += self.add(subset, log + log_prior[subset])
        else:
            weight = self.add_to_window(index, subset, log + log_prior[subset], limit, squared)
            self.pairs[subset] += weight[:, None, None] * pairs

    def add_any_power(
        self,
        index: int,
        sizes: Floats,
        gram: Floats,
        finer: Floats,
        log_prior: Floats,
        bound: Floats,
    ) -> None:
        """Add the hypotheses of one power of any value, close to the order of the finest rows of the window."""
        w = len(sizes) - 1
        triple = self.windows[index][1] - 2
        order, points = self.rows.orders[:, triple], self.rows.points
        usable = (order > 0.0) & (order < priors.MAX_POWER)
        last = np.maximum(gram[:, -1, -1], TINY)
        most = log_prior + scale_free(last, 0.0, points, w)
        most += np.where(points > 1.0, *bound[::-1])
        subset, _ = self.relevant(np.where(usable, most, -np.inf))
        order, gram = order[subset], gram[subset]
        if not len(gram):
            return
        powers = np.maximum(order[:, None] + priors.OFFSETS, TINY)
        log, gains, squares = single_power(sizes, powers, gram, points[subset, None])
        log += on_arrays.log(
            priors.ANY_POWER_PRIOR / priors.MAX_POWER * np.gradient(priors.OFFSETS)
        )
        total = log_sum_exp(log)
        limit, squared = np.zeros((len(order), w)), np.zeros(len(order))
        if not self.exact_known:
            weight = on_arrays.exp(log - total[:, None])
            products = finer[subset] * gram[:, -1:, -1]
            limit = -np.sum(weight[..., None] * gains, axis=1)
            squares += products[:, -1:] - 2.0 * np.sum(gains * products[:, None, :-1], axis=-1)
            slope = (gains[:, -1] - gains[:, 0]) / (2.0 * priors.OFFSETS[-1])
            drift = priors.DRIFT**2 * np.sum(slope * matvec(gram, slope), axis=-1)
            distance = np.min(np.abs(order[:, None] - np.array(priors.POWERS)), axis=-1)
            squares += ((distance > 0.5 * priors.SPACING) * drift)[:, None]
            squared = np.sum(weight * squares, axis=-1)
        weight = self.add_to_window(index, subset, total + log_prior[subset], limit, squared)
        self.any_power[self.index[subset], self.grid.nearest[subset, triple]] += weight

    def add_to_window(
        self, index: int, subset: Subset, log: Floats, limit: Floats, squared: Floats
    ) -> Floats:
        """Add the log evidence and the limit of an expansion in a window, and return the weights."""
        weight = self.add(subset, log)
        self.window[subset, index] += weight
        if not self.exact_known:
            (start, end), differences = self.windows[index], self.rows.differences
            limit_weights = np.zeros((len(limit), differences.shape[-1]))
            limit_weights[:, start:end] = limit
            limit_weights[:, end:] = 1.0
            # the noise of finer levels limits how well the limit is known
            if end < differences.shape[-1]:
                squared = squared + differences[subset, end, end]
            self.limit_weights[subset, index] += weight[:, None] * limit_weights
            self.limit_square[subset, index] += weight * squared
        return weight

    def add(self, subset: Subset, log: Floats) -> Floats:
        """Add log evidence of some ladders to their totals, and return it relative to that of unrelated sizes."""
        weight = on_arrays.exp(np.minimum(log - self.log_unit[subset], LARGEST_LOG))
        self.total[subset] += weight
        return np.asarray(weight)

    def posterior(self) -> Posterior:
        """Return the normalised probabilities, after all hypotheses were added."""
        grid, total, first_of_pairs = self.grid, self.total, self.terms.first_of_pairs
        pairs, first, second = np.moveaxis(self.pairs / total[:, None, None], 1, 0)
        lower, higher = self.terms.lower[first_of_pairs], self.terms.higher[first_of_pairs]
        # a power times a logarithm is no order of its own
        second = np.where(lower == higher, 0.0, second)
        mixed = pairs - first - second
        dominant = self.any_power / total[:, None]
        dominant = dominant + grid.sum_by_power(first, lower) + grid.sum_by_power(second, higher)
        limit_weights, limit_square = self._limit()
        return Posterior(
            powers=grid.powers,
            grid=grid.grid,
            reach=grid.reach,
            orders=self.rows.orders,
            windows=self.windows,
            dominant=dominant,
            mixed=mixed,
            pairs=np.stack([lower, higher], axis=-1),
            lowest=dominant + grid.sum_by_power(mixed, lower),
            highest=dominant + grid.sum_by_power(mixed, higher),
            window=self.window / total[:, None],
            alternating=self.alternating / total,
            scattered=1.0 / total,
            noise=self.noise / total,
            limit_weights=limit_weights,
            limit_square=limit_square,
        )

    def _limit(self) -> tuple[Floats, Floats]:
        """Return `limit_weights` and `limit_square` of the `Posterior`."""
        if self.exact_known:
            return np.full_like(self.rows.free, np.nan), np.full_like(self.total, np.nan)
        # improbable windows may have limits far away
        likely = self.window > LIKELY * np.max(self.window, axis=-1, keepdims=True)
        expansion = np.maximum(np.sum(self.window * likely, axis=-1), TINY)
        weights = np.sum(self.limit_weights * likely[..., None], axis=1) / expansion[:, None]
        return weights, np.sum(self.limit_square * likely, axis=1) / expansion


def posterior(
    ladder: Ladder, expected: ExpectedOrder | None = None, *, left_out: float = LEFT_OUT
) -> Posterior:
    """Return the posterior of ladders with at least three levels and finite data.

    Hypotheses are skipped that together hold at most the part `left_out` of all evidence.
    """
    evidence = _Sum(ladder, expected, left_out)
    evidence.add_no_expansion()
    for index in range(len(evidence.windows)):
        evidence.add_window(index)
    return evidence.posterior()
