"""Code generation: source text of steps from a tableau or coefficients, and of starts from steps.

The text is registered with `linecache`, so that the engine, tracebacks and debuggers can read it like any other source.

Coefficients are formulas such as ``"1/2 - sqrt(3)/6"``. The function uses their values as floats, by name; the theory
reads the formulas themselves, to be exact (`exact_names`).
"""

from __future__ import annotations

import hashlib
import inspect
import linecache
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from types import FunctionType
from typing import Any

from vibsim.formula import constant
from vibsim.schemes.base import HANDED, Stepper


def written(
    text: str, formulas: Mapping[str, str] | None = None, functions: Mapping[str, Any] | None = None
) -> FunctionType:
    """Return the function that `text` defines; equal arguments give the same object.

    The text is a single ``def`` that uses ``+ - * /`` and comparisons. `formulas` give the constants that it uses by
    name (functions of one scheme must agree on them), `functions` the functions that it calls, or `math`.
    """
    return _written(text, tuple((formulas or {}).items()), tuple(sorted((functions or {}).items())))


@cache
def _written(
    text: str, formulas: tuple[tuple[str, str], ...], functions: tuple[tuple[str, Any], ...]
) -> FunctionType:
    values = {name: constant(formula) for name, formula in formulas}
    digest = hashlib.sha256(f"{text}{formulas}".encode()).hexdigest()[:16]
    file = f"<vibsim scheme {digest}>"
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    before = {"__name__": __name__, **values, **dict(functions)}
    namespace: dict[str, Any] = dict(before)
    exec(compile(text, file, "exec"), namespace)
    (function,) = (
        value
        for name, value in namespace.items()
        if isinstance(value, FunctionType) and name not in before
    )
    _FORMULAS[function] = dict(formulas)
    return function


def weighted(
    prefix: str, weights: Sequence[str], names: Sequence[str], formulas: dict[str, str]
) -> str:
    """Return the text of a weighted sum of names; weights other than 0 and 1 join `formulas` as ``prefix_1``, ..."""
    terms = []
    for j, (weight, name) in enumerate(zip(weights, names, strict=True), 1):
        if weight not in ("0", "1"):
            formulas[f"{prefix}_{j}"] = weight
            terms.append(f"{prefix}_{j} * {name}")
        elif weight == "1":
            terms.append(name)
    return " + ".join(terms)


_FORMULAS: dict[FunctionType, Mapping[str, str]] = {}


def exact_names(function: Callable[..., Any]) -> Mapping[str, str]:
    """Return the formulas of a generated function's constants by name; empty for any other function."""
    return _FORMULAS.get(function, {}) if isinstance(function, FunctionType) else {}


def self_starting(step: Callable[..., Any], *, carries_acceleration: bool = False) -> Stepper:
    """Return the arithmetic of a one-step method from its step (`Stepper.step`): the start is the first step.

    The state is (u, v), or (u, v, a) if the acceleration at the end of a step is reused by the next one.
    """
    handed = [name for name in HANDED if name in inspect.signature(step).parameters]
    arguments = ", ".join(["dt", "p", *handed])
    state = "u, v, acceleration(u, v, 0.0, p)" if carries_acceleration else "u, v"
    start = written(
        f"def start_one_step(variant, u, v, {arguments}):\n"
        f"    following, velocity = {step.__name__}(({state}), 0.0, {arguments})\n"
        "    return following\n",
        functions={step.__name__: step},
    )
    stepper = Stepper(start, step)
    if not carries_acceleration:
        return stepper
    return replace(stepper, carried=lambda u, v, a, t, dt: (u(t), v(t), a(t)))
