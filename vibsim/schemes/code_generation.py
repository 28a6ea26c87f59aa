"""Functions written out from data: a tableau or coefficients become the text of a step, a step the text of its start.

The text is kept where Python looks for source (`linecache`), so that the engine, a traceback and a debugger read it
as they read any other function.

Coefficients are formulas such as ``"1/2 - sqrt(3)/6"``: the function has their values as floats, under the names that
its text uses, and the theory reads the formulas themselves, to be exact (`exact_names`).
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
    """Return the function that `text` defines; the same one for the same text.

    The text is one ``def``, in ``+ - * /`` and comparisons. `formulas` are those of the numbers that it uses by name
    (two functions of one scheme that share a name share its formula), `functions` what it calls, or `math`.
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
    """Write a sum of names with weights, which join `formulas` as ``prefix_1``, ...; weights 0 and 1 are left out."""
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
    """Return the formulas of the numbers that a function uses by name; none for one that was not written here."""
    return _FORMULAS.get(function, {}) if isinstance(function, FunctionType) else {}


def self_starting(
    step: Callable[..., Any], *, implicit: bool = False, carries_acceleration: bool = False
) -> Stepper:
    """Return the arithmetic of a one-step method, whose velocity is its own, from its step (`Stepper.step`).

    Where it carries the acceleration, with which the last step ended and a step begins, the state is (u, v, a).
    """
    taken = [name for name in HANDED if name in inspect.signature(step).parameters]
    rest = ", ".join(["dt", "p", *taken])
    state = "u, v, acceleration(u, v, 0.0, p)" if carries_acceleration else "u, v"
    start = written(
        f"def start_one_step(variant, u, v, {rest}):\n"
        f"    following, velocity = {step.__name__}(({state}), 0.0, {rest})\n"
        "    return following\n",
        functions={step.__name__: step},
    )
    stepper = Stepper(start, step, implicit=implicit)
    if not carries_acceleration:
        return stepper
    return replace(stepper, carried=lambda u, v, a, t, dt: (u(t), v(t), a(t)))
