"""The harmonic oscillation ``u'' = -w^2 u``, which the linear models share."""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.models.base import Floats


def motion(t: Floats, w: Any, u_0: Any, v_0: Any) -> tuple[Floats, Floats]:
    """Return position and velocity at times `t`: vibration text (B), equation (2), for any initial velocity."""
    cos, sin = np.cos(w * t), np.sin(w * t)
    return u_0 * cos + v_0 / w * sin, v_0 * cos - u_0 * w * sin


def period(w: Any, u_0: Any, v_0: Any) -> Any:
    """Return ``2 pi/w``, whatever the amplitude; NaN at rest."""
    rest = (np.asarray(u_0) == 0) & (np.asarray(v_0) == 0)
    return np.where(rest, np.nan, 2 * np.pi / w)
