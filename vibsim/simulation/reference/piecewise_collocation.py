r"""Motions whose force has corners or jumps, by collocation in pieces: within a piece the force is smooth.

Within a piece the modes of all switches are fixed (`vibsim.simulation.reference.one_sided_forces`), so that stages
beyond its end use the smooth continuation of its force. A step in which a switch leaves its mode is repeated with the
length that ends there, found by Newton's method on the polynomial of the step until the length no longer changes. Then
the mode changes and a new piece begins. A switch at the border of two modes has the mode that the motion enters; if
each mode leads into the other (dry friction that holds), there is no such motion, and the member slides.

A first walk finds the pieces, in steps of at most a given length. Every further walk has twice as many equal steps in
each piece as the previous one, so that the difference of two walks measures the error of the latter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.simulation.reference.collocation import (
    STAGES,
    Pieces,
    added,
    advanced,
    ahead,
    nodes,
    stages,
)
from vibsim.simulation.reference.event_detection import Exits, find_exits, overshoot
from vibsim.simulation.reference.one_sided_forces import Sides

MOST_ATTEMPTS = 2**13
"""Largest number of attempted steps of every member."""
SHORTEST = 2.0**-20
"""Shortest step, as a fraction of the end time."""
AT_ONCE = 1e-13
"""Fraction of the end time within which a switch counts as being at the start of the step."""
LINEAR = 1e-9
"""Tolerance for a quantity to be linear in time: its deviation from linear at half the time, relative to its change."""
TIED = 1e-12
"""Distance within which a switch is at a border, relative to its largest value in the previous step."""
LANDED = 2.0**-50
"""Tolerance for the end of a step at a switch, relative to the time."""
NEARLY = 1e-11
"""Tolerance relative to the end time, if rounding prevents `LANDED`."""
CLOSE = 0.02
"""Fraction of a step within which a root near its end is the one that it aims at."""
TRIES, MOST_TRIES = 5, 12
"""Corrections of a step's length before `NEARLY` suffices, and before the member is given up."""
OPEN, SLIDING, ENDLESS = range(3)
"""No known obstacle; a force holds the member at a jump; too many corners."""
END, SWITCH, EDGE, STEPS = range(4)
"""Rows of a plan: the time at which a piece ends, the switch that ends it (-1 for the end of the motion), the value of
its quantity there, and the number of its steps; shape (row, piece, case)."""


@dataclass(frozen=True)
class Walk:
    """The current state of the members, and their steps so far; arrays of shape (case,), updated in place."""

    sides: Sides
    end: Floats
    longest: Floats
    plan: Floats | None
    t: Floats
    t_lost: Floats
    """Compensation of the sum t."""
    u: Floats
    """Shape (coordinate, case)."""
    v: Floats
    lost: Floats
    """Compensations of the sums u and v, shape (2, coordinate, case)."""
    modes: Floats
    """Shape (switch, case)."""
    edge: Floats
    """Border at which a switch is, NaN if at none, shape (switch, case)."""
    h: Floats
    """Length of the next attempted step."""
    last: Flags
    """Whether that step ends the motion."""
    aim: Integers
    """The switch at which that step is to end; -1 for none."""
    goal: Floats
    """Value of the quantity of that switch there."""
    guess: Floats
    """Guess of the accelerations at its stages, shape (coordinate, stage, case)."""
    fresh: Flags
    """Whether the guess is to be replaced by the acceleration at the start of the step."""
    tries: Integers
    """Corrections of the step's length so far."""
    turns: Integers
    """Changes of modes since the last step."""
    taken: Integers
    """Accepted steps of the piece so far."""
    planned: Integers
    """Remaining steps of the piece in the plan; 0 without a plan."""
    going: Flags
    sliding: Flags
    """Whether a member ended because a force holds it at a jump."""
    count: Integers
    """Number of accepted steps."""
    steps: list[tuple[Any, ...]]
    ends: list[list[tuple[float, int, float, int]]]
    """For every member, a row of the plan for each of its pieces so far."""


@dataclass(frozen=True)
class Step:
    """An attempted step of the members `who`."""

    who: Integers
    h: Floats
    a: Floats
    exits: Exits


def walk_pieces(
    sides: Sides, start: Floats, end: Floats, longest: Floats, plan: Floats | None
) -> tuple[Pieces, Floats, Integers]:
    """Integrate each member to its end time.

    Parameters
    ----------
    start
        All positions and then all velocities at t = 0, shape (state, case).
    end
        End times, shape (case,).
    longest
        Longest step without a plan, shape (case,).
    plan
        The pieces of the previous walk, each of which gets twice as many steps; members with 0 steps have no plan.

    Returns
    -------
    tuple
        The solution, NaN for members that do not reach the end; its pieces, with 0 steps for those; and the reason why
        a member did not reach the end: `SLIDING`, `ENDLESS`, or `OPEN` if unknown, shape (case,).
    """
    walk = _begin(sides, start, end, longest, plan)
    for _ in range(MOST_ATTEMPTS):
        who = np.flatnonzero(walk.going)
        if not len(who):
            break
        _go_on(walk, _try(walk, who))
    arrived = walk.t >= end * (1.0 - AT_ONCE)
    ends = np.where(walk.going, ENDLESS, np.where(walk.sliding, SLIDING, OPEN))
    return _pieces(walk, arrived), _plan(walk, arrived), ends


