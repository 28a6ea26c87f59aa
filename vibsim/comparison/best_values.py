"""The most accurate value of each number of a ladder: extrapolated, with a bound of its error.

The numbers are those that a ``value`` check may use at ``level: best``. Each is computed at all levels
(`vibsim.comparison.value_numbers`) and then extrapolated (`vibsim.convergence.extrapolation.numbers`), since the peaks
of an extrapolated solution are meaningless. The grid convergence index of the finest level is added
(`vibsim.convergence.extrapolation.gci`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.formal_orders import even_powers, formal_orders
from vibsim.comparison import value_numbers
from vibsim.comparison.batches import batches
from vibsim.comparison.comparison_variables import Table
from vibsim.comparison.extremum_of_levels import extremum_of_levels
from vibsim.comparison.quantity_comparison import Compared
from vibsim.comparison.thresholds import ERROR_OF_LINE, IRREGULAR, ORDER_OF_GRID, ORDER_OF_PARABOLA
from vibsim.convergence.differences import safe_ratio
from vibsim.convergence.extrapolation import gci
from vibsim.convergence.extrapolation.numbers import Limit, limit, observed_order
from vibsim.convergence.extrapolation.thresholds import NUMBER_SAFETY_ALONE
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Variable, flags
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, MEMBER
from vibsim.experiment.value_names import VALUES
from vibsim.models import Model
from vibsim.observe import oscillation, spectrum, steady_state
from vibsim.observe.member_block import MemberBlock, energy_at_start
from vibsim.schemes.orders import depends_on_velocity, is_autonomous

FROM_PEAK_TIMES = (
    "period", "period_error", "frequency", "error_of_frequency", "phase_error_per_period"
)  # fmt: skip
"""Numbers computed from the times of peaks, unless the motion has a recurrence."""


@dataclass(frozen=True)
class Scalar:
    """A number of each scheme and member that has a limit."""

    variable: str  # name in the convergence Record
    value: str  # name among `vibsim.experiment.value_names.VALUES`
    quantity: str  # empty if it belongs to none
    units: str
    words: str


def value(name: str, place: value_numbers.Place) -> tuple[Floats, Floats, Floats]:
    """Return the number `name` at `place`, the bound of its error, and the part of it that no level shows.

    Each has the shape (scheme, case). The bound is NaN if the number is not a limit or the levels give no bound, and
    infinite if no levels can give one.
    """
    if not VALUES[name].has_limit(place.level):
        bound = np.where(place.is_open(name), np.inf, np.nan)
        return value_numbers.value(name, place), bound, np.zeros(place.block.shape)
    ladder = _ladder(name, place)
    best = ladder.limit()
    found = steady_state.wrapped(best.value) if VALUES[name].is_angle else best.value
    # an absolute value has no negative limit
    least = 0.0 if name in ("max_abs", "relative_energy_error") else -np.inf
    return np.maximum(found, least), best.bound, ladder.missed


@dataclass(frozen=True)
class _Ladder:
    """A number at each level, and its promised order; shapes (scheme, case, level) and (scheme, case)."""

    levels: tuple[int, ...]
    values: Floats  # NaN for adaptive schemes, which have no levels
    order: Floats
    even: Flags
    floor: Floats
    size: Floats  # size of the solution, or of the number itself
    missed: Floats  # error that no level shows: of an extremum between points, of a corner of the force; or infinite
    safety: Floats  # factor on the bound
    of_series: Floats  # value and bound of a sample in the extrapolated series, (..., 2); NaN for other numbers

    def over(self, unit: Floats) -> _Ladder:
        """Return the ladder of the number over a unit, shape (scheme, case)."""
        known = np.where(unit > 0.0, unit, np.nan)
        with np.errstate(invalid="ignore"):  # an energy that overflows
            return replace(
                self,
                size=self.size / known,
                missed=self.missed / known,
                values=self.values / known[..., None],
                floor=self.floor / known[..., None],
            )

    def limit(self) -> Limit:
        """Return the limit, with a bound that includes `missed`; or that of the series, if closer."""
        found = limit(self.values, self.levels, self.order, self.even, self.floor)
        bound = self.safety * found.bound + self.missed
        value, series_bound = np.moveaxis(self.of_series, -1, 0)
        # a series has one change, as a number whose extrapolation rests on one
        series_bound = NUMBER_SAFETY_ALONE * series_bound
        is_closer = series_bound < bound
        bound = np.where(is_closer, series_bound, bound)
        return Limit(
            np.where(is_closer, value, found.value),
            np.where(np.isinf(self.missed), np.inf, bound),
            np.where(is_closer, max(len(self.levels) - 3, 0), found.first),
            np.where(is_closer, len(self.levels) - 1, found.last),
        )


def _ladder(name: str, place: value_numbers.Place) -> _Ladder:
    if name == "relative_energy_error":
        largest = _ladder("max_abs", replace(place, quantity="energy_deviation"))
        return largest.over(np.abs(energy_at_start(place.block.finest)))
    block, comparison, row = place.block, place.comparison(), VALUES[name]
    if row.is_sample:
        rows = value_numbers.samples(place)
    else:
        rows = [value_numbers.value(name, replace(place, level=lv)) for lv in place.levels]
    values = np.stack(rows, axis=-1)
    values[block.adaptive] = np.nan
    if not row.survives_failure:
        values[block.failed] = np.nan
    if row.is_angle:
        values = steady_state.continued(values, values[..., -1:])
    size = _size(name, place, values)
    if comparison is not None and row.is_sample:
        floor = comparison.floor
    else:
        relative = block.relative_floor * block.magnified[:, None]
        if row.measured_by == "roots" and oscillation.has_recurrence(block, place.levels[-1]):
            relative = relative / np.minimum(block.omega_dt, 1.0) ** 2
        floor = np.broadcast_to(relative * size[..., None], values.shape)
    missed, (order, even) = block.unseen_at_corner(size), _promised(name, place)
    if row.measured_by == "points":
        values, error, is_smooth = extremum_of_levels(name, place, values, floor, size, order)
        missed = missed + error
        order = np.where(is_smooth, order, np.minimum(order, ORDER_OF_GRID))
        even = even & is_smooth
    if name in FROM_PEAK_TIMES:
        missed = missed + _error_of_period(place) * size
    if row.rests_on_run:
        missed = missed + _of_run(name, place)
    safety = np.broadcast_to(block.safety(IRREGULAR), size.shape)
    astray = _of_wrong_limit(name, place)
    missed = missed + astray
    if row.needs_events:
        # how late an event on the mesh is depends on the mesh by accident
        missed = np.where(np.isnan(block.left_to_the_mesh), missed, np.inf)
    missed = np.where(np.isfinite(block.missed.time) | place.is_open(name), np.inf, missed)
    of_series = np.full((*size.shape, 2), np.nan)
    if row.is_sample and len(place.levels) >= LEVELS_OF_AN_ORDER:
        of_series = np.where(astray[..., None] > 0.0, np.nan, value_numbers.sample_of_series(place))
    return _Ladder(place.levels, values, order, even, floor, size, missed, safety, of_series)


def _stacked(rows: Sequence[_Ladder]) -> _Ladder:
    """Stack ladders of the same levels along a new first axis."""
    _, *names = vars(rows[0])
    return _Ladder(rows[0].levels, *(np.stack([getattr(r, name) for r in rows]) for name in names))


def _error_of_period(place: value_numbers.Place) -> Floats:
    """Return the relative error of a period that is the mean time between peaks, shape (scheme, case).

    A peak is the zero of the straight line between two velocities, with an error of at most ``dt^2/8 |u'''/u''|``. That
    vanishes if the force depends only on the position; otherwise the damping rate and the frequency bound the quotient.
    """
    block, model = place.block, place.block.model
    if model.is_alone and is_autonomous(model) and not depends_on_velocity(model):
        return np.zeros(block.shape)
    if oscillation.has_recurrence(block, place.levels[-1]):
        return np.zeros(block.shape)
    period, count = (np.asarray(block.finest[name]) for name in ("period", "period_count"))
    dt = block.group.end / block.grid.steps[-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        rate = block.decay + 2.0 * np.pi / period
        error_of_peak = rate * ERROR_OF_LINE * dt**2
        return np.asarray(2.0 * error_of_peak / (count * period))


def _of_wrong_limit(name: str, place: value_numbers.Place) -> Floats:
    """Return the error of a number whose levels approach another solution than the exact one, shape (scheme, case).

    A number in the unit of the solution is off by no more than the solution; any other one by an unknown amount.
    """
    own = place.comparison()
    q = own or place.compared.get(place.block.model.position)
    distance = np.zeros(place.block.shape) if q is None else q.beyond_the_bound
    if own is not None and (VALUES[name].is_sample or VALUES[name].measured_by == "points"):
        return distance
    return np.where(distance > 0.0, np.inf, 0.0)


def _of_run(name: str, place: value_numbers.Place) -> Floats:
    """Return the error of a number due to the finite length of the run, shape (scheme, case)."""
    at = place.block, place.levels[-1], place.quantity
    if name == "peak_frequency":
        return spectrum.error_by_other_lines(*at)
    left = steady_state.distance(*at)
    return left if name == "steady_amplitude" else safe_ratio(left, steady_state.amplitude(*at))


def _promised(name: str, place: value_numbers.Place) -> tuple[Floats, Flags]:
    """Return the promised order of a number, and whether its powers are even, shape (scheme, case)."""
    block, experiment = place.block, place.block.experiment
    quantity = place.quantity or block.model.position
    order = formal_orders(experiment, quantity, block.columns, block.eventless)
    even = even_powers(experiment, quantity, block.columns)
    if VALUES[name].measured_by == "parabola":
        order, even = np.minimum(order, ORDER_OF_PARABOLA), np.zeros_like(even)
    return np.broadcast_to(order, block.shape), np.broadcast_to(even, block.shape)


def _size(name: str, place: value_numbers.Place, values: Floats) -> Floats:
    """Return the size that errors are relative to: of the solution, or of the number itself."""
    finest, row = replace(place, level=place.levels[-1]), VALUES[name]
    if row.is_sample or row.measured_by == "points":
        q = place.comparison()
        if q is not None:
            return q.scale
        ends = (name,) if name == "max_abs" else ("min", "max")
        rows = [np.abs(value_numbers.value(end, finest)) for end in ends]
        return np.asarray(np.maximum.reduce(rows))
    if row.has_own_size:
        return np.abs(values[..., -1])
    if name == "phase_error_per_period":
        return value_numbers.value("period", finest)
    # relative errors
    return np.ones(values.shape[:-1])


def scalars(model: Model, lean: bool = False) -> tuple[Scalar, ...]:
    """Return the numbers whose limits are stored: only period and amplitude if storage is bounded (`lean`)."""
    rows = [("period", "s", "period"), ("amplitude", model.states[0].unit, "amplitude")]
    if not lean:
        rows += [
            ("frequency", "rad s-1", "angular frequency"),
            ("growth_per_period", "1", "growth factor per period"),
            ("relative_energy_error", "1", "max |E - E(0)| / |E(0)|"),
        ]
    result = [Scalar(name, name, "", unit, words) for name, unit, words in rows]
    for quantities, names in ((model.states, WORDS), (model.outputs, ("min", "max"))):
        for row in () if lean else quantities:
            for name in names:
                words = f"{row.long_name}, {WORDS[name]}"
                result.append(Scalar(f"{row.name}_{name}", name, row.name, row.unit, words))
    return tuple(result)


WORDS = {"end": "at the end", "min": "least value", "max": "largest value"}

COLUMNS = {
    "finest": "finest level, in its own unit",
    "gci": "relative grid convergence index",
    "order": "observed order",
    "convergence": "how the levels follow each other",
    "first": "coarsest level used",
    "last": "finest level used",
}
"""Further variables for each number, stored unless storage is bounded."""


def table(block: MemberBlock, compared: Compared) -> Table:
    """Return the limits of all numbers with their bounds, as variables of the convergence Record."""
    variables: Table = {}
    columns_by_name: dict[str, list[NDArray[Any]]] = {name: [] for name in COLUMNS}
    levels = np.array(block.grid.levels, dtype=np.int16)
    for rows in batches(scalars(block.model, block.lean), math.prod(block.shape)):
        places = [
            value_numbers.Place(block, compared, r.quantity, "best", None, None) for r in rows
        ]
        ladder = _stacked([_ladder(r.value, p) for r, p in zip(rows, places, strict=True)])
        best = ladder.limit()
        bound = np.where(np.isinf(best.bound), np.nan, best.bound)
        numbers = {
            "richardson": (best.value, "extrapolated over the levels"),
            "richardson_error": (bound, "bound of the error of the extrapolated value"),
        }
        if not block.lean:
            kinds = gci.classify(ladder.values, ladder.levels, ladder.floor)
            index = gci.index(ladder.values, ladder.levels, ladder.order, kinds)
            numbers["gci"] = index, "grid convergence index of the finest level"
        for i, row in enumerate(rows):
            for key, (values, words) in numbers.items():
                text, entry = f"{row.words}: {words}", values[i].copy()
                variables[f"{row.variable}_{key}"] = Variable.of(MEMBER, entry, text, row.units)
        if block.lean:
            continue
        columns: tuple[NDArray[Any], ...] = (
            ladder.values[..., -1],
            gci.relative(index, ladder.values[..., -1], ladder.size),
            observed_order(ladder.values, ladder.levels, ladder.floor),
            kinds,
            levels[best.first],
            levels[best.last],
        )
        for column, values in zip(columns_by_name.values(), columns, strict=True):
            column.extend(values)
    for name, rows_of_column in columns_by_name.items():
        if rows_of_column:
            attributes = flags(gci.CLASSES) if name == "convergence" else {}
            dims, values = ("scalar", *MEMBER), np.stack(rows_of_column)
            variables[f"scalar_{name}"] = Variable.of(dims, values, COLUMNS[name], **attributes)
    return variables


def coordinate(block: MemberBlock) -> Table:
    """Return the coordinate of the numbers; empty if only their limits are stored."""
    if block.lean:
        return {}
    names = np.array([row.variable for row in scalars(block.model)])
    return {"scalar": Variable.of(("scalar",), names, "numbers of which the limit was sought")}
