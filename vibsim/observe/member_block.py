"""The level data of a block of members on their common grid, with the data that all their quantities share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vibsim.apriori.exact_values import known_values
from vibsim.apriori.force_discontinuities import Corners, corners_of
from vibsim.apriori.formal_orders import left_to_the_mesh
from vibsim.apriori.roundoff_floor import (
    SPACING_AT_ONE,
    relative_floors,
    solution_size,
    stored_floor,
)
from vibsim.apriori.stability_limits import stability_limits
from vibsim.convergence.differences import laid_out, largest
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import CENTRED, HIGHEST, NORMS, TYPICAL_NORM, plain_name
from vibsim.experiment import Experiment
from vibsim.experiment.sweep_columns import Columns, by_options, recorded_columns
from vibsim.models import BUDGET, ENERGIES, Model
from vibsim.observe import event_at_end
from vibsim.observe.common_grid import Grid, check_belonging, common_grid, take
from vibsim.observe.missed_pulses import Missed, missed_pulses
from vibsim.observe.sensitivity import sensitivity
from vibsim.observe.stiffness import Motion, decay_rate, stiffest
from vibsim.observe.thresholds import FEW_RADIANS
from vibsim.simulation.members import Members, members


@dataclass(frozen=True)
class MemberBlock:
    """A block of members of an experiment; s, c and l stand for schemes, cases and levels."""

    experiment: Experiment
    records: Mapping[int, Record]  # level Records
    grid: Grid
    lean: bool  # whether no series are kept
    norms: tuple[str, ...]  # the norms that are kept
    columns: Columns
    exact: Mapping[str, Floats]  # states on the common grid, shape (c, t); empty if not known
    magnified: Floats  # factor by which disturbances grow, shape (c,)
    relative_floor: Floats  # predicted round-off relative to the solution, shape (s, 1 or c, l)
    stored_floor: Floats  # round-off of storage, relative to the solution, shape (l,): 0 for double
    omega_dt: Floats  # w dt, shape (c, l)
    fastest: Floats  # the same for the highest frequency, which steps must resolve
    decay: Floats  # the largest rate at which damping reduces a velocity, shape (s, c)
    failed: Flags  # whether a run failed, shape (s, c, l)
    group: Members  # the values of the members
    stability_limit: Floats  # largest stable w dt, infinite for none, shape (s, 1 or c)
    adaptive: Flags  # whether a scheme chooses its own steps and so has no levels, shape (s,)
    left_to_the_mesh: Floats  # order of errors that the mesh limits, else NaN, shape (s, c)
    corners: Corners  # the first corner of the force within a step
    missed: Missed  # pulses of the force between the points of every level
    growth: Floats  # largest position over the largest exact one, shape (s, c, l); NaN if not known
    eventless: Flags  # whether a model with events met none on the finest level, shape (s, c)
    event_at_end: Flags  # whether an event may be on either side of the end, shape (s, c)

    @property
    def model(self) -> Model:
        """The model."""
        return self.experiment.model.definition

    @property
    def finest(self) -> Record:
        """The Record of the finest level."""
        return self.records[self.grid.levels[-1]]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of schemes and of members."""
        schemes, cases, _ = self.failed.shape
        return schemes, cases

    @property
    def phase(self) -> Floats:
        """Duration of the run in radians, ``w T``, shape (c,).

        Without small oscillations it is that of the exact period; for a smooth motion without a period 1, else NaN.
        """
        w, period = (
            stored_or_nan(self.finest, name, self.shape[1:])
            for name in ("natural_frequency", "exact_period")
        )
        least = np.nan if self.model.events_act else 1.0
        own = np.fmax(2.0 * np.pi / period * self.group.end, least)
        return np.where(np.isnan(w), own, w * self.group.end)

    @property
    def radians(self) -> Floats:
        """``w dt``, with w as in `phase`, shape (c, l)."""
        own = self.phase[:, None] / np.array(self.grid.steps)
        return np.where(np.isnan(self.omega_dt), own, self.omega_dt)

    def series(self, name: str) -> list[Floats]:
        """Return a quantity at every level, coarse to fine, each of shape (s, c, t); NaN if it is not stored.

        ``[D_2t u]`` does not exist at the first and the last step. There both the quantity and its exact values are set
        to 0, so that differences and errors vanish and norms are those of the other points.
        """
        if any(name not in self.records[level] for level in self.grid.levels):
            return [np.full((*self.shape, len(self.grid.t)), np.nan) for _ in self.grid.levels]
        series = [take(self.grid, self.records[level], name) for level in self.grid.levels]
        if not name.endswith(CENTRED):
            return series
        series = [values.copy(order="K") for values in series]
        for values in series:
            exists = np.any(np.isfinite(values), axis=-1)
            for place in self.ends():
                values[..., place] = np.where(exists, 0.0, np.nan)
        return series

    def has_own_end(self) -> Flags:
        """Tell whether the velocity at the last point is computed like all others, shape (scheme, case)."""
        own = by_options(
            self.experiment, self.columns, lambda scheme, o: scheme.has_own_end(self.model, o)
        )
        return np.broadcast_to(own != 0.0, self.shape)

    def ends(self) -> list[int]:
        """Return the indices of the first and the last step on the common grid, if they are on it."""
        return [0, -1] if self.grid.end_included else [0]

    def exact_of(self, name: str) -> Floats | None:
        """Return a quantity's exact values, which broadcast against (s, c, t); None if they are not known."""
        plain = plain_name(name)
        if plain in self.exact:
            exact = self.exact[plain][None]
        elif self.model.conservative and plain == "energy":
            exact = energy_at_start(self.finest)[..., None]
        else:
            t = self.grid.times(self.group.end)
            known = known_values(self.model, plain, self.exact, t, self.group)
            if known is None:
                return None
            exact = known[None]
        if plain == name:
            return exact
        # 0 at the ends, like the series: see `series`
        inside = np.ones(len(self.grid.t))
        inside[self.ends()] = 0.0
        # infinite values give NaN at the ends
        with np.errstate(invalid="ignore"):
            return np.asarray(exact * inside)

    def size(self, name: str, values: list[Floats], sizes: Mapping[str, Floats]) -> Floats:
        """Return the size to which round-off of a quantity is relative, shape (s, c), given sizes of other quantities.

        The round-off of a part of the energy is relative to the whole energy. That of a velocity includes the rounding
        of the position, divided by the duration of the run or of an oscillation.
        """
        plain = plain_name(name)
        if plain in ENERGIES:
            return sizes["energy"]
        size = solution_size(values)
        if plain in BUDGET:
            return np.asarray(np.maximum(size, sizes["energy"]))
        if plain in self.model.positions:
            return np.asarray(np.maximum(size, sizes.get(plain, size)))
        if plain not in self.model.velocities:
            return size
        duration = self.grid.dt[0] * self.grid.steps[0]
        # a motion without small oscillations has no frequency
        rate = np.fmax(self.finest["natural_frequency"], 1.0 / duration)
        position = self.model.positions[self.model.velocities.index(plain)]
        return np.asarray(np.maximum(size, sizes[position] * rate))

    def safety(self, irregular: float) -> Floats:
        """Return the factor on bounds from levels, shape (c,): `irregular` if events or tables divide steps."""
        has_places = self.corners.of_tables | self.model.events_act
        return np.where(has_places, irregular, 1.0)

    def unseen_at_corner(self, size: Floats) -> Floats:
        """Return a bound of the error of a quantity of given size due to a corner of the force, shape (s, c)."""
        part = self.corners.unseen(self.group.end, self.grid.steps, self.omega_dt[:, -1])
        return np.multiply(part, size, out=np.zeros(self.shape), where=part > 0.0)

    def floor_of(self, name: str, size: Floats) -> Floats:
        """Return the predicted round-off of a quantity of given size, shape (s, c, l), at least that of its storage.

        The motion magnifies the former only. ``[D_2t u]`` divides the last digit of the position by dt: eps/(w dt)
        relative to the velocity.
        """
        relative = self.relative_floor
        if name.endswith(CENTRED):
            with np.errstate(divide="ignore"):
                relative = relative + SPACING_AT_ONE / self.radians
        # for members that grow without bound the floor overflows
        with np.errstate(over="ignore", invalid="ignore"):
            computed = relative * (size * self.magnified)[..., None]
            return np.asarray(np.maximum(computed, self.stored_floor * size[..., None]))


