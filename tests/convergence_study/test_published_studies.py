"""Grid studies from the literature, and methods of SciPy with fixed steps: numbers that nobody here computed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.integrate
from numpy.typing import NDArray

from vibsim import judge

Array = NDArray[np.float64]


def test_the_nasa_tutorial_on_spatial_convergence() -> None:
    """Pressure recovery of an inlet on three grids, with the numbers of the tutorial.

    Source: NASA Glenn Research Center, NPARC Alliance CFD Verification and Validation, "Examining Spatial (Grid)
    Convergence": order 1.786170, limit 0.97130, GCI 0.103083 % of the finest grid. The theoretical order is 2.
    """
    verdict = judge([1, 2, 4], [0.97050, 0.96854, 0.96178])
    assert verdict.order == pytest.approx(1.786170, abs=1e-6)
    assert verdict.best == pytest.approx(0.97130, abs=1e-5)
    assert verdict.gci == pytest.approx(0.00103083, abs=1e-8)
    assert judge([1, 2, 4], [0.97050, 0.96854, 0.96178], order=2).status != "PASS"


CELIK = {
    "reattachment length": ((18000, 8000, 4500), (6.063, 5.972, 5.863), 1.53, 6.1685, 0.022),
    "velocity, order below 1": ((18000, 4500, 980), (10.7880, 10.7250, 10.6050), 0.75, 10.8801, 0.011),
}  # fmt: skip


@pytest.mark.parametrize("name", CELIK)
def test_the_studies_of_celik_et_al(name: str) -> None:
    """Turbulent flow over a backward-facing step on three grids of N cells: order, limit and GCI of table 1.

    Source: I. B. Celik et al., Procedure for estimation and reporting of uncertainty due to discretization in CFD
    applications, J. Fluids Eng. 130, 078001 (2008).
    """
    cells, values, order, limit, gci = CELIK[name]
    verdict = judge([n**-0.5 for n in cells], values)
    assert verdict.order == pytest.approx(order, abs=0.01)
    assert verdict.best == pytest.approx(limit, abs=2e-3)
    assert verdict.gci == pytest.approx(gci, abs=5e-4)
    assert judge([n**-0.5 for n in cells], values, order=2).status != "PASS"


def test_the_oscillating_study_of_celik_et_al_shows_no_order() -> None:
    """The third study of table 1: its differences change sign, so that the printed order (1.51) is none of a power."""
    verdict = judge([n**-0.5 for n in (18000, 4500, 980)], [6.0042, 5.9624, 6.0909])
    assert verdict.status == "INCONCLUSIVE"
    assert verdict.order is None
    assert verdict.best is None


def pendulum(_: float, y: Array) -> list[float]:
    return [float(y[1]), -float(np.sin(y[0]))]


def fixed_steps(method: type[Any], n: int) -> float:
    """The angle of a pendulum after n steps of a Runge-Kutta method of SciPy, without its step control."""
    h = 4.0 / n
    solver = method(pendulum, 0.0, [1.0, 0.0], 4.0, first_step=h, max_step=h, rtol=1e3, atol=1e3)
    for _ in range(n):
        solver.step()
    assert solver.t == pytest.approx(4.0)
    assert solver.status == "finished"
    return float(solver.y[0])


@pytest.mark.parametrize(
    ("method", "order", "counts"),
    [
        (scipy.integrate.RK23, 3, (32, 64, 128, 256)),
        (scipy.integrate.RK45, 5, (16, 32, 64, 128)),
    ],
    ids=lambda x: getattr(x, "__name__", ""),
)
def test_the_methods_of_scipy_have_their_order(
    method: type[Any], order: int, counts: tuple[int, ...]
) -> None:
    h = [4.0 / n for n in counts]
    values = [fixed_steps(method, n) for n in counts]
    for least in (order - 1, order):
        assert judge(h, values, at_least=least).status != "FAIL"
    verdict = judge(h, values)
    assert verdict.order == pytest.approx(order, abs=0.6)
    tight = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}
    exact = scipy.integrate.solve_ivp(pendulum, (0.0, 4.0), [1.0, 0.0], **tight)
    if verdict.error is not None and verdict.error_bound is not None:
        true = abs(values[-1] - exact.y[0, -1])
        assert abs(verdict.error) == pytest.approx(true, rel=0.5)
    assert judge(h, values, order=order - 2).status != "PASS"


def euler(n: int) -> Array:
    """The series of a pendulum by Euler's method."""
    y = np.empty((n + 1, 2))
    y[0] = 1.0, 0.0
    for k in range(n):
        y[k + 1] = y[k] + 4.0 / n * np.array(pendulum(0.0, y[k]))
    return y


def heun(n: int) -> Array:
    y = np.empty((n + 1, 2))
    y[0] = 1.0, 0.0
    h = 4.0 / n
    for k in range(n):
        first = np.array(pendulum(0.0, y[k]))
        y[k + 1] = y[k] + h / 2 * (first + np.array(pendulum(0.0, y[k] + h * first)))
    return y


def classical(n: int) -> Array:
    y = np.empty((n + 1, 2))
    y[0] = 1.0, 0.0
    h = 4.0 / n
    for k in range(n):
        a = np.array(pendulum(0.0, y[k]))
        b = np.array(pendulum(0.0, y[k] + h / 2 * a))
        c = np.array(pendulum(0.0, y[k] + h / 2 * b))
        d = np.array(pendulum(0.0, y[k] + h * c))
        y[k + 1] = y[k] + h / 6 * (a + 2 * b + 2 * c + d)
    return y


@pytest.mark.parametrize(("solver", "order"), [(euler, 1), (heun, 2), (classical, 4)])
def test_whole_series_of_textbook_methods_have_their_order(
    solver: Callable[[int], Array], order: int
) -> None:
    counts = [128, 256, 512, 1024]
    values = [solver(n) for n in counts]
    h = [4.0 / n for n in counts]
    verdict = judge(h, values, order=order, dims=[0])
    assert (verdict.status, verdict.reason) == ("PASS", "asymptotic")
    assert judge(h, values, order=order + 1).reason == "order_low"
    angle, velocity = judge(h, [np.moveaxis(v, 1, 0) for v in values], order=order, members=True)
    assert (angle.status, velocity.status) == ("PASS", "PASS")


def test_odeint_at_a_fixed_tolerance_has_no_order() -> None:
    """Its steps do not depend on the output times, so that finer ones show the tolerance, and no order."""
    counts = [20, 40, 80, 160]
    values = [
        scipy.integrate.odeint(pendulum, [1.0, 0.0], np.linspace(0, 4, n + 1), tfirst=True)[:, 0]
        for n in counts
    ]
    verdict = judge([4.0 / n for n in counts], values)
    assert verdict.reason != "asymptotic" or (verdict.order or 0) < 1
    assert judge([4.0 / n for n in counts], values, noise=1e-6).reason == "exact"
