r"""Newton's method for the equations of one step of an implicit scheme.

Every scheme of `vibsim.schemes.implicit` and `vibsim.schemes.newmark` reduces to one unknown: the acceleration x at
the next point, with ``x = a(u + d_u x, v + d_v x, t)`` and known u, d_u, v, d_v. Newton's method uses the exact
derivative, ``1 - (d_u da/du + d_v da/dv)``, and iterates to round-off: the quasi-Newton method of the vibration text
(B), section 6.2, stopped at 1e-4, which spoiled its Crank-Nicolson rows (`errata`).

The iteration stops when the remaining error, estimated from the rate of convergence, is a few units in the last place
of the terms of the equation (E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, equation IV.8.10). A
linear force takes two iterations; the second confirms the first. If Newton's method cycles (a steep friction law), it
alternates with bisection between two points where the residual has opposite signs. If no solution is found the result
is NaN and the member fails there; a value that does not solve the equation is never returned. Large steps may have
several solutions: the result is the one that Newton's method reaches from the current acceleration.

With several coordinates the unknowns are all accelerations at one or two stages (`solver`),
``x_i = a(U_i, V_i, t_i)`` with ``U_i = u_i + sum_j d_u_ij x_j`` and V_i likewise. The Jacobian,
``1 - (d_u_ij da/du + d_v_ij da/dv)``, differs from the identity by O(dt^2), or O(dt) if the force depends on the
velocity, so it is eliminated without pivoting. A zero pivot or an iteration that does not converge gives NaN. There is
no bisection.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import product
from typing import Any, TypeVar

from vibsim.schemes.base import Acceleration, Slopes
from vibsim.schemes.code_generation import written

F = TypeVar("F")
Two = tuple[float, float]
Four = tuple[float, float, float, float]

TOLERANCE = 2.0**-51
"""Largest remaining error, relative to the terms of the equation."""
STALLED = 2.0**-30
"""Largest correction that counts as round-off once corrections stop decreasing, relative to the same terms."""
LEAST = 2.0**-1022
"""Absolute tolerance: the smallest normal number, because `TOLERANCE` times a smaller one may underflow."""
MAX_NEWTON = 12
"""Newton iterations before bisection takes part."""
MAX_NEWTON_SYSTEM = 50
"""Newton iterations before a system counts as unsolvable."""
ONE_SIDED = 8
"""Iterations on one side of the solution after which the search widens."""
WIDENINGS = 3
"""Number of widenings, each twice as far as the one before."""
MAX_BISECTION = 200
"""Iterations before the equation counts as unsolvable; every second one halves the interval."""


def alone(function: F) -> F:
    """Mark a function that a kernel compiles separately instead of inlining it: start and step share it."""
    return function


@alone
def solved(
    x: float, u: float, d_u: float, v: float, d_v: float, t: float, p: Any, acceleration: Acceleration, slopes: Slopes
) -> float:  # fmt: skip
    """Return the solution of ``x = acceleration(u + d_u x, v + d_v x, t, p)`` from the initial guess x; NaN if none.

    It also runs on exact numbers, for which a correction is either 0 or too large.
    """
    guess, before = x, 0.0
    for k in range(MAX_NEWTON):
        here, speed = u + d_u * x, v + d_v * x
        force = acceleration(here, speed, t, p)
        by_u, by_v = slopes(here, speed, t, p)
        change = (x - force) / (1.0 - (d_u * by_u + d_v * by_v))
        scale = abs(force) + abs(by_u * here) + abs(by_v * speed)
        rate = change / before if k else 1.0
        x = x - change
        # NaN if x or a slope is infinite or NaN
        sound = (x - x) + (scale - scale)
        if sound != sound:
            break
        if not abs(change * rate) > TOLERANCE * scale + LEAST:
            return x
        if k and not abs(change) > STALLED * scale + LEAST and not abs(rate) < 0.5:
            return x
        before = change
    return bisected(guess, u, d_u, v, d_v, t, p, acceleration, slopes)


@alone
def bisected(
    x: float, u: float, d_u: float, v: float, d_v: float, t: float, p: Any, acceleration: Acceleration, slopes: Slopes
) -> float:  # fmt: skip
    """Solve the equation of `solved` by alternating Newton's method and bisection; return NaN if that fails."""
    below = above = math.nan
    change, scale, width = math.inf, 0.0, 0.0
    for k in range(MAX_BISECTION):
        here, speed = u + d_u * x, v + d_v * x
        force = acceleration(here, speed, t, p)
        by_u, by_v = slopes(here, speed, t, p)
        slope = 1.0 - (d_u * by_u + d_v * by_v)
        terms = abs(by_u * here) + abs(by_v * speed)
        # an infinite or zero slope is replaced by that of a constant force
        if not abs(slope) > 0.0 or not abs(slope) + terms < math.inf:
            slope, terms = 1.0, 0.0
        change, scale = (x - force) / slope, abs(force) + terms
        if not abs(change) > TOLERANCE * scale + LEAST:
            return x - change
        if x < force:
            below = x
        else:
            above = x
        ahead = x - change
        if below == below and above == above:
            if not (k % 2 == 0 and (ahead - below) * (ahead - above) < 0.0):
                ahead = 0.5 * (below + above)
        elif ONE_SIDED < k <= ONE_SIDED + WIDENINGS:
            # a nearly constant force has its solution about |x - a| away: search there, but no farther
            ahead = x + width if x < force else x - width
            width = 2.0 * width
        else:
            width = abs(x - force)
        x = ahead
    return x if abs(change) <= STALLED * scale + LEAST else math.nan


