r"""Motions whose force has corners or jumps, by collocation from one to the next: every piece has a smooth force.

Within a piece the modes of all switches are held (`vibsim.simulation.reference.one_sided_forces`), so that stages
behind its end see the smooth continuation of its force. A step in which a switch leaves its mode is taken again with
the length that ends there: Newton's method on the polynomial of the step, until the length no longer changes. There the
mode changes and a new piece begins. A switch that is at the border of two modes has the mode into which the motion
goes; where each leads into the other (dry friction that holds) there is no such motion.

A first walk finds the pieces, in steps of at most a given length. Every other one has twice as many equal steps in
each piece as the one before it, so that the difference of two walks tells the error of the latter.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from vibsim.simulation.reference.collocation import (
    Floats,
    added,
    basis,
    integrals,
    stages,
    summed,
    tableau,
)
from vibsim.simulation.reference.event_detection import Exits, find_exits, overshoot
from vibsim.simulation.reference.one_sided_forces import Sides
from vibsim.simulation.reference.piece_steps import (
    AT_ONCE,
    Log,
    Walk,
    begin_walk,
    next_length,
    of,
    plan_piece,
    settle,
)
from vibsim.simulation.reference.pieces import Pieces, Plan

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

MOST_ATTEMPTS = 2**13
"""Steps that are tried, at most, of every member."""
SHORTEST = 2.0**-20
"""Part of the end time below which no step is tried."""
LANDED = 2.0**-50
"""A step ends at a switch to so much of the time."""
NEARLY = 1e-11
"""Part of the end time to which it must, where rounding allows no more."""
CLOSE = 0.02
"""Part of a step within which its end is taken for the root that is sought."""
TRIES, MOST_TRIES = 5, 12
OPEN, SLIDING, ENDLESS = range(3)
"""Nothing is against an end; a force holds the member at a jump; there are more corners than can be gone through."""


@dataclass(frozen=True)
class Step:
    """A step that was tried, of the members `who`."""

    who: Ints
    h: Floats
    a: Floats
    exits: Exits


def walk_pieces(
    sides: Sides, start: Floats, end: Floats, longest: Floats, plan: Plan | None
) -> tuple[Pieces, Plan, Ints]:
    """Go to the end time of each member.

    Parameters
    ----------
    start
        All positions and then all velocities at t = 0, shape (state, case).
    end
        End times, shape (case,).
    longest
        Longest step where there is no plan, shape (case,).
    plan
        The pieces of a walk before, of which each gets twice as many steps; of members without steps nothing is known.

    Returns
    -------
    tuple
        The solution, NaN for members that do not come to the end; its pieces, without steps for those; and why a
        member did not come to the end: `SLIDING`, `ENDLESS`, or `OPEN` for no reason known, shape (case,).
    """
    walk = begin_walk(sides, start, end, longest, plan)
    log = Log([], [[] for _ in end], np.zeros(len(end), dtype=np.int64))
    for _ in range(MOST_ATTEMPTS):
        who = np.flatnonzero(walk.going)
        if not len(who):
            break
        _go_on(walk, log, _try(walk, who))
    arrived = walk.t >= end * (1.0 - AT_ONCE)
    ends = np.where(walk.going, ENDLESS, np.where(walk.sliding, SLIDING, OPEN))
    return log.pieces(walk, arrived), log.plan(arrived), ends


def _try(walk: Walk, who: Ints) -> Step:
    """Take a step of every member in `who`, and look where switches leave their modes."""
    sides, h, modes = walk.sides.of(who), walk.h[who], of(walk.modes, who)
    u, v, t = of(walk.u, who), of(walk.v, who), walk.t[who]
    force = sides.force(modes)
    guess, fresh = of(walk.guess, who), walk.fresh[who]
    if fresh.any():
        guess = np.where(fresh, force(u[:, None], v[:, None], t[None]), guess)
    a = stages(force, u, v, t + tableau().c[:, None] * h, h, guess)
    exits = find_exits(sides, modes, of(walk.edge, who), (u, v, t), h, a)
    return Step(who, h, a, exits)


def _go_on(walk: Walk, log: Log, step: Step) -> None:
    """Accept the step of each member, or change what is tried next."""
    who, found = step.who, step.exits
    failed = ~np.isfinite(step.a).all(axis=(0, 1))
    turned = ~failed & found.turned.any(axis=0)
    aim, goal = walk.aim[who], walk.goal[who]
    over = overshoot(found, aim, goal)
    closes = ~failed & ~turned & (aim >= 0) & (np.abs(over) <= CLOSE)
    leaves = ~failed & ~turned & found.leaves(np.where(closes, aim, -1))
    closes &= ~leaves
    passes = ~(failed | turned | leaves | closes)
    _shorten(walk, who[failed])
    _turn(walk, who[turned], found.modes[:, turned])
    _take_aim(walk, step, leaves)
    done = _close_in(walk, step, closes, over)
    _accept(walk, log, step, passes | done, done)


def _shorten(walk: Walk, who: Ints) -> None:
    """Halve steps whose equations have no solution; end members whose steps become too short."""
    walk.h[who] *= 0.5
    walk.longest[who] = np.maximum(0.5 * walk.longest[who], SHORTEST * walk.end[who])
    walk.last[who], walk.aim[who], walk.fresh[who], walk.planned[who] = False, -1, True, 0
    walk.going[who[walk.h[who] < SHORTEST * walk.end[who]]] = False


def _turn(walk: Walk, who: Ints, modes: Floats) -> None:
    """Give switches at a border the mode into which the motion goes."""
    walk.modes[:, who] = modes
    walk.fresh[who] = True
    walk.turns[who] += 1
    held = who[walk.turns[who] > 2 * (1 + len(walk.modes))]
    walk.going[held], walk.sliding[held] = False, True


def _take_aim(walk: Walk, step: Step, leaves: Flags) -> None:
    """Shorten steps to where the first switch leaves its mode; where that is at once, change the mode."""
    if not leaves.any():
        return
    which = np.flatnonzero(leaves)
    who = step.who[which]
    sides, modes = walk.sides.of(who), of(walk.modes, who)
    begin = of(walk.u, who), of(walk.v, who), walk.t[who]
    a = of(step.a, which)
    switch, edge, x = step.exits.roots(sides, modes, begin, step.h[which], a, which)
    walk.aim[who], walk.goal[who], walk.tries[who] = switch, edge, 0
    walk.last[who], walk.fresh[who], walk.planned[who] = False, True, 0
    at_once = x * step.h[which] <= AT_ONCE * walk.end[who]
    walk.h[who] = np.where(at_once, walk.h[who], x * walk.h[who])
    now = who[at_once]
    if len(now):
        own, border = switch[at_once], edge[at_once]
        changed = walk.modes[:, now]
        changed[own, np.arange(len(now))] = _beyond(walk.modes[own, now], border)
        walk.edge[own, now] = border
        walk.aim[now] = -1
        _turn(walk, now, changed)


def _beyond(mode: Floats, edge: Floats) -> Floats:
    """Return the mode on the other side of an edge."""
    return np.where(mode < edge, edge, edge - 1.0)


def _close_in(walk: Walk, step: Step, closes: Flags, over: Floats) -> Flags:
    """Correct steps that are to end at a switch; return which do."""
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


def _accept(walk: Walk, log: Log, step: Step, taken: Flags, ends: Flags) -> None:
    """Go on by the steps that were taken; `ends` says which of them end at a switch."""
    if not taken.any():
        return
    who, h, a = step.who[taken], step.h[taken], of(step.a, np.flatnonzero(taken))
    log.keep(walk, who, h, a)
    first, second = _whole()
    u, v = of(walk.u, who), of(walk.v, who)
    changes = h * v + h * h * summed(second, a)[:, 0], h * summed(first, a)[:, 0]
    walk.u[:, who], walk.lost[0][:, who] = added(u, changes[0], walk.lost[0][:, who])
    walk.v[:, who], walk.lost[1][:, who] = added(v, changes[1], walk.lost[1][:, who])
    walk.t[who], walk.t_lost[who] = added(walk.t[who], h, walk.t_lost[who])
    walk.taken[who] += 1
    walk.edge[:, who] = np.nan
    walk.guess[..., who] = summed(_ahead(), a)
    walk.fresh[who] = False
    _finish(walk, log, who[walk.last[who] & ~ends[taken]])
    of_piece = ends[taken]
    _change(walk, log, step, np.flatnonzero(taken)[of_piece])
    on = who[~of_piece]
    on = on[walk.going[on]]
    before = walk.h[on]
    walk.planned[on] = np.maximum(walk.planned[on] - 1, 0)
    next_length(walk, on)
    # a guess is for a step of the same length
    walk.fresh[on] |= np.abs(walk.h[on] - before) > 1e-6 * before


@cache
def _ahead() -> Floats:
    """Return the coefficients by which the stages of a step tell those of an equal one behind it."""
    return basis(1.0 + tableau().c)


@cache
def _whole() -> tuple[Floats, Floats]:
    return integrals(np.ones(1))


def _finish(walk: Walk, log: Log, who: Ints) -> None:
    walk.t[who] = walk.end[who]
    walk.going[who] = False
    for case in who:
        log.ends[case].append((walk.end[case], -1, 0.0, int(walk.taken[case])))


def _change(walk: Walk, log: Log, step: Step, which: Ints) -> None:
    """Change the modes of switches at which steps have ended, and begin new pieces."""
    if not len(which):
        return
    who = step.who[which]
    own, edge = walk.aim[who], walk.goal[who]
    for case, switch, border in zip(who, own, edge, strict=True):
        row = (float(walk.t[case]), int(switch), float(border), int(walk.taken[case]))
        log.ends[case].append(row)
    walk.modes[own, who] = _beyond(walk.modes[own, who], edge)
    walk.edge[own, who] = edge
    settle(walk, who, step.exits.size[:, which], own)
    walk.piece[who] += 1
    over = walk.t[who] >= walk.end[who] * (1.0 - AT_ONCE)
    _finish(walk, log, who[over])
    plan_piece(walk, who[~over])
