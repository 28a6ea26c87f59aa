"""Whether a sum of formulas is 0 for all states, by numbers: equal functions may have different formulas.

A formula with corners or jumps is tested on every side of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.formula import Switch, held, values, values_of
from vibsim.models.table import HEIGHT

TESTS = 24
"""Number of random points at which formulas are compared."""
REACHES = (1.0, 10.0, 100.0, 1000.0, 10000.0)
"""Sizes of states that are tried, from the least, to reach all sides of corners and jumps. [convention]"""
TRIED = 2**12
"""Number of states of each size that are tried."""
MOST_SIDES = 2**8
"""Largest number of combinations of sides that are tested."""
AGREE = 1e-9
"""Largest difference of equal formulas, relative to the size of their terms."""
NEAR_ONE = (0.3, 1.7)
"""Least and largest number for a name without a size of its own."""


def zeros(terms: Any, states: Sequence[str], others: Mapping[str, tuple[float, float]]) -> Flags:
    """Tell at each test point where a sum is finite whether it is 0, shape (point,).

    `others` are the further names in the formulas, the time among them, with the least and the largest number of each.
    """
    formulas, switches = held(terms, (*states, "t", HEIGHT))
    if not formulas:
        return np.ones(1, dtype=bool)
    points = _test_points(states, others, switches)
    found = [np.broadcast_to(x, points["t"].shape) for x in values_of(formulas, points)]
    total, size = np.sum(found, axis=0), np.sum(np.abs(found), axis=0)
    known = np.isfinite(total)
    return np.asarray(np.abs(total[known]) <= AGREE * size[known])


def _test_points(
    states: Sequence[str], others: Mapping[str, tuple[float, float]], switches: Sequence[Switch]
) -> dict[str, Floats]:
    """Return random states, other numbers and modes of switches, with all combinations of modes that are found.

    A mode that depends on the time is random, because a pulse may be too short to be found.
    """
    rng = np.random.default_rng(21)
    near = {name: rng.uniform(-1.0, 1.0, TESTS) for name in states}
    near |= {name: rng.uniform(*ends, TESTS) for name, ends in others.items()}
    if not switches:
        return near
    size = np.repeat(REACHES, TRIED)
    far = {name: size * rng.uniform(-1.0, 1.0, len(size)) for name in states}
    far |= {name: rng.uniform(*ends, len(size)) for name, ends in others.items()}
    numbers = {name: np.concatenate([near[name], far[name]]) for name in near}
    random, modes = {"t", HEIGHT}, []
    for switch in switches:
        if random.isdisjoint(switch.quantity.names):
            q = np.broadcast_to(values(switch.quantity, numbers), TESTS + len(size))
            mode = np.floor(q) if switch.whole else np.where(q > 0.0, 0.0, -1.0)
        else:
            random.add(switch.mode)
            mode = rng.integers(-2 if switch.whole else -1, 1, TESTS + len(size)).astype(float)
        numbers[switch.mode] = mode
        modes.append(np.clip(mode, -2.0, 1.0))
    # the first point with each combination of modes, beside the points that every formula has
    _, first = np.unique(np.stack(modes), axis=1, return_index=True)
    chosen = np.union1d(np.arange(TESTS), np.sort(first)[:MOST_SIDES])
    return {name: number[chosen] for name, number in numbers.items()}
