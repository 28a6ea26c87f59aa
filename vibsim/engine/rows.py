"""Text of the functions that move numbers into and out of the rows of `vibsim.engine.block_loop`."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy

from vibsim.engine import block_loop, gather
from vibsim.engine.stages import kept_names, stages
from vibsim.engine.text import Module, enter
from vibsim.schemes.base import Stepper


def texts(states: int, parameters: int, rows: Mapping[str, object]) -> dict[str, str]:
    """Return the functions that move tuples, by their names; `rows` has the numbers of the rows."""

    def function(head: str, *lines: str) -> str:
        return f"@compiled\ndef {head}:\n    " + "\n    ".join(lines)

    def places(first: object, count: int) -> list[str]:
        return [f"rows[({first} + {i}) * {block_loop.LANES} + j]" for i in range(count)]

    def get(name: str, argument: str, first: object, count: int) -> str:
        return function(
            f"{name}(rows, {argument}j)", f"return ({', '.join(places(first, count)) or '0.0'},)"
        )

    def put(name: str, argument: str, first: object, count: int) -> str:
        lines = (f"{where} = values[{i}]" for i, where in enumerate(places(first, count)))
        return function(f"{name}(rows, {argument}j, values)", *lines)

    whole = " + ".join(f"state[{i}]" for i in range(states))
    return {
        "states_in": get("states_in", "first, ", "first", states),
        "put_states": put("put_states", "first, ", "first", states),
        "extrema_in": get("extrema_in", "", rows["EXTREMA"], gather.N_EXTREMA),
        "put_extrema": put("put_extrema", "", rows["EXTREMA"], gather.N_EXTREMA),
        "parameters_in": get("parameters_in", "", rows["FIRST_PARAMETER"], parameters),
        "total": function("total(state)", f"return {whole}"),
    }


def put_stages(
    module: Module, stepper: Stepper, renamed: Mapping[str, str], rows: Mapping[str, object]
) -> None:
    """Write the stages of a step as functions, and the loops over lanes that take all but the last."""
    places = {
        name: f"rows[({rows['FIRST_KEPT']} + {i}) * {block_loop.LANES} + j]"
        for i, name in enumerate(kept_names(stepper.step))
    }
    lines = ["def stages_of(rows, old, filled, n):"]
    *parts, last = stages(stepper.step)
    for i, part in enumerate(parts, 1):
        enter(module, stepper.step, deepcopy(part.tree), f"stage_{i}", renamed)
        kept = "".join(f"{places[name]}, " for name in part.before)
        lines += [
            "    for j in range(filled):",
            f"        h = rows[{rows['DT']} * {block_loop.LANES} + j]",
            f"        p_{i}, state_{i} = parameters_in(rows, j), states_in(rows, old, j)",
            f"        values_{i} = stage_{i}(state_{i}, n * h, h, p_{i}, ({kept}))",
            *(f"        {places[name]} = values_{i}[{k}]" for k, name in enumerate(part.after)),
        ]
    enter(module, stepper.step, deepcopy(last.tree), "step_end", renamed)
    module.put("stages_of", "\n".join(["@compiled", *lines]))
    kept = "".join(f"{places[name]}, " for name in last.before)
    module.put("kept_in", f"@compiled\ndef kept_in(rows, j):\n    return ({kept})")
