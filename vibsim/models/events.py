r"""Events as data of a model: times at which a motion is not smooth. Between two events the force is smooth.

A motion with events is a sequence of smooth pieces, each in a *mode*, a number that is constant within the piece. An
event ends a piece: the state may jump, and the next mode is chosen. A step uses the smooth force of its mode, never a
jump (`vibsim.engine.events`).

- Friction, Coulomb's law (vibration text (B), section 10.3): ``drive`` is the acceleration by all other forces and
  ``limit`` the largest acceleration that friction can hold. A body that slides in the direction ``mode`` = 1 or -1 has
  the acceleration ``drive - mode*limit`` until its velocity vanishes. If ``|drive| <= limit`` there, it sticks (mode 0)
  until the drive exceeds the limit; otherwise it slides on, in the direction of the drive.
- Impact on the ground (B, section 10.9): the body flies (mode 1) until the height vanishes. There the velocity v
  becomes ``-restitution*v``, and the body comes to rest for ever (mode 0) if that is at most `eps_v`.
- Crossings, as a user writes them: a formula, the *guard*, changes its sign along the motion. The states then get new
  values, or the motion ends (mode 0; B, section 10.6). The mode says on which side of every guard the motion is: an
  event happens once for each crossing in its direction, and not again before the guard has changed back.

Source: vibration text (B), sections 10.3, 10.6 and 10.9; E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary
Differential Equations I, section II.6 (discontinuous equations).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import ClassVar

from vibsim.formula import Expression

Formula = str | Expression
Guards = Sequence[tuple[int, Formula]]
"""Formulas that vanish at events, with the directions of `Crossing`."""


class _Kind:
    """What holds for a kind of events, unless it says otherwise."""

    jumps: ClassVar[bool] = True
    """Whether the state is discontinuous at events."""
    reverses: ClassVar[bool] = False
    """Whether a change of the direction of motion, at which the force jumps, is an event."""

    @property
    def act(self) -> bool:
        """Whether events change the motion; otherwise they are only counted."""
        return True

    def smooth(self, accelerations: Sequence[Formula]) -> Sequence[Formula]:
        """Return the accelerations between events."""
        return accelerations

    def changed(self, velocities: Sequence[str]) -> Collection[str]:
        """Return the states that an event changes."""
        return ()


@dataclass(frozen=True)
class Friction(_Kind):
    """Coulomb friction; formulas in the position, ``t`` and the parameters."""

    jumps: ClassVar[bool] = False
    reverses: ClassVar[bool] = True
    rows: ClassVar[tuple[Crossing, ...]] = ()
    """Events that a user writes: none."""
    drive: Formula
    """Acceleration by all forces except friction."""
    limit: Formula
    """Largest acceleration that friction can hold, at least 0."""
    cost: Formula
    """Energy lost per length of the path: a force."""

    def smooth(self, accelerations: Sequence[Formula]) -> Sequence[Formula]:
        """Return the acceleration without friction."""
        return (self.drive,)

    def guards(self, position: str, velocity: str) -> Guards:
        """Return the velocity: the body sticks or turns where it vanishes."""
        return ((0, velocity),)


@dataclass(frozen=True)
class Impact(_Kind):
    """Impact on the ground, at the position 0; formulas in the parameters."""

    rows: ClassVar[tuple[Crossing, ...]] = ()
    restitution: Formula
    """Speed after an impact over the speed before it."""
    near: Formula
    """With events left to the mesh: the height below which a falling body is on the ground."""
    slow: Formula
    """Largest speed after an impact at which the body stays on the ground."""
    cost: Formula
    """Energy lost per decrease of ``v^2/2``: a mass."""

    def guards(self, position: str, velocity: str) -> Guards:
        """Return the height, which falls to 0."""
        return ((-1, position),)

    def changed(self, velocities: Sequence[str]) -> Collection[str]:
        """Return the states that an event changes."""
        return velocities


@dataclass(frozen=True)
class Crossing:
    """One event of `Crossings`; formulas in the states, ``t`` and the parameters."""

    guard: Formula
    """Formula that changes its sign at the event."""
    direction: int = 0
    """-1 if only a fall below 0 is an event, 1 if only a rise above 0 is, 0 for both."""
    then: tuple[tuple[str, Formula], ...] = ()
    """States that change, with formulas of their new values in the old ones."""
    ends: bool = False
    """Whether the motion ends there, in an unchanged state."""


@dataclass(frozen=True)
class Crossings(_Kind):
    """Events where formulas change sign; simultaneous events happen in the order of the rows."""

    rows: tuple[Crossing, ...]
    cost: Formula = "1"
    """Factor of the lost energy: losses at events are counted as energy."""

    @property
    def act(self) -> bool:
        """Whether an event changes a state or ends the motion."""
        return any(row.then or row.ends for row in self.rows)

    def guards(self, position: str, velocity: str) -> Guards:
        """Return the formulas that the user wrote."""
        return [(row.direction, row.guard) for row in self.rows]

    def changed(self, velocities: Sequence[str]) -> Collection[str]:
        """Return the states that an event changes."""
        return [name for row in self.rows for name, _ in row.then]


Events = Friction | Impact | Crossings
TREATMENTS = ("located", "mesh")
"""How a scheme treats events: located within the step, or noticed at the next grid point."""
