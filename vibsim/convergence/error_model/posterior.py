"""The posterior of ladders: the probabilities of powers, windows and limits, summed over all hypotheses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from vibsim.convergence.differences import orders_of_steps, safe_ratio
from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import (
    ExpectedOrder,
    Table,
    hypotheses_of,
    level_differences,
    matvec,
    noise_of_rows,
    two_powers,
)
from vibsim.convergence.error_model.likelihood import (
    TINY,
    WindowRows,
    finest_noise_log_priors,
    free_row_evidence,
    log_bound,
    log_sum_exp,
    noise_evidence,
    scale_free,
    single_power,
    weigh_table,
    window_rows,
)
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays

LEFT_OUT = 1e-11
"""Largest part of all evidence that may be skipped: it changes error bounds by less than a digit."""
MOST_TABLES, MOST_HYPOTHESES = 10, 7300
"""Upper limits of the numbers of tables and of hypotheses on a window."""
LARGEST_LOG = 600.0
"""Log evidence relative to that of no expansion is clipped here, against overflow."""
LIKELY = 1e-3
"""A window contributes to the limit if its probability, relative to the most probable window, exceeds this."""


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
        return np.where(self.numbers, 1.0, priors.POINTS)

    def some(self, subset: Integers) -> Ladder:
        """Return a subset of the ladders."""
        parts = {name: getattr(self, name)[subset] for name in ("gram", "floor", "numbers")}
        return replace(self, **parts)

    def without_exact(self) -> Ladder:
        """Return the ladders without the known exact solution."""
        m = len(self.h) - 1
        return replace(self, gram=self.gram[:, :m, :m], exact_known=False)


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
    pairs: Floats  # these two powers, shape (pair, 2)
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


def orders_of(ladder: Ladder) -> Floats:
    """Return the order of each three successive levels, shape (ladder, n-2); NaN where there is none.

    It solves ``(h_0^p - h_1^p)/(h_1^p - h_2^p) = d_0/d_1``. Successive differences of opposite sign have none.
    """
    n = len(ladder.h)
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : n - 1]
    same_sign = np.diagonal(ladder.gram, 1, 1, 2)[:, : n - 2] > 0.0
    ratios = np.where(same_sign, safe_ratio(sizes[:, :-1], sizes[:, 1:]), np.nan)
    return orders_of_steps(ratios, ladder.h)


Subset = slice | Integers
"""Index of some ladders, or of all."""


class _Fit:
    """Accumulates the evidence of hypotheses, window by window."""

    def __init__(self, ladder: Ladder, expected: ExpectedOrder | None, left_out: float) -> None:
        self.ladder, self.points, self.expected = ladder, ladder.points, expected
        terms = two_powers((1.0,), expected)
        usual = np.concatenate([terms.lower, terms.higher])
        grid = np.unique(
            np.concatenate([usual, np.arange(priors.SPACING, priors.MAX_POWER, priors.SPACING)])
        )
        self.orders = orders_of(ladder)
        # of the other powers of the grid, only those nearest to a measured order are used
        nearest = np.searchsorted(0.5 * (grid[1:] + grid[:-1]), self.orders)
        # and both ends, which are the interval of an unknown order
        ends = np.array([0, len(grid) - 1])
        used = np.unique(np.concatenate([np.searchsorted(grid, usual), nearest.ravel(), ends]))
        self.grid, self.powers, self.nearest = grid, grid[used], np.searchsorted(used, nearest)
        neighbours = np.stack([np.append(grid[0], grid[:-1]), np.append(grid[1:], grid[-1])])
        self.reach = np.where(np.isin(grid, usual), grid, neighbours)[:, used]
        count, n = len(ladder.gram), len(ladder.h)
        self.windows = [
            (last - length, last)
            for last in range(n - 1, 1, -1)
            for length in range(min(priors.LONGEST_WINDOW, last), 1, -1)
        ]
        # of the evidence that may be skipped, half is for whole tables and half for single hypotheses
        share = 0.5 * left_out / len(self.windows)
        self.log_table, self.log_single = (
            on_arrays.log(share / x) for x in (MOST_TABLES, MOST_HYPOTHESES)
        )
        # rounding of a level is relative to the largest difference at this and finer levels
        squares = np.diagonal(ladder.gram, axis1=1, axis2=2)[:, : n - 1]
        largest = np.maximum.accumulate(squares[:, ::-1], axis=-1)[:, ::-1]
        largest = np.concatenate([largest, largest[:, -1:]], axis=-1)
        # it is added to the Gram matrix, so that no difference is smaller
        self.rounding = priors.ROUNDING * (ladder.floor**2 + priors.EPSILON**2 * largest + TINY)
        self.differences = self.gram(0, n - 1)
        self.free_rows = free_row_evidence(self.differences, self.points) - priors.FREE_PENALTY
        # all evidence is relative to that of differences with unrelated sizes
        self.log_unit = np.sum(self.free_rows, axis=-1)
        if ladder.exact_known:
            # the true error of the coarsest level may have any size, too
            squared = np.maximum(self.gram(0, 0, with_exact=True)[:, 0, 0], TINY)
            evidence = scale_free(squared, 0.0, self.points, 1)
            self.log_unit = self.log_unit + (evidence - priors.FREE_PENALTY)
        self.finer_by_end = {end: self.finer_rows(end) for end in range(2, n)}
        self.total, self.index = np.ones(count), np.arange(count)
        pairs, windows = len(terms.first_of_pairs), len(self.windows)
        shapes: dict[str, tuple[int, ...]] = {
            **dict.fromkeys(("alternating", "noise"), ()),
            "pairs": (3, pairs),
            **dict.fromkeys(("window", "limit_square"), (windows,)),
            "any_power": (len(self.powers),),
            "limit_weights": (windows, n - 1),
        }
        self.values = {name: np.zeros((count, *shape)) for name, shape in shapes.items()}

    def add_window(self, index: int) -> None:
        """Add the hypotheses that the expansion holds on the levels of this window and on no others."""
        start, end = self.windows[index]
        ladder = self.ladder
        outside = np.sum(self.free_rows[:, :start], axis=-1)
        for evidence in self.finer_by_end[end]:
            outside += evidence
        smallest = self.differences[:, end - 1, end - 1]
        sizes = ladder.h[start : end + 1] / ladder.h[end]
        gram, finer = self.gram(start, end), np.empty((len(outside), 0))
        if ladder.exact_known:
            gram = self.gram(start, end, with_exact=True)
            smallest = np.minimum(smallest, gram[:, -1, -1])
            sizes = np.append(sizes, 0.0)
        else:
            finer = self.finer_products(start, end)
        log_priors = [outside + x for x in finest_noise_log_priors(ladder.floor[:, end], smallest)]
        # rounding the sizes makes windows with equal ratios share their hypotheses
        hypotheses = hypotheses_of(tuple(np.round(sizes, 12)), self.expected)
        tables = [(table, log_priors[i]) for i, table in enumerate(hypotheses.two_shapes)]
        # numbers have no shape
        has_shape = self.points > 1.0
        own_shape = np.where(has_shape, priors.OWN_SHAPE_PRIOR, 0.0)
        with np.errstate(divide="ignore"):
            multiple, with_shape = (
                log_priors[0] + on_arrays.log(priors.JITTER_PRIOR * x)
                for x in (1.0 - own_shape, own_shape)
            )
            one_shape = log_priors[0] + on_arrays.log(priors.ONE_SHAPE_PRIOR * has_shape)
        tables += [
            (table, multiple + on_arrays.log(p))
            for table, p in zip(hypotheses.factors, priors.JITTER_PRIORS, strict=True)
        ]
        tables += [(hypotheses.factors_with_shape, with_shape), (hypotheses.one_shape, one_shape)]
        data = [window_rows(gram, self.points, split=x) for x in (False, True)]
        for table, prior in tables:
            self.add_table(index, table, prior, data, finer)
        self.add_any_power(index, sizes, gram, finer, log_priors[0], hypotheses.any_power_log_bound)
        for i, table in enumerate(hypotheses.alternating):
            prior = log_priors[i] + on_arrays.log(priors.ALTERNATING_PRIOR)
            self.add_table(index, table, prior, data, finer[:, :0], name="alternating")

    def relevant(self, bound: Floats) -> tuple[Subset, Floats]:
        """Return the ladders for which evidence up to this bound matters, and the least that a hypothesis needs."""
        total = self.log_unit + on_arrays.log(self.total)
        keep = bound > total + self.log_table
        subset = slice(None) if np.all(keep) else np.flatnonzero(keep)
        return subset, total + self.log_single

    def add_table(
        self,
        index: int,
        table: Table,
        prior: Floats,
        data: list[WindowRows],
        finer: Floats,
        *,
        name: str = "window",
    ) -> None:
        """Add the hypotheses of a table on the rows of a window."""
        rows = data[table.orthogonal_forms is not None]
        subset, least = self.relevant(prior + log_bound(table, rows))
        part = rows if isinstance(subset, slice) else WindowRows._make(x[subset] for x in rows)
        if not len(part.last_square):
            return
        log, pairs, limit, squared = weigh_table(
            table, part, finer[subset], (least - prior)[subset]
        )
        if not np.any(np.isfinite(log)):
            return
        if name == "window":
            weight = self.add_to_window(index, subset, log + prior[subset], limit, squared)
            self.values["pairs"][subset] += weight[:, None, None] * pairs
        else:
            self.values[name][subset] += self.add_to_total(subset, log + prior[subset])

    def add_to_total(self, subset: Subset, log: Floats) -> Floats:
        """Add log evidence of some ladders to their totals, and return it relative to that of no expansion."""
        weight = on_arrays.exp(np.minimum(log - self.log_unit[subset], LARGEST_LOG))
        self.total[subset] += weight
        return np.asarray(weight)

    def gram(self, start: int, end: int, *, with_exact: bool = False) -> Floats:
        """Return the Gram matrix of the rows from level `start` to level `end`, and of the true error of the latter."""
        gram = self.ladder.gram
        noise = noise_of_rows(self.rounding[:, start : end + 1])
        if not with_exact:
            return np.asarray(gram[:, start:end, start:end] + noise)
        count = end - start
        result = np.zeros((len(gram), count + 1, count + 1))
        result[:, :count, :count] = gram[:, start:end, start:end] + noise
        # the error of a level is the sum of all finer differences and of the error of the finest level
        with_error = np.sum(gram[:, :, end:], axis=-1)
        result[:, :count, count] = result[:, count, :count] = with_error[:, start:end]
        result[:, count, count] = np.sum(with_error[:, end:], axis=-1) + self.rounding[:, end]
        if count:
            result[:, count - 1, count] -= self.rounding[:, end]
            result[:, count, count - 1] -= self.rounding[:, end]
        return result

    def finer_rows(self, end: int) -> tuple[Floats, Floats]:
        """Return the log evidence that all rows finer than level `end` are noise, and a log probability.

        That is the probability that noise hides the expansion there. Noise of size s < D hides a difference D with the
        probability ``(s/D)^N``. D falls by the order of the finest levels of the window; if there is no such order,
        nothing needs to be hidden.
        """
        sizes, floor = self.ladder.h[end - 1 :] / self.ladder.h[end], self.ladder.floor[:, end:]
        order = np.clip(self.orders[:, end - 2, None], priors.POWERS[0], priors.MAX_POWER)
        falls = level_differences(on_arrays.power(sizes, order))
        norms = np.sqrt(np.diagonal(self.differences, axis1=1, axis2=2)[:, end - 1 :])
        remaining = np.maximum(norms[:, :1] * falls[:, 1:] / falls[:, :1], TINY)
        largest = np.max(norms[:, 1:], axis=-1, initial=0.0)
        hidden = np.fmin(on_arrays.log(np.maximum(largest, floor[:, 0])[:, None] / remaining), 0.0)
        rows = self.differences[:, end:, end:]
        noise = noise_evidence(self.ladder.h[end:], rows, self.points, floor)
        return noise, self.points * np.sum(hidden, axis=-1)

    def finer_products(self, start: int, end: int) -> Floats:
        """Return the argument `finer` of `kernel` for this window."""
        with_finer = np.sum(self.differences[:, :, end:], axis=-1)
        square = np.sum(with_finer[:, end:], axis=-1, keepdims=True)
        last = np.maximum(self.differences[:, end - 1, end - 1], TINY)
        products = np.concatenate([with_finer[:, start:end], square], axis=-1)
        return np.asarray(products / last[:, None])

    def add_to_window(
        self, index: int, subset: Subset, log: Floats, limit: Floats, squared: Floats
    ) -> Floats:
        """Add the log evidence and the limit of an expansion in a window, and return the weights."""
        weight = self.add_to_total(subset, log)
        self.values["window"][subset, index] += weight
        if not self.ladder.exact_known:
            (start, end), n = self.windows[index], len(self.ladder.h)
            limit_weights = np.zeros((len(limit), n - 1))
            limit_weights[:, start:end] = limit
            limit_weights[:, end:] = 1.0
            # the noise of finer levels limits how well the limit is known
            if end < n - 1:
                squared = squared + self.differences[subset, end, end]
            self.values["limit_weights"][subset, index] += weight[:, None] * limit_weights
            self.values["limit_square"][subset, index] += weight * squared
        return weight

    def add_any_power(
        self,
        index: int,
        sizes: Floats,
        gram: Floats,
        finer: Floats,
        prior: Floats,
        bound: Floats,
    ) -> None:
        """Add the hypotheses of one power of any value, close to the order of the finest rows of the window."""
        w = len(sizes) - 1
        order = self.orders[:, self.windows[index][1] - 2]
        usable = (order > 0.0) & (order < priors.MAX_POWER)
        last = np.maximum(gram[:, -1, -1], TINY)
        most = prior + scale_free(last, 0.0, self.points, w)
        most += np.where(self.points > 1.0, *bound[::-1])
        subset, _ = self.relevant(np.where(usable, most, -np.inf))
        order, points, gram = order[subset], self.points[subset, None], gram[subset]
        if not len(gram):
            return
        log, gains, squares = single_power(
            sizes, np.maximum(order[:, None] + priors.OFFSETS, TINY), gram, points
        )
        log += on_arrays.log(
            priors.ANY_POWER_PRIOR / priors.MAX_POWER * np.gradient(priors.OFFSETS)
        )
        total = log_sum_exp(log)
        limit, squared = np.zeros((len(order), w)), np.zeros(len(order))
        if not self.ladder.exact_known:
            weight = on_arrays.exp(log - total[:, None])
            products = finer[subset] * gram[:, -1:, -1]
            limit = -np.sum(weight[..., None] * gains, axis=1)
            squares += products[:, -1:] - 2.0 * np.sum(gains * products[:, None, :-1], axis=-1)
            slope = (gains[:, -1] - gains[:, 0]) / (2.0 * priors.OFFSETS[-1])
            drift = priors.DRIFT**2 * np.sum(slope * matvec(gram, slope), axis=-1)
            distance = np.min(np.abs(order[:, None] - np.array(priors.POWERS)), axis=-1)
            squares += ((distance > 0.5 * priors.SPACING) * drift)[:, None]
            squared = np.sum(weight * squares, axis=-1)
        weight = self.add_to_window(index, subset, total + prior[subset], limit, squared)
        nearest = self.nearest[subset, self.windows[index][1] - 2]
        self.values["any_power"][self.index[subset], nearest] += weight

    def add_no_expansion(self) -> None:
        """Add the hypotheses that all rows from some level on are noise, and coarser rows have unrelated sizes."""
        ladder, n = self.ladder, len(self.ladder.h)
        for k in range(n - 1):
            log = np.sum(self.free_rows[:, :k], axis=-1)
            gram = self.gram(k, n - 1, with_exact=ladder.exact_known)
            log += noise_evidence(ladder.h[k:], gram, self.points, ladder.floor[:, k:])
            self.values["noise"] += self.add_to_total(slice(None), log)

    def posterior(self) -> Posterior:
        """Return the normalised probabilities, after all hypotheses were added."""
        values, total = self.values, self.total
        any_power = values.pop("any_power") / total[:, None]
        pairs, first, second = np.moveaxis(values.pop("pairs") / total[:, None, None], 1, 0)
        terms = two_powers((1.0,), self.expected)
        pair_powers = np.stack(
            [terms.lower[terms.first_of_pairs], terms.higher[terms.first_of_pairs]], axis=-1
        )
        lower, higher = (self.sum_by_power(p) for p in pair_powers.T)
        if self.ladder.exact_known:
            values["limit_weights"] = np.full_like(self.free_rows, np.nan)
            values["limit_square"] = np.full_like(total, np.nan)
        else:
            # improbable windows may have limits far away
            window = values["window"]
            likely = window > LIKELY * np.max(window, axis=-1, keepdims=True)
            expansion = np.maximum(np.sum(window * likely, axis=-1), TINY)
            limit = np.sum(values["limit_weights"] * likely[..., None], axis=1)
            values["limit_weights"] = limit / expansion[:, None]
            values["limit_square"] = np.sum(values["limit_square"] * likely, axis=1) / expansion
        for name in ("alternating", "noise"):
            values[name] = values[name] / total
        values["window"] = values["window"] / total[:, None]
        mixed = pairs - first - second
        dominant = any_power + lower(first) + higher(second)
        return Posterior(
            powers=self.powers,
            grid=self.grid,
            reach=self.reach,
            orders=self.orders,
            windows=self.windows,
            dominant=dominant,
            mixed=mixed,
            pairs=pair_powers,
            lowest=dominant + lower(mixed),
            highest=dominant + higher(mixed),
            scattered=1.0 / total,
            **values,
        )

    def sum_by_power(self, powers: Floats) -> Callable[[Floats], Floats]:
        """Return a function that sums values of pairs by the given power of each pair, shape (ladder, power)."""
        order = np.argsort(powers, kind="stable")
        distinct, start = np.unique(powers[order], return_index=True)
        columns = np.searchsorted(self.powers, distinct)

        def summed(values: Floats) -> Floats:
            sums = np.zeros((len(values), len(self.powers)))
            sums[:, columns] = np.add.reduceat(values[:, order], start, axis=1)
            return sums

        return summed


def posterior(
    ladder: Ladder, expected: ExpectedOrder | None = None, *, left_out: float = LEFT_OUT
) -> Posterior:
    """Return the posterior of ladders with at least three levels and finite data.

    Hypotheses are skipped that together hold at most the part `left_out` of all evidence.
    """
    fit = _Fit(ladder, expected, left_out)
    fit.add_no_expansion()
    for index in range(len(fit.windows)):
        fit.add_window(index)
    return fit.posterior()
