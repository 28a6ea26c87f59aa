"""Every lane gives the same bits, for every model and every scheme with every option."""

import dataclasses
import itertools
import warnings

import numpy as np
import pytest

from vibsim.engine import LANES, integrate, lane_for
from vibsim.engine.kernel import source
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

RNG = np.random.default_rng(7)
MEMBERS = 5


def all_options(scheme):
    names = [option.name for option in scheme.options]
    for choice in itertools.product(*(option.choices for option in scheme.options)):
        yield dict(zip(names, choice, strict=True))


CASES = [
    pytest.param(model, scheme, options, id="-".join((model.kind, scheme.kind, *options.values())))
    for model in MODELS.values()
    for scheme in SCHEMES.values()
    for options in all_options(scheme)
]


def members(model):
    """Numbers that make some members swing, some go over the top, and one rest."""
    parameters = RNG.uniform(0.3, 12.0, (MEMBERS, len(model.parameters)))
    initial = np.array([[1.0, 0.0], [3.1, 0.0], [-0.5, 7.5], [0.2, -9.0], [0.0, 0.0]])
    return parameters, initial, np.linspace(0.01, 0.05, MEMBERS)


def assert_same_bits(one, other):
    for field in dataclasses.fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        assert a.tobytes() == b.tobytes(), field.name


@pytest.mark.parametrize(("model", "scheme", "options"), CASES)
def test_lanes_give_the_same_bits(model, scheme, options):
    numbers = members(model)
    plain, compiled = (integrate(model, scheme, options, *numbers, 240, 8, lane) for lane in LANES)
    assert_same_bits(plain, compiled)
    assert np.isfinite(plain.position).all()


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
@pytest.mark.parametrize("lane", LANES)
def test_a_member_alone_has_the_bits_it_has_among_others(model, lane):
    scheme = SCHEMES["central"]
    parameters, initial, dt = members(model)
    together = integrate(model, scheme, scheme.defaults(), parameters, initial, dt, 240, 8, lane)
    for i in range(MEMBERS):
        one = slice(i, i + 1)
        alone = integrate(
            model, scheme, scheme.defaults(), parameters[one], initial[one], dt[one], 240, 8, lane
        )
        for field in dataclasses.fields(alone):
            assert (
                getattr(alone, field.name).tobytes() == getattr(together, field.name)[one].tobytes()
            )


@pytest.mark.parametrize("lane", LANES)
def test_a_member_that_overflows_ends_and_the_others_go_on(lane):
    """On the linear model w dt = 4 multiplies the solution by -13.9 each step."""
    model, scheme = MODELS["linear_pendulum"], SCHEMES["central"]
    parameters = np.array([[1.0, 1.0, 1.0], [16.0, 1.0, 1.0], [1.0, 1.0, 1.0]])
    initial = np.array([[1.0, 0.0]] * 3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        runs = integrate(
            model, scheme, scheme.defaults(), parameters, initial, np.ones(3), 400, 1, lane
        )
    failed = runs.last_step[1]
    assert 0 < failed < 400
    assert list(runs.last_step[[0, 2]]) == [400, 400]
    assert np.isfinite(runs.position[1, : failed + 1]).all()
    assert np.isnan(runs.position[1, failed + 1 :]).all()
    growth = runs.position[1, 50] / runs.position[1, 49]
    # the double root of x^2 + 14 x + 1 = 0
    assert growth == pytest.approx(-7.0 - np.sqrt(48.0), rel=1e-12)
    assert np.isfinite(runs.position[[0, 2]]).all()


def test_the_kernel_contains_no_contraction_and_no_foreign_call():
    for model in MODELS.values():
        for scheme in SCHEMES.values():
            text = source(model, scheme.stepper(scheme.defaults()))
            assert "fastmath" not in text
            assert "fma" not in text
            assert "import" not in text.replace("import math", "")


def test_little_work_needs_no_compiler():
    assert lane_for(2**9) == "plain"
    assert lane_for(2**22) == "compiled"
