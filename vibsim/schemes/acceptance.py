"""What a scheme from outside must satisfy before it is added."""

from __future__ import annotations

import ast
import inspect
import math
from typing import Any

from vibsim.schemes.base import Scheme, Stepper, handed
from vibsim.schemes.orders import Orders
from vibsim.schemes.step_numbers import (
    HIGHEST_POWER,
    MOST_COMPARISONS,
    POWER_RULE,
    EndlessStepError,
    Plain,
    counting,
    small_power,
)

STEP_RULE = (
    f"it may use + - * /, whole powers up to **{HIGHEST_POWER}, abs and comparisons, takes "
    "(state, t, dt, p, acceleration), and returns two things, the next state as a tuple and the velocity"
)
STEP_BACK = 1e-9
"""Largest distance after two steps of length 1/2 and two back that counts as round-off and unfinished iterations."""


def fault_of(scheme: Scheme) -> str:
    """Return why a scheme from an installed package cannot be added; empty if it can."""
    if scheme.adaptive:
        return "a scheme that chooses its own steps cannot be added"
    options = scheme.defaults()
    stepper: object = scheme.stepper(options)
    if not isinstance(stepper, Stepper):
        return "its stepper must return a vibsim.schemes.Stepper"
    for u, v in ((1.0, 0.0), (-1.0, 0.5), (1.0, -0.5)):
        try:
            fault = _fault_of_step(stepper, u, v)
        except EndlessStepError as error:
            return f"{error}: it made more than {MOST_COMPARISONS} comparisons at w dt = 0.1"
        except Exception as error:
            return f"its step cannot be run ({type(error).__name__}: {error}): {STEP_RULE}"
        if fault:
            return fault
    if fault := _fault_of_text(stepper):
        return fault
    if not isinstance(scheme.orders(options), Orders):
        return "its orders must return a vibsim.schemes.orders.Orders"
    if scheme.even_powers is True and _missed_on_the_way_back(scheme) > STEP_BACK:
        return "its even_powers is True, but a step back does not undo a step"
    return ""


def _fault_of_text(stepper: Stepper) -> str:
    """Return what the text of a scheme's functions shows to be at fault; empty if nothing, or if there is no text."""
    for function in (stepper.start, stepper.step, stepper.backward):
        if function.__name__ == "<lambda>":
            return "its start, step and backward must be functions written with def, not lambda"
        try:
            tree = ast.parse(inspect.cleandoc("\n" + inspect.getsource(function)))
        except (OSError, TypeError, SyntaxError):
            continue
        for node in ast.walk(tree):
            if not (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)):
                continue
            if not small_power(node):
                return f"its {function.__name__} has {ast.unparse(node)}: {POWER_RULE}"
    return ""


def _fault_of_step(stepper: Stepper, u: float, v: float) -> str:
    """Return what is wrong with the results of start and step; empty if nothing.

    They run on numbers that offer no more than a step may use, so that they raise an error where they use more.
    """
    forces: Any = (lambda u, v, t, p: -u, lambda u, v, t, p: (Plain(-1.0), Plain(0.0)))
    start, step = (counting(handed(f, *forces)) for f in (stepper.start, stepper.step))
    state = start(stepper.variant, Plain(u), Plain(v), Plain(0.1), ())
    made: Any = step(state, Plain(0.1), Plain(0.1), ())
    shapes = [len(part) if isinstance(part, tuple) else 0 for part in made]
    if shapes != [len(state), 0]:
        return "its step must return the next state, as long as that of the start, and the velocity"
    numbers = [Plain.lift(number).nearest for number in (*state, *made[0], made[1])]
    if not all(map(math.isfinite, numbers)):
        return f"its step gives a number that is not finite, from u = {u:g} and v = {v:g} with w dt = 0.1"
    return ""


def _missed_on_the_way_back(scheme: Scheme) -> float:
    """Return the distance from the initial values after two steps, a new start from there and two back."""
    stepper, drag = scheme.stepper(scheme.defaults()), 0.2 if scheme.velocity_forces else 0.0
    force = (
        lambda u, v, t, p: -u - u * u * u - drag * v,
        lambda u, v, t, p: (-1 - 3 * u * u, -drag),
    )
    start, step = (handed(function, *force) for function in (stepper.start, stepper.step))
    u, v = initial = 0.8, 0.5
    for dt in (0.5, -0.5):
        state: Any = start(stepper.variant, u, v, dt, ())
        state = step(state, dt, dt, ())[0]
        u, v = state[0], step(state, 2.0 * dt, dt, ())[1]
    return max(abs(u - initial[0]), abs(v - initial[1]))
