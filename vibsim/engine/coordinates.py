"""Several coordinates: the text of a scheme for one coordinate works on vectors unchanged.

For a model with several coordinates positions, velocities and accelerations are vectors. Sums of vectors and products
with numbers are computed component by component, so that uncoupled coordinates have the same bits as each alone;
``abs`` is the Euclidean norm. Anything else (a product of two vectors, a comparison, a number added to a vector) is
refused. In compiled code a vector is a tuple of floats (`vibsim.native`), in plain Python a `Vector` of
`vibsim.schemes.step_numbers`.
"""

from __future__ import annotations

from vibsim.engine import gather
from vibsim.engine.text import Module, collect
from vibsim.schemes import newton
from vibsim.schemes.base import Stepper, no_backward


def put_vectors(module: Module, stepper: Stepper, count: int) -> None:
    """Write vector versions of functions of the schemes that work on numbers only."""
    used = stepper.step.__globals__
    for stages, function in enumerate((newton.solved, newton.solved_together), 1):
        if used.get(function.__name__) is function:
            collect(module, newton.solver(count, stages), function.__name__, {})
    if stepper.backward is no_backward:
        components = ", ".join(["math.nan"] * count)
        module.define("backward(state, dt)", f"return vector({components})")


def put_moves(module: Module, count: int) -> None:
    """Write the functions that read and write positions and velocities in arrays with a row for each component."""

    def joined(parts: list[str]) -> str:
        return f"vector({', '.join(parts)})" if count > 1 else parts[0]

    def components(name: str) -> list[str]:
        return [f"{name}[{k}]" for k in range(count)] if count > 1 else [name]

    for head, place in (
        ("initial_of(values, k)", "values[k, {}]"),
        ("point_of(values, case, k)", "values[{}, case, k]"),
    ):
        rows = [f"float({place.format(row)})" for row in range(2 * count)]
        module.define(head, f"return {joined(rows[:count])}, {joined(rows[count:])}")
    for head, parts in (
        ("put_components(samples, first, case, k, w)", components("w")),
        ("put_moving(samples, case, k, q, w)", components("q") + components("w")),
    ):
        first = "first + " if "first" in head else ""
        lines = (f"samples[{first}{row}, case, k] = {part}" for row, part in enumerate(parts))
        module.define(head, *lines)
    module.define("first_of(q)", f"return {components('q')[0]}")
    pairs = zip(components("q"), components("w"), strict=True)
    terms = [f"abs({part})" for pair in pairs for part in pair]
    # pairwise: a short chain of dependent additions, and no deep nesting
    while len(terms) > 1:
        terms = [f"({a} + {b})" for a, b in zip(terms[::2], terms[1::2], strict=False)] + terms[
            len(terms) - len(terms) % 2 :
        ]
    module.define("size_of(q, w)", f"return {terms[0]}")


def put_further(module: Module, count: int) -> None:
    """Write the functions that gather the extrema of the coordinates after the first."""
    for text in (gather.first_extrema, gather.next_extrema, gather.note_extrema):
        collect(module, text, text.__name__, {})
    further = range(1, count)
    first = "".join(f"first_extrema(q[{k}], w[{k}]), " for k in further)
    module.define("first_further(q, w)", f"return ({first})")
    ahead = "".join(f"next_extrema(further[{k - 1}], q[{k}], w[{k}], 0.0), " for k in further)
    module.define("next_further(further, q, w)", f"return ({ahead})")
    notes = (
        f"note_extrema(stats, case, {k * gather.N_STATS}, further[{k - 1}], 0.0)" for k in further
    )
    module.define("note_further(stats, case, further)", "pass", *notes)
