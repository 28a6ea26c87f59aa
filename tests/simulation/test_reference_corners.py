"""References of motions whose force has corners or jumps: against SciPy stopped at each, closed forms, and schemes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from thinned import thinned

from vibsim import Experiment, analyse, simulate
from vibsim.models import MODELS, Model
from vibsim.models.table import Table
from vibsim.simulation.members import Members
from vibsim.simulation.reference import event_detection
from vibsim.simulation.reference.solve import method, reference

FRACTION = np.arange(101) / 100


def group(initial: dict[str, Any], parameters: dict[str, Any], end: list[float]) -> Members:
    count = len(end)
    return Members(
        index=np.arange(count),
        columns={},
        parameters={n: np.broadcast_to(x, count) + 0.0 for n, x in parameters.items()},
        initial={n: np.broadcast_to(x, count) + 0.0 for n, x in initial.items()},
        end=np.asarray(end, dtype=float),
    )


def oscillator(*declared: str, **formulas: str) -> Model:
    return MODELS["oscillator"].written(formulas, declared)


MASS = {"m": 1.0}
ROAD = Table(-0.13, 0.2, np.random.default_rng(7).normal(scale=0.01, size=41))


def vehicle(table: Table) -> Model:
    model = MODELS["vehicle"].with_formulas({"spring": "30*u"}, (), table, False)
    return model.variant(frozenset({"b"}))


@dataclass(frozen=True)
class Case:
    """A motion, its force written again by hand, on one side of each corner, and what changes sign at a corner."""

    model: Model
    force: Any
    """Of u, v, t and the signs of `corners`."""
    corners: tuple[Any, ...]
    """Functions of u, v and t."""
    u: float = 1.0
    v: float = 0.0
    end: float = 15.0
    parameters: Any = None


def _road_force(u: float, v: float, t: float, s: list[float]) -> float:
    x = ROAD.first + ROAD.spacing * np.arange(ROAD.points)
    q = np.zeros(ROAD.points)
    h = ROAD.heights
    q[1:-1] = (h[:-2] - 2 * h[1:-1] + h[2:]) / ROAD.spacing**2
    q[0], q[-1] = q[1], q[-2]
    return float(-np.interp(1.5 * t, x, q) * 1.5**2 - (0.8 * v + 30 * u) / 2.0)


ROAD_TIMES = [(ROAD.first + ROAD.spacing * i) / 1.5 for i in range(ROAD.points)]

CASES = {
    "quadratic": Case(
        oscillator(damping="0.3*abs(v)*v"),
        lambda u, v, t, s: -u - 0.3 * s[0] * v * v,
        (lambda u, v, t: v,),
        end=40.0,
    ),
    "quadratic_weak_spring": Case(
        oscillator(damping="2*v*abs(v)", spring="sin(u)", force="sin(1.3*t)"),
        lambda u, v, t, s: math.sin(1.3 * t) - math.sin(u) - 2 * s[0] * v * v,
        (lambda u, v, t: v,),
        u=0.0,
        v=0.4,
    ),
    "hard_stops": Case(
        oscillator(spring="u + 100*max(u - 1, 0) + 100*min(u + 1, 0)"),
        lambda u, v, t, s: -u
        - 100 * (u - 1 if s[0] > 0 else 0.0)
        - 100 * (u + 1 if s[1] < 0 else 0.0),
        (lambda u, v, t: u - 1, lambda u, v, t: u + 1),
        u=1.5,
        end=10.0,
    ),
    "play": Case(
        oscillator(spring="0 if abs(u) < 0.5 else u - 0.5*sign(u)", damping="0.05*v"),
        lambda u, v, t, s: -(u - 0.5 if s[0] > 0 else u + 0.5 if s[1] < 0 else 0.0) - 0.05 * v,
        (lambda u, v, t: u - 0.5, lambda u, v, t: u + 0.5),
    ),
    "onset": Case(
        oscillator(force="heaviside(t - 3)*cos(t)"),
        lambda u, v, t, s: -u + (math.cos(t) if s[0] > 0 else 0.0),
        (lambda u, v, t: t - 3,),
    ),
    "ramp": Case(
        oscillator(force="max(t - 2, 0) - max(t - 5, 0)", spring="u + u**3"),
        lambda u, v, t, s: -u - u**3 + (t - 2 if s[0] > 0 else 0.0) - (t - 5 if s[1] > 0 else 0.0),
        (lambda u, v, t: t - 2, lambda u, v, t: t - 5),
    ),
    "square_wave": Case(
        oscillator(force="sign(sin(3*t))"),
        lambda u, v, t, s: -u + s[0],
        (lambda u, v, t: math.sin(3 * t),),
    ),
    "pulses": Case(
        oscillator(force="0.3 if mod(t, 2) < 0.5 else 0", damping="0.1*v"),
        lambda u, v, t, s: -u - 0.1 * v + (0.3 if s[0] > 0 else 0.0),
        (lambda u, v, t: math.cos(math.pi * (t - 0.25)) - math.cos(math.pi * 0.25),),
    ),
    "one_sided": Case(
        oscillator(damping="0.4*v if v > 0 else 0.1*v"),
        lambda u, v, t, s: -u - (0.4 if s[0] > 0 else 0.1) * v,
        (lambda u, v, t: v,),
    ),
    "slipping": Case(
        oscillator(damping="0.1*sign(v)", force="3*cos(t/2)"),
        lambda u, v, t, s: -u - 0.1 * s[0] + 3 * math.cos(t / 2),
        (lambda u, v, t: v,),
        end=5.0,
    ),
    "several": Case(
        oscillator(spring="u + u*abs(u)", damping="0.2*sign(v)*v**4", force="abs(sin(t))"),
        lambda u, v, t, s: -u - s[0] * u * u - 0.2 * s[1] * v**4 + s[2] * math.sin(t),
        (lambda u, v, t: u, lambda u, v, t: v, lambda u, v, t: math.sin(t)),
    ),
    "jumping_spring": Case(
        oscillator(spring="u + 0.5*sign(u)", damping="0.1*v"),
        lambda u, v, t, s: -u - 0.5 * s[0] - 0.1 * v,
        (lambda u, v, t: u,),
    ),
    "table": Case(
        vehicle(ROAD),
        _road_force,
        tuple((lambda u, v, t, at=at: t - at) for at in ROAD_TIMES if 0 < at < 5.0),
        u=0.01,
        end=5.0,
        parameters={"m": 2.0, "b": 0.8, "speed": 1.5},
    ),
}  # fmt: skip


def steered(case: Case, signs: list[float], start: Any, stop: float, **more: Any) -> Any:
    """Run DOP853 with the signs held: its steps end at `stop`, where it is as accurate as it can be."""

    def right(t: float, y: Any) -> tuple[float, float]:
        return y[1], case.force(*y, t, signs)

    t, y = start
    options = {"method": "DOP853", "rtol": 2.3e-14, "atol": 1e-16, "max_step": 0.1}
    return solve_ivp(right, (t, stop), y, **options, **more)


def signs_behind(case: Case, start: Any, signs: list[float]) -> list[float]:
    """Return the signs of all switches a little later: none of them is 0 there."""
    t = start[0]
    later = steered(case, signs, start, t + 1e-6).y[:, -1]
    return [math.copysign(1.0, corner(*later, t + 1e-6)) for corner in case.corners]


def landed(case: Case, start: Any, signs: list[float], corner: Any, stop: float) -> Any:
    """Return time and state where a switch is 0, by the secant method on runs that end there."""
    times, found = [stop - 1e-5, stop], []
    for _ in range(6):
        y = steered(case, signs, start, times[len(found)]).y[:, -1]
        found.append((corner(*y, times[len(found)]), y))
        if len(found) > 1:
            (a, b), (f, g) = times[-2:], (found[-2][0], found[-1][0])
            if f == g or abs(g) < 1e-16:
                break
            times.append(b - g * (b - a) / (g - f))
    return times[len(found) - 1], found[-1][1]


def by_scipy(case: Case, times: np.ndarray) -> np.ndarray:
    """Return u and v at times, by DOP853 that is stopped at each corner and started anew behind it."""
    start, signs = (0.0, np.array([case.u, case.v])), [1.0] * len(case.corners)
    signs = signs_behind(case, start, signs)
    found = []
    for end in times:
        while start[0] < end:
            events: list[Any] = []
            for corner, sign in zip(case.corners, signs, strict=True):
                # at the start a switch may be 0 by its rounding
                events.append(
                    lambda t, y, c=corner, sign=sign, first=start[0]: (
                        sign * c(*y, t) if t > first + 1e-7 else 1.0
                    )
                )
                events[-1].terminal, events[-1].direction = True, -1
            run = steered(case, signs, start, end, events=events)
            hit = [k for k, hits in enumerate(run.t_events) if len(hits)]
            if not hit:
                start = end, run.y[:, -1]
                break
            start = landed(case, start, signs, case.corners[hit[0]], run.t[-1])
            signs = signs_behind(case, start, signs)
        found.append(start[1])
    return np.array(found).T


@pytest.mark.parametrize("name", thinned(CASES, 3))
def test_scipy_stopped_at_the_corners_finds_the_same_motion(name: str) -> None:
    case = CASES[name]
    numbers = case.parameters or MASS
    series, bounds = reference(
        case.model, group({"u": case.u, "v": case.v}, numbers, [case.end]), FRACTION
    )
    assert "every corner" in method(case.model)
    other = by_scipy(case, FRACTION[10::10] * case.end)
    for row, key in enumerate(("u", "v")):
        size = np.max(np.abs(series[key]))
        assert 0.0 < bounds[key][0] <= 1.2e-12 * size
        # DOP853's own error: its tolerance over some hundred steps
        assert np.max(np.abs(series[key][0, 10::10] - other[row])) <= 3e-12 * size


SWEEP = {"u": [1.0, 0.2, 3.0, 0.0, 1.0], "v": [0.0, 1.0, -1.0, 0.0, 0.5]}


@pytest.mark.parametrize("b", [0.05, 0.7])
def test_free_motion_has_its_first_integral_between_turns(b: float) -> None:
    """With s the sign of v, (v^2 + u/(b s) - 1/(2 b^2)) exp(2 b s u) is constant where v does not vanish."""
    model = oscillator("b", damping="b*abs(v)*v")
    ends = [20.0, 9.0, 14.0, 5.0, 30.0]
    numbers = {**MASS, "parameters.b": b}
    series, bounds = reference(model, group(SWEEP, numbers, ends), np.arange(2001) / 2000)
    assert np.isfinite(bounds["u"]).all()
    for u, v in zip(series["u"], series["v"], strict=True):
        s = np.where(v > 0.0, 1.0, -1.0)
        kept = (v * v + u / (b * s) - 0.5 / b**2) * np.exp(2.0 * b * s * u)
        same = s[1:] == s[:-1]
        size = np.max((v * v + np.abs(u) / b + 0.5 / b**2) * np.exp(2.0 * b * s * u))
        assert np.max(np.abs(np.diff(kept)[same])) <= 1e-14 * size
    # at rest it stays
    assert not series["u"][3].any()


def test_a_mass_on_a_stop_has_its_closed_form() -> None:
    """Free flight between two stiff springs: half a sine of frequency 10 at each, and straight lines between them."""
    model = oscillator(spring="100*max(u - 1, 0) + 100*min(u + 1, 0)")
    end, fraction = 40.0, np.arange(4001) / 4000
    series, bounds = reference(model, group({"u": 0.0, "v": 1.0}, MASS, [end]), fraction)
    half = 2.0 + math.pi / 10.0
    t = (fraction * end + 1.0) % (2.0 * half)
    way = t % half
    u = np.where(way < 2.0, way - 1.0, 1.0 + np.sin(10.0 * (way - 2.0)) / 10.0)
    u = np.where(t < half, u, -u)
    assert 0.0 < bounds["u"][0] < 1e-12
    assert np.max(np.abs(series["u"][0] - u)) <= 5e-14


@pytest.mark.parametrize("damping", thinned(["b*abs(v)*v", "b*v if v > 0 else b*v/3"], 2))
def test_a_member_has_its_bits_whatever_is_computed_beside_it(damping: str) -> None:
    model = oscillator("b", "w", damping=damping, spring="u + max(u - 0.9, 0)", force="sin(w*t)")
    ends = [9.0, 4.0, 7.0, 2.0, 12.0]
    numbers = {
        **MASS,
        "parameters.b": [0.1, 0.3, 1.0, 2.0, 0.01],
        "parameters.w": [0.5, 3.0, 1.0, 0.0, 1.1],
    }
    together, bounds = reference(model, group(SWEEP, numbers, ends), FRACTION)
    assert np.isfinite(bounds["u"]).all()
    for case, end in enumerate(ends):
        own = {n: np.asarray(x)[case] if np.ndim(x) else x for n, x in numbers.items()}
        start = {n: x[case] for n, x in SWEEP.items()}
        alone, bound = reference(model, group(start, own, [end]), FRACTION)
        for name in ("u", "v"):
            assert alone[name][0].tobytes() == together[name][case].tobytes()
            assert bound[name][0] == bounds[name][case]


@pytest.mark.parametrize(
    "formulas",
    [
        {"damping": "0.5*sign(v)"},
        {"damping": "0.5*sign(v)", "force": "cos(t)"},
        {"spring": "u + max(u - 0.5, 0)**1.5"},
        {"damping": "0.2*sign(v)*sqrt(abs(v))"},
        pytest.param({"force": "sign(sin(1/(t - 2)))"}, marks=pytest.mark.slow),
    ],
)
def test_what_has_no_reference(formulas: dict[str, str]) -> None:
    """A body that friction holds or that chatters, pieces that are singular at their ends, infinitely many corners."""
    model = oscillator(**formulas)
    series, bounds = reference(model, group({"u": 1.0, "v": 0.0}, MASS, [40.0]), FRACTION)
    assert np.isnan(series["u"]).all()
    assert np.isnan(bounds["u"]).all()


@pytest.mark.parametrize("over", [1e-3, 1e-5, 1e-7, 0.0, -1e-7, -1e-3])
def test_a_corner_that_is_hardly_met(over: float) -> None:
    """cos t rises above 1 - over for a time of about 2 (2 over)^(1/2); the bound holds whether that is seen or not."""
    model = oscillator("d", spring="u + 100*max(u - 1 + d, 0)")
    numbers = {**MASS, "parameters.d": over}
    start = {"u": 0.0, "v": 1.0}
    series, bounds = reference(model, group(start, numbers, [6.0]), np.array([0.0, 1.0]))
    # beyond the corner it is an oscillation with the frequency w around c
    w, c = math.sqrt(101.0), 100.0 * (1.0 - over) / 101.0
    u, v = math.sin(6.0), math.cos(6.0)
    if over > 0.0:
        first = math.asin(1.0 - over)
        speed = math.cos(first)
        # it comes back with the opposite velocity
        depth = 1.0 - over - c
        half = (math.pi - 2.0 * math.atan2(depth * w, speed)) / w
        half = 2.0 * math.atan2(speed, depth * w) / w
        last = math.asin(1.0 - over)
        rest = 6.0 - first - half
        u = math.sin(last) * math.cos(rest) - speed * math.sin(rest)
        v = -math.sin(last) * math.sin(rest) - speed * math.cos(rest)
    found = series["u"][0, -1], series["v"][0, -1]
    if np.isfinite(bounds["u"][0]):
        assert abs(found[0] - u) <= bounds["u"][0] + 2e-15
        assert abs(found[1] - v) <= bounds["v"][0] + 2e-15
    if abs(over) >= 1e-5:
        assert np.isfinite(bounds["u"][0])


def content(**changes: Any) -> dict[str, Any]:
    return {
        "title": "t",
        "model": {"kind": "oscillator", "damping": {"quadratic": 0.3}, "spring": "sin(u)"},
        "initial": {"u": 1.0},
        "time": {"end": 6.0},
        "levels": [6, 7, 8, 9],
        "schemes": ["central", "gauss4"],
        **changes,
    }


@pytest.mark.parametrize(
    ("scheme", "end", "order"),
    [
        ("central", 2.0, 2.0),
        ("rk4", 2.0, 4.0),
        pytest.param("central", 20.0, 2.0, marks=pytest.mark.slow),
        pytest.param("rk4", 20.0, 3.0, marks=pytest.mark.slow),
        pytest.param("gauss4", 20.0, 3.0, marks=pytest.mark.slow),
    ],
)
def test_schemes_converge_to_it_at_their_orders(scheme: str, end: float, order: float) -> None:
    """The orders of the schemes before the first turn, and 3 at most behind it.

    Where a corner lies within its step is another part of it at each level and for each member: what is left of that
    in the mean over members is the order.
    """
    levels = [4, 5, 6, 7, 8] if end < 3.0 else [9, 10, 11, 12, 13]
    made = content(
        model={"kind": "oscillator", "damping": {"quadratic": 0.5}},
        initial={"u": 1.0, "v": -0.1}, time={"end": end}, levels=levels, schemes=[scheme],
        samples="common", sweep={"initial.u": {"linspace": [0.8, 1.2, 16]}},
    )  # fmt: skip
    experiment = Experiment.from_dict(made)
    errors = []
    for level in (levels[0], levels[-1]):
        found = simulate(experiment, level)
        assert "every corner" in found["u_exact"].attrs["method"]
        gaps = np.abs((found["u"] - found["u_exact"]).values[0])
        errors.append(np.mean(np.log2(np.max(gaps, axis=-1))))
    measured = (errors[0] - errors[1]) / (levels[-1] - levels[0])
    assert measured == pytest.approx(order, abs=0.15)


def test_errors_of_a_table_are_taken_against_it(tmp_path: Any, monkeypatch: Any) -> None:
    rows = [f"{ROAD.first + ROAD.spacing * i:.10g},{h:.17g}" for i, h in enumerate(ROAD.heights)]
    (tmp_path / "road.csv").write_text("\n".join(["x,h", *rows]) + "\n")
    monkeypatch.chdir(tmp_path)
    model = {"kind": "vehicle", "m": 2.0, "b": 0.8, "speed": 1.5, "spring": "30*u"}
    experiment = Experiment.from_dict(
        content(
            model={**model, "road": {"table": "road.csv"}},
            initial={"u": 0.01},
            time={"end": 5.0},
            checks=[{"value": "error_linf", "quantity": "absolute_position", "below": 1e-3}],
        )
    )
    record = analyse(experiment, [simulate(experiment, level) for level in experiment.levels])
    errors = np.abs(record["u_error_norm"].sel(norm="linf").values[:, 0])
    assert np.all(errors[:, -1] < errors[:, 0] / 20)
    assert np.isfinite(record["absolute_position_error_norm"]).all()


def test_a_root_of_a_bent_function_is_found_in_a_few_steps() -> None:
    """``e^(k x) = 2``; regula falsi alone would keep one end of the bracket and creep."""
    rates = np.array([1.0, 3.0, -3.0])
    left, right = np.where(rates > 0.0, 0.0, -1.0), np.where(rates > 0.0, 1.0, 0.5)
    sign = np.sign(rates)
    found = event_detection._root(lambda x: sign * (np.exp(rates * x) - 2.0), left, right)
    np.testing.assert_allclose(found, np.log(2.0) / rates, rtol=1e-8)
