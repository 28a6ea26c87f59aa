r"""Heights known at equally spaced places, and their interpolation.

Source: vibration text (B), section 10.8. With heights ``h_i = h(x_i)``, ``x_i = x_0 + i dx``, the second derivative is
``q_i = (h_(i-1) - 2 h_i + h_(i+1))/dx^2``; at the ends it is that of the neighbour, ``q_0 = q_1``, ``q_N = q_(N-1)``.
This is of first order at one point only, so the motion keeps second order; an end value of 0 would reduce it to first.

Between two points q is linear, and h is the cubic through both heights with that second derivative: with the fraction w
of the way from point i to point i+1

    h = (1 - w) h_i + w h_(i+1) - dx^2 w (1 - w)/6 ((2 - w) q_i + (1 + w) q_(i+1)),

exact at the points and of fourth order between inner ones. Units: x, h and dx [m], q [m-1].
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.models.events import Formula

FEWEST_POINTS = 3
"""Smallest number of points of a table: a second difference takes three."""
HEADER, HEIGHTS, BENDS = range(3)
"""Rows of `Table.rows`."""
ROWS = 3
HEIGHT, BEND = "_height", "_bend"
"""Names of h and q at the current place in formulas of a model; no user can write them."""


@dataclass(frozen=True)
class Table:
    """Heights at equally spaced places; equal numbers make equal objects."""

    first: float
    """Place of the first point."""
    spacing: float
    heights: Floats = field(compare=False, repr=False)
    """Shape (point,), with at least `FEWEST_POINTS` points."""
    digest: str = field(init=False)
    """SHA-256 of all numbers."""

    def __post_init__(self) -> None:
        head = np.array([self.first, self.spacing], dtype="<f8").tobytes()
        content = np.ascontiguousarray(self.heights, dtype="<f8").tobytes()
        object.__setattr__(self, "digest", hashlib.sha256(head + content).hexdigest())

    @property
    def points(self) -> int:
        """Number of points."""
        return len(self.heights)

    @property
    def last(self) -> float:
        """Place of the last point."""
        return self.first + (self.points - 1) * self.spacing

    @property
    def spacings_ahead(self) -> float:
        """Number of spacings from place 0, where motions begin, to the last point; an integer if 0 is a point."""
        return self.points - 1 + self.first / self.spacing

    @cached_property
    def bends(self) -> Floats:
        """Second derivative at every point, shape (point,)."""
        h = self.heights
        inner = (h[:-2] - 2.0 * h[1:-1] + h[2:]) / (self.spacing * self.spacing)
        return np.concatenate([inner[:1], inner, inner[-1:]])

    @cached_property
    def rows(self) -> Floats:
        """Array for a kernel, shape (`ROWS`, point): first place and spacing, heights, second derivatives."""
        rows = np.zeros((ROWS, self.points))
        rows[HEADER, :2] = self.first, self.spacing
        rows[HEIGHTS], rows[BENDS] = self.heights, self.bends
        return rows

    def read(self, x: Floats, before: Floats | None = None) -> tuple[Floats, Floats]:
        """Return heights and second derivatives at places, by numpy; kernels do not use it.

        Parameters
        ----------
        before
            Index of the point at which the piece of each place begins; pieces are extrapolated beyond their ends. None
            for the piece that contains the place.
        """
        way = (x - self.first) / self.spacing
        number = np.clip(np.floor(way) if before is None else before, 0, self.points - 2)
        i = number.astype(np.int64)
        w = way - i
        line = (1.0 - w) * self.heights[i] + w * self.heights[i + 1]
        q_0, q_1 = self.bends[i], self.bends[i + 1]
        bow = w * (1.0 - w) * ((2.0 - w) * q_0 + (1.0 + w) * q_1)
        return line - self.spacing * self.spacing / 6.0 * bow, (1.0 - w) * q_0 + w * q_1


@dataclass(frozen=True)
class Lookup:
    """A table whose values formulas of a model use under the names `HEIGHT` and `BEND`."""

    table: Table
    place: Formula
    """Place in the table at time ``t``: a speed times ``t``, a formula in ``t`` and the parameters."""
    is_met: bool = False
    """Whether steps of every member end at every point of the table, so that no step contains a corner of the force."""
