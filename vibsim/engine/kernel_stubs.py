"""The names that a kernel binds: what the loops call without knowing the model or the scheme.

Each kernel has functions and numbers of its own under these names (`vibsim.engine.kernel`); here they only say what
the loops may rely on. Compiled code of functions that are handed other functions could not be kept, so the loops know
them by name. The ``_fast`` ones are the same text with elementary functions that have no branch.
"""

from __future__ import annotations

from typing import Any, NoReturn, TypeVar

F = TypeVar("F")

State = tuple[Any, ...]
"""The state of a scheme, as many floats as it carries; of several coordinates, tuples of them."""
P = tuple[float, ...]
"""The parameters of a member."""

GATHER = True
"""Whether energies, extrema, norms, peaks and turns are gathered."""
D2T = True
"""Whether the energy by ``[D_2t u]^n = (u^(n+1) - u^(n-1))/(2 dt)`` is gathered beside that by the own velocity."""
SERIES = True
"""Whether samples are taken of the running maxima of the energy deviation, and of ``[D_2t u]``."""
KEEP = True
"""Whether local extrema are kept one by one (`vibsim.engine.extrema`)."""
STAGGERED = True
"""Whether peaks are found by ``[D_2t u]``, since the scheme's own velocity belongs to another time; the start is then
none."""
WORK = True
"""Whether samples are taken of the sums of the powers of damping and of driving forces."""
STAGED = True
"""Whether a step is cut into stages (`vibsim.engine.stages`)."""
EVENTS = True
"""Whether the model has events (`vibsim.engine.events`)."""
LOCATED = True
"""Whether they are found within the step, not noticed at the grid point behind."""
SYSTEM = False
"""Whether there are several coordinates: a position and a velocity are then tuples."""
COORDINATES = 1
STATES = 1
"""Entries of the scheme's state."""
SET = 4
"""Rows of one set (`vibsim.engine.block_loop`): the state, the position, the scheme's own velocity, the position
before."""
PARAMETERS = 1
"""Number of parameters."""
DT, ENERGY, BOTTOM, VELOCITY, TWO_BEFORE, INTERIOR, ALIVE, EVENT, EXTREMA = range(8, 17)
FIRST_PARAMETER, RATE, PENDING, LARGEST_D2T, SLOPE, SLOPE_BEFORE = range(26, 32)
DISSIPATED, DRIVEN, FIRST_KEPT = range(32, 35)
"""Rows behind the two sets: step, initial energy, multiple of a turn below, velocity at this point, velocity two points
before, largest deviation before this point, 1 for a lane that goes on, 1 for a lane with something to note, what is
gathered at every step, the parameters; and where `D2T` is, ``1/(2 dt)``, the deviation by ``[D_2t u]`` at this point,
and the largest one before; the velocity by which peaks are found where that is `STAGGERED`, at this point and the one
before; the sums of powers where they are wanted for `WORK`; what is kept from stage to stage."""


def called(function: F) -> F:
    """Mark a function that a kernel compiles for itself instead of into its callers.

    A loop over lanes then becomes vector instructions whatever stands around its call, and what is long and seldom
    needed does not crowd what is needed at every step.
    """
    return function


def _unbound() -> NoReturn:
    raise RuntimeError("only a kernel binds this name")


def start(variant: int, u: float, v: float, dt: float, p: P) -> State:
    """Return the state at the first step (`vibsim.schemes.base.Stepper.start`)."""
    _unbound()


def step(state: State, t: float, dt: float, p: P) -> tuple[State, Any]:
    """Return the next state, and the velocity at the present time (`vibsim.schemes.base.Stepper.step`)."""
    _unbound()


def step_fast(state: State, t: float, dt: float, p: P) -> tuple[State, float]:
    """Return what `step` does, or NaN where a fast function is out of its range."""
    _unbound()


def stages_of(rows: Any, old: int, filled: int, n: int) -> None:
    """Take every stage but the last of step n of every lane (`vibsim.engine.stages`)."""
    _unbound()


def step_end(
    state: State, t: float, dt: float, p: P, kept: tuple[float, ...]
) -> tuple[State, float]:
    """Return what `step_fast` does, from what the stages before have kept."""
    _unbound()


def kept_in(rows: Any, j: int) -> tuple[float, ...]:
    """Return what the last stage takes of a lane."""
    _unbound()


def backward(state: State, dt: float) -> float:
    """Return the one-sided velocity at the present time (`vibsim.schemes.base.Stepper.backward`)."""
    _unbound()


def initial_of(values: Any, k: int) -> tuple[Any, Any]:
    """Return all positions and all velocities of member k."""
    _unbound()


def point_of(values: Any, case: int, k: int) -> tuple[Any, Any]:
    """Return all positions and all velocities of a member at sample k."""
    _unbound()


