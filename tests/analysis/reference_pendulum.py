"""Ladders of the pendulum from an integrator of their own, independent of the engine."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@numba.njit
def centred(theta_0, end, steps, every, three_term, first, backward):  # type: ignore[no-untyped-def]
    """Step theta'' = -sin theta from rest by centred differences (pendulum lecture, (7)-(11))."""
    dt = end / steps
    theta, omega = np.zeros(steps // every + 1), np.zeros(steps // every + 1)
    d = 0.0 if first else -0.5 * dt * dt * math.sin(theta_0)
    before, now, v_before, v = theta_0, theta_0 + d, 0.0, 0.0
    theta[0] = theta_0
    for n in range(1, steps + 1):
        kick = -dt * dt * math.sin(now)
        after = 2.0 * now - before + kick if three_term else now + (d + kick)
        v_next = (after - before if three_term else 2.0 * d + kick) / (2.0 * dt)
        if n == steps:
            v_next = d / dt if backward else 2.0 * v - v_before
        if n % every == 0:
            theta[n // every], omega[n // every] = now, v_next
        before, now, d = now, after, d + kick
        v_before, v = v, v_next
    return theta, omega


@functools.cache
def _run(theta_0: float, level: int, every: int, *flags: bool) -> tuple[Floats, Floats]:
    theta, omega = centred(theta_0, 20.0, 2**level, every, *flags)
    return theta, omega


def pendulum(
    levels: Sequence[int], quantity: str, theta_0: float = 1.0, **options: Any
) -> list[Floats]:
    """Return a quantity per level, on 65 common times from 0 to 20; levels from 6 on."""
    fields = []
    for level in levels:
        flags = (options.get(name, False) for name in ("three_term", "first", "backward"))
        theta, omega = _run(theta_0, level, 2 ** (level - 6), *flags)
        energy = 0.5 * omega**2 + 2.0 * np.sin(0.5 * theta) ** 2
        fields.append({"theta": theta, "omega": omega, "dE": energy - energy[0]}[quantity])
    return fields
