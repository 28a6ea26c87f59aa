r"""The finite difference operators of the vibration text on a mesh of equal steps.

- ``[D_t D_t u]^n = (u^(n+1) - 2 u^n + u^(n-1))/dt^2`` (B, equation (4)),
- ``[D_2t u]^n = (u^(n+1) - u^(n-1))/(2 dt)``,
- ``[D_t^+ u]^n = (u^(n+1) - u^n)/dt`` and ``[D_t^- u]^n = (u^n - u^(n-1))/dt``,
- the mean ``(u^n + u^(n+1))/2``.

Every array has the time along its last axis. A result has values only where the operator has all its points: of n
values, n - 2 from the centred ones, n - 1 from the others. So ``D_t^+ D_t^- u`` and ``D_t^- D_t^+ u`` are plain
compositions, and both are ``D_t D_t u`` at the points 1, ..., n - 2 (B, exercise 15).

Units: those of u over those of dt, per difference.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vibsim.core.array_types import Floats


def second_difference(u: ArrayLike, dt: Any) -> Floats:
    """Return ``[D_t D_t u]^n`` at the points 1, ..., n - 2."""
    values = np.asarray(u, dtype=float)
    return np.asarray((values[..., 2:] - 2.0 * values[..., 1:-1] + values[..., :-2]) / (dt * dt))


def centred_difference(u: ArrayLike, dt: Any) -> Floats:
    """Return ``[D_2t u]^n`` at the points 1, ..., n - 2."""
    values = np.asarray(u, dtype=float)
    return np.asarray((values[..., 2:] - values[..., :-2]) / (2.0 * dt))


def forward_difference(u: ArrayLike, dt: Any) -> Floats:
    """Return ``[D_t^+ u]^n`` at the points 0, ..., n - 2."""
    values = np.asarray(u, dtype=float)
    return np.asarray((values[..., 1:] - values[..., :-1]) / dt)


def backward_difference(u: ArrayLike, dt: Any) -> Floats:
    """Return ``[D_t^- u]^n`` at the points 1, ..., n - 1: the numbers of `forward_difference`, one point later."""
    return forward_difference(u, dt)


def mean(u: ArrayLike) -> Floats:
    """Return the arithmetic mean half-way between neighbours, at 1/2, ..., n - 3/2."""
    values = np.asarray(u, dtype=float)
    return np.asarray(0.5 * (values[..., 1:] + values[..., :-1]))


def error_fraction(p: ArrayLike) -> Floats:
    """Return ``E = [D_t D_t u]^n/u''(t_n) = (2/p)^2 sin^2(p/2)`` of ``exp(i w t)``, p = w dt (B, exercise 7)."""
    return np.sinc(np.asarray(p, dtype=float) / (2.0 * np.pi)) ** 2
