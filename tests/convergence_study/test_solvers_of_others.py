"""Solvers and tools that nobody here wrote: finite elements, finite volumes, and grid convergence indices.

scikit-fem solves Poisson's equation, FiPy transports a wave; pyGCS and convergence say an order and an index of three
numbers, whatever these are.
"""

from __future__ import annotations

import warnings
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vibsim import judge

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def fem() -> ModuleType:
    import skfem

    return skfem


def poisson(fem: Any, element: Any, level: int) -> tuple[float, float, Array, float]:
    """Solve -laplace u = f on the unit square, u = sin(pi x) sin(pi y): errors in L2 and H1, nodes, energy."""
    pi = np.pi
    mesh = fem.MeshTri().refined(level)
    basis = fem.Basis(mesh, element, intorder=6)

    def exact(x: Any) -> Any:
        return np.sin(pi * x[0]) * np.sin(pi * x[1])

    def gradient(x: Any) -> tuple[Any, Any]:
        return (
            pi * np.cos(pi * x[0]) * np.sin(pi * x[1]),
            pi * np.sin(pi * x[0]) * np.cos(pi * x[1]),
        )

    stiffness = fem.BilinearForm(
        lambda u, v, _: u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1]
    ).assemble(basis)
    load = fem.LinearForm(lambda v, w: 2 * pi**2 * exact(w.x) * v).assemble(basis)
    u = fem.solve(*fem.condense(stiffness, load, D=basis.get_dofs()))
    field = basis.interpolate(u)
    l2 = fem.Functional(lambda w: (w.uh - exact(w.x)) ** 2).assemble(basis, uh=field)
    h1 = fem.Functional(
        lambda w: sum((w.uh.grad[i] - gradient(w.x)[i]) ** 2 for i in range(2))
    ).assemble(basis, uh=field)
    order = np.lexsort((mesh.p[1], mesh.p[0]))
    count = 2**level + 1
    nodes = u[basis.nodal_dofs[0]][order].reshape(count, count)
    return float(np.sqrt(l2)), float(np.sqrt(h1)), nodes, float(u @ (stiffness @ u))


@pytest.mark.parametrize(("name", "in_l2", "in_h1"), [("ElementTriP1", 2, 1), ("ElementTriP2", 3, 2)])  # fmt: skip
def test_finite_elements_have_their_orders(
    fem: ModuleType, name: str, in_l2: int, in_h1: int
) -> None:
    levels = [3, 4, 5, 6]
    h = [0.5**level for level in levels]
    found = [poisson(fem, getattr(fem, name)(), level) for level in levels]
    l2, h1, nodes, energy = zip(*found, strict=True)
    for errors, order in ((l2, in_l2), (h1, in_h1)):
        verdict = judge(h, errors, order=order)
        assert verdict.status == "PASS", verdict.sentence
        assert verdict.order == pytest.approx(order, abs=0.06)
        assert judge(h, errors, order=order + 1).reason == "order_low"
    # the nodes of all levels nest; those of P2 are superconvergent here
    at_nodes = judge(h, nodes, at_least=in_l2)
    assert at_nodes.status == "PASS", at_nodes.sentence
    assert at_nodes.values.shape == (4, 9, 9)
    verdict = judge(h, energy, order=2 * in_h1)
    assert verdict.status == "PASS", verdict.sentence
    assert verdict.best == pytest.approx(np.pi**2 / 2, rel=1e-4)
    assert verdict.error is not None
    assert verdict.error == pytest.approx(energy[-1] - np.pi**2 / 2, rel=0.1)


def test_a_re_entrant_corner_is_no_second_order(fem: ModuleType) -> None:
    """The energy of P1 on an L has order 4/3, the square of h^(2/3), beside the order 2 of the smooth part."""
    levels = [2, 3, 4, 5, 6]
    values = []
    for level in levels:
        basis = fem.Basis(fem.MeshTri.init_lshaped().refined(level), fem.ElementTriP1())
        stiffness = fem.BilinearForm(
            lambda u, v, _: u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1]
        ).assemble(basis)
        load = fem.LinearForm(lambda v, _: 1.0 * v).assemble(basis)
        u = fem.solve(*fem.condense(stiffness, load, D=basis.get_dofs()))
        values.append(float(load @ u))
    verdict = judge([0.5**level for level in levels], values, order=2)
    assert verdict.status != "PASS"
    assert verdict.order is not None
    assert 4 / 3 < verdict.order < 1.8
    # the torsion of an L of three unit squares (with f = 1)
    assert verdict.best == pytest.approx(0.21408, abs=2e-4)


