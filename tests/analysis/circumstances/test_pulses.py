"""A pulse of the force between the points of every level: no level knows of it, and none may decide."""

from __future__ import annotations

import re
from typing import Any

import pytest
from thinned import thinned

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.core.errors import VibsimError

pytestmark = pytest.mark.usefixtures("without_series")


def judged(force: str, *, schemes: Any = ("rk4",), levels: Any = (5, 6, 7, 8), **more: Any) -> Any:
    content = {
        "title": "pulse",
        "model": {"kind": "oscillator", "spring": "4*u", "force": force},
        "initial": {"u": 1.0},
        "time": {"end": 5.0},
        "levels": list(levels),
        "schemes": list(schemes),
        "checks": [{"converges": "u"}],
    }
    experiment = Experiment.from_dict({**content, **more})
    levels = [simulate(experiment, level) for level in experiment.levels]
    (found,) = verdicts(experiment, analyse(experiment, levels))
    return found


@pytest.mark.parametrize(
    "force",
    thinned(
        [
            "heaviside(t - 1.3) - heaviside(t - 1.3001)",
            "5e2*(sign(t - 3.77) - sign(t - 3.771))",
            "1e9*(heaviside(t - 1.3) - heaviside(t - 1.3 - 1e-9))",
            "sin(t) + 3*heaviside(t - 1.3)*heaviside(1.30001 - t)",
            # nonlinear arguments
            "2e3*(heaviside(t**2 - 1.7) - heaviside(exp(t) - exp(sqrt(1.7) + 1e-5)))",
            "1e3*heaviside(sin(5*t) - 0.9999999)",
            # periodic ones
            "50*heaviside(mod(t, 1) - 0.99999)",
            "100*(floor(t + 0.1) - floor(t + 0.09999))",
            "1e3 if 1.3 < t and t < 1.30001 else 0",
            # a hat, which has corners
            "1e5*max(1 - abs(t - 1.3)/1e-5, 0)",
            # several
            "1e3*heaviside(0.00001 - abs(t - 2)*abs(t - 3.3)*abs(t - 4.1))",
        ],
        3,
    ),
)
def test_a_pulse_between_jumps_is_not_smooth(force: str) -> None:
    found = judged(force)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "non_smooth"), found.text
    assert "will not help" not in found.advice


@pytest.mark.parametrize("width", thinned([1e-2, 1e-3, 1e-5, 1e-7, 1e-9], 2))
def test_a_pulse_of_any_width_is_not_smooth(width: float) -> None:
    force = f"{10.0 / width!r}*(heaviside(t - 3.3) - heaviside(t - 3.3 - {width!r}))"
    found = judged(force, schemes=["rk4", "central"])
    assert all(one.status == "INCONCLUSIVE" for one in found.results)
    assert all(one.reason == "non_smooth" for one in found.results), found.text
    time = re.search(r"t = ([0-9]+\.?[0-9]*)\b", found.text)
    assert time is not None
    assert float(time[1]) == pytest.approx(3.3, abs=2 * width)


@pytest.mark.parametrize(
    "force",
    [
        "1e4*exp(-((t - 1.3)/1e-4)**2)",
        "1e7*exp(-((t - 1.3)/1e-7)**2)",
        "sin(t) + 1/((t - 1.3)**2 + 1e-7)",
        "1e4*(tanh((t - 1.3)/1e-5) - tanh((t - 1.3001)/1e-5))",
        "1e5/cosh((t - 1.3)/1e-5)",
        "1e3*exp(-1e8*sin(t)**2)",
        # another jump does not make it one
        "heaviside(t - 1)*1e4*exp(-((t - 1.3)/1e-4)**2)",
    ],
)
def test_a_smooth_pulse_is_not_resolved(force: str) -> None:
    found = judged(force)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "pre_asymptotic"), found.text
    assert "has a pulse" in found.text
    assert "No level sees it" in found.text
    assert "will not help" not in found.advice


@pytest.mark.slow
def test_the_level_that_is_advised_sees_the_pulse() -> None:
    force = "30*exp(-((t - 3.36)/0.02)**2)"
    coarse = judged(force, levels=[2, 3, 4, 5])
    assert (coarse.status, coarse.reason) == ("INCONCLUSIVE", "pre_asymptotic")
    first = re.search(r"from level (\d+) on", coarse.advice)
    assert first is not None, coarse.advice
    level = int(first[1])
    assert judged(force, levels=range(level + 2, level + 6)).status == "PASS"


@pytest.mark.parametrize(
    "force",
    thinned(
        [
            "0.3*sin(30*t)",
            "exp(-((t - 3)/0.3)**2)",
            "t**2*exp(-t) - log(1 + t)*sqrt(t + 1)",
            "tanh((t - 5)/0.2)",
            # bounds of this are far wider than its values
            "(t - 5)**4 - t**4 + 20*t**3 - 150*t**2 + 500*t",
            "cos(t)**2 + sin(t)**2 - 1",
        ],
        3,
    ),
)
def test_a_force_that_the_levels_see_passes(force: str) -> None:
    found = judged(force, levels=[8, 9, 10, 11], time={"end": 10.0})
    assert found.status == "PASS"


def test_a_wrong_solution_beside_a_smooth_force_stays_one() -> None:
    """Nothing hides a wrong limit where there is no pulse."""
    content = {
        "title": "wrong",
        "model": {"kind": "oscillator", "spring": "4*u", "force": "sin(3*t)"},
        "initial": {"u": 1.0},
        "time": {"end": 10.0},
        "levels": [6, 7, 8, 9],
        "schemes": ["central"],
        "checks": [{"converges": "u"}],
    }
    right = Experiment.from_dict(content)
    other = {**content, "model": {**content["model"], "force": "1.01*sin(3*t)"}}
    wrong = Experiment.from_dict(other)
    levels = []
    for level in right.levels:
        data = simulate(right, level)
        levels.append(data.assign(u=simulate(wrong, level)["u"]))
    (found,) = verdicts(right, analyse(right, levels))
    assert (found.status, found.reason) == ("FAIL", "wrong_limit")


PULSE = "(heaviside({0} - 1.3) - heaviside({0} - 1.3 - {1}))"


@pytest.mark.parametrize("width", ["1e-2", "1e-4", "1e-8"])
@pytest.mark.parametrize(
    ("name", "model"),
    [
        ("voltage", {"kind": "circuit", "L": 1.0, "R": 0.1, "C": 1.0}),
        ("exact", {"kind": "oscillator", "spring": "u"}),
        ("road", {"kind": "vehicle", "speed": 1.0}),
    ],
)
def test_what_is_differentiated_may_have_no_pulse(
    name: str, model: dict[str, Any], width: str
) -> None:
    """Both jumps lie between two looks at the formula; its derivative would leave both out."""
    text = "1 + 0.1*" + PULSE.format("x" if name == "road" else "t", width)
    with pytest.raises(VibsimError, match=r"jumps near . = 1\.3"):
        judged("0", model={**model, name: text})