def _begin(sides: Sides, start: Floats, end: Floats, longest: Floats, plan: Floats | None) -> Walk:
    """Return the members at t = 0, with the length of their first step."""
    u, v = np.array(np.split(start, 2))
    cases, switches = len(end), len(sides.switches)
    zero, no = np.zeros(cases, dtype=np.int64), np.zeros(cases, dtype=bool)
    nothing = np.zeros(cases)
    walk = Walk(
        sides=sides, end=end, longest=longest, plan=plan, t=nothing.copy(), t_lost=nothing.copy(),
        u=u, v=v, lost=np.zeros((2, *u.shape)), modes=np.zeros((switches, cases)),
        edge=np.full((switches, cases), np.nan), h=nothing.copy(), last=no.copy(), aim=zero - 1,
        goal=nothing.copy(), guess=np.zeros((len(u), STAGES, cases)), fresh=~no, tries=zero.copy(),
        turns=zero.copy(), taken=zero.copy(), planned=zero.copy(), going=~no, sliding=no.copy(),
        count=zero.copy(), steps=[], ends=[[] for _ in end],
    )  # fmt: skip
    everyone = np.arange(cases)
    _settle(walk, everyone, np.zeros((switches, cases)), zero - 1)
    _begin_piece(walk, everyone)
    return walk


def _of(numbers: Floats, who: Integers) -> Floats:
    """Return the values of a subset of the members, contiguous in memory."""
    return np.take(numbers, who, axis=-1)


def _settle(walk: Walk, who: Integers, size: Floats, fired: Integers) -> None:
    """Set the modes of all switches at the start of a piece; switches at a border keep theirs until the step is tried.

    Parameters
    ----------
    size
        Largest value of each quantity in the previous step, shape (switch, case).
    fired
        The switch whose mode has just changed, -1 for none.
    """
    sides, modes, edge = walk.sides.of(who), _of(walk.modes, who), _of(walk.edge, who)
    u, v, t = _of(walk.u, who), _of(walk.v, who), walk.t[who]
    for k, is_whole in enumerate(sides.whole):
        q = np.nan_to_num(sides.quantity(k, modes, u, v, t))
        border = np.round(q) if is_whole else np.zeros(len(who))
        free = np.floor(q) if is_whole else np.where(q > 0.0, 0.0, -1.0)
        tied = np.abs(q - border) <= TIED * size[k]
        keeps = (modes[k] == border) | (modes[k] == border - 1.0)
        has_fired = fired == k
        modes[k] = np.where(has_fired | (tied & keeps), modes[k], np.where(tied, border, free))
        edge[k] = np.where(has_fired, edge[k], np.where(tied, border, np.nan))
    walk.modes[:, who], walk.edge[:, who] = modes, edge


def _planned(walk: Walk, who: Integers) -> Floats:
    """Return the plan of the current pieces, shape (row, case); 0 steps if they are not in the plan."""
    plan = np.zeros((4, len(who)))
    if walk.plan is not None:
        piece = np.array([len(walk.ends[case]) for case in who], dtype=np.int64)
        row = np.minimum(piece, walk.plan.shape[1] - 1)
        plan = walk.plan[:, row, who]
        plan[STEPS] = np.where(piece == row, plan[STEPS], 0.0)
    return plan


def _begin_piece(walk: Walk, who: Integers) -> None:
    """Choose the first step of a piece."""
    walk.taken[who] = 0
    walk.planned[who] = 2 * _planned(walk, who)[STEPS]
    walk.fresh[who] = True
    _choose_length(walk, who)


def _choose_length(walk: Walk, who: Integers) -> None:
    """Choose the length of the next step: in a planned piece, an equal part of its remaining length."""
    remaining = walk.end[who] - walk.t[who]
    h = np.where(walk.h[who] > 0.0, 2.0 * walk.h[who], np.inf)
    h = np.minimum(h, walk.longest[who])
    left, plan = walk.planned[who], _planned(walk, who)
    way = plan[END] - walk.t[who]
    ahead = (left > 0) & (way > 0.0)
    h = np.where(ahead, way / np.maximum(left, 1), h)
    ends = ahead & (left == 1)
    walk.aim[who] = np.where(ends, plan[SWITCH], -1)
    walk.goal[who] = np.where(ends, plan[EDGE], 0.0)
    walk.tries[who] = walk.turns[who] = 0
    last = (h >= remaining * (1.0 - 1e-6)) & (walk.aim[who] < 0)
    walk.last[who] = last
    walk.h[who] = np.where(last, remaining, h)
    _meet_known(walk, who[walk.planned[who] == 0])


