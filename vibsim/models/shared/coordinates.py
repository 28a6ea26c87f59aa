"""Coordinates that a user names: which names are free, their velocities, and which of them are angles."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterator, Sequence

from vibsim.core.vocabulary import VECTORS
from vibsim.formula import CONSTANTS, FUNCTIONS, Binary, Call, Name
from vibsim.formula.tree import walk
from vibsim.models.base import BUDGET, ENERGIES, Model, State, tree

MOST = 64
"""Largest number of coordinates."""
NUMBERS = (
    *("period", "amplitude", "frequency", "growth_per_period", "relative_energy_error"),
    *("peak", "trough", "scalar", "theory", "measured", "work", "energy_drift", "check"),
)
"""Prefixes of names of variables in results, beside the energies."""
SECTIONS = ("initial", "model", "schemes", "time")
"""Prefixes of names of swept values."""
TAKEN = frozenset(
    """
    t scheme case decay_rate level pair triple norm norm_seconds check steps dt end index extremum size_over
    first_peak last_peak status last_step failure_time natural_frequency omega_dt
    highest_omega_dt stability_limit size_over_exact force_evaluations_total accepted_steps
    exact_period
    """.split()  # noqa: SIM905
)
"""Other reserved names: variables of results, and names that would make one together with a suffix of results."""


def velocities_of(coordinates: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the velocities."""
    return ("v",) if coordinates == ("u",) else tuple(f"v{name}" for name in coordinates)


def states_of(coordinates: tuple[str, ...], word: str) -> tuple[State, ...]:
    """Return the states of coordinates without units; `word` says what they are."""
    positions = (State(name, "1", word) for name in coordinates)
    return (*positions, *(State(name, "1", "velocity") for name in velocities_of(coordinates)))


def name_fault(name: str, others: tuple[str, ...] = ()) -> str:
    """Return why a name cannot name a coordinate, a velocity or an output beside `others`; empty if it can."""
    if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        return "must consist of letters, digits and _, and begin with a letter"
    if keyword.iskeyword(name):
        return f"'{name}' is a word of the grammar of formulas and cannot be a name"
    if name in FUNCTIONS or name in CONSTANTS:
        return f"'{name}' is a {'function' if name in FUNCTIONS else 'constant'} of formulas"
    stored = (*ENERGIES, *BUDGET, *VECTORS, *NUMBERS)
    if name in TAKEN or name in stored or name in others:
        return f"'{name}' has another meaning already, in formulas or in results"
    pairs = [*((name, of) for of in (*stored, *SECTIONS, *others)), *((of, name) for of in others)]
    for longer, shorter in pairs:
        if longer.startswith(f"{shorter}_"):
            return f"'{longer}' is what results may call something of '{shorter}'"
    return ""


def coordinate_faults(coordinates: Sequence[str]) -> Iterator[str]:
    """Yield for each name why it cannot name a coordinate beside those before it; empty if it can."""
    before: list[str] = []
    for name in coordinates:
        velocity = velocities_of(tuple(coordinates) if len(coordinates) == 1 else (name, ""))[0]
        fault = name_fault(name, tuple(before))
        yield fault or name_fault(velocity, (*before, name))
        before += [name, velocity]


def angles(model: Model) -> Iterator[str]:
    """Yield the coordinates whose sine or cosine, or that of a sum of two, is in the equation: angles."""
    for formula in model.accelerations:
        for node in walk(tree(model, formula)):
            if isinstance(node, Call) and node.function in ("sin", "cos"):
                (angle,) = node.arguments
                is_sum = isinstance(angle, Binary) and angle.operator in "+-"
                sides = angle.operands if is_sum else (angle,)
                yield from (side.name for side in sides if isinstance(side, Name))
