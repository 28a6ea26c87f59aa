"""Forces from a table, against SciPy between the corners, a recurrence in numpy, and the road that was sampled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from thinned import thinned

from vibsim.core.errors import SimulationError
from vibsim.engine import integrate
from vibsim.models import MODELS, Model
from vibsim.models.table import Table
from vibsim.schemes import FIXED_STEP, SCHEMES

M, B, K, SPEED = 1.5, 0.6, 5.0, 2.0
START = (0.1, -0.2)
POINTS = 11
END = 1.0
HEIGHTS = np.random.default_rng(4).normal(scale=0.05, size=POINTS)
ROUGH = Table(0.0, SPEED * END / (POINTS - 1), HEIGHTS)
ROAD = "0.1*sin(2*x + 0.3)"


def vehicle(table: Table | None, *, b: float = B, is_met: bool = True, road: str = "0") -> Model:
    numbers = () if table is None else (table, is_met)
    model = MODELS["vehicle"].written({"spring": f"{K}*u", "road": road}, (), *numbers)
    return model.variant(frozenset({"b"} if b else ()))


def run(model, kind, steps, *, b=B, lane="plain", end=END, members=1, **options):
    scheme = SCHEMES[kind]
    own = scheme.defaults() | options
    if any(option.name == "end_velocity" for option in scheme.options):
        own["end_velocity"] = "kick"
    numbers = np.array([[M, b, SPEED]] * members) * (1.0 - 0.1 * np.arange(members)[:, None])
    arrays = numbers, np.array([START] * members), np.full(members, end / steps)
    return integrate(model, scheme, own, *arrays, steps, 1, lane=lane)


def reference(table: Table, b: float) -> np.ndarray:
    """Return position and velocity at the end by SciPy, from corner to corner; np.interp gives q between them."""
    x = table.first + table.spacing * np.arange(table.points)
    q = np.zeros(table.points)
    q[1:-1] = (table.heights[:-2] - 2 * table.heights[1:-1] + table.heights[2:]) / table.spacing**2
    q[0], q[-1] = q[1], q[-2]

    def right(t, y):
        return y[1], -np.interp(SPEED * t, x, q) * SPEED**2 - (b * y[1] + K * y[0]) / M

    y = np.array(START)
    for first, last in zip(x[:-1] / SPEED, x[1:] / SPEED, strict=True):
        y = solve_ivp(right, (first, last), y, method="DOP853", rtol=3e-14, atol=1e-15).y[:, -1]
    return y


TREATED = [(k, b) for k in FIXED_STEP for b in (0.0, B) if SCHEMES[k].treats(vehicle(ROUGH, b=b))]


@pytest.mark.parametrize(("kind", "b"), thinned(TREATED, 3))
def test_every_scheme_has_its_order_where_steps_end_at_the_corners(kind: str, b: float) -> None:
    model = vehicle(ROUGH, b=b)
    exact = reference(ROUGH, b)
    options = SCHEMES[kind].defaults()
    order = min(SCHEMES[kind].formal_order(name, model, options) for name in ("u", "v"))
    steps = [640, 1280, 2560] if order < 3 else [80, 160, 320]
    runs = [run(model, kind, n, b=b) for n in steps]
    errors = [np.hypot(r.position[0, -1] - exact[0], r.velocity[0, -1] - exact[1]) for r in runs]
    orders = -np.diff(np.log2(errors))
    assert orders[-1] == pytest.approx(order, abs=0.2), (errors, orders)


@pytest.mark.parametrize(("kind", "kept"), [("rk4", 4.0), ("gauss4", 4.0), ("rk3", 3.0)])
def test_corners_within_steps_leave_the_second_order(kind: str, kept: float) -> None:
    exact = reference(ROUGH, B)[0]
    for is_met, steps, order in ((True, 160, kept), (False, 7 * 64, 2.0)):
        model = vehicle(ROUGH, is_met=is_met)
        # the steps are 4 times finer: the corners lie at the same places within them, up to their order
        errors = [abs(run(model, kind, n).position[0, -1] - exact) for n in (steps, 16 * steps)]
        assert np.log2(errors[0] / errors[1]) / 4 == pytest.approx(order, abs=0.35)
        options = SCHEMES[kind].defaults()
        assert SCHEMES[kind].formal_order("u", model, options) == order
        assert SCHEMES[kind].formal_order("work_done", model, options) == 2.0
        if not is_met:
            assert not SCHEMES[kind].has_even_powers("u", model, options)


def test_a_multistep_scheme_looks_back_across_corners() -> None:
    model = vehicle(ROUGH)
    assert SCHEMES["ab3"].formal_order("u", model, SCHEMES["ab3"].defaults()) == 2.0
    assert SCHEMES["ab3"].formal_order("u", vehicle(None), SCHEMES["ab3"].defaults()) == 3.0


def test_the_centred_scheme_is_the_recurrence_of_the_text() -> None:
    """B, section 10.8: F^n = -m q_n speed^2 at dt = dx/speed, in the scheme of section 8.1."""
    h, n = HEIGHTS, POINTS - 1
    dt = ROUGH.spacing / SPEED
    q = np.empty(n + 1)
    q[1:-1] = (h[:-2] - 2 * h[1:-1] + h[2:]) / ROUGH.spacing**2
    q[0], q[-1] = q[1], q[-2]
    force = -M * q * SPEED**2
    u = np.empty(n + 1)
    u[0] = START[0]
    u[1] = u[0] + dt * START[1] + dt**2 / (2 * M) * (force[0] - B * START[1] - K * u[0])
    for i in range(1, n):
        known = 2 * M * u[i] + (B * dt / 2 - M) * u[i - 1] + dt**2 * (force[i] - K * u[i])
        u[i + 1] = known / (M + B * dt / 2)
    found = run(vehicle(ROUGH), "central", n).position[0]
    assert found == pytest.approx(u, rel=0, abs=4e-16 * n * np.abs(u).max())


def sampled(points: int, is_zero_at_ends: bool) -> Table:
    x = np.linspace(0.0, SPEED * END, points)
    table = Table(0.0, x[1], 0.1 * np.sin(2 * x + 0.3))
    if is_zero_at_ends:
        table.bends[[0, -1]] = 0.0
        object.__setattr__(table, "digest", f"zero at the ends of {points}")
    return table


@pytest.mark.parametrize(("is_zero_at_ends", "order"), [(False, 2.0), (True, 1.0)])
def test_a_finer_table_tends_to_the_road_that_it_samples(
    is_zero_at_ends: bool, order: float
) -> None:
    """The copied end rule keeps second order; zero end values, a variant of this test, leave the first."""
    exact = run(vehicle(None, road=ROAD), "rk4", 1280).position[0, -1]
    errors = []
    for points in (81, 161, 321):
        model = vehicle(sampled(points, is_zero_at_ends))
        errors.append(abs(run(model, "rk4", points - 1).position[0, -1] - exact))
    assert -np.diff(np.log2(errors)) == pytest.approx([order, order], abs=0.06)


def test_damping_and_members_of_their_own_speed_in_both_lanes() -> None:
    """The compiled lane gives the bits of the plain one, of every member, and of other tables by the same text."""
    for table in (ROUGH, Table(-0.05, 0.11, np.sin(np.arange(40.0)))):
        model = vehicle(table, is_met=False)
        plain, scalar = (
            run(model, "rk4", 61, lane=lane, members=4) for lane in ("plain", "scalar")
        )
        assert plain.position.tobytes() == scalar.position.tobytes()
        assert plain.velocity.tobytes() == scalar.velocity.tobytes()
        assert plain.gathered is not None
        assert scalar.gathered is not None
        assert plain.gathered.deviation.tobytes() == scalar.gathered.deviation.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("kind", FIXED_STEP)
def test_every_scheme_has_the_same_bits_in_both_lanes(kind: str) -> None:
    model = vehicle(ROUGH, b=0.0, is_met=False)
    plain, scalar = (run(model, kind, 61, b=0.0, lane=lane) for lane in ("plain", "scalar"))
    assert plain.position.tobytes() == scalar.position.tobytes()
    assert plain.velocity.tobytes() == scalar.velocity.tobytes()


def test_no_number_of_a_table_is_in_the_text_of_a_kernel() -> None:
    from vibsim.engine.kernel import source

    scheme = SCHEMES["central"]
    texts = {
        source(model, scheme.stepper_for(model, scheme.defaults()))
        for model in map(vehicle, (ROUGH, sampled(81, False), replace(ROUGH, first=-0.1)))
    }
    assert len(texts) == 1


def test_a_table_is_not_looked_up_in_blocks() -> None:
    with pytest.raises(SimulationError, match="looks a table up"):
        run(vehicle(ROUGH), "central", 10, lane="blocks")
