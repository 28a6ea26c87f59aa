r"""Which polynomials a scheme reproduces exactly, and why it does not reproduce the next one.

A polynomial is reproduced where the positions that the scheme computes lie on it for any time step. Whatever else
follows from the functions of the scheme itself, in exact numbers (`vibsim.theory.polynomial`):

- the *first step* is what its start makes of the initial values, less the state that moves along the polynomial;
- a *step* begins on that state, at any time t, and its residual is what it then is off by;
- the *cause* of a step's residual is the first of these in which it is there: the motion without forces, so that the
  scheme's differences or sums are at fault; with the forces on a body at rest, whose argument is then wrong within
  the step; with damping.

That holds as long as the velocity does not change its sign where a formula has its absolute value.

Source: vibration text (B), sections 2.2 and 8.5, problem 1 and exercise 9; `errata`, 8.5 and exercise 1 e.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from vibsim.models.base import Model
from vibsim.schemes.base import Stepper
from vibsim.theory.laurent import Laurent
from vibsim.theory.polynomial import (
    Course,
    Forces,
    is_rational,
    restoring,
    with_numbers,
    with_symbols,
)

HIGHEST_DEGREE = 8
"""Degree at which the search ends."""
KNOWN_POWERS = 12
"""Power of dt from which on nothing is known of a residual: twice that of any scheme at these degrees."""
FOLLOWED_STEPS = 4
"""Steps that a polynomial must be followed for: more than any scheme carries points."""
ROUNDED = 1e-13
"""Size of a term that is none: some schemes state their coefficients to 16 decimals."""
OF = ("position", "velocity", "state")
State = tuple[Laurent, ...]


@dataclass(frozen=True)
class Residual:
    """The first term of what a scheme is off by, ``coefficient dt^power``, computed less exact."""

    of: str
    """``position``; where that is exact, ``velocity`` or else ``state``, for what lies behind these two."""
    power: int
    coefficient: Any
    """Of SymPy, in the symbols t, c_0, c_1, ..., the parameters of the model and w_0, its natural frequency."""


@dataclass(frozen=True)
class Miss:
    """Why polynomials of a degree are not reproduced."""

    degree: int
    start: Residual | None
    """Of the first step; None where it is exact."""
    step: Residual | None
    """Of every further step."""
    cause: str
    """Of the residual of a step: a value of `Forces`; empty where it is exact."""


def applies(model: Model) -> bool:
    """Tell whether the acceleration of a model can be worked out in exact numbers, and never jumps."""
    if model.events is not None or not model.is_alone:
        return False
    return is_rational(restoring(model))


def _refuse(model: Model) -> None:
    if not applies(model):
        raise ValueError(f"the acceleration of {model.kind} has more than + - * /, powers and abs")


def reproduces(stepper: Stepper, model: Model, degree: int) -> bool:
    """Tell whether a scheme reproduces polynomials of a degree, as solutions of a model with a force for them.

    The stepper is that of `vibsim.schemes.Scheme.stepper_for`. ValueError where the model has no rational formulas.
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
    """Return the highest degree up to which polynomials are reproduced, -1 for none, `HIGHEST_DEGREE` for all tried."""
    missed = (d for d in range(HIGHEST_DEGREE + 1) if not reproduces(stepper, model, d))
    return next(missed, HIGHEST_DEGREE + 1) - 1


@lru_cache(maxsize=256)
def miss(stepper: Stepper, model: Model, degree: int) -> Miss:
    """Return what the first step and every further one are off by, on polynomials of a degree."""
    _refuse(model)
    course = with_numbers(stepper, model, degree, KNOWN_POWERS)
    first, step = (_residual(course, off) for off in (_first, _step))
    if step is None:
        return Miss(degree, first, step, "")
    acting = (forces for forces in Forces if _is_off(_step(replace(course, forces=forces))))
    cause = next((forces.value for forces in acting), "")
    return Miss(degree, first, step, cause)


def _first(course: Course) -> State:
    """Return what the state at step 1 is off by."""
    return _less(course.start(), course.state(course.dt))


def _step(course: Course) -> State:
    """Return what a step from the polynomial at time t is off by."""
    t = course.names["t"]
    return _less(course.step(course.state(t), t), course.state(t + course.dt))


def _less(state: State, exact: State) -> State:
    return tuple(a - b for a, b in zip(state, exact, strict=True))


def _is_off(state: State) -> bool:
    return any(x.leading is not None for x in state)


def _residual(course: Course, off: Callable[[Course], State]) -> Residual | None:
    """Return the first term of the first number of a state that is off; its power from a point, the rest in symbols."""
    from sympy import factor

    for index, number in enumerate(off(course)):
        # terms that are no rounding of a scheme's coefficients
        powers = (
            k
            for k in range(number.first, number.end)
            if abs(number.field.value(number.at(k))) > ROUNDED
        )
        power = next(powers, None)
        if power is not None:
            known = power + 1 + (KNOWN_POWERS - number.end)
            symbolic = with_symbols(course.stepper, course.model, course.degree, known)
            coefficient = factor(off(symbolic)[index].at(power).as_expr())
            return Residual(OF[min(index, 2)], power, coefficient)
    return None


def fitted_force(stepper: Stepper, model: Model, degree: int) -> Any:
    """Return what must be added to the acceleration of every step, but not of the start, to reproduce polynomials.

    Of centred differences with quadratic damping by the geometric mean and degree 2 it is ``-b c_2^2 dt^2/m``: the
    force F^n is reduced by ``b c_2^2 dt^2`` for n >= 1, and F^0 stays (`errata`, 8.5).
    An expression of SymPy in dt and the symbols of `Residual`; ValueError where no such force does it.
    """
    from sympy import Symbol

    _refuse(model)
    course = with_symbols(stepper, model, degree, KNOWN_POWERS)
    before, ahead = (_step(replace(course, fitted=x))[0] for x in (0.0, 1.0))
    fitted = -before / (ahead - before)
    fits = not _is_off((*_first(course), *_step(replace(course, fitted=fitted))))
    # it must not go on in the second half of what is known of it
    if not fits or any(fitted.at(k) for k in range(fitted.end // 2, fitted.end)):
        raise ValueError(f"no force at the inner points makes degree {degree} exact")
    powers = range(fitted.first, fitted.end)
    return sum(fitted.at(k).as_expr() * Symbol("dt") ** k for k in powers)
