"""The names that a kernel binds: what the loops call without knowing the model or the scheme.

Each kernel has numbers and functions of its own under these names (`vibsim.engine.kernel`). A module of the loops
declares those that it needs, and this is what it may rely on. Compiled code of functions that are handed other
functions could not be kept, so the loops know them by name. The ``_fast`` ones are the same text with elementary
functions that have no branch: they give NaN outside their range.

Settings:

======================  ===============================================================================================
``GATHER``              energies, extrema, norms, peaks and turns are gathered
``D2T``                 and the energy by ``[D_2t u]^n = (u^(n+1) - u^(n-1))/(2 dt)`` beside that by the own velocity
``SERIES``              samples are taken of the running maxima of the energy deviation, and of ``[D_2t u]``
``KEEP``                local extrema are kept one by one (`vibsim.engine.extrema`)
``STAGGERED``           peaks are found by ``[D_2t u]``, since the own velocity belongs to another time; the start is
                        then none
``WORK``                samples are taken of the sums of the powers of damping and of driving forces
``STAGED``              a step is cut into stages (`vibsim.engine.stages`)
``EVENTS``              the model has events (`vibsim.engine.events`)
``LOCATED``             they are found within the step, not noticed at the grid point behind
``PARAMETERS``          the number of parameters
======================  ===============================================================================================

Functions; u, v, t and p are position, velocity, time and parameters of a member. Of several coordinates position and
velocity are vectors (`vibsim.engine.coordinates`); q and w are either:

==============================================================  =======================================================
``start, step, backward``                                       those of `vibsim.schemes.base.Stepper`
``stages_of(rows, old, filled, n)``                             takes all stages of step n but the last
``step_end(state, t, dt, p, kept)``, ``kept_in(rows, j)``       the last one, and what it takes of the others
``energies(u, v, t, p)``                                        kinetic and potential energy
``energy_with(u, v, t, p, potential)``                          their sum where the potential energy is known
``powers(u, v, t, p)``                                          what damping takes, and what driving forces put in
``observed(u, v, t, p)``                                        the formulas that are worked out of samples
``parameters_of(parameters, table, case)``                      the parameters of a member, and the table of the model
``initial_of(values, k)``, ``point_of(values, case, k)``        all positions and all velocities, at the start or of
                                                                sample k
``put_moving(samples, case, k, q, w)``                          writes them
``put_components(samples, first, case, k, w)``                  writes one of them into rows from ``first`` on
``first_of(q)``                                                 that of the first coordinate
``size_of(q, w)``                                               the sum of the absolute values of all of them
``first_further, next_further, note_further``                   `vibsim.engine.gather` for coordinates behind the first
``parameters_in, states_in, extrema_in``                        tuples in the rows of a lane (`vibsim.engine.rows`)
``put_states, put_extrema``                                     write them
``vector(*numbers)``                                            a vector
``total(state)``                                                the sum of a state, NaN where an entry is
``drive, limit, impact_of``                                     the formulas of `vibsim.models.events`
``mode_of(p)``, ``start_of(p)``, ``with_mode(p, mode, start)``  mode of a member, and when its scheme has last started
``first_mode(u, v, t, p)``                                      the mode at the beginning
``guard(u, v, t, p)``, ``guard_on_mesh``                        falls below 0 at the event that ends the present mode
``landed(u, v)``                                                the state at a located event, without its rounding
``settled(u, v, t, before, is_last, p)``                        position, velocity and mode behind an event; `before`:
                                                                position a step before, infinite if located; `is_last`:
                                                                a step has no room for more
``counts_as_event(before, after, came, goes)``                  whether a change of mode and state counts as an event
``is_at_rest(mode)``                                            whether all coordinates rest
``followed(u, v, t, p)``                                        the mode at the end of a smooth piece, without an event
``held(v)``                                                     the velocity of a member at rest that had this one
``spent(u, ahead)``, ``lost(came, goes, t, p)``                 what a smooth piece, and an event between two states,
                                                                costs in units of ``cost``
``turning(before, after, v, own)``                              1 for an event between two modes and velocities that is
                                                                a peak, -1 for a trough, 0 for neither
``guards(u, v, t, p)``, ``guard_rates``, ``guard_curvatures``   the formulas of `vibsim.models.events.Crossings`, and
                                                                their first and second derivatives by time
``crossed(k, u, v, t, p)``, ``is_end(k)``                       the state behind event k, and whether it ends the motion
``is_ended_by(g, h)``                                           whether a jump of the guards from g to h ends the motion
==============================================================  =======================================================
"""

from __future__ import annotations

from typing import Any, TypeVar

F = TypeVar("F")

State = tuple[Any, ...]
"""The state of a scheme, as many floats as it carries; of several coordinates, tuples of them."""
P = tuple[float, ...]
"""The parameters of a member."""


def called(function: F) -> F:
    """Mark a function that a kernel compiles for itself instead of into its callers.

    A loop over lanes then becomes vector instructions whatever stands around its call, and what is long and seldom
    needed does not crowd what is needed at every step.
    """
    return function


def unbound(*_: Any) -> Any:
    """Stand for a function that only a kernel has."""
    raise RuntimeError("only a kernel binds this name")
