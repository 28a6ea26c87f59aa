"""The loop over members and steps, written once for every scheme, model and lane.

`run` takes the functions of the scheme and the model as its first arguments; `vibsim.engine.kernel` binds them, and
compiles the same text for the compiled lanes.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.gather import (
    bottom_of,
    next_extrema,
    note_extrema,
    note_peak,
    note_trough,
    note_turn,
)

OVERFLOW = 1e150
"""A member that grows beyond has failed: its energy could no longer be stored."""

END_RULES = {"kick": 0, "extrapolate": 1, "backward": 2}
"""Velocity at the last point: the scheme's own, linear extrapolation, one-sided difference."""


def run(
    start: Any,
    step: Any,
    backward: Any,
    acceleration: Any,
    energies: Any,
    parameters_of: Any,
    parameters: Any,
    initial: Any,
    dt: Any,
    steps: int,
    every: int,
    first_order: bool,
    end_rule: int,
    turn: float,
    samples: Any,
    stats: Any,
    counts: Any,
) -> None:
    """Step every member of one scheme, and fill `samples`, `stats` and `counts`.

    Parameters
    ----------
    start, step, backward
        The scheme (see `vibsim.schemes.base.Stepper`).
    acceleration, energies, parameters_of
        The model: ``acceleration(u, v, t, p)``; ``energies(u, v, t, p)``, kinetic and potential;
        ``parameters_of(parameters, case)``, the tuple p.
    parameters, initial, dt
        Shapes (case, n_parameters), (case, 2) with position and velocity, and (case,).
    steps, every
        Number of steps; a sample is stored at each multiple of `every`, which divides `steps`.
    first_order
        Whether the first-order start is taken.
    end_rule
        One of `END_RULES`.
    turn
        Angle of a whole turn; 0 where the position is no angle.
    samples
        Shape (4, case, n_samples), filled with NaN: position, velocity, kinetic and potential energy.
    stats
        Shape (case, 15), filled with NaN: `vibsim.engine.gather.STATS`.
    counts
        Shape (case, 3), filled with zeros: `vibsim.engine.gather.COUNTS`.
    """
    for case in range(len(dt)):
        h = float(dt[case])
        p = parameters_of(parameters, case)
        u = float(initial[case, 0])
        v = float(initial[case, 1])
        kinetic, potential = energies(u, v, 0.0, p)
        energy_0 = kinetic + potential
        samples[0, case, 0] = u
        samples[1, case, 0] = v
        samples[2, case, 0] = kinetic
        samples[3, case, 0] = potential
        extrema = (u, u, v, v, 0.0)
        bottom = bottom_of(u, turn) if turn > 0.0 else 0.0
        if v == 0.0:
            stats[case, 12] = u
        state = start(first_order, u, v, h, p, acceleration)
        interior = 0.0
        good = 0
        sample = 1
        due = every
        v_before = v
        for n in range(1, steps + 1):
            t = n * h
            u_before, v_two_before, v_before = u, v_before, v
            u = state[0]
            if n < steps or end_rule == 0:
                state, v = step(state, t, h, p, acceleration)
            elif end_rule == 1:
                v = 2.0 * v_before - v_two_before
            else:
                v = backward(state, h)
            # written so that NaN fails as well
            if not abs(u) + abs(v) < OVERFLOW:
                break
            good = n
            kinetic, potential = energies(u, v, t, p)
            interior = extrema[4]
            extrema = next_extrema(extrema, u, v, (kinetic + potential) - energy_0)
            if v_before >= 0.0 and v < 0.0:
                note_peak(stats, counts, case, t, h, u_before, v_before, u, v)
            if v_before <= 0.0 and v > 0.0:
                note_trough(stats, case, h, u_before, v_before, v)
            if turn > 0.0 and abs(u - bottom) > 0.5 * turn:
                ahead = turn if u > bottom else -turn
                note_turn(stats, counts, case, t, h, ahead, bottom, u_before, u)
                bottom += ahead
            if n == due:
                samples[0, case, sample] = u
                samples[1, case, sample] = v
                samples[2, case, sample] = kinetic
                samples[3, case, sample] = potential
                sample += 1
                due += every
        note_extrema(stats, case, extrema, interior)
        counts[case, 2] = good
