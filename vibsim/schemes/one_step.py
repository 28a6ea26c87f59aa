"""One-step methods: the state is (u, v), the velocity is the scheme's own, and it needs no other first step.

A method that begins a step with the acceleration which the step before ended with carries it as a third entry.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from vibsim.schemes.base import HANDED, Stepper
from vibsim.schemes.written import written


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
    return Stepper(start, step, implicit=implicit)
