r"""Newton's method for the equations that a step of an implicit scheme leaves, of several coordinates.

`vibsim.schemes.newton` has one coordinate; here the unknowns are the accelerations of all of them at one or two stages,
``x_i = a(U_i, V_i, t_i)`` with ``U_i = u_i + sum_j d_u_ij x_j`` and V_i likewise. The matrix of Newton's method,
``1 - (d_u_ij da/du + d_v_ij da/dv)``, differs from the unit matrix by O(dt^2), or O(dt) where the force depends on the
velocity: it is eliminated without a search for pivots. A pivot that vanishes ends the member, as does an iteration
without an end: never a value that does not solve the equations. It stops as `vibsim.schemes.newton` does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from itertools import product
from typing import Any

from vibsim.schemes.code_generation import written
from vibsim.schemes.newton import LEAST, MOST_TOGETHER, STALLED, TOLERANCE, alone

_NUMBERS = {
    "LEAST": repr(LEAST),
    "STALLED": repr(STALLED),
    "TOLERANCE": repr(TOLERANCE),
}


@cache
def solver(coordinates: int, stages: int) -> Callable[..., Any]:
    """Return what `vibsim.schemes.newton.solved` (one stage) or `solved_together` (two) is for several coordinates.

    Positions, velocities and accelerations are tuples, as long as there are coordinates; `slopes` returns the
    derivatives of every acceleration by every position, row by row, and then those by every velocity.
    """
    guesses = ("x", "y")[:stages]
    unknowns = list(product(range(stages), range(coordinates)))
    name = f"solved_{'together_' if stages > 1 else ''}{coordinates}"
    found = [f"({', '.join(f'x_{i}_{c}' for c in range(coordinates))})" for i in range(stages)]
    done = ", ".join(found)
    lines = [
        "@alone",
        f"def {name}({', '.join(guesses)}, u, d_u, v, d_v, t, p, acceleration, slopes):",
        *(f"    x_{i}_{c} = {guesses[i]}[{c}]" for i, c in unknowns),
        "    before = 0.0",
        f"    for k in range({MOST_TOGETHER}):",
        *(f"        {line}" for line in _iteration(coordinates, stages)),
        "        rate = change / before if k else 1.0",
        "        # `not >`, so that NaN ends it as well",
        "        if not change * rate > TOLERANCE * scale + LEAST:",
        f"            return {done}",
        "        if k and not change > STALLED * scale + LEAST and not rate < 0.5:",
        f"            return {done}",
        "        before = change",
        *(f"    x_{i}_{c} = math.nan" for i, c in unknowns),
        f"    return {done}",
    ]
    return written("\n".join(lines) + "\n", _NUMBERS, {"alone": alone, "math": math})


def _iteration(coordinates: int, stages: int) -> Iterator[str]:
    """Yield the lines of one iteration, which change the unknowns and set `change` and `scale`."""
    several = range(coordinates)
    unknowns = list(enumerate(product(range(stages), several)))

    def of_stage(name: str, *index: int) -> str:
        """Name an entry of a vector or matrix over stages; of one stage it is the number itself."""
        place = sum(i * stages ** (len(index) - k) for k, i in enumerate(index, 1))
        return f"{name}[{place}]" if stages > 1 else name

    def slope(i: int, row: int, column: int, by: int) -> str:
        """Name the derivative of an acceleration at stage i by a position (0) or a velocity (1)."""
        return f"slopes_{i}[{by * coordinates**2 + row * coordinates + column}]"

    terms = []
    for i in range(stages):
        for name, known, weights in (("place", "u", "d_u"), ("speed", "v", "d_v")):
            entries = []
            for c in several:
                reach = (f"{of_stage(weights, i, j)} * x_{j}_{c}" for j in range(stages))
                entries.append(f"{of_stage(known, i)}[{c}] + ({' + '.join(reach)})")
            yield f"{name}_{i} = ({', '.join(entries)})"
        for name in ("acceleration", "slopes"):
            found = "force" if name == "acceleration" else name
            yield f"{found}_{i} = {name}(place_{i}, speed_{i}, {of_stage('t', i)}, p)"
        for c in several:
            terms.append(f"abs(force_{i}[{c}])")
            for e in several:
                terms.append(f"abs({slope(i, c, e, 0)} * place_{i}[{e}])")
                terms.append(f"abs({slope(i, c, e, 1)} * speed_{i}[{e}])")
    for row, (i, c) in unknowns:
        yield f"r_{row} = x_{i}_{c} - force_{i}[{c}]"
        for column, (j, e) in unknowns:
            by_u = f"{slope(i, c, e, 0)} * {of_stage('d_u', i, j)}"
            by_v = f"{slope(i, c, e, 1)} * {of_stage('d_v', i, j)}"
            yield f"m_{row}_{column} = {'1.0 - ' if row == column else '-'}({by_u} + {by_v})"
    yield from elimination(len(unknowns))
    yield from (f"x_{i}_{c} = x_{i}_{c} - r_{row}" for row, (i, c) in unknowns)
    yield "change = abs(r_0)"
    for row, _ in unknowns[1:]:
        yield f"change = abs(r_{row}) if abs(r_{row}) > change else change"
    # a change that is no number is one in the sum as well
    yield f"change = change + (({' + '.join(f'r_{row}' for row, _ in unknowns)}) * 0.0)"
    yield f"scale = {' + '.join(terms)}"


def elimination(size: int) -> Iterator[str]:
    """Yield the lines that solve ``m x = r`` for ``m_0_0, m_0_1, ...``; the solution stands in ``r_0, ...`` then."""
    for k in range(size):
        for row in range(k + 1, size):
            yield f"factor = m_{row}_{k} / m_{k}_{k}"
            yield from (
                f"m_{row}_{j} = m_{row}_{j} - factor * m_{k}_{j}" for j in range(k + 1, size)
            )
            yield f"r_{row} = r_{row} - factor * r_{k}"
    for row in reversed(range(size)):
        rest = "".join(f" - m_{row}_{j} * r_{j}" for j in range(row + 1, size))
        yield f"r_{row} = (r_{row}{rest}) / m_{row}_{row}"
