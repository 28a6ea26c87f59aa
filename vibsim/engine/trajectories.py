"""Step all members of one scheme: choose the lane, run the kernel."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.engine import block_loop, events, extrema, gather, results
from vibsim.engine.kernel import carried, kernel, observer
from vibsim.engine.results import Trajectories
from vibsim.engine.stages import kept_names
from vibsim.experiment.cost import PLAIN_WORK, work, work_alone
from vibsim.models import Model, has_budget
from vibsim.models.base import Formula
from vibsim.schemes import Scheme
from vibsim.schemes.base import END_RULES, Options, Stepper

TASK = 16 * block_loop.LANES
"""Number of members per task of a thread."""


def lane_for(members: int, steps: int, *, alone: bool = False, step_work: float = 1.0) -> str:
    """Choose the lane from the size of the work; the bits are the same in every lane.

    `alone` says that members cannot be stepped together by vector instructions: the step is implicit and iterates as
    often as its member needs, or the model does not allow it (`vibsim.experiment.cost.work_alone`). `step_work` is the
    work of a step, in explicit steps of one coordinate with one force evaluation.
    """
    if members * steps * step_work <= PLAIN_WORK:
        return "plain"
    return "blocks" if members > 1 and not alone else "scalar"


def integrate(
    model: Model,
    scheme: Scheme,
    options: Options,
    parameters: Floats,
    initial: Floats,
    dt: Floats,
    steps: int,
    every: int,
    *,
    lane: str | None = None,
    threads: int = 1,
    with_gathered: bool = True,
    with_series: bool = False,
    n_extrema: int = 0,
    n_events: int = 0,
) -> Trajectories:
    """Step every member from t = 0.

    Parameters
    ----------
    parameters
        In the order of `model.parameters`, shape (case, n_parameters).
    initial
        All positions and then all velocities, shape (case, state).
    dt
        Step of each member, shape (case,).
    steps, every
        Number of steps N, and the stride of the samples, a divisor of N.
    lane
        One of `LANES`; None: chosen by `lane_for`.
    threads
        Number of threads that share the members.
    with_gathered
        Whether extrema, norms, peaks, turns and energies are gathered at every step.
    with_series
        Whether samples have more than position and velocity.
    n_extrema
        Largest number of peaks, and of troughs, that are kept per member.
    n_events
        Largest number of event times that are kept per member, if anything is gathered.

    Raises
    ------
    SimulationError
        If the kernel cannot be compiled.
    ValueError
        If parameters or initial values do not have the shape that the model requires.
    """
    members, count = len(dt), model.coordinates
    _check_shapes(model, parameters, initial, members)
    stepper = scheme.stepper_for(model, options)
    has_events, has_work = model.events is not None, has_budget(model)
    if lane is None:
        factor = work_alone(model)
        step_work = sum(work(scheme.evaluations, scheme.explicit, factor))
        alone = stepper.implicit or factor is not None
        lane = lane_for(members, steps, alone=alone, step_work=step_work)
    run = kernel(model, stepper, lane, with_gathered, with_series, n_extrema > 0)

    # arrays that the kernel fills; NaN until known
    n_rows = _n_rows(model, stepper) if with_series else 2 * count
    n_columns = events.columns(count)["N_STATS_EVENTS"] + n_events
    n_columns = n_columns if has_events else count * gather.N_STATS
    n_counts = extrema.N_COUNTS_KEPT if n_extrema else gather.N_COUNTS
    samples = np.full((n_rows, members, steps // every + 1), np.nan)
    stats = np.full((members, n_columns if with_gathered else 0), np.nan)
    counts = np.zeros((members, n_counts), dtype=np.int64)
    kept = np.full((extrema.N_KEPT, members if n_extrema else 0, n_extrema), np.nan)

    parameters = _scaled(model, stepper, parameters, dt)
    numbers = _contiguous(parameters, _table(model), initial, dt)
    scratch = 0
    if lane == "blocks":
        states, n_kept = carried(stepper, model), len(kept_names(stepper.step))
        places = block_loop.row_places(states, parameters.shape[1], n_extrema > 0)
        scratch = places["FIRST_KEPT"] + n_kept * block_loop.LANES
    settings = steps, every, stepper.variant, END_RULES.index(stepper.end), model.turn or 0.0

    def task(first: int) -> None:
        stop = min(first + (TASK if threads > 1 else members), members)
        run(*numbers, first, stop, *settings, samples, stats, counts, kept, _aligned(scratch))

    if threads == 1:
        task(0)
    else:
        # kernels release the GIL
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(task, range(0, members, TASK)))
    return Trajectories(
        states=samples[: 2 * count],
        last_step=counts[:, gather.LAST_STEP],
        gathered=results.gathered_of(stats, counts, numbers[3], count) if with_gathered else None,
        series=results.series_of(samples, count, has_work, has_events) if with_series else None,
        extrema=results.extrema_of(kept, counts) if n_extrema else None,
        events=results.event_times_of(stats, count) if has_events and with_gathered else None,
    )


def _n_rows(model: Model, stepper: Stepper) -> int:
    """Return the number of rows of samples, up to the last that the kernel uses."""
    last = "RUNNING_D2T_ROW" if stepper.own_velocity else "RUNNING_ROW"
    if has_budget(model):
        last = "DRIVEN_ROW" if model.events is None else "LOST_ROW"
    return gather.sample_rows(model.coordinates)[last] + 1


def extrema_of(u: Floats, dt: float) -> results.Extrema:
    """Return peaks and troughs of positions at equal steps, shape (n_samples,), by the code of the kernels.

    Source: vibration text, section 3.5.
    """
    kept = np.full((extrema.N_KEPT, 1, len(u)), np.nan)
    counts = np.zeros((1, extrema.N_COUNTS_KEPT), dtype=np.int64)
    for n, triple in enumerate(zip(*(u[i:].tolist() for i in range(3)), strict=False), 1):
        if extrema.is_turned(*triple):
            extrema.note_turned(kept, counts, 0, n, dt, *triple)
    most = counts[0, [extrema.PEAK_COUNT, extrema.TROUGH_COUNT]].max()
    return results.extrema_of(kept[:, :, :most], counts)


def _check_shapes(model: Model, parameters: Floats, initial: Floats, members: int) -> None:
    count, shape = len(model.parameters), (members, len(model.states))
    # tabulated points may follow the parameters
    if parameters.shape[1] < count:
        raise ValueError(f"{model.kind} has {count} parameters, not {parameters.shape[1]}")
    if initial.shape != shape:
        raise ValueError(
            f"initial values of {model.kind} have the shape {shape}, not {initial.shape}"
        )


def _scaled(model: Model, stepper: Stepper, parameters: Floats, dt: Floats) -> Floats:
    """Append the factors of `Stepper.scaling` to the parameters of every member."""
    if stepper.scaling is None:
        return parameters
    named = {row.key: parameters[:, i] for i, row in enumerate(model.parameters)}
    factors = stepper.scaling(np.broadcast_to(model.natural_frequency(named), dt.shape) * dt)
    return np.column_stack([parameters, *factors])


def _table(model: Model) -> Floats:
    """Return the table of the model, shape (row, point); empty if it has none."""
    return _NO_TABLE if model.lookup is None else model.lookup.table.rows


_NOTHING, _NO_TABLE = np.empty(0), np.empty((0, 0))


def _aligned(size: int) -> Floats:
    """Return an array aligned to a cache line: access to a vector across two lines costs twice."""
    if size == 0:
        return _NOTHING
    buffer = np.empty(size + 8)
    first = -buffer.__array_interface__["data"][0] % 64 // 8
    return buffer[first : first + size]


def _contiguous(*arrays: Floats) -> list[Floats]:
    return [np.ascontiguousarray(array, dtype=float) for array in arrays]


def energies(
    model: Model,
    parameters: Floats,
    dt: Floats,
    every: int,
    states: Floats,
    *,
    lane: str,
) -> tuple[Floats, Floats]:
    """Return kinetic and potential energy at the samples of `integrate`, shape (case, n_samples); see `observed`."""
    formulas = (model.kinetic_energy, model.potential_energy)
    kinetic, potential = observed(model, formulas, parameters, dt, every, states, lane=lane)
    return kinetic, potential


def observed(
    model: Model,
    formulas: tuple[Formula, ...],
    parameters: Floats,
    dt: Floats,
    every: int,
    states: Floats,
    *,
    lane: str,
) -> Floats:
    """Return values of formulas of a model at the samples of `integrate`, shape (formula, case, n_samples).

    Parameters
    ----------
    states
        As `Trajectories.states`.

    Raises
    ------
    SimulationError
        If the kernel cannot be compiled.
    """
    samples = np.ascontiguousarray(states)
    values = np.empty((len(formulas), *samples.shape[1:]))
    run = observer(model, formulas, "plain" if lane == "plain" else "scalar")
    run(*_contiguous(parameters, _table(model), dt), every, 0, samples, values)
    return values
