"""Spectra and Poincare sections: against cosines, the theory of a scheme, and SciPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.core.errors import InputError
from vibsim.core.home import home
from vibsim.observe import spectrum

FILE = home() / "configs" / "showcase" / "duffing_periods.yaml"


@pytest.mark.parametrize("line", [20.0, 20.5, 33.1, 47.77, 60.999])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5])
def test_the_frequency_of_a_cosine_is_found_between_the_lines(line: float, phase: float) -> None:
    """To the part that its negative frequency leaves, of the size 1/k^3; a mean and a weaker cosine do not matter."""
    t = np.linspace(0.0, 1.0, 257)
    series = 5.0 + 3.0 * np.cos(2.0 * np.pi * line * t + phase)
    assert abs(float(spectrum.highest(series)) - line) < 2.0 / line**3
    beside = series + 0.1 * np.cos(2.0 * np.pi * 100.0 * t)
    assert abs(float(spectrum.highest(beside)) - line) < 1e-3


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
    assert np.isnan(spectrum.highest(rows)).all()
    assert np.isnan(spectrum.highest(rows[..., :5])).all()


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
