"""One-step methods: the state is (u, v), the velocity is the scheme's own, and it needs no other first step.

A method that begins a step with the acceleration which the step before ended with carries it as a third entry.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from vibsim.schemes.base import HANDED, Function, Stepper, position_and_velocity
from vibsim.schemes.code_generation import written


def with_acceleration(u: Function, v: Function, a: Function, t: Any, dt: Any) -> Any:
    """Return ``(u, v, a)``."""
    return u(t), v(t), a(t)


def self_starting(
    step: Callable[..., Any], *, implicit: bool = False, carries_acceleration: bool = False
) -> Stepper:
    """Return the arithmetic of a one-step method from its step (`Stepper.step`).

    Parameters
    ----------
    carries_acceleration
        Whether the state is (u, v, a) rather than (u, v).
    """
    asked = [name for name in HANDED if name in inspect.signature(step).parameters]
    rest = ", ".join(["dt", "p", *asked])
    state = "u, v, acceleration(u, v, 0.0, p)" if carries_acceleration else "u, v"
    start = written(
        f"def start_one_step(variant, u, v, {rest}):\n"
        f"    following, velocity = {step.__name__}(({state}), 0.0, {rest})\n"
        "    return following\n",
        functions={step.__name__: step},
    )
    carried = with_acceleration if carries_acceleration else position_and_velocity
    return Stepper(start, step, implicit=implicit, carried=carried)
