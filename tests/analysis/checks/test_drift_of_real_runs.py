"""How the energy of pendulums and springs drifts, level by level: claims that are true, false or open."""

from __future__ import annotations

from typing import Any

import pytest
from thinned import thinned
from whole import decided

from vibsim import Experiment, analyse, simulate, verdicts

DRIFTS = ("none", "bounded", "linear", "quadratic")


def found(scheme: str, level: int, **initial: float) -> dict[str, tuple[str, str]]:
    """Return status and reason of every claim on the drift of the energy at one level."""
    data: dict[str, Any] = {
        "title": "t",
        "model": {"kind": "pendulum" if "theta" in initial else "spring"},
        "initial": initial,
        "time": {"end": 50.0},
        "levels": [level],
        "schemes": [scheme],
        "checks": [{"conserves": "energy", "drift": drift} for drift in DRIFTS],
    }
    experiment = Experiment.from_dict(data)
    told = decided(experiment)
    return {drift: (one.status, one.reason) for drift, one in zip(DRIFTS, told, strict=True)}


@pytest.mark.parametrize("theta", [0.5, 2.0, 2.9])
@pytest.mark.parametrize(("scheme", "level"), thinned([("rk4", 10), ("rk4", 13), ("rk3", 16)], 2))
def test_a_linear_drift_is_seen_as_long_as_it_is_above_the_rounding_of_the_energy(
    scheme: str, level: int, theta: float
) -> None:
    """A disturbance shifts a large swing in time more and more: that is no rounding of its energy."""
    told = found(scheme, level, theta=theta)
    assert told["linear"] == ("PASS", "match")
    assert {told[drift][0] for drift in ("none", "bounded", "quadratic")} == {"FAIL"}


@pytest.mark.parametrize("theta", [0.5, 2.0])
@pytest.mark.parametrize("level", [14, 16])
def test_a_drift_below_round_off_is_left_open(level: int, theta: float) -> None:
    told = found("rk4", level, theta=theta)
    assert told["linear"] == told["quadratic"] == ("INCONCLUSIVE", "round_off")
    assert told["none"] == told["bounded"] == ("PASS", "match")


def test_what_theory_conserves_exactly_does_not_drift() -> None:
    told = found("gauss4", 12, u=1.0)
    assert told["none"] == ("PASS", "match")
    assert told["linear"] == ("FAIL", "mismatch")


@pytest.mark.parametrize("level", [10, 12, 14])
def test_a_drift_behind_an_oscillation_to_the_other_side_is_seen(level: int) -> None:
    """Heun's energy dips within each swing by as much as it has gained over the whole run."""
    told = found("heun", level, theta=2.0)
    assert told["linear"] == ("PASS", "match")
    assert told["bounded"] == ("FAIL", "mismatch")


@pytest.mark.parametrize("scheme", ["velocity_verlet", "central", "crank_nicolson"])
@pytest.mark.parametrize("level", [8, 11, 14])
def test_a_symplectic_or_symmetric_scheme_keeps_its_energy_bounded(scheme: str, level: int) -> None:
    told = found(scheme, level, theta=2.0)
    assert told["bounded"] == ("PASS", "match")
    assert {told[drift][0] for drift in ("none", "linear", "quadratic")} == {"FAIL"}


def test_the_stairs_of_several_frequencies_are_no_drift() -> None:
    """Henon and Heiles' system: over 20 times as long the largest error of the energy is that of 16 periods."""
    data: dict[str, Any] = {
        "title": "t",
        "model": {
            "kind": "system",
            "coordinates": ["x", "y"],
            "acceleration": {"x": "-x - 2*x*y", "y": "-y - x**2 + y**2"},
        },
        "initial": {"y": -0.15, "vx": 0.5},
        "time": {"end": 40.0},
        "levels": [11],
        "schemes": ["central", "pefrl"],
        "checks": [{"conserves": "energy", "drift": drift} for drift in DRIFTS],
    }
    experiment = Experiment.from_dict(data)
    told = decided(experiment)
    for one in told[2:]:
        assert one.status != "PASS"
    assert told[1].reason == "pre_asymptotic"
    assert told[1].advice == "Lengthen the run (`time: end`), or store more of it (`samples: all`)."


@pytest.mark.parametrize("scheme", ["yoshida4", "pefrl", "gauss4"])
def test_an_oscillation_of_two_frequencies_is_no_drift(scheme: str) -> None:
    """Of a symplectic scheme the error grows to one side for a while, and stays on the other: that is left open."""
    data: dict[str, Any] = {
        "title": "t",
        "model": {
            "kind": "system",
            "coordinates": ["x", "y"],
            "acceleration": {
                "x": "-x - 0.9215962635558014*(x - y)",
                "y": "-y + 0.9215962635558014*(x - y) - 0.278285172749245*y**3",
            },
        },
        "initial": {"x": 0.9788265002248391, "y": 0.6312585754630256},
        "time": {"end": 100.0},
        "levels": [12],
        "schemes": [scheme],
        "checks": [{"conserves": "energy", "drift": drift} for drift in DRIFTS[1:]],
    }
    experiment = Experiment.from_dict(data)
    told = decided(experiment)
    assert [one.status for one in told[:2]] == ["INCONCLUSIVE", "INCONCLUSIVE"]


def test_a_drift_that_has_just_overtaken_an_oscillation_is_linear() -> None:
    """The largest deviation so far stands until then, and rises like t^1.91 at first; that to t = 180 like t^1.003."""
    data: dict[str, Any] = {
        "title": "t",
        "model": {"kind": "pendulum", "g": 2.0},
        "initial": {"theta": 2.102},
        "time": {"end": 90.0},
        "levels": [11],
        "schemes": ["rkn4"],
        "checks": [{"conserves": "energy", "drift": drift} for drift in ("linear", "quadratic")],
    }
    experiment = Experiment.from_dict(data)
    told = decided(experiment)
    assert [one.status for one in told] == ["PASS", "FAIL"]


def test_a_drift_is_per_period_of_the_motion() -> None:
    """At 3.1 rad that is 3.3 times as long as the period of small oscillations."""
    data = {
        "title": "t",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 3.1},
        "time": {"end": 400.0},
        "levels": [12],
        "schemes": ["rk4"],
        "checks": [{"conserves": "energy", "drift": "linear"}],
    }
    experiment = Experiment.from_dict(data)
    level = simulate(experiment, 12)
    (verdict,) = verdicts(experiment, analyse(experiment, [level]))
    lost = -level.energy_deviation.values[0, 0, -1] / level.energy_initial.values.item()
    per_period = lost * level.exact_period.values.item() / 400.0
    assert verdict.results[0].facts["drift_rate"] == pytest.approx(per_period, rel=0.1)


def test_a_motion_that_never_returns_has_a_drift_without_a_warning() -> None:
    told = found("central", 10, theta=0.0, omega=2.0)
    assert told["bounded"] == ("PASS", "match")