@alone
def solved_together(
    x: float, y: float, u: Two, d_u: Four, v: Two, d_v: Four, t: Two, p: Any, acceleration: Acceleration, slopes: Slopes
) -> Two:  # fmt: skip
    """Solve ``x = a(U_1, V_1, t_1)``, ``y = a(U_2, V_2, t_2)`` from initial guesses x and y; return NaN if that fails.

    ``U_i = u_i + d_u_i1 x + d_u_i2 y`` and V_i likewise; `d_u` and `d_v` are matrices in row-major order.
    """
    before = 0.0
    for k in range(MAX_NEWTON_SYSTEM):
        u_1, u_2 = u[0] + (d_u[0] * x + d_u[1] * y), u[1] + (d_u[2] * x + d_u[3] * y)
        v_1, v_2 = v[0] + (d_v[0] * x + d_v[1] * y), v[1] + (d_v[2] * x + d_v[3] * y)
        force_1, force_2 = acceleration(u_1, v_1, t[0], p), acceleration(u_2, v_2, t[1], p)
        a, b = slopes(u_1, v_1, t[0], p)
        c, d = slopes(u_2, v_2, t[1], p)
        j_11, j_12 = 1.0 - (a * d_u[0] + b * d_v[0]), -(a * d_u[1] + b * d_v[1])
        j_21, j_22 = -(c * d_u[2] + d * d_v[2]), 1.0 - (c * d_u[3] + d * d_v[3])
        off_1, off_2 = x - force_1, y - force_2
        determinant = j_11 * j_22 - j_12 * j_21
        d_x = (off_1 * j_22 - off_2 * j_12) / determinant
        d_y = (off_2 * j_11 - off_1 * j_21) / determinant
        x, y = x - d_x, y - d_y
        change = abs(d_x) if abs(d_x) > abs(d_y) else abs(d_y)
        scale = (
            abs(force_1) + abs(force_2) + abs(a * u_1) + abs(b * v_1) + abs(c * u_2) + abs(d * v_2)
        )
        rate = change / before if k else 1.0
        # `not >`, so that NaN ends the iteration as well
        if not change * rate > TOLERANCE * scale + LEAST:
            return x, y
        if k and not change > STALLED * scale + LEAST and not rate < 0.5:
            return x, y
        before = change
    return math.nan, math.nan


@cache
def solver(coordinates: int, stages: int) -> Callable[..., Any]:
    """Return the counterpart of `solved` (one stage) or `solved_together` (two) for several coordinates.

    Positions, velocities and accelerations are vectors; `slopes` returns the Jacobian of the accelerations with respect
    to the positions in row-major order, then that with respect to the velocities.
    """
    guesses = ", ".join(("x", "y")[:stages])
    name = f"solved_{'together_' if stages > 1 else ''}{coordinates}"
    nothing = f"vector({', '.join(['math.nan'] * coordinates)})"
    lines = [
        "@alone",
        f"def {name}({guesses}, u, d_u, v, d_v, t, p, acceleration, slopes):",
        "    before = 0.0",
        f"    for k in range({MAX_NEWTON_SYSTEM}):",
        *(f"        {line}" for line in _iteration(coordinates, stages)),
        "        rate = change / before if k else 1.0",
        "        # `not >`, so that NaN ends the iteration as well",
        "        if not change * rate > TOLERANCE * scale + LEAST:",
        f"            return {guesses}",
        "        if k and not change > STALLED * scale + LEAST and not rate < 0.5:",
        f"            return {guesses}",
        "        before = change",
        f"    return {', '.join([nothing] * stages)}",
    ]
    numbers = {"LEAST": LEAST, "STALLED": STALLED, "TOLERANCE": TOLERANCE}
    formulas = {name: repr(value) for name, value in numbers.items()}
    return written("\n".join(lines) + "\n", formulas, {"alone": alone, "math": math})


