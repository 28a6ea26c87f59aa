"""The loop over blocks of members, then steps, then the members of a block: many members at once.

The members of a block take each step together in a loop without branches, which the compiler vectorises; the data of a
step stay in the L1 cache. Whatever needs a branch is rare and is done member by member after that loop: a peak, a turn,
a sample, an overflow, or an elementary function outside the range of its branch-free form. The latter gives NaN there,
and the step of such a member is repeated with the full functions.

The operations on a member's numbers are those of `vibsim.engine.member_loop`, in the same order, so that the bits are
the same. `rows` is the flat scratch memory of one block: a row has `LANES` numbers, and lane j of it is
``rows[ROW + j]``, because constant offsets tell the compiler that rows do not overlap. Two sets of rows, for the
previous and the current step, swap roles at each step. A set holds the scheme's state, the position, the scheme's own
velocity and, if extrema are kept, the previous position.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.engine.extrema import is_turned, note_turned
from vibsim.engine.gather import (
    DISSIPATED_ROW,
    DRIVEN_ROW,
    LARGEST_DEVIATION,
    LAST_STEP,
    N_EXTREMA,
    OVERFLOW,
    RUNNING_D2T_ROW,
    RUNNING_ROW,
    VELOCITY_D2T_ROW,
    bottom_of,
    end_velocity,
    first_extrema,
    is_event,
    larger,
    next_extrema,
    note_d2t,
    note_events,
    note_extrema,
)
from vibsim.engine.kernel_stubs import P, called, unbound

LANES = 64
"""Number of members in a block."""
VECTOR = 8
"""Number of lanes of the widest vector instruction; narrower ones divide it."""

ROWS = ("DT", "ENERGY", "BOTTOM", "VELOCITY", "TWO_BEFORE", "INTERIOR", "ALIVE", "EVENT", "EXTREMA")
"""Rows after the two sets: step, initial energy, multiple of a turn below, velocity at this point and two points
before, largest deviation before this point, 1 for an active lane, 1 for a lane with something to note, and from
``EXTREMA`` on the entries of `vibsim.engine.gather.Extrema`. The parameters follow, from ``FIRST_PARAMETER`` on."""
FURTHER_ROWS = (
    *("RATE", "PENDING", "LARGEST_D2T", "SLOPE", "SLOPE_BEFORE", "DISSIPATED", "DRIVEN"),
    "FIRST_KEPT",
)
"""Rows after the parameters. With `D2T`: ``1/(2 dt)``, the deviation by ``[D_2t u]`` at this point and the largest
before. With `STAGGERED`: ``[D_2t u]`` at this point and at the previous one. With `WORK`: the sums of the powers. From
``FIRST_KEPT`` on: values kept for later stages."""

# bound by the kernel (`vibsim.engine.kernel_stubs`); names of rows are their offsets (`row_places`)
D2T = GATHER = KEEP = SERIES = STAGED = STAGGERED = WORK = True
ALIVE = BEFORE = BOTTOM = DEVIATION_SO_FAR = DISSIPATED = DRIVEN = DT = ENERGY = EVENT = 1
FIRST_PARAMETER = INTERIOR = LARGEST_D2T = OWN = PARAMETERS = PENDING = POSITION = RATE = SET = 1
SLOPE = SLOPE_BEFORE = TWO_BEFORE = VELOCITY = 1
backward = energies = energies_fast = extrema_in = kept_in = parameters_in = unbound
parameters_of = powers = powers_fast = put_extrema = put_states = stages_of = start = unbound
states_in = step = step_end = step_fast = total = unbound

Lane = tuple[int, int, int, int, int]
"""Offsets of the set before and after a step, the member, its lane, and the number of the step."""


def row_places(states: int, parameters: int, with_peaks: bool) -> dict[str, int]:
    """Return the offset of every row by name.

    ``POSITION, OWN, BEFORE`` are relative to a set, after the state: the position, the scheme's own velocity, the
    previous position. ``SET`` is the second set. `ROWS`, the parameters and `FURTHER_ROWS` follow.
    """
    within = {"POSITION": states, "OWN": states + 1, "BEFORE": states + 2}
    size = states + (3 if with_peaks else 2)
    shared = {name: 2 * size + i for i, name in enumerate(ROWS)}
    first = shared["EXTREMA"] + N_EXTREMA
    further = {name: first + parameters + i for i, name in enumerate(FURTHER_ROWS)}
    shared |= {"DEVIATION_SO_FAR": shared["EXTREMA"] + LARGEST_DEVIATION, "FIRST_PARAMETER": first}
    places = {**within, "SET": size, **shared, **further}
    return {name: row * LANES for name, row in places.items()}


def run(members: Any, span: Any, settings: Any, results: Any, rows: Any) -> None:
    """Step a range of members by one scheme: see `vibsim.engine.member_loop.run`.

    Parameters
    ----------
    rows
        Scratch memory: `LANES` numbers for each row.
    """
    parameters, table, initial, dt = members
    first, stop = span
    steps, every, variant, end_rule, turn = settings
    samples = results[0]
    for base in range(first, stop, LANES):
        width = min(LANES, stop - base)
        # whole vectors: surplus lanes repeat the last member and are never written
        filled = (width + VECTOR - 1) // VECTOR * VECTOR
        for j in range(filled):
            case = base + min(j, width - 1)
            p = parameters_of(parameters, table, case)
            for i in range(PARAMETERS):
                rows[FIRST_PARAMETER + i * LANES + j] = parameters[case, i]
            begin(rows, j, variant, initial[case, 0], initial[case, 1], dt[case], turn, p)
            rows[ALIVE + j] = 1.0 if j < width else 0.0
        for j in range(width):
            samples[0, base + j, 0] = initial[base + j, 0]
            samples[1, base + j, 0] = initial[base + j, 1]
            if SERIES:
                samples[RUNNING_ROW, base + j, 0] = 0.0
            if WORK:
                samples[DISSIPATED_ROW, base + j, 0] = rows[DISSIPATED + j]
                samples[DRIVEN_ROW, base + j, 0] = rows[DRIVEN + j]
        sample = 1
        due = every
        for n in range(1, steps + 1):
            is_last = n == steps
            old = 0 if n & 1 else SET
            new = SET - old
            if is_last:
                for j in range(filled):
                    rows[TWO_BEFORE + j] = rows[new + OWN + j]
                    rows[INTERIOR + j] = rows[DEVIATION_SO_FAR + j]
            if step_lanes(rows, filled, n) or is_last:
                for j in range(width):
                    if rows[ALIVE + j] != 0.0:
                        mend(rows, (old, new, base + j, j, n), is_last, end_rule, every, results)
            if GATHER:  # noqa: SIM102
                if gather_lanes(rows, filled, n, turn):
                    for j in range(width):
                        if rows[EVENT + j] != 0.0 and rows[ALIVE + j] != 0.0:
                            note(rows, (old, new, base + j, j, n), turn, results)
            if n == due:
                for j in range(width):
                    if rows[ALIVE + j] != 0.0:
                        samples[0, base + j, sample] = rows[new + POSITION + j]
                        samples[1, base + j, sample] = rows[VELOCITY + j]
                        if SERIES:
                            take_series(rows, (old, new, base + j, j, n), sample, samples)
                sample += 1
                due += every
        for j in range(width):
            if rows[ALIVE + j] != 0.0:
                finish(rows, base + j, j, steps, every, results)


@called
def begin(rows: Any, j: int, variant: int, u: float, v: float, h: float, turn: float, p: P) -> None:
    """Put a member at t = 0 into lane j."""
    rows[DT + j] = h
    rows[ENERGY + j] = 0.0
    if GATHER:
        kinetic, potential = energies(u, v, 0.0, p)
        rows[ENERGY + j] = kinetic + potential
    rows[BOTTOM + j] = bottom_of(u, turn)
    put_extrema(rows, j, first_extrema(u, v))
    put_states(rows, 0, j, start(variant, u, v, h, p))
    rows[POSITION + j] = u
    rows[OWN + j] = v
    if KEEP:
        rows[BEFORE + j] = u
    if D2T:
        rows[RATE + j] = 0.5 / h
        rows[PENDING + j] = 0.0
        rows[LARGEST_D2T + j] = 0.0
    if STAGGERED:
        rows[SLOPE + j] = math.nan
    if WORK:
        rows[DISSIPATED + j], rows[DRIVEN + j] = powers(u, v, 0.0, p)


@called
def step_lanes(rows: Any, filled: int, n: int) -> int:
    """Take step n of every lane, with constant offsets of the sets, so that the compiler sees that they differ."""
    if n & 1:
        return step_block(rows, 0, SET, filled, n)
    return step_block(rows, SET, 0, filled, n)


def step_block(rows: Any, old: int, new: int, filled: int, n: int) -> int:
    """Take step n of every lane; return whether some lane may have failed or left the range of a fast function."""
    bad = 0
    if STAGED:
        stages_of(rows, old, filled, n)
    for j in range(filled):
        h = rows[DT + j]
        state = states_in(rows, old, j)
        if STAGED:
            following, own = step_end(state, n * h, h, parameters_in(rows, j), kept_in(rows, j))
        else:
            following, own = step_fast(state, n * h, h, parameters_in(rows, j))
        put_states(rows, new, j, following)
        u = state[0]
        rows[new + POSITION + j] = u
        rows[new + OWN + j] = own
        if KEEP:
            rows[new + BEFORE + j] = rows[old + POSITION + j]
        rows[VELOCITY + j] = own
        whole = total(following)
        bad = bad | ((not abs(u) + abs(own) < OVERFLOW) | (whole != whole))
    return bad


@called
def mend(rows: Any, lane: Lane, is_last: bool, end_rule: int, every: int, results: Any) -> None:
    """Repeat step n of a lane with full functions if it gave NaN; apply the end rule; finish a member that failed."""
    old, new, case, j, n = lane
    h = rows[DT + j]
    state = states_in(rows, old, j)
    own = rows[new + OWN + j]
    whole = total(states_in(rows, new, j))
    if own != own or whole != whole:
        following, own = step(state, n * h, h, parameters_in(rows, j))
        put_states(rows, new, j, following)
        rows[new + OWN + j] = own
    v = own
    if is_last:
        before = rows[old + OWN + j]
        v = end_velocity(end_rule, own, before, rows[TWO_BEFORE + j], backward(state, h))
    rows[VELOCITY + j] = v
    if not abs(state[0]) + abs(v) < OVERFLOW:
        # for a failed member, all points precede the last one
        rows[INTERIOR + j] = rows[DEVIATION_SO_FAR + j]
        finish(rows, case, j, n - 1, every, results)
        rows[ALIVE + j] = 0.0
        rows[VELOCITY + j] = 0.0
        for i in range(0, SET, LANES):
            rows[new + i + j] = 0.0


@called
def gather_lanes(rows: Any, filled: int, n: int, turn: float) -> int:
    """Gather the statistics of step n, with constant offsets of the sets as in `step_lanes`."""
    if n & 1:
        return gather_block(rows, 0, SET, filled, n, turn)
    return gather_block(rows, SET, 0, filled, n, turn)


def gather_block(rows: Any, old: int, new: int, filled: int, n: int, turn: float) -> int:
    """Gather the statistics of every lane at step n; return whether some lane has something to note."""
    events = 0
    for j in range(filled):
        u = rows[new + POSITION + j]
        v = rows[VELOCITY + j]
        kinetic, potential = energies_fast(u, v, n * rows[DT + j], parameters_in(rows, j))
        deviation = (kinetic + potential) - rows[ENERGY + j]
        put_extrema(rows, j, next_extrema(extrema_in(rows, j), u, v, deviation))
        if STAGGERED:
            slope, slope_before = velocity_d2t(rows, old, new, j), rows[SLOPE + j]
            rows[SLOPE_BEFORE + j] = slope_before
            rows[SLOPE + j] = slope
        else:
            slope = rows[new + OWN + j]
            slope_before = rows[old + OWN + j]
        event = is_event(turn, rows[BOTTOM + j], slope_before, u, slope)
        event = event | (deviation != deviation)
        if D2T:
            size = deviation_d2t(rows, old, new, j, n)
            rows[LARGEST_D2T + j] = larger(rows[PENDING + j], rows[LARGEST_D2T + j])
            rows[PENDING + j] = size
            event = event | (size != size)
        if WORK:
            taken, put = powers_fast(u, v, n * rows[DT + j], parameters_in(rows, j))
            known = (taken + put) == (taken + put)
            rows[DISSIPATED + j] = rows[DISSIPATED + j] + (taken if known else 0.0)
            rows[DRIVEN + j] = rows[DRIVEN + j] + (put if known else 0.0)
            event = event | (not known)
        if KEEP:
            event = event | is_turned(rows[old + BEFORE + j], rows[old + POSITION + j], u)
        rows[EVENT + j] = 1.0 if event else 0.0
        events = events | event
    return events


def velocity_d2t(rows: Any, old: int, new: int, j: int) -> float:
    """Return ``[D_2t u]^n`` of a lane, whose next position is the first entry of its new state."""
    ahead = float(rows[new + j])
    previous = float(rows[old + POSITION + j])
    return (ahead - previous) * float(rows[RATE + j])


def deviation_d2t(rows: Any, old: int, new: int, j: int, n: int) -> float:
    """Return the absolute energy deviation by ``[D_2t u]^n`` of a lane, or NaN outside the range of fast functions."""
    kinetic, potential = energies_fast(
        rows[new + POSITION + j],
        velocity_d2t(rows, old, new, j),
        n * rows[DT + j],
        parameters_in(rows, j),
    )
    return abs((kinetic + potential) - float(rows[ENERGY + j]))


@called
def take_series(rows: Any, lane: Lane, sample: int, samples: Any) -> None:
    """Write the further rows of a sample of a lane."""
    old, new, case, j, _ = lane
    samples[RUNNING_ROW, case, sample] = rows[DEVIATION_SO_FAR + j]
    if D2T:
        samples[VELOCITY_D2T_ROW, case, sample] = velocity_d2t(rows, old, new, j)
        samples[RUNNING_D2T_ROW, case, sample] = larger(rows[PENDING + j], rows[LARGEST_D2T + j])
    if WORK:
        samples[DISSIPATED_ROW, case, sample] = rows[DISSIPATED + j]
        samples[DRIVEN_ROW, case, sample] = rows[DRIVEN + j]


@called
def note(rows: Any, lane: Lane, turn: float, results: Any) -> None:
    """Note the peak, trough or turn of a lane at step n, and repeat energies that fast functions could not give."""
    _, stats, counts, kept = results
    old, new, case, j, n = lane
    h, p = rows[DT + j], parameters_in(rows, j)
    u, v = rows[new + POSITION + j], rows[VELOCITY + j]
    kinetic, potential = energies(u, v, n * h, p)
    size = abs((kinetic + potential) - rows[ENERGY + j])
    if size > rows[DEVIATION_SO_FAR + j]:
        rows[DEVIATION_SO_FAR + j] = size
    if WORK:
        taken, put = powers_fast(u, v, n * h, p)
        if taken + put != taken + put:
            taken, put = powers(u, v, n * h, p)
            rows[DISSIPATED + j] = rows[DISSIPATED + j] + taken
            rows[DRIVEN + j] = rows[DRIVEN + j] + put
    if D2T:
        kinetic, potential = energies(u, velocity_d2t(rows, old, new, j), n * h, p)
        rows[PENDING + j] = abs((kinetic + potential) - rows[ENERGY + j])
    if KEEP:
        before, middle = rows[old + BEFORE + j], rows[old + POSITION + j]
        if is_turned(before, middle, u):
            note_turned(kept, counts, case, n - 1, h, before, middle, u)
    if STAGGERED:
        slope, slope_before = rows[SLOPE + j], rows[SLOPE_BEFORE + j]
    else:
        slope = rows[new + OWN + j]
        slope_before = rows[old + OWN + j]
    passed = (n * h, h, rows[old + POSITION + j], slope_before, u, slope)
    bottom = rows[BOTTOM + j]
    rows[BOTTOM + j] = note_events(stats, counts, case, turn, bottom, passed)


@called
def finish(rows: Any, case: int, j: int, good: int, every: int, results: Any) -> None:
    """Write the statistics of a member whose last finite step is `good`."""
    samples, stats, counts, _ = results
    if GATHER:
        note_extrema(stats, case, 0, extrema_in(rows, j), rows[INTERIOR + j])
    if D2T:
        note_d2t(stats, samples, case, good, every, rows[LARGEST_D2T + j])
    counts[case, LAST_STEP] = good
