"""What a kernel has for a model with several coordinates: the scheme written out, and what moves tuples."""

from __future__ import annotations

from vibsim.core.errors import SimulationError
from vibsim.engine import gather
from vibsim.engine.coordinates import NUMBER, VECTOR, Kind, collect_system
from vibsim.engine.text import Module, collect
from vibsim.schemes.base import Stepper, no_backward


def put_scheme(module: Module, stepper: Stepper, count: int) -> None:
    """Write start, step and velocities of a scheme for `count` coordinates, and what is gathered of each.

    Raises
    ------
    SimulationError
        Where a function of the scheme has no meaning for vectors.
    """
    state: Kind = NUMBER
    if stepper.whole:
        for name in ("start", "step"):
            collect(module, getattr(stepper, name), name, {})
    else:
        state = _put_start(module, stepper, count)
        found = collect_system(module, stepper.step, "step", (state, NUMBER, NUMBER, NUMBER), count)
        if found != (state, VECTOR):
            raise SimulationError("a step returns another state than the start")
    backward = no_backward if stepper.whole else stepper.backward
    collect_system(module, backward, "backward", (state, NUMBER), count, returns=VECTOR)
    velocities = (NUMBER, VECTOR, VECTOR, VECTOR, VECTOR)
    collect_system(module, gather.end_velocity, "end_velocity", velocities, count)
    difference = gather.centred_difference
    collect_system(module, difference, difference.__name__, (VECTOR, VECTOR, NUMBER), count)
    put_moves(module, count)
    _put_further(module, count)


def put_moves(module: Module, count: int) -> None:
    """Write what reads positions and velocities from arrays with a row of each."""
    for name, place in (("initial_of", "values[k, {}]"), ("point_of", "values[{}, case, k]")):
        rows = [f"float({place.format(row)})" for row in range(2 * count)]
        head = "values, k" if name == "initial_of" else "values, case, k"
        halves = f"({', '.join(rows[:count])},), ({', '.join(rows[count:])},)"
        module.put(name, f"@compiled\ndef {name}({head}):\n    return {halves}")


def _put_start(module: Module, stepper: Stepper, count: int) -> Kind:
    """Write the start, for which `Stepper.scaling` multiplies the initial velocity; return the kind of its state."""
    kinds = (NUMBER, VECTOR, VECTOR, NUMBER, NUMBER)
    if stepper.scaling is None:
        return collect_system(module, stepper.start, "start", kinds, count)
    state = collect_system(module, stepper.start, "start_unscaled", kinds, count)
    scaled = ", ".join(f"v[{k}] * p[-1]" for k in range(count))
    module.put(
        "start",
        "@compiled\ndef start(variant, u, v, dt, p):\n"
        f"    return start_unscaled(variant, u, ({scaled},), dt, p)",
    )
    return state


def _put_further(module: Module, count: int) -> None:
    """Write what gathers extrema and norms of the coordinates behind the first one, and what adds up all sizes."""

    def function(head: str, line: str) -> None:
        module.put(head.partition("(")[0], f"@compiled\ndef {head}:\n    {line}")

    for text in (gather.first_extrema, gather.next_extrema, gather.note_extrema):
        collect(module, text, text.__name__, {})
    further = range(1, count)
    sizes = " + ".join(f"abs({name}[{k}])" for k in range(count) for name in ("u", "v"))
    function("size_of(u, v)", f"return {sizes}")
    first = ", ".join(f"first_extrema(u[{k}], v[{k}])" for k in further)
    function("first_further(u, v)", f"return ({first},)")
    ahead = ", ".join(f"next_extrema(further[{k - 1}], u[{k}], v[{k}], 0.0)" for k in further)
    function("next_further(further, u, v)", f"return ({ahead},)")
    notes = "\n    ".join(
        f"note_extrema(stats, case, {k * gather.N_STATS}, further[{k - 1}], 0.0, dt)"
        for k in further
    )
    function("note_further(stats, case, further, dt)", notes)
