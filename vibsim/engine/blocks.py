"""The loop over blocks of members, then steps, then the members of a block: many members at once.

The members of a block take each step together in a loop without branches, which the compiler turns into vector
instructions; what a step reads and writes stays in the first-level cache. Whatever needs a branch is rare and is done
member by member after that loop: a peak, a turn, a sample, an overflow, and an elementary function outside the range
of its branch-free form, which gives NaN there: the step of such a member is taken again with the full functions.

Every operation on a member's numbers is one that `vibsim.engine.loop` does, in the same order, so that the bits are
the same. `rows` is the scratch memory of one block, flat: row r of lane j is ``rows[r * LANES + j]``, because a stride
that the compiler knows tells it that rows do not overlap. Two sets of rows, of the last step and of this one, swap
their parts at each step; each holds the scheme's state, the position and the scheme's own velocity.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.bound import (
    ALIVE,
    BOTTOM,
    DT,
    ENERGY,
    EVENT,
    EXTREMA,
    FIRST_PARAMETER,
    GATHER,
    INTERIOR,
    PARAMETERS,
    SET,
    STATES,
    TWO_BEFORE,
    VELOCITY,
    backward,
    called,
    energies,
    energies_fast,
    extrema_in,
    parameters_in,
    parameters_of,
    put_extrema,
    put_states,
    start,
    states_in,
    step,
    step_fast,
    total,
)
from vibsim.engine.gather import (
    LARGEST_DEVIATION,
    LAST_STEP,
    N_EXTREMA,
    OVERFLOW,
    bottom_of,
    end_velocity,
    first_extrema,
    is_event,
    next_extrema,
    note_events,
    note_extrema,
)

LANES = 64
"""Members of a block."""
VECTOR = 8
"""Lanes of the widest vector instruction; fewer divide it."""

ROWS = ("DT", "ENERGY", "BOTTOM", "VELOCITY", "TWO_BEFORE", "INTERIOR", "ALIVE", "EVENT", "EXTREMA")
"""Rows behind the two sets, in their order. A kernel binds their numbers; from ``EXTREMA`` on stand the entries of
`vibsim.engine.gather.Extrema`, from ``FIRST_PARAMETER`` on the parameters."""


def set_of(states: int) -> int:
    """Return how many rows a set has: the state, the position, the scheme's own velocity."""
    return states + 2


def n_rows(states: int, parameters: int) -> int:
    """Return how many rows a kernel needs."""
    return 2 * set_of(states) + len(ROWS) - 1 + N_EXTREMA + parameters


def row_numbers(states: int) -> dict[str, int]:
    """Return the number of every row behind the two sets, and of the first parameter."""
    numbers = {name: 2 * set_of(states) + i for i, name in enumerate(ROWS)}
    return numbers | {"FIRST_PARAMETER": numbers["EXTREMA"] + N_EXTREMA}


def run(
    parameters: Any,
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
    rows: Any,
) -> None:
    """Step members first..stop-1 of one scheme: see `vibsim.engine.loop.run`.

    Parameters
    ----------
    rows
        Scratch memory, shape (`n_rows` * `LANES`,).
    """
    for base in range(first, stop, LANES):
        width = min(LANES, stop - base)
        # whole vectors: the lanes behind the last member repeat it and are never written
        filled = (width + VECTOR - 1) // VECTOR * VECTOR
        for j in range(filled):
            begin(parameters, initial, dt, base + min(j, width - 1), j, variant, turn, rows)
            rows[ALIVE * LANES + j] = 1.0 if j < width else 0.0
        for j in range(width):
            samples[0, base + j, 0] = initial[base + j, 0]
            samples[1, base + j, 0] = initial[base + j, 1]
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
            bad = step_odd(rows, filled, n) if n & 1 else step_even(rows, filled, n)
            if bad or is_last:
                for j in range(width):
                    if rows[ALIVE * LANES + j] != 0.0:
                        mend(rows, old, new, base + j, j, n, is_last, end_rule, stats, counts)
            if GATHER:
                odd = n & 1
                if gather_odd(rows, filled, n, turn) if odd else gather_even(rows, filled, n, turn):
                    for j in range(width):
                        if rows[EVENT * LANES + j] != 0.0 and rows[ALIVE * LANES + j] != 0.0:
                            note(rows, old, new, base + j, j, n, turn, stats, counts)
            if n == due:
                for j in range(width):
                    if rows[ALIVE * LANES + j] != 0.0:
                        samples[0, base + j, sample] = rows[(new + STATES) * LANES + j]
                        samples[1, base + j, sample] = rows[VELOCITY * LANES + j]
                sample += 1
                due += every
        for j in range(width):
            if rows[ALIVE * LANES + j] != 0.0:
                finish(rows, base + j, j, steps, stats, counts)


