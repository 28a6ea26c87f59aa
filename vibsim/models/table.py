r"""Heights that are known at equally spaced places only, and what follows from them between the places.

Source: vibration text (B), section 10.8. With heights ``h_i = h(x_i)``, ``x_i = x_0 + i dx``, the second derivative is
``q_i = (h_(i-1) - 2 h_i + h_(i+1))/dx^2``, at the ends that of the neighbour, ``q_0 = q_1``, ``q_N = q_(N-1)``: first
order at one point, so that all in all second order is kept, where an end value of 0 would leave the first alone.

Between two points q is the straight line, and h the cubic through both heights whose second derivative is that line:
with the fraction w of the way from point i to point i+1

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
"""Points of a table, at least: a second difference takes three."""
HEADER, HEIGHTS, BENDS = range(3)
"""Rows of `Table.rows`."""
ROWS = 3
HEIGHT, BEND = "_height", "_bend"
"""Names by which formulas of a model know h and q at the present place; no user can write them."""


@dataclass(frozen=True)
class Table:
    """Heights at equally spaced places; two of the same numbers are equal."""

    first: float
    """Place of the first point."""
    spacing: float
    heights: Floats = field(compare=False, repr=False)
    """At least three, shape (point,)."""
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
        """Spacings from the place 0, where motions begin, to the last point; whole where a point is there."""
        return self.points - 1 + self.first / self.spacing

    @cached_property
    def bends(self) -> Floats:
        """Second derivative at every point, shape (point,)."""
        h = self.heights
        inner = (h[:-2] - 2.0 * h[1:-1] + h[2:]) / (self.spacing * self.spacing)
        return np.concatenate([inner[:1], inner, inner[-1:]])

    @cached_property
    def rows(self) -> Floats:
        """What a kernel looks up, shape (`ROWS`, point): place and spacing, heights, second derivatives."""
        found = np.zeros((ROWS, self.points))
        found[HEADER, :2] = self.first, self.spacing
        found[HEIGHTS], found[BENDS] = self.heights, self.bends
        return found

    def read(self, x: Floats, before: Floats | None = None) -> tuple[Floats, Floats]:
        """Return heights and second derivatives at places, by numpy: not for steps.

        Parameters
        ----------
        before
            Number of the point before each place, whose piece is taken; it goes on beyond its ends. None finds it.
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
    """A table that the formulas of a model look up, under the names `HEIGHT` and `BEND`."""

    table: Table
    place: Formula
    """Where, in ``t`` and the parameters: a speed times ``t``."""
    is_met: bool = False
    """Whether a step of every member ends at every point of the table, so that no step has a corner of the force."""
