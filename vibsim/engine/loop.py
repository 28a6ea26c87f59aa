"""The loop over members and steps, written once for every scheme, model and lane.

`run` takes the functions of the scheme and the model as its first arguments; `vibsim.engine.kernel` binds them, and
compiles the same text for the compiled lanes.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.gather import (
    LAST_STEP,
    bottom_of,
    next_extrema,
    note_extrema,
    note_peak,
    note_trough,
    note_turn,
)

OVERFLOW = 1e150
"""A member that grows beyond has failed: its energy could no longer be stored."""


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
    variant: int,
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
    variant
        Which of its starts the scheme takes.
    end_rule
        Velocity at the last point: index into `vibsim.schemes.base.END_RULES`.
    turn
        Angle of a whole turn; 0 where the position is no angle.
    samples
        Shape (4, case, n_samples), filled with NaN: position, velocity, kinetic and potential energy.
    stats
        Shape (case, `N_STATS`), filled with NaN: columns of `vibsim.engine.gather`.
    counts
        Shape (case, `N_COUNTS`), filled with zeros: columns of `vibsim.engine.gather`.
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
        state = start(variant, u, v, h, p, acceleration)
        interior = 0.0
        good = 0
        sample = 1
        due = every
        v_before = v
        for n in range(1, steps + 1):
            t = n * h
            u_before, v_two_before, v_before = u, v_before, v
            u = state[0]
            following, own = step(state, t, h, p, acceleration)
            v = own
            if n == steps:
                if end_rule == 1:
                    v = 2.0 * v_before - v_two_before
                elif end_rule == 2:
                    v = backward(state, h)
            state = following
            # written so that NaN fails as well
            if not abs(u) + abs(v) < OVERFLOW:
                break
            good = n
            kinetic, potential = energies(u, v, t, p)
            interior = extrema[4]
            extrema = next_extrema(extrema, u, v, (kinetic + potential) - energy_0)
            # the scheme's own velocity: an end formula would move a peak in the last step
            if v_before >= 0.0 and own < 0.0:
                note_peak(stats, counts, case, t, h, u_before, v_before, u, own)
            if v_before <= 0.0 and own > 0.0:
                note_trough(stats, case, h, u_before, v_before, own)
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
        counts[case, LAST_STEP] = good
