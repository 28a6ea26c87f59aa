"""The loop over members and then steps: one member at a time, its whole state in registers.

`vibsim.engine.kernel` binds the functions of the scheme and the model, runs this text in Python in the plain lane and
compiles it for the scalar lane. The contents of a step are written once, in the scheme, the model and
`vibsim.engine.gather`; `vibsim.engine.block_loop` does the same steps in another order.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.engine.events import DONE, LOST, TAKEN, begun, passed, put_turned
from vibsim.engine.extrema import is_turned, note_turned
from vibsim.engine.gather import (
    DISSIPATED_ROW,
    DRIVEN_ROW,
    LARGEST_DEVIATION,
    LAST_STEP,
    LOST_ROW,
    OVERFLOW,
    RUNNING_D2T_ROW,
    RUNNING_ROW,
    VELOCITY_D2T_ROW,
    bottom_of,
    centred_difference,
    end_velocity,
    first_extrema,
    is_event,
    larger,
    next_extrema,
    note_d2t,
    note_events,
    note_extrema,
)
from vibsim.engine.kernel_stubs import P, unbound

# bound by the kernel (`vibsim.engine.kernel_stubs`)
D2T = EVENTS = GATHER = KEEP = LOCATED = SERIES = STAGGERED = WORK = True
backward = energies = energy_with = first_further = first_of = initial_of = mode_of = unbound
next_further = note_further = observed = parameters_of = point_of = powers = unbound
put_components = put_moving = size_of = start = step = unbound


def run(members: Any, span: Any, settings: Any, results: Any, rows: Any) -> None:
    """Step a range of members by one scheme, and fill the results.

    Parameters
    ----------
    members
        ``parameters``, shape (case, n_parameters). ``table``, shape (row, point), empty if the model has none
        (`vibsim.models.table`). ``initial``, shape (case, state): positions, then velocities. ``dt``, shape (case,).
    span
        First member and end of the range, exclusive.
    settings
        ``steps, every``: number of steps; a sample is stored at each multiple of `every`, which divides `steps`.
        ``variant``: variant of the scheme's start. ``end_rule``: velocity at the last point, index into
        `vibsim.schemes.base.END_RULES`. ``turn``: angle of a full turn; 0 if the position is not an angle.
    results
        ``samples``, shape (rows, case, n_samples), filled with NaN: positions, velocities, and the rows of
        `vibsim.engine.gather`. ``stats``, shape (case, `N_STATS`), filled with NaN: columns of `vibsim.engine.gather`.
        ``counts``, shape (case, `N_COUNTS`), filled with zeros: columns of `vibsim.engine.gather`, then those of
        `vibsim.engine.extrema`. ``kept``, shape (`N_KEPT`, case, extremum), filled with NaN: rows of
        `vibsim.engine.extrema`.
    rows
        Scratch memory of `vibsim.engine.block_loop`, unused here.
    """
    parameters, table, initial, dt = members
    first, stop = span
    steps, every, variant, end_rule, turn = settings
    samples, stats, counts, kept = results
    for case in range(first, stop):
        h = float(dt[case])
        p = parameters_of(parameters, table, case)
        # with several coordinates q and w are vectors; u and v are position and velocity of the first
        q, w = initial_of(initial, case)
        u, v = first_of(q), first_of(w)
        if EVENTS:
            p = begun(stats, case, q, w, p)
            last_event = -1
        energy_0 = 0.0
        if GATHER:
            kinetic, potential = energies(q, w, 0.0, p)
            energy_0 = kinetic + potential
        work = first_work(q, w, p)
        if D2T:
            # deviation of the energy by the centred difference: at this point, and the largest before it
            pending = largest_d2t = 0.0
        put_moving(samples, case, 0, q, w)
        if SERIES:
            samples[RUNNING_ROW, case, 0] = 0.0
        if WORK:
            put_work(samples, stats, case, 0, work)
        extrema, further = first_extrema(u, v), first_further(q, w)
        interior = 0.0
        bottom = bottom_of(u, turn)
        state = start(variant, q, w, h, p)
        good = 0
        sample = 1
        due = every
        u_before, q_before, w_before, slope = u, q, w, v
        if STAGGERED:
            slope = math.nan
        for n in range(1, steps + 1):
            t = n * h
            u_two_before, u_before, q_before = u_before, u, q
            w_two_before, w_before = w_before, w
            if EVENTS:
                record = stats, counts, case
                q, following, own, p, passes = passed(record, variant, n, h, q, w_before, state, p)
                last_event = n if passes > 0 else last_event
            else:
                q = state[0]
                following, own = step(state, t, h, p)
            w = own
            if n == steps:
                w = end_velocity(end_rule, own, w_before, w_two_before, backward(state, h))
            if EVENTS:  # noqa: SIM102
                # end formulas are invalid across an event and at rest
                if n - last_event < 2 or mode_of(p) == 0.0:
                    w = own
            state = following
            # written so that NaN fails as well
            if not size_of(q, w) < OVERFLOW:
                break
            good = n
            u, v = first_of(q), first_of(w)
            # with the scheme's own velocity, because an end formula would move a peak in the last step
            slope_before, slope = slope, first_of(own)
            if STAGGERED:
                slope = (first_of(following[0]) - u_before) * (0.5 / h)
            if EVENTS:  # noqa: SIM102
                # peaks at events were noted with the event, also at a point of rest just before
                if n == last_event or (n - 1 == last_event and slope_before == 0.0):
                    slope_before = math.nan
            if GATHER:
                kinetic, potential = energies(q, w, t, p)
                interior = extrema[LARGEST_DEVIATION]
                extrema = next_extrema(extrema, u, v, (kinetic + potential) - energy_0)
                further = next_further(further, q, w)
                if is_event(turn, bottom, slope_before, u, slope):
                    points = (t, h, u_before, slope_before, u, slope)
                    bottom = note_events(stats, counts, case, turn, bottom, points)
            if WORK:
                work = next_work(work, stats, case, (q, w, t, p))
            if D2T:
                # the deviation at the previous point depends on this point, which is now known to be finite
                largest_d2t = larger(pending, largest_d2t)
                velocity_d2t = centred_difference(following[0], q_before, 0.5 / h)
                pending = abs(energy_with(q, velocity_d2t, t, p, potential) - energy_0)
            if KEEP:  # noqa: SIM102
                if is_turned(u_two_before, u_before, u):
                    note_turned(kept, counts, case, n - 1, h, u_two_before, u_before, u)
                    if EVENTS:  # noqa: SIM102
                        if LOCATED:
                            put_turned(stats, counts, kept, case, h)
            if n == due:
                put_moving(samples, case, sample, q, w)
                if SERIES:
                    samples[RUNNING_ROW, case, sample] = extrema[LARGEST_DEVIATION]
                    if D2T:
                        put_components(samples, VELOCITY_D2T_ROW, case, sample, velocity_d2t)
                        samples[RUNNING_D2T_ROW, case, sample] = larger(pending, largest_d2t)
                    if WORK:
                        put_work(samples, stats, case, sample, work)
                sample += 1
                due += every
        if GATHER:
            # for a failed member, all points precede the last one
            interior = interior if good == steps else extrema[LARGEST_DEVIATION]
            note_extrema(stats, case, 0, extrema, interior)
            note_further(stats, case, further)
        if D2T:
            note_d2t(stats, samples, case, good, every, largest_d2t)
        counts[case, LAST_STEP] = good


def first_work(q: Any, w: Any, p: P) -> tuple[float, float]:
    """Return the powers of damping and of driving forces at t = 0; with events, their work, which is 0."""
    work = 0.0, 0.0
    if WORK:
        if EVENTS:
            return work
        work = powers(q, w, 0.0, p)
    return work


def next_work(work: tuple[float, float], stats: Any, case: int, point: Any) -> tuple[float, float]:
    """Return the sums of the powers after one more point (q, w, t, p); with events, the work so far."""
    if EVENTS:
        return stats[case, TAKEN], stats[case, DONE]
    q, w, t, p = point
    dissipated, driven = powers(q, w, t, p)
    return work[0] + dissipated, work[1] + driven


def put_work(samples: Any, stats: Any, case: int, k: int, work: tuple[float, float]) -> None:
    """Write the work of sample k."""
    samples[DISSIPATED_ROW, case, k] = work[0]
    samples[DRIVEN_ROW, case, k] = work[1]
    if EVENTS:
        samples[LOST_ROW, case, k] = stats[case, LOST]


def observe(
    parameters: Any, table: Any, dt: Any, every: int, first: int, samples: Any, results: Any
) -> None:
    """Fill `results` with values of formulas at stored samples, for its number of members from member `first` on.

    Parameters
    ----------
    parameters
        Shape (case, n_parameters).
    table
        Table of the model, shape (row, point); empty if it has none.
    dt, every
        Step of each member, shape (case,), and steps between samples.
    samples
        All positions and all velocities, shape (state, case, n_samples).
    results
        Shape (formula, members, n_samples); NaN where the samples are NaN.
    """
    for member in range(results.shape[1]):
        case = first + member
        p = parameters_of(parameters, table, case)
        for k in range(results.shape[2]):
            u, v = point_of(samples, case, k)
            values = observed(u, v, (k * every) * float(dt[case]), p)
            for i in range(results.shape[0]):
                results[i, member, k] = values[i]
