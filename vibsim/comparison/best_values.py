"""The most accurate value of every number that a ladder holds: extrapolated, with a bound of its error.

Numbers are those that a ``value`` check may ask for at ``level: best``. Each is worked out at every level first
(`vibsim.comparison.value_numbers`), and its limit taken from these (`vibsim.convergence.number_extrapolation`): an
extrapolated solution has no peaks of its own. Beside the bound stands the grid convergence index of the finest level
(`vibsim.convergence.gci`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.formal_orders import even_powers, formal_orders
from vibsim.comparison import value_numbers
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.comparison.thresholds import MISSED_EXTREMUM, OF_GRID, OF_PARABOLA
from vibsim.convergence import gci
from vibsim.convergence.number_extrapolation import Limit, limit, observed_order
from vibsim.convergence.thresholds import ORDER_ABOVE_ROUND_OFF
from vibsim.core.array_types import Codes, Flags, Floats
from vibsim.core.record import Variable, attributes
from vibsim.experiment.value_names import HAVE_LIMITS
from vibsim.models import Model
from vibsim.observe import oscillation
from vibsim.observe.member_block import MemberBlock

Table = dict[str, Variable]

MEMBER = ("scheme", "case")

_INTERPOLATED = frozenset(
    {"period", "period_error", "amplitude", "amplitude_error", "growth_factor"}
)
_AT_POINTS = frozenset({"min", "max", "max_abs"})
_ON_THE_GRID = frozenset({"min", "max", "max_abs", "relative_energy_error"})
_OF_ROOTS = frozenset(
    {"frequency", "error_of_frequency", "phase_error_per_period", "growth_per_period"}
)
"""Made of the recurrence of the steps, whose round-off is eps/(w dt)^2; by peaks where there is none."""


@dataclass(frozen=True)
class Scalar:
    """A number of every scheme and member that has a limit."""

    variable: str  # name in the convergence Record
    value: str  # name among `vibsim.experiment.value_names.VALUES`
    quantity: str  # empty where it is of none
    units: str
    words: str


@dataclass(frozen=True)
class Best:
    """A number at every level, and what its limit is; arrays of shape (scheme, case) and (scheme, case, level)."""

    levels: Floats
    limit: Limit
    order: Floats  # observed order; NaN where there is none
    kind: Codes  # position in `gci.CLASSES`
    index: Floats  # grid convergence index of the finest level
    relative: Floats  # the same over the number; NaN where that is near zero


def has_limit(name: str, level: int | str | None) -> bool:
    """Tell whether a value is asked for as the limit of the numbers of the levels."""
    return level == "best" and name in HAVE_LIMITS


def value(name: str, place: value_numbers.Place) -> tuple[Floats, Floats]:
    """Return the number `name` at `place`, and the bound of its error, shape (scheme, case).

    The bound is NaN where the number is not a limit, or nothing is known of its error.
    """
    if not has_limit(name, place.level):
        return value_numbers.value(name, place), place.missing
    found = _ladder(name, place).limit()
    return found.value, found.bound


@dataclass(frozen=True)
class _Ladder:
    """A number at every level, and what is promised of it; shapes (scheme, case, level) and (scheme, case)."""

    values: Floats
    order: Floats
    even: Flags
    floor: Floats
    # what the points of the finest grid may miss of an extremum, shape (scheme, case)
    missed: Floats
    levels: tuple[int, ...]

    def limit(self) -> Limit:
        """Return the limit."""
        found = limit(self.values, self.levels, self.order, self.even, self.floor)
        return replace(found, bound=found.bound + self.missed)


def _ladder(name: str, place: value_numbers.Place) -> _Ladder:
    """Return the ladder of the number `name`; NaN for schemes that have no levels."""
    found = _at_levels(name, place)
    found[place.block.adaptive] = np.nan
    order, even = _promised(name, place)
    floor = _floor(name, place, found)
    return _Ladder(found, order, even, floor, _missed(name, place, found, floor), place.levels)


def _missed(name: str, place: value_numbers.Place, found: Floats, floor: Floats) -> Floats:
    """Return how much of an extremum lies between grid points: ``w^2 dt^2/8`` of its size at most.

    How much differs from level to level by accident, which no extrapolation takes away. Nothing is missed where the
    levels have the same number.
    """
    nothing = np.zeros(found.shape[:-1])
    if name not in _AT_POINTS:
        return nothing
    p = np.minimum(place.block.omega_dt[:, -1], 1.0)
    apart = np.abs(np.diff(found[..., -3:], axis=-1))
    with np.errstate(invalid="ignore"):
        same = np.all(apart <= ORDER_ABOVE_ROUND_OFF * floor[..., -1:], axis=-1)
    return np.where(same, nothing, MISSED_EXTREMUM * p**2 * _scale(name, place, found))


def best(name: str, place: value_numbers.Place) -> Best:
    """Return the limit of the number `name`, and how its levels approach it."""
    one = _ladder(name, place)
    kinds = gci.classify(one.values, one.levels, one.floor)
    index = gci.index(one.values, one.levels, one.order, kinds)
    return Best(
        levels=one.values,
        limit=one.limit(),
        order=observed_order(one.values, one.levels, one.floor),
        kind=kinds,
        index=index,
        relative=gci.relative(index, one.values[..., -1], _scale(name, place, one.values)),
    )


def _at_levels(name: str, place: value_numbers.Place) -> Floats:
    """Return the number at every level, shape (scheme, case, level); those of a series at a common time."""
    if name in ("end", "at"):
        found = value_numbers.samples(place)
    else:
        rows = (replace(place, level=level) for level in place.levels)
        found = [value_numbers.value(name, row) for row in rows]
    return np.stack(found, axis=-1)


def _promised(name: str, place: value_numbers.Place) -> tuple[Floats, Flags]:
    """Return the order that a number should have, and whether its powers are even, shape (scheme, case)."""
    block, experiment = place.block, place.block.experiment
    quantity = place.quantity or block.model.position
    if name == "relative_energy_error":
        quantity = "energy_deviation"
    order = formal_orders(experiment, quantity, block.columns)
    even = even_powers(experiment, quantity, block.columns)
    if name in _INTERPOLATED:
        order, even = np.minimum(order, OF_PARABOLA), np.zeros_like(even)
    elif name in _ON_THE_GRID:
        order, even = np.minimum(order, OF_GRID), np.zeros_like(even)
    return np.broadcast_to(order, block.shape), np.broadcast_to(even, block.shape)


def _floor(name: str, place: value_numbers.Place, found: Floats) -> Floats:
    """Return the predicted round-off of a number at every level, in its unit."""
    block, comparison = place.block, place.comparison()
    if comparison is not None and name in ("end", "at"):
        return comparison.floor
    relative = block.relative_floor * block.magnified[:, None]
    if name in _OF_ROOTS and oscillation.has_recurrence(block, place.levels[-1]):
        relative = relative / np.minimum(block.omega_dt, 1.0) ** 2
    size = _scale(name, place, found)
    return np.broadcast_to(relative * size[..., None], found.shape)


def _scale(name: str, place: value_numbers.Place, found: Floats) -> Floats:
    """Return the size that such a number has: of the solution, or of the number itself."""
    if name in ("end", "at", "min", "max", "max_abs"):
        q, block = place.comparison(), place.block
        if q is not None:
            return q.scale
        rows = [value_numbers.value(which, replace(place, level=block.grid.levels[-1]))
                for which in ("min", "max")]  # fmt: skip
        return np.asarray(np.maximum(*np.abs(rows)))
    if name in ("period", "frequency", "amplitude", "growth_per_period", "growth_factor"):
        return np.abs(found[..., -1])
    if name == "phase_error_per_period":
        return value_numbers.value("period", replace(place, level=place.levels[-1]))
    # relative errors
    return np.ones(found.shape[:-1])


def scalars(model: Model, lean: bool = False) -> tuple[Scalar, ...]:
    """Name the numbers whose limits are kept; where storage is bounded, period and amplitude."""
    first = model.states[0]
    whole = [
        Scalar("period", "period", "", "s", "period"),
        Scalar("amplitude", "amplitude", "", first.unit, "amplitude"),
    ]
    if lean:
        return tuple(whole)
    whole += [
        Scalar("frequency", "frequency", "", "rad s-1", "angular frequency"),
        Scalar("growth_per_period", "growth_per_period", "", "1", "growth factor per period"),
        Scalar("relative_energy_error", "relative_energy_error", "", "1", "max |E - E(0)| / |E(0)|"),
    ]  # fmt: skip
    for state in model.states:
        whole += _of(state.name, state.unit, state.long_name, ("end", "min", "max"))
    for output in model.outputs:
        whole += _of(output.name, output.unit, output.long_name, ("min", "max"))
    return tuple(whole)


WORDS = {"end": "at the end", "min": "least value", "max": "largest value"}


def _of(name: str, unit: str, words: str, which: tuple[str, ...]) -> list[Scalar]:
    return [Scalar(f"{name}_{w}", w, name, unit, f"{words}, {WORDS[w]}") for w in which]


def table(block: MemberBlock, compared: Mapping[str, Comparison]) -> Table:
    """Return the limits of all numbers, as variables of the convergence Record."""
    found: Table = {}
    kept = []
    for row in scalars(block.model, block.lean):
        place = value_numbers.Place(block, compared, row.quantity, "best", None, None)
        if block.lean:
            found |= _of_limit(row, _ladder(row.value, place).limit())
            continue
        one = best(row.value, place)
        words = f"{row.words}: grid convergence index of the finest level"
        index = Variable(MEMBER, one.index, attributes(words, row.units))
        found |= _of_limit(row, one.limit) | {f"{row.variable}_gci": index}
        kept.append(one)
    return found | _stacked(block, kept) if kept else found


def _of_limit(row: Scalar, found: Limit) -> Table:
    """Return the limit of a number and its bound."""
    value = attributes(f"{row.words}: extrapolated over the levels", row.units)
    bound = attributes(f"{row.words}: bound of the error of the extrapolated value", row.units)
    return {
        f"{row.variable}_richardson": Variable(MEMBER, np.array(found.value), value),
        f"{row.variable}_richardson_error": Variable(MEMBER, found.bound, bound),
    }


def _stacked(block: MemberBlock, kept: list[Best]) -> Table:
    """Return what is kept along the numbers: the finest level, the relative index, order, class, levels."""
    levels = np.array(block.grid.levels, dtype=np.int16)
    dims = ("scalar", *MEMBER)
    flags: dict[str, Any] = {
        "flag_values": np.arange(len(gci.CLASSES), dtype=np.int8),
        "flag_meanings": " ".join(gci.CLASSES),
    }
    columns: Mapping[str, tuple[list[NDArray[Any]], str]] = {
        "finest": ([one.levels[..., -1] for one in kept], "finest level, in its own unit"),
        "gci": ([one.relative for one in kept], "relative grid convergence index"),
        "order": ([one.order for one in kept], "observed order"),
        "convergence": ([one.kind for one in kept], "how the levels follow each other"),
        "first": ([levels[one.limit.first] for one in kept], "coarsest level used"),
        "last": ([levels[one.limit.last] for one in kept], "finest level used"),
    }
    found = {
        f"scalar_{name}": Variable(dims, np.stack(rows), attributes(words, "1"))
        for name, (rows, words) in columns.items()
    }
    flagged = found["scalar_convergence"]
    attrs: dict[str, Any] = {**flagged.attrs, **flags}
    return found | {"scalar_convergence": Variable(dims, flagged.values, attrs)}


def coordinate(block: MemberBlock) -> Table:
    """Return the coordinate of the numbers; empty where only their limits are kept."""
    if block.lean:
        return {}
    names = np.array([row.variable for row in scalars(block.model, block.lean)])
    words = "numbers of which the limit was sought"
    return {"scalar": Variable(("scalar",), names, attributes(words, "1"))}
