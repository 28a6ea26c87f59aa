"""Ladders of the pendulum from an integrator of their own, independent of the engine."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def _centred(
    theta_0: float,
    end: float,
    steps: int,
    every: int,
    three_term: bool,
    first: bool,
    backward: bool,
) -> tuple[Floats, Floats]:
    """Step theta'' = -sin theta from rest by centred differences (pendulum lecture, equations 7-11)."""
    dt = end / steps
    theta, omega = np.zeros(steps // every + 1), np.zeros(steps // every + 1)
    d = 0.0 if first else -0.5 * dt * dt * math.sin(theta_0)
    before, now, v_before, v = theta_0, theta_0 + d, 0.0, 0.0
    theta[0] = theta_0
    for n in range(1, steps + 1):
        kick = -dt * dt * math.sin(now)
        after = 2.0 * now - before + kick if three_term else now + (d + kick)
        v_next = (after - before) / (2.0 * dt) if three_term else (2.0 * d + kick) / (2.0 * dt)
        if n == steps:
            v_next = d / dt if backward else 2.0 * v - v_before
        if n % every == 0:
            theta[n // every], omega[n // every] = now, v_next
        before, now, d = now, after, d + kick
        v_before, v = v, v_next
    return theta, omega


compiled: Callable[..., tuple[Floats, Floats]] = numba.njit(_centred)


def pendulum(
    levels: Sequence[int], quantity: str, theta_0: float = 1.0, **options: Any
) -> list[Floats]:
    """Return a quantity on the times of the coarsest of 64 intervals or fewer, per level."""
    fields = []
    for level in levels:
        every = 2 ** (level - min(levels[0], 6))
        flags = (options.get(name, False) for name in ("three_term", "first", "backward"))
        theta, omega = compiled(theta_0, 20.0, 2**level, every, *flags)
        energy = 0.5 * omega**2 + 2.0 * np.sin(0.5 * theta) ** 2
        fields.append({"theta": theta, "omega": omega, "dE": energy - energy[0]}[quantity])
    return fields
