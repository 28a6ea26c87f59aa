r"""Polynomials that a scheme reproduces exactly, and the reason why it does not reproduce the next degree.

A polynomial is reproduced if the computed positions lie on it for any time step. The residuals follow from the
functions of the scheme in exact arithmetic (`vibsim.theory.polynomial`):

- the residual of the *first step* is the state that the start computes, minus the state on the polynomial;
- the residual of a *step* is the state that it computes from the state on the polynomial at any time t, minus the state
  on the polynomial at t + dt;
- the *cause* of a step's residual is the first of these cases in which it occurs: without forces, so that differences
  or sums are at fault; with the forces on a body at rest, whose arguments are then wrong; with damping.

That holds as long as the velocity does not change its sign if a formula contains its absolute value.

Source: vibration text (B), sections 2.2 and 8.5, problem 1 and exercise 9; `errata`, 8.5 and exercise 1 e.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from vibsim.models.base import Model
from vibsim.schemes.base import Stepper
from vibsim.theory.laurent import ROUNDED, Laurent
from vibsim.theory.polynomial import (
    Course,
    Forces,
    is_rational,
    restoring,
    with_numbers,
    with_symbols,
)

HIGHEST_DEGREE = 8
"""Highest degree that is tried."""
KNOWN_POWERS = 12
"""Power of dt at which residuals are truncated: twice that of any scheme at these degrees."""
FOLLOWED_STEPS = 4
"""Number of steps for which a polynomial must be reproduced: more than any scheme carries points."""
OF = ("position", "velocity", "state")
State = tuple[Laurent, ...]


@dataclass(frozen=True)
class Residual:
    """The leading term of a residual, ``coefficient dt^power``, computed minus exact."""

    of: str
    """``position``; if that is exact, ``velocity``; otherwise ``state``, for the remaining entries of the state."""
    power: int
    coefficient: Any
    """SymPy expression in the symbols t, c_0, c_1, ..., the parameters of the model and w_0, its natural frequency."""


@dataclass(frozen=True)
class Miss:
    """Why polynomials of a degree are not reproduced."""

    degree: int
    start: Residual | None
    """Residual of the first step; None if it is exact."""
    step: Residual | None
    """Residual of every further step; None if it is exact."""
    cause: str
    """Cause of the residual of a step, a value of `Forces`; empty if it is exact."""


def applies(model: Model) -> bool:
    """Tell whether the acceleration of a model can be evaluated in exact arithmetic, and never jumps."""
    if model.events is not None or not model.is_alone:
        return False
    return is_rational(restoring(model))


def _refuse(model: Model) -> None:
    if not applies(model):
        raise ValueError(f"the acceleration of {model.kind} has more than + - * /, powers and abs")


def reproduces(stepper: Stepper, model: Model, degree: int) -> bool:
    """Tell whether a scheme reproduces polynomials of a degree, as manufactured solutions of a model.

    The stepper is that of `vibsim.schemes.Scheme.stepper_for`. Raises ValueError unless `applies` holds for the model.
    """
    _refuse(model)
    course = with_numbers(stepper, model, degree, KNOWN_POWERS)
    state, t = course.start(), course.dt
    for _ in range(FOLLOWED_STEPS):
        if (state[0] - course.solution(0, t)).leading is not None:
            return False
        state, t = course.step(state, t), t + course.dt
    return True


@lru_cache(maxsize=256)
def exact_degree(stepper: Stepper, model: Model) -> int:
    """Return the highest degree up to which polynomials are reproduced: -1 for none, at most `HIGHEST_DEGREE`."""
    missed = (d for d in range(HIGHEST_DEGREE + 1) if not reproduces(stepper, model, d))
    return next(missed, HIGHEST_DEGREE + 1) - 1


@lru_cache(maxsize=256)
def miss(stepper: Stepper, model: Model, degree: int) -> Miss:
    """Return the residuals of the first and every further step on polynomials of a degree, with their cause."""
    _refuse(model)
    course = with_numbers(stepper, model, degree, KNOWN_POWERS)
    first, step = (_leading(course, residual) for residual in (_of_start, _of_step))
    if step is None:
        return Miss(degree, first, step, "")
    causes = (f for f in Forces if not _vanishes(_of_step(replace(course, forces=f))))
    cause = next((forces.value for forces in causes), "")
    return Miss(degree, first, step, cause)


def _of_start(course: Course) -> State:
    """Return the residual of the state at step 1."""
    return _minus(course.start(), course.state(course.dt))


def _of_step(course: Course) -> State:
    """Return the residual of a step from the polynomial at time t."""
    t = course.names["t"]
    return _minus(course.step(course.state(t), t), course.state(t + course.dt))


def _minus(state: State, exact: State) -> State:
    return tuple(a - b for a, b in zip(state, exact, strict=True))


def _vanishes(state: State) -> bool:
    return all(x.leading is None for x in state)


def _leading(course: Course, residual: Callable[[Course], State]) -> Residual | None:
    """Return the leading term of the first nonzero entry of a residual: its power numerically, then symbolically."""
    from sympy import factor

    for index, number in enumerate(residual(course)):
        # skip terms that are due to rounding of a scheme's coefficients
        powers = (
            k
            for k in range(number.first, number.end)
            if abs(number.field.value(number.at(k))) > ROUNDED
        )
        power = next(powers, None)
        if power is not None:
            known = power + 1 + (KNOWN_POWERS - number.end)
            symbolic = with_symbols(course.stepper, course.model, course.degree, known)
            coefficient = factor(residual(symbolic)[index].at(power).as_expr())
            return Residual(OF[min(index, 2)], power, coefficient)
    return None


def fitted_force(stepper: Stepper, model: Model, degree: int) -> Any:
    """Return the force that must be added to the acceleration in steps, but not in the start, to reproduce polynomials.

    For centred differences with quadratic damping by the geometric mean and degree 2 it is ``-b c_2^2 dt^2/m``: the
    force F^n is reduced by ``b c_2^2 dt^2`` for n >= 1, and F^0 is unchanged (`errata`, 8.5).
    A SymPy expression in dt and the symbols of `Residual`. Raises ValueError if there is no such force.
    """
    from sympy import Symbol

    _refuse(model)
    course = with_symbols(stepper, model, degree, KNOWN_POWERS)
    without, with_force = (_of_step(replace(course, fitted=x))[0] for x in (0.0, 1.0))
    fitted = -without / (with_force - without)
    fits = _vanishes((*_of_start(course), *_of_step(replace(course, fitted=fitted))))
    # it must be a polynomial: no terms in the second half of the known powers
    if not fits or any(fitted.at(k) for k in range(fitted.end // 2, fitted.end)):
        raise ValueError(f"no force at the inner points makes degree {degree} exact")
    powers = range(fitted.first, fitted.end)
    return sum(fitted.at(k).as_expr() * Symbol("dt") ** k for k in powers)
