"""What is known of every member at the finest level, each number with its error bar.

The error of the finest of two levels follows from their difference d and the order p: ``d/(r^p - 1)``, where r is the
ratio of their steps (pendulum lecture, section 2.5, for the finer level). The interval of p gives that of the error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import MEMBER, TYPICAL_NORM
from vibsim.report import data
from vibsim.report.data import Member, formal_orders, known, norm_index, whole
from vibsim.report.style import finite, no_zeros

VARIES = 1e-6
"""Relative spread below which a number is the same for all members."""


@dataclass(frozen=True)
class Measured:
    """One number of every scheme and member with its error bar; arrays have the shape (scheme, case)."""

    name: str
    unit: str
    value: Floats
    error: Floats  # estimated from the two finest levels; NaN with a single level


@dataclass(frozen=True)
class Error:
    """The norm of the error of the finest level; arrays have the shape (scheme, case)."""

    true: Floats  # against the exact solution; NaN where there is none
    estimate: Floats
    low: Floats
    high: Floats
    """Estimate with the ends of the interval of the order; NaN where no interval is stated."""

    @property
    def kind(self) -> str:
        """Whether any member has an exact solution to compare with."""
        return "true" if np.isfinite(self.true).any() else "estimated"

    @property
    def best(self) -> Floats:
        """The true error where it is known, else the estimate."""
        return np.where(np.isfinite(self.true), self.true, self.estimate)


def error(record: Record, quantity: str) -> Error:
    """Return the error of a quantity at the finest level, in the typical norm."""
    norm, true = norm_index(record), true_error(record, quantity)
    if not whole(record, "pair"):
        nothing = np.full_like(true, np.nan)
        return Error(true, nothing, nothing, nothing)
    last = data.pick(record, f"{quantity}_difference_norm", norm=norm, pair=-1)
    order, low, high = orders(record, quantity)
    stated = np.where(np.isfinite(order), order, formal_orders(record, quantity))
    return Error(true, *(last * _part(record, p) for p in (stated, high, low)))


def true_error(record: Record, quantity: str) -> Floats:
    """Return the norm of the true error of the finest level, shape (scheme, case); NaN where there is none."""
    norm = norm_index(record)
    return known(record, f"{quantity}_error_norm", MEMBER, norm=norm, level=-1)


def norms(record: Record, quantity: str, member: Member) -> Floats:
    """Return the true error of a member at every level, or the differences of its levels where it is not known."""

    def of(name: str) -> Floats:
        return no_zeros(data.at(record, f"{quantity}_{name}_norm", member, norm=norm_index(record)))

    is_known = np.isfinite(of("error")).any() or not whole(record, "pair")
    return of("error") if is_known else np.append(of("difference"), np.nan)


def orders(
    record: Record, quantity: str, norm: str = TYPICAL_NORM
) -> tuple[Floats, Floats, Floats]:
    """Return the stated order of every scheme and member and the ends of its interval, shape (scheme, case)."""
    order, low, high = (
        # a large sweep has orders of what checks ask about only
        known(record, f"{quantity}_order{end}", MEMBER, norm=norm_index(record, norm))
        for end in ("", "_low", "_high")
    )
    return order, low, high


def deviation(record: Record, quantity: str) -> Floats:
    """Return the stated order minus the promised one, shape (scheme, case)."""
    return np.asarray(orders(record, quantity)[0] - formal_orders(record, quantity))


def _part(record: Record, order: Floats) -> Floats:
    """Return the part of the difference of the two finest levels that is left as error of the finest."""
    levels = whole(record, "level")
    with np.errstate(divide="ignore", over="ignore"):
        rest = 2.0 ** (order * (levels[-1] - levels[-2])) - 1.0
        return np.where(rest > 0.0, 1.0 / rest, np.where(np.isnan(rest), np.nan, np.inf))


def measured(record: Record, name: str, position: str) -> Measured:
    """Return the ``period`` or the ``amplitude``, which may have either sign where a run grows without bound."""
    value = np.abs(known(record, name, MEMBER, level=-1))
    error = np.full(value.shape, np.nan)
    if whole(record, "pair"):
        coarser = np.abs(known(record, name, MEMBER, level=-2))
        error = np.abs(value - coarser) * _part(record, formal_orders(record, position))
    return Measured(name, data.unit(record, name), value, error)


def varies(values: Floats) -> bool:
    """Say whether some numbers of members differ by more than their own rounding."""
    found = np.abs(finite(values))
    return found.size > 1 and bool(np.ptp(found) > VARIES * found.max())


def period_error(record: Record, level: int) -> Floats:
    """Return the relative error of the period at a position of `level`, shape (scheme, case); NaN where not known."""
    period, exact = known(record, "period", MEMBER, level=level), data.exact_periods(record)
    with np.errstate(invalid="ignore", divide="ignore"):
        # on the separatrix there is no period to be wrong about
        return np.asarray(np.where(np.isinf(exact), np.nan, np.abs(period / exact - 1.0)))