def block_of(experiment: Experiment, records: Mapping[int, Record]) -> MemberBlock:
    """Return the block of the members in level Records.

    Raises VibsimError if there is no level, or the levels have no times in common or do not belong together.
    """
    grid = common_grid(records)
    check_belonging(experiment, records)
    rows = [records[level] for level in grid.levels]
    model, finest = experiment.model.definition, rows[-1]
    failed = by_level([row["status"] for row in rows]) != 0
    eventless = stored_or_nan(finest, "event_count", failed.shape[:2]) == 0.0
    lean = any(record.attrs.get("storage") == "lean" for record in rows)
    columns, states = recorded_columns(finest), [state.name for state in model.states]
    case = np.asarray(finest["case"], dtype=np.int64)
    group = members(experiment, int(case[0]), int(case[-1]) + 1)
    t = grid.times(group.end)
    if not lean:
        exact = {n: take(grid, finest, f"{n}_exact") for n in states if f"{n}_exact" in finest}
    elif model.exact is None:
        exact = {}
    else:
        exact = {name: laid_out(values) for name, values in group.exact(model, t).items()}
    motion = Motion(model, grid, finest, group, exact)
    corners = corners_of(model, finest, group, grid.dt[0])
    left = left_to_the_mesh(experiment, columns, corners.of_tables)
    relative_floor = relative_floors(experiment, grid.steps, columns)
    return MemberBlock(
        experiment=experiment,
        records=records,
        grid=grid,
        lean=lean,
        norms=_norms(experiment) if lean else NORMS,
        columns=columns,
        exact=exact,
        magnified=sensitivity(experiment, t, group, exact if lean else None),
        relative_floor=relative_floor,
        stored_floor=stored_floor(records, grid.levels, states),
        omega_dt=by_level([row["omega_dt"] for row in rows]),
        fastest=_fastest(motion, rows),
        decay=decay_rate(motion),
        group=group,
        failed=failed,
        stability_limit=stability_limits(experiment, columns),
        adaptive=np.array([scheme.adaptive for scheme in experiment.schemes]),
        left_to_the_mesh=np.where(eventless, np.nan, left),
        corners=corners,
        missed=missed_pulses(model, finest, group),
        growth=_growth(model, rows, grid, exact),
        eventless=eventless,
        event_at_end=event_at_end.is_at_end(model, records, grid, group, relative_floor[..., -1]),
    )