def _meet_known(walk: Walk, who: Integers) -> None:
    """Let steps end where a switch that is linear in time leaves its mode, which is known in advance."""
    sides, modes, t = walk.sides.of(who), _of(walk.modes, who), walk.t[who]
    for k in walk.sides.timed if len(who) else ():
        h = walk.h[who]
        still = _of(walk.u, who), _of(walk.v, who)
        q, half, ahead = (sides.quantity(k, modes, *still, t + x * h) for x in (0.0, 0.5, 1.0))
        rate = ahead - q
        linear = (np.abs(half - q - 0.5 * rate) <= LINEAR * np.abs(rate)) & (rate != 0.0)
        low, high = sides.borders(modes)
        goal = np.where(rate > 0.0, high[k], low[k])
        x = (goal - q) / rate
        meets = linear & (x > AT_ONCE) & (x < 1.0)
        now = who[meets]
        walk.h[now] = (x * h)[meets]
        walk.aim[now], walk.goal[now], walk.last[now] = k, goal[meets], False


def _try(walk: Walk, who: Integers) -> Step:
    """Attempt a step of every member in `who`, and find where switches leave their modes."""
    sides, h, modes = walk.sides.of(who), walk.h[who], _of(walk.modes, who)
    u, v, t = _of(walk.u, who), _of(walk.v, who), walk.t[who]
    force = sides.force(modes)
    guess, fresh = _of(walk.guess, who), walk.fresh[who]
    if fresh.any():
        guess = np.where(fresh, force(u[:, None], v[:, None], t[None]), guess)
    a = stages(force, u, v, t + nodes()[0][:, None] * h, h, guess)
    return Step(who, h, a, find_exits(sides, modes, _of(walk.edge, who), (u, v, t), h, a))


def _go_on(walk: Walk, step: Step) -> None:
    """Accept the step of each member, or change the next attempt."""
    who, exits = step.who, step.exits
    failed = ~np.isfinite(step.a).all(axis=(0, 1))
    turned = ~failed & exits.turned.any(axis=0)
    aim, goal = walk.aim[who], walk.goal[who]
    over = overshoot(exits, aim, goal)
    closes = ~failed & ~turned & (aim >= 0) & (np.abs(over) <= CLOSE)
    leaves = ~failed & ~turned & exits.leaves(np.where(closes, aim, -1))
    closes &= ~leaves
    passes = ~(failed | turned | leaves | closes)
    _shorten(walk, who[failed])
    _turn(walk, who[turned], exits.modes[:, turned])
    _take_aim(walk, step, leaves)
    done = _close_in(walk, step, closes, over)
    _accept(walk, step, passes | done, done)


def _shorten(walk: Walk, who: Integers) -> None:
    """Halve steps whose equations have no solution; end members whose steps become too short."""
    walk.h[who] *= 0.5
    walk.longest[who] = np.maximum(0.5 * walk.longest[who], SHORTEST * walk.end[who])
    walk.last[who], walk.aim[who], walk.fresh[who], walk.planned[who] = False, -1, True, 0
    walk.going[who[walk.h[who] < SHORTEST * walk.end[who]]] = False


def _turn(walk: Walk, who: Integers, modes: Floats) -> None:
    """Give switches at a border the mode that the motion enters."""
    walk.modes[:, who] = modes
    walk.fresh[who] = True
    walk.turns[who] += 1
    held = who[walk.turns[who] > 2 * (1 + len(walk.modes))]
    walk.going[held], walk.sliding[held] = False, True


def _take_aim(walk: Walk, step: Step, leaves: Flags) -> None:
    """Shorten steps to where the first switch leaves its mode; if that is at their start, change the mode."""
    if not leaves.any():
        return
    which = np.flatnonzero(leaves)
    who = step.who[which]
    sides, modes = walk.sides.of(who), _of(walk.modes, who)
    begin = _of(walk.u, who), _of(walk.v, who), walk.t[who]
    a = _of(step.a, which)
    switch, edge, x = step.exits.roots(sides, modes, begin, step.h[which], a, which)
    walk.aim[who], walk.goal[who], walk.tries[who] = switch, edge, 0
    walk.last[who], walk.fresh[who], walk.planned[who] = False, True, 0
    at_once = x * step.h[which] <= AT_ONCE * walk.end[who]
    walk.h[who] = np.where(at_once, walk.h[who], x * walk.h[who])
    now = who[at_once]
    if len(now):
        _cross(walk, now, switch[at_once], edge[at_once])
        walk.aim[now] = -1
        _turn(walk, now, walk.modes[:, now])


