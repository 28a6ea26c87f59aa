"""The names that a kernel binds: constants and functions that the loops use without knowing the model or the scheme.

Each kernel defines these names itself (`vibsim.engine.kernel`). A module of the loops declares as stubs those that it
uses; this is their contract. The loops call functions by name because compiled code with function arguments cannot be
cached. Functions with the suffix ``_fast`` have the same text, with branch-free elementary functions that give NaN
outside their range.

Settings:

======================  ===============================================================================================
``GATHER``              energies, extrema, norms, peaks and turns are gathered
``D2T``                 the energy with ``[D_2t u]^n = (u^(n+1) - u^(n-1))/(2 dt)`` as velocity is gathered as well
``SERIES``              samples include the running maxima of the energy deviation, and ``[D_2t u]``
``KEEP``                local extrema are kept individually (`vibsim.engine.extrema`)
``STAGGERED``           peaks are located by ``[D_2t u]``, because the scheme's velocity belongs to another time; the
                        start never counts as a peak
``WORK``                samples include the sums of the powers of damping and of driving forces
``STAGED``              a step is cut into stages (`vibsim.engine.stages`)
``EVENTS``              the model has events (`vibsim.engine.events`)
``LOCATED``             events are located within the step, not noticed at the next grid point
``ACT``                 events change the motion; otherwise they are only counted
``PARAMETERS``          the number of parameters
======================  ===============================================================================================

Functions; u, v, t and p are position, velocity, time and parameters of a member. With several coordinates position and
velocity are vectors (`vibsim.engine.coordinates`); q and w may be numbers or vectors:

==============================================================  =======================================================
``start, step, backward``                                       the functions of `vibsim.schemes.base.Stepper`
``stages_of(rows, old, filled, n)``                             does all stages of step n but the last
``step_end(state, t, dt, p, kept)``, ``kept_in(rows, j)``       the last stage, and the values it needs of the others
``energies(u, v, t, p)``                                        kinetic and potential energy
``energy_with(u, v, t, p, potential)``                          their sum, given the potential energy
``powers(u, v, t, p)``                                          power of damping (taken) and of driving forces (put in)
``observed(u, v, t, p)``                                        values of the formulas that are evaluated at samples
``parameters_of(parameters, table, case)``                      the parameters of a member, and the table of the model
``initial_of(values, k)``, ``point_of(values, case, k)``        all positions and all velocities, at the start or at
                                                                sample k
``put_moving(samples, case, k, q, w)``                          writes positions and velocities of sample k
``put_components(samples, first, case, k, w)``                  writes the components of w into rows from ``first`` on
``first_of(q)``                                                 the first component
``size_of(q, w)``                                               the sum of the absolute values of all components
``first_further, next_further, note_further``                   `vibsim.engine.gather` for coordinates after the first
``parameters_in, states_in, extrema_in``                        tuples in the rows of a lane (`vibsim.engine.rows`)
``put_states, put_extrema``                                     write them
``vector(*numbers)``                                            a vector
``total(state)``                                                the sum of a state, NaN if any entry is NaN
``drive, limit, impact_of``                                     the formulas of `vibsim.models.events`
``mode_of(p)``, ``start_of(p)``, ``with_mode(p, mode, start)``  mode of a member, and time of its scheme's last restart
``first_mode(u, v, t, p)``                                      the initial mode
``guard(u, v, t, p)``, ``guard_on_mesh``                        falls below 0 at the event that ends the current mode
``landed(u, v)``                                                the state at a located event, without its rounding
``settled(u, v, t, before, is_last, p)``                        position, velocity and mode after an event; `before`:
                                                                position a step before, infinite if located; `is_last`:
                                                                the step has reached its limit of events
``counts_as_event(before, after, came, goes)``                  whether a change of mode and state counts as an event
``is_at_rest(mode)``                                            whether all coordinates rest
``followed(u, v, t, p)``                                        the mode at the end of a smooth piece without an event
``held(v)``                                                     velocity in mode 0 of a member that had velocity v
``spent(u, ahead)``, ``lost(came, goes, t, p)``                 cost of a smooth piece, and of an event between two
                                                                states, in units of ``cost``
``turning(before, after, v, own)``                              1 for an event between two modes and velocities that is
                                                                a peak, -1 for a trough, 0 for neither
``guards(u, v, t, p)``, ``guard_rates``, ``guard_curvatures``   the guards of `vibsim.models.events.Crossings`, and
                                                                their first and second time derivatives
``crossed(k, u, v, t, p)``, ``is_end(k)``                       the state after event k, and whether it ends the motion
``is_ended_by(g, h)``                                           whether a jump of the guards from g to h ends the motion
==============================================================  =======================================================
"""

from __future__ import annotations

from typing import Any, TypeVar

F = TypeVar("F")

State = tuple[Any, ...]
"""The carried state of a scheme: floats, or vectors with several coordinates."""
P = tuple[float, ...]
"""The parameters of a member."""


def called(function: F) -> F:
    """Mark a function that a kernel compiles separately instead of inlining it.

    A loop over lanes is then vectorised independently of its caller, and rare code stays out of the loop over steps.
    """
    return function


def unbound(*_: Any) -> Any:
    """Stub of a function that only a kernel defines."""
    raise RuntimeError("only a kernel binds this name")
