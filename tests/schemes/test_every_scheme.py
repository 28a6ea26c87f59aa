"""What holds for every scheme of the registry on every model: its promised order, its limit, its expansion."""

import itertools

import numpy as np
import pytest

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

PAIRS = [
    pytest.param(scheme, model, id=f"{scheme.kind}-{model.kind}")
    for scheme, model in itertools.product(SCHEMES.values(), MODELS.values())
]
LEVELS = [7, 8, 9, 10]


def ladder(scheme, model, **options):
    """Return the experiment of one scheme with every option at its default, or as given."""
    initial = {model.position: 1.1, model.velocity: -0.3}
    named = {option.name for option in scheme.options}
    chosen = {name: value for name, value in options.items() if name in named}
    return Experiment.from_dict(
        {
            "title": "t",
            "model": {"kind": model.kind},
            "initial": initial,
            "time": {"end": 12.0},
            "levels": LEVELS,
            "schemes": [{"kind": scheme.kind, **chosen}],
            "checks": [
                {"id": q, "converges": q, "order": "scheme", "norm": "linf_interior"}
                for q in (model.position, model.velocity, "energy_deviation")
            ],
        }
    )


@pytest.mark.parametrize(("scheme", "model"), PAIRS)
def test_every_quantity_converges_with_the_promised_order(scheme, model):
    experiment = ladder(scheme, model)
    convergence = analyse(experiment, [simulate(experiment, level) for level in LEVELS])
    for verdict in verdicts(experiment, convergence):
        assert (verdict.status, verdict.reason) == ("PASS", "asymptotic"), verdict.text
        (result,) = verdict.results
        promised = scheme.formal_order(verdict.quantity, model, scheme.defaults())
        assert abs(result.order - promised) < 0.05
        assert result.interval[1] - result.interval[0] < 0.1


@pytest.mark.parametrize(("scheme", "model"), PAIRS)
def test_the_errors_fall_with_the_promised_order(scheme, model):
    """Against the exact solution, without the analysis."""
    if model.exact is None:
        return
    experiment = ladder(scheme, model)
    errors = []
    for level in LEVELS:
        data = simulate(experiment, level).isel(scheme=0, case=0)
        difference = (data[model.position] - data[f"{model.position}_exact"]).values
        errors.append(np.sqrt(np.mean(difference**2)))
    promised = scheme.formal_order(model.position, model, scheme.defaults())
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), promised, atol=0.05)


@pytest.mark.parametrize(("scheme", "model"), PAIRS)
def test_the_error_expands_in_the_powers_that_the_scheme_says(scheme, model):
    """One extrapolation removes h^p; what is left falls with p + 2 where the powers are even, else with p + 1."""
    if model.exact is None:
        return
    experiment = ladder(scheme, model, end_velocity="kick")
    options = experiment.schemes[0].options
    for name in (model.position, model.velocity):
        order = scheme.formal_order(name, model, options)
        values, exact = [], None
        for level in LEVELS:
            data = simulate(experiment, level).isel(scheme=0, case=0)
            stride = 2 ** (level - LEVELS[0])
            values.append(data[name].values[::stride])
            exact = data[f"{name}_exact"].values[::stride]
        best = [
            fine + (fine - coarse) / (2**order - 1) for coarse, fine in itertools.pairwise(values)
        ]
        errors = [np.max(np.abs(value - exact)[:-1]) for value in best]
        left = order + (2 if scheme.even_powers(name, model, options) else 1)
        assert np.log2(errors[-2] / errors[-1]) > left - 0.5


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_the_stability_limit_is_where_it_is_said_to_be(scheme):
    if scheme.stability_limit is None:
        return
    model = MODELS["linear_pendulum"]
    parameters = np.ones((2, len(model.parameters)))
    dt = scheme.stability_limit * np.array([0.995, 1.005])
    runs = integrate(
        model, scheme, scheme.defaults(), parameters, np.array([[1.0, 0.0]] * 2), dt, 2000, 1
    )
    assert np.max(np.abs(runs.position[0])) < 20
    assert runs.last_step[1] < 2000 or np.max(np.abs(runs.position[1])) > 1e6


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_predicted_round_off_is_finite_and_does_not_shrink(scheme):
    choices = [[(option.name, choice) for choice in option.choices] for option in scheme.options]
    for options in map(dict, itertools.product(*choices)):
        predicted = [scheme.round_off(options, 2**level) for level in range(0, 31, 5)]
        assert predicted[0] >= 2.0**-54
        assert np.all(np.diff(predicted) >= 0)
        assert np.all(np.isfinite(predicted))


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_the_scheme_says_what_it_is(scheme):
    assert scheme.title
    assert scheme.source
    assert scheme.force_evaluations >= 1
    assert scheme.defaults() == {option.name: option.choices[0] for option in scheme.options}
    assert all(option.description for option in scheme.options)
