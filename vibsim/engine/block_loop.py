"""The loop over blocks of members, then steps, then the members of a block: many members at once.

The members of a block take each step together in a loop without branches, which the compiler turns into vector
instructions; what a step reads and writes stays in the first-level cache. Whatever needs a branch is rare and is done
member by member after that loop: a peak, a turn, a sample, an overflow, and an elementary function outside the range
of its branch-free form, which gives NaN there: the step of such a member is taken again with the full functions.

Every operation on a member's numbers is one that `vibsim.engine.member_loop` does, in the same order, so that the bits
are the same. `rows` is the scratch memory of one block, flat: row r of lane j is ``rows[r * LANES + j]``, because a
stride that the compiler knows tells it that rows do not overlap. Two sets of rows, of the last step and of this one,
swap their parts at each step; each holds the scheme's state, the position and the scheme's own velocity, and where
extrema are kept the position before.
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
"""Members of a block."""
VECTOR = 8
"""Lanes of the widest vector instruction; fewer divide it."""

ROWS = ("DT", "ENERGY", "BOTTOM", "VELOCITY", "TWO_BEFORE", "INTERIOR", "ALIVE", "EVENT", "EXTREMA")
"""Rows behind the two sets: step, initial energy, multiple of a turn below, velocity at this point and two points
before, largest deviation before this point, 1 for a lane that goes on, 1 for one with something to note, and from
``EXTREMA`` on the entries of `vibsim.engine.gather.Extrema`; behind those, from ``FIRST_PARAMETER`` on, the
parameters."""
ROWS_BEHIND = (
    *("RATE", "PENDING", "LARGEST_D2T", "SLOPE", "SLOPE_BEFORE", "DISSIPATED", "DRIVEN"),
    "FIRST_KEPT",
)
"""Rows behind the parameters: where `D2T` is ``1/(2 dt)``, the deviation by ``[D_2t u]`` at this point and the largest
one before; where peaks are found by that velocity (`STAGGERED`), it at this point and the one before; the sums of
powers for `WORK`; and from ``FIRST_KEPT`` on what is kept from stage to stage."""

# bound by the kernel (`vibsim.engine.kernel_stubs`); `SET` is the number of rows of a set
D2T = GATHER = KEEP = SERIES = STAGED = STAGGERED = WORK = True
ALIVE = BOTTOM = DISSIPATED = DRIVEN = DT = ENERGY = EVENT = EXTREMA = FIRST_PARAMETER = 1
INTERIOR = LARGEST_D2T = PARAMETERS = PENDING = RATE = SET = SLOPE = SLOPE_BEFORE = STATES = 1
TWO_BEFORE = VELOCITY = 1
backward = energies = energies_fast = extrema_in = kept_in = parameters_in = unbound
parameters_of = powers = powers_fast = put_extrema = put_states = stages_of = start = unbound
states_in = step = step_end = step_fast = total = unbound

Lane = tuple[int, int, int, int, int]
"""First rows of the set before a step and of that behind it, the member, its lane, and the number of the step."""


def set_of(states: int, with_peaks: bool) -> int:
    """Return how many rows a set has: the state, the position, the scheme's own velocity, the position before."""
    return states + (3 if with_peaks else 2)


def row_numbers(states: int, parameters: int, with_peaks: bool) -> dict[str, int]:
    """Return the number of every row behind the two sets, and of the first parameter."""
    behind = 2 * set_of(states, with_peaks)
    numbers = {name: behind + i for i, name in enumerate(ROWS)}
    first = numbers["EXTREMA"] + N_EXTREMA
    last = {name: first + parameters + i for i, name in enumerate(ROWS_BEHIND)}
    return numbers | {"FIRST_PARAMETER": first} | last


