r"""Motions whose force has corners or jumps, by collocation from one to the next: every piece has a smooth force.

Within a piece the modes of all switches are held (`vibsim.simulation.sides`), so that stages behind its end see the
smooth continuation of its force. A step in which a switch leaves its mode is taken again with the length that ends
there: Newton's method on the polynomial of the step, until the length no longer changes. There the mode changes and
a new piece begins. A switch that is at the border of two modes has the mode into which the motion goes; where each
leads into the other (dry friction that holds) there is no such motion.

A first walk finds the pieces, in steps of at most a given length. Every other one has twice as many equal steps in
each piece as the one before it, so that the difference of two walks tells the error of the latter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.simulation.collocation import (
    STAGES,
    Floats,
    added,
    basis,
    integrals,
    stages,
    summed,
    tableau,
)
from vibsim.simulation.exits import Exits, find_exits, overshoot
from vibsim.simulation.sides import Sides

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

MOST_ATTEMPTS = 2**13
"""Steps that are tried, at most, of every member."""
SHORTEST = 2.0**-20
"""Part of the end time below which no step is tried."""
AT_ONCE = 1e-13
"""Part of the end time within which a switch is where the step begins."""
LANDED = 2.0**-50
"""A step ends at a switch to so much of the time."""
NEARLY = 1e-11
"""Part of the end time to which it must, where rounding allows no more."""
CLOSE = 0.02
"""Part of a step within which its end is taken for the root that is sought."""
TRIES, MOST_TRIES = 5, 12
OPEN, SLIDING, ENDLESS = range(3)
"""Nothing is against an end; a force holds the member at a jump; there are more corners than can be gone through."""
LINEAR = 1e-9
"""A quantity is linear in time that is half-way at half the time, to so much of its change."""
TIED = 1e-12
"""A switch is at a border to so much of its largest value in the step before."""


@dataclass(frozen=True)
class Plan:
    """The pieces of a walk: their ends, what ends them, and their numbers of steps; shape (piece, case)."""

    end: Floats
    switch: Ints
    """Index of the switch, -1 for the end of the motion."""
    edge: Floats
    """Value of its quantity there."""
    steps: Ints


@dataclass(frozen=True)
class Walk:
    """Where the members are; arrays that change as they go on."""

    sides: Sides
    timed: tuple[int, ...]
    """The switches that look at the time alone."""
    end: Floats
    longest: Floats
    plan: Plan | None
    t: Floats
    u: Floats
    """Shape (coordinate, case)."""
    v: Floats
    lost: Floats
    """What the rounding of u and v has lost, shape (2, coordinate, case)."""
    t_lost: Floats
    modes: Floats
    """Shape (switch, case)."""
    edge: Floats
    """Value at whose border a switch is, NaN elsewhere, shape (switch, case)."""
    h: Floats
    """Length of the step that is tried next."""
    last: Flags
    """Whether it ends the motion."""
    aim: Ints
    """The switch at which it is to end; -1 for none."""
    goal: Floats
    """Value of the quantity of that switch there."""
    guess: Floats
    """Of the accelerations at its stages, shape (coordinate, stage, case)."""
    fresh: Flags
    """Whether there is no guess but the acceleration where it begins."""
    tries: Ints
    turns: Ints
    """Changes of modes since the last step."""
    piece: Ints
    taken: Ints
    """Steps of the piece so far."""
    planned: Ints
    """Steps of it that are left in the plan, 0 where there is none."""
    going: Flags
    sliding: Flags
    """Whether a member ended where a force holds it at a jump."""


@dataclass(frozen=True)
class Step:
    """A step that was tried, of the members `who`."""

    who: Ints
    h: Floats
    a: Floats
    exits: Exits


@dataclass(frozen=True)
class Pieces:
    """A solution by steps of different lengths; NaN behind the last one of a member, and for those without an end."""

    end: Floats
    begin: Floats
    """Start of every step, shape (step, case)."""
    length: Floats
    position: Floats
    """Shape (step, coordinate, case)."""
    velocity: Floats
    acceleration: Floats
    """Shape (step, coordinate, stage, case)."""

    def at(self, fraction: Floats) -> Floats:
        """Return all positions and then all velocities at fractions of the end time, shape (state, case, time)."""
        count = self.position.shape[1]
        found = np.full((2 * count, len(self.end), len(fraction)), np.nan)
        for case, end in enumerate(self.end):
            known = int(np.sum(np.isfinite(self.length[:, case])))
            if known:
                self._put(case, fraction * end, known, found[:, case])
        return found

    def _put(self, case: int, times: Floats, known: int, found: Floats) -> None:
        """Work the states of one member out, some times at a time."""
        begin, count = self.begin[:known, case], len(found) // 2
        for first in range(0, len(times), 4096):
            t = times[first : first + 4096]
            step = np.maximum(np.searchsorted(begin, t, side="right") - 1, 0)
            h = self.length[step, case]
            x = (t - begin[step]) / h
            once, twice = integrals(x)
            v = self.velocity[step, :, case].T
            u = self.position[step, :, case].T + h * x * v
            for j in range(STAGES):
                a = self.acceleration[step, :, j, case].T
                v = v + h * (once[:, j] * a)
                u = u + h * h * (twice[:, j] * a)
            found[:count, first : first + 4096] = u
            found[count:, first : first + 4096] = v

    def of(self, members: Flags) -> Pieces:
        """Return the solutions of some members."""
        return Pieces(
            self.end[members],
            self.begin[:, members],
            self.length[:, members],
            self.position[..., members],
            self.velocity[..., members],
            self.acceleration[..., members],
        )


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
    walk = _begin(sides, start, end, longest, plan)
    log = _Log([], [[] for _ in end], np.zeros(len(end), dtype=np.int64))
    for _ in range(MOST_ATTEMPTS):
        who = np.flatnonzero(walk.going)
        if not len(who):
            break
        _go_on(walk, log, _try(walk, who))
    arrived = walk.t >= end * (1.0 - AT_ONCE)
    ends = np.where(walk.going, ENDLESS, np.where(walk.sliding, SLIDING, OPEN))
    return log.pieces(walk, arrived), log.plan(arrived), ends


def _begin(sides: Sides, start: Floats, end: Floats, longest: Floats, plan: Plan | None) -> Walk:
    u, v = np.array(np.split(start, 2))
    cases, switches = len(end), len(sides.switches)
    whole = np.zeros(cases, dtype=np.int64)
    no = np.zeros(cases, dtype=bool)
    walk = Walk(
        sides=sides, timed=sides.timed, end=end, longest=longest, plan=plan,
        t=np.zeros(cases), u=u, v=v, lost=np.zeros((2, *u.shape)), t_lost=np.zeros(cases),
        modes=np.zeros((switches, cases)), edge=np.full((switches, cases), np.nan),
        h=np.zeros(cases), last=no.copy(), aim=whole - 1, goal=np.zeros(cases),
        guess=np.zeros((len(u), STAGES, cases)), fresh=~no, tries=whole.copy(), turns=whole.copy(),
        piece=whole.copy(), taken=whole.copy(), planned=whole.copy(), going=~no, sliding=no.copy(),
    )  # fmt: skip
    everyone = np.arange(cases)
    _settle(walk, everyone, np.zeros((switches, cases)), whole - 1)
    _plan_piece(walk, everyone)
    return walk


def _of(numbers: Floats, who: Ints) -> Floats:
    """Return the numbers of some members, in the order of memory in which they are computed with."""
    return np.take(numbers, who, axis=-1)


def _settle(walk: Walk, who: Ints, size: Floats, fired: Ints) -> None:
    """Set the modes of all switches where a piece begins; those at a border keep theirs until the step tells.

    Parameters
    ----------
    size
        Largest value of each quantity in the step before, shape (switch, case).
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
        own = fired == k
        modes[k] = np.where(own | (tied & keeps), modes[k], np.where(tied, border, free))
        edge[k] = np.where(own, edge[k], np.where(tied, border, np.nan))
    walk.modes[:, who], walk.edge[:, who] = modes, edge


