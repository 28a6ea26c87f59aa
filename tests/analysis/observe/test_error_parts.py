"""Phase and amplitude of errors as quantities: against closed forms on the spring, and references on the pendulum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from spring_runs import Run, judged, spring

from vibsim.checks.phase_amplitude_text import sentence
from vibsim.core.errors import InputError
from vibsim.core.record import Record, Variable
from vibsim.experiment import Experiment
from vibsim.simulation import simulate_record

W = 2 * np.pi
PARTS = [
    {"id": "phase", "converges": "u_phase_error", "order": 2},
    {"id": "amplitude", "converges": "u_amplitude_error", "order": 2},
]
SHORT = {"time": {"end": 4.0, "base_steps": 320}, "levels": [0, 1, 2, 3]}


def p_of(run: Run, level: int) -> Any:
    return W * float(run.record["dt"][level])


def at(run: Run, scheme: int, level: int) -> tuple[Any, Any, Any]:
    """Return times, phase and amplitude of one scheme at one level."""
    phase, amplitude = (
        -run.record[f"u_{part}_error_error"][scheme, 0, level] for part in ("phase", "amplitude")
    )
    return run.record["t"], phase, amplitude


@pytest.fixture(scope="module")
def run() -> Run:
    schemes = ["central", "crank_nicolson", "forward_euler", "euler_cromer", "rk2", "rk4"]
    return spring(schemes, *PARTS, **SHORT)


@pytest.mark.parametrize("level", [0, 1, 2])
def test_the_centred_scheme_has_the_phase_of_its_frequency_and_no_amplitude(
    run: Run, level: int
) -> None:
    t, phase, amplitude = at(run, 0, level)
    p = p_of(run, level)
    np.testing.assert_allclose(phase, (2 / p * np.arcsin(p / 2) - 1) * t, rtol=1e-7, atol=1e-12)
    assert np.abs(amplitude).max() < 1e-9


@pytest.mark.parametrize("level", [0, 1, 2])
def test_crank_nicolson_lags_without_any_error_of_the_amplitude(run: Run, level: int) -> None:
    t, phase, amplitude = at(run, 1, level)
    p = p_of(run, level)
    np.testing.assert_allclose(phase, (2 / p * np.arctan(p / 2) - 1) * t, rtol=1e-6, atol=1e-12)
    assert np.abs(amplitude).max() < 1e-9


@pytest.mark.parametrize("level", [0, 1, 2])
def test_forward_euler_grows_as_theory_says_and_lags_by_the_second_order(
    run: Run, level: int
) -> None:
    t, phase, amplitude = at(run, 2, level)
    p = p_of(run, level)
    grown = np.expm1(0.5 * np.log1p(p * p) * t * W / p)
    np.testing.assert_allclose(amplitude, grown, rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(phase, (np.arctan(p) / p - 1) * t, rtol=1e-4, atol=1e-8)


@pytest.mark.parametrize("level", [0, 1, 2])
def test_euler_cromer_is_shifted_by_half_a_step_from_the_start(run: Run, level: int) -> None:
    t, phase, amplitude = at(run, 3, level)
    p = p_of(run, level)
    angle = 2 * np.arcsin(p / 2)
    expected = (angle / p - 1) * t + 0.5 * angle / W
    np.testing.assert_allclose(np.abs(phase), np.abs(expected), rtol=1e-5)
    np.testing.assert_allclose(amplitude, 1 / np.cos(0.5 * angle) - 1, rtol=1e-4)


@pytest.mark.parametrize("scheme", [4, 5])
def test_runge_kutta_schemes_have_the_modulus_and_the_angle_of_their_polynomial(
    run: Run, scheme: int
) -> None:
    t, phase, amplitude = at(run, scheme, 0)
    z = 1j * p_of(run, 0)
    factor = sum(
        z**k / f for k, f in zip(range(scheme // 5 * 2 + 3), (1, 1, 2, 6, 24), strict=False)
    )
    steps = t / float(run.record["dt"][0])
    np.testing.assert_allclose(phase, np.angle(factor) * steps / W - t, rtol=1e-5, atol=1e-11)
    grown = np.expm1(np.log(abs(factor)) * steps)
    np.testing.assert_allclose(amplitude, grown, rtol=1e-4, atol=1e-11)


def orders(run: Run, name: str) -> Any:
    """Return the stated order of every scheme, and of every member of one, in the typical norm."""
    found = run.record[f"{name}_order"][..., run.record.words("norm").index("l2")]
    return found.ravel()


def test_orders_of_both_parts(run: Run) -> None:
    phase, amplitude = orders(run, "u_phase_error"), orders(run, "u_amplitude_error")
    np.testing.assert_allclose(phase, [2, 2, 2, 1, 2, 4], atol=0.05)
    np.testing.assert_allclose(amplitude[3:], [2, 3, 5], atol=0.05)
    # exp(w^2 dt T/2) is 1.6 at the coarsest level
    assert amplitude[2] == pytest.approx(1.0, abs=0.25)


def test_a_wrong_start_is_named_by_a_verdict_on_the_position() -> None:
    trap = {"kind": "central", "start": "first_order"}
    found = spring([trap], {"converges": "u", "order": 2}, **SHORT)
    text = found.verdicts[0].text
    assert found.verdicts[0].reason == "order_low"
    assert "The phase is of first order, the amplitude of second order" in text
    assert "so the start is of first order" in text


def test_what_is_not_asked_for_is_kept_as_numbers_only() -> None:
    found = spring(["central"], {"converges": "u"}, **SHORT)
    assert "u_phase_error_order" in found.record
    assert "u_phase_error_difference" not in found.record


def pendulum(schemes: list[Any], **more: Any) -> Run:
    data = {
        "title": "test",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 2.0},
        "time": {"end": 20.0},
        "levels": [7, 8, 9, 10],
        "schemes": schemes,
        "checks": [
            {"converges": "theta_phase_error", "order": 2},
            {"converges": "theta_amplitude_error", "order": 2},
        ],
    }
    experiment = Experiment.from_dict({**data, **more})
    levels = {level: simulate_record(experiment, level) for level in experiment.levels}
    return judged(experiment, levels)


def test_the_shift_of_a_pendulum_is_that_of_its_zero_crossings() -> None:
    # independent of the template and of the windows: times of zero crossings of a reference and of the scheme's steps
    found = pendulum(["central"])
    reference = solve_ivp(
        lambda t, y: [y[1], -np.sin(y[0])],
        (0, 20),
        [2.0, 0.0],
        "DOP853",
        None,
        True,
        rtol=1e-13,
        atol=1e-13,
    )
    level = found.levels[9]
    t, theta = np.asarray(level["t"]), np.asarray(level["theta"])[0, 0]
    phase = -found.record["theta_phase_error_error"][0, 0, 2]
    places = np.flatnonzero(theta[:-1] * theta[1:] < 0)
    assert len(places) >= 4
    for k in places.tolist():
        near = slice(max(k - 3, 0), k + 5)
        cubic = np.polynomial.Polynomial.fit(t[near], theta[near], 7)
        crossing = brentq(cubic, t[k], t[k + 1], xtol=1e-14)
        true = brentq(lambda x: reference.sol(x)[0], crossing - 0.1, crossing + 0.1, xtol=1e-14)
        told = np.interp(crossing, found.record["t"], phase)
        assert told == pytest.approx(true - crossing, rel=0.05)


def test_euler_cromer_from_rest_is_of_first_order_in_time_alone_on_the_pendulum_too() -> None:
    found = pendulum(["euler_cromer"])
    assert orders(found, "theta_phase_error")[0] == pytest.approx(1.0, abs=0.05)
    assert orders(found, "theta_amplitude_error")[0] == pytest.approx(2.0, abs=0.05)


def test_a_pendulum_that_goes_over_the_top_has_no_parts() -> None:
    found = pendulum(["central"], initial={"theta": 1.0, "omega": 3.0})
    assert {verdict.reason for verdict in found.verdicts} == {"not_applicable"}


def test_without_a_true_solution_the_extrapolated_one_is_the_measure() -> None:
    model = {"kind": "oscillator", "spring": "u + u**3"}
    checks = [
        {"converges": "u_phase_error", "order": 2},
        {"converges": "u_amplitude_error", "order": 2},
    ]
    more = {"model": model, "initial": {"u": 1.0}, "checks": checks, "time": {"end": 10.0}}
    trap = {"kind": "central", "label": "trap", "start": "first_order"}
    found = pendulum(["central", trap], **more)
    levels = {level: without_truth(record) for level, record in found.levels.items()}
    alone = judged(found.experiment, levels)
    assert "u_phase_error_exact" in found.record
    assert "u_phase_error_exact" not in alone.record
    for run in (found, alone):
        np.testing.assert_allclose(orders(run, "u_phase_error"), [2, 1], atol=0.12)
        np.testing.assert_allclose(orders(run, "u_amplitude_error"), [2, 2], atol=0.1)
    # against what the levels extrapolate to, the same shifts to the accuracy of that
    shifts = [run.record["u_phase_error_difference"][0] for run in (found, alone)]
    np.testing.assert_allclose(*shifts, rtol=1e-2, atol=1e-6)


def test_a_member_without_a_true_solution_does_not_take_it_from_the_others() -> None:
    sweep = {"initial.theta": [1.0, 2.0]}
    found = pendulum(["central"], sweep=sweep)
    levels = {}
    for level, record in found.levels.items():
        kept = dict(record.variables)
        for name in ("theta_exact", "omega_exact"):
            values = np.array(kept[name].values)
            values[1] = np.nan
            kept[name] = Variable(kept[name].dims, values, kept[name].attrs)
        levels[level] = Record(record.coords, kept, record.attrs)
    mixed = judged(found.experiment, levels)
    np.testing.assert_allclose(orders(mixed, "theta_phase_error"), 2.0, atol=0.05)
    errors = mixed.record["theta_phase_error_error"][0]
    np.testing.assert_array_equal(errors[0], found.record["theta_phase_error_error"][0, 0])
    assert np.isnan(errors[1]).all()
    shifts = mixed.record["theta_phase_error_difference"][0, 1]
    same = found.record["theta_phase_error_difference"][0, 1]
    np.testing.assert_allclose(shifts, same, rtol=1e-2, atol=1e-5)


def without_truth(record: Record) -> Record:
    """Return a level without the reference solution."""
    kept = {k: v for k, v in record.variables.items() if not k.endswith("_exact")}
    return Record(record.coords, kept, record.attrs)


@pytest.mark.slow
def test_members_of_a_sweep_have_the_bits_that_they_have_alone() -> None:
    sweep = {"initial.theta": [0.5, 1.0, 2.5]}
    together = pendulum(["central", "rk4"], sweep=sweep).record
    for case, theta in enumerate(sweep["initial.theta"]):
        alone = pendulum(["central", "rk4"], initial={"theta": theta}).record
        for name in ("theta_phase_error_finest", "theta_amplitude_error_order"):
            np.testing.assert_array_equal(together[name][:, case], alone[name][:, 0])


@pytest.mark.parametrize(
    ("phase", "amplitude", "share", "words"),
    [
        (1.0, 2.0, 0.9, "so the start is of first order"),
        (2.0, 4.02, 1e-9, "so the frequency is of second order"),
        (2.0, 1.0, 0.0, "The error is one of the amplitude"),
        (1.5, 2.5, 1.0, "order 1.5"),
    ],
)
def test_sentences(phase: float, amplitude: float, share: float, words: str) -> None:
    assert words in sentence(phase, amplitude, share, 4.0)


@pytest.mark.parametrize(("phase", "amplitude"), [(4.0, 5.0), (6.0, 4.0), (7.5, 4.0)])
def test_a_part_of_the_expected_order_is_not_blamed(phase: float, amplitude: float) -> None:
    assert sentence(phase, amplitude, 0.0, 4.0) == ""
    assert sentence(phase, amplitude, 0.0, 5.0) != ""


def test_the_last_estimates_of_parts_that_are_open_blame_none() -> None:
    """Both are of second order: the phase of levels as coarse as these only seems to be of order 1.5."""
    found = spring(
        ["bdf2"],
        {"converges": "u"},
        model={"kind": "oscillator", "damping": {"linear": 0.1}},
        time={"end": 40.0},
        levels=[6, 7, 8],
    )
    phase, amplitude = (orders(found, f"u_{x}_error").item() for x in ("phase", "amplitude"))
    assert "amplitude" in sentence(phase, amplitude, 0.0, 2.0)
    (verdict,) = found.verdicts
    assert verdict.reason == "pre_asymptotic"
    assert "amplitude" not in verdict.text


@pytest.mark.parametrize(
    ("phase", "amplitude"), [(2.0, 2.1), (np.nan, 2.0), (1.2, 2.0), (1.0, 2.3), (0.0, 2.0)]
)
def test_nothing_is_said_where_the_parts_do_not_differ_or_are_no_orders(
    phase: float, amplitude: float
) -> None:
    assert sentence(phase, amplitude, 1.0, 4.0) == ""


def faults(**more: Any) -> str:
    data = {
        "title": "test",
        "model": {"kind": "spring"},
        "initial": {"u": 1.0},
        "time": {"end": 4.0},
        "levels": [5, 6, 7],
        "schemes": ["central"],
    }
    with pytest.raises(InputError) as caught:
        Experiment.from_dict({**data, **more})
    return str(caught.value)


@pytest.mark.parametrize(
    ("model", "initial", "reason"),
    [
        ({"kind": "pendulum"}, {"theta": 1.0}, "pendulum is nonlinear"),
        (
            {"kind": "oscillator", "force": "cos(t)"},
            {"u": 1.0},
            "oscillator has a force that depends on time",
        ),
        (
            {"kind": "oscillator", "damping": {"quadratic": 0.1}},
            {"u": 1.0},
            "oscillator has a damping that is not linear",
        ),
        ({"kind": "elastic_pendulum", "beta": 0.9}, {}, "elastic_pendulum has several coordinates"),
    ],
)
def test_where_theory_knows_no_order_of_a_part_it_must_be_given(
    model: dict[str, Any], initial: dict[str, float], reason: str
) -> None:
    part = {"pendulum": "theta", "elastic_pendulum": "x"}.get(model["kind"], "u") + "_phase_error"
    for order, key in (({}, "converges"), ({"order": "scheme"}, "order")):
        text = faults(model=model, initial=initial, checks=[{"converges": part, **order}])
        assert f"checks[0].{key}" in text
        assert f"theory knows the order of {part} on linear models" in text
        assert f"{reason}: give `order:` as a number" in text


def test_parts_of_another_name_and_of_motions_with_events() -> None:
    text = faults(checks=[{"converges": "u_phaze_error", "order": 1}])
    assert "unknown quantity" in text
    text = faults(checks=[{"converges": "v_phase_error", "order": 1}])
    assert "did you mean 'u_phase_error'" in text
    ball = {"model": {"kind": "bouncing_ball"}, "initial": {"h": 1.0}}
    text = faults(checks=[{"converges": "h_phase_error", "order": 1}], **ball)
    assert "bouncing_ball has events" in text
    text = faults(checks=[{"value": "end", "quantity": "u_phase_error", "equals": 0.0}])
    assert "unknown quantity" in text


@pytest.mark.slow
@pytest.mark.parametrize("asked", ["u_phase_error", "u_amplitude_error"])
def test_a_large_run_that_is_asked_for_one_part_alone_is_judged(asked: str) -> None:
    """Beyond 2^14 samples a part that no check asks for is not there; what the parts say is then left out."""
    checks = [{"converges": "u", "order": 2}, {"converges": asked, "order": 2}]
    found = spring(["euler_cromer"], *checks, time={"end": 4.0}, levels=[12, 13, 14, 15])
    assert f"{asked}_order" in found.record
    assert (
        len({"u_phase_error_order", "u_amplitude_error_order"} & set(found.record.variables)) == 1
    )
    assert found.verdicts[0].reason == "order_low"
    assert "The phase is of" not in found.verdicts[0].text


@pytest.mark.slow
def test_the_order_of_a_part_is_promised_where_theory_has_it_and_expected_elsewhere() -> None:
    parts = [
        {"converges": "u_phase_error", "order": "scheme"},
        {"converges": "u_amplitude_error", "order": 2},
    ]
    short = {"time": {"end": 2.0, "base_steps": 640}, "levels": [0, 1, 2, 3]}
    for found in spring(["euler_cromer"], *parts, **short).verdicts:
        assert found.status == "PASS"
        assert "as promised (order " in found.text
    swing = {"model": {"kind": "pendulum"}, "initial": {"theta": 1.0}}
    check = {"converges": "theta_phase_error", "order": 2}
    (found,) = spring(["central"], check, levels=[0, 1, 2, 3], **swing).verdicts
    assert "as expected (order 2)" in found.text
