"""What one writes by hand with numba or numpy: the loops alone, for members that are released at rest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from bench import traced

BLOCK = 64


@njit(error_model="numpy", cache=True)
def three_term(theta: Any, g_over_l: float, h: float, steps: int, out: Any) -> None:
    """Step one member after the other with the library's sine."""
    for i in range(len(theta)):
        before = theta[i]
        u = before - 0.5 * h * h * g_over_l * math.sin(before)
        for _ in range(1, steps):
            ahead = 2.0 * u - before - h * h * g_over_l * math.sin(u)
            before = u
            u = ahead
        out[i] = u


sine = njit(error_model="numpy", inline="always")(traced.fast_sine())
"""The engine's sine without branches, for arguments up to 1e5."""


def simd(contract: bool) -> Any:
    """Return compensated stepping with members as the inner loop, in blocks; strict, or with contraction."""
    fast: Any = {"contract"} if contract else False

    @njit(error_model="numpy", fastmath=fast)
    def run(theta: Any, g_over_l: float, h: float, steps: int, out: Any) -> None:
        u, d = np.empty(BLOCK), np.empty(BLOCK)
        u_rest, d_rest = np.empty(BLOCK), np.empty(BLOCK)
        for first in range(0, len(theta), BLOCK):
            for i in range(BLOCK):
                kick = 0.5 * (h * h) * (-g_over_l * sine(theta[first + i]))
                d[i] = kick
                d_rest[i] = 0.0
                u[i] = theta[first + i] + kick
                part = u[i] - theta[first + i]
                u_rest[i] = (theta[first + i] - (u[i] - part)) + (kick - part)
            for _ in range(1, steps):
                for i in range(BLOCK):
                    kick = (h * h) * (-g_over_l * sine(u[i])) + d_rest[i]
                    ahead = d[i] + kick
                    part = ahead - d[i]
                    d_rest[i] = (d[i] - (ahead - part)) + (kick - part)
                    d[i] = ahead
                    drift = ahead + u_rest[i]
                    ahead = u[i] + drift
                    part = ahead - u[i]
                    u_rest[i] = (u[i] - (ahead - part)) + (drift - part)
                    u[i] = ahead
            for i in range(BLOCK):
                out[first + i] = u[i]

    return run


def over_members(theta: Any, g_over_l: float, h: float, steps: int) -> Any:
    """Return compensated stepping in numpy over all members, with numpy's sine and without temporary arrays."""
    kick = 0.5 * (h * h) * (-g_over_l * np.sin(theta))
    d, d_rest = kick.copy(), np.zeros_like(theta)
    u = theta + d
    part = u - theta
    u_rest = (theta - (u - part)) + (d - part)
    ahead, a, b = np.empty_like(u), np.empty_like(u), np.empty_like(u)

    def add(total: Any, term: Any, rest: Any) -> None:
        """Add `term` to `total`, and leave the rounding error in `rest`."""
        np.add(total, term, out=ahead)
        np.subtract(ahead, total, out=a)
        np.subtract(ahead, a, out=b)
        np.subtract(total, b, out=rest)
        np.subtract(term, a, out=b)
        np.add(rest, b, out=rest)
        total[:] = ahead

    for _ in range(1, steps):
        np.sin(u, out=kick)
        np.multiply(kick, -g_over_l, out=kick)
        np.multiply(kick, h * h, out=kick)
        np.add(kick, d_rest, out=kick)
        add(d, kick, d_rest)
        np.add(d, u_rest, out=kick)
        add(u, kick, u_rest)
    return u


def three_term_over_members(theta: Any, g_over_l: float, h: float, steps: int) -> Any:
    """Return the three-term form in numpy over all members, with numpy's sine."""
    before = theta.copy()
    u = theta - 0.5 * h * h * g_over_l * np.sin(theta)
    kick = np.empty_like(u)
    for _ in range(1, steps):
        np.sin(u, out=kick)
        kick *= h * h * g_over_l
        kick += before
        np.multiply(u, 2.0, out=before)
        before -= kick
        u, before = before, u
    return u