@called
def begin(
    parameters: Any,
    initial: Any,
    dt: Any,
    case: int,
    j: int,
    variant: int,
    turn: float,
    rows: Any,
) -> None:
    """Put member `case` at t = 0 into lane j."""
    h = float(dt[case])
    p = parameters_of(parameters, case)
    u = float(initial[case, 0])
    v = float(initial[case, 1])
    for i in range(PARAMETERS):
        rows[(FIRST_PARAMETER + i) * LANES + j] = parameters[case, i]
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


@called
def step_odd(rows: Any, filled: int, n: int) -> int:
    """Take an odd step: with its sets as numbers the compiler sees that they are not the same."""
    return step_block(rows, 0, SET, filled, n)


@called
def step_even(rows: Any, filled: int, n: int) -> int:
    """Take an even step."""
    return step_block(rows, SET, 0, filled, n)


def step_block(rows: Any, old: int, new: int, filled: int, n: int) -> int:
    """Take step n of every lane; return whether one may have failed or left the range of a fast function."""
    bad = 0
    for j in range(filled):
        h = rows[DT * LANES + j]
        state = states_in(rows, old, j)
        following, own = step_fast(state, n * h, h, parameters_in(rows, j))
        put_states(rows, new, j, following)
        u = state[0]
        rows[(new + STATES) * LANES + j] = u
        rows[(new + STATES + 1) * LANES + j] = own
        rows[VELOCITY * LANES + j] = own
        whole = total(following)
        bad = bad | ((not abs(u) + abs(own) < OVERFLOW) | (whole != whole))
    return bad


@called
def mend(
    rows: Any,
    old: int,
    new: int,
    case: int,
    j: int,
    n: int,
    is_last: bool,
    end_rule: int,
    stats: Any,
    counts: Any,
) -> None:
    """Take step n of a lane again where the fast one gave NaN; end the velocity; let a member that failed rest."""
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
        finish(rows, case, j, n - 1, stats, counts)
        rows[ALIVE * LANES + j] = 0.0
        rows[VELOCITY * LANES + j] = 0.0
        for i in range(SET):
            rows[(new + i) * LANES + j] = 0.0


@called
def gather_odd(rows: Any, filled: int, n: int, turn: float) -> int:
    """Gather what an odd step has."""
    return gather_block(rows, 0, SET, filled, n, turn)


@called
def gather_even(rows: Any, filled: int, n: int, turn: float) -> int:
    """Gather what an even step has."""
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
        own, own_before = rows[(new + STATES + 1) * LANES + j], rows[(old + STATES + 1) * LANES + j]
        event = is_event(turn, rows[BOTTOM * LANES + j], own_before, u, own)
        event = event | (deviation != deviation)
        rows[EVENT * LANES + j] = 1.0 if event else 0.0
        events = events | event
    return events


@called
def note(
    rows: Any, old: int, new: int, case: int, j: int, n: int, turn: float, stats: Any, counts: Any
) -> None:
    """Note the peak, trough or turn of a lane at step n, and an energy that no fast function could give."""
    h = rows[DT * LANES + j]
    u, v = rows[(new + STATES) * LANES + j], rows[VELOCITY * LANES + j]
    kinetic, potential = energies(u, v, n * h, parameters_in(rows, j))
    size = abs((kinetic + potential) - rows[ENERGY * LANES + j])
    if size > rows[(EXTREMA + LARGEST_DEVIATION) * LANES + j]:
        rows[(EXTREMA + LARGEST_DEVIATION) * LANES + j] = size
    rows[BOTTOM * LANES + j] = note_events(
        stats,
        counts,
        case,
        n * h,
        h,
        turn,
        rows[BOTTOM * LANES + j],
        rows[(old + STATES) * LANES + j],
        rows[(old + STATES + 1) * LANES + j],
        u,
        rows[(new + STATES + 1) * LANES + j],
    )


@called
def finish(rows: Any, case: int, j: int, good: int, stats: Any, counts: Any) -> None:
    """Write what was gathered of a member that has arrived, or that failed after step `good`."""
    if GATHER:
        note_extrema(
            stats, case, extrema_in(rows, j), rows[INTERIOR * LANES + j], rows[DT * LANES + j]
        )
    counts[case, LAST_STEP] = good
