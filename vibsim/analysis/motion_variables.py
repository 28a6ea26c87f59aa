"""What is kept of the motion beside the comparison of levels: theory beside measurement, extrema, energy, cost.

Kept where series are, that is up to 2^18 samples on the coarsest level. A larger sweep keeps none of it: its checks are
worked out all the same, while the levels are at hand. Theory is left out, too, where more than `THEORY_RUNS` runs
differ in w dt.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import flags
from vibsim.comparison import best_values, value_numbers
from vibsim.comparison.comparison_variables import Table
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.core.record import Variable, attributes
from vibsim.core.vocabulary import DRIFTS
from vibsim.experiment.schema.published import row_at, row_id
from vibsim.experiment.value_names import VALUES
from vibsim.observe import oscillation, predicted_oscillation
from vibsim.observe.common_grid import take
from vibsim.observe.energy_drift import drift_at
from vibsim.observe.member_block import MemberBlock, by_level

Floats = NDArray[np.float64]

THEORY_RUNS = 2**12
"""Runs for which theory is worked out, at about 0.1 ms each."""

OF_LEVEL = ("scheme", "case", "level")

PEAKS = "interpolated peaks"
RECURRENCE = f"recurrence of the steps; {PEAKS} where a run satisfies none to rounding"
"""How growth and frequency were measured (`vibsim.observe.oscillation`): attribute ``method``."""


def motion(block: MemberBlock, compared: Mapping[str, Comparison]) -> Table:
    """Return the variables of the convergence Record that belong to the motion of every scheme, member and level."""
    if block.lean:
        return {}
    table = _theory(block) | _drift(block) | _extrema(block) | _running(block)
    table |= _beside(block, compared)
    words = "largest stable w dt: infinite for none, 0 where every step grows"
    limit = Variable(
        ("scheme", "case"), predicted_oscillation.limits(block), attributes(words, "1")
    )
    words = "evaluations of the acceleration; of an implicit scheme those of one iteration per step"
    counts = _by_level(block, lambda level: oscillation.force_evaluations(block, level))
    total = Variable(OF_LEVEL, counts, attributes(words, "1"))
    words = "largest position over the largest exact one, or over that of the coarsest level"
    size = Variable(OF_LEVEL, block.growth, attributes(words, "1"))
    return table | {
        "stability_limit": limit,
        "size_over_exact": size,
        "force_evaluations_total": total,
    }


def _by_level(block: MemberBlock, of: Callable[[int], Floats]) -> Floats:
    return by_level([np.broadcast_to(of(level), block.shape) for level in block.grid.levels])


def _theory(block: MemberBlock) -> Table:
    """Return growth, frequency and phase error, predicted and measured."""
    measured: dict[str, Callable[[int], Floats]] = {
        "growth": lambda level: oscillation.growth_of_motion(block, level),
        "frequency": lambda level: oscillation.frequency(block, level),
        "phase_error": lambda level: oscillation.phase_error(block, level),
    }
    known: dict[str, Callable[[int], Floats]] = {
        "growth": lambda level: predicted_oscillation.growth_per_period(block, level),
        "frequency": lambda level: predicted_oscillation.frequency(block, level),
        "phase_error": lambda level: predicted_oscillation.phase_error(block, level),
    }
    if _different(block) > THEORY_RUNS:
        missing = np.full(block.shape, np.nan)
        known = dict.fromkeys(known, lambda level: missing)
    words = {
        "growth": ("growth factor of the amplitude per period", "1"),
        "frequency": ("angular frequency", "rad s-1"),
        "phase_error": ("time by which peaks come early, per period", "s"),
    }
    table: Table = {}
    for prefix, functions, adjective in (
        ("theory", known, "predicted"),
        ("measured", measured, "measured"),
    ):
        for name, of in functions.items():
            text, units = words[name]
            attrs = attributes(f"{adjective} {text}", units)
            if functions is measured:
                attrs["method"] = _method(block)
            table[f"{prefix}_{name}"] = Variable(OF_LEVEL, _by_level(block, of), attrs)
    return table


def _method(block: MemberBlock) -> str:
    """Say how growth and frequency were measured."""
    seen = all(oscillation.has_recurrence(block, level) for level in block.grid.levels)
    return RECURRENCE if seen else PEAKS


def _different(block: MemberBlock) -> int:
    """Return how many runs of the whole experiment may differ in w dt or in options: it depends on no part of it."""
    experiment = block.experiment
    keys = experiment.sweep.keys if experiment.sweep else ()
    alike = all(key.startswith("initial.") for key in keys)
    runs = len(experiment.schemes) * len(block.grid.levels)
    return runs if alike else runs * experiment.members


def _drift(block: MemberBlock) -> Table:
    """Return how the energy error by the scheme's own velocity grows with time."""
    found = [drift_at(block, level) for level in block.grid.levels]
    words = "how the energy error grows with time"
    kinds = np.stack([drift.kind for drift in found], axis=-1)
    rate_words = (
        "relative energy error per period of a linear drift, per period squared of a quadratic one, change of "
        "its logarithm per period of an exponential one"
    )
    rates = by_level([drift.rate for drift in found])
    return {
        "energy_drift_kind": Variable(OF_LEVEL, kinds, attributes(words, "1", **flags(DRIFTS))),
        "energy_drift_rate": Variable(OF_LEVEL, rates, attributes(rate_words, "1")),
    }


