"""Several coordinates: a scheme that is written for one coordinate stands for vectors as it is.

In the text of a scheme every position, velocity and acceleration is one number. For a model with several coordinates
they are vectors. A sum of vectors, a number times a vector, and ``abs`` of a vector, which is its Euclidean norm, are
worked out component by component, so that uncoupled coordinates move as each would alone, to the last bit. Anything
else (a product of two vectors, a comparison, a number added to a vector) is refused. In compiled code every tuple of
floats is a vector (`vibsim.native`), in plain Python a `Vector` is one.
"""

from __future__ import annotations

import math
from functools import reduce
from operator import add, neg, sub
from typing import Any, NoReturn

from vibsim.core.errors import SimulationError
from vibsim.engine import gather
from vibsim.engine.text import Module, collect, divided
from vibsim.schemes import newton
from vibsim.schemes.base import Stepper, no_backward


class Vector(tuple[float, ...]):
    """A vector in the plain lane."""

    __slots__ = ()

    def __add__(self, other: Any) -> Vector:
        return Vector(map(add, self, self._vector(other)))

    def __sub__(self, other: Any) -> Vector:
        return Vector(map(sub, self, self._vector(other)))

    def __mul__(self, number: Any) -> Vector:
        return Vector([a * self._number(number) for a in self])

    __rmul__ = __mul__

    def __truediv__(self, number: Any) -> Vector:
        return Vector([divided(a, self._number(number)) for a in self])

    def __repr__(self) -> str:
        return f"vector{tuple(self)}"

    def __neg__(self) -> Vector:
        return Vector(map(neg, self))

    def __abs__(self) -> float:
        return math.sqrt(reduce(add, [a * a for a in self]))

    def _vector(self, other: Any) -> Vector:
        return other if isinstance(other, Vector) else self._refuse()

    def _number(self, other: Any) -> float:
        return self._refuse() if isinstance(other, Vector) else other

    def _refuse(self, *_: Any) -> NoReturn:
        raise SimulationError("an operation of the scheme has no meaning for vectors")

    __lt__ = __le__ = __gt__ = __ge__ = __radd__ = __rsub__ = __rtruediv__ = _refuse


def vector(*components: float) -> Vector:
    """Return a vector: what the text of a kernel calls by this name."""
    return Vector(components)


def put_vectors(module: Module, stepper: Stepper, count: int) -> None:
    """Write what a kernel for `count` coordinates needs beside the text of the scheme and the loop."""
    used = stepper.step.__globals__
    for stages, function in enumerate((newton.solved, newton.solved_together), 1):
        if used.get(function.__name__) is function:
            collect(module, newton.solver(count, stages), function.__name__, {})
    if stepper.backward is no_backward:
        components = ", ".join(["math.nan"] * count)
        module.define("backward(state, dt)", f"return vector({components})")
    put_moves(module, count)
    for text in (gather.first_extrema, gather.next_extrema, gather.note_extrema):
        collect(module, text, text.__name__, {})
    further = range(1, count)
    sizes = " + ".join(f"abs({name}[{k}])" for k in range(count) for name in ("u", "v"))
    module.define("size_of(u, v)", f"return {sizes}")
    first = ", ".join(f"first_extrema(u[{k}], v[{k}])" for k in further)
    module.define("first_further(u, v)", f"return ({first},)")
    ahead = ", ".join(f"next_extrema(further[{k - 1}], u[{k}], v[{k}], 0.0)" for k in further)
    module.define("next_further(further, u, v)", f"return ({ahead},)")
    notes = (
        f"note_extrema(stats, case, {k * gather.N_STATS}, further[{k - 1}], 0.0)" for k in further
    )
    module.define("note_further(stats, case, further)", *notes)


def put_moves(module: Module, count: int) -> None:
    """Write what reads positions and velocities from arrays with a row of each."""
    for head, place in (
        ("initial_of(values, k)", "values[k, {}]"),
        ("point_of(values, case, k)", "values[{}, case, k]"),
    ):
        rows = [f"float({place.format(row)})" for row in range(2 * count)]
        halves = (", ".join(half) for half in (rows[:count], rows[count:]))
        module.define(head, f"return {', '.join(f'vector({half})' for half in halves)}")
