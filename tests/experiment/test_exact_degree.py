"""Checks of the degree up to which schemes reproduce polynomials."""

import pytest

from vibsim import analyse, simulate, verdicts
from vibsim.core.errors import VibsimError
from vibsim.experiment import Experiment

TEXT = """
title: polynomials
model: {model}
initial: {{}}
time: {{end: 2.0}}
levels: [3, 4]
schemes: [rk4, {{kind: central, label: varied}}]
sweep: {{schemes.varied.start: [centred, first_order]}}
checks:
  - {{value: exact_degree, at: {{{at}}}, equals: 1}}
"""


def experiment(tmp_path, model="{kind: duffing}", at="scheme: rk4", more=""):
    path = tmp_path / "polynomials.yaml"
    path.write_text(TEXT.format(model=model, at=at) + more)
    return Experiment.from_yaml(path)


@pytest.mark.parametrize(
    "model",
    ["{kind: pendulum}", "{kind: oscillator, spring: sin(u)}", "{kind: bouncing_ball}"],
)
def test_models_without_exact_numbers_are_refused(tmp_path, model):
    with pytest.raises(
        VibsimError,
        match=r"polynomials\.yaml:10: checks\[0\]\.value: exact_degree.*whole powers and abs",
    ):
        experiment(tmp_path, model)


def test_no_level_is_asked_for(tmp_path):
    with pytest.raises(VibsimError, match="level"):
        experiment(tmp_path, at="level: 3")


def test_every_member_has_the_degree_of_its_options(tmp_path):
    more = """\
  - {value: exact_degree, at: {scheme: varied, case: 0}, equals: 2}
  - {value: exact_degree, at: {scheme: varied, case: 1}, equals: 1}
"""
    asked = experiment(tmp_path, more=more)
    found = analyse(asked, [simulate(asked, level) for level in (3, 4)])
    assert [verdict.status for verdict in verdicts(asked, found)] == ["PASS"] * 3
