"""The numbers of ``value`` checks, computed for all schemes and members at once.

Names, quantities and places are those of `vibsim.experiment.value_names`. A number that does not exist is NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vibsim.comparison.comparison_variables import estimates
from vibsim.comparison.quantity_comparison import Compared, Comparison
from vibsim.comparison.solution_distance import discrete_error, exact_series
from vibsim.convergence.differences import largest, safe_ratio
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.elementary import on_arrays
from vibsim.experiment.value_names import VALUES
from vibsim.observe import oscillation, predicted_oscillation, spectrum, steady_state
from vibsim.observe.event_at_end import may_jump
from vibsim.observe.member_block import MemberBlock, energy_at_start, stored_or_nan


@dataclass(frozen=True)
class Place:
    """The quantity, level and time of a value, and the data to take it from."""

    block: MemberBlock
    compared: Compared  # quantities compared between levels
    quantity: str  # empty if the value belongs to none
    level: int | str | None
    t: float | None
    step: int | None
    event: int | None = None  # number of an event, from 1

    @property
    def missing(self) -> Floats:
        """NaN for every scheme and member, shape (scheme, case)."""
        return np.full(self.block.shape, np.nan)

    @property
    def levels(self) -> tuple[int, ...]:
        """The levels."""
        return self.block.grid.levels

    @property
    def at_level(self) -> int | None:
        """The selected level, by default the finest; None if it does not exist."""
        level = self.levels[-1] if self.level is None else self.level
        return level if isinstance(level, int) and level in self.block.records else None

    def data(self) -> Record | None:
        """Return the Record of the selected level."""
        return None if self.at_level is None else self.block.records[self.at_level]

    def gathered(self, name: str) -> Floats:
        """Return a variable of the selected level for all members; NaN if the level does not have it."""
        data = self.data()
        return self.missing if data is None else stored_or_nan(data, name, self.block.shape)

    def of_quantity(self, which: str) -> Floats:
        """Return a number of the quantity that was gathered over all steps."""
        return self.gathered(f"{self.quantity}_{which}")

    def is_open(self, name: str) -> Flags:
        """Tell where the number `name` depends on an event that may be behind the end, shape (scheme, case)."""
        grid, model = self.block.grid, self.block.model
        if VALUES[name].is_sample:
            data = self.data()
            t, every = (grid.t, grid.stride) if data is None else (data["t"], data.whole("every"))
            is_last = grid.end_included and _index(self, t, every) == len(t) - 1
            depends = is_last and may_jump(model, self.quantity)
        else:
            depends = name in ("event_count", "last_event_time")
        return self.block.event_at_end & depends

    def comparison(self) -> Comparison | None:
        """Return the comparison of the quantity between levels, or None."""
        return self.compared.get(self.quantity)


Number = Callable[[Place], Any]


def value(name: str, place: Place) -> Floats:
    """Return the number `name` at `place`, shape (scheme, case)."""
    number = np.asarray(NUMBERS[name](place), dtype=np.float64)
    return np.array(np.broadcast_to(number, place.block.shape))


def samples(p: Place) -> list[Floats]:
    """Return the values of a series at a common time, by default the last one, at all levels."""
    q, grid = p.comparison(), p.block.grid
    index = _index(p, grid.t, grid.stride)
    if q is None or index is None:
        return [p.missing for _ in p.levels]
    return [values[..., index] for values in q.values]


def sample_of_series(p: Place) -> Floats:
    """Return the value at a common time in the extrapolated series, and the bound of this, shape (scheme, case, 2)."""
    q, grid = p.comparison(), p.block.grid
    index = _index(p, grid.t, grid.stride)
    if q is None or index is None:
        return np.stack([p.missing, p.missing], axis=-1)
    return np.stack([q.extrapolation[0][..., index], q.largest_bound], axis=-1)


def _index(p: Place, t: Floats, every: int) -> int | None:
    """Return the index of the selected sample; None if it was not stored."""
    if p.step is not None:
        index, remainder = divmod(p.step, every)
        return index if remainder == 0 and index < len(t) else None
    if p.t is None:
        return len(t) - 1
    index = int(np.argmin(np.abs(t - p.t)))
    return index if abs(float(t[index]) - p.t) <= 1e-9 * float(t[-1]) else None


def _needs_data(number: Callable[[Place, Record], Any]) -> Number:
    """Wrap a number that is computed from the Record of a level; it is missing without that Record."""

    def take(p: Place) -> Any:
        data = p.data()
        return p.missing if data is None else number(p, data)

    return take


def _at_level(number: Callable[[MemberBlock, int], Floats]) -> Number:
    """Wrap a number of the members at a level."""
    return lambda p: p.missing if p.at_level is None else number(p.block, p.at_level)


@_needs_data
def _sample(p: Place, data: Record) -> Floats:
    """Return the value of a series at a time, by default the last one."""
    if p.quantity not in data:
        return p.missing
    index = _index(p, data["t"], data.whole("every"))
    return p.missing if index is None else np.asarray(data[p.quantity][..., index], dtype=float)


def _extreme(which: str, reduce: Callable[..., Floats]) -> Number:
    """Return an extreme value: gathered over all steps for a state, taken from the samples for an output."""

    def take(p: Place, data: Record) -> Any:
        is_output = p.quantity in {output.name for output in p.block.model.outputs}
        # NaN if a member failed
        sampled = is_output and p.quantity in data
        return reduce(data[p.quantity], axis=-1) if sampled else p.of_quantity(which)

    return _needs_data(take)


@_needs_data
def _max_abs(p: Place, data: Record) -> Floats:
    """Return the largest absolute value, from the gathered one or from the least and the largest value."""
    if f"{p.quantity}_max_abs" in data:
        return p.of_quantity("max_abs")
    return np.asarray(np.maximum(*(np.abs(p.of_quantity(which)) for which in ("min", "max"))))


@_needs_data
def _event_time(p: Place, data: Record) -> Floats:
    """Return the time of an event by its number; NaN if there are fewer events."""
    times = np.asarray(data["event_time"]) if "event_time" in data else p.missing[..., :0]
    index = (p.event or 0) - 1
    return times[..., index] if 0 <= index < times.shape[-1] else p.missing


def _of_quantity(number: Callable[[MemberBlock, int, str], Floats]) -> Number:
    """Wrap a number of a quantity of the members at a level."""
    return lambda p: p.missing if p.at_level is None else number(p.block, p.at_level, p.quantity)


def _fall(number: Number) -> Number:
    """Return the ratio of a number to that at the next finer level; by default for the finest two levels."""

    def take(p: Place) -> Floats:
        levels = p.levels
        level = levels[max(len(levels) - 2, 0)] if p.level is None else p.level
        if level not in levels[:-1]:
            return p.missing
        finer = levels[levels.index(int(level)) + 1]
        return safe_ratio(*(number(replace(p, level=lv)) for lv in (level, finer)))

    return take


@_needs_data
def _own_norm(p: Place, data: Record) -> Floats:
    """Return ``sqrt(dt sum (u_exact - u)^2 / T)`` over the stored points of a level (vibration text, section 2.2)."""
    exact = exact_series(p.block, data.whole("level"), p.quantity)
    error = exact - np.asarray(data[p.quantity], dtype=float)
    return np.asarray(np.sqrt(np.sum(error**2, axis=-1) / (error.shape[-1] - 1)))


@_needs_data
def _second_difference(p: Place, data: Record) -> Floats:
    """Return ``E = [D_tD_t u]/u''`` of the exact position by least squares (vibration text, exercise 7)."""
    position = p.block.model.position
    if f"{position}_exact" not in data or data.whole("every") != 1:
        return p.missing
    exact = np.asarray(data[f"{position}_exact"])
    inside = exact[..., 1:-1]
    forward, backward = exact[..., 2:] - inside, inside - exact[..., :-2]
    squares = np.sum(inside**2, axis=-1) * np.asarray(data["omega_dt"]) ** 2
    return safe_ratio(-np.sum((forward - backward) * inside, axis=-1), squares)


def _running_max(p: Place) -> Any:
    """Return the largest deviation so far; at the end this is the overall largest, which needs no series."""
    at_end = p.t is None and p.step is None
    return _max_abs(p) if at_end else _sample(replace(p, quantity=f"{p.quantity}_running_max"))


def _over_initial(number: Number) -> Number:
    """Return a number divided by the absolute initial energy."""

    def take(p: Place, data: Record) -> Floats:
        return safe_ratio(*np.broadcast_arrays(number(p), np.abs(energy_at_start(data))))

    return _needs_data(take)


def _error(norm: str) -> Number:
    def take(p: Place) -> Floats:
        q = p.comparison()
        if q is None:
            return p.missing
        in_norm = q.in_norm(norm)
        return in_norm.extrapolation if p.level == "best" else _along(p, in_norm.error)

    return take


def _along(p: Place, entries: Floats) -> Floats:
    """Return the entry of the selected level, by default the last one; entries begin at the coarsest level."""
    levels = p.levels[: entries.shape[-1]]
    level = levels[-1] if p.level is None and levels else p.level
    return entries[..., levels.index(level)] if level in levels else p.missing


def _of_triple(number: Callable[[Comparison], Floats]) -> Number:
    def take(p: Place) -> Floats:
        q = p.comparison()
        return (
            p.missing if q is None or len(p.levels) < LEVELS_OF_AN_ORDER else _along(p, number(q))
        )

    return take


def _estimate_defect(p: Place) -> Floats:
    """Return ``max |estimate - true error| / max |true error|``."""
    q, coarser = p.comparison(), p.levels[:-1]
    level = coarser[-1] if p.level is None and coarser else p.level
    if q is None or q.errors is None or level not in coarser:
        return p.missing
    index = coarser.index(level)
    estimate, error = estimates(q)[index], q.errors[index]
    return safe_ratio(largest(estimate - error), largest(error))


def _gathered(name: str) -> Number:
    return lambda p: p.gathered(name)


GATHERED = (
    *("period", "period_grid", "exact_period", "amplitude"),
    *("event_count", "first_event_time", "last_event_time", "rest_time"),
)
"""Numbers that the levels store under these names."""

NUMBERS: Mapping[str, Number] = {
    **{name: _gathered(name) for name in GATHERED},
    "event_time": _event_time,
    "end": _sample,
    "at": _sample,
    "min": _extreme("min", np.min),
    "max": _extreme("max", np.max),
    "max_abs": _max_abs,
    "max_abs_interior": lambda p: p.of_quantity("max_abs_interior"),
    "max_abs_ratio": _fall(_max_abs),
    "max_abs_interior_ratio": _fall(lambda p: p.of_quantity("max_abs_interior")),
    "period_error": lambda p: safe_ratio(p.gathered("period"), p.gathered("exact_period")) - 1.0,
    "running_max": _running_max,
    "relative_running_max": _over_initial(_running_max),
    "frequency": _at_level(oscillation.frequency),
    "predicted_frequency": _at_level(predicted_oscillation.frequency),
    "error_of_frequency": _at_level(oscillation.error_of_frequency),
    "phase_error_per_period": _at_level(oscillation.phase_error),
    "predicted_phase_error": _at_level(predicted_oscillation.phase_error),
    "phase_error_slope": _needs_data(lambda p, data: oscillation.phase_error_slope(data)),
    "amplitude_error": _needs_data(lambda p, data: oscillation.growth_factor(data) - 1.0),
    "steady_amplitude": _of_quantity(steady_state.amplitude),
    "steady_phase": _of_quantity(steady_state.phase),
    "steady_change": _of_quantity(steady_state.change),
    "section_period": _at_level(steady_state.section_period),
    "peak_frequency": _of_quantity(spectrum.peak_frequency),
    "growth_factor": _needs_data(lambda p, data: oscillation.growth_factor(data)),
    "growth_per_period": _at_level(oscillation.growth_per_period),
    "predicted_growth_per_period": _at_level(predicted_oscillation.growth_per_period),
    "stability_limit": lambda p: predicted_oscillation.limits(p.block),
    "exact_degree": lambda p: predicted_oscillation.exact_degrees(p.block),
    "relative_energy_error": _over_initial(_gathered("energy_deviation_max_abs")),
    "relative_energy_error_d2t": _over_initial(
        _needs_data(lambda p, data: oscillation.energy_error_d2t(p.block, data))
    ),
    "accepted_steps": _at_level(oscillation.steps_taken),
    "force_evaluations": _at_level(oscillation.force_evaluations),
    "error_rate": lambda p: on_arrays.log2(_fall(_own_norm)(p)),
    "second_difference_fraction": _second_difference,
    "discrete_error": _of_quantity(discrete_error),
    "error_l1": _error("l1"),
    "error_l2": _error("l2"),
    "error_linf": _error("linf"),
    "error_linf_interior": _error("linf_interior"),
    "error_estimate_defect": _estimate_defect,
    "observed_order": _of_triple(lambda q: q.observed_orders("l2")),
    "ratio": _of_triple(lambda q: q.ratios("l2")),
    "coincidence": _of_triple(lambda q: q.coincidence),
    "richardson_error": lambda p: q.bound_of_length if (q := p.comparison()) else p.missing,
}
"""The function that computes each number, by its name."""
