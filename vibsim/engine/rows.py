"""Text of the functions that read and write the rows of `vibsim.engine.block_loop`."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy

from vibsim.engine import gather
from vibsim.engine.block_loop import LANES
from vibsim.engine.stages import kept_names, stages
from vibsim.engine.text import Module, enter
from vibsim.schemes.base import Stepper


def put_rows(module: Module, states: int, parameters: int, begin: Mapping[str, object]) -> None:
    """Write the functions that read and write tuples; `begin` has the offsets of rows."""
    for name, argument, first, count in (
        ("states", "first, ", "first", states),
        ("extrema", "", begin["EXTREMA"], gather.N_EXTREMA),
        ("parameters", "", begin["FIRST_PARAMETER"], parameters),
    ):
        places = [f"rows[{first} + {i * LANES} + j]" for i in range(count)]
        module.define(f"{name}_in(rows, {argument}j)", f"return ({', '.join(places) or '0.0'},)")
        if name != "parameters":
            lines = (f"{place} = values[{i}]" for i, place in enumerate(places))
            module.define(f"put_{name}(rows, {argument}j, values)", *lines)
    module.define("total(state)", "return " + " + ".join(f"state[{i}]" for i in range(states)))


def put_stages(
    module: Module, stepper: Stepper, renamed: Mapping[str, str], begin: Mapping[str, object]
) -> None:
    """Write the stages of a step as functions, and ``stages_of`` with a loop over lanes for each stage but the last."""
    places = {
        name: f"rows[{begin['FIRST_KEPT']} + {i * LANES} + j]"
        for i, name in enumerate(kept_names(stepper.step))
    }
    lines = ["def stages_of(rows, old, filled, n):"]
    *parts, last = stages(stepper.step)
    for i, part in enumerate(parts, 1):
        enter(module, stepper.step, deepcopy(part.tree), f"stage_{i}", renamed)
        kept = "".join(f"{places[name]}, " for name in part.before)
        lines += [
            "    for j in range(filled):",
            f"        h = rows[{begin['DT']} + j]",
            f"        p_{i}, state_{i} = parameters_in(rows, j), states_in(rows, old, j)",
            f"        values_{i} = stage_{i}(state_{i}, n * h, h, p_{i}, ({kept}))",
            *(f"        {places[name]} = values_{i}[{k}]" for k, name in enumerate(part.after)),
        ]
    enter(module, stepper.step, deepcopy(last.tree), "step_end", renamed)
    module.put("stages_of", "\n".join(["@compiled", *lines]))
    kept = "".join(f"{places[name]}, " for name in last.before)
    module.define("kept_in(rows, j)", f"return ({kept})")