def size_of(u: Any, v: Any) -> float:
    """Return the sum of the absolute values of all positions and velocities."""
    _unbound()


def first_further(u: Any, v: Any) -> Any:
    """Return `vibsim.engine.gather.first_extrema` of every coordinate but the first."""
    _unbound()


def next_further(further: Any, u: Any, v: Any) -> Any:
    """Return `vibsim.engine.gather.next_extrema` of every coordinate but the first."""
    _unbound()


def note_further(stats: Any, case: int, further: Any, dt: float) -> None:
    """Write the extrema and norms of every coordinate but the first."""
    _unbound()


def energies(u: float, v: float, t: float, p: P) -> tuple[float, float]:
    """Return kinetic and potential energy."""
    _unbound()


def energies_fast(u: float, v: float, t: float, p: P) -> tuple[float, float]:
    """Return what `energies` does, or NaN where a fast function is out of its range."""
    _unbound()


def energy_with(u: float, v: float, t: float, p: P, potential: float) -> float:
    """Return the energy where the potential energy at this place and time is known."""
    _unbound()


def powers(u: float, v: float, t: float, p: P) -> tuple[float, float]:
    """Return the power that damping takes, and that which driving forces put in."""
    _unbound()


def powers_fast(u: float, v: float, t: float, p: P) -> tuple[float, float]:
    """Return what `powers` does, or NaN where a fast function is out of its range."""
    _unbound()


def observed(u: float, v: float, t: float, p: P) -> tuple[float, ...]:
    """Return the values of the formulas that are worked out of samples."""
    _unbound()


def parameters_of(parameters: Any, table: Any, case: int) -> P:
    """Return the parameters of a member from the array of shape (case, n_parameters), and the table of the model."""
    _unbound()


def parameters_in(rows: Any, j: int) -> P:
    """Return the parameters of a lane (`vibsim.engine.block_loop`)."""
    _unbound()


def states_in(rows: Any, first: int, j: int) -> State:
    """Return the state of a lane from the set of rows that begins at `first` (`vibsim.engine.block_loop`)."""
    _unbound()


def put_states(rows: Any, first: int, j: int, state: State) -> None:
    """Write the state of a lane to the set of rows that begins at `first`."""
    _unbound()


def extrema_in(rows: Any, j: int) -> Any:
    """Return what a lane has gathered at every step (`vibsim.engine.gather.Extrema`)."""
    _unbound()


def put_extrema(rows: Any, j: int, extrema: Any) -> None:
    """Write what a lane has gathered at every step."""
    _unbound()


def total(state: State) -> float:
    """Return the sum of the entries of a state, which is NaN where one of them is."""
    _unbound()


def drive(u: float, v: float, t: float, p: P) -> float:
    """Return the acceleration without the friction (`vibsim.models.events.Friction`)."""
    _unbound()


def limit(u: float, v: float, t: float, p: P) -> float:
    """Return the largest acceleration that friction can hold."""
    _unbound()


def impact_of(u: float, v: float, t: float, p: P) -> tuple[float, float, float]:
    """Return restitution, height and speed of `vibsim.models.events.Impact`."""
    _unbound()


def mode_of(p: P) -> float:
    """Return the mode of a member (`vibsim.models.events`)."""
    _unbound()


def start_of(p: P) -> float:
    """Return the time at which the scheme has last started."""
    _unbound()


def with_mode(p: P, mode: float, start: float) -> P:
    """Return the parameters of a member with another mode, and another time at which the scheme has started."""
    _unbound()


def first_mode(u: float, v: float, t: float, p: P) -> float:
    """Return the mode at the beginning."""
    _unbound()


def guard(u: float, v: float, t: float, p: P) -> float:
    """Return a number that falls below 0 at the event that ends the present mode."""
    _unbound()


def guard_on_mesh(u: float, v: float, t: float, p: P) -> float:
    """Return the same for grid points."""
    _unbound()


def landed(u: float, v: float) -> tuple[float, float]:
    """Return position and velocity at a located event, without their rounding."""
    _unbound()


def settled(u: float, v: float, t: float, before: float, p: P) -> tuple[float, float, float]:
    """Return position, velocity and mode behind an event; `before`: position a step before, infinite if located."""
    _unbound()


def spent(u: float, ahead: float) -> float:
    """Return what a smooth piece between two positions costs, in units of `vibsim.models.events` (``cost``)."""
    _unbound()


def lost(before: float, after: float) -> float:
    """Return what an event costs beside that, from the velocities before and behind it."""
    _unbound()


def turning(before: float, after: float) -> float:
    """Return 1 for an event between two modes that is a peak, -1 for a trough, 0 for neither."""
    _unbound()
