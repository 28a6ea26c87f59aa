"""The rows of ladders with their rounding, and the evidence of rows outside a window."""

from __future__ import annotations

import numpy as np

from vibsim.convergence.error_model import priors
from vibsim.convergence.error_model.ladder import Ladder, orders_of
from vibsim.convergence.error_model.likelihood import (
    TINY,
    free_row_evidence,
    noise_evidence,
    scale_free,
)
from vibsim.convergence.error_model.matrices import level_differences, noise_of_rows
from vibsim.core.array_types import Floats
from vibsim.elementary import on_arrays


class Rows:
    """The rows of ladders; a window has the coarsest level `start` and the finest level `end`."""

    def __init__(self, ladder: Ladder) -> None:
        self.ladder, self.points, n = ladder, ladder.points, len(ladder.h)
        self.orders = orders_of(ladder)
        # rounding of a level is relative to the largest difference at this and finer levels
        squares = np.diagonal(ladder.gram, axis1=1, axis2=2)[:, : n - 1]
        largest = np.maximum.accumulate(squares[:, ::-1], axis=-1)[:, ::-1]
        largest = np.concatenate([largest, largest[:, -1:]], axis=-1)
        # it is added to the Gram matrix, so that no difference is smaller
        self.rounding = priors.ROUNDING * (ladder.floor**2 + priors.EPSILON**2 * largest + TINY)
        self.differences = self.gram(0, n - 1)
        self.free = free_row_evidence(self.differences, self.points) - priors.FREE_PENALTY
        self._finer = {end: self._finer_rows(end) for end in range(2, n)}

    def gram(self, start: int, end: int, *, with_exact: bool = False) -> Floats:
        """Return the Gram matrix of the differences of a window, and of the true error of its finest level."""
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

    def unrelated(self) -> Floats:
        """Return the log evidence that all rows have unrelated sizes: the unit of all other evidence."""
        log: Floats = np.sum(self.free, axis=-1)
        if self.ladder.exact_known:
            # the true error of the coarsest level may have any size, too
            squared = np.maximum(self.gram(0, 0, with_exact=True)[:, 0, 0], TINY)
            log = log + (scale_free(squared, 0.0, self.points, 1) - priors.FREE_PENALTY)
        return log

    def noise_from(self, level: int) -> Floats:
        """Return the log evidence that all rows from this level on are noise, and coarser ones have unrelated sizes."""
        log: Floats = np.sum(self.free[:, :level], axis=-1)
        ladder = self.ladder
        gram = self.gram(level, len(ladder.h) - 1, with_exact=ladder.exact_known)
        log += noise_evidence(ladder.h[level:], gram, self.points, ladder.floor[:, level:])
        return log

    def outside(self, start: int, end: int) -> Floats:
        """Return the log evidence of the rows outside a window: coarser ones are unrelated, finer ones noise."""
        log: Floats = np.sum(self.free[:, :start], axis=-1)
        for evidence in self._finer[end]:
            log += evidence
        return log

    def _finer_rows(self, end: int) -> tuple[Floats, Floats]:
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
        """Return the argument `finer` of `kernel` for a window."""
        with_finer = np.sum(self.differences[:, :, end:], axis=-1)
        square = np.sum(with_finer[:, end:], axis=-1, keepdims=True)
        last = np.maximum(self.differences[:, end - 1, end - 1], TINY)
        products = np.concatenate([with_finer[:, start:end], square], axis=-1)
        return np.asarray(products / last[:, None])