def _cross(walk: Walk, who: Integers, switch: Integers, edge: Floats) -> None:
    """Give one switch of each member the mode on the other side of an edge."""
    mode = walk.modes[switch, who]
    walk.modes[switch, who] = np.where(mode < edge, edge, edge - 1.0)
    walk.edge[switch, who] = edge


def _close_in(walk: Walk, step: Step, closes: Flags, over: Floats) -> Flags:
    """Correct the length of steps that are to end at a switch; return which end there."""
    who, end = step.who, walk.end[step.who]
    miss = np.abs(over) * step.h
    t = walk.t[who] + step.h
    landed = (miss <= LANDED * t) | ((walk.tries[who] >= TRIES) & (miss <= NEARLY * end))
    again = closes & ~landed
    walk.going[who[again & (walk.tries[who] >= MOST_TRIES)]] = False
    walk.h[who[again]] = (step.h * (1.0 - over))[again]
    walk.guess[..., who[again]] = step.a[..., again]
    walk.fresh[who[again]] = False
    walk.tries[who[again]] += 1
    return closes & landed


def _accept(walk: Walk, step: Step, taken: Flags, ends: Flags) -> None:
    """Advance by the steps in `taken`; `ends` says which of them end at a switch."""
    if not taken.any():
        return
    who, h, a = step.who[taken], step.h[taken], _of(step.a, np.flatnonzero(taken))
    u, v = _of(walk.u, who), _of(walk.v, who)
    walk.steps.append((who, walk.count[who], walk.t[who], h, u, v, a))
    walk.count[who] += 1
    walk.u[:, who], walk.v[:, who], walk.lost[..., who] = advanced(u, v, h, a, _of(walk.lost, who))
    walk.t[who], walk.t_lost[who] = added(walk.t[who], h, walk.t_lost[who])
    walk.taken[who] += 1
    walk.edge[:, who] = np.nan
    walk.guess[..., who] = ahead(a)
    walk.fresh[who] = False
    _finish(walk, who[walk.last[who] & ~ends[taken]])
    of_piece = ends[taken]
    _change(walk, step, np.flatnonzero(taken)[of_piece])
    on = who[~of_piece]
    on = on[walk.going[on]]
    before = walk.h[on]
    walk.planned[on] = np.maximum(walk.planned[on] - 1, 0)
    _choose_length(walk, on)
    # the guess is only valid for a step of equal length
    walk.fresh[on] |= np.abs(walk.h[on] - before) > 1e-6 * before


def _finish(walk: Walk, who: Integers) -> None:
    walk.t[who] = walk.end[who]
    walk.going[who] = False
    for case in who:
        walk.ends[case].append((walk.end[case], -1, 0.0, int(walk.taken[case])))


def _change(walk: Walk, step: Step, which: Integers) -> None:
    """Change the modes of switches at which steps have ended, and begin new pieces."""
    if not len(which):
        return
    who = step.who[which]
    switches, edge = walk.aim[who], walk.goal[who]
    for case, switch, border in zip(who, switches, edge, strict=True):
        walk.ends[case].append((walk.t[case], switch, border, walk.taken[case]))
    _cross(walk, who, switches, edge)
    _settle(walk, who, step.exits.size[:, which], switches)
    over = walk.t[who] >= walk.end[who] * (1.0 - AT_ONCE)
    _finish(walk, who[over])
    _begin_piece(walk, who[~over])


def _pieces(walk: Walk, arrived: Flags) -> Pieces:
    """Return the solution of the members that reached the end."""
    count, cases = walk.u.shape
    most = int(walk.count.max(initial=0))
    begin, length = np.full((2, most, cases), np.nan)
    position, velocity = np.full((2, most, count, cases), np.nan)
    inner = np.full((most, count, STAGES, cases), np.nan)
    for who, row, t, h, u, v, a in walk.steps:
        begin[row, who], length[row, who] = t, h
        position[row, :, who], velocity[row, :, who] = u.T, v.T
        inner[row, :, :, who] = np.moveaxis(a, -1, 0)
    length[:, ~arrived] = np.nan
    return Pieces(walk.end, begin, length, position, velocity, inner)


def _plan(walk: Walk, arrived: Flags) -> Floats:
    """Return the pieces, with 0 steps for members that did not reach the end."""
    known = [rows if is_done else [] for rows, is_done in zip(walk.ends, arrived, strict=True)]
    plan = np.zeros((4, max((len(rows) for rows in known), default=0) or 1, len(known)))
    plan[SWITCH] = -1.0
    for case, rows in enumerate(known):
        if rows:
            plan[:, : len(rows), case] = np.transpose(rows)
    return plan
