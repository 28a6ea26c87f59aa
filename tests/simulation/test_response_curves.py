"""Both branches of a Duffing oscillator, and the numbers of a steady state, against SciPy and harmonic balance."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.core.home import home
from vibsim.core.record import Record
from vibsim.observe import steady_state

FILE = home() / "configs" / "showcase" / "duffing_branches.yaml"
SAMPLES = 32
"""Of a period of the force, as those of the coarsest level: what is not steady yet has other sums by other samples."""


def continued(omegas: list[float], periods: int) -> tuple[list[complex], list[complex]]:
    """Return ``A exp(-i phase)`` of each member by SciPy, one from the other, and that of the period before."""
    state, last, before = [0.0, 0.0], [], []
    for w in omegas:

        def slope(t: float, y: np.ndarray, w: float = w) -> tuple[float, float]:
            u, v = y.tolist()
            return v, math.cos(w * t) - 0.1 * v - u - 0.04 * u**3

        end, period = periods * 2 * np.pi / w, 2 * np.pi / w
        times = np.append(end - 2 * period + period / SAMPLES * np.arange(2 * SAMPLES), end)
        found = solve_ivp(
            slope,
            (0.0, end),
            state,
            "DOP853",
            times,
            rtol=1e-10,
            atol=1e-11,
        )
        u = found.y[0]
        factors = np.exp(-1j * w * times)
        for rows, part in ((before, slice(0, SAMPLES + 1)), (last, slice(SAMPLES, None))):
            rows.append(complex(w / np.pi * np.trapezoid(u[part] * factors[part], times[part])))
        state = list(found.y[:, -1])
    return last, before


def balanced(w: float) -> list[float]:
    """Return the amplitudes of one harmonic alone: ``((1 - w^2 + 3/4 0.04 A^2)^2 + (0.1 w)^2) A^2 = 1``."""
    stiff, linear = 0.03, 1.0 - w * w
    squares = np.roots([stiff**2, 2.0 * stiff * linear, linear**2 + (0.1 * w) ** 2, -1.0])
    return sorted(float(np.sqrt(x.real)) for x in squares if abs(x.imag) < 1e-9)


@pytest.fixture(scope="module")
def branches() -> tuple[Experiment, Any]:
    """The showcase experiment with a check that asks for each number of each member."""
    given = Experiment.from_yaml(FILE)
    levels = {level: simulate(given, level) for level in given.levels}
    return given, analyse(given, levels), levels


@pytest.mark.slow
def test_every_verdict_passes(branches: Any) -> None:
    experiment, convergence, _ = branches
    assert [v.status for v in verdicts(experiment, convergence)] == ["PASS"] * 9


@pytest.mark.slow
@pytest.mark.usefixtures("without_series")
def test_a_number_of_all_members_names_the_branch_and_one_that_is_not_steady_asks_for_periods() -> (
    None
):
    """The largest amplitude is on the way up, where the response jumps down; a curve one way has no branches."""
    data = {
        "title": "Two branches",
        "model": {"kind": "duffing", "delta": 0.1, "beta": 0.04, "gamma": 1.0, "omega": 1.0},
        "time": {"periods": 20, "steps_per_period": 16, "frequency": "model.omega"},
        "levels": [1, 2, 3],
        "schemes": ["rk4"],
        "checks": [
            {"value": "steady_amplitude", "quantity": "u", "over": "model.omega",
             "take": "where_largest", "above": 1},
            {"value": "steady_change", "quantity": "u", "at": {"case": 2}, "below": 1e-9},
            {"value": "section_period", "at": {"case": 2}, "equals": 1},
        ],
    }  # fmt: skip
    told = []
    for omegas in ([1.1, 1.3, 1.5, 1.3, 1.1], [1.1, 1.3, 1.5]):
        sweep = {"model.omega": omegas, "follow": "model.omega"}
        experiment = Experiment.from_dict({**data, "sweep": sweep})
        levels = {level: simulate(experiment, level) for level in experiment.levels}
        told.append(verdicts(experiment, analyse(experiment, levels)))
    assert "is at model.omega = 1.3 on the way up; it is above 1" in told[0][0].text
    assert "is at model.omega = 1.3; it is above 1" in told[1][0].text
    advice = "Give more `periods:`, if the motion is not steady yet, or change"
    for verdict, asked in zip(told[0][1:], ("below", "equals"), strict=True):
        assert verdict.status == "FAIL"
        assert verdict.advice == f"{advice} `{asked}:`."


@pytest.mark.slow
def test_each_branch_is_that_of_an_independent_continuation(branches: Any) -> None:
    """Amplitude, phase and change of every member, up and down, by DOP853 at 1e-10."""
    from vibsim.comparison import best_values, value_numbers
    from vibsim.observe.member_block import block_of

    experiment, _, levels = branches
    omegas = list(experiment.sweep.axes[0].values[0])
    last, before = (np.array(row) for row in continued(omegas, 80))
    block = block_of(experiment, {level: Record.from_xarray(levels[level]) for level in (2, 3, 4)})

    def number(name: str) -> tuple[Any, Any]:
        place = value_numbers.Place(block, {}, "u", "best", None, None)
        return tuple(row[0] for row in best_values.value(name, place)[:2])

    amplitude, bound = number("steady_amplitude")
    off = np.abs(amplitude - np.abs(last))
    assert np.all(off <= 2e-7 * np.abs(last))
    assert np.all(off <= bound)
    phase, _ = number("steady_phase")
    np.testing.assert_allclose(phase, -np.angle(last), atol=1e-5)
    finest = value_numbers.Place(block, {}, "u", 4, None, None)
    change = value_numbers.value("steady_change", finest)[0]
    np.testing.assert_allclose(change, np.abs(last - before) / np.abs(last), rtol=1e-2, atol=1e-7)


@pytest.mark.slow
def test_each_branch_is_near_one_of_harmonic_balance() -> None:
    """The jumps are there: up and down differ at 1.3 to 1.5 alone, where one harmonic has three answers."""
    experiment = Experiment.from_yaml(FILE)
    omegas = np.array(experiment.sweep.axes[0].values[0])
    # level 2 keeps 32 samples of a period
    largest = np.abs(simulate(experiment, 2)["u"].values[0, :, -33:]).max(axis=-1)
    for w in omegas[:11]:
        up, down = largest[np.flatnonzero(omegas == w)[[0, -1]]]
        known = balanced(float(w))
        for found in (up, down):
            assert min(abs(found / a - 1.0) for a in known) < 0.03
        several = len(known) == 3
        assert (up / down > 2.0) == several
        if several:
            assert abs(up / known[2] - 1.0) < 0.03
            assert abs(down / known[0] - 1.0) < 0.03


@pytest.mark.slow
@pytest.mark.usefixtures("without_series")
def test_amplitude_and_phase_of_a_linear_oscillator_converge_to_the_closed_form() -> None:
    """``A = 1/sqrt((k - w^2)^2 + (b w)^2)``, ``tan(phase) = b w/(k - w^2)``, with the order of the scheme."""
    b, w, k = 0.4, 1.3, 1.0
    data: dict[str, Any] = {
        "title": "A linear response",
        "model": {
            "kind": "oscillator",
            "damping": {"linear": b},
            "spring": "k*u",
            "force": "cos(omega*t)",
            "parameters": {"k": k, "omega": w},
        },
        "time": {"periods": 30, "steps_per_period": 16, "frequency": "model.parameters.omega"},
        "levels": [0, 1, 2, 3],
        "schemes": ["central", "rk4"],
    }
    amplitude = 1.0 / np.hypot(k - w * w, b * w)
    phase = float(np.arctan2(b * w, k - w * w))
    checks = [
        {"value": name, "quantity": "u", "equals": exact, "atol": 1e-7, "at": {"level": "best"}}
        for name, exact in (("steady_amplitude", amplitude), ("steady_phase", phase))
    ]
    checks += [{"value": "steady_change", "quantity": "u", "below": 1e-6}]
    experiment = Experiment.from_dict({**data, "checks": checks})
    levels = {level: simulate(experiment, level) for level in experiment.levels}
    found = verdicts(experiment, analyse(experiment, levels))
    assert [v.status for v in found] == ["PASS"] * 3, [v.text for v in found]
    errors = []
    for level in experiment.levels:
        checks = [
            {
                "value": "steady_amplitude",
                "quantity": "u",
                "equals": amplitude,
                "at": {"level": level},
            }
        ]
        one = Experiment.from_dict({**data, "checks": checks})
        (verdict,) = verdicts(one, analyse(one, levels))
        errors.append([abs(row.value - amplitude) for row in verdict.results])
    rates = np.log2(np.array(errors[1:-1]) / np.array(errors[2:]))
    np.testing.assert_allclose(rates[-1], [2.0, 4.0], atol=0.1)


def distance(
    monkeypatch: pytest.MonkeyPatch, of: Callable[[int], complex], noise: float, periods: float
) -> float:
    """Return the bound of `steady_state.distance` for the harmonic `of` so many periods before the end."""

    def harmonic(block: Any, level: int, quantity: str, back: int = 0) -> Any:
        return np.array([[of(back)]])

    monkeypatch.setattr(steady_state, "harmonic", harmonic)
    monkeypatch.setattr(steady_state, "rounding", lambda *_: np.array([[noise]]))
    block: Any = SimpleNamespace(experiment=SimpleNamespace(time=SimpleNamespace(periods=periods)))
    return float(steady_state.distance(block, 0, "u")[0, 0])


@pytest.mark.parametrize("beyond", [1e-6, -1e-6])
def test_a_best_phase_next_to_pi_is_that_of_the_circle_by_any_velocity(beyond: float) -> None:
    """The levels of `central` are on the other side of pi than the limit, and extrapolate their last velocity."""
    b, w, k = 0.4, 1.3, 1.0
    size = w / np.hypot(k - w * w, b * w)
    lag = float(np.arctan2(b * w, k - w * w)) - np.pi / 2
    exact = np.pi - beyond if beyond > 0.0 else -np.pi - beyond
    best = {"quantity": "v", "at": {"level": "best"}}
    checks = [
        {"value": "steady_phase", "equals": exact, "atol": 1e-6, **best},
        {"value": "steady_phase", "above": 3.0, **best},
        {"value": "steady_amplitude", "equals": size, "atol": 1e-6, **best},
        {"value": "steady_change", "quantity": "v", "below": 1e-11},
    ]
    data: dict[str, Any] = {
        "title": "t",
        "model": {
            "kind": "oscillator",
            "damping": {"linear": b},
            "spring": "k*u",
            "force": "cos(omega*t + s)",
            "parameters": {"k": k, "omega": w, "s": lag - exact},
        },
        "time": {"periods": 30, "steps_per_period": 16, "frequency": "model.parameters.omega"},
        "levels": [0, 1, 2, 3],
        "schemes": ["central"],
        "checks": checks,
    }
    experiment = Experiment.from_dict(data)
    levels = {level: simulate(experiment, level) for level in experiment.levels}
    phase, above, amplitude, change = verdicts(experiment, analyse(experiment, levels))
    ((found,), (largest,)) = (phase.results, amplitude.results)
    assert -np.pi < found.value <= np.pi
    assert abs(found.value - exact) < 1e-6
    assert phase.status == "PASS"
    # an angle of at most pi cannot be told from one of at least -pi
    assert above.status == "INCONCLUSIVE"
    assert abs(largest.value - size) < 1e-6
    assert change.status == "PASS", change.text


def test_what_is_left_of_a_transient_is_what_its_last_changes_say(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of one that a period multiplies by z: the larger of the last two estimates is exact a period ago."""
    z = 0.6 * cmath.exp(0.4j)
    found = distance(monkeypatch, lambda back: 0.8j + 0.1 * z ** (5 - back), 0.0, 60.0)
    np.testing.assert_allclose(found, steady_state.REST_SAFETY * 0.1 * 0.6**4, rtol=1e-12)