def run(members: Any, span: Any, settings: Any, found: Any, rows: Any) -> None:
    """Step some members of one scheme: see `vibsim.engine.member_loop.run`.

    Parameters
    ----------
    rows
        Scratch memory: `LANES` numbers for each row.
    """
    parameters, table, initial, dt = members
    first, stop = span
    steps, every, variant, end_rule, turn = settings
    samples = found[0]
    for base in range(first, stop, LANES):
        width = min(LANES, stop - base)
        # whole vectors: the lanes behind the last member repeat it and are never written
        filled = (width + VECTOR - 1) // VECTOR * VECTOR
        for j in range(filled):
            case = base + min(j, width - 1)
            p = parameters_of(parameters, table, case)
            for i in range(PARAMETERS):
                rows[(FIRST_PARAMETER + i) * LANES + j] = parameters[case, i]
            begin(rows, j, variant, initial[case, 0], initial[case, 1], dt[case], turn, p)
            rows[ALIVE * LANES + j] = 1.0 if j < width else 0.0
        for j in range(width):
            samples[0, base + j, 0] = initial[base + j, 0]
            samples[1, base + j, 0] = initial[base + j, 1]
            if SERIES:
                samples[RUNNING_ROW, base + j, 0] = 0.0
            if WORK:
                samples[DISSIPATED_ROW, base + j, 0] = rows[DISSIPATED * LANES + j]
                samples[DRIVEN_ROW, base + j, 0] = rows[DRIVEN * LANES + j]
        sample = 1
        due = every
        for n in range(1, steps + 1):
            is_last = n == steps
            old = 0 if n & 1 else SET
            new = SET - old
            if is_last:
                for j in range(filled):
                    rows[TWO_BEFORE * LANES + j] = rows[(new + STATES + 1) * LANES + j]
                    rows[INTERIOR * LANES + j] = rows[(EXTREMA + LARGEST_DEVIATION) * LANES + j]
            if step_lanes(rows, filled, n) or is_last:
                for j in range(width):
                    if rows[ALIVE * LANES + j] != 0.0:
                        mend(rows, (old, new, base + j, j, n), is_last, end_rule, every, found)
            if GATHER:  # noqa: SIM102
                if gather_lanes(rows, filled, n, turn):
                    for j in range(width):
                        if rows[EVENT * LANES + j] != 0.0 and rows[ALIVE * LANES + j] != 0.0:
                            note(rows, (old, new, base + j, j, n), turn, found)
            if n == due:
                for j in range(width):
                    if rows[ALIVE * LANES + j] != 0.0:
                        samples[0, base + j, sample] = rows[(new + STATES) * LANES + j]
                        samples[1, base + j, sample] = rows[VELOCITY * LANES + j]
                        if SERIES:
                            take_series(rows, (old, new, base + j, j, n), sample, samples)
                sample += 1
                due += every
        for j in range(width):
            if rows[ALIVE * LANES + j] != 0.0:
                finish(rows, base + j, j, steps, every, found)


@called
def begin(rows: Any, j: int, variant: int, u: float, v: float, h: float, turn: float, p: P) -> None:
    """Put a member at t = 0 into lane j."""
    rows[DT * LANES + j] = h
    rows[ENERGY * LANES + j] = 0.0
    if GATHER:
        kinetic, potential = energies(u, v, 0.0, p)
        rows[ENERGY * LANES + j] = kinetic + potential
    rows[BOTTOM * LANES + j] = bottom_of(u, turn)
    put_extrema(rows, j, first_extrema(u, v))
    put_states(rows, 0, j, start(variant, u, v, h, p))
    rows[(0 + STATES) * LANES + j] = u
    rows[(0 + STATES + 1) * LANES + j] = v
    if KEEP:
        rows[(0 + STATES + 2) * LANES + j] = u
    if D2T:
        rows[RATE * LANES + j] = 0.5 / h
        rows[PENDING * LANES + j] = 0.0
        rows[LARGEST_D2T * LANES + j] = 0.0
    if STAGGERED:
        rows[SLOPE * LANES + j] = math.nan
    if WORK:
        rows[DISSIPATED * LANES + j], rows[DRIVEN * LANES + j] = powers(u, v, 0.0, p)


@called
def step_lanes(rows: Any, filled: int, n: int) -> int:
    """Take step n of every lane: with its sets as numbers the compiler sees that they are not the same."""
    if n & 1:
        return step_block(rows, 0, SET, filled, n)
    return step_block(rows, SET, 0, filled, n)