def _plan_piece(walk: Walk, who: Ints) -> None:
    """Choose the first step of a piece."""
    walk.taken[who] = 0
    walk.planned[who] = 0
    walk.fresh[who] = True
    if walk.plan is not None:
        inside = walk.piece[who] < len(walk.plan.end)
        known = who[inside]
        walk.planned[known] = 2 * walk.plan.steps[walk.piece[known], known]
    _next_length(walk, who)


def _next_length(walk: Walk, who: Ints) -> None:
    """Choose the length of the next step: of a planned piece, an equal part of what is left of it."""
    rest = walk.end[who] - walk.t[who]
    walk.aim[who], walk.tries[who], walk.turns[who] = -1, 0, 0
    h = np.where(walk.h[who] > 0.0, 2.0 * walk.h[who], np.inf)
    h = np.minimum(h, walk.longest[who])
    left = walk.planned[who]
    if walk.plan is not None:
        row = np.minimum(walk.piece[who], len(walk.plan.end) - 1)
        way = walk.plan.end[row, who] - walk.t[who]
        ahead = (left > 0) & (way > 0.0)
        h = np.where(ahead, way / np.maximum(left, 1), h)
        ends = ahead & (left == 1)
        walk.aim[who] = np.where(ends, walk.plan.switch[row, who], -1)
        walk.goal[who] = np.where(ends, walk.plan.edge[row, who], 0.0)
    last = (h >= rest * (1.0 - 1e-6)) & (walk.aim[who] < 0)
    walk.last[who] = last
    walk.h[who] = np.where(last, rest, h)
    _meet_known(walk, who[walk.planned[who] == 0])


