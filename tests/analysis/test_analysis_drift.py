"""How an energy error grows: kinds of drift that are known, and those of schemes."""

from __future__ import annotations

import numpy as np
import pytest
from spring_runs import spring

from vibsim.analysis.drift import STILL, drift_of
from vibsim.vocabulary import DRIFTS

PERIODS = 20.0
SAMPLES = 512
S = np.linspace(0.0, 1.0, SAMPLES + 1)
WAVE = np.sin(4 * np.pi * PERIODS * S)

Floats = np.ndarray


def kind_of(deviation: Floats, periods: float = PERIODS, floor: float = 1e-15) -> tuple[str, float]:
    running = np.maximum.accumulate(np.abs(deviation))[None, None]
    one = np.ones((1, 1))
    ratio = 1.0 + deviation[None, None]
    found = drift_of(running, ratio, one, floor * one, np.array([periods]))
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
    )
    assert DRIFTS[int(found.kind[0, 0])] == "exponential"
    assert found.rate[0, 0] * PERIODS == pytest.approx(change, rel=1e-9)


def test_what_cannot_be_named_is_unclear() -> None:
    assert kind_of(1e-3 * np.sqrt(S))[0] == "unclear"
    assert kind_of(1e-3 * S**3)[0] == "unclear"
    assert kind_of(1e-3 * S, periods=3.0)[0] == "unclear"
    assert kind_of(1e-3 * S[:: SAMPLES // 16])[0] == "unclear"
    broken = 1e-3 * S
    broken[SAMPLES // 2 :] = np.nan
    assert kind_of(broken)[0] == "unclear"


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
