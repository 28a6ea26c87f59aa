r"""Events: where a motion is not smooth, as data of a model; between two of them the force is a smooth one.

A motion with events is a sequence of smooth pieces, each in a *mode*, a number that does not change within the piece.
An event ends a piece: there the state may jump, and the next mode is chosen. Steps see the smooth force of their mode
only, never a jump (`vibsim.engine.events`).

- Friction, Coulomb's law (vibration text (B), section 10.3): with the acceleration ``drive`` by all other forces, and
  ``limit`` the largest that friction can hold, a body that slides in the direction ``mode`` = 1 or -1 has the
  acceleration ``drive - mode*limit``, until its velocity vanishes. There it sticks (mode 0) where
  ``|drive| <= limit``: it stays where it is until the drive exceeds the limit. Otherwise it slides on, along the drive.
- Impact on the ground (B, section 10.9): in flight (mode 1) until the height vanishes; there the velocity v becomes
  ``-restitution*v``, and the body comes to rest for ever (mode 0) where that is at most `eps_v`.
- Crossings, as a user writes them: a formula, its *guard*, changes its sign along the motion. The states then get new
  values, or the motion ends there (mode 0; B, section 10.6). The mode says on which side of every guard the motion is:
  an event happens once for each crossing in its direction, and not again before the guard has gone back.

Source: vibration text (B), sections 10.3, 10.6 and 10.9; E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary
Differential Equations I, section II.6 (discontinuous equations).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibsim.formula import Expression

Formula = str | Expression


@dataclass(frozen=True)
class Friction:
    """Coulomb friction; both formulas are accelerations, in the position, ``t`` and the parameters."""

    jumps: ClassVar[bool] = False
    """Whether events change the state at once."""
    drive: Formula
    """By all forces but the friction."""
    limit: Formula
    """The largest that friction can hold, at least 0."""
    cost: Formula
    """Energy that goes per length of the path: a force."""


@dataclass(frozen=True)
class Impact:
    """Impact on the ground, at the position 0; formulas in the parameters."""

    jumps: ClassVar[bool] = True
    restitution: Formula
    """Speed after an impact over the speed before it."""
    near: Formula
    """On the mesh: the height below which a body that falls is on the ground."""
    slow: Formula
    """The largest speed after an impact with which it stays there."""
    cost: Formula
    """Energy that goes per half square of the speed lost: a mass."""


@dataclass(frozen=True)
class Crossing:
    """One event of `Crossings`; formulas in the states, ``t`` and the parameters."""

    guard: Formula
    """It changes its sign at the event."""
    direction: int = 0
    """-1 where only a fall below 0 is an event, 1 where only a rise above it is, 0 for both."""
    then: tuple[tuple[str, Formula], ...] = ()
    """States that change, with their new values by formulas in the values before."""
    ends: bool = False
    """Whether the motion ends there: the state stays as it is."""


@dataclass(frozen=True)
class Crossings:
    """Events where formulas change their signs; at one time the first of them happens first."""

    jumps: ClassVar[bool] = True
    rows: tuple[Crossing, ...]
    cost: Formula = "1"
    """What goes at an event is counted in energy."""


Events = Friction | Impact | Crossings
TREATMENTS = ("located", "mesh")
"""How a scheme treats events: found within the step, or noticed at the grid point behind them."""
