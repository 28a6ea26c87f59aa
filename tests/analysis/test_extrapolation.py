"""The extrapolated solution and the bound of its error, against exact solutions."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from vibsim.comparison.best_solution import best_record
from vibsim.comparison.extrapolate_members import Extrapolated, Method, Start, extrapolate_members
from vibsim.convergence.extrapolation.states import FLOATS, Circumstances, best_entry, tableau
from vibsim.core.record import Record, Variable
from vibsim.engine import integrate
from vibsim.experiment import Experiment
from vibsim.ladder import best, climb
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES
from vibsim.simulation import simulate_record

Floats = NDArray[np.float64]
ARITHMETICS = ("compensated", "increment", "three_term")


def method(model: str = "pendulum", **options: str) -> Method:
    scheme = SCHEMES["central"]
    return Method(MODELS[model], scheme, {**scheme.defaults(), "end_velocity": "kick", **options})


def start(
    theta: Any, omega: Any = 0.0, end: Any = 20.0, g: Any = 1.0, parameters: int = 4
) -> Start:
    theta, omega, end, g = np.broadcast_arrays(
        np.atleast_1d(np.asarray(theta, dtype=float)), omega, end, g
    )
    ones = np.ones(len(theta))
    return Start(
        np.stack([g * ones, ones, ones, 0.0 * ones], -1)[:, :parameters], np.stack([theta, omega * ones], -1),
        end * ones, np.sqrt(g) * ones,
    )  # fmt: skip


def exact(of: Method, members: Start, points: int) -> list[Floats]:
    """Return exact position and velocity, shape (t, case)."""
    assert of.model.exact is not None
    t = members.end[:, None] * (np.arange(points + 1) / points)
    initial = {s.name: members.initial[:, i : i + 1] for i, s in enumerate(of.model.states)}
    numbers = {p.name: members.parameters[:, i : i + 1] for i, p in enumerate(of.model.parameters)}
    found = of.model.exact(t, initial, numbers)
    return [found[state.name].T for state in of.model.states]


def bound_and_error(found: Extrapolated, true: list[Floats]) -> tuple[Floats, Floats]:
    """Return bounds and true errors after t = 0, of both states."""
    bounds = [found.position_error[1:], found.velocity_error[1:]]
    errors = [abs(found.position - true[0])[1:], abs(found.velocity - true[1])[1:]]
    return np.stack(bounds), np.stack(errors)


# the tableau


@pytest.mark.parametrize("levels", [(3, 4, 5, 6), (2, 4, 5, 8), (0, 3)])
@pytest.mark.parametrize("powers", [(2, 2), (2, 1), (1, 1), (4, 2)])
def test_the_last_entry_removes_every_power(
    levels: tuple[int, ...], powers: tuple[int, int]
) -> None:
    p, q = powers
    steps = tuple(3 * 2**level for level in levels)
    terms = [(0.7, -1.3, 0.4)[k] for k in range(len(steps) - 1)]
    rows = [[1.0 + sum(c / n ** (p + k * q) for k, c in enumerate(terms)) for n in steps]]
    table = tableau(steps, p, q, (0.0,) * len(steps))
    for j in range(1, len(steps)):
        before = rows[-1]
        factors = [table.entries[i][j - 1].factor for i in range(j, len(steps))]
        rows.append(
            [b + f * (b - a) for (a, b), f in zip(itertools.pairwise(before), factors, strict=True)]
        )
    assert rows[-1][0] == pytest.approx(1.0, abs=64 * np.finfo(float).eps)


def test_every_power_needs_its_own_weights() -> None:
    """Weights for even powers leave something of odd ones."""
    even, every = (tableau((8, 16, 32), 2, q, (0.0,) * 3).entries[2][1].factor for q in (2, 1))
    assert even == pytest.approx(1 / 15)
    assert every == pytest.approx(1 / 7)


def test_floats_and_arrays_give_the_same_bits() -> None:
    rng = np.random.default_rng(3)
    table = tableau((64, 128, 256, 512), 2, 2, (1e-15, 2e-15, 3e-15, 4e-15))
    for k in range(200):
        sizes = 10.0 ** rng.uniform(-14, 1, (2, 4))
        values = 1.0 + sizes * rng.normal(size=(2, 4)) * 4.0 ** -np.arange(4)
        if k % 7 == 0:
            values[:, k % 4] = np.nan
        known = Circumstances(1.3, 1.0, 0.1, 20.0, 1e-3, 2.0, 20.0)
        floats = best_entry(table, [tuple(map(float, pair)) for pair in values.T], known, FLOATS)
        wide = Circumstances(*(np.array([value]) for value in vars(known).values()))
        with np.errstate(all="ignore"):
            arrays = best_entry(table, [tuple(pair[:, None, None]) for pair in values.T], wide)
        for one, many in zip(floats, arrays, strict=True):
            np.testing.assert_array_equal(one, np.ravel(many)[0])


def test_an_entry_is_as_wrong_as_a_finer_level_says() -> None:
    """Three levels extrapolate to the same number from each two by accident; the fourth shows it."""
    known = Circumstances(1.0, 1.0, 0.1, 1.0, 0.0, 1.0, 1.0)
    levels = [(value, 0.0) for value in (1.0, 1.03, 1.0375, 1.04)]
    before, after = (
        best_entry(tableau((8, 16, 32, 64)[:n], 2, 2, (1e-16,) * n), levels[:n], known, FLOATS)
        for n in (3, 4)
    )
    assert before.error < 1e-10
    assert after.error > 1e-4


# honest, and not too careful


def batches(seed: int, count: int) -> Iterator[tuple[Method, Start, tuple[int, ...], int]]:
    """Draw right ladders: both models, three arithmetics, coarse and fine, some near the separatrix."""
    rng = np.random.default_rng(seed)
    while count:
        of = method(
            str(rng.choice(["pendulum", "pendulum", "linear_pendulum"])),
            arithmetic=str(rng.choice(ARITHMETICS)),
        )
        cases, points = 25, int(rng.choice([1, 4, 16]))
        phase, step = 10.0 ** rng.uniform(0.3, 2.2), 10.0 ** rng.uniform(-1.3, 0.2)
        base = int(rng.choice([1, 3, 5]))
        least = max(phase / step, 16)
        lowest = max(int(np.ceil(np.log2(least / base))), 4)
        gaps = rng.choice([1, 1, 1, 2], size=int(rng.integers(2, 6)))
        steps = tuple(base * 2 ** int(lv) for lv in lowest + np.cumsum([0, *gaps]))
        if steps[-1] > 50_000:
            continue
        near = np.pi - 10.0 ** rng.uniform(-3, 0, cases)
        theta = np.where(rng.random(cases) < 0.2, near, rng.uniform(0.05, 3.0, cases))
        g = 10.0 ** rng.uniform(-0.5, 1.0, cases)
        omega = np.where(rng.random(cases) < 0.3, rng.uniform(-2.5, 2.5, cases), 0.0) * np.sqrt(g)
        yield (
            of,
            start(theta, omega, phase / np.sqrt(g), g, len(of.model.parameters)),
            steps,
            points,
        )
        count -= 1


def measured(seed: int, count: int) -> tuple[Floats, Floats, Floats]:
    """Return bounds, errors, and whether a point belongs to an asymptotic ladder of at least four levels."""
    rows = []
    for of, members, steps, points in batches(seed, count):
        found = climb(of, members, steps, points, lane="scalar")
        bounds, errors = bound_and_error(found, exact(of, members, points))
        fine = np.broadcast_to(of_asymptotic(members, steps), bounds.shape)
        rows.append([x.ravel() for x in (bounds, errors, fine)])
    bounds, errors, fine = (np.concatenate(x) for x in zip(*rows, strict=True))
    return bounds, errors, fine


def of_asymptotic(members: Start, steps: tuple[int, ...]) -> Any:
    is_fine = members.frequency * members.end / steps[0] < 0.3
    return is_fine & (len(steps) >= 4) & (abs(members.initial[:, 0]) < 2.5)


def test_the_bound_holds_and_is_not_far_too_large() -> None:
    bounds, errors, fine = measured(20260101, 60)
    assert len(bounds) > 10_000
    assert np.mean(errors <= bounds) >= 0.999
    asymptotic = (fine > 0) & np.isfinite(bounds) & (errors > 0)
    assert np.median(bounds[asymptotic] / errors[asymptotic]) < 100
    # a bound is known for nearly all of them
    assert np.mean(np.isfinite(bounds)) > 0.95


@pytest.mark.slow
def test_the_bound_holds_over_many_ladders() -> None:
    bounds, errors, _ = measured(7, 600)
    assert np.mean(errors <= bounds) >= 0.999


@pytest.mark.parametrize("model", ["pendulum", "linear_pendulum"])
@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("velocity_verlet", {"even_powers": False}),
        ("crank_nicolson", {"even_powers": False}),
        ("gauss4", {"even_powers": False}),
        ("generalized_alpha", {}),
        ("hht", {}),
    ],
)
def test_the_bound_holds_where_some_powers_are_missing_or_small(
    kind: str, changes: dict[str, bool], model: str
) -> None:
    """A symmetric scheme that does not say so, and schemes whose odd powers have small coefficients."""
    scheme = replace(SCHEMES[kind], **changes)
    of = Method(MODELS[model], scheme, scheme.defaults())
    members = start(np.array([0.3, 1.0, 2.0]), 0.3, parameters=len(of.model.parameters))
    true = exact(of, members, 16)
    held = []
    for first in range(6, 11):
        for count in range(3, min(7, 14 - first)):
            steps = tuple(2**level for level in range(first, first + count))
            found = climb(of, members, steps, 16, lane="scalar")
            bounds, errors = bound_and_error(found, true)
            held.append(errors <= bounds + 1e-13)
    assert np.mean(held) >= 0.999


def test_the_bound_holds_with_a_corrected_frequency_and_damping() -> None:
    """Its start is not symmetric then: the damping of the first step is corrected, that of others is not."""
    for levels in ([6, 7, 8, 9], [6, 7, 8, 9, 10], [7, 8, 9, 10, 11]):
        experiment = Experiment(
            model="oscillator",
            parameters={"m": 1.0, "spring": "k*u", "damping": {"linear": 0.2}, "parameters": {"k": 4.0}},
            initial={"u": 1.0, "v": 0.3},
            time={"end": 10.0},
            levels=levels,
            schemes=[{"kind": "central", "frequency_correction": True, "end_velocity": "kick"}],
        )  # fmt: skip
        found = best(experiment)
        t, w = found.t.values, np.sqrt(3.99)
        true = np.exp(-0.1 * t) * (np.cos(w * t) + 0.4 / w * np.sin(w * t))
        error = np.abs(found.u.values[0, 0] - true)
        assert np.all(error <= found.u_error.values[0, 0] + 1e-14)


@pytest.mark.parametrize("theta", [0.5, 1.0, 3.1])
def test_against_fifty_digits(theta: float) -> None:
    """A pendulum released from rest: ``sin(theta/2) = k cd(t, k)``, k = sin(theta_0/2)."""
    of, members, steps = method(), start(theta, end=20.0), (256, 512, 1024, 2048, 4096)
    found = climb(of, members, steps, 4, lane="scalar")
    with mpmath.workdps(50):
        k = mpmath.sin(mpmath.mpf(theta) / 2)
        sine = [k * mpmath.ellipfun("cd", mpmath.mpf(5 * i), k=k) for i in range(5)]
        true = np.array([float(2 * mpmath.asin(s)) for s in sine])
    error = abs(found.position[:, 0] - true)
    assert np.all(error <= found.position_error[:, 0])
    assert found.position_error.max() < 1e-8


def test_levels_that_are_too_coarse_are_dropped() -> None:
    of, members = method(), start([0.5, 1.0, 2.0], end=40.0)
    steps = tuple(2**level for level in range(4, 14))
    found = climb(of, members, steps, 16, lane="scalar")
    bounds, errors = bound_and_error(found, exact(of, members, 16))
    # w dt is 2.5 at the coarsest level, where the scheme is unstable
    assert np.all(found.first[1:] > 0)
    assert np.all(errors <= bounds)
    assert bounds.max() < 1e-11


def test_levels_in_round_off_are_not_used_beyond_benefit() -> None:
    of, members = method(arithmetic="three_term"), start(1.0)
    steps = tuple(2**level for level in range(6, 18))
    found = climb(of, members, steps, 16, lane="scalar")
    bounds, errors = bound_and_error(found, exact(of, members, 16))
    finest = climb(of, members, steps[-4:], 16, lane="scalar")
    worse, _ = bound_and_error(finest, exact(of, members, 16))
    assert np.all(errors <= bounds)
    assert bounds.max() < 0.01 * worse.max()
    assert found.last.max() < len(steps) - 1


@pytest.mark.parametrize("quantity", ["start", "end"])
def test_what_the_options_make_of_the_powers(quantity: str) -> None:
    """A first-order start breaks the promised order; an end formula has every power at one time only."""
    options = {"start": "first_order"} if quantity == "start" else {"end_velocity": "extrapolate"}
    of, members = method(**options), start([0.3, 1.0, 2.0])
    found = climb(of, members, (128, 256, 512, 1024, 2048), 16, lane="scalar")
    bounds, errors = bound_and_error(found, exact(of, members, 16))
    assert np.all(errors <= bounds)
    if quantity == "end":
        assert bounds[1, -1].max() > 100 * bounds[1, :-1].max()
        assert bounds[0].max() < 1e-10


def test_a_solution_that_does_not_converge_gets_no_small_bound() -> None:
    """Differences that do not fall, as those of a random walk over the levels."""
    rng = np.random.default_rng(5)
    of, members, t = method(), start(np.ones(400)), (np.arange(17) / 16)[:, None]
    true = exact(of, members, 16)
    levels = []
    for _ in range(5):
        size = 1e-3 * rng.normal(size=true[0].shape)
        levels.append((true[0] + size, true[1] + 1e-3 * rng.normal(size=true[0].shape)))
    found = extrapolate_members(of, members, (64, 128, 256, 512, 1024), t, levels, None)
    bounds, errors = bound_and_error(found, true)
    assert np.mean(errors <= bounds) >= 0.995


# levels that have failed


def levels_of(steps: tuple[int, ...], members: Start, of: Method) -> list[tuple[Floats, Floats]]:
    runs = [
        integrate(
            of.model, of.scheme, of.options, members.parameters, members.initial,
            members.end / n, n, n // 8, lane="plain", with_gathered=False,
        )
        for n in steps
    ]  # fmt: skip
    return [(run.position.T.copy(), run.velocity.T.copy()) for run in runs]


@pytest.mark.parametrize("failed", range(5))
def test_a_level_that_failed_is_done_without(failed: int) -> None:
    of, members, steps = method(), start([1.0, 2.0], end=8.0), (32, 64, 128, 256, 512)
    levels, true = levels_of(steps, members, of), exact(of, members, 8)
    for values in levels[failed]:
        values[3:, 0] = np.nan
    found = extrapolate_members(of, members, steps, (np.arange(9) / 8)[:, None], levels, None)
    bounds, errors = bound_and_error(found, true)
    assert np.all(errors <= bounds)
    assert np.all(np.isfinite(bounds))
    used = zip(found.first[3:, 0], found.last[3:, 0], strict=True)
    assert all(not first <= failed <= last for first, last in used)


def test_without_two_levels_nothing_is_known() -> None:
    of, members, steps = method(), start(1.0, end=8.0), (64, 128)
    levels = levels_of(steps, members, of)
    levels[0][0][:] = np.nan
    t = (np.arange(9) / 8)[:, None]
    found = extrapolate_members(of, members, steps, t, levels, None)
    assert np.all(np.isinf(found.position_error))
    np.testing.assert_array_equal(found.position, levels[1][0])
    assert np.all(found.first == 1)
    levels[1][1][:] = np.nan
    gone = extrapolate_members(of, members, steps, t, levels, None)
    assert np.all(gone.first == -1)
    assert np.all(np.isinf(gone.velocity_error))


# the Record


def experiment(**more: Any) -> Experiment:
    return Experiment.from_dict(
        {
            "title": "t",
            "model": {"kind": "pendulum"},
            "initial": {"theta": 1.0, "omega": 0.0},
            "time": {"end": 10.0},
            "levels": {"from": 5, "to": 8},
            "schemes": [{"kind": "central", "end_velocity": "kick"}],
            "output": "best",
        }
        | more
    )


def part(record: Record, cases: slice) -> Record:
    def cut(table: Any) -> dict[str, Variable]:
        return {
            name: Variable(
                v.dims,
                v.values[tuple(cases if dim == "case" else slice(None) for dim in v.dims)],
                v.attrs,
            )
            for name, v in table.items()
        }

    return Record(cut(record.coords), cut(record.variables), record.attrs)


def test_a_record_of_the_best_solution() -> None:
    sweep = {"initial.theta": [0.5, 1.0, 2.9], "schemes.central.arithmetic": list(ARITHMETICS)}
    many = experiment(sweep=sweep, samples={"every": 2})
    records = {level: simulate_record(many, level) for level in many.levels}
    best = best_record(many, records)
    assert best.sizes == {"scheme": 1, "case": 9, "t": 17}
    assert set(best.variables) == {
        "theta", "omega", "theta_error", "omega_error", "level_first", "level_last",
    }  # fmt: skip
    for variable in (*best.coords.values(), *best.variables.values()):
        assert variable.attrs["long_name"]
        assert variable.attrs["units"]
    assert best.variable("omega_error").attrs["units"] == "rad s-1"
    assert np.all(best["level_last"][..., -1] == 8)
    fine = records[8]
    for state in ("theta", "omega"):
        error = abs(best[state] - fine[f"{state}_exact"][None, :, ::8])
        assert np.all(error <= best[f"{state}_error"])


@pytest.mark.parametrize("edges", [(0, 2, 9), (0, 1, 4, 8, 9)])
def test_a_member_does_not_depend_on_the_others(edges: tuple[int, ...]) -> None:
    sweep = {"initial.theta": [0.5, 1.0, 3.14], "schemes.central.end_velocity": ["extrapolate", "backward", "kick"]}  # fmt: skip # noqa: E501
    many = experiment(sweep=sweep)
    records = {level: simulate_record(many, level) for level in many.levels}
    whole = best_record(many, records)
    for first, stop in itertools.pairwise(edges):
        cases = slice(first, stop)
        some = best_record(many, {level: part(r, cases) for level, r in records.items()})
        for name in whole.variables:
            np.testing.assert_array_equal(some[name], whole[name][:, cases])


def test_the_record_tells_who_reached_the_tolerance() -> None:
    # the second starts at the separatrix, omega = 2 cos(theta/2)
    sweep = {"initial.omega": [0.0, 1.755165, 1.754]}
    asked = Experiment.from_dict(
        {
            "title": "t",
            "model": {"kind": "pendulum"},
            "initial": {"theta": 1.0, "omega": 0.0},
            "time": {"end": 20.0},
            "schemes": [{"kind": "central", "end_velocity": "kick"}],
            "sweep": sweep,
            "output": "best",
            "tolerance": 1e-7,
        }
    ).with_levels((7, 8, 9, 10))
    best = best_record(asked, {level: simulate_record(asked, level) for level in asked.levels})
    worst = np.max([best["theta_error"].max(-1), best["omega_error"].max(-1)], axis=0)
    np.testing.assert_array_equal(best["reached"], worst <= 1e-7)
    assert best["reached"].tolist() == [[1, 0, 0]]
    assert 1e-7 < worst[0, 2] < np.inf
    assert best.meanings("reached") == {0: "no", 1: "yes"}
