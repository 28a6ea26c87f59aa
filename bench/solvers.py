"""The other solvers: each function takes release angles, the end and a tolerance, and returns what solves all members.

What a user prepares once (compiling, building an integrator) is done before the function returns. Imported by
`bench.worker`, in an environment that may lack any of the libraries.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Solve = Callable[[], Floats]


def _pendulum(t: float, y: Any) -> list[float]:
    return [y[1], -math.sin(y[0])]


def _solve_ivp(method: str, theta: Floats, end: float, tolerance: float) -> Solve:
    from scipy.integrate import solve_ivp

    def one(angle: float) -> float:
        found = solve_ivp(
            _pendulum, (0.0, end), [angle, 0.0], method=method, rtol=tolerance, atol=tolerance
        )
        return float(found.y[0, -1]) if found.success else math.nan

    return lambda: np.array([one(angle) for angle in theta.tolist()])


def dop853(theta: Floats, end: float, tolerance: float) -> Solve:
    """SciPy's solve_ivp, the explicit method of order 8."""
    return _solve_ivp("DOP853", theta, end, tolerance)


def lsoda(theta: Floats, end: float, tolerance: float) -> Solve:
    """SciPy's solve_ivp with ODEPACK's multistep methods."""
    return _solve_ivp("LSODA", theta, end, tolerance)


def odeint(theta: Floats, end: float, tolerance: float) -> Solve:
    """SciPy's older interface to the same multistep methods."""
    from scipy.integrate import odeint as run

    times = np.array([0.0, end])

    def one(angle: float) -> float:
        y = run(
            _pendulum,
            [angle, 0.0],
            times,
            rtol=tolerance,
            atol=tolerance,
            mxstep=100_000,
            tfirst=True,
        )
        return float(y[-1, 0])

    return lambda: np.array([one(angle) for angle in theta.tolist()])


@cache
def _numbalsoda_loop() -> Any:
    """Compile the loop over members once for all tolerances."""
    from numba import cfunc, njit
    from numbalsoda import lsoda as run
    from numbalsoda import lsoda_sig

    @cfunc(lsoda_sig)
    def right(t: Any, y: Any, dy: Any, p: Any) -> None:
        dy[0] = y[1]
        dy[1] = -math.sin(y[0])

    address, data = right.address, np.array([0.0])

    @njit
    def loop(angles: Any, times: Any, tolerance: float, out: Any) -> None:
        for i in range(len(angles)):
            start = np.array([angles[i], 0.0])
            y, success = run(address, start, times, data, tolerance, tolerance, 100_000)
            out[i] = y[-1, 0] if success else np.nan

    # the function behind the address lives as long as this
    loop.right = right  # type: ignore[attr-defined]
    return loop


def numbalsoda(theta: Floats, end: float, tolerance: float) -> Solve:
    """LSODA in C++, called from a compiled loop with a compiled right-hand side."""
    loop, times, out = _numbalsoda_loop(), np.array([0.0, end]), np.empty_like(theta)

    def solve() -> Floats:
        loop(theta, times, tolerance, out)
        return out

    return solve


def _heyoka_system() -> Any:
    import heyoka as hy

    x, v = hy.make_vars("x", "v")
    return [(x, v), (v, -hy.sin(x))]


def heyoka(theta: Floats, end: float, tolerance: float) -> Solve:
    """Taylor series of high order, compiled; one integrator that is set back for each member."""
    import heyoka as hy

    integrator = hy.taylor_adaptive(_heyoka_system(), [1.0, 0.0], tol=tolerance)
    out = np.empty_like(theta)

    def solve() -> Floats:
        for i, angle in enumerate(theta):
            integrator.time = 0.0
            integrator.state[:] = (angle, 0.0)
            integrator.propagate_until(end)
            out[i] = integrator.state[0]
        return out

    return solve


def heyoka_batch(theta: Floats, end: float, tolerance: float) -> Solve:
    """The same with a batch of members in the vector registers."""
    import heyoka as hy

    width = hy.recommended_simd_size()
    padded = np.append(theta, np.full(-len(theta) % width, theta[-1]))
    rows = padded.reshape(-1, width)
    integrator = hy.taylor_adaptive_batch(
        _heyoka_system(), np.array([rows[0], np.zeros(width)]), tol=tolerance
    )
    out = np.empty_like(rows)

    def solve() -> Floats:
        for i, row in enumerate(rows):
            integrator.set_time(0.0)
            integrator.state[0] = row
            integrator.state[1] = 0.0
            integrator.propagate_until(end)
            out[i] = integrator.state[0]
        return out.ravel()[: len(theta)]

    return solve


@cache
def _diffrax_run(is_one: bool) -> Any:
    """Trace once for all tolerances; what is compiled depends on the number of members alone."""
    import diffrax as dx
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    term = dx.ODETerm(lambda t, y, args: jnp.stack([y[1], -jnp.sin(y[0])]))

    def one(angle: Any, end: Any, tolerance: Any) -> Any:
        found = dx.diffeqsolve(
            term,
            dx.Dopri8(),
            0.0,
            end,
            0.01,
            jnp.stack([angle, jnp.zeros_like(angle)]),
            saveat=dx.SaveAt(t1=True),
            stepsize_controller=dx.PIDController(rtol=tolerance, atol=tolerance),
            max_steps=100_000,
        )
        return found.ys[0, 0]

    if is_one:
        return jax.jit(lambda angles, end, tolerance: one(angles[0], end, tolerance)[None])
    return jax.jit(jax.vmap(one, in_axes=(0, None, None)))


def diffrax(theta: Floats, end: float, tolerance: float) -> Solve:
    """Dormand and Prince of order 8 in JAX with double precision, compiled, mapped over the members."""
    run = _diffrax_run(len(theta) == 1)
    return lambda: np.asarray(run(theta, end, tolerance).block_until_ready())