def transport(term: str, n: int, courant: float) -> Array:
    """Averages of a wave over n cells after a quarter of the period, by FiPy."""
    with warnings.catch_warnings():
        # it asks for parts of numpy that have other names now
        warnings.simplefilter("ignore")
        import fipy

        mesh = fipy.PeriodicGrid1D(nx=n, dx=1.0 / n)
        edges = np.linspace(0.0, 1.0, n + 1)
        start = -n * np.diff(np.cos(2 * np.pi * edges)) / (2 * np.pi)
        u = fipy.CellVariable(mesh=mesh, value=start)
        equation = fipy.TransientTerm() + getattr(fipy, term)(coeff=(1.0,)) == 0
        steps = round(0.25 * n / courant)
        for _ in range(steps):
            equation.solve(var=u, dt=0.25 / steps)
        return np.array(u.value)


@pytest.mark.slow
def test_upwind_differences_of_finite_volumes_have_order_1() -> None:
    counts = [60, 120, 240, 480]
    h = [1.0 / n for n in counts]
    values = [transport("UpwindConvectionTerm", n, 0.5) for n in counts]
    verdict = judge(h, values, order=1, restrict="mean")
    assert verdict.status != "FAIL", verdict.sentence
    assert verdict.order == pytest.approx(1.0, abs=0.1)
    assert judge(h, values, order=2, restrict="mean").status != "PASS"
    edges = np.linspace(-0.25, 0.75, counts[0] + 1)
    exact = -counts[0] * np.diff(np.cos(2 * np.pi * edges)) / (2 * np.pi)
    known = judge(h, values, order=1, restrict="mean", exact=exact)
    assert known.error == pytest.approx(verdict.error, rel=0.1)


@pytest.mark.slow
def test_a_limiter_is_between_the_orders() -> None:
    """Second order but for the extrema, which it clips: order 1 is excluded, and 2 is not simply confirmed."""
    counts = [20, 40, 80]
    h = [1.0 / n for n in counts]
    values = [transport("VanLeerConvectionTerm", n, 0.1) for n in counts]
    limited = judge(h, values, restrict="mean", order=1)
    assert limited.status != "PASS"
    assert limited.order is not None
    assert 1.4 < limited.order < 3.0


STUDIES = {
    "nasa": ((1.0, 2.0, 4.0), (0.97050, 0.96854, 0.96178)),
    "celik": ((18000**-0.5, 8000**-0.5, 4500**-0.5), (6.063, 5.972, 5.863)),
}


@pytest.mark.parametrize("name", STUDIES)
def test_peers_say_the_same_order_of_the_same_numbers(name: str) -> None:
    from convergence.functions import gci, order_of_convergence, richardson_extrapolate
    from pyGCS import GCI

    h, values = STUDIES[name]
    verdict = judge(h, values)
    ratios = h[1] / h[0], h[2] / h[1]
    order = order_of_convergence(*values, *ratios)
    assert verdict.order == pytest.approx(order, abs=1e-3)
    assert verdict.best == pytest.approx(richardson_extrapolate(*values[:2], ratios[0], order), rel=1e-4)  # fmt: skip
    index, _ = gci(ratios[0], abs(1 - values[1] / values[0]), order)
    assert verdict.gci == pytest.approx(index, rel=1e-2)
    other = GCI(cells=[3, 2, 1], grid_size=list(h), solution=list(values), dimension=1)
    assert verdict.order == pytest.approx(other.get("apparent_order"), abs=1e-3)


def test_peers_have_an_order_for_levels_that_move_apart() -> None:
    """They take the size of the logarithm, so that differences which double pass for those of order 1."""
    from convergence.functions import order_of_convergence
    from pyGCS import GCI

    h, values = [1.0, 2.0, 4.0], [1.0, 1.2, 1.3]
    assert order_of_convergence(*values, 2.0, 2.0) == pytest.approx(1.0)
    other = GCI(cells=[3, 2, 1], grid_size=list(h), solution=list(values), dimension=1)
    assert other.get("apparent_order") == pytest.approx(1.0)
    assert other.get("gci")[0] == pytest.approx(0.25)
    verdict = judge(h, values)
    assert verdict.status != "PASS"
    assert verdict.order == pytest.approx(-1.0)
    assert verdict.gci is None
