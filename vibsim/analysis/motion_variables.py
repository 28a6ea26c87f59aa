"""Variables of the motion besides the comparison of levels: predicted and measured oscillation, extrema, energy, cost.

They are stored only where series are, that is up to 2^18 samples on the coarsest level. The checks of a larger sweep
are evaluated all the same, from the levels. Predictions are left out where more than `THEORY_RUNS` runs differ in w dt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vibsim.comparison import best_values, value_numbers
from vibsim.comparison.comparison_variables import Table
from vibsim.comparison.quantity_comparison import Compared
from vibsim.core.array_types import Floats
from vibsim.core.record import Variable, flags
from vibsim.core.vocabulary import DRIFTS, MEMBER, OF_LEVEL, PEAKS
from vibsim.experiment.schema.published import row_at, row_id
from vibsim.experiment.value_names import VALUES
from vibsim.observe import oscillation, predicted_oscillation
from vibsim.observe.common_grid import take
from vibsim.observe.energy_drift import drift_at
from vibsim.observe.member_block import MemberBlock, by_level

THEORY_RUNS = 2**12
"""Most runs for which predictions are computed, at about 0.1 ms each."""

RECURRENCE = f"recurrence of the steps; {PEAKS} where a run satisfies none to rounding"
"""How growth and frequency were measured (`vibsim.observe.oscillation`): attribute ``method``."""
GROWTH = "growth factor of the amplitude per period"
EARLY = "time by which peaks come early, per period"


def motion(block: MemberBlock, compared: Compared) -> Table:
    """Return the variables of the convergence Record on the motion of every scheme, member and level."""
    if block.lean:
        return {}
    table = _theory(block) | _drift(block) | _side_by_side(block) | _running(block)
    table |= _beside(block, compared)
    words = "largest stable w dt: infinite for none, 0 where every step grows"
    limits = predicted_oscillation.limits(block)
    table["stability_limit"] = Variable.of(MEMBER, limits, words)
    words = "largest position over the largest exact one, or over that of the coarsest level"
    table["size_over_exact"] = Variable.of(OF_LEVEL, block.growth, words)
    words = "evaluations of the acceleration; of an implicit scheme those of one iteration per step"
    counts = _by_level(block, oscillation.force_evaluations)
    table["force_evaluations_total"] = Variable.of(OF_LEVEL, counts, words)
    return table


def _by_level(block: MemberBlock, measure: Callable[[MemberBlock, int], Floats]) -> Floats:
    rows = [np.broadcast_to(measure(block, level), block.shape) for level in block.grid.levels]
    return by_level(rows)


def _theory(block: MemberBlock) -> Table:
    """Return predicted and measured growth, frequency and phase error."""
    theory, observed = predicted_oscillation, oscillation
    rows: tuple[tuple[str, str, str, Callable[..., Floats], Callable[..., Floats]], ...] = (
        ("growth", GROWTH, "1", theory.growth_per_period, observed.growth_of_motion),
        ("frequency", "angular frequency", "rad s-1", theory.frequency, observed.frequency),
        ("phase_error", EARLY, "s", theory.phase_error, observed.phase_error),
    )
    by_recurrence = all(observed.has_recurrence(block, level) for level in block.grid.levels)
    method = RECURRENCE if by_recurrence else PEAKS
    predicted: Table = {}
    measured: Table = {}
    for name, text, unit, predict, measure in rows:
        values = np.full((*block.shape, len(block.grid.levels)), np.nan)
        if _distinct_runs(block) <= THEORY_RUNS:
            values = _by_level(block, predict)
        predicted[f"theory_{name}"] = Variable.of(OF_LEVEL, values, f"predicted {text}", unit)
        values, words = _by_level(block, measure), f"measured {text}"
        measured[f"measured_{name}"] = Variable.of(OF_LEVEL, values, words, unit, method=method)
    return predicted | measured


def _distinct_runs(block: MemberBlock) -> int:
    """Return how many runs of the whole experiment, not of this part, may differ in w dt or in options."""
    experiment = block.experiment
    keys = experiment.sweep.keys if experiment.sweep else ()
    runs = len(experiment.schemes) * len(block.grid.levels)
    is_initial = all(key.startswith("initial.") for key in keys)
    return runs if is_initial else runs * experiment.members


def _drift(block: MemberBlock) -> Table:
    """Return how the energy error, computed with the scheme's own velocity, grows with time."""
    drifts = [drift_at(block, level) for level in block.grid.levels]
    kinds = np.stack([drift.kind for drift in drifts], axis=-1)
    rates = by_level([drift.rate for drift in drifts])
    kind_words = "how the energy error grows with time"
    rate_words = (
        "relative energy error per period of a linear drift, per period squared of a quadratic one, change of its "
        "logarithm per period of an exponential one"
    )
    return {
        "energy_drift_kind": Variable.of(OF_LEVEL, kinds, kind_words, **flags(DRIFTS)),
        "energy_drift_rate": Variable.of(OF_LEVEL, rates, rate_words),
    }


def _side_by_side(block: MemberBlock) -> Table:
    """Return peaks, troughs and event times of all levels; where a level has fewer, the rest is NaN."""
    rows = [block.records[level] for level in block.grid.levels]
    suffixes = ("_time", "", "_time_grid", "_grid")
    names = {f"{kind}{suffix}": "extremum" for kind in ("peak", "trough") for suffix in suffixes}
    table: Table = {}
    for name, dim in (names | {"event_time": "event"}).items():
        if all(name in row for row in rows):
            longest = max(row[name].shape[-1] for row in rows)
            values = np.full((*block.shape, len(rows), longest), np.nan)
            for i, row in enumerate(rows):
                values[:, :, i, : row[name].shape[-1]] = row[name]
            attrs = rows[-1].variable(name).attrs
            table[name] = Variable((*OF_LEVEL, dim), values, attrs)
    return table


def _running(block: MemberBlock) -> Table:
    """Return the largest energy deviation so far, at the common times."""
    rows = [block.records[level] for level in block.grid.levels]
    table: Table = {}
    for name in ("energy_deviation_running_max", "energy_deviation_d2t_running_max"):
        if all(name in row for row in rows):
            maxima = np.stack([take(block.grid, row, name) for row in rows], 2)
            attrs = rows[-1].variable(name).attrs
            table[name] = Variable((*OF_LEVEL, "t"), np.ascontiguousarray(maxima), attrs)
    return table


def _beside(block: MemberBlock, compared: Compared) -> Table:
    """Return the additional columns of published tables, shape (check, case, beside); NaN elsewhere."""
    experiment = block.experiment
    width = max((len(table.beside) for table in experiment.published), default=0)
    if not width:
        return {}
    ids = [check.id for check in experiment.checks]
    names = [scheme.name for scheme in experiment.schemes]
    columns = np.full((len(ids), block.shape[1], width), np.nan)
    for i, table in enumerate(experiment.published, 1):
        for j, row in enumerate(table.rows, 1):
            at, about = row_at(row), table.quantity or ""
            base = value_numbers.Place(block, compared, about, at.level, at.t, at.step, at.event)
            for k, name in enumerate(table.beside):
                has_quantity = VALUES[name].of != "none"
                place = base if has_quantity else replace(base, quantity="")
                values, _, _ = best_values.value(name, place)
                columns[ids.index(row_id(i, j)), :, k] = values[names.index(row.scheme)]
    words = "numbers beside each row of a published table"
    return {"published_beside": Variable.of(("check", "case", "beside"), columns, words)}
