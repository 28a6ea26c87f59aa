"""What is believed of ladders after all hypotheses of the error model have been weighed."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from vibsim.convergence.differences import order_of_differences, safe_ratio
from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import (
    between,
    form,
    hypotheses_of,
    inverse,
    noise_of_rows,
    outer,
    packed,
    times,
    two_powers,
)
from vibsim.convergence.error_model.likelihood import (
    TINY,
    UNTHINKABLE,
    any_size,
    log_sum,
    noise,
    noise_of_finest,
    scale_free,
    weights,
)
from vibsim.core.array_types import Flags, Floats, Integers

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


@dataclass
class Posterior:
    """What is believed of ladders: probabilities, of shape (ladder,) where no other is given."""

    powers: Floats  # the powers that are looked at, increasing, shape (power,)
    orders: Floats  # of every three successive levels, shape (ladder, n-2); see `local_orders`
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

    def replace(self, ladders: Integers, other: Posterior, rows: Flags) -> None:
        """Believe of some ladders what another posterior says in some of its rows."""
        for one in fields(self):
            if one.name not in ("powers", "windows", "pairs"):
                getattr(self, one.name)[ladders] = getattr(other, one.name)[rows]


def local_orders(ladder: Ladder) -> Floats:
    """Return the order of every three successive levels, shape (ladder, n-2); NaN where there is none.

    It solves ``(h_0^p - h_1^p)/(h_1^p - h_2^p) = d_0/d_1``. Differences that turn their sign have none.
    """
    n = len(ladder.h)
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : n - 1]
    found = []
    for i in range(n - 2):
        same = ladder.gram[:, i, i + 1] > 0.0
        ratio = np.where(same, safe_ratio(sizes[:, i], sizes[:, i + 1]), np.nan)
        found.append(order_of_differences(ratio, ladder.h[i : i + 3]))
    return np.stack(found, axis=-1)


class _Sums:
    """Sums over hypotheses, scaled by the largest evidence so far."""

    def __init__(self, ladders: int) -> None:
        self.top = np.full(ladders, -np.inf)
        self.values: dict[str, Floats] = {}

    def add(self, log: Floats, **means: Floats) -> None:
        """Add means, of shape (ladder, ...), with weights of these logs, shape (ladder,)."""
        top = np.maximum(self.top, log)
        if np.any(top > self.top):
            factor = np.exp(self.top - top)
            for name, value in self.values.items():
                self.values[name] = _by_ladder(factor, value) * value
            self.top = top
        weight = np.exp(log - top)
        for name, mean in means.items():
            value = _by_ladder(weight, mean) * mean
            self.values[name] = self.values[name] + value if name in self.values else value


def _by_ladder(factor: Floats, values: Floats) -> Floats:
    return factor.reshape(-1, *[1] * (values.ndim - 1))


class _Fit:
    """The posterior in the making: hypotheses are added window by window."""

    def __init__(self, ladder: Ladder, promised: float | None) -> None:
        self.ladder, self.points, self.promised = ladder, ladder.points, promised
        terms = two_powers((1.0,), promised)
        usual = np.concatenate([terms.lower, terms.higher])
        self.powers = np.unique(
            np.concatenate([usual, np.arange(priors.BIN, priors.HIGHEST, priors.BIN)])
        )
        self.orders = local_orders(ladder)
        n = len(ladder.h)
        self.windows = [
            (last - rows, last)
            for last in range(n - 1, 1, -1)
            for rows in range(min(priors.LONGEST_WINDOW, last), 1, -1)
        ]
        # rounding is part of every row; that of a level is relative to what differs from there on
        squares = np.diagonal(ladder.gram, axis1=1, axis2=2)[:, : n - 1]
        largest = np.maximum.accumulate(squares[:, ::-1], axis=-1)[:, ::-1]
        largest = np.concatenate([largest, largest[:, -1:]], axis=-1)
        # it is added to the rows, so that no difference is smaller
        self.rounding = priors.ROUNDING * (ladder.floor**2 + priors.EPSILON**2 * largest + TINY)
        self.differences = self.rows(0, n - 1)
        self.alone_rows = any_size(self.differences, self.points) - priors.PRICE
        self.sums = _Sums(len(ladder.gram))

    def add_window(self, index: int) -> None:
        """Add the hypotheses that the expansion holds between two levels."""
        start, end = self.windows[index]
        ladder = self.ladder
        rest = np.sum(self.alone_rows[:, :start], axis=-1)
        rest += noise(
            ladder.h[end:], self.differences[:, end:, end:], self.points, ladder.floor[:, end:]
        )
        smallest = self.differences[:, end - 1, end - 1]
        if ladder.exact_known:
            smallest = np.minimum(smallest, self.rows(end, end, with_exact=True)[:, 0, 0])
        noisy = noise_of_finest(ladder.floor[:, end], smallest)
        sizes = ladder.h[start : end + 1] / ladder.h[end]
        inside, behind = self.rows(start, end), np.empty((len(rest), 0))
        if ladder.exact_known:
            inside = self.rows(start, end, with_exact=True)
            sizes = np.append(sizes, 0.0)
        else:
            behind = self.behind(start, end)
        # with a few digits less windows of one ratio are the same
        of_window = hypotheses_of(tuple(np.round(sizes, 12)), self.promised)
        self.add_any_power(index, sizes, inside, rest + noisy[0])
        tables = [(table, noisy[i]) for i, table in enumerate(of_window.two_shapes)]
        tables += [
            (table, noisy[0] + math.log(priors.ONE_SHAPE_PRIOR * chance))
            for table, chance in zip(of_window.one_shape, priors.JITTER_PRIORS, strict=True)
        ]
        for table, prior in tables:
            log, means = weights(table, inside, self.points, behind)
            self.add(index, log + rest + prior, **means)
        for i, table in enumerate(of_window.alternating):
            log, _ = weights(table, inside, self.points, behind[:, :0])
            log += rest + noisy[i] + math.log(priors.ALTERNATING)
            self.sums.add(log, alternating=np.ones(len(log)))

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

    def behind(self, start: int, end: int) -> Floats:
        """Return what `kernel` reads of the differences behind a window."""
        with_rest = np.sum(self.differences[:, :, end:], axis=-1)
        own = np.sum(with_rest[:, end:], axis=-1, keepdims=True)
        last = np.maximum(self.differences[:, end - 1, end - 1], TINY)
        return np.asarray(np.concatenate([with_rest[:, start:end], own], axis=-1) / last[:, None])

    def error_of(self, level: int) -> Floats:
        """Return the evidence of the true error of a level, if that may have any size."""
        squared = self.rows(level, level, with_exact=True)[:, 0, 0]
        return scale_free(np.maximum(squared, TINY), 0.0, self.points, 1) - priors.PRICE

    def add(
        self, index: int, log: Floats, *, path: Floats, path_squared: Floats, **means: Floats
    ) -> None:
        """Add hypotheses on the rows of a window to all sums."""
        of_window = np.arange(len(self.windows)) == index
        chosen = np.broadcast_to(of_window, (len(log), len(of_window)))
        if not self.ladder.exact_known:
            (start, end), n = self.windows[index], len(self.ladder.h)
            whole = np.zeros((len(log), n - 1))
            whole[:, start:end] = path
            whole[:, end:] = 1.0
            # the limit is known no better than the noise behind the window
            if end < n - 1:
                path_squared = path_squared + self.differences[:, end, end]
            means["path"] = whole[:, None] * of_window[:, None]
            means["path_squared"] = path_squared[:, None] * of_window
        self.sums.add(log, window=chosen.astype(np.float64), **means)

    def add_any_power(self, index: int, sizes: Floats, inside: Floats, rest: Floats) -> None:
        """Add the hypotheses of one power of any value, close to that of the finest differences of the window."""
        w = len(sizes) - 1
        order = self.orders[:, self.windows[index][1] - 2]
        usable = (order > 0.0) & (order < priors.HIGHEST)
        order = np.where(usable, order, 1.0)
        powers = np.maximum(order[:, None] + priors.AROUND, TINY)
        errors = sizes ** powers[..., None]
        c = between(errors)
        precision, log_det = inverse(outer(c, c) + noise_of_rows((priors.MISFIT * errors) ** 2))
        trace = np.maximum(np.sum(form(precision) * packed(inside)[:, None], axis=-1), TINY)
        log = scale_free(trace, log_det, self.points[:, None], w) + rest[:, None]
        log += np.log(priors.OTHER_PRIOR / priors.HIGHEST * np.gradient(priors.AROUND))
        log = np.where(usable[:, None], log, UNTHINKABLE)
        total = log_sum(log)
        weight = np.exp(log - total[:, None])
        gains = times(precision, c)
        left = 1.0 - np.sum(gains * c, axis=-1)
        behind = (
            self.behind(*self.windows[index]) * inside[:, -1:, -1]
            if not self.ladder.exact_known
            else None
        )
        path, squared = np.zeros((len(log), w)), np.zeros(len(log))
        if behind is not None:
            path = -np.sum(weight[..., None] * gains, axis=1)
            of_each = np.sum(form(outer(gains, gains)) * packed(inside)[:, None], axis=-1)
            of_each += trace / w * left + behind[:, -1:]
            of_each -= 2.0 * np.sum(gains * behind[:, None, :-1], axis=-1)
            squared = np.sum(weight * of_each, axis=-1)
        nearest = np.argmin(np.abs(order[:, None] - self.powers), axis=-1)
        of_power = (np.arange(len(self.powers)) == nearest[:, None]).astype(np.float64)
        self.add(index, total, path=path, path_squared=squared, any_power=of_power)

    def add_no_expansion(self) -> None:
        """Add the hypotheses without an expansion: rows of any size, behind which all may be noise."""
        ladder, n = self.ladder, len(self.ladder.h)
        ones = np.ones(len(ladder.gram))
        scattered = np.sum(self.alone_rows, axis=-1)
        if ladder.exact_known:
            scattered = scattered + self.error_of(0)
        self.sums.add(scattered, scattered=ones)
        for k in range(n - 1):
            log = np.sum(self.alone_rows[:, :k], axis=-1)
            log += noise(
                ladder.h[k:],
                self.rows(k, n - 1, with_exact=ladder.exact_known),
                self.points,
                ladder.floor[:, k:],
            )
            self.sums.add(log, noise=ones)

    def posterior(self) -> Posterior:
        """Return what is believed, after all hypotheses were added."""
        values = self.sums.values
        names = ("alternating", "scattered", "noise")
        expansion = np.maximum(np.sum(values["window"], axis=-1), TINY)
        total = expansion + sum(values[name] for name in names)
        pairs, first, second, any_power = (
            values.pop(name) / total[:, None]
            for name in ("pairs", "first_alone", "second_alone", "any_power")
        )
        terms = two_powers((1.0,), self.promised)
        of_pairs = np.stack(
            [terms.lower[terms.first_of_pairs], terms.higher[terms.first_of_pairs]], axis=-1
        )
        lower, higher = (p[:, None] == self.powers for p in of_pairs.T)
        for name in (*names, "window"):
            values[name] = values[name] / _by_ladder(total, values[name])
        if self.ladder.exact_known:
            values["path"], values["path_squared"] = self.alone_rows * np.nan, total * np.nan
        else:
            # what hardly can be has limits far away
            likely = values["window"] > LIKELY * np.max(values["window"], axis=-1, keepdims=True)
            expansion = np.maximum(np.sum(values["window"] * likely, axis=-1), TINY) * total
            values["path"] = np.sum(values["path"] * likely[..., None], axis=1) / expansion[:, None]
            values["path_squared"] = np.sum(values["path_squared"] * likely, axis=1) / expansion
        return Posterior(
            powers=self.powers,
            orders=self.orders,
            windows=self.windows,
            alone=any_power + _of_powers(first, lower) + _of_powers(second, higher),
            of_pairs=pairs - first - second,
            pairs=of_pairs,
            lowest=any_power + _of_powers(pairs - second, lower) + _of_powers(second, higher),
            highest=any_power + _of_powers(first, lower) + _of_powers(pairs - first, higher),
            **values,
        )


def _of_powers(of_pairs: Floats, chosen: Flags) -> Floats:
    """Return the sums over the pairs that have each power, shape (ladder, power)."""
    found = np.zeros((len(of_pairs), chosen.shape[1]))
    for pair, power in zip(*np.nonzero(chosen), strict=True):
        found[:, power] += of_pairs[:, pair]
    return found


def posterior(ladder: Ladder, promised: float | None = None) -> Posterior:
    """Return what is believed of ladders of three levels and more, all of whose numbers are finite."""
    fit = _Fit(ladder, promised)
    for index in range(len(fit.windows)):
        fit.add_window(index)
    fit.add_no_expansion()
    return fit.posterior()
