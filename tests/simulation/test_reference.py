"""The computed reference: against exact solutions, its bounds, its bits, and what it refuses."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from thinned import thinned

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.models import MODELS, has_solution
from vibsim.models.system import written
from vibsim.simulation.members import Members
from vibsim.simulation.reference.solve import reference

FRACTION = np.arange(101) / 100


def group(initial, parameters, end):
    count = len(end)
    return Members(
        index=np.arange(count),
        columns={},
        parameters={
            name: np.broadcast_to(value, count) + 0.0 for name, value in parameters.items()
        },
        initial={name: np.broadcast_to(value, count) + 0.0 for name, value in initial.items()},
        end=np.asarray(end, dtype=float),
    )


PENDULUM = {"g": 1.0, "L": 1.0, "m": 1.0, "drag": 0.0}


@pytest.mark.parametrize("end", [0.3, 7.0, 60.0])
@pytest.mark.parametrize(("theta", "omega"), [(0.1, 0.0), (3.0, 0.0), (0.5, 3.0), (0.0, 0.0)])
def test_the_reference_is_the_exact_pendulum(theta, omega, end):
    model = MODELS["pendulum"]
    initial = {"theta": theta, "omega": omega}
    series, bounds = reference(model, group(initial, PENDULUM, [end]), FRACTION)
    exact = model.exact(FRACTION * end, initial, PENDULUM)
    for name, found in series.items():
        size = max(np.max(np.abs(exact[name])), 1e-300)
        # the phase of the exact solution is rounded as well
        assert (
            np.max(np.abs(found[0] - exact[name]))
            <= bounds[name][0] + 1e-15 * (10 + 4 * end) * size
        )
        assert bounds[name][0] <= 1e-12 * size + 1e-300


@pytest.mark.slow
def test_a_member_has_its_bits_whatever_is_computed_beside_it():
    model = MODELS["duffing"].variant(frozenset({"delta", "gamma"}))
    numbers = {"delta": 0.2, "alpha": [1.0, -1.0, 0.3], "beta": 1.0, "gamma": 0.3, "omega": 1.2}
    initial = {"u": [1.0, 0.1, 2.0], "v": 0.0}
    together, bounds = reference(model, group(initial, numbers, [9.0, 20.0, 3.0]), FRACTION)
    for case, end in enumerate((9.0, 20.0, 3.0)):
        own = {**numbers, "alpha": numbers["alpha"][case]}
        start = {**initial, "u": initial["u"][case]}
        alone, bound = reference(model, group(start, own, [end]), FRACTION)
        for name in ("u", "v"):
            assert alone[name][0].tobytes() == together[name][case].tobytes()
            assert bound[name][0] == bounds[name][case]


@pytest.mark.parametrize(
    ("mu", "u", "v", "end"),
    thinned(
        [
            (2.045372456337754, 2.67237970225732, -2.9004121394351547, 14.563728275383495),
            (3.781695830848897, 0.5983873085909055, 2.376689548106964, 14.950709453788965),
            (2.4226597282521025, -2.5700313653619324, 2.5433683679187746, 13.622267287177651),
        ],
        3,
    ),
)
def test_the_reference_knows_its_error_between_the_ends_of_its_steps(mu, u, v, end):
    """Where steps end two solutions agree before they do in between, which was taken for the error everywhere.

    Of 400 random motions of van der Pol's oscillator these have the largest errors over the bounds of then.
    """
    model = written(("u",), {"acceleration.u": "mu*(1 - u**2)*v - u"}, ("mu",))
    fraction = np.linspace(0.0, 1.0, 1010)
    numbers = group({"u": u, "v": v}, {"parameters.mu": mu}, [end])
    found, bounds = reference(model, numbers, fraction)
    true = solve_ivp(
        lambda t, y: (y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]),
        (0.0, end),
        (u, v),
        method="DOP853",
        t_eval=fraction * end,
        rtol=3e-14,
        atol=1e-15,
        max_step=0.01,
    ).y
    for name, series in zip(("u", "v"), true, strict=True):
        # what SciPy leaves of its own
        left = 3e-13 * np.max(np.abs(series))
        assert np.max(np.abs(found[name][0] - series)) <= bounds[name][0] + left


def test_a_slow_iteration_is_not_taken_for_round_off():
    """The force of a Maxwell element, the velocity vz, decays: changes of the stages fall by less than a half."""
    equations = {"acceleration.u": "-50*u - vz/2", "acceleration.z": "60*vu - 5*vz"}
    model = written(("u", "z"), equations, ())
    start = {"u": 0.05, "z": 0.0, "vu": 0.0, "vz": 3.0}
    found, bounds = reference(model, group(start, {}, [3.0]), FRACTION)
    matrix = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-50, 0, 0, -0.5], [0, 0, 60, -5]])
    true = [expm(3.0 * x * matrix) @ list(start.values()) for x in FRACTION]
    for name, series in zip(start, np.transpose(true), strict=True):
        assert np.max(np.abs(found[name][0] - series)) <= bounds[name][0] < 1e-13


def test_a_motion_with_events_has_no_reference():
    assert has_solution(MODELS["oscillator"].written({"force": "sign(sin(3*t))"}, ()))
    held = content(model={"kind": "oscillator", "damping": {"coulomb": 0.3}, "force": "cos(2*t)"})
    model = Experiment.from_dict({**held, "checks": []}).model.definition
    assert model.events is not None
    assert not has_solution(model)


def content(**changes):
    return {
        "title": "t",
        "model": {"kind": "oscillator", "spring": "sinh(u)", "damping": "0.3*v**3", "force": "cos(2*t)"},
        "initial": {"u": 1.0},
        "time": {"end": 6.0},
        "levels": [5, 6, 7, 8],
        "schemes": ["rk4"],
        "checks": [
            {"converges": "u", "order": 4},
            {"value": "error_linf", "quantity": "u", "below": 1e-7},
            {"equal": ["rk4", "exact"], "quantity": "v", "atol": 1e-6},
        ],
        **changes,
    }  # fmt: skip


def test_errors_are_taken_against_the_reference():
    experiment = Experiment.from_dict(content())
    levels = [simulate(experiment, level) for level in experiment.levels]
    assert "collocation" in levels[0]["u_exact"].attrs["method"]
    assert 0.0 < float(levels[0]["u_exact_error"][0]) < 1e-13
    for verdict in verdicts(experiment, analyse(experiment, levels)):
        assert verdict.status == "PASS", verdict.text


def test_convergence_to_another_equation_is_seen():
    """Levels that were computed with a damping a tenth too small converge, but not to the reference."""
    experiment = Experiment.from_dict(content(checks=[{"converges": "u", "order": 4}]))
    model = {**content()["model"], "damping": "0.27*v**3"}
    other = Experiment.from_dict(content(model=model))
    levels = []
    for level in experiment.levels:
        data, wrong = simulate(experiment, level), simulate(other, level)
        data = data.copy(deep=True)
        for name in ("u", "v"):
            data[name] = wrong[name]
        levels.append(data)
    (verdict,) = verdicts(experiment, analyse(experiment, levels))
    assert (verdict.status, verdict.reason) == ("FAIL", "wrong_limit")
