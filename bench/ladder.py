"""The ladder of levels as a solver: some levels of the scheme, extrapolated."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bench import ours
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

Floats = NDArray[np.float64]
Solve = Callable[[], Floats]


def _ladders() -> tuple[str, ...]:
    """Return ladders by their number of steps, written ``base x 2^(first..last)``."""
    found = [
        (base * (2 ** (last + 1) - 2**first), base, first, last)
        for base in (4, 5, 6, 7)
        for first in range(3, 9)
        for last in range(first + 2, first + 7)
    ]
    kept = [row for row in sorted(found) if 1000 <= row[0] <= 200_000]
    return tuple(f"{base} x 2^({first}..{last})" for _, base, first, last in kept)


LADDERS = _ladders()


def increment(theta: Floats, end: float, ladder: str) -> Solve:
    """vibsim's ladder with the arithmetic that suffices, error bounds and all."""
    return _product("increment", theta, end, ladder)


def compensated(theta: Floats, end: float, ladder: str) -> Solve:
    """The same with compensated sums."""
    return _product("compensated", theta, end, ladder)


def increment_by_hand(theta: Floats, end: float, ladder: str) -> Solve:
    """The engine's levels and Richardson's tableau, without a bound."""
    return _by_hand("increment", theta, end, ladder)


def compensated_by_hand(theta: Floats, end: float, ladder: str) -> Solve:
    """The same with compensated sums."""
    return _by_hand("compensated", theta, end, ladder)


def _steps(ladder: str) -> tuple[int, ...]:
    base, _, powers = ladder.partition(" x 2^(")
    first, _, last = powers.rstrip(")").partition("..")
    return tuple(int(base) * 2**level for level in range(int(first), int(last) + 1))


def _product(arithmetic: str, theta: Floats, end: float, ladder: str) -> Solve:
    from vibsim.ladder import Method, Start, solve

    scheme, members = SCHEMES["central"], len(theta)
    options = {**scheme.defaults(), "arithmetic": arithmetic, "end_velocity": "kick"}
    method = Method(MODELS["pendulum"], scheme, options)
    initial = np.stack([theta, np.zeros(members)], axis=-1)
    one = np.ones(members)
    start = Start(np.ones((members, len(MODELS["pendulum"].parameters))), initial, end * one, one)
    steps = _steps(ladder)
    # compiled, as the other solvers are: left alone, so little work would run uncompiled
    lane = "scalar" if members == 1 else "blocks"
    return lambda: np.asarray(solve(method, start, steps, lane=lane).position[-1])


def _by_hand(arithmetic: str, theta: Floats, end: float, ladder: str) -> Solve:
    levels = _steps(ladder)
    lane = "scalar" if len(theta) == 1 else "blocks"

    def solve() -> Floats:
        """Remove h^2, h^4, ... one after the other: the scheme is symmetric."""
        column = [
            ours.step(theta, end, n, arithmetic=arithmetic, gather=False, lane=lane).position[:, -1]
            for n in levels
        ]
        factor = 1.0
        while len(column) > 1:
            factor *= 4.0
            column = [fine + (fine - coarse) / (factor - 1.0) for coarse, fine in pairwise(column)]
        return column[0]

    return solve