_KINDS = ("peak", "trough")


def _extrema(block: MemberBlock) -> Table:
    """Return the peaks and troughs of every level side by side, NaN behind those of coarse levels."""
    names = [f"{kind}{of}" for kind in _KINDS for of in ("_time", "", "_time_grid", "_grid")]
    table: Table = {}
    for name in names:
        rows = [block.records[level] for level in block.grid.levels]
        if any(name not in row for row in rows):
            continue
        longest = max(row[name].shape[-1] for row in rows)
        found = np.full((*block.shape, len(rows), longest), np.nan)
        for i, row in enumerate(rows):
            found[:, :, i, : row[name].shape[-1]] = row[name]
        table[name] = Variable((*OF_LEVEL, "extremum"), found, rows[-1].variable(name).attrs)
    return table


def _running(block: MemberBlock) -> Table:
    """Return the largest energy deviation so far, at the common times."""
    table: Table = {}
    for deviation in ("energy_deviation", "energy_deviation_d2t"):
        name = f"{deviation}_running_max"
        rows = [block.records[level] for level in block.grid.levels]
        if any(name not in row for row in rows):
            continue
        found = np.ascontiguousarray(np.stack([take(block.grid, row, name) for row in rows], 2))
        table[name] = Variable((*OF_LEVEL, "t"), found, rows[-1].variable(name).attrs)
    return table


def _beside(block: MemberBlock, compared: Mapping[str, Comparison]) -> Table:
    """Return what published tables have beside their rows, shape (check, case, beside); NaN elsewhere."""
    experiment = block.experiment
    width = max((len(table.beside) for table in experiment.published), default=0)
    if not width:
        return {}
    ids = [check.id for check in experiment.checks]
    names = [scheme.name for scheme in experiment.schemes]
    found = np.full((len(ids), block.shape[1], width), np.nan)
    for i, table in enumerate(experiment.published, 1):
        for j, row in enumerate(table.rows, 1):
            at = row_at(row)
            place = value_numbers.Place(
                block, compared, table.quantity or "", at.level, at.t, at.step
            )
            index = ids.index(row_id(i, j))
            for k, name in enumerate(table.beside):
                beside, _ = best_values.value(name, _fitting(place, name))
                found[index, :, k] = beside[names.index(row.scheme)]
    attrs = attributes("numbers beside each row of a published table", "1")
    return {"published_beside": Variable(("check", "case", "beside"), found, attrs)}


def _fitting(place: value_numbers.Place, name: str) -> value_numbers.Place:
    """Return the place with the quantity left out where a value is of none."""
    return place if VALUES[name].of != "none" else replace(place, quantity="")
