"""What is believed of ladders after all hypotheses of the error model have been weighed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibsim.convergence.differences import order_of_differences, safe_ratio
from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.hypotheses import (
    Window,
    hypotheses_of,
    inverse,
    levels_to_rows,
    two_powers,
)
from vibsim.convergence.error_model.likelihood import (
    TINY,
    any_size,
    evidence,
    mean_square,
    noise,
    noise_of_finest,
    scale_free,
)
from vibsim.core.array_types import Flags, Floats

UNTHINKABLE = -1e6
"""Log evidence of what cannot be."""
NEGLIGIBLE = -20.0
"""Log probability, over the largest so far, of hypotheses that are left out."""


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
    elsewhere: Floats  # that the limit is not the exact solution; 0 where that is not known
    # the limit less the finest level: the mean of its expression in the differences, shape (ladder, row), and its mean
    # square; given the expansion, and where the exact solution is not known
    path: Floats
    path_squared: Floats

    @property
    def expansion(self) -> Floats:
        """Return the probability of an expansion in one or two powers."""
        return np.asarray(np.sum(self.window, axis=-1))


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

    def add(self, log: Floats) -> Floats:
        """Return the weights of hypotheses, shape (ladder, hypothesis), and scale down what was summed before."""
        top = np.maximum(self.top, np.max(log, axis=-1))
        factor = np.exp(self.top - top)
        for name, value in self.values.items():
            self.values[name] = value * factor.reshape(-1, *[1] * (value.ndim - 1))
        self.top = top
        less = log - top[:, None]
        return np.where(less > NEGLIGIBLE, np.exp(less), 0.0)

    def put(self, name: str, value: Floats) -> None:
        self.values[name] = self.values[name] + value if name in self.values else value


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
        # the finest and longest first: what follows is mostly negligible beside them
        self.windows = [
            (last - rows, last)
            for last in range(n - 1, 1, -1)
            for rows in range(min(priors.LONGEST_WINDOW, last), 1, -1)
        ]
        # rounding is part of every row; that of a level is relative to what differs from there on
        squares = np.diagonal(ladder.gram, axis1=1, axis2=2)[:, : n - 1]
        largest = np.maximum.accumulate(squares[:, ::-1], axis=-1)[:, ::-1]
        largest = np.concatenate([largest, largest[:, -1:]], axis=-1)
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
        inside = self.rows(start, end)
        relative = sizes
        of_window = hypotheses_of(tuple(sizes), self.promised)
        if ladder.exact_known:
            apart = rest + self.error_of(end) + math.log(priors.ELSEWHERE)
            for i, window in of_window.two_shapes:
                log, _ = evidence(window, inside, self.points)
                weights = self.sums.add(log + window.terms.log_prior + (apart + noisy[i])[:, None])
                self.sums.put("elsewhere", np.sum(weights, axis=-1))
            inside = self.rows(start, end, with_exact=True)
            relative = np.append(sizes, 0.0)
            of_window = hypotheses_of(tuple(relative), self.promised)
        self.add_any_power(index, relative, inside, rest + noisy[0])
        for i, window in of_window.two_shapes:
            self.add_hypotheses(index, window, inside, (rest + noisy[i])[:, None])
        for log_prior, window in of_window.one_shape:
            self.add_hypotheses(index, window, inside, (rest + noisy[0] + log_prior)[:, None])
        for i, window in of_window.alternating:
            log, _ = evidence(window, inside, self.points)
            log += (
                window.terms.log_prior + (rest + noisy[i])[:, None] + math.log(priors.ALTERNATING)
            )
            self.sums.put("alternating", np.sum(self.sums.add(log), axis=-1))

    def rows(self, start: int, end: int, *, with_exact: bool = False) -> Floats:
        """Return the Gram matrix of the differences between two levels, and of the true error of the second one."""
        picked = np.zeros((end - start + with_exact, self.ladder.gram.shape[-1]))
        picked[np.arange(end - start), np.arange(start, end)] = 1.0
        if with_exact:
            picked[-1, end:] = 1.0
        levels = levels_to_rows(end - start + 2)[: len(picked), : end - start + 1]
        noise = (levels * self.rounding[:, None, start : end + 1]) @ levels.T
        return np.asarray(picked @ self.ladder.gram @ picked.T + noise)

    def error_of(self, level: int) -> Floats:
        """Return the evidence of the true error of a level, if that may have any size."""
        squared = self.rows(level, level, with_exact=True)[:, 0, 0]
        return scale_free(np.maximum(squared, TINY), 0.0, self.points, 1) - priors.PRICE

    def add_hypotheses(self, index: int, window: Window, inside: Floats, rest: Floats) -> None:
        """Add hypotheses on the rows of a window, with the evidence of all other rows."""
        terms, ladder, put = window.terms, self.ladder, self.sums.put
        (start, end), n = self.windows[index], len(self.ladder.h)
        log, scale = evidence(window, inside, self.points)
        weights = self.sums.add(log + terms.log_prior + rest)
        first, second = (
            mean_square(window.gains[:, i], inside) + scale * window.left[:, i, i] for i in range(2)
        )
        share = np.sqrt(second / np.maximum(first, TINY)) * (terms.share != 0.0)
        for name, part in (
            ("pairs", weights),
            ("first_alone", weights * (share < priors.DOMINATES)),
            ("second_alone", weights * (share > 1.0 / priors.DOMINATES)),
        ):
            put(name, np.add.reduceat(part, terms.starts, axis=-1))
        all_windows = np.zeros((len(weights), len(self.windows)))
        all_windows[:, index] = np.sum(weights, axis=-1)
        put("window", all_windows)
        if not ladder.exact_known:
            path = np.zeros((len(terms.lower), n - 1))
            path[:, start:end] = -np.sum(window.gains, axis=1)
            path[:, end:] = 1.0
            squared = mean_square(path, self.differences) + scale * np.sum(window.left, axis=(1, 2))
            self.put_path(index, weights @ path, np.sum(weights * squared, axis=-1))

    def put_path(self, index: int, path: Floats, squared: Floats) -> None:
        """Add to the expression of the limit in the differences, and to its square, of a window."""
        of_window = np.arange(len(self.windows)) == index
        self.sums.put("path", path[:, None] * of_window[:, None])
        self.sums.put("path_squared", squared[:, None] * of_window)

    def add_any_power(self, index: int, sizes: Floats, inside: Floats, rest: Floats) -> None:
        """Add the hypotheses of one power of any value, close to that of the finest differences of the window."""
        rows = levels_to_rows(len(sizes))
        (start, end), n = self.windows[index], len(self.ladder.h)
        order = self.orders[:, end - 2]
        usable = (order > 0.0) & (order < priors.HIGHEST)
        powers = np.maximum(np.where(usable, order, 1.0)[:, None] + priors.AROUND, TINY)
        errors = sizes ** powers[..., None]
        c = errors @ rows.T
        noise = (rows * (priors.MISFIT * errors[..., None, :]) ** 2) @ rows.T
        precision, log_det = inverse(c[..., :, None] * c[..., None, :] + noise)
        trace = np.maximum(np.einsum("cpij,cij->cp", precision, inside), TINY)
        log = scale_free(trace, log_det, self.points[:, None], len(rows)) + rest[:, None]
        log += np.log(priors.OTHER_PRIOR / priors.HIGHEST * np.gradient(priors.AROUND))
        weights = self.sums.add(np.where(usable[:, None], log, UNTHINKABLE))
        mass = np.sum(weights, axis=-1)
        nearest = np.argmin(np.abs(np.where(usable, order, 1.0)[:, None] - self.powers), axis=-1)
        self.sums.put(
            "any_power", mass[:, None] * (np.arange(len(self.powers)) == nearest[:, None])
        )
        self.sums.put("window", mass[:, None] * (np.arange(len(self.windows)) == index))
        if not self.ladder.exact_known:
            gains = np.einsum("cpi,cpij->cpj", c, precision)
            path = np.zeros((*powers.shape, n - 1))
            path[..., start:end] = -gains
            path[..., end:] = 1.0
            squared = np.einsum("cpi,cij,cpj->cp", path, self.differences, path)
            squared += trace / len(rows) * (1.0 - np.sum(gains * c, axis=-1))
            mean = np.einsum("cp,cpi->ci", weights, path)
            self.put_path(index, mean, np.sum(weights * squared, axis=-1))

    def add_no_expansion(self) -> None:
        """Add the hypotheses without an expansion: rows of any size, behind which all may be noise."""
        ladder, n = self.ladder, len(self.ladder.h)
        scattered = np.sum(self.alone_rows, axis=-1)
        if ladder.exact_known:
            scattered = scattered + self.error_of(0)
        self.sums.put("scattered", self.sums.add(scattered[:, None])[:, 0])
        for k in range(n - 1):
            log = np.sum(self.alone_rows[:, :k], axis=-1)
            log += noise(
                ladder.h[k:],
                self.rows(k, n - 1, with_exact=ladder.exact_known),
                self.points,
                ladder.floor[:, k:],
            )
            self.sums.put("noise", self.sums.add(log[:, None])[:, 0])

    def posterior(self) -> Posterior:
        """Return what is believed, after all hypotheses were added."""
        values = self.sums.values
        values.setdefault("elsewhere", np.zeros(len(self.points)))
        names = ("alternating", "scattered", "noise", "elsewhere")
        expansion = np.maximum(np.sum(values["window"], axis=-1), TINY)
        total = expansion + sum(values[name] for name in names)
        pairs, first, second, any_power = (
            values.pop(name) / total[:, None]
            for name in ("pairs", "first_alone", "second_alone", "any_power")
        )
        terms = two_powers((1.0,), self.promised)
        lower, higher = (
            (p[terms.starts, None] == self.powers).astype(np.float64)
            for p in (terms.lower, terms.higher)
        )
        for name in (*names, "window"):
            values[name] = values[name] / total.reshape(-1, *[1] * (values[name].ndim - 1))
        if self.ladder.exact_known:
            values["path"], values["path_squared"] = self.alone_rows * np.nan, total * np.nan
        else:
            # a coarse level may have blown up: what cannot be is not multiplied by it
            likely = values["window"] > math.exp(NEGLIGIBLE)
            expansion = np.maximum(np.sum(values["window"] * likely, axis=-1), TINY) * total
            values["path"] = np.sum(values["path"] * likely[..., None], axis=1) / expansion[:, None]
            values["path_squared"] = np.sum(values["path_squared"] * likely, axis=1) / expansion
        return Posterior(
            powers=self.powers,
            orders=self.orders,
            windows=self.windows,
            alone=any_power + first @ lower + second @ higher,
            of_pairs=pairs - first - second,
            pairs=np.stack([p[terms.starts] for p in (terms.lower, terms.higher)], axis=-1),
            lowest=any_power + (pairs - second) @ lower + second @ higher,
            highest=any_power + first @ lower + (pairs - first) @ higher,
            **values,
        )


def posterior(ladder: Ladder, promised: float | None = None) -> Posterior:
    """Return what is believed of ladders of three levels and more, all of whose numbers are finite."""
    fit = _Fit(ladder, promised)
    for index in range(len(fit.windows)):
        fit.add_window(index)
    fit.add_no_expansion()
    return fit.posterior()
