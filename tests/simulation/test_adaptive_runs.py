"""Adaptive schemes: what their rows of a level file are, what they count, and how they fail."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vibsim.core.errors import SimulationError
from vibsim.core.record import Record
from vibsim.engine import integrate
from vibsim.experiment import Experiment
from vibsim.experiment.cost import level_cost
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES
from vibsim.schemes.adaptive import TOLERANCE, seconds
from vibsim.simulation import adaptive, simulate_record

ADAPTIVE = [kind for kind, scheme in SCHEMES.items() if scheme.adaptive]
SPRING = MODELS["spring"]
LEAST = 100 * 2.0**-52
"""Relative tolerance that SciPy does not go below."""


@pytest.fixture(autouse=True)
def nothing_kept() -> Iterator[None]:
    """Forget the runs that other tests have left."""
    adaptive._cache.clear()
    yield
    adaptive._cache.clear()


def experiment(*schemes: Any, **sections: Any) -> Any:
    """Return an experiment with the pendulum, unless `sections` say otherwise."""
    content = {
        "title": "adaptive",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 10.0},
        "levels": [4, 5, 7],
        "schemes": list(schemes),
    }
    return Experiment.from_dict({**content, **sections})


def problem(kind: str, tolerance: float = 1e-6, end: float = 20.0, **more: Any) -> adaptive.Problem:
    """Return the spring with w = 1 from u = 1."""
    given = adaptive.Problem(SPRING, kind, tolerance, (1.0,), (1.0, 0.0), end)
    return replace(given, **more)


def same(a: Record, b: Record, places: Any = slice(None)) -> None:
    """Assert that two level Records hold the same bits for the members of the second one."""
    for name in b.variables:
        left, dims = a[name], a.variable(name).dims
        if "case" in dims:
            left = left[tuple(places if dim == "case" else slice(None) for dim in dims)]
        assert np.array_equal(left, b[name], equal_nan=True), name


# --- what is computed -----------------------------------------------------------------------------


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("kind", ADAPTIVE)
def test_errors_are_those_that_the_tolerance_allows(kind: str, tolerance: float) -> None:
    run = adaptive.solve(problem(kind, tolerance))
    t = np.linspace(0.01, 20.0, 1999)
    error = np.hypot(*(run.at(t) - np.array([np.cos(t), -np.sin(t)])))
    # every step adds at most rtol |y| + atol <= 2 tolerance to either component, and a rotation keeps it
    assert 0.0 < error.max() <= 2.0 * math.sqrt(2.0) * tolerance * len(run.pieces)


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_counts_are_those_of_scipy(kind: str) -> None:
    from scipy.integrate import solve_ivp

    asked = problem(kind)
    jacobian = {} if kind == "dop853" else {"jac": lambda t, y: [[0.0, 1.0], [-1.0, 0.0]]}
    theirs = solve_ivp(
        lambda t, y: (y[1], -y[0]),
        (0.0, asked.end),
        asked.initial,
        method=adaptive.CLASSES[kind],
        rtol=asked.tolerance,
        atol=asked.tolerance,
        dense_output=True,
        **jacobian,
    )
    run = adaptive.solve(asked)
    assert (len(run.pieces), run.force_evaluations) == (len(theirs.t) - 1, theirs.nfev)
    assert np.array_equal(run.times, theirs.t)
    # the same function of time, asked at a place between
    t = np.array([7.3])
    np.testing.assert_allclose(run.at(t), theirs.sol(t), rtol=0, atol=4e-16)


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_absolute_tolerances_scale_with_the_problem(kind: str) -> None:
    # a power of two, so that no rounding differs
    small = problem(kind, initial=(2.0**-20, 0.0))
    assert small.scale == (2.0**-20, 2.0**-20)
    assert problem(kind, parameters=(4.0,), initial=(0.5, 8.0)).scale == (2.0, 8.0)
    runs = adaptive.solve(problem(kind)), adaptive.solve(small)
    assert runs[0].times == runs[1].times
    t = np.linspace(0.1, 20.0, 100)
    assert np.array_equal(runs[0].at(t), 2.0**20 * runs[1].at(t))


def test_a_member_at_rest_stays_there() -> None:
    run = adaptive.solve(problem("dop853", initial=(0.0, 0.0)))
    assert not run.at(np.array([20.0])).any()


def test_tolerances_below_scipys_least_act_on_the_absolute_one() -> None:
    from scipy.integrate import DOP853

    with pytest.warns(UserWarning, match="rtol"):
        solver = DOP853(lambda t, y: y, 0.0, [1.0], 1.0, rtol=TOLERANCE.least)
    assert solver.rtol == LEAST
    # without a warning, which would be an error here
    runs = [adaptive.solve(problem("dop853", x)) for x in (TOLERANCE.least, LEAST)]
    assert len(runs[0].pieces) > len(runs[1].pieces)


# --- the rows of a level --------------------------------------------------------------------------


def test_levels_share_one_run_and_hold_its_values_at_their_times(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solved: list[adaptive.Problem] = []
    monkeypatch.setattr(
        adaptive,
        "solve",
        lambda asked, solve=adaptive.solve: (solved.append(asked), solve(asked))[1],
    )
    asked = experiment("central", {"kind": "dop853", "tolerance": [1e-4, 1e-8]}, "lsoda")
    records = [simulate_record(asked, level) for level in asked.levels]
    assert [one.tolerance for one in solved] == [1e-4, 1e-8, 1e-10]
    coarse, fine = records[0], records[-1]
    stride = (len(fine["t"]) - 1) // (len(coarse["t"]) - 1)
    assert np.array_equal(coarse["theta"][1:], fine["theta"][1:, :, ::stride])
    for name in ("accepted_steps", "force_evaluations_total"):
        assert all(np.array_equal(r[name], coarse[name], equal_nan=True) for r in records)
        assert np.isnan(coarse[name][0]).all()
        assert np.isfinite(coarse[name][1:]).all()


def test_what_is_gathered_is_gathered_over_the_points_of_the_level() -> None:
    record = simulate_record(experiment(*ADAPTIVE, "rk4", samples="all"), 7)
    for name, values in (
        ("theta_max", record["theta"].max(axis=-1)),
        ("omega_min", record["omega"].min(axis=-1)),
        ("energy_deviation_max_abs", np.abs(record["energy_deviation"]).max(axis=-1)),
    ):
        assert np.array_equal(record[name], values), name
    # the period by the same interpolation of the same points, which are equal to 1e-6
    np.testing.assert_allclose(record["period"], record["period"][-1, 0], rtol=1e-6)


def test_files_without_adaptive_schemes_do_not_speak_of_them() -> None:
    assert "accepted_steps" not in simulate_record(experiment("central"), 4)


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_a_member_does_not_depend_on_those_beside_it(kind: str) -> None:
    asked = experiment(
        {"kind": kind, "tolerance": 1e-6},
        "central",
        sweep={"initial.theta": [0.3, 1.0, 2.0, 3.0], f"schemes.{kind}.tolerance": [1e-3, 1e-6]},
    )
    whole = simulate_record(asked, 5, threads=2)
    adaptive._cache.clear()
    same(whole, simulate_record(asked, 5, 3, 6), slice(3, 6))


@pytest.mark.parametrize("lane", ["plain", "scalar"])
def test_tables_pass_through_every_lane_unchanged(lane: str) -> None:
    table = np.arange(22.0).reshape(1, 22) / 32.0
    method = replace(SCHEMES["dop853"], stepper=lambda options: adaptive.along_a_table(1))
    run = integrate(
        SPRING,
        method,
        {},
        np.concatenate([np.ones((1, 1)), table], axis=1),
        table[:, :2],
        np.array([0.5]),
        9,
        1,
        lane=lane,
    )
    assert np.array_equal([run.position[0], run.velocity[0]], table[0, :20].reshape(10, 2).T)


# --- what fails -----------------------------------------------------------------------------------


def run_of(kind: str, acceleration: str, initial: list[list[float]], steps: int = 64) -> Any:
    """Integrate members with a force of their own to t = 8."""
    model = replace(SPRING, acceleration=acceleration, linear=False)
    return adaptive.integrate(
        model,
        SCHEMES[kind],
        {"tolerance": 1e-6},
        np.ones((len(initial), 1)),
        np.array(initial),
        np.full(len(initial), 8.0 / steps),
        steps,
        1,
    )


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_what_leaves_every_bound_ends_and_the_others_go_on(kind: str) -> None:
    # u'' = 2 u^3 from u = v = 1 is 1/(1 - t), beyond all bounds at t = 1; at rest in 0 it stays
    run = run_of(kind, "2*u**3", [[1.0, 1.0], [0.0, 0.0]], 60)
    assert run.last_step.tolist() == [7, 60]
    assert np.isnan(run.position[0, 8:]).all()
    t = np.arange(8) * (8.0 / 60)
    np.testing.assert_allclose(run.position[0, :8], 1.0 / (1.0 - t), rtol=1e-3)
    assert run.gathered.accepted_steps[0] > 0


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_a_force_that_is_no_number_ends_the_member(kind: str) -> None:
    # sqrt(u) has no value below 0, where u = 1 - t^2 + ... arrives; from -1 it never had one
    run = run_of(kind, "-2*sqrt(u)", [[1.0, 0.0], [-1.0, 0.0]])
    assert 0 < run.last_step[0] < 64
    assert run.last_step[1] == 0


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_growth_ends_where_nothing_could_be_stored_any_more(kind: str) -> None:
    # exp(100 t) is 1e150 at t = 3.45 and overflows at 7.1
    model = replace(SPRING, acceleration="1e4*u")
    run = adaptive.solve(problem(kind, 1e-3, 8.0, model=model))
    assert 3.3 < run.times[-1] < 3.6


def test_a_run_that_takes_too_many_steps_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptive, "MOST_STEPS", 5)
    run = adaptive.solve(problem("dop853"))
    assert len(run.pieces) == 5
    assert np.isnan(run.at(np.array([20.0]))).all()


def test_failures_are_recorded_with_their_time() -> None:
    asked = experiment("central", "dop853")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(adaptive, "MOST_STEPS", 5)
        record = simulate_record(asked, 4)
    assert record["status"].tolist() == [[0], [1]]
    assert 0.0 < record["failure_time"][1, 0] < 10.0


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_no_step_of_a_given_size_is_taken(kind: str) -> None:
    with pytest.raises(SimulationError, match="takes its own steps"):
        SCHEMES[kind].stepper(SCHEMES[kind].defaults())


# --- what is kept, and what it costs --------------------------------------------------------------


def test_runs_are_kept_within_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = [problem("dop853", end=end) for end in (10.0, 20.0, 30.0)]
    steps = [len(adaptive.solved(one).pieces) for one in asked]
    assert list(adaptive._cache) == asked
    monkeypatch.setattr(adaptive, "CACHED_STEPS", steps[2] + steps[0])
    adaptive.solved(asked[0])
    assert list(adaptive._cache) == [asked[2], asked[0]]
    monkeypatch.setattr(adaptive, "CACHED_STEPS", 0)
    adaptive.solved(asked[2])
    assert list(adaptive._cache) == [asked[2]]


@pytest.mark.parametrize("kind", ADAPTIVE)
def test_the_plan_counts_what_a_run_costs(kind: str) -> None:
    other = {"kind": "central", "label": "other"}
    plain, *loads = (
        level_cost(experiment("central", scheme, time={"end": 100.0}), 7)
        for scheme in (other, *({"kind": kind, "tolerance": x} for x in (1e-4, 1e-10)))
    )
    assert plain.scipy_seconds == 0.0
    assert plain.seconds(100) < loads[0].seconds(100) < loads[1].seconds(100)
    assert plain.shard > loads[0].shard > loads[1].shard
    assert plain.memory(1) < loads[0].memory(1)
    # a shard that holds more members than its time allows would take longer than it is meant to
    assert loads[1].shard * seconds(kind, 1e-10, 100.0 / (2.0 * math.pi)) <= 4.0
