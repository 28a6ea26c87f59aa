"""The most accurate values that a ladder holds, against numbers that are known otherwise."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest

from vibsim.analysis import Verdict, analyse_parts, analyse_records, join_parts, verdicts
from vibsim.comparison.best_solution import best_record
from vibsim.comparison.best_values import scalars
from vibsim.comparison.largest_between_samples import largest_between_samples
from vibsim.convergence.extrapolation.gci import CLASSES
from vibsim.core.record import Record
from vibsim.experiment import Experiment
from vibsim.experiment.value_names import VALUES
from vibsim.observe.member_block import block_of
from vibsim.simulation import simulate_record

PENDULUM = {"model": {"kind": "pendulum"}, "initial": {"theta": 1.0}, "time": {"end": 40.0}}
SPRING = {"model": {"kind": "spring", "w": "2*pi"}, "initial": {"u": 1.0}, "time": {"end": 10.3}}
CIRCUIT = {
    "model": {"kind": "circuit", "L": 2.0, "R": 0.4, "C": 0.5, "voltage": "1.5"},
    "initial": {"i": 0.0, "di_dt": 0.75},
    "time": {"end": 12.0},
}
LEVELS = [7, 8, 9, 10, 11]


def analysed(*checks: dict[str, Any], **data: Any) -> tuple[Experiment, Record]:
    given = {"title": "test", "levels": LEVELS, "schemes": ["central"], "checks": list(checks)}
    experiment = Experiment.from_dict({**given, **data})
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    return experiment, analyse_records(experiment, records)


def best(record: Record, name: str, scheme: int = 0, case: int = 0) -> tuple[float, float]:
    return float(record[f"{name}_richardson"][scheme, case]), float(
        record[f"{name}_richardson_error"][scheme, case]
    )


def judged(*checks: dict[str, Any], **data: Any) -> list[Verdict]:
    return verdicts(*analysed(*checks, **data))


@pytest.mark.slow
def test_the_period_of_the_pendulum_is_within_its_bound() -> None:
    """Against the complete elliptic integral, for every scheme and amplitude."""
    schemes = ["central", "rk4", "euler_cromer", "velocity_verlet", "heun"]
    sweep = {"initial.theta": [0.1, 1.0, 2.5]}
    _, record = analysed(**(PENDULUM | {"schemes": schemes, "sweep": sweep}))
    for case, exact in enumerate(record["exact_period"]):
        for i, scheme in enumerate(schemes):
            value, bound = best(record, "period", i, case)
            assert abs(value - exact) <= bound < 1e-2 * exact, (scheme, case)
            finest = float(record["period"][i, case, -1])
            if scheme in {"central", "euler_cromer", "velocity_verlet"}:
                assert abs(value - exact) < 0.02 * abs(finest - exact), (scheme, case)


@pytest.mark.parametrize("base", [40, 64, 90, 128, 150])
def test_a_period_whose_peaks_are_not_symmetric_is_within_its_bound(base: int) -> None:
    """Of van der Pol's limit cycle, from which it starts; 6.66328685932 is known to all its digits.

    The straight line between two velocities finds a peak to dt^2 only, by an accident of where it lies in the step.
    """
    start, schemes = {"u": 2.008619860874843}, ["rk4", "gauss4"]
    model = {"kind": "system", "acceleration": "(1 - u**2)*v - u"}
    time = {"end": 20.0, "base_steps": base}
    _, record = analysed(
        model=model, initial=start, time=time, levels=[0, 1, 2, 3], schemes=schemes
    )
    for i, scheme in enumerate(schemes):
        value, bound = best(record, "period", i)
        assert abs(value - 6.66328685932) <= bound < 0.01, (scheme, value, bound)
        value, bound = best(record, "frequency", i)
        assert abs(value - 2.0 * math.pi / 6.66328685932) <= bound < 0.002, (scheme, value, bound)


def test_extrema_of_a_motion_driven_faster_than_it_swings_are_within_their_bounds() -> None:
    """Against the closed form; such a motion, and products of states, bend more than a small oscillation does."""
    frequencies, start = [2.3, 3.1, 4.4, 5.9], (0.3, 0.4)
    model = {
        "kind": "system",
        "acceleration": "3*cos(w*t) - u",
        "parameters": {"w": 1.0},
        "outputs": {"product": "u*v", "square": "u**2 + v**2/2"},
    }
    _, record = analysed(
        model=model,
        initial=dict(zip("uv", start, strict=True)),
        sweep={"model.parameters.w": frequencies},
        time={"end": 11.3, "base_steps": 5},
        levels=[4, 5, 6, 7, 8],
        schemes=["rk4", "crank_nicolson"],
    )
    t = np.linspace(0.0, 11.3, 200_001)
    for case, w in enumerate(frequencies):
        forced = 3.0 / (1.0 - w**2)
        u = forced * (np.cos(w * t) - np.cos(t)) + start[0] * np.cos(t) + start[1] * np.sin(t)
        v = forced * (np.sin(t) - w * np.sin(w * t)) - start[0] * np.sin(t) + start[1] * np.cos(t)
        for name, series in {"u": u, "v": v, "product": u * v, "square": u**2 + v**2 / 2}.items():
            for which, exact in (("min", series.min()), ("max", series.max())):
                for scheme in (0, 1):
                    value, bound = best(record, f"{name}_{which}", scheme, case)
                    assert abs(value - exact) <= bound + 1e-8, (name, which, w, scheme)
                    assert bound < 1e-3 * np.max(np.abs(series))


@pytest.mark.parametrize(
    ("function", "end"),
    [
        (lambda t: np.cos(t - 3.3), 9.0),
        (lambda t: np.sin(t) + 0.3 * np.cos(3.0 * t + 1.0), 9.0),
        (lambda t: np.exp(-0.3 * t) * np.sin(2.0 * t + 1.5), 9.0),  # falls soon behind its start
        (lambda t: np.cos(0.4 * t), 7.0),  # from its crest
        (lambda t: 1.0 - np.exp(-t), 4.0),  # up to the end
        (lambda t: np.exp(np.sin(t)), 60.0),  # nine crests alike
        (lambda t: 0.0 * t + 2.0, 1.0),
        (lambda t: np.sin(1.3 * t + 0.1), 2.5),
    ],
)
def test_the_largest_value_between_samples(function, end) -> None:
    """Against samples two hundred times as dense, from all places within a step."""
    for step in (0.15, 0.04):
        starts = np.linspace(0.0, step, 9)[:, None]
        count = int(end / step)
        largest, bound = largest_between_samples([function(starts + step * np.arange(count))])
        dense = step * np.linspace(0.0, count - 1.0, 200 * (count - 1) + 1)
        exact = np.max(function(starts + dense), axis=-1, keepdims=True)
        assert np.all(np.abs(largest - exact) <= bound + 1e-5 * step**2)
        assert np.all(bound <= 2.0 * step**4)


@pytest.mark.parametrize("fall", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("power", [1, 2])
def test_a_crest_where_a_slope_or_a_curvature_jumps_is_within_its_bound(
    fall: float, power: int
) -> None:
    """Anywhere in the series, its first and last step among them."""
    step, tip = 0.1, np.linspace(0.0, 1.9, 191)[:, None]
    behind = step * np.arange(20) - tip
    largest, bound = largest_between_samples(
        [1.0 - np.abs(behind) ** power * np.where(behind < 0.0, 1.0, fall)]
    )
    assert np.all(np.abs(largest - 1.0) <= bound + 1e-12)
    assert np.all(bound <= 2.1 * max(fall, 1.0) * step**power)


def test_a_scheme_that_chooses_its_steps_has_no_best_extremum() -> None:
    """It has no levels that could tell its error."""
    schemes = ["central", {"kind": "dop853", "tolerance": 1e-6}]
    _, record = analysed(**(PENDULUM | {"schemes": schemes}))
    for name in ("theta_max", "omega_min", "wire_force_max"):
        for what in (f"{name}_richardson", f"{name}_richardson_error"):
            assert np.isfinite(record[what][0]).all()
            assert np.isnan(record[what][1]).all(), what


def test_numbers_of_the_spring() -> None:
    """Against cos(w t) and -w sin(w t)."""
    w = 2 * math.pi
    exact = {
        "frequency": w,
        "growth_per_period": 1.0,
        "relative_energy_error": 0.0,
        "u_end": math.cos(w * 10.3),
        "v_end": -w * math.sin(w * 10.3),
        "v_max": w,
        "v_min": -w,
    }
    for scheme in ("central", "rk4"):
        _, record = analysed(**(SPRING | {"schemes": [scheme]}))
        for name, number in exact.items():
            value, bound = best(record, name)
            assert abs(value - number) <= bound, (scheme, name)
            assert bound < 0.01 * max(abs(number), 1.0)


@pytest.mark.slow
def test_a_jump_of_the_force_that_no_level_shows_is_part_of_every_bound() -> None:
    """Just behind a point of all levels it comes too early on each, by the same; u = 0.4 cos t + F (1 - cos(t - s))."""
    start, end, strength = 1.2501, 2.5, 1.3
    model = {"kind": "oscillator", "force": f"{strength}*heaviside(t - {start})"}
    exact = {
        "u_end": 0.4 * math.cos(end) + strength * (1.0 - math.cos(end - start)),
        "v_end": -0.4 * math.sin(end) + strength * math.sin(end - start),
    }
    data = {"model": model, "initial": {"u": 0.4}, "time": {"end": end}, "levels": [4, 5, 6, 7, 8]}
    for scheme in ("gauss4", "central", "heun"):
        _, record = analysed(**data, schemes=[scheme])
        for name, number in exact.items():
            value, bound = best(record, name)
            assert abs(value - number) <= bound < 0.06, (scheme, name)
            assert abs(value - number) > 1e-5
    # at a point of all levels there is nothing of the kind
    data["model"] = model | {"force": f"{strength}*heaviside(t - 1.25)"}
    _, record = analysed(**data, schemes=["gauss4"])
    assert best(record, "u_end")[1] < 1e-5


def test_a_jump_behind_a_corner_of_the_force_is_part_of_the_bound() -> None:
    """The corner, at u = 0.2, comes first and leaves less; the reference has the end."""
    model = {
        "kind": "oscillator",
        "spring": "u + max(u - 0.2, 0)",
        "force": "heaviside(t - 4.9269)",
    }
    data = {"model": model, "initial": {"u": 0.5, "v": 0.2}, "time": {"end": 7.5}}
    experiment, record = analysed(**data, levels=[6, 7, 8], schemes=["gauss4"])
    exact = float(simulate_record(experiment, 8)["u_exact"][0, -1])
    value, bound = best(record, "u_end")
    assert 1e-3 < abs(value - exact) <= bound < 0.05


def test_a_jump_of_the_force_that_no_level_shows_is_part_of_the_bound_of_the_best_solution() -> (
    None
):
    start, end, strength = 1.2501, 2.5, 1.3
    model = {"kind": "oscillator", "force": f"{strength}*heaviside(t - {start})"}
    data = {"title": "t", "model": model, "time": {"end": end}, "tolerance": 0.015}
    data |= {"initial": {"u": 0.4}, "schemes": ["gauss4"], "output": "best"}
    experiment = Experiment.from_dict(data).with_levels((5, 6, 7))
    levels = {level: simulate_record(experiment, level) for level in experiment.levels}
    record = best_record(experiment, levels)
    t = np.asarray(record["t"])
    exact = 0.4 * np.cos(t) + strength * np.where(t > start, 1.0 - np.cos(t - start), 0.0)
    away = np.abs(record["u"][0, 0] - exact)
    assert np.all(away <= record["u_error"][0, 0])
    assert np.max(away) > 1e-5
    # the same part of the size of each state, of which one is within the tolerance
    bounds = {name: np.max(record[f"{name}_error"]) for name in ("u", "v")}
    parts = [bound / np.max(np.abs(record[name])) for name, bound in bounds.items()]
    assert parts[1] == pytest.approx(parts[0], rel=1e-3)
    assert bounds["u"] < 0.015 < bounds["v"]
    assert not record["reached"][0, 0]


def test_an_extremum_at_an_impact_is_that_of_the_event_or_up_to_a_step_away() -> None:
    """Heights at events are stored of the first coordinate only."""
    forces = {"u": "0.893*cos(1.02*t) - 2.29*u - 0.0415*vu", "x": "-x"}
    for names, most in (("u", "x"), 1e-12), (("x", "u"), 0.03):
        _, record = analysed(
            model={
                "kind": "system",
                "coordinates": {name: {"acceleration": forces[name]} for name in names},
            },
            initial={"u": -1.15, "vu": -0.586},
            events=[{"when": "u - 0.185", "rising": True, "then": {"vu": "-0.837*vu"}}],
            time={"end": 7.42},
            levels=[6, 7, 8, 9, 10],
            schemes=["rk3"],
        )
        value, bound = best(record, "u_max")
        assert abs(0.185 - value) <= bound < most
    assert 0.185 - value > 1e-3


@pytest.mark.parametrize("friction", [0.1, 0.4])
def test_an_extremum_where_friction_turns_or_stops_a_body_has_the_order_of_the_scheme(
    friction: float,
) -> None:
    """The first swing ends at -(1 - 2 c), from where the body slides back, or where it sticks."""
    model = {"kind": "oscillator", "damping": {"coulomb": friction}, "spring": "u"}
    data = {"model": model, "initial": {"u": 1.0}, "schemes": ["rk4"]}
    time = {"end": 10.0, "base_steps": 50}
    _, record = analysed(**data, time=time, levels=[0, 1, 2, 3])
    value, bound = best(record, "u_min")
    assert abs(value + 1.0 - 2.0 * friction) <= bound < 1e-8


@pytest.mark.parametrize(("sign", "name"), [(-1.0, "u_min"), (1.0, "u_max")])
def test_an_extremum_before_the_first_point_is_not_taken_for_the_start(
    sign: float, name: str
) -> None:
    decay, u, v = 0.2, 0.5, 0.03
    w, t = math.sqrt(1.0 - decay**2), np.linspace(0.0, 1.0, 100_001)
    motion = np.exp(-decay * t) * (u * np.cos(w * t) + (v + decay * u) / w * np.sin(w * t))
    model = {"kind": "oscillator", "damping": {"linear": 2.0 * decay}}
    data = {"model": model, "time": {"end": 8.3}, "levels": [4, 5, 6], "schemes": ["rk4"]}
    _, record = analysed(**data, initial={"u": sign * u, "v": sign * v})
    value, bound = best(record, name)
    assert sign * value > u
    assert abs(value - sign * np.max(motion)) <= bound < 2e-4
    _, record = analysed(**data, initial={"u": sign * u})
    assert best(record, name)[1] < 1e-13


def test_numbers_of_the_circuit() -> None:
    """i(t) = a exp(-R t/(2 L)) sin(w t), written down by hand; its first peak is its largest value."""
    inductance, resistance, capacity, first = 2.0, 0.4, 0.5, 0.75
    decay = resistance / (2 * inductance)
    w = math.sqrt(1 / (inductance * capacity) - decay**2)
    t = np.array([math.atan2(w, decay) / w, 12.0])
    i = first / w * np.exp(-decay * t) * np.sin(w * t)
    _, record = analysed(**CIRCUIT)
    for name, number in (("i_end", i[1]), ("i_max", i[0])):
        value, bound = best(record, name)
        assert abs(value - number) <= bound < 2e-3, name
    value, bound = best(record, "i_end")
    assert abs(value - i[1]) < 1e-8


def test_what_is_stored_says_how_it_was_found() -> None:
    experiment, record = analysed(**PENDULUM)
    names = record.words("scalar")
    assert {"period", "amplitude", "frequency", "theta_end", "omega_max", "wire_force_max"} <= set(
        names
    )
    k = names.index("period")
    assert int(record["scalar_last"][k, 0, 0]) == 11
    assert CLASSES[int(record["scalar_convergence"][k, 0, 0])] == "monotone"
    assert record["scalar_order"][k, 0, 0] == pytest.approx(2.0, abs=0.05)
    finest = record["period"][0, 0, -1]
    assert record["scalar_finest"][k, 0, 0] == finest
    change = abs(record["period"][0, 0, -1] - record["period"][0, 0, -2])
    assert record["period_gci"][0, 0] == pytest.approx(1.25 * change / 3)
    assert record["scalar_gci"][k, 0, 0] == pytest.approx(1.25 * change / 3 / finest)
    units = record.variable("omega_end_richardson").attrs["units"]
    assert units == experiment.model.definition.states[1].unit
    # a linear motion does not grow by this scheme
    _, record = analysed(**SPRING)
    k = record.words("scalar").index("growth_per_period")
    assert CLASSES[int(record["scalar_convergence"][k, 0, 0])] == "round_off"


def test_every_value_that_exists_at_best_has_a_limit_or_is_of_the_solution() -> None:
    have_limits = {name for name, value in VALUES.items() if value.has_limit("best")}
    assert {name for name in have_limits if not VALUES[name].best} == set()
    rest = {name for name, value in VALUES.items() if value.best} - have_limits
    assert rest == {"error_l1", "error_l2", "error_linf", "error_linf_interior"}


def test_checks_compare_the_limit_and_tell_its_bound() -> None:
    at = {"level": "best"}
    record = analysed(**PENDULUM)[1]
    exact, last = float(record["exact_period"][0]), float(record["period"][0, 0, -1])
    finest = {"value": "period", "equals": exact, "atol": 2e-5}
    right = finest | {"at": at, "atol": 1e-6}
    near = {"value": "period", "at": at, "below": exact - 1e-7}
    wrong = {"value": "period", "at": at, "equals": exact + 1e-4, "atol": 1e-5}
    of_the_last = {"value": "period", "at": at, "equals": last, "atol": 1e-7}
    found = judged(finest, right, near, wrong, of_the_last, **PENDULUM)
    assert [v.status for v in found] == ["FAIL", "PASS", "INCONCLUSIVE", "FAIL", "FAIL"]
    assert [v.reason for v in found[1:]] == ["match", "pre_asymptotic", "mismatch", "mismatch"]
    # no level is finer than all of them
    assert found[4].results[0].facts["level_as_asked"] is None
    assert "with an error of at most" in found[1].text
    assert "`levels:`" in found[2].advice


def test_a_number_that_its_bound_does_not_prove_is_said_so_or_left_open() -> None:
    value, bound = best(analysed(**PENDULUM)[1], "period")
    near = {"value": "period", "at": {"level": "best"}}
    asked = [{"equals": value, "atol": part * bound} for part in (0.5, 2.0)]
    asked += [{"below": value + part * bound} for part in (0.5, 2.0)]
    asked += [{"above": value - part * bound} for part in (0.5, 2.0)]
    found = judged(*(near | one for one in asked), **PENDULUM)
    assert [v.status for v in found] == ["PASS", "PASS", *(["INCONCLUSIVE", "PASS"] * 2)]
    unproved = "do not prove it: the error bound is wider than what is asked"
    assert [unproved in v.text for v in found] == [True, *([False] * 5)]


def test_one_level_bounds_nothing() -> None:
    checks = [{"value": "period", "at": {"best": True}, "below": x} for x in (6.0, 7.0)]
    found = judged(*checks, **(PENDULUM | {"levels": [9]}))
    assert [(v.status, v.reason) for v in found] == [
        ("INCONCLUSIVE", "too_few_levels"),
        ("PASS", "match"),
    ]
    assert "unknown error, because there is one level only" in found[0].text


def test_a_level_too_coarse_for_a_number_does_not_hide_what_finer_ones_say() -> None:
    """The coarsest level has no turn; the others approach a period."""
    run = PENDULUM | {"initial": {"theta": 2.0}, "time": {"end": 20.0}, "levels": [4, 5, 6, 7, 8]}
    check = {"value": "period", "at": {"level": "best"}, "equals": 8.35, "atol": 0.01}
    experiment, record = analysed(check, **run, schemes=["euler_cromer"])
    assert np.isnan(record["period"][0, 0, 0])
    assert np.isfinite(record["period"][0, 0, 1:]).all()
    value, bound = best(record, "period")
    assert abs(value - float(record["exact_period"][0])) <= bound < 0.01
    assert "with an error of at most" in verdicts(experiment, record)[0].text


def test_a_number_of_a_level_that_is_named_is_asked_of_a_finer_one() -> None:
    """Finer levels alone do not change the number of a level that stays the same."""
    run = SPRING | {"levels": [6, 7]}
    asked = {"value": "end", "quantity": "u", "equals": -0.3, "atol": 0.01}
    of_finest, of_level = judged(asked, asked | {"at": {"level": 7}}, **run)
    assert of_finest.reason == of_level.reason == "mismatch"
    assert of_finest.advice.startswith("Add level")
    assert "ask for one" not in of_finest.advice
    assert "and ask for one (`at: {level: 9}`)" in of_level.advice


def test_a_scheme_that_chooses_its_own_steps_has_no_limits() -> None:
    schemes = ["central", {"kind": "dop853", "tolerance": 1e-6}]
    _, record = analysed(**(PENDULUM | {"schemes": schemes}))
    assert np.isnan(record["period_richardson"][1]).all()
    assert np.isfinite(record["period_richardson"][0]).all()


@pytest.mark.slow
def test_a_large_sweep_keeps_period_and_amplitude_only() -> None:
    sweep = {"initial.theta": {"linspace": [0.1, 2.0, 5]}}
    experiment, record = analysed(**(PENDULUM | {"sweep": sweep}))
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    lean = {
        level: Record(row.coords, row.variables, {**row.attrs, "storage": "lean"})
        for level, row in records.items()
    }
    block = block_of(experiment, lean)
    assert [row.variable for row in scalars(block.model, block.lean)] == ["period", "amplitude"]
    thin = analyse_records(experiment, lean)
    kept = {name for name in thin.variables if "gci" in name or name.startswith("scalar_")}
    assert kept == set()
    np.testing.assert_array_equal(thin["period_richardson"], record["period_richardson"])
    assert "scalar" not in thin.coords


@pytest.mark.slow
def test_members_are_the_same_in_parts() -> None:
    data = PENDULUM | {"sweep": {"initial.theta": [0.3, 1.0, 3.0, 2.0]}}
    experiment, whole = analysed(**data)

    readers = {level: partial(simulate_record, experiment, level) for level in experiment.levels}
    parts = join_parts(list(analyse_parts(experiment, readers, size=1)))
    for name in (
        "period_richardson",
        "theta_end_richardson_error",
        "scalar_order",
        "omega_max_gci",
    ):
        np.testing.assert_array_equal(parts[name], whole[name])


def test_bounds_of_numbers_by_peaks_know_nothing_of_the_rounding_of_roots() -> None:
    """The recurrence is for linear models: elsewhere eps/(w dt)^2 does not enter."""
    _, record = analysed(**(PENDULUM | {"levels": [13, 14, 15, 16], "samples": "common"}))
    assert best(record, "growth_per_period")[1] < 1e-6
    assert best(record, "frequency")[1] < 1e-9


def test_a_sample_has_a_bound_near_that_of_the_series() -> None:
    """Against 2 asin(k sn(K - 20)), k = sin(1/2)."""
    short = {"time": {"end": 20.0}, "levels": [6, 7, 8, 9], "schemes": ["rk4"]}
    value, bound = best(analysed(**(PENDULUM | short))[1], "theta_end")
    assert abs(value - 0.9958006771243681) <= bound < 1e-7


def test_a_number_that_has_not_settled_does_not_pass_by_chance() -> None:
    """With 2 to 8 steps a period the ends differ by their size, and nothing bounds the error of the finest one."""
    given = {"model": {"kind": "spring", "w": 20.0}, "initial": {"u": 1.0}, "time": {"end": 5.0}}
    at = {"quantity": "u", "at": {"level": "best"}}
    near = {"value": "end", "equals": 0.3, "atol": 0.3} | at
    wide = {"value": "end", "equals": 0.3, "atol": 30} | at
    found = judged(near, wide, **given, levels=[5, 6, 7], schemes=["newmark"])
    assert math.cos(100.0) > 0.8
    assert "u at the end is 0.4658" in found[0].text
    assert "unknown error" in found[0].text
    assert [(v.status, v.reason) for v in found] == [
        ("INCONCLUSIVE", "pre_asymptotic"),
        ("PASS", "match"),
    ]


def test_a_number_whose_changes_do_not_shrink_has_no_best_value() -> None:
    """Pushed to rest upside down, the computed pendulum turns later by ln 4 with each level: there is no period."""
    given = {"model": {"kind": "pendulum"}, "initial": {"theta": 0.0, "omega": 2.0}}
    run = given | {"time": {"end": 40.0}, "levels": [9, 10, 11, 12, 13]}
    near, far = ({"value": "period", "above": x, "at": {"level": "best"}} for x in (6.28, -1.5))
    found = judged(near, far, **run, schemes=[{"kind": "central", "end_velocity": "kick"}])
    assert [v.reason for v in found] == ["pre_asymptotic", "match"]
    assert "because its changes do not shrink steadily from level to level" in found[0].text


@pytest.mark.parametrize(
    ("kind", "levels"),
    [
        ("backward_euler", [5, 6, 7]),
        ("backward_euler", [5, 6, 7, 8, 9]),
        ("central", [7, 8, 9, 10]),
    ],
)
def test_a_crest_that_another_one_overtakes_is_within_its_bound(
    kind: str, levels: list[int]
) -> None:
    """At every level one crest is the largest, and in the limit another one: by closed forms."""
    start = {"backward_euler": (1.0, -0.2), "central": (1.0, 1.7768)}[kind]
    force = {"backward_euler": "0", "central": "cos(0.8*t)"}[kind]
    content = {
        "title": "test",
        "model": {"kind": "system", "acceleration": f"-u + {force}"},
        "initial": dict(zip(("u", "v"), start, strict=True)),
        "time": {"end": {"backward_euler": 8.0, "central": 24.0}[kind]},
        "levels": levels,
        "schemes": [kind],
    }
    exact = {"backward_euler": math.sqrt(1.04), "central": 4.973592638}[kind]
    _, record = analysed(**content)
    away = abs(float(record["u_max_richardson"][0, 0]) - exact)
    assert 1e-4 < away <= float(record["u_max_richardson_error"][0, 0])


def test_a_largest_size_is_not_negative() -> None:
    """Extrapolated, an energy error that vanishes with dt may come out below 0."""
    content = {
        "model": {
            "kind": "system",
            "coordinates": ["x", "y"],
            "acceleration": {"x": "-x - 2*x*y", "y": "-y - x**2 + y**2"},
        },
        "initial": {"y": -0.15, "vx": 0.5},
        **{"time": {"end": 40}, "levels": [8, 9, 10, 11], "schemes": ["central"]},
    }
    about = {"value": "max_abs", "quantity": "energy_deviation", "at": {"level": "best"}}
    [found] = judged(about | {"below": 1e-3}, **content)
    assert 0.0 <= found.results[0].value < 1e-4


def test_the_bound_of_an_energy_error_covers_a_crest_between_points() -> None:
    """All levels may have the same point nearest to it: their numbers then agree to 1e-6 and are wrong by 1e-4."""
    content = {
        "model": {"kind": "oscillator", "spring": "u", "force": "cos(2*t)/2"},
        "initial": {"u": 1.0},
        **{"time": {"end": 5.0}, "sweep": {"time.end": [6.0, 8.0, 15.0]}},
        **{"levels": [5, 6, 7, 8], "schemes": ["gauss4"]},
    }
    _, record = analysed(**content)
    t = np.linspace(0.0, 6.0, 10**6)
    u, v = (7 * np.cos(t) - np.cos(2 * t)) / 6, (2 * np.sin(2 * t) - 7 * np.sin(t)) / 6
    exact = np.max(np.abs(u**2 + v**2 - 1.0))
    away = np.abs(record["relative_energy_error_richardson"][0] - exact)
    bound = record["relative_energy_error_richardson_error"][0]
    assert np.all(away <= bound)
    assert np.all(bound < 1e-4)
