"""How an energy error grows: kinds of drift that are known, and those of schemes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_runs import registered, spring

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.core.vocabulary import DRIFTS
from vibsim.observe.energy_drift import drift_of
from vibsim.observe.thresholds import STILL
from vibsim.schemes import SCHEMES
from vibsim.schemes.code_generation import self_starting
from vibsim.schemes.implicit import step_crank_nicolson

PERIODS = 20.0
SAMPLES = 512
S = np.linspace(0.0, 1.0, SAMPLES + 1)
WAVE = np.sin(4 * np.pi * PERIODS * S)

Floats = np.ndarray


def kind_of(deviation: Floats, periods: float = PERIODS, floor: float = 1e-15) -> tuple[str, float]:
    running = np.maximum.accumulate(np.abs(deviation))[None, None]
    one = np.ones((1, 1))
    ratio = 1.0 + deviation[None, None]
    found = drift_of(running, ratio, one, floor * one, np.array([periods]), deviation[None, None])
    return DRIFTS[int(found.kind[0, 0])], float(found.rate[0, 0])


@pytest.mark.parametrize("size", [1e-9, 1e-3])
@pytest.mark.parametrize("wave", [0.0, 0.5, 10.0])
@pytest.mark.parametrize(("power", "kind"), [(1, "linear"), (2, "quadratic")])
def test_a_drift_is_named_and_measured_under_an_oscillation(
    power: int, kind: str, wave: float, size: float
) -> None:
    found, rate = kind_of(size * (S**power + wave * WAVE))
    assert found == kind
    # the stairs of the running maximum have steps of half a period
    assert rate * PERIODS**power == pytest.approx(size, rel=2 / PERIODS if wave else 1e-9)


@pytest.mark.parametrize("size", [1e-9, 1e-3])
def test_an_oscillation_is_bounded_and_round_off_is_no_drift(size: float) -> None:
    assert kind_of(size * WAVE**2)[0] == "bounded"
    assert kind_of(size * (WAVE + 0.5 * STILL * S))[0] == "bounded"
    assert kind_of(1e-14 * S) == ("none", 0.0)
    assert kind_of(0.0 * S) == ("none", 0.0)
    # growth far above the floor is none however small it is
    assert kind_of(1e-12 * S)[0] == "linear"


@pytest.mark.parametrize("change", [-40.0, -0.5, 0.5, 3.0, 40.0])
def test_exponential_growth_and_decay_are_named_with_their_rate(change: float) -> None:
    running = np.abs(np.expm1(change * S))
    one = np.ones((1, 1))
    found = drift_of(
        np.maximum.accumulate(running)[None, None],
        np.exp(change * S)[None, None],
        one,
        1e-15 * one,
        np.array([PERIODS]),
        np.expm1(change * S)[None, None],
    )
    assert DRIFTS[int(found.kind[0, 0])] == "exponential"
    assert found.rate[0, 0] * PERIODS == pytest.approx(change, rel=1e-9)


@pytest.mark.parametrize("steps", [400, 600, 5000])
def test_a_decay_below_the_smallest_number_is_exponential(steps: int) -> None:
    """Backward Euler at w dt = 2: the energy falls by 1/5 at each step, and is 0 from step 460 or so on."""
    check = {"conserves": "energy", "drift": "bounded"}
    run = spring(
        ["backward_euler"],
        check,
        model={"kind": "spring", "w": 1.0},
        time={"end": 2.0 * steps, "base_steps": steps},
    )
    assert [(v.status, v.reason) for v in run.verdicts] == [("FAIL", "mismatch")]
    assert DRIFTS[int(run.record["energy_drift_kind"].item())] == "exponential"
    rate = run.record["energy_drift_rate"].item()
    assert rate == pytest.approx(-np.log(5.0) * np.pi, rel=1e-9)


@pytest.mark.parametrize("end", [0.5, 0.05, 0.0])
def test_what_is_above_underflow_decides(end: float) -> None:
    """Until `end`, of which 0 leaves one sample only; what falls otherwise than by a power is not named."""
    one = np.ones((1, 1))
    running = np.where(S > 0, 1.0, 0.0)[None, None]

    def found(ratio: Floats) -> tuple[str, float]:
        ratio = ratio[None, None]
        drift = drift_of(running, ratio, one, 1e-15 * one, np.array([PERIODS]), ratio - 1.0)
        return DRIFTS[int(drift.kind[0, 0])], float(drift.rate[0, 0]) * PERIODS

    decay = np.where(end >= S, np.exp(-700.0 * S / max(end, 0.01)), 0.0)
    kind, rate = found(decay)
    assert kind == "exponential"
    assert rate == pytest.approx(-700.0 / end if end else -np.inf, rel=1e-9)
    assert found(np.where(S < 0.5, (1.0 - 2.0 * S) ** 2, 0.0))[0] == "unclear"


@pytest.mark.parametrize(
    ("scheme", "p", "steps"),
    [
        ("gauss4", 3.0, 6000),
        ("crank_nicolson", 30.0, 600),
        ({"kind": "generalized_alpha", "rho_inf": 1.0}, 30.0, 600),
        ("crank_nicolson", 1000.0, 600),
    ],
)
def test_rounding_that_grows_with_the_steps_is_no_drift(scheme, p: float, steps: int) -> None:
    check = {"conserves": "energy", "drift": "none"}
    model, time = {"kind": "spring", "w": 1.0}, {"end": p * steps, "base_steps": steps}
    run = spring([scheme], check, model=model, time=time)
    assert [v.status for v in run.verdicts] == ["PASS"]


def pushed(state, t, dt, p, acceleration, slopes):  # type: ignore[no-untyped-def]
    (u, v), own = step_crank_nicolson(state, t, dt, p, acceleration, slopes)
    return (u * (1.0 + 1e-12), v * (1.0 + 1e-12)), own


@pytest.mark.slow
@pytest.mark.parametrize("steps", [2000, 100_000])
def test_a_small_drift_is_above_that_rounding(monkeypatch: pytest.MonkeyPatch, steps: int) -> None:
    """RK4 loses p^6/72 at each step; Crank-Nicolson pushed by 1e-12 at each gains that much."""
    stepper = self_starting(pushed)
    genuine = SCHEMES["crank_nicolson"]
    broken = replace(genuine, kind="pushed", stepper=lambda options: stepper)
    registered(monkeypatch, broken)
    model, time = {"kind": "spring", "w": 1.0}, {"end": 0.1 * steps, "base_steps": steps}
    check = {"conserves": "energy", "drift": "linear"}
    run = spring(["rk4", "pushed"], check, model=model, time=time)
    assert [v.status for v in run.verdicts] == ["PASS"]
    rate = run.record["energy_drift_rate"][:, 0, 0] * 0.1 / (2 * np.pi)
    assert rate == pytest.approx([0.1**6 / 72, 2e-12], rel=0.02)


def test_what_cannot_be_named_is_unclear() -> None:
    assert kind_of(1e-3 * np.sqrt(S))[0] == "unclear"
    assert kind_of(1e-3 * S**3)[0] == "unclear"
    assert kind_of(1e-3 * S, periods=3.0)[0] == "unclear"
    assert kind_of(1e-3 * S[:: SAMPLES // 16])[0] == "unclear"
    broken = 1e-3 * S
    broken[SAMPLES // 2 :] = np.nan
    assert kind_of(broken)[0] == "unclear"


@pytest.mark.parametrize(("stops", "kind"), [(0.8, "unclear"), (1.0, "linear")])
def test_a_range_that_stops_widening_shows_no_drift(stops: float, kind: str) -> None:
    """The energy error of a chain goes to another middle with its modes: the largest error stands still meanwhile."""
    deviation = 1e-9 * (np.minimum(S / stops, 1.0) * 0.6 - np.sin(2 * np.pi * PERIODS * S) ** 2)
    running = np.maximum.accumulate(np.abs(deviation))[None, None]
    one, periods = np.ones((1, 1)), np.array([PERIODS])
    ratio = 1.0 + deviation[None, None]
    found = drift_of(running, ratio, one, 1e-15 * one, periods, deviation[None, None])
    assert DRIFTS[int(found.kind[0, 0])] == kind


def test_an_overflow_of_one_member_is_no_warning() -> None:
    running = np.stack([1e-3 * S, np.where(S > 0.5, np.inf, 1e-3 * S)])[None]
    ones = np.ones((1, 2))
    periods = np.array([PERIODS, PERIODS])
    found = drift_of(running, 1.0 + running, ones, 1e-15 * ones, periods, running)
    assert [DRIFTS[int(code)] for code in found.kind[0]] == ["linear", "unclear"]


def test_an_error_above_round_off_is_not_none_however_short_the_run() -> None:
    checks = [{"conserves": "energy", "drift": drift} for drift in ("none", "bounded")]
    none, bounded = spring(["central"], *checks, time={"end": 1.0, "base_steps": 40}).verdicts
    assert (none.status, none.reason) == ("FAIL", "mismatch")
    assert "exceeds round-off" in none.text
    assert (bounded.status, bounded.reason) == ("INCONCLUSIVE", "pre_asymptotic")


def test_an_energy_that_is_conserved_better_than_asked_for_needs_no_better_scheme() -> None:
    check = {"conserves": "energy", "drift": "linear"}
    (verdict,) = spring(["crank_nicolson"], check).verdicts
    assert verdict.status == "FAIL"
    assert verdict.advice.startswith("Set `drift: none`, which was measured")


KINDS = {
    "central": "bounded",
    "rk4": "linear",
    "crank_nicolson": "none",
    "forward_euler": "exponential",
    "backward_euler": "exponential",
}


def test_the_drift_of_schemes_is_stored_and_checked() -> None:
    checks = [
        {"conserves": "energy", "drift": kind, "schemes": [name]}
        for name, kind in KINDS.items()
        if kind != "exponential"
    ]
    wrong = [
        {"conserves": "energy", "drift": "none", "schemes": ["central"]},
        {"conserves": "energy", "drift": "bounded", "schemes": ["forward_euler"]},
        {"conserves": "energy", "drift": "quadratic", "schemes": ["rk4"]},
    ]
    exact = {"conserves": "energy", "drift": "bounded", "schemes": ["crank_nicolson"]}
    run = spring(list(KINDS), *checks, *wrong, exact)
    assert [v.status for v in run.verdicts] == ["PASS"] * 3 + ["FAIL"] * 3 + ["PASS"]
    assert {v.reason for v in run.verdicts[3:6]} == {"mismatch"}
    found = run.record["energy_drift_kind"][:, 0, 0]
    assert dict(zip(KINDS, [DRIFTS[i] for i in found], strict=True)) == KINDS
    # |A|^2 = 1 - p^6/72 of RK4, and 1 + p^2 of Forward Euler
    p = float(run.record["omega_dt"][0, 0])
    rate = run.record["energy_drift_rate"][:, 0, 0]
    assert rate[1] == pytest.approx(p**6 / 72 * 40, rel=0.02)
    assert rate[3] == pytest.approx(np.log1p(p * p) * 40, rel=1e-9)


def test_the_velocity_decides_what_the_energy_seems_to_do() -> None:
    # B, section 6.2, sees Crank-Nicolson lose energy: an artefact of [D_2t u]
    own = {"conserves": "energy", "drift": "none"}
    centred = {"conserves": "energy_d2t", "drift": "bounded"}
    run = spring(["crank_nicolson"], own, centred, {**centred, "drift": "none"})
    assert [v.status for v in run.verdicts] == ["PASS", "PASS", "FAIL"]


def test_a_run_that_broke_down_conserves_nothing() -> None:
    check = {"conserves": "energy", "drift": "bounded"}
    claim = {"claim": "it is conserved", "that": check, "holds": False}
    time = {"end": 4000.0, "base_steps": 4000}
    run = spring(["euler_cromer"], check, claim, time=time)
    assert [v.reason for v in run.verdicts] == ["non_finite", "non_finite"]
    assert [v.status for v in run.verdicts] == ["FAIL", "FAIL"]


def test_the_last_time_counts_where_its_velocity_is_that_of_all_others() -> None:
    """Of Forward Euler and RK4 the energy changes by a known factor at each step: the last error is the largest."""
    steps = 64
    check = {"id": "kept", "conserves": "energy", "drift": "none"}
    run = spring(
        [
            "forward_euler",
            "rk4",
            "central",
            {"kind": "central", "end_velocity": "kick", "label": "kick"},
        ],
        check,
        model={"kind": "spring", "w": 1.0},
        time={"end": 1.5, "base_steps": steps},
    )
    p = 1.5 / steps
    growth = np.array([1.0 + p * p, 1.0 - p**6 / 72.0 + p**8 / 576.0]) ** steps
    found = run.record["check_kept_energy_error"][:, 0]
    assert found[:2] == pytest.approx(np.abs(growth - 1.0), rel=1e-10)
    # the largest energy error of centred differences is that of the velocity without the extrapolated one at the end
    energies = np.abs(run.levels[0]["energy_deviation"][:, 0])
    initial = run.levels[0]["energy_initial"][:, 0]
    assert found[2] == pytest.approx(np.max(energies[2, :-1]) / initial[2], rel=1e-12)
    assert found[3] == pytest.approx(np.max(energies[3]) / initial[3], rel=1e-12)
    assert found[2] < found[3]


@pytest.mark.parametrize(
    ("model", "initial", "verdicts_of"),
    [
        # a body without a spring, exact at every step; a cubic spring alone; a spring that pushes away
        ({"kind": "oscillator", "spring": "0"}, {"u": 1.0, "v": 0.3}, ("PASS", "PASS")),
        ({"kind": "duffing", "alpha": 0.0}, {"u": 1.0}, ("FAIL", "FAIL")),
        ({"kind": "oscillator", "spring": "-0.1*u"}, {"u": 0.2, "v": 0.3}, ("FAIL", "PASS")),
    ],
)
def test_round_off_is_known_without_small_oscillations(
    model: dict[str, object], initial: dict[str, float], verdicts_of: tuple[str, str]
) -> None:
    """Their frequency is not defined; an error of 0 once failed as no round-off."""
    made = Experiment.from_dict(
        {
            "title": "t",
            "model": model,
            "initial": initial,
            "time": {"end": 10.0, "base_steps": 8},
            "levels": [3, 4, 5, 6],
            "schemes": ["rk4"],
            "checks": [
                {"equal": ["rk4", "exact"], "quantity": "u"},
                {"conserves": "energy", "drift": "none"},
            ],
        }
    )
    found = verdicts(made, analyse(made, [simulate(made, level) for level in made.levels]))
    assert tuple(row.status for row in found) == verdicts_of


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("end", [np.inf, np.nan])
def test_an_energy_that_is_not_finite_at_the_end_is_unclear(end: float) -> None:
    running, one = np.array([0.0, *np.full(400, 1.0), *np.full(112, end)]), np.ones((1, 1))
    wave = running * np.sign(WAVE)
    found = drift_of(
        *(running[None, None], 1.0 + wave[None, None], one, 1e-15 * one, np.array([PERIODS])),
        wave[None, None],
    )
    assert DRIFTS[int(found.kind[0, 0])] == "unclear"