def _iteration(coordinates: int, stages: int) -> Iterator[str]:
    """Yield the lines of one iteration, which change the unknowns and set `change` and `scale`."""
    several, guesses = range(coordinates), ("x", "y")[:stages]
    unknowns = list(enumerate(product(range(stages), several)))

    def of_stage(name: str, *index: int) -> str:
        """Return the text of an entry of a vector or matrix over stages; with one stage, of the number itself."""
        place = sum(i * stages ** (len(index) - k) for k, i in enumerate(index, 1))
        return f"{name}[{place}]" if stages > 1 else name

    def slope(i: int, row: int, column: int, by: int) -> str:
        """Return the text of a derivative of an acceleration at stage i by a position (0) or a velocity (1)."""
        return f"slopes_{i}[{by * coordinates**2 + row * coordinates + column}]"

    terms = []
    for i in range(stages):
        for name, known, weights in (("place", "u", "d_u"), ("speed", "v", "d_v")):
            reach = (f"{of_stage(weights, i, j)} * {x}" for j, x in enumerate(guesses))
            yield f"{name}_{i} = {of_stage(known, i)} + ({' + '.join(reach)})"
        for name in ("acceleration", "slopes"):
            target = "force" if name == "acceleration" else name
            yield f"{target}_{i} = {name}(place_{i}, speed_{i}, {of_stage('t', i)}, p)"
        for c in several:
            terms.append(f"abs(force_{i}[{c}])")
            for e in several:
                terms.append(f"abs({slope(i, c, e, 0)} * place_{i}[{e}])")
                terms.append(f"abs({slope(i, c, e, 1)} * speed_{i}[{e}])")
    for row, (i, c) in unknowns:
        yield f"r_{row} = {guesses[i]}[{c}] - force_{i}[{c}]"
        for column, (j, e) in unknowns:
            by_u = f"{slope(i, c, e, 0)} * {of_stage('d_u', i, j)}"
            by_v = f"{slope(i, c, e, 1)} * {of_stage('d_v', i, j)}"
            yield f"m_{row}_{column} = {'1.0 - ' if row == column else '-'}({by_u} + {by_v})"
    yield from elimination(len(unknowns))
    for i, x in enumerate(guesses):
        step = ", ".join(f"r_{i * coordinates + c}" for c in several)
        yield f"{x} = {x} - vector({step})"
    yield "change = abs(r_0)"
    for row, _ in unknowns[1:]:
        yield f"change = abs(r_{row}) if abs(r_{row}) > change else change"
    # a NaN in any change is a NaN in the sum as well
    yield from _summed("total", [f"r_{row}" for row, _ in unknowns])
    yield "change = change + (total * 0.0)"
    yield from _summed("scale", terms)


def _summed(name: str, terms: Sequence[str]) -> Iterator[str]:
    """Yield the lines that sum `terms` into `name`, one term a line."""
    for i, term in enumerate(terms):
        yield f"{name} = {f'{name} + ' if i else ''}{term}"


def elimination(size: int) -> Iterator[str]:
    """Yield the lines that solve ``m x = r``, entries ``m_0_0, m_0_1, ...``, leaving the solution in ``r_0, ...``."""
    for k in range(size):
        for row in range(k + 1, size):
            yield f"factor = m_{row}_{k} / m_{k}_{k}"
            yield from (
                f"m_{row}_{j} = m_{row}_{j} - factor * m_{k}_{j}" for j in range(k + 1, size)
            )
            yield f"r_{row} = r_{row} - factor * r_{k}"
    for row in reversed(range(size)):
        yield from (f"r_{row} = r_{row} - m_{row}_{j} * r_{j}" for j in range(row + 1, size))
        yield f"r_{row} = r_{row} / m_{row}_{row}"