def _meet_known(walk: Walk, who: Ints) -> None:
    """Let steps end where a switch that is linear in time will leave its mode: that is known before."""
    sides, modes, t = walk.sides.of(who), _of(walk.modes, who), walk.t[who]
    for k in walk.timed if len(who) else ():
        h = walk.h[who]
        still = _of(walk.u, who), _of(walk.v, who)
        q, half, ahead = (sides.quantity(k, modes, *still, t + x * h) for x in (0.0, 0.5, 1.0))
        rate = ahead - q
        linear = (np.abs(half - q - 0.5 * rate) <= LINEAR * np.abs(rate)) & (rate != 0.0)
        low = modes[k] if sides.whole[k] else np.where(modes[k] < 0.0, -np.inf, 0.0)
        high = low + 1.0 if sides.whole[k] else np.where(modes[k] < 0.0, 0.0, np.inf)
        goal = np.where(rate > 0.0, high, low)
        x = (goal - q) / rate
        meets = linear & (x > AT_ONCE) & (x < 1.0)
        now = who[meets]
        walk.h[now] = (x * h)[meets]
        walk.aim[now], walk.goal[now], walk.last[now] = k, goal[meets], False


def _try(walk: Walk, who: Ints) -> Step:
    """Take a step of every member in `who`, and look where switches leave their modes."""
    sides, h, modes = walk.sides.of(who), walk.h[who], _of(walk.modes, who)
    u, v, t = _of(walk.u, who), _of(walk.v, who), walk.t[who]
    force = sides.force(modes)
    guess, fresh = _of(walk.guess, who), walk.fresh[who]
    if fresh.any():
        guess = np.where(fresh, force(u[:, None], v[:, None], t[None]), guess)
    a = stages(force, u, v, t + tableau().c[:, None] * h, h, guess)
    exits = find_exits(sides, modes, _of(walk.edge, who), (u, v, t), h, a)
    return Step(who, h, a, exits)


