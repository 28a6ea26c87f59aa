"""A smooth motion between its samples: quintic polynomials through position, velocity and acceleration.

Between two points, ``U(x) = c0 + c1 y + ... + c5 y^5`` with y from 0 to 1 has the position, the velocity and the
acceleration of both (Hermite interpolation). Near a point its error is ``|y|^3 h^6/720`` of the sixth derivative: it
vanishes with the distance from the point, so that a small shift in time costs no accuracy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats


@dataclass(frozen=True)
class Template:
    """Motions that others are compared with; r stands for rows, each with its own scheme and member."""

    position: Floats
    """Shape (r, t)."""
    velocity: Floats
    """Shape (r, t)."""
    spacing: Floats
    """Distance between points, shape (r,)."""
    coefficients: Floats
    """Of the cell behind each point but the last, shape (6, r, t-1)."""

    @property
    def times(self) -> Floats:
        """Times from the first point on, shape (r, t)."""
        return self.spacing[:, None] * np.arange(self.position.shape[-1])

    def at(self, place: Floats) -> tuple[Floats, Floats]:
        """Return position and velocity at places in units of the spacing, shape (..., r, n), also beyond the ends."""
        cells = self.coefficients.shape[-1]
        cell = np.clip(np.floor(np.nan_to_num(place)), 0, cells - 1)
        y = place - cell
        flat = cell.astype(np.int64) + cells * np.arange(len(self.spacing))[:, None]
        c = [row.ravel().take(flat) for row in self.coefficients]
        position = c[0] + y * (c[1] + y * (c[2] + y * (c[3] + y * (c[4] + y * c[5]))))
        slope = c[1] + y * (2 * c[2] + y * (3 * c[3] + y * (4 * c[4] + y * (5 * c[5]))))
        return position, slope / self.spacing[:, None]


def template(position: Floats, velocity: Floats, acceleration: Floats, spacing: Floats) -> Template:
    """Return the motion with these samples.

    Parameters
    ----------
    position, velocity, acceleration
        Shape (r, t).
    spacing
        Shape (r,).
    """
    h = spacing[:, None]
    v, a = h * velocity, h * h * acceleration
    u0, u1 = position[:, :-1], position[:, 1:]
    v0, v1, a0, a1 = v[:, :-1], v[:, 1:], a[:, :-1], a[:, 1:]
    rise = u1 - u0
    coefficients = np.stack(
        [
            u0,
            v0,
            0.5 * a0,
            10 * rise - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
            -15 * rise + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
            6 * rise - 3 * v0 - 3 * v1 - 0.5 * a0 + 0.5 * a1,
        ]
    )
    return Template(position, velocity, spacing, coefficients)