def step_block(rows: Any, old: int, new: int, filled: int, n: int) -> int:
    """Take step n of every lane; return whether one may have failed or left the range of a fast function."""
    bad = 0
    if STAGED:
        stages_of(rows, old, filled, n)
    for j in range(filled):
        h = rows[DT * LANES + j]
        state = states_in(rows, old, j)
        if STAGED:
            following, own = step_end(state, n * h, h, parameters_in(rows, j), kept_in(rows, j))
        else:
            following, own = step_fast(state, n * h, h, parameters_in(rows, j))
        put_states(rows, new, j, following)
        u = state[0]
        rows[(new + STATES) * LANES + j] = u
        rows[(new + STATES + 1) * LANES + j] = own
        if KEEP:
            rows[(new + STATES + 2) * LANES + j] = rows[(old + STATES) * LANES + j]
        rows[VELOCITY * LANES + j] = own
        whole = total(following)
        bad = bad | ((not abs(u) + abs(own) < OVERFLOW) | (whole != whole))
    return bad


@called
def mend(rows: Any, lane: Lane, is_last: bool, end_rule: int, every: int, found: Any) -> None:
    """Take step n of a lane again where the fast one gave NaN; end the velocity; let a member that failed rest."""
    old, new, case, j, n = lane
    h = rows[DT * LANES + j]
    state = states_in(rows, old, j)
    own = rows[(new + STATES + 1) * LANES + j]
    whole = total(states_in(rows, new, j))
    if own != own or whole != whole:
        following, own = step(state, n * h, h, parameters_in(rows, j))
        put_states(rows, new, j, following)
        rows[(new + STATES + 1) * LANES + j] = own
    v = own
    if is_last:
        before = rows[(old + STATES + 1) * LANES + j]
        v = end_velocity(end_rule, own, before, rows[TWO_BEFORE * LANES + j], backward(state, h))
    rows[VELOCITY * LANES + j] = v
    if not abs(state[0]) + abs(v) < OVERFLOW:
        # of a member that failed, all points came before the last one
        rows[INTERIOR * LANES + j] = rows[(EXTREMA + LARGEST_DEVIATION) * LANES + j]
        finish(rows, case, j, n - 1, every, found)
        rows[ALIVE * LANES + j] = 0.0
        rows[VELOCITY * LANES + j] = 0.0
        for i in range(SET):
            rows[(new + i) * LANES + j] = 0.0


@called
def gather_lanes(rows: Any, filled: int, n: int, turn: float) -> int:
    """Gather what step n has, as `step_lanes` takes it."""
    if n & 1:
        return gather_block(rows, 0, SET, filled, n, turn)
    return gather_block(rows, SET, 0, filled, n, turn)


def gather_block(rows: Any, old: int, new: int, filled: int, n: int, turn: float) -> int:
    """Gather what every lane has at step n; return whether one has something to note."""
    events = 0
    for j in range(filled):
        u = rows[(new + STATES) * LANES + j]
        v = rows[VELOCITY * LANES + j]
        kinetic, potential = energies_fast(u, v, n * rows[DT * LANES + j], parameters_in(rows, j))
        deviation = (kinetic + potential) - rows[ENERGY * LANES + j]
        put_extrema(rows, j, next_extrema(extrema_in(rows, j), u, v, deviation))
        if STAGGERED:
            slope, slope_before = velocity_d2t(rows, old, new, j), rows[SLOPE * LANES + j]
            rows[SLOPE_BEFORE * LANES + j] = slope_before
            rows[SLOPE * LANES + j] = slope
        else:
            slope = rows[(new + STATES + 1) * LANES + j]
            slope_before = rows[(old + STATES + 1) * LANES + j]
        event = is_event(turn, rows[BOTTOM * LANES + j], slope_before, u, slope)
        event = event | (deviation != deviation)
        if D2T:
            size = deviation_d2t(rows, old, new, j, n)
            rows[LARGEST_D2T * LANES + j] = larger(
                rows[PENDING * LANES + j], rows[LARGEST_D2T * LANES + j]
            )
            rows[PENDING * LANES + j] = size
            event = event | (size != size)
        if WORK:
            taken, put = powers_fast(u, v, n * rows[DT * LANES + j], parameters_in(rows, j))
            known = (taken + put) == (taken + put)
            rows[DISSIPATED * LANES + j] = rows[DISSIPATED * LANES + j] + (taken if known else 0.0)
            rows[DRIVEN * LANES + j] = rows[DRIVEN * LANES + j] + (put if known else 0.0)
            event = event | (not known)
        if KEEP:
            event = event | is_turned(
                rows[(old + STATES + 2) * LANES + j], rows[(old + STATES) * LANES + j], u
            )
        rows[EVENT * LANES + j] = 1.0 if event else 0.0
        events = events | event
    return events


