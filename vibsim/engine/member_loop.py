"""The loop over members, then steps: one member at a time, its whole state in registers.

`vibsim.engine.kernel` binds the functions of the scheme and the model, runs this text as it stands in the plain lane
and compiles it for the scalar one. What happens in a step is written once, in the scheme, the model and
`vibsim.engine.gather`; `vibsim.engine.block_loop` does the same steps in another order.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.engine.events import DONE, LOST, begun, passed
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
from vibsim.engine.kernel_stubs import unbound

# bound by the kernel (`vibsim.engine.kernel_stubs`)
D2T = EVENTS = GATHER = KEEP = SERIES = STAGGERED = SYSTEM = WORK = True
COORDINATES = 1
backward = energies = energy_with = first_further = initial_of = mode_of = next_further = unbound
note_further = observed = parameters_of = point_of = powers = size_of = start = step = unbound


def run(
    parameters: Any,
    table: Any,
    initial: Any,
    dt: Any,
    first: int,
    stop: int,
    steps: int,
    every: int,
    variant: int,
    end_rule: int,
    turn: float,
    samples: Any,
    stats: Any,
    counts: Any,
    kept: Any,
    rows: Any,
) -> None:
    """Step members first..stop-1 of one scheme, and fill `samples`, `stats` and `counts`.

    Parameters
    ----------
    parameters, initial, dt
        Shapes (case, n_parameters), (case, state) with positions and then velocities, and (case,).
    table
        What formulas look up (`vibsim.models.table`), shape (row, point); empty where they do not.
    steps, every
        Number of steps; a sample is stored at each multiple of `every`, which divides `steps`.
    variant
        Which of its starts the scheme takes.
    end_rule
        Velocity at the last point: index into `vibsim.schemes.base.END_RULES`.
    turn
        Angle of a whole turn; 0 where the position is no angle.
    samples
        Shape (rows, case, n_samples), filled with NaN: positions, velocities, and the rows of `vibsim.engine.gather`.
    stats
        Shape (case, `N_STATS`), filled with NaN: columns of `vibsim.engine.gather`.
    counts
        Shape (case, `N_COUNTS`), filled with zeros: columns of `vibsim.engine.gather`, and behind them those of
        `vibsim.engine.extrema`.
    kept
        Shape (`N_KEPT`, case, extremum), filled with NaN: rows of `vibsim.engine.extrema`.
    rows
        Scratch of `vibsim.engine.block_loop`, which this loop does without.
    """
    # positions q and velocities w are tuples for several coordinates; u and v are those of the first one
    for case in range(first, stop):
        h = float(dt[case])
        p = parameters_of(parameters, table, case)
        if SYSTEM:
            q, w = initial_of(initial, case)
            u, v = q[0], w[0]
            further = first_further(q, w)
            for i in range(COORDINATES):
                samples[i, case, 0] = q[i]
                samples[COORDINATES + i, case, 0] = w[i]
        else:
            q = u = float(initial[case, 0])
            w = v = float(initial[case, 1])
            samples[0, case, 0] = u
            samples[1, case, 0] = v
        energy_0 = 0.0
        if GATHER:
            kinetic, potential = energies(q, w, 0.0, p)
            energy_0 = kinetic + potential
        if SERIES:
            samples[RUNNING_ROW, case, 0] = 0.0
        if WORK:
            if EVENTS:
                dissipated = driven = 0.0
                samples[LOST_ROW, case, 0] = 0.0
            else:
                dissipated, driven = powers(q, w, 0.0, p)
            samples[DISSIPATED_ROW, case, 0] = dissipated
            samples[DRIVEN_ROW, case, 0] = driven
        extrema = first_extrema(u, v)
        bottom = bottom_of(u, turn)
        if EVENTS:
            p = begun(stats, case, u, v, p)
            last_event = -1
        state = start(variant, q, w, h, p)
        interior = 0.0
        good = 0
        sample = 1
        due = every
        q_before, w_before, slope = q, w, v
        if STAGGERED:
            slope = math.nan
        if D2T:
            rate = 0.5 / h
            pending = largest_d2t = 0.0
        if KEEP:
            u_before = u
        for n in range(1, steps + 1):
            t = n * h
            if KEEP:
                u_two_before = u_before
            u_before, q_before, w_two_before, w_before = u, q, w_before, w
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
                # a formula over points on both sides of an event, or of a member at rest, gives no velocity
                if n - last_event < 2 or mode_of(p) == 0.0:
                    w = own
            state = following
            # the scheme's own velocity: an end formula would move a peak in the last step
            if SYSTEM:
                size, u, v, own_first = size_of(q, w), q[0], w[0], own[0]  # type: ignore[index]
            else:
                size, u, v, own_first = abs(q) + abs(w), q, w, own
            # written so that NaN fails as well
            if not size < OVERFLOW:
                break
            good = n
            slope_before, slope = slope, own_first
            if STAGGERED:
                if SYSTEM:  # noqa: SIM108
                    slope = (following[0][0] - u_before) * (0.5 / h)
                else:
                    slope = (following[0] - u_before) * (0.5 / h)
            if EVENTS:  # noqa: SIM102
                # events have noted themselves whether they are peaks, also one at rest on the point before
                if n == last_event or (n - 1 == last_event and slope_before == 0.0):
                    slope_before = math.nan
            if GATHER:
                kinetic, potential = energies(q, w, t, p)
                interior = extrema[LARGEST_DEVIATION]
                extrema = next_extrema(extrema, u, v, (kinetic + potential) - energy_0)
                if SYSTEM:
                    further = next_further(further, q, w)
                if is_event(turn, bottom, slope_before, u, slope):
                    points = (t, h, u_before, slope_before, u, slope)
                    bottom = note_events(stats, counts, case, turn, bottom, points)
            if WORK:
                if EVENTS:
                    driven = stats[case, DONE]
                else:
                    taken, put = powers(q, w, t, p)
                    dissipated += taken
                    driven += put
            if D2T:
                # that of the point before counts now that this one is sound, since it rests on it
                largest_d2t = larger(pending, largest_d2t)
                velocity_d2t = centred_difference(following[0], q_before, rate)
                pending = abs(energy_with(q, velocity_d2t, t, p, potential) - energy_0)
            if KEEP:  # noqa: SIM102
                if is_turned(u_two_before, u_before, u):
                    note_turned(kept, counts, case, n - 1, h, u_two_before, u_before, u)
            if n == due:
                if SYSTEM:
                    for i in range(COORDINATES):
                        samples[i, case, sample] = q[i]
                        samples[COORDINATES + i, case, sample] = w[i]
                else:
                    samples[0, case, sample] = u
                    samples[1, case, sample] = v
                if SERIES:
                    samples[RUNNING_ROW, case, sample] = extrema[LARGEST_DEVIATION]
                    if D2T:
                        if SYSTEM:
                            for i in range(COORDINATES):
                                samples[VELOCITY_D2T_ROW + i, case, sample] = velocity_d2t[i]
                        else:
                            samples[VELOCITY_D2T_ROW, case, sample] = velocity_d2t
                        samples[RUNNING_D2T_ROW, case, sample] = larger(pending, largest_d2t)
                    if WORK:
                        samples[DISSIPATED_ROW, case, sample] = dissipated
                        samples[DRIVEN_ROW, case, sample] = driven
                        if EVENTS:
                            samples[LOST_ROW, case, sample] = stats[case, LOST]
                sample += 1
                due += every
        if GATHER:
            # of a member that failed, all points came before the last one
            interior = interior if good == steps else extrema[LARGEST_DEVIATION]
            note_extrema(stats, case, 0, extrema, interior)
            if SYSTEM:
                note_further(stats, case, further)
        if D2T:
            note_d2t(stats, samples, case, good, every, largest_d2t)
        counts[case, LAST_STEP] = good


def observe(
    parameters: Any, table: Any, dt: Any, every: int, first: int, samples: Any, found: Any
) -> None:
    """Fill `found` with formulas of stored samples, for as many members as it has from member `first` on.

    Parameters
    ----------
    parameters
        Shape (case, n_parameters).
    table
        What formulas look up, shape (row, point); empty where they do not.
    dt, every
        Step of each member, shape (case,), and steps between samples.
    samples
        All positions and all velocities, shape (state, case, n_samples).
    found
        A row of each formula, shape (formula, members, n_samples); NaN where the samples are.
    """
    for member in range(found.shape[1]):
        case = first + member
        p = parameters_of(parameters, table, case)
        for k in range(found.shape[2]):
            if SYSTEM:
                u, v = point_of(samples, case, k)
            else:
                u = float(samples[0, case, k])
                v = float(samples[1, case, k])
            values = observed(u, v, (k * every) * float(dt[case]), p)
            for i in range(found.shape[0]):
                found[i, member, k] = values[i]