def _go_on(walk: Walk, log: _Log, step: Step) -> None:
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


def _accept(walk: Walk, log: _Log, step: Step, taken: Flags, ends: Flags) -> None:
    """Go on by the steps that were taken; `ends` says which of them end at a switch."""
    if not taken.any():
        return
    who, h, a = step.who[taken], step.h[taken], _of(step.a, np.flatnonzero(taken))
    log.keep(walk, who, h, a)
    first, second = _whole()
    u, v = _of(walk.u, who), _of(walk.v, who)
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
    _next_length(walk, on)
    # a guess is for a step of the same length
    walk.fresh[on] |= np.abs(walk.h[on] - before) > 1e-6 * before


@cache
def _ahead() -> Floats:
    """Return the coefficients by which the stages of a step tell those of an equal one behind it."""
    return basis(1.0 + tableau().c)


@cache
def _whole() -> tuple[Floats, Floats]:
    return integrals(np.ones(1))


def _finish(walk: Walk, log: _Log, who: Ints) -> None:
    walk.t[who] = walk.end[who]
    walk.going[who] = False
    for case in who:
        log.ends[case].append((walk.end[case], -1, 0.0, int(walk.taken[case])))


def _change(walk: Walk, log: _Log, step: Step, which: Ints) -> None:
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
    _settle(walk, who, step.exits.size[:, which], own)
    walk.piece[who] += 1
    over = walk.t[who] >= walk.end[who] * (1.0 - AT_ONCE)
    _finish(walk, log, who[over])
    _plan_piece(walk, who[~over])


@dataclass(frozen=True)
class _Log:
    """The steps that were taken, and the ends of pieces."""

    steps: list[tuple[Any, ...]]
    ends: list[list[tuple[float, int, float, int]]]
    count: Ints

    def keep(self, walk: Walk, who: Ints, h: Floats, a: Floats) -> None:
        """Add a step of some members."""
        row = (who, self.count[who], walk.t[who], h, walk.u[:, who], walk.v[:, who], a)
        self.steps.append(row)
        self.count[who] += 1

    def pieces(self, walk: Walk, arrived: Flags) -> Pieces:
        """Return the solution."""
        count, cases = walk.u.shape
        most = int(self.count.max(initial=0))
        begin, length = np.full((most, cases), np.nan), np.full((most, cases), np.nan)
        states = np.full((2, most, count, cases), np.nan)
        inner = np.full((most, count, STAGES, cases), np.nan)
        for who, row, t, h, u, v, a in self.steps:
            begin[row, who], length[row, who] = t, h
            states[0, row, :, who], states[1, row, :, who] = u.T, v.T
            inner[row, :, :, who] = np.moveaxis(a, -1, 0)
        length[:, ~arrived] = np.nan
        return Pieces(walk.end, begin, length, states[0], states[1], inner)

    def plan(self, arrived: Flags) -> Plan:
        """Return the pieces, without steps for members that did not arrive."""
        kept = [rows if is_there else [] for rows, is_there in zip(self.ends, arrived, strict=True)]
        shape = max((len(rows) for rows in kept), default=0) or 1, len(kept)
        plan = Plan(
            np.zeros(shape), np.full(shape, -1), np.zeros(shape), np.zeros(shape, dtype=np.int64)
        )
        for case, rows in enumerate(kept):
            for k, (end, switch, edge, steps) in enumerate(rows):
                plan.end[k, case], plan.switch[k, case] = end, switch
                plan.edge[k, case], plan.steps[k, case] = edge, steps
        return plan


def planned(plan: Plan, members: Flags) -> Plan:
    """Return the plan of some members."""
    return Plan(*(field[:, members] for field in _fields(plan)))


def _fields(plan: Plan) -> Iterator[Any]:
    yield from (plan.end, plan.switch, plan.edge, plan.steps)