def by_level(values: list[Floats]) -> Floats:
    """Return arrays stacked along a new last dimension, which is the outermost one in memory."""
    return np.moveaxis(np.stack([np.asarray(row, dtype=np.float64) for row in values]), 0, -1)


def stored_or_nan(record: Record, name: str, shape: tuple[int, ...]) -> Floats:
    """Return a variable of a level, broadcast to a shape; NaN if the level does not have it."""
    values = np.asarray(record[name], dtype=np.float64) if name in record else np.float64(np.nan)
    return np.broadcast_to(values, shape)


def fastest(record: Record) -> Floats:
    """Return the highest angular frequency of small oscillations times the step."""
    return np.asarray(record[HIGHEST if HIGHEST in record else "omega_dt"], dtype=np.float64)


def energy_at_start(record: Record) -> Floats:
    """Return the energy at t = 0, shape (scheme, case)."""
    return np.asarray(record["energy_initial"], dtype=np.float64)


def _fastest(motion: Motion, rows: list[Record]) -> Floats:
    """Return the angular frequency that steps must resolve times the step of every level, shape (case, level)."""
    stored, w, end = by_level([fastest(row) for row in rows]), stiffest(motion), motion.group.end
    natural = np.asarray(motion.finest["natural_frequency"], dtype=float)
    steps = np.array(motion.grid.steps, dtype=np.float64)
    return np.where((w == natural)[:, None], stored, (w * end)[:, None] / steps)


def _norms(experiment: Experiment) -> tuple[str, ...]:
    """Return the norms that a lean analysis keeps: the typical one, and those that checks use."""
    named: set[str] = {TYPICAL_NORM}
    for check in experiment.checks:
        inner = check.measured
        if inner.kind == "converges":
            named.add(inner.norm)
        elif inner.kind == "value":
            named.add(inner.value.removeprefix("error_"))
    return tuple(norm for norm in NORMS if norm in named)


def _growth(model: Model, rows: list[Record], grid: Grid, exact: Mapping[str, Floats]) -> Floats:
    """Return the largest position of every level over the largest exact one; NaN without an exact solution.

    Levels alone do not distinguish instability from growth of the exact motion, as before an escape. If there are few
    common times per period, the exact motion may pass through 0 at all of them, so the amplitude of its velocity counts
    as well.
    """
    position = model.position
    ends = [by_level([row[f"{position}_{end}"] for row in rows]) for end in ("min", "max")]
    computed = np.maximum(*(np.abs(end) for end in ends))
    if position not in exact:
        return np.full(computed.shape, np.nan)
    w = np.asarray(rows[-1]["natural_frequency"], dtype=np.float64)
    with np.errstate(all="ignore"):
        by_speed = np.where(w * grid.dt[0] > FEW_RADIANS, largest(exact[model.velocity]) / w, 0.0)
    reference = np.fmax(largest(exact[position]), by_speed)[:, None]
    usable = np.isfinite(computed) & (reference > 0)
    return np.where(usable, computed, np.nan) / np.where(usable, reference, 1.0)
