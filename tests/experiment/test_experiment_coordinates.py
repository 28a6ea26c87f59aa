"""Experiments with several coordinates: what the elastic pendulum takes, and what it refuses."""

import math

import pytest

from vibsim import experiment as spec
from vibsim.core.errors import InputError

BASE = {
    "title": "t",
    "source": "s",
    "model": {"kind": "elastic_pendulum"},
    "time": {"end": 1.0},
    "levels": [4, 5, 6],
    "schemes": ["rk4"],
}


def read(**changes):
    whole = {key: value for key, value in (BASE | changes).items() if value is not None}
    return spec.Experiment.from_dict(whole, name="elastic", collection="adhoc")


def refused(**changes):
    with pytest.raises(InputError) as caught:
        read(**changes)
    return str(caught.value)


def test_the_motion_starts_at_an_angle_and_a_stretch():
    model = {"kind": "elastic_pendulum", "Theta": 30, "epsilon": 0.1}
    initial = read(model=model).initial
    assert initial["x"] == pytest.approx(1.1 * math.sin(math.pi / 6), rel=1e-15)
    assert initial["y"] == pytest.approx(1 - 1.1 * math.cos(math.pi / 6), rel=1e-14)
    assert initial["vx"] == initial["vy"] == 0.0


def test_a_stretch_alone_keeps_its_digits():
    """B has (0, epsilon): the stretched body hangs lower."""
    initial = read(model={"kind": "elastic_pendulum", "Theta": 0, "epsilon": 1e-17}).initial
    assert initial["x"] == 0.0
    assert initial["y"] == -1e-17


def test_every_coordinate_is_checked_where_no_check_is_given():
    assert [check.converges for check in read().checks] == ["x", "y"]


def test_terms_that_are_not_there_are_no_part_of_the_equation():
    hangs = read(model={"kind": "elastic_pendulum", "Theta": 0})
    assert hangs.model.terms == ()
    assert hangs.model.definition.exact is not None
    swung = read(sweep={"model.gamma": [0.0, 0.1]})
    assert swung.model.terms == ("Theta", "gamma")
    assert swung.model.definition.damping is not None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"model": {"kind": "elastic_pendulum", "beta": 1.0}}, "must be at most 0.999999"),
        ({"model": {"kind": "elastic_pendulum", "epsilon": -1}}, "must be greater than -1"),
        ({"initial": {"x": 0.2}}, "must be 0.5, where the motion starts, or be left out"),
        ({"levels": None, "tolerance": 1e-6}, "extrapolates a motion of one coordinate"),
        ({"output": "best"}, "extrapolates a motion of one coordinate"),
        ({"checks": [{"converges": "y_d2t", "order": 2}]}, "did you mean 'vy_d2t'?"),
        ({"checks": [{"converges": "position_vectr"}]}, "did you mean 'position_vector'?"),
        (
            {"checks": [{"value": "end", "quantity": "position_vector", "below": 1}]},
            "position_vector: end is not defined for this quantity: choose from x, y, vx, vy",
        ),
        (
            {"checks": [{"equal": ["rk4", "exact"], "quantity": "velocity_vector"}]},
            "velocity_vector: exact is not defined for this quantity: choose from x, y, vx, vy",
        ),
        (
            {
                "model": {"kind": "spring"},
                "checks": [{"accurate": "velocity_vector", "relative": 1}],
            },
            "takes several coordinates together, and spring has one here: ask for v",
        ),
        (
            {"model": {"kind": "system", "coordinates": ["position_vector"], "acceleration": "-1"}},
            "'position_vector' has another meaning already",
        ),
        (
            {"checks": [{"value": "running_max", "quantity": "energy_d2t", "below": 1}]},
            "choose from energy_deviation, energy_deviation_d2t",
        ),
        (
            {"checks": [{"value": "max_abs", "quantity": "energy_d2t", "below": 1}]},
            "choose from x, y, vx, vy, energy_deviation, energy_deviation_d2t",
        ),
        (
            {"model": {"kind": "elastic_pendulum", "exact_x": "sin(t)", "Theta": 30}},
            "model.Theta: 30.0: has no meaning beside an exact solution",
        ),
        (
            {"model": {"kind": "elastic_pendulum", "exact_y": "1/t"}},
            "model.exact_y: 1/t: must have a finite value at t = 0, where y is inf",
        ),
        ({"model": {"kind": "elastic_pendulum", "exact_x": "sin(x)"}}, "unknown name 'x'"),
        (
            {"model": {"kind": "elastic_pendulum", "gamma": 0.1}, "schemes": ["velocity_verlet"]},
            "velocity_verlet: cannot treat elastic_pendulum",
        ),
    ],
)
def test_what_cannot_be_is_refused(changes, words):
    assert words in refused(**changes)


def test_a_manufactured_motion_starts_on_itself():
    formulas = {"exact_x": "a*sin(t) + 0.1", "exact_y": "0.2*t", "parameters": {"a": 0.3}}
    experiment = read(model={"kind": "elastic_pendulum", "gamma": 0.5, **formulas})
    assert experiment.initial == pytest.approx({"x": 0.1, "y": 0.0, "vx": 0.3, "vy": 0.2})
    assert set(experiment.model.parameters) == {"beta", "gamma", "parameters.a"}
