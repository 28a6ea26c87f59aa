"""Steps of a model with events (`vibsim.models.events`): smooth steps, divided at events.

Events that are *located* are found by repeating the step with a different length: the length tau with which it ends at
the event is a root, as accurate as the scheme itself, whatever its order. There the state changes, and the scheme
restarts: once for the rest of the step, and once more at the grid point, because a multistep scheme needs equal steps.
Events that are left to the *mesh* are noticed at the next grid point, and treated there.

The time of a scheme begins at 0 when it restarts. Mode and time of the restart follow the parameters of the member, so
that forces are evaluated at the right time and in the right mode.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.engine.extrema import HEIGHT, OF_A_KIND, PEAK_COUNT, TIME, TIME_GRID
from vibsim.engine.gather import N_STATS, note_turning
from vibsim.engine.kernel_stubs import P, State, called, unbound

# bound by the kernel (`vibsim.engine.kernel_stubs`)
ACT = GATHER = LOCATED = WORK = True
first_mode = first_of = followed = guard = guard_on_mesh = held = is_at_rest = counts_as_event = (
    unbound
)
landed = lost = mode_of = powers = settled = spent = start = start_of = step = turning = (
    with_mode
) = unbound

# Columns of `stats`, after those of `vibsim.engine.gather`. HALTED and HALTED_GRID: the mode before the body came to
# rest, and the next grid point; if it leaves in the other direction, it has turned there. LOST: cost of sliding or
# impacts so far. DONE, TAKEN: work of driving forces and of damping so far, summed piece by piece, because the powers
# have corners at events. TURN_TIME, TURN: time and height of the last event that was a peak, followed by those of the
# last that was a trough. The times of the first events follow, as many as fit.
EVENT_COUNT, FIRST_EVENT, LAST_EVENT, REST_TIME = range(N_STATS, N_STATS + 4)
HALTED, HALTED_GRID, LOST, DONE, TAKEN, TURN_TIME, TURN = range(N_STATS + 4, N_STATS + 11)
N_STATS_EVENTS = N_STATS + 13
_COLUMNS = (
    *("EVENT_COUNT", "FIRST_EVENT", "LAST_EVENT", "REST_TIME", "HALTED", "HALTED_GRID", "LOST"),
    *("DONE", "TAKEN", "TURN_TIME", "TURN", "N_STATS_EVENTS"),
)

MOST_EVENTS = 256
"""Largest number of events in a step; after the last one the body rests until its force moves it."""
MOST_TRIALS = 200
"""Largest number of trials for the time of an event; every third halves the interval."""
SHARP = 2.0**-52
"""Tolerance of the time of an event, relative to the step."""


def columns(coordinates: int) -> dict[str, int]:
    """Return the indices of these columns by name, after those of all coordinates."""
    further = (coordinates - 1) * N_STATS
    return {name: globals()[name] + further for name in _COLUMNS}


@called
def begun(stats: Any, case: int, u: float, v: float, p: P) -> P:
    """Return the parameters with the initial mode, and initialise the columns of events."""
    mode = first_mode(u, v, 0.0, p)
    if GATHER:
        stats[case, EVENT_COUNT] = 0.0
        stats[case, LOST] = 0.0
        stats[case, DONE] = 0.0
        stats[case, TAKEN] = 0.0
        if is_at_rest(mode):
            stats[case, REST_TIME] = 0.0
    return with_mode(p, mode, 0.0)


@called
def passed(
    record: Any, variant: int, n: int, dt: float, u: float, v: float, state: State, p: P
) -> tuple[float, State, float, P, int]:
    """Return position, next state, velocity and parameters at step `n`, and the number of events since step n - 1.

    Parameters
    ----------
    record
        `stats`, `counts` and the member.
    u, v
        Position and velocity at step n - 1.
    state
        State of the scheme at step n; meaningless for a member at rest.
    """
    t, began = n * dt, start_of(p)
    if mode_of(p) == 0.0:
        ahead, own, following = u, held(v), state
    else:
        ahead = state[0]
        following, own = step(state, t - start_of(p), dt, p)
    count = 0
    if LOCATED:
        if guard(ahead, own, t, p) < 0.0:
            after, speed, p, count = across(record, variant, n, dt, u, v, p)
            if ACT:
                ahead, own = after, speed
        elif GATHER:
            note_piece(record, variant, (u, v, ahead, own, t - dt, dt), p)
    else:
        if GATHER:
            note_piece(record, variant, (u, v, ahead, own, t - dt, dt), p)
        if guard_on_mesh(ahead, own, t, p) < 0.0:
            before, came = mode_of(p), (ahead, own)
            ahead, own, mode = settled(ahead, own, t, u, False, p)
            if GATHER:
                note_event(record, t, t, came, before, (ahead, own), mode, p)
            p = with_mode(p, mode, t)
            count = 1
    if not ACT:
        # the motion goes on as if nothing had happened
        p, count = with_mode(p, mode_of(p), began), 0
    p = with_mode(p, followed(ahead, own, t, p), start_of(p))
    if count > 0:
        p = with_mode(p, mode_of(p), t)
        following = anew(variant, ahead, own, dt, p)
    return ahead, following, own, p, count


@called
def across(
    record: Any, variant: int, n: int, dt: float, u: float, v: float, p: P
) -> tuple[float, float, P, int]:
    """Return position, velocity and parameters at step `n` after all events since step n - 1, and their number."""
    t, end = (n - 1) * dt, n * dt
    for count in range(2 * MOST_EVENTS):
        left = end - t
        ahead, own = leap(variant, u, v, t, left, p)
        if not (left > 0.0 and guard(ahead, own, end, p) < 0.0):
            if GATHER:
                note_piece(record, variant, (u, v, ahead, own, t, left), p)
            return ahead, own, p, count
        tau = landing(variant, u, v, t, left, p)
        ahead, own = leap(variant, u, v, t, tau, p)
        ahead, own = landed(ahead, own)
        if GATHER:
            note_piece(record, variant, (u, v, ahead, own, t, tau), p)
        # the last event of a step may be at its end
        t = t + tau if tau < left else end
        before = mode_of(p)
        u, v, mode = settled(ahead, own, t, math.inf, count >= MOST_EVENTS - 1, p)
        if GATHER:
            note_event(record, t, end, (ahead, own), before, (u, v), mode, p)
        p = with_mode(p, mode, t)
    return u * math.nan, v * math.nan, p, 2 * MOST_EVENTS


@called
def note_piece(record: Any, variant: int, piece: tuple[float, ...], p: P) -> None:
    """Add the cost of a smooth piece, and the work of damping and driving forces along it, by Simpson's rule.

    Parameters
    ----------
    piece
        Position and velocity at its beginning, position and velocity at its end, time at its beginning, length.
    """
    stats, _, case = record
    u, v, ahead, own, t, dt = piece
    stats[case, LOST] = stats[case, LOST] + spent(u, ahead)
    if WORK:  # noqa: SIM102
        if mode_of(p) != 0.0:
            middle, speed = leap(variant, u, v, t, 0.5 * dt, p)
            taken, done = powers(u, v, t, p)
            taken_between, done_between = powers(middle, speed, t + 0.5 * dt, p)
            taken_last, done_last = powers(ahead, own, t + dt, p)
            sum_taken = (taken + taken_last) + 4.0 * taken_between
            sum_done = (done + done_last) + 4.0 * done_between
            stats[case, TAKEN] = stats[case, TAKEN] + dt * sum_taken / 6.0
            stats[case, DONE] = stats[case, DONE] + dt * sum_done / 6.0


@called
def anew(variant: int, u: float, v: float, dt: float, p: P) -> State:
    """Return the state of a restarted scheme after its first step."""
    return start(variant, u, v, dt, p)


@called
def leap(variant: int, u: float, v: float, t: float, dt: float, p: P) -> tuple[float, float]:
    """Return position and velocity after one step of length `dt` from time `t`, in the current mode."""
    if mode_of(p) == 0.0 or not dt > 0.0:
        return u, v
    here = with_mode(p, mode_of(p), t)
    state = anew(variant, u, v, dt, here)
    return state[0], step(state, dt, dt, here)[1]


@called
def landing(variant: int, u: float, v: float, t: float, left: float, p: P) -> float:
    """Return the length of the step that ends at the event; the guard is below 0 after a step of length `left`.

    Regula falsi (Illinois variant), with a bisection every third time, so that the interval shrinks for any guard. A
    guard that is 0 at the beginning, because of the previous event, does not count as the root.
    """
    low, high = 0.0, left
    at_low = guard(u, v, t, p)
    ahead, own = leap(variant, u, v, t, left, p)
    at_high = guard(ahead, own, t + left, p)
    side = 0
    for k in range(MOST_TRIALS):
        tau = 0.5 * (low + high)
        if k % 3 != 2 and at_low > 0.0:
            guess = high - at_high * ((high - low) / (at_high - at_low))
            # not within rounding of an end, which would gain nothing
            least = 0.25 * SHARP * left
            guess = low + least if guess < low + least else guess
            guess = high - least if guess > high - least else guess
            tau = guess if low < guess < high else tau
        if high - low <= SHARP * left or not low < tau < high:
            break
        ahead, own = leap(variant, u, v, t, tau, p)
        value = guard(ahead, own, t + tau, p)
        if value < 0.0:
            high, at_high = tau, value
            if side == -1:
                at_low = 0.5 * at_low
            side = -1
        else:
            low, at_low = tau, value
            if side == 1:
                at_high = 0.5 * at_high
            side = 1
    return high


@called
def note_event(
    record: Any, t: float, grid: float, came: Any, before: float, goes: Any, after: float, p: P
) -> None:
    """Write the event at time `t`: its time, whether the member comes to rest, and whether it is a peak or a trough.

    A member that rests and then leaves in the direction from which it came has turned when it came to rest.

    Parameters
    ----------
    came, before
        Position and velocity, and mode before the event.
    goes, after
        The same after the event.
    """
    stats, counts, case = record
    stats[case, LOST] = stats[case, LOST] + lost(came, goes, t, p)
    u = first_of(goes[0])
    since, point, resting = t, grid, stats[case, REST_TIME]
    counted = counts_as_event(before, after, came, goes)
    if is_at_rest(before):
        since, point, before = resting, stats[case, HALTED_GRID], stats[case, HALTED]
    elif is_at_rest(after):
        stats[case, HALTED], stats[case, HALTED_GRID] = before, grid
    stats[case, REST_TIME] = t if is_at_rest(after) else math.nan
    if not counted:
        return
    if stats[case, EVENT_COUNT] == 0.0:
        stats[case, FIRST_EVENT] = t
    stats[case, LAST_EVENT] = t
    place = N_STATS_EVENTS + math.floor(stats[case, EVENT_COUNT])
    if place < stats.shape[1]:
        stats[case, place] = t
    stats[case, EVENT_COUNT] += 1.0
    kind = turning(before, after, first_of(came[1]), first_of(goes[1]))
    if kind != 0.0:
        note_turning(stats, counts, case, since, point, u, kind)
        side = 0 if kind > 0.0 else 2
        stats[case, TURN_TIME + side] = since
        stats[case, TURN + side] = u


@called
def put_turned(stats: Any, counts: Any, kept: Any, case: int, dt: float) -> None:
    """Correct time and height of the last peak and the last trough if they are events.

    The parabola through three points ignores the corner between them.
    """
    for kind in range(2):
        place = counts[case, PEAK_COUNT + kind] - 1
        row = OF_A_KIND * kind
        if 0 <= place < kept.shape[2]:
            time = stats[case, TURN_TIME + 2 * kind]
            if abs(time - kept[row + TIME_GRID, case, place]) <= dt:
                kept[row + TIME, case, place] = time
                kept[row + HEIGHT, case, place] = stats[case, TURN + 2 * kind]
