"""Numbers of every member at the finest level, each with its error bar.

The error of the finer of two levels follows from their difference d and the order p: ``d/(r^p - 1)``, where r is the
ratio of their steps (pendulum lecture, section 2.5). The interval of p gives that of the error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import MEMBER
from vibsim.report.data import Ladder, Results
from vibsim.report.style import finite, no_zeros

LAST_PART = 4
"""A settled motion swings no further than its amplitude in the last one of so many parts of the time."""
SETTLED = 0.1  # largest relative excess of the swing of a settled motion over its amplitude
SWINGS = (
    f"in the last quarter of the run the motion still swings over {100 * SETTLED:g} % further "
    "than this amplitude"
)
VARIES = 1e-6  # relative spread below which members share a number


@dataclass(frozen=True)
class Measured:
    """A number of every scheme and member with its error bar; arrays have the shape (scheme, case)."""

    name: str
    unit: str
    value: Floats
    error: Floats  # estimated from the two finest levels; NaN with a single level


@dataclass(frozen=True)
class Error:
    """The norm of the error of the finest level; arrays have the shape (scheme, case)."""

    true: Floats  # against the exact solution; NaN without one
    estimate: Floats
    low: Floats
    high: Floats  # estimates with the ends of the interval of the order; NaN without one

    @property
    def kind(self) -> str:
        """``true`` if any member has an exact solution to compare with, else ``estimated``."""
        return "true" if np.isfinite(self.true).any() else "estimated"

    @property
    def best(self) -> Floats:
        """The true error if it is known, else the estimate."""
        return np.where(np.isfinite(self.true), self.true, self.estimate)


def error(record: Results, quantity: str) -> Error:
    """Return the error of a quantity at the finest level, in the typical norm."""
    true = true_error(record, quantity)
    if not record.pairs:
        nothing = np.full_like(true, np.nan)
        return Error(true, nothing, nothing, nothing)
    last = record.pick(f"{quantity}_difference_norm", pair=-1)
    order, low, high = record.orders(quantity)
    stated = np.where(np.isfinite(order), order, record.formal_orders(quantity))
    return Error(true, *(last * _error_fraction(record, p) for p in (stated, high, low)))


def true_error(record: Results, quantity: str) -> Floats:
    """Return the norm of the true error of the finest level, shape (scheme, case); NaN without an exact solution."""
    return record.optional(f"{quantity}_error_norm", MEMBER, level=-1)


def norms(ladder: Ladder) -> Floats:
    """Return the true error of a member at every level, or the differences of its levels if it is unknown."""

    def norm(name: str) -> Floats:
        return no_zeros(ladder.at(f"{name}_norm"))

    is_known = np.isfinite(norm("error")).any() or not ladder.record.pairs
    return norm("error") if is_known else np.append(norm("difference"), np.nan)


def deviation(record: Results, quantity: str) -> Floats:
    """Return the order, stated or estimated, minus the formal one, shape (scheme, case)."""
    return np.asarray(record.orders(quantity)[0] - record.formal_orders(quantity))


def _error_fraction(record: Results, order: Floats) -> Floats:
    """Return the error of the finest level as a fraction of its difference from the next coarser one."""
    levels = record.levels
    with np.errstate(divide="ignore", over="ignore"):
        ratio = 2.0 ** (order * (levels[-1] - levels[-2])) - 1.0
        return np.where(ratio > 0.0, 1.0 / ratio, np.where(np.isnan(ratio), np.nan, np.inf))


def measured(record: Results, name: str) -> Measured:
    """Return the size of the ``period`` or ``amplitude``, whose sign is arbitrary if a run grows without bound."""
    value = np.abs(record.optional(name, MEMBER, level=-1))
    error = np.full(value.shape, np.nan)
    if record.pairs:
        coarser = np.abs(record.optional(name, MEMBER, level=-2))
        order = record.formal_orders(record.model.position)
        error = np.abs(value - coarser) * _error_fraction(record, order)
    return Measured(name, record.unit(name), value, error)


def unsettled(record: Results) -> Flags:
    """Return which members still swing further than their amplitude says, shape (scheme, case).

    Their motion has several frequencies, or has not yet decayed. Without stored series nothing is known.
    """
    name = f"{record.model.position}_finest"
    size = np.abs(record.optional("amplitude", MEMBER, level=-1))
    if name not in record:
        return np.zeros(size.shape, np.bool_)
    series = np.asarray(record[name], dtype=np.float64)
    late = series[..., -(series.shape[-1] // LAST_PART) :]
    return np.asarray(0.5 * np.ptp(late, axis=-1) > (1.0 + SETTLED) * size)


def varies(values: Floats) -> bool:
    """Return whether the sizes of numbers differ by more than rounding."""
    sizes = np.abs(finite(values))
    return sizes.size > 1 and bool(np.ptp(sizes) > VARIES * sizes.max())


def period_error(record: Results, level: int) -> Floats:
    """Return the relative error of the period at a position of `level`, shape (scheme, case); NaN if unknown."""
    period, exact = record.optional("period", MEMBER, level=level), record.exact_periods
    with np.errstate(invalid="ignore", divide="ignore"):
        # on the separatrix the exact period is infinite
        return np.asarray(np.where(np.isinf(exact), np.nan, np.abs(period / exact - 1.0)))