def velocity_d2t(rows: Any, old: int, new: int, j: int) -> float:
    """Return ``[D_2t u]^n`` of a lane, whose next position is the first entry of its new state."""
    ahead = float(rows[new * LANES + j])
    behind = float(rows[(old + STATES) * LANES + j])
    return (ahead - behind) * float(rows[RATE * LANES + j])


def deviation_d2t(rows: Any, old: int, new: int, j: int, n: int) -> float:
    """Return the size of the energy deviation by ``[D_2t u]^n`` of a lane, or NaN; the potential energy is known."""
    kinetic, potential = energies_fast(
        rows[(new + STATES) * LANES + j],
        velocity_d2t(rows, old, new, j),
        n * rows[DT * LANES + j],
        parameters_in(rows, j),
    )
    return abs((kinetic + potential) - float(rows[ENERGY * LANES + j]))


@called
def take_series(rows: Any, lane: Lane, sample: int, samples: Any) -> None:
    """Write what samples have of a lane beside position and velocity."""
    old, new, case, j, _ = lane
    samples[RUNNING_ROW, case, sample] = rows[(EXTREMA + LARGEST_DEVIATION) * LANES + j]
    if D2T:
        samples[VELOCITY_D2T_ROW, case, sample] = velocity_d2t(rows, old, new, j)
        samples[RUNNING_D2T_ROW, case, sample] = larger(
            rows[PENDING * LANES + j], rows[LARGEST_D2T * LANES + j]
        )
    if WORK:
        samples[DISSIPATED_ROW, case, sample] = rows[DISSIPATED * LANES + j]
        samples[DRIVEN_ROW, case, sample] = rows[DRIVEN * LANES + j]


@called
def note(rows: Any, lane: Lane, turn: float, found: Any) -> None:
    """Note the peak, trough or turn of a lane at step n, and an energy that no fast function could give."""
    _, stats, counts, kept = found
    old, new, case, j, n = lane
    h, p = rows[DT * LANES + j], parameters_in(rows, j)
    u, v = rows[(new + STATES) * LANES + j], rows[VELOCITY * LANES + j]
    kinetic, potential = energies(u, v, n * h, p)
    size = abs((kinetic + potential) - rows[ENERGY * LANES + j])
    if size > rows[(EXTREMA + LARGEST_DEVIATION) * LANES + j]:
        rows[(EXTREMA + LARGEST_DEVIATION) * LANES + j] = size
    if WORK:
        taken, put = powers_fast(u, v, n * h, p)
        if taken + put != taken + put:
            taken, put = powers(u, v, n * h, p)
            rows[DISSIPATED * LANES + j] = rows[DISSIPATED * LANES + j] + taken
            rows[DRIVEN * LANES + j] = rows[DRIVEN * LANES + j] + put
    if D2T:
        kinetic, potential = energies(u, velocity_d2t(rows, old, new, j), n * h, p)
        rows[PENDING * LANES + j] = abs((kinetic + potential) - rows[ENERGY * LANES + j])
    if KEEP:
        behind, middle = rows[(old + STATES + 2) * LANES + j], rows[(old + STATES) * LANES + j]
        if is_turned(behind, middle, u):
            note_turned(kept, counts, case, n - 1, h, behind, middle, u)
    if STAGGERED:
        slope, slope_before = rows[SLOPE * LANES + j], rows[SLOPE_BEFORE * LANES + j]
    else:
        slope = rows[(new + STATES + 1) * LANES + j]
        slope_before = rows[(old + STATES + 1) * LANES + j]
    passed = (n * h, h, rows[(old + STATES) * LANES + j], slope_before, u, slope)
    bottom = rows[BOTTOM * LANES + j]
    rows[BOTTOM * LANES + j] = note_events(stats, counts, case, turn, bottom, passed)


@called
def finish(rows: Any, case: int, j: int, good: int, every: int, found: Any) -> None:
    """Write what was gathered of a member that has arrived, or that failed after step `good`."""
    samples, stats, counts, _ = found
    if GATHER:
        note_extrema(stats, case, 0, extrema_in(rows, j), rows[INTERIOR * LANES + j])
    if D2T:
        note_d2t(stats, samples, case, good, every, rows[LARGEST_D2T * LANES + j])
    counts[case, LAST_STEP] = good
