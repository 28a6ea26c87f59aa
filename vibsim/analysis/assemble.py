"""The convergence Record: every comparison between the levels of an experiment, on their coarsest common grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis import series
from vibsim.analysis.belonging import check_belonging
from vibsim.analysis.checks import measured_numbers
from vibsim.analysis.compare import SERIES, Ladder, Table, differences, extrapolated
from vibsim.analysis.evidence import evidence, formal_orders, relative_floors
from vibsim.analysis.floor import solution_size
from vibsim.analysis.grid import Grid, common_grid, take
from vibsim.analysis.sensitivity import sensitivity
from vibsim.analysis.verdict import judge
from vibsim.errors import VibsimError
from vibsim.models import MODELS
from vibsim.models.base import ENERGIES
from vibsim.record import Record, Variable, attributes
from vibsim.vocabulary import NORMS, REASON_NAMES, STATUSES, TOLERANCE, TYPICAL_NORM

if TYPE_CHECKING:
    import xarray

    from vibsim.spec import Experiment

Floats = NDArray[np.float64]


def analyse(
    experiment: Experiment, datasets: Mapping[int, xarray.Dataset] | Sequence[xarray.Dataset]
) -> xarray.Dataset:
    """Compare the levels of an experiment.

    Parameters
    ----------
    datasets
        What `simulate` returned for every level, by level or in any order.

    Returns
    -------
    xarray.Dataset
        The content of ``convergence.nc`` (design, section 4.4).

    Raises
    ------
    VibsimError
        Where there is no level, a level is given twice, the levels have no times in common, or they are not levels of
        one and the same problem, that of the experiment.
    """
    rows = datasets.values() if isinstance(datasets, Mapping) else datasets
    records = [Record.from_xarray(dataset) for dataset in rows]
    levels = [int(np.asarray(record.attrs["level"]).item()) for record in records]
    twice = sorted({level for level in levels if levels.count(level) > 1})
    if twice:
        raise VibsimError(f"level {twice[0]} is given more than once")
    return analyse_records(experiment, dict(zip(levels, records, strict=True))).to_xarray()


def analyse_records(experiment: Experiment, records: Mapping[int, Record]) -> Record:
    """Compare the levels of an experiment, given and returned as plain arrays; see `analyse`."""
    grid = common_grid(records)
    check_belonging(experiment, records)
    finest = records[grid.levels[-1]]
    magnified = sensitivity(experiment, grid, finest)
    coords = _coords(experiment, grid, finest)
    table: Table = {}
    names = compared(experiment)
    for name in names:
        ladder = _ladder(experiment, grid, records, name, magnified)
        table |= differences(grid, ladder) | extrapolated(experiment, grid, ladder)
    table |= _scaled_deviation(experiment, grid, records) | _scalars(grid, records)
    attrs: dict[str, Any] = {
        "title": experiment.title,
        "model": experiment.model.kind,
        "end_included": int(grid.end_included),
    }
    plain = Record(coords, table, attrs)
    for name in names:
        table |= _verdict(experiment, plain, name)
    numbers = measured_numbers(experiment, Record(coords, table, attrs), records)
    if len(numbers):
        words = "number that each check measured"
        table["check_value"] = Variable(
            ("check", "scheme", "case"), numbers, attributes(words, "1")
        )
    return Record(coords, table, attrs)


def compared(experiment: Experiment) -> tuple[str, ...]:
    """Name the quantities that are compared between levels: states, total energy, and what a check asks for."""
    states = (state.name for state in MODELS[experiment.model.kind].states)
    return tuple(dict.fromkeys([*states, "energy", "energy_deviation", *asked(experiment)]))


def asked(experiment: Experiment) -> tuple[str, ...]:
    """Name the quantities that the checks are about."""
    inner = [check.measured for check in experiment.checks]
    named = (check.converges if check.kind == "converges" else check.quantity for check in inner)
    return tuple(dict.fromkeys(name for name in named if name is not None))


def _coords(experiment: Experiment, grid: Grid, finest: Record) -> Table:
    levels = np.array(grid.levels, dtype=np.int64)
    kept = ("scheme",), ("case",)
    coords = {name: v for name, v in finest.coords.items() if v.dims in kept}
    coords["t"] = Variable(("t",), grid.t, finest.coords["t"].attrs)
    coords["level"] = Variable(("level",), levels, attributes("level", "1"))
    if len(levels) > 1:
        words = "coarser level of two successive ones"
        coords["pair"] = Variable(("pair",), levels[:-1], attributes(words, "1"))
    if len(levels) > 2:
        words = "coarsest level of three successive ones"
        coords["triple"] = Variable(("triple",), levels[:-2], attributes(words, "1"))
    coords["norm"] = Variable(("norm",), np.array(NORMS), attributes("norm over time", "1"))
    ids = [check.id for check in experiment.checks]
    if ids:
        coords["check"] = Variable(("check",), np.array(ids), attributes("name of the check", "1"))
    steps = np.array(grid.steps, dtype=np.int64)
    coords["steps"] = Variable(("level",), steps, attributes("number of time steps", "1"))
    dims = ("level", "case") if "end" in finest else ("level",)
    dt = grid.dt if "end" in finest else grid.dt[:, 0]
    coords["dt"] = Variable(dims, dt, attributes("time step", "s"))
    return coords


def _ladder(
    experiment: Experiment,
    grid: Grid,
    records: Mapping[int, Record],
    name: str,
    magnified: Floats,
) -> Ladder:
    values = [take(grid, records[level], name) for level in grid.levels]
    finest = records[grid.levels[-1]]
    sizes = _size(experiment, grid, records, name) * magnified
    attrs = finest.variables[name].attrs
    return Ladder(
        name=name,
        long_name=str(attrs.get("long_name", name)),
        units=str(attrs.get("units", "1")),
        values=values,
        exact=_exact(experiment, grid, finest, name),
        order=formal_orders(experiment, name),
        floor=relative_floors(experiment, grid.steps) * sizes[..., None],
    )


def _size(experiment: Experiment, grid: Grid, records: Mapping[int, Record], name: str) -> Floats:
    """Return the size that round-off is relative to, shape (scheme, case).

    What is left of an energy is known no better than the energy itself; a velocity is known no better than what the
    rounding of the position leaves of it over the run, or over a swing.
    """
    model = MODELS[experiment.model.kind]

    def largest(of: str) -> Floats:
        return solution_size([take(grid, records[level], of) for level in grid.levels])

    if name in ENERGIES:
        return largest("energy")
    if name != model.velocity:
        return largest(name)
    finest = records[grid.levels[-1]]
    duration = grid.dt[0] * grid.steps[0]
    rate = np.maximum(finest["natural_frequency"], 1.0 / duration)
    return np.asarray(np.maximum(largest(name), largest(model.position) * rate))


def _exact(experiment: Experiment, grid: Grid, finest: Record, name: str) -> Floats | None:
    if f"{name}_exact" in finest:
        return take(grid, finest, f"{name}_exact")[None]
    if not MODELS[experiment.model.kind].conservative:
        return None
    shape = finest[name].shape[:2]
    if name == "energy":
        start = np.asarray(finest[name][..., :1], dtype=np.float64)
        return np.broadcast_to(start, (*shape, len(grid.t)))
    return np.zeros((*shape, len(grid.t))) if name == "energy_deviation" else None


def _scaled_deviation(experiment: Experiment, grid: Grid, records: Mapping[int, Record]) -> Table:
    """Return dE_l (2^p)^k, which coincide where the energy converges to conservation (A, section 2.6)."""
    name = "energy_deviation"
    p = formal_orders(experiment, name)[:, None, None]
    scaled = [
        take(grid, records[level], name) * series.gap_ratio(p, level - grid.levels[0])
        for level in grid.levels
    ]
    attrs = records[grid.levels[-1]].variables[name].attrs
    long_name = f"{attrs.get('long_name', name)}, rescaled"
    dims = ("scheme", "case", "level", "t")
    units = str(attrs.get("units", "1"))
    return {f"{name}_scaled": Variable(dims, np.stack(scaled, 2), attributes(long_name, units))}


def _scalars(grid: Grid, records: Mapping[int, Record]) -> Table:
    """Gather what the levels hold once per member, and the last value of every series."""
    rows = [records[level] for level in grid.levels]
    table: Table = {}
    dims: tuple[str, ...]
    for name, variable in rows[-1].variables.items():
        values = [row[name] for row in rows]
        if variable.dims == ("scheme", "case"):
            dims = ("scheme", "case", "level")
            table[name] = Variable(dims, np.stack(values, -1), variable.attrs)
        elif variable.dims == ("case",):
            same = all(np.array_equal(value, values[-1], equal_nan=True) for value in values)
            dims = ("case",) if same else ("case", "level")
            stacked = values[-1] if same else np.stack(values, -1)
            table[name] = Variable(dims, stacked, variable.attrs)
        elif variable.dims == SERIES:
            attrs = dict(variable.attrs)
            attrs["long_name"] = f"{attrs.get('long_name', name)} at the last stored time"
            last = np.stack([value[..., -1] for value in values], -1)
            table[f"{name}_end"] = Variable(("scheme", "case", "level"), last, attrs)
    return table


def _flags(names: Sequence[str]) -> dict[str, Any]:
    return {"flag_values": np.arange(len(names), dtype=np.int8), "flag_meanings": " ".join(names)}


def _verdict(experiment: Experiment, record: Record, name: str) -> Table:
    """Judge a quantity by the formal order; the order in every norm, status and window in the typical norm."""
    order = formal_orders(experiment, name)
    by_norm = {
        kind: judge(evidence(experiment, record, name, kind, order, TOLERANCE)) for kind in NORMS
    }
    typical = by_norm[TYPICAL_NORM]
    member = ("scheme", "case")
    table: Table = {}
    words = {"order": "stated order", "order_low": "its lower end", "order_high": "its upper end"}
    for key, field in (("order", "order"), ("order_low", "low"), ("order_high", "high")):
        values = np.stack([getattr(by_norm[kind], field) for kind in NORMS], axis=-1)
        attrs = attributes(f"{name}: {words[key]}", "1")
        table[f"{name}_{key}"] = Variable((*member, "norm"), values, attrs)
    for key, levels in (("first", typical.first), ("last", typical.last)):
        words_ = f"{name}: {key} level that the order rests on, -1 for none"
        table[f"{name}_window_{key}"] = Variable(member, levels, attributes(words_, "1"))
    for key, codes, names in (
        ("status", typical.status, STATUSES),
        ("reason", typical.reason, REASON_NAMES),
    ):
        attrs = attributes(f"{name}: {key} of the verdict on its order", "1", **_flags(names))
        table[f"{name}_{key}"] = Variable(member, codes, attrs)
    return table
