"""The convergence Record: all comparisons between the levels of an experiment, on the coarsest common time grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.motion_variables import motion
from vibsim.apriori.force_discontinuities import corner_variables
from vibsim.checks.experiment_tolerance import bounds
from vibsim.checks.kinds import check_variables, definition
from vibsim.checks.order import phase_at_start
from vibsim.comparison import best_values
from vibsim.comparison.compare_quantities import comparisons
from vibsim.comparison.comparison_variables import Table, in_precision, numbers, over_time
from vibsim.comparison.order_verdict import judge_orders, judgement, order_in
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.comparison.work_precision import work_precision
from vibsim.convergence import differences
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record, Variable, flags
from vibsim.core.vocabulary import (
    CENTRED,
    HIGHEST,
    MEMBER,
    OF_LEVEL,
    REASON_NAMES,
    SECONDS_OF_NORM,
    SERIES,
    STATUSES,
    TYPICAL_NORM,
    is_error_part,
)
from vibsim.experiment.storage import RUNNING, checked_quantities, lean_series
from vibsim.models import centred
from vibsim.models.events import TREATMENTS
from vibsim.observe.common_grid import SAME_AT_EVERY_LEVEL
from vibsim.observe.member_block import MemberBlock, block_of
from vibsim.observe.missed_pulses import may_miss_pulses, missed_variables
from vibsim.observe.stiffness import applies as motion_decides
from vibsim.observe.stiffness import is_damped
from vibsim.simulation.scaled import in_scales

if TYPE_CHECKING:
    import xarray

    from vibsim.experiment import Experiment

ONCE = SAME_AT_EVERY_LEVEL | {"energy_initial"}
"""Variables taken from the finest level alone; the initial energy differs between levels only by rounding."""


def analyse(
    experiment: Experiment, datasets: Mapping[int, xarray.Dataset] | Sequence[xarray.Dataset]
) -> xarray.Dataset:
    """Compare the levels of an experiment.

    Parameters
    ----------
    datasets
        The results of `simulate` for every level, by level or in any order.

    Returns
    -------
    xarray.Dataset
        The content of ``convergence.nc``: every quantity compared between levels, norms, orders, and the measured
        values of each check. The ``long_name`` of each variable describes it.

    Raises
    ------
    VibsimError
        Where there is no level, a level is given twice, the levels have no common times, or the levels do not belong to
        the problem of the experiment.
    """
    rows = datasets.values() if isinstance(datasets, Mapping) else datasets
    records = [Record.from_xarray(dataset) for dataset in rows]
    levels = [record.whole("level") for record in records]
    twice = sorted({level for level in levels if levels.count(level) > 1})
    if twice:
        raise VibsimError(f"level {twice[0]} is given more than once")
    return analyse_records(experiment, dict(zip(levels, records, strict=True))).to_xarray()


def analyse_records(experiment: Experiment, records: Mapping[int, Record]) -> Record:
    """Compare the levels, by level, of all members or a range of them; see `analyse`.

    The results of a member do not depend on the other members.
    """
    block = block_of(experiment, records)
    # quantities from centred differences ``[D_2t u]``, stored where the scheme defines another velocity
    by_differences = () if block.lean else centred(block.model)
    stored = tuple(name for name in by_differences if name in block.finest)
    quantities = comparisons(block, compared(experiment, block.lean) + stored)
    measured = (check.measured for check in experiment.checks)
    checked = checked_quantities(experiment)
    # where a sweep is too large to store series, only quantities of checks are judged, and their error parts
    judged = [n for n in quantities if not block.lean or n in checked or is_error_part(n)]
    judge_orders(quantities, judged, [check for check in measured if check.kind == "converges"])
    table: Table = {}
    for q in quantities.values():
        is_shown = not is_error_part(q.name) or q.name in checked
        if is_shown:
            table |= numbers(q)
        if q.name in judged:
            table |= _verdict(q) | phase_at_start(q)
        if is_shown and not (block.lean or q.parts):
            table |= over_time(q)
    table |= _scalars(block) | check_variables(block, quantities) | motion(block, quantities)
    table |= corner_variables(block.model, block.corners)
    if may_miss_pulses(block.model):
        table |= missed_variables(block.missed)
    if is_damped(block.model):
        words = "largest rate at which damping takes a velocity away"
        table["decay_rate"] = Variable.of(MEMBER, block.decay, words, "1/s")
    table |= best_values.table(block, quantities)
    if experiment.tolerance is not None:
        table |= bounds(block)
    if not block.lean:
        table |= _scaled_deviation(quantities["energy_deviation"])
        table |= work_precision(block, quantities)
    attrs: dict[str, Any] = {
        "title": experiment.title,
        "model": experiment.model.kind,
        "end_included": int(block.grid.end_included),
        "storage": "lean" if block.lean else "series",
        "checks": definition(experiment),
    }
    return in_scales(Record(_coords(block), table, attrs), experiment)


def compared(experiment: Experiment, lean: bool = False) -> tuple[str, ...]:
    """Return the names of the quantities compared between levels: states, energy, and those of the checks."""
    states = (state.name for state in experiment.model.definition.states)
    series = lean_series(experiment) if lean else (*states, "energy", "energy_deviation")
    return tuple(dict.fromkeys([*series, *checked_quantities(experiment)]))


def _coords(block: MemberBlock) -> Table:
    grid, finest = block.grid, block.finest
    shared = ("scheme",), ("case",)
    coords = {n: _widened(block, v) for n, v in finest.coords.items() if v.dims in shared}
    coords["t"] = Variable(("t",), grid.t, finest.coords["t"].attrs)
    levels = np.array(grid.levels, dtype=np.int64)

    def add(name: str, values: Any, words: str, dim: str = "") -> None:
        coords[name] = Variable.of((dim or name,), np.array(values), words)

    add("level", levels, "level")
    if len(levels) > 1:
        add("pair", levels[:-1], "coarser level of two successive ones")
    if len(levels) > 2:
        add("triple", levels[:-2], "coarsest level of three successive ones")
    add("norm", block.norms, "norm over time")
    powers = [SECONDS_OF_NORM[norm] for norm in block.norms]
    add("norm_seconds", powers, "power of s beside the unit of an error or a difference", "norm")
    if block.experiment.checks:
        add("check", [check.id for check in block.experiment.checks], "name of the check")
    coords |= best_values.coordinate(block)
    add("steps", np.array(grid.steps, dtype=np.int64), "number of time steps", "level")
    end_varies = "end" in finest
    dt = grid.dt if end_varies else grid.dt[:, 0]
    dims = ("level", "case") if end_varies else ("level",)
    coords["dt"] = Variable.of(dims, dt, "time step", "s")
    return coords


def _widened(block: MemberBlock, variable: Variable) -> Variable:
    """Give swept strings the same width in every part of a sweep."""
    if variable.values.dtype.kind != "U" or "sweep_key" not in variable.attrs:
        return variable
    schemes = (scheme.method for scheme in block.experiment.schemes)
    words = [choice for scheme in schemes for option in scheme.words for choice in option.choices]
    width = max(map(len, (*words, *TREATMENTS)))
    return Variable(variable.dims, variable.values.astype(f"U{width}"), variable.attrs)


def _scaled_deviation(q: Comparison) -> Table:
    """Return dE_l (2^p)^k; the levels coincide where the energy error converges to zero (A, section 2.6)."""
    levels, p = q.block.grid.levels, q.power[..., None]
    # an infinite energy error stays infinite
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = [
            u * differences.gap_ratio(p, level - levels[0])
            for u, level in zip(q.values, levels, strict=True)
        ]
    dims = ("scheme", "case", "level", "t")
    words = f"{q.long_name}, rescaled"
    return {f"{q.name}_scaled": Variable.of(dims, np.stack(scaled, 2), words, q.units)}


def _scalars(block: MemberBlock) -> Table:
    """Return the scalars of every member at each level, and the last value of every series."""
    rows = [block.records[level] for level in block.grid.levels]
    largest = {f"{state.name}_max" for state in block.model.states}
    table: Table = {}
    for name, variable in rows[-1].variables.items():
        attrs, dims = dict(variable.attrs), variable.dims
        if dims == SERIES:
            # no centred difference exists at the end; a running maximum there is the overall maximum
            if not name.endswith((CENTRED, RUNNING)):
                attrs["long_name"] = f"{attrs.get('long_name', name)} at the last stored time"
                last = np.stack([row[name][..., -1] for row in rows], -1)
                table[f"{name}_end"] = Variable(OF_LEVEL, last, attrs)
        elif dims not in (MEMBER, ("case",)):
            continue
        elif name in ONCE:
            table[name] = variable
        elif not block.lean or name in _LEAN | largest:
            stacked = np.stack([row[name] for row in rows], -1)
            table[name] = Variable((*dims, "level"), stacked, attrs)
    if motion_decides(block.model):
        words = "angular frequency that a step has to resolve along the motion times the time step"
        table[HIGHEST] = Variable.of(("case", "level"), block.fastest, words)
    return table


_LEAN = {
    *("status", "failure_time", "omega_dt", HIGHEST),
    *("period", "amplitude", "energy_deviation_max_abs"),
}
"""Scalars of every member that are kept even where storage is bounded."""


def _verdict(q: Comparison) -> Table:
    """Return the verdict on the order of a quantity in the typical norm, and its stated order in every norm."""
    typical = judgement(q, TYPICAL_NORM)
    table: Table = {}

    def add(key: str, values: NDArray[Any], words: str, **more: Any) -> None:
        dims = ("scheme", "case", "norm")[: values.ndim]
        table[f"{q.name}_{key}"] = Variable.of(dims, values, f"{q.name}: {words}", **more)

    orders = np.stack([order_in(q, norm) for norm in q.block.norms], axis=-1)
    add("order", in_precision(q, orders), "stated order")
    for end, text in {"low": "lower", "high": "upper"}.items():
        judged = (q.judged.get((norm, "scheme")) for norm in q.block.norms)
        values = [
            np.full(orders.shape[:-1], np.nan) if j is None else getattr(j, end) for j in judged
        ]
        words = f"{text} end of the interval of the order, in the norms that are judged"
        add(f"order_{end}", in_precision(q, np.stack(values, axis=-1)), words)
    for key, levels in (("first", typical.first), ("last", typical.last)):
        text = f"{key} level that the order rests on, -1 for none"
        add(f"window_{key}", levels.astype(np.int16), text)
    add("status", typical.status, "status of the verdict on its order", **flags(STATUSES))
    add("reason", typical.reason, "reason of the verdict on its order", **flags(REASON_NAMES))
    return table
