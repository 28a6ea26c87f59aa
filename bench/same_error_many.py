"""Many trajectories to the same error, one thread."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from bench.ladder import LADDERS
from bench.page import Section, table
from bench.peers import Contestant, compete
from bench.same_error import END, TOLERANCES, WANTED, header, ratio, rows, write_problem

TITLE = "Many trajectories, same error"
ANSWER = (
    "For many trajectories the ladder is {0[many_error.increment_faster_than_solve_ivp]:.0f} times faster than a loop "
    "over SciPy's `solve_ivp`, and {0[many_error.increment_faster_than_heyoka]:.2f} times as fast as heyoka."
)
TOLERANCES_FROM = TOLERANCES[8:]
"""From 1e-9: what is looser does not do for swings of 2.5."""

LOOP, NUMBALSODA, HEYOKA = "solve_ivp loop, DOP853", "numbalsoda loop", "heyoka, batches"
INCREMENT, COMPENSATED = "ladder, increment", "ladder, compensated"


def run(small: bool) -> Section:
    """Tune and time all of them."""
    members, mapped, rounds = (256, 64, 2) if small else (10_000, 1000, 5)
    contestants = (
        Contestant("solvers:dop853", LOOP, TOLERANCES_FROM, measured_on=20),
        Contestant("solvers:diffrax", "diffrax, vmap", TOLERANCES_FROM, True, measured_on=mapped),
        Contestant("solvers:numbalsoda", NUMBALSODA, TOLERANCES_FROM, True),
        Contestant("solvers:heyoka_batch", HEYOKA, TOLERANCES_FROM, True),
        Contestant("ladder:increment", INCREMENT, LADDERS),
        Contestant("ladder:compensated", COMPENSATED, LADDERS),
        Contestant(
            "ladder:increment_by_hand", "its levels and a plain tableau, increment", LADDERS
        ),
        Contestant("ladder:compensated_by_hand", "the same, compensated", LADDERS),
    )
    with tempfile.TemporaryDirectory() as folder:
        problem = write_problem(Path(folder), np.linspace(0.1, 2.5, members), tuned_on=16)
        found = compete(contestants, problem, rounds, 0.01 if small else 0.1)
    caption = (
        f"{members} pendulums, theta_0 from 0.1 to 2.5, one core: every theta at t = {END:g} within {WANTED:g}. "
        "Settings are sought on 16 members and proved on those that are timed: all, but 20 for the loop over "
        f"solve_ivp and {mapped} for diffrax. All members have the same ladder."
    )
    names = (LOOP, NUMBALSODA, HEYOKA)
    lines = table(caption, header("us per member", names), rows(found, 1e6, names))
    figures = {
        f"many_error.{name}_faster_than_{short}": ratio(found, other, of)
        for name, of in (("increment", INCREMENT), ("compensated", COMPENSATED))
        for short, other in (("solve_ivp", LOOP), ("numbalsoda", NUMBALSODA), ("heyoka", HEYOKA))
    }
    return Section(tuple(lines), figures)
