"""Spectra and Poincare sections: against cosines, the theory of a scheme, and SciPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from whole import decided

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.core.errors import InputError
from vibsim.core.home import home
from vibsim.observe import spectrum
from vibsim.observe.steady_state import is_angle
from vibsim.simulation.members import members

FILE = home() / "configs" / "showcase" / "duffing_periods.yaml"


@pytest.mark.parametrize("line", [3.0, 3.4, 20.0, 20.5, 33.1, 47.77, 60.999])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5])
def test_the_frequency_of_a_cosine_is_found_between_the_lines(line: float, phase: float) -> None:
    """To round-off; a mean does not matter, and a weaker cosine little."""
    t = np.linspace(0.0, 1.0, 257)
    series = 5.0 + 3.0 * np.cos(2.0 * np.pi * line * t + phase)
    found, bound = spectrum.highest(series)
    assert abs(found - line) < 1e-11 * line
    assert bound < 1e-6
    beside = series + 0.1 * np.cos(2.0 * np.pi * 100.0 * t)
    found, bound = spectrum.highest(beside)
    assert abs(found - line) < 1e-4
    assert abs(found - line) < bound < 2e-2


TIME = np.linspace(0.0, 1.0, 513)
"""Of a series in the unit of its time, where a line is a whole turn."""
CASES = 200


def cosine(line: float, phase: float, decay: float = 0.0) -> np.ndarray:
    return np.exp(-decay * TIME) * np.cos(2.0 * np.pi * line * TIME + phase)


def decays(random: np.random.Generator) -> tuple[np.ndarray, float]:
    """From hardly damped to gone after a tenth of the time, but not within a period."""
    line = random.uniform(4.0, 40.0)
    decay = min(10.0 ** random.uniform(-1.0, 1.4), 0.4 * line)
    return 2.0 + cosine(line, random.uniform(0.0, 6.0), decay), line


def driven(random: np.random.Generator) -> tuple[np.ndarray, float]:
    """A steady cosine and what is left of the start, no larger."""
    line, phase = random.uniform(4.0, 30.0), random.uniform(0.0, 6.0)
    start = cosine(
        line * random.uniform(0.3, 2.5), random.uniform(0.0, 6.0), random.uniform(0.3, 30.0)
    )
    return cosine(line, phase) + random.uniform(0.0, 0.9) * start, line


def two_tones(near: float, far: float) -> Any:
    """Two steady cosines, so many lines apart."""

    def series(random: np.random.Generator) -> tuple[np.ndarray, float]:
        line, apart = random.uniform(5.0, 40.0), random.uniform(near, far) * random.choice([-1, 1])
        other = line + apart if line + apart > 2.0 else line - apart
        size = 10.0 ** random.uniform(-2.0, -0.1)
        first, second = random.uniform(0.0, 6.0, 2)
        return cosine(line, first) + size * cosine(other, second), line

    return series


@pytest.mark.parametrize(
    ("series", "misses", "typical", "widest"),
    [
        (decays, 0, 1e-6, 1e-6),
        (driven, 2, 0.02, 3.0),
        (two_tones(4.0, 20.0), 0, 0.01, 0.5),
        (two_tones(1.0, 4.0), 2, 0.3, np.inf),
        (two_tones(0.05, 1.0), 2, 0.2, 2.0),
    ],
)
def test_the_bound_of_a_frequency_covers_a_decay_and_other_lines(
    series: Any, misses: int, typical: float, widest: float
) -> None:
    """Of random cases as good as all; bounds in lines."""
    random = np.random.default_rng(5)
    rows, lines = zip(*(series(random) for _ in range(CASES)), strict=True)
    found, bound = spectrum.highest(np.stack(rows))
    off = np.abs(found - np.array(lines))
    assert np.count_nonzero(~(off <= bound + 1e-10)) <= misses
    assert np.median(bound) < typical
    assert np.max(bound) <= widest


def test_a_frequency_has_the_same_bits_alone_and_beside_others() -> None:
    random = np.random.default_rng(6)
    rows = np.stack([make(random)[0] for make in (decays, driven) for _ in range(8)])
    # as a Record has them, with the time outermost
    together = spectrum.highest(np.asfortranarray(rows))
    alone = [spectrum.highest(np.asfortranarray(row[None])) for row in rows]
    for i, of_all in enumerate(together):
        np.testing.assert_array_equal(of_all, [one[i][0] for one in alone])


def test_the_amplitude_of_a_line_is_that_of_the_cosine() -> None:
    t = np.linspace(0.0, 1.0, 129)
    found = spectrum.lines(np.stack([3.0 * np.cos(2 * np.pi * 10 * t), np.full(129, 7.0)]))
    assert found.shape == (2, 65)
    assert found[0, 10] == pytest.approx(3.0, rel=1e-12)
    assert found[0, [9, 11]] == pytest.approx(1.5, rel=1e-12)
    assert np.all(found[1] < 1e-12)


def test_no_frequency_is_told_where_there_is_no_such_line() -> None:
    t = np.linspace(0.0, 1.0, 65)
    rows = np.stack([np.cos(2 * np.pi * t), np.where(t > 0.5, np.nan, 0.0), np.exp(-t)])
    for found in (rows, rows[..., :5]):
        assert np.isnan(spectrum.highest(found)[0]).all()


def test_the_spectrum_has_the_frequency_error_of_the_scheme() -> None:
    """Central differences: ``2/dt asin(w dt/2)`` at every level, and w in the limit."""
    predicted = [2.0 / dt * np.arcsin(0.5 * dt) for dt in (0.5, 0.25, 0.125)]
    rows = [("best", 1.0), *enumerate(predicted)]
    checks = [
        {"value": name, "quantity": "u", "at": {"level": level}, "equals": w, "atol": 2e-5}
        for level, w in rows
        for name in ("peak_frequency",)
    ]
    experiment = Experiment.from_dict(
        {
            "title": "A spectrum",
            "model": {"kind": "spring", "w": 1.0},
            "initial": {"u": 1.0},
            "time": {"end": 400.0, "base_dt": 0.5},
            "levels": [0, 1, 2],
            "schemes": ["central"],
            "checks": checks,
        }
    )
    levels = {level: simulate(experiment, level) for level in experiment.levels}
    found = verdicts(experiment, analyse(experiment, levels))
    for verdict, (level, w) in zip(found, rows, strict=True):
        assert abs(verdict.results[0].value - w) < (2e-5 if level != "best" else 2e-4)
    assert predicted[0] - 1.0 > 0.01


def sections(gamma: float, periods: int, start: tuple[float, float] = (1.0, 0.0)) -> np.ndarray:
    """Return u and v after every period of the force by SciPy, shape (state, period)."""

    def slope(t: float, y: np.ndarray) -> tuple[float, float]:
        u, v = y.tolist()
        return v, gamma * math.cos(1.2 * t) - 0.3 * v + u - u**3

    times = 2.0 * np.pi / 1.2 * np.arange(periods + 1)
    return solve_ivp(
        slope,
        (0.0, times[-1]),
        start,
        "DOP853",
        times,
        rtol=1e-10,
        atol=1e-11,
    ).y


@pytest.mark.slow
def test_periods_are_those_of_an_independent_solution() -> None:
    experiment = Experiment.from_yaml(FILE)
    levels = {level: simulate(experiment, level) for level in experiment.levels}
    found = verdicts(experiment, analyse(experiment, levels))
    assert [v.status for v in found] == ["PASS"] * 7
    wanted = {check.at.swept["model.gamma"]: check.equals for check in experiment.checks[:6]}
    for gamma, period in wanted.items():
        whole = sections(gamma, 150)
        points = whole[:, 100:]
        if period:
            apart = [
                np.max(np.abs(points[:, k:] - points[:, :-k])) for k in range(1, int(period) + 1)
            ]
            assert apart[-1] < 1e-3
            assert all(far > 1e-2 for far in apart[:-1])
        else:
            # two starts 1e-8 apart part by a factor of 1e5 at least
            other = sections(gamma, 60, (1.0 + 1e-8, 0.0))
            assert np.max(np.abs(other - whole[:, :61])) > 1e-3


def test_a_section_needs_the_period_of_a_force() -> None:
    data: dict[str, Any] = {
        "title": "x",
        "model": {"kind": "duffing", "delta": 0.3, "gamma": 0.2, "omega": 1.2},
        "time": {"end": 20.0},
        "levels": [5, 6],
        "schemes": ["rk4"],
    }
    figures = [{"source": "a", "shows": "poincare"}]
    for sections_ in ({"figures": figures}, {"checks": [{"value": "section_period", "equals": 1}]}):
        with pytest.raises(InputError, match="time names no frequency"):
            Experiment.from_dict({**data, **sections_})


def test_the_section_of_a_pendulum_that_turns_over_repeats_up_to_whole_turns() -> None:
    """It goes over the top once in each period of its force; SciPy shows the same."""
    w, periods = 2.0 / 3.0, 60
    found = solve_ivp(
        lambda t, y: [y[1], -math.sin(y[0]) - 0.5 * y[1] + 1.4 * math.cos(w * t)],
        (0.0, 2.0 * math.pi * periods / w), [0.2, 0.0], method="DOP853", rtol=1e-10, atol=1e-10,
        t_eval=2.0 * math.pi / w * np.arange(periods // 2, periods + 1),
    )  # fmt: skip
    assert np.abs(np.diff(found.y[0])) == pytest.approx(2.0 * math.pi, abs=1e-3)
    pendulum = {
        "kind": "system",
        "acceleration": "-sin(u) - v/2 + 1.4*cos(w*t)",
        "parameters": {"w": w},
    }
    experiment = Experiment.from_dict(
        {
            **{"title": "x", "model": pendulum, "initial": {"u": 0.2}, "schemes": ["rk4"]},
            "time": {
                "periods": periods, "steps_per_period": 32, "frequency": "model.parameters.w"
            },
            "levels": [1, 2],
            "checks": [{"value": "section_period", "equals": 1}],
        }
    )  # fmt: skip
    [verdict] = decided(experiment)
    assert verdict.status == "PASS"


def test_the_velocity_at_the_end_is_no_part_of_a_section() -> None:
    """`central` extrapolates it, with an error above the tolerance of a repeated state where the motion is steady."""
    experiment = Experiment.from_dict(
        {
            "title": "x",
            "model": {"kind": "duffing", "delta": 0.2, "beta": -0.1, "gamma": 0.3, "omega": 0.9},
            "schemes": ["central", "rk4"],
            "time": {"periods": 60, "steps_per_period": 16, "frequency": "model.omega"},
            "levels": [2, 3],
            "checks": [{"value": "section_period", "equals": 1}],
        }
    )
    [verdict] = decided(experiment)
    assert verdict.status == "PASS"


def test_what_is_an_angle_of_one_member_need_not_be_one_of_another() -> None:
    """Each member is asked by itself, so that no number depends on how members are divided into files."""
    system = {"kind": "system", "acceleration": "-sin(u) - c*u", "parameters": {"c": 0.0}}
    experiment = Experiment.from_dict(
        {
            **{"title": "x", "model": system, "initial": {"u": 0.2}, "schemes": ["rk4"]},
            **{"time": {"end": 1.0}, "levels": [1, 2]},
            "sweep": {"model.parameters.c": [0.0, 0.1, 0.0]},
        }
    )
    sizes = {"u": np.full(3, 0.2), "v": np.full(3, 0.2)}
    found = is_angle(experiment.model.definition, members(experiment, 0, 3), "u", sizes)
    assert found.tolist() == [True, False, True]


def test_a_position_is_an_angle_if_its_whole_motion_repeats_after_a_turn() -> None:
    """It leaves out a stop that only far positions touch, and a spring that is soft beyond a thousandth."""
    stop = {"kind": "system", "acceleration": "-sin(u) - 100*max(u - 20, 0)"}
    soft = {"kind": "system", "acceleration": "-1e4*u*exp(-1e6*u**2)"}
    for system, size, expected in ((stop, 1.0, True), (stop, 30.0, False), (soft, 1e-3, False)):
        experiment = Experiment.from_dict(
            {
                **{"title": "x", "model": system, "initial": {"u": 0.2}, "schemes": ["rk4"]},
                **{"time": {"end": 1.0}, "levels": [1, 2]},
            }
        )
        sizes = {"u": np.array([size]), "v": np.array([1.0])}
        found = is_angle(experiment.model.definition, members(experiment, 0, 1), "u", sizes)
        assert found.tolist() == [expected]
