"""Where members are on their way from corner to corner (`vibsim.simulation.reference.piecewise_collocation`), and how
long the next step is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.simulation.reference.collocation import STAGES, Floats
from vibsim.simulation.reference.one_sided_forces import Sides
from vibsim.simulation.reference.pieces import Pieces, Plan

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

AT_ONCE = 1e-13
"""Part of the end time within which a switch is where the step begins."""
LINEAR = 1e-9
"""A quantity is linear in time that is half-way at half the time, to so much of its change."""
TIED = 1e-12
"""A switch is at a border to so much of its largest value in the step before."""


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


def begin_walk(
    sides: Sides, start: Floats, end: Floats, longest: Floats, plan: Plan | None
) -> Walk:
    """Return the members at the start, with their first step; see
    `vibsim.simulation.reference.piecewise_collocation.walk_pieces`.
    """
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
    settle(walk, everyone, np.zeros((switches, cases)), whole - 1)
    plan_piece(walk, everyone)
    return walk


def of(numbers: Floats, who: Ints) -> Floats:
    """Return the numbers of some members, in the order of memory in which they are computed with."""
    return np.take(numbers, who, axis=-1)


def settle(walk: Walk, who: Ints, size: Floats, fired: Ints) -> None:
    """Set the modes of all switches where a piece begins; those at a border keep theirs until the step tells.

    Parameters
    ----------
    size
        Largest value of each quantity in the step before, shape (switch, case).
    fired
        The switch whose mode has just changed, -1 for none.
    """
    sides, modes, edge = walk.sides.of(who), of(walk.modes, who), of(walk.edge, who)
    u, v, t = of(walk.u, who), of(walk.v, who), walk.t[who]
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


def plan_piece(walk: Walk, who: Ints) -> None:
    """Choose the first step of a piece."""
    walk.taken[who] = 0
    walk.planned[who] = 0
    walk.fresh[who] = True
    if walk.plan is not None:
        inside = walk.piece[who] < len(walk.plan.end)
        known = who[inside]
        walk.planned[known] = 2 * walk.plan.steps[walk.piece[known], known]
    next_length(walk, who)


def next_length(walk: Walk, who: Ints) -> None:
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
    sides, modes, t = walk.sides.of(who), of(walk.modes, who), walk.t[who]
    for k in walk.timed if len(who) else ():
        h = walk.h[who]
        still = of(walk.u, who), of(walk.v, who)
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


@dataclass(frozen=True)
class Log:
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
