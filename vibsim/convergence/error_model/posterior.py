"""What is believed of ladders after all hypotheses of the error model have been weighed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from vibsim.convergence.differences import orders_of_steps, safe_ratio
from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import (
    Promise,
    Table,
    between,
    hypotheses_of,
    noise_of_rows,
    times,
    two_powers,
)
from vibsim.convergence.error_model.likelihood import (
    TINY,
    WindowRows,
    any_size,
    highest,
    log_sum,
    noise,
    noise_of_finest,
    scale_free,
    single_power,
    weights,
    window_rows,
)
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays

LEFT_OUT = 1e-11
"""Part of all evidence that may be left out: bounds of errors change by less than a digit, probabilities not at all."""
TABLES, MOST_HYPOTHESES = 10, 7300
"""There are no more of them on a window."""
LARGEST_LOG = 600.0
"""Of evidence over that of no expansion at all: more says no more."""
LIKELY = 1e-3
"""Probability of a window, over that of the most probable one, from which on its limit counts."""


@dataclass(frozen=True)
class Ladder:
    """The numbers of ladders that the model reads; n levels, m rows."""

    h: Floats  # step sizes, decreasing, shape (n,)
    # inner products (means over the points) of the n-1 differences and, where the exact solution is known, of the
    # finest level less that, shape (ladder, m, m)
    gram: Floats
    floor: Floats  # predicted noise of every level in the same norm, shape (ladder, n)
    numbers: Flags  # whether the values are single numbers, shape (ladder,)
    exact_known: bool

    @property
    def points(self) -> Floats:
        """Independent points, shape (ladder,)."""
        return np.where(self.numbers, 1.0, priors.POINTS)

    def some(self, rows: Integers) -> Ladder:
        """Return some of the ladders."""
        parts = {name: getattr(self, name)[rows] for name in ("gram", "floor", "numbers")}
        return replace(self, **parts)

    def without_exact(self) -> Ladder:
        """Return what the levels alone say, where the exact solution is known."""
        m = len(self.h) - 1
        return replace(self, gram=self.gram[:, :m, :m], exact_known=False)


@dataclass
class Posterior:
    """What is believed of ladders: probabilities, of shape (ladder,) where no other is given."""

    powers: Floats  # the powers that are looked at, increasing, shape (power,)
    grid: Floats  # the same, and those that only other ladders have
    # what each of `powers` may be: one of an expansion is itself, another one lies between its neighbours on the grid,
    # since a second power behind it moves the measured order; shape (2, power)
    reach: Floats
    orders: Floats  # of every three successive levels, shape (ladder, n-2); see `orders_of`
    windows: list[tuple[int, int]]  # coarsest and finest level
    alone: Floats  # that this power dominates, shape (ladder, power)
    lowest: Floats  # that this is the lowest power of weight, shape (ladder, power)
    highest: Floats  # that this is the highest one, shape (ladder, power)
    # that two powers are of one size, shape (ladder, pair), and these powers, shape (pair, 2)
    of_pairs: Floats
    pairs: Floats
    window: Floats  # that the expansion holds in this window, shape (ladder, window)
    alternating: Floats  # that errors change their sign from level to level
    scattered: Floats  # that there is no expansion, and no noise either
    noise: Floats  # that all but some coarse levels are noise
    # the limit less the finest level: the mean of its expression in the differences, shape (ladder, row), and its mean
    # square; given the expansion, and where the exact solution is not known
    path: Floats
    path_squared: Floats

    @property
    def expansion(self) -> Floats:
        """Return the probability of an expansion in one or two powers."""
        return np.asarray(np.sum(self.window, axis=-1))

    def some(self, rows: Integers) -> Posterior:
        """Return what is believed of some of the ladders."""
        return replace(self, **{name: getattr(self, name)[rows] for name in self.of_ladders()})

    def replace(self, ladders: Integers, other: Posterior, rows: Flags) -> None:
        """Believe of some ladders what another posterior of them, among fewer others, says in some of its rows."""
        place = np.searchsorted(self.powers, other.powers)
        for name in self.of_ladders():
            values = getattr(other, name)[rows]
            if name in ("alone", "lowest", "highest"):
                every = np.zeros((len(values), len(self.powers)))
                every[:, place] = values
                values = every
            getattr(self, name)[ladders] = values

    def of_ladders(self) -> list[str]:
        """Name what has a row for each ladder."""
        names = [one.name for one in fields(self)]
        return [
            name for name in names if name not in ("powers", "grid", "reach", "windows", "pairs")
        ]


def orders_of(ladder: Ladder) -> Floats:
    """Return the order of every three successive levels, shape (ladder, n-2); NaN where there is none.

    It solves ``(h_0^p - h_1^p)/(h_1^p - h_2^p) = d_0/d_1``. Differences that turn their sign have none.
    """
    n = len(ladder.h)
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : n - 1]
    same = np.diagonal(ladder.gram, 1, 1, 2)[:, : n - 2] > 0.0
    ratios = np.where(same, safe_ratio(sizes[:, :-1], sizes[:, 1:]), np.nan)
    return orders_of_steps(ratios, ladder.h)


Rows = slice | Integers
"""Some ladders, or all."""


class _Fit:
    """The posterior in the making: hypotheses are added window by window."""

    def __init__(self, ladder: Ladder, promise: Promise | None, left_out: float) -> None:
        self.ladder, self.points, self.promise = ladder, ladder.points, promise
        terms = two_powers((1.0,), promise)
        usual = np.concatenate([terms.lower, terms.higher])
        every = np.unique(
            np.concatenate([usual, np.arange(priors.BIN, priors.HIGHEST, priors.BIN)])
        )
        self.orders = orders_of(ladder)
        # of the powers between the usual ones, those that are nearest to some order
        nearest = np.searchsorted(0.5 * (every[1:] + every[:-1]), self.orders)
        # and the ends, which are the interval of an order that nothing is known of
        ends = np.array([0, len(every) - 1])
        used = np.unique(np.concatenate([np.searchsorted(every, usual), nearest.ravel(), ends]))
        self.grid, self.powers, self.nearest = every, every[used], np.searchsorted(used, nearest)
        neighbours = np.stack([np.append(every[0], every[:-1]), np.append(every[1:], every[-1])])
        self.reach = np.where(np.isin(every, usual), every, neighbours)[:, used]
        count, n = len(ladder.gram), len(ladder.h)
        self.windows = [
            (last - rows, last)
            for last in range(n - 1, 1, -1)
            for rows in range(min(priors.LONGEST_WINDOW, last), 1, -1)
        ]
        # half of what may be left out is that of whole tables, half that of single hypotheses
        part = 0.5 * left_out / len(self.windows)
        self.of_table, self.of_one = (on_arrays.log(part / x) for x in (TABLES, MOST_HYPOTHESES))
        # rounding is part of every row; that of a level is relative to what differs from there on
        squares = np.diagonal(ladder.gram, axis1=1, axis2=2)[:, : n - 1]
        largest = np.maximum.accumulate(squares[:, ::-1], axis=-1)[:, ::-1]
        largest = np.concatenate([largest, largest[:, -1:]], axis=-1)
        # it is added to the rows, so that no difference is smaller
        self.rounding = priors.ROUNDING * (ladder.floor**2 + priors.EPSILON**2 * largest + TINY)
        self.differences = self.rows(0, n - 1)
        self.alone_rows = any_size(self.differences, self.points) - priors.PRICE
        # sums over hypotheses of their evidence, over that of differences that all have a size of their own
        self.unit = np.sum(self.alone_rows, axis=-1)
        if ladder.exact_known:
            # the true error of the coarsest level may have any size, too
            squared = np.maximum(self.rows(0, 0, with_exact=True)[:, 0, 0], TINY)
            self.unit = self.unit + (scale_free(squared, 0.0, self.points, 1) - priors.PRICE)
        self.of_ends = {end: self.beyond(end) for end in range(2, n)}
        self.total, self.every = np.ones(count), np.arange(count)
        pairs, windows = len(terms.first_of_pairs), len(self.windows)
        shapes: dict[str, tuple[int, ...]] = {
            **dict.fromkeys(("alternating", "noise"), ()),
            "pairs": (3, pairs),
            **dict.fromkeys(("window", "path_squared"), (windows,)),
            "any_power": (len(self.powers),),
            "path": (windows, n - 1),
        }
        self.values = {name: np.zeros((count, *shape)) for name, shape in shapes.items()}

    def add_window(self, index: int) -> None:
        """Add the hypotheses that the expansion holds between two levels."""
        start, end = self.windows[index]
        ladder = self.ladder
        rest = np.sum(self.alone_rows[:, :start], axis=-1)
        for part in self.of_ends[end]:
            rest += part
        smallest = self.differences[:, end - 1, end - 1]
        sizes = ladder.h[start : end + 1] / ladder.h[end]
        inside, behind = self.rows(start, end), np.empty((len(rest), 0))
        if ladder.exact_known:
            inside = self.rows(start, end, with_exact=True)
            smallest = np.minimum(smallest, inside[:, -1, -1])
            sizes = np.append(sizes, 0.0)
        else:
            behind = self.behind(start, end)
        noisy = [rest + part for part in noise_of_finest(ladder.floor[:, end], smallest)]
        # with a few digits less windows of one ratio are the same
        of_window = hypotheses_of(tuple(np.round(sizes, 12)), self.promise)
        tables = [(table, noisy[i]) for i, table in enumerate(of_window.two_shapes)]
        # numbers have no shape
        shapes = self.points > 1.0
        own = np.where(shapes, priors.OWN_SHAPE, 0.0)
        with np.errstate(divide="ignore"):
            one, several = (
                noisy[0] + on_arrays.log(priors.JITTER_PRIOR * x) for x in (1.0 - own, own)
            )
            alike = noisy[0] + on_arrays.log(priors.ONE_SHAPE * shapes)
        tables += [
            (table, one + on_arrays.log(p))
            for table, p in zip(of_window.factors, priors.JITTER_PRIORS, strict=True)
        ]
        tables += [(of_window.factors_with_shape, several), (of_window.one_shape, alike)]
        read = [window_rows(inside, self.points, split=x) for x in (False, True)]
        for table, prior in tables:
            self.add_table(index, table, prior, read, behind)
        self.add_any_power(index, sizes, inside, behind, noisy[0], of_window.any_power)
        for i, table in enumerate(of_window.alternating):
            prior = noisy[i] + on_arrays.log(priors.ALTERNATING)
            self.add_table(index, table, prior, read, behind[:, :0], name="alternating")

    def matters(self, most: Floats) -> tuple[Rows, Floats]:
        """Return the ladders of which a table with evidence up to this may matter, and what hypothesis would not."""
        whole = self.unit + on_arrays.log(self.total)
        keep = most > whole + self.of_table
        return slice(None) if np.all(keep) else np.flatnonzero(keep), whole + self.of_one

    def add_table(
        self,
        index: int,
        table: Table,
        prior: Floats,
        of_kinds: list[WindowRows],
        behind: Floats,
        *,
        name: str = "window",
    ) -> None:
        """Add the hypotheses of a table on the rows of a window."""
        read = of_kinds[table.beside is not None]
        rows, least = self.matters(prior + highest(table, read))
        part = read if isinstance(rows, slice) else WindowRows._make(x[rows] for x in read)
        if not len(part.last):
            return
        log, pairs, path, squared = weights(table, part, behind[rows], (least - prior)[rows])
        if not np.any(np.isfinite(log)):
            return
        if name == "window":
            weight = self.add(index, rows, log + prior[rows], path, squared)
            self.values["pairs"][rows] += weight[:, None, None] * pairs
        else:
            self.values[name][rows] += self.weight(rows, log + prior[rows])

    def weight(self, rows: Rows, log: Floats) -> Floats:
        """Return the weights of hypotheses of some ladders, and count them among all."""
        found = on_arrays.exp(np.minimum(log - self.unit[rows], LARGEST_LOG))
        self.total[rows] += found
        return np.asarray(found)

    def rows(self, start: int, end: int, *, with_exact: bool = False) -> Floats:
        """Return the Gram matrix of the differences between two levels, and of the true error of the second one."""
        gram = self.ladder.gram
        noise = noise_of_rows(self.rounding[:, start : end + 1])
        if not with_exact:
            return np.asarray(gram[:, start:end, start:end] + noise)
        count = end - start
        found = np.zeros((len(gram), count + 1, count + 1))
        found[:, :count, :count] = gram[:, start:end, start:end] + noise
        # the error of a level is the sum of all finer differences and of the error of the finest one
        with_error = np.sum(gram[:, :, end:], axis=-1)
        found[:, :count, count] = found[:, count, :count] = with_error[:, start:end]
        found[:, count, count] = np.sum(with_error[:, end:], axis=-1) + self.rounding[:, end]
        if count:
            found[:, count - 1, count] -= self.rounding[:, end]
            found[:, count, count - 1] -= self.rounding[:, end]
        return found

    def beyond(self, end: int) -> tuple[Floats, Floats]:
        """Return what is said of the rows behind windows that end at a level: the evidence of noise, and what it hides.

        The second is the log of how likely noise hides what an expansion leaves there. A difference of which D is
        expected is as small as noise of the size s < D with the probability ``(s/D)^N``. D falls by the order of the
        finest levels of the window; where they have none, nothing is expected.
        """
        sizes, floor = self.ladder.h[end - 1 :] / self.ladder.h[end], self.ladder.floor[:, end:]
        order = np.clip(self.orders[:, end - 2, None], priors.POWERS[0], priors.HIGHEST)
        falls = between(on_arrays.power(sizes, order))
        own = np.sqrt(np.diagonal(self.differences, axis1=1, axis2=2)[:, end - 1 :])
        expected = np.maximum(own[:, :1] * falls[:, 1:] / falls[:, :1], TINY)
        largest = np.max(own[:, 1:], axis=-1, initial=0.0)
        hidden = np.fmin(on_arrays.log(np.maximum(largest, floor[:, 0])[:, None] / expected), 0.0)
        rows = self.differences[:, end:, end:]
        return noise(self.ladder.h[end:], rows, self.points, floor), self.points * np.sum(
            hidden, axis=-1
        )

    def behind(self, start: int, end: int) -> Floats:
        """Return what `kernel` reads of the differences behind a window."""
        with_rest = np.sum(self.differences[:, :, end:], axis=-1)
        own = np.sum(with_rest[:, end:], axis=-1, keepdims=True)
        last = np.maximum(self.differences[:, end - 1, end - 1], TINY)
        return np.asarray(np.concatenate([with_rest[:, start:end], own], axis=-1) / last[:, None])

    def add(self, index: int, rows: Rows, log: Floats, path: Floats, squared: Floats) -> Floats:
        """Add hypotheses on the rows of a window of some ladders, and return their weights."""
        weight = self.weight(rows, log)
        self.values["window"][rows, index] += weight
        if not self.ladder.exact_known:
            (start, end), n = self.windows[index], len(self.ladder.h)
            whole = np.zeros((len(path), n - 1))
            whole[:, start:end] = path
            whole[:, end:] = 1.0
            # the limit is known no better than the noise behind the window
            if end < n - 1:
                squared = squared + self.differences[rows, end, end]
            self.values["path"][rows, index] += weight[:, None] * whole
            self.values["path_squared"][rows, index] += weight * squared
        return weight

    def add_any_power(
        self,
        index: int,
        sizes: Floats,
        inside: Floats,
        behind: Floats,
        prior: Floats,
        limit: Floats,
    ) -> None:
        """Add the hypotheses of one power of any value, close to that of the finest differences of the window."""
        w = len(sizes) - 1
        order = self.orders[:, self.windows[index][1] - 2]
        usable = (order > 0.0) & (order < priors.HIGHEST)
        last = np.maximum(inside[:, -1, -1], TINY)
        most = prior + scale_free(last, 0.0, self.points, w)
        most += np.where(self.points > 1.0, *limit[::-1])
        rows, _ = self.matters(np.where(usable, most, -np.inf))
        order, points, inside = order[rows], self.points[rows, None], inside[rows]
        if not len(inside):
            return
        log, gains, squares = single_power(
            sizes, np.maximum(order[:, None] + priors.AROUND, TINY), inside, points
        )
        log += on_arrays.log(priors.OTHER_PRIOR / priors.HIGHEST * np.gradient(priors.AROUND))
        total = log_sum(log)
        path, squared = np.zeros((len(order), w)), np.zeros(len(order))
        if not self.ladder.exact_known:
            weight = on_arrays.exp(log - total[:, None])
            rest = behind[rows] * inside[:, -1:, -1]
            path = -np.sum(weight[..., None] * gains, axis=1)
            squares += rest[:, -1:] - 2.0 * np.sum(gains * rest[:, None, :-1], axis=-1)
            slope = (gains[:, -1] - gains[:, 0]) / (2.0 * priors.AROUND[-1])
            away = np.abs(order[:, None] - np.array(priors.POWERS)).min(axis=-1) > 0.5 * priors.BIN
            squares += (away * priors.DRIFT**2 * np.sum(slope * times(inside, slope), axis=-1))[
                :, None
            ]
            squared = np.sum(weight * squares, axis=-1)
        weight = self.add(index, rows, total + prior[rows], path, squared)
        nearest = self.nearest[rows, self.windows[index][1] - 2]
        self.values["any_power"][self.every[rows], nearest] += weight

    def add_no_expansion(self) -> None:
        """Add the hypotheses that all rows behind one are noise, and those before it have a size of their own."""
        ladder, n = self.ladder, len(self.ladder.h)
        for k in range(n - 1):
            log = np.sum(self.alone_rows[:, :k], axis=-1)
            log += noise(
                ladder.h[k:],
                self.rows(k, n - 1, with_exact=ladder.exact_known),
                self.points,
                ladder.floor[:, k:],
            )
            self.values["noise"] += self.weight(slice(None), log)

    def posterior(self) -> Posterior:
        """Return what is believed, after all hypotheses were added."""
        values, total = self.values, self.total
        any_power = values.pop("any_power") / total[:, None]
        pairs, first, second = np.moveaxis(values.pop("pairs") / total[:, None, None], 1, 0)
        terms = two_powers((1.0,), self.promise)
        of_pairs = np.stack(
            [terms.lower[terms.first_of_pairs], terms.higher[terms.first_of_pairs]], axis=-1
        )
        lower, higher = (self.of_powers(p) for p in of_pairs.T)
        if self.ladder.exact_known:
            values["path"] = np.full_like(self.alone_rows, np.nan)
            values["path_squared"] = np.full_like(total, np.nan)
        else:
            # what hardly can be has limits far away
            window = values["window"]
            likely = window > LIKELY * np.max(window, axis=-1, keepdims=True)
            expansion = np.maximum(np.sum(window * likely, axis=-1), TINY)
            values["path"] = np.sum(values["path"] * likely[..., None], axis=1) / expansion[:, None]
            values["path_squared"] = np.sum(values["path_squared"] * likely, axis=1) / expansion
        for name in ("alternating", "noise"):
            values[name] = values[name] / total
        values["window"] = values["window"] / total[:, None]
        both = pairs - first - second
        alone = any_power + lower(first) + higher(second)
        return Posterior(
            powers=self.powers,
            grid=self.grid,
            reach=self.reach,
            orders=self.orders,
            windows=self.windows,
            alone=alone,
            of_pairs=both,
            pairs=of_pairs,
            lowest=alone + lower(both),
            highest=alone + higher(both),
            scattered=1.0 / total,
            **values,
        )

    def of_powers(self, powers: Floats) -> Callable[[Floats], Floats]:
        """Return what sums what belongs to pairs up over those that have each power, shape (ladder, power)."""
        order = np.argsort(powers, kind="stable")
        found, start = np.unique(powers[order], return_index=True)
        places = np.searchsorted(self.powers, found)

        def summed(of_pairs: Floats) -> Floats:
            whole = np.zeros((len(of_pairs), len(self.powers)))
            whole[:, places] = np.add.reduceat(of_pairs[:, order], start, axis=1)
            return whole

        return summed


def posterior(
    ladder: Ladder, promise: Promise | None = None, *, left_out: float = LEFT_OUT
) -> Posterior:
    """Return what is believed of ladders of three levels and more, all of whose numbers are finite.

    Hypotheses are left out that surely have no more than the part `left_out` of the evidence of all.
    """
    fit = _Fit(ladder, promise, left_out)
    fit.add_no_expansion()
    for index in range(len(fit.windows)):
        fit.add_window(index)
    return fit.posterior()