def test_equal_changes_by_rounding_leave_a_steady_motion_its_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A factor of 1 between two changes would leave an infinite rest, which rounding must not decide."""
    ulp = 2.0**-53

    def harmonic(back: int) -> complex:
        return 0.8 + ulp * back

    noise = 8.0 * ulp
    assert distance(monkeypatch, harmonic, noise, 60.0) == steady_state.REST_SAFETY * noise * 60.0
    assert math.isinf(distance(monkeypatch, harmonic, 0.0, 60.0))


def test_a_slow_transient_that_changes_less_than_rounding_is_within_the_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A weakly damped motion is a hundred changes away from its steady one."""
    left, factor, noise = 1e-13, 0.99, 2e-15
    assert left * (1.0 / factor - 1.0) < noise
    found = distance(monkeypatch, lambda back: left * factor**-back, noise, 200.0)
    assert left < found < 10.0 * left


def test_a_steady_motion_of_a_response_curve_has_a_bound() -> None:
    """The changes of its last periods are round-off, two of them equal to the last bit at w = 0.8."""
    model = {
        "kind": "oscillator",
        "spring": "u - 0.1*u**3",
        "damping": {"linear": 0.2},
        "force": "F*cos(w*t)",
        "parameters": {"F": 0.3, "w": 1.0},
    }
    limits = {"quantity": "u", "at": {"case": 1, "level": "best"}}
    experiment = Experiment.from_dict(
        {
            **{"title": "x", "model": model, "schemes": ["central"], "levels": [0, 1, 2, 3]},
            "time": {"periods": 60, "steps_per_period": 16, "frequency": "model.parameters.w"},
            "sweep": {"model.parameters.w": [0.7, 0.8], "follow": "model.parameters.w"},
            "checks": [{"value": "steady_amplitude", "equals": 0.87635499, "atol": 1e-6, **limits}],
        }
    )
    levels = [simulate(experiment, level) for level in experiment.levels]
    (verdict,) = verdicts(experiment, analyse(experiment, levels))
    assert verdict.status == "PASS"
    assert "do not prove it" not in verdict.text


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.4])
def test_the_bound_of_a_motion_that_is_not_steady_yet_reaches_the_steady_one(
    damping: float,
) -> None:
    """What is left of the start after eight periods, at three frequencies, against the closed form."""
    w = np.array([0.7, 1.4, 2.3])
    experiment = Experiment.from_dict(
        {
            "title": "On its way",
            "model": {
                "kind": "oscillator",
                "damping": {"linear": damping},
                "force": "cos(omega*t)",
                "parameters": {"omega": 1.0},
            },
            "initial": {"u": 0.3},
            "time": {
                "periods": 8,
                "steps_per_period": 16,
                "frequency": "model.parameters.omega",
            },
            "levels": [1, 2, 3],
            "schemes": ["rk4"],
            "sweep": {"model.parameters.omega": w.tolist()},
            "checks": [
                {"value": name, "quantity": "u", "above": -3, "at": {"level": "best"}}
                for name in ("steady_amplitude", "steady_phase")
            ],
        }
    )
    levels = {level: simulate(experiment, level) for level in experiment.levels}
    convergence = analyse(experiment, levels)
    steady = 1.0 / (1.0 - w**2 + 1j * damping * w)
    for number, exact, size in ((1, np.abs(steady), 1.0), (2, -np.angle(steady), np.abs(steady))):
        value, bound = (
            convergence[f"check_check_{number}_{name}"].values[0]
            for name in ("value", "error_bound")
        )
        off = np.abs(value - exact)
        assert np.all(off <= bound)
        # what is left of a start at distance |0.3 - steady| and its velocity
        left = np.exp(-damping * 6 * np.pi / w) * 5.0 * (1.0 + np.abs(steady)) / size
        assert np.all(bound <= left + 1e-4)


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        (
            {"time": {"periods": 40, "steps_per_period": 16}},
            "time names no frequency.*give time as periods",
        ),
        (
            {"time": {"periods": 40, "steps_per_period": 4, "frequency": "model.omega"}},
            "at least 8 stored samples in every period",
        ),
        ({"samples": {"every": 5}}, "at least 8 stored samples in every period.*there are 6.4"),
    ],
)
def test_numbers_of_a_steady_state_need_periods_of_a_force(
    sections: dict[str, Any], message: str
) -> None:
    from vibsim.core.errors import InputError

    data = {
        "title": "x",
        "model": {"kind": "duffing", "delta": 0.1, "gamma": 1.0, "omega": 1.0},
        "time": {"periods": 40, "steps_per_period": 16, "frequency": "model.omega"},
        "levels": [1],
        "schemes": ["rk4"],
        "checks": [{"value": "steady_amplitude", "quantity": "u", "below": 1}],
    }
    Experiment.from_dict({**data, "samples": "common", "levels": [1, 2]})
    if "steps_per_period" in str(sections):
        data = {**data, "levels": [0]}
    with pytest.raises(InputError, match=message):
        Experiment.from_dict({**data, **sections})
