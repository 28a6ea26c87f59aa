"""From (model, scheme) to one function that steps members: text first, then a lane.

A kernel is written out as one Python module that holds everything it runs: the elementary functions, the gathering,
the scheme's functions and the model's formulas. The *plain* lane runs that module as it stands, which needs no
compiler; the *compiled* lane runs the same module through numba, strictly (no contraction, no reassociation), so that
both give the same bits. The text is also the key of the cache: a changed formula, scheme or loop is another kernel.
"""

from __future__ import annotations

import ast
import inspect
import math
import types
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from vibsim import expression
from vibsim.engine import elementary, loop
from vibsim.engine.cache import Kernel, load
from vibsim.errors import SimulationError
from vibsim.models import Model
from vibsim.schemes import Stepper

_PLAIN = """\
def compiled(function):
    return function

entry = compiled
"""

_COMPILED = """\
from numba import njit

compiled = njit(error_model="numpy", nogil=True, forceinline=True)
entry = njit(error_model="numpy", nogil=True, cache=True)
"""

BOUND = ("start", "step", "backward", "acceleration", "energies", "parameters_of")
"""Functions that a kernel knows by name instead of being handed them: numba does not cache what is handed functions."""

ELEMENTARY: Mapping[str, Callable[..., float]] = {"sin": elementary.sin}
"""The functions that a model's formulas may call."""


@cache
def kernel(model: Model, stepper: Stepper, lane: str) -> Kernel:
    """Return the function that steps members of `model` by `stepper`.

    Parameters
    ----------
    lane
        ``plain`` or ``compiled``: the same bits at different speeds.

    Raises
    ------
    SimulationError
        Where the kernel cannot be compiled.
    """
    body = source(model, stepper)
    if lane == "plain":
        namespace: dict[str, Any] = {}
        exec(compile(_PLAIN + body, f"<{model.kind} kernel>", "exec"), namespace)
        plain: Kernel = namespace["kernel"]
        return plain
    return load(_COMPILED + body)


def source(model: Model, stepper: Stepper) -> str:
    """Return the text of the kernel of `model` and `stepper`, without the header that chooses its lane."""
    functions: dict[str, str] = {}
    for name, function in ELEMENTARY.items():
        _collect(function, name, functions)
    for name in ("start", "step", "backward"):
        _collect(getattr(stepper, name), name, functions)
    functions |= _formulas(model)
    _collect(loop.run, "kernel", functions)
    return "import math\n\n" + "\n\n".join(functions.values()) + "\n"


def _collect(function: Callable[..., Any], name: str, functions: dict[str, str]) -> None:
    """Write `function` under `name`, after whatever it uses of its own module.

    Names that a module binds to numbers, or tuples of numbers, are written out; functions are collected in their turn;
    ``math`` is imported by every kernel. Anything else is refused.
    """
    if not isinstance(function, types.FunctionType):
        raise SimulationError(f"{name} is no plain Python function, so it cannot enter a kernel")
    tree = ast.parse(inspect.cleandoc("\n" + inspect.getsource(function))).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise SimulationError(f"{name} is no function with a name, so it cannot enter a kernel")
    _strip(tree, name)
    local = set(function.__code__.co_varnames)
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} - local
    for other in sorted(used & function.__globals__.keys()):
        value = function.__globals__[other]
        if isinstance(value, types.FunctionType):
            if other not in functions:
                _collect(value, other, functions)
        elif _is_constant(value):
            _add(functions, other, f"{other} = {value!r}")
        elif value is not math:
            raise SimulationError(
                f"{name} uses {other}, which is no number, tuple of numbers or plain function"
            )
    mark = "entry" if name == "kernel" else "compiled"
    _add(functions, name, f"@{mark}\n{ast.unparse(tree)}")


def _is_constant(value: object) -> bool:
    if isinstance(value, tuple):
        return all(_is_constant(entry) for entry in value)
    return isinstance(value, int | float)


def _add(functions: dict[str, str], name: str, text: str) -> None:
    if functions.setdefault(name, text) != text:
        raise SimulationError(f"{name} means two things in one kernel")


def _strip(tree: ast.FunctionDef, name: str) -> None:
    """Rename a function; drop its docstring, its annotations, and the functions it is handed."""
    tree.name = name
    tree.returns = None
    tree.args.args = [argument for argument in tree.args.args if argument.arg not in BOUND]
    for argument in tree.args.args:
        argument.annotation = None
    if ast.get_docstring(tree) is not None:
        tree.body = tree.body[1:]
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        call.args = [
            argument for argument in call.args if getattr(argument, "id", None) not in BOUND
        ]


def _formulas(model: Model) -> dict[str, str]:
    """Write the model's acceleration and energies as functions of ``(u, v, t, p)``."""
    names = [parameter.name for parameter in model.parameters]
    unpack = [f"({', '.join(names)},) = p"] if names else []
    known = (model.position, model.velocity, "t", *names)
    arguments = f"{model.position}, {model.velocity}, t, p"

    def function(name: str, results: Mapping[str, str]) -> str:
        lines = list(unpack)
        for result, formula in results.items():
            lines += expression.to_statements(_parsed(formula, known), result)
        lines.append(f"return {', '.join(results)}")
        return f"@compiled\ndef {name}({arguments}):\n    " + "\n    ".join(lines)

    values = ", ".join(f"float(parameters[case, {i}])" for i in range(len(names))) or "0.0"
    return {
        "acceleration": function("acceleration", {"_result": model.acceleration}),
        "energies": function(
            "energies", {"_kinetic": model.kinetic_energy, "_potential": model.potential_energy}
        ),
        "parameters_of": f"@compiled\ndef parameters_of(parameters, case):\n    return ({values},)",
    }


def _parsed(formula: str, known: tuple[str, ...]) -> expression.Expression:
    """Read a formula, and refuse functions that the engine does not have."""
    tree = expression.parse(formula, known)
    for node in expression.walk(tree):
        if isinstance(node, expression.Call) and node.function not in ELEMENTARY:
            raise SimulationError(
                f"{formula}: the engine has no function {node.function}; it has "
                + ", ".join(ELEMENTARY)
            )
    return tree
