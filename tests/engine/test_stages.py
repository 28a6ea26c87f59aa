"""A step cut into stages is the step."""

import ast
import math

import pytest

from vibsim.engine.stages import kept_names, stages
from vibsim.schemes import FIXED_STEP

EXPLICIT = {kind: scheme for kind, scheme in FIXED_STEP.items() if scheme.explicit}


def force(u, v, t, p):
    return -p[0] * math.sin(u) - 0.1 * v * abs(v) + 0.2 * math.cos(0.7 * t)


def step_of(scheme):
    return scheme.stepper(scheme.defaults()).step


def taken(stage, function):
    """Return what a stage is as a function."""
    namespace = dict(function.__globals__)
    module = ast.Module([stage.tree], [])
    exec(compile(module, "<stage>", "exec"), namespace)
    return namespace[stage.tree.name]


@pytest.mark.parametrize("kind", EXPLICIT)
def test_a_step_has_a_stage_for_each_of_several_forces(kind):
    scheme = EXPLICIT[kind]
    number = scheme.evaluations
    assert len(stages(step_of(scheme))) == (number if number > 1 else 0)


@pytest.mark.parametrize("kind", [kind for kind in EXPLICIT if stages(step_of(EXPLICIT[kind]))])
def test_stages_one_after_the_other_give_the_bits_of_the_step(kind):
    step = step_of(EXPLICIT[kind])
    state, t, dt, p = (0.7, -0.3), 1.3, 0.21, (1.7,)
    rows = {}
    for stage in stages(step):
        kept = tuple(rows[name] for name in stage.before)
        found = taken(stage, step)(state, t, dt, p, kept, force)
        rows.update(zip(stage.after, found, strict=False))
    assert found == step(state, t, dt, p, force)
    assert set(rows) == set(kept_names(step))


@pytest.mark.parametrize("kind", [kind for kind in FIXED_STEP if kind not in EXPLICIT])
def test_an_implicit_step_is_not_cut(kind):
    assert stages(step_of(FIXED_STEP[kind])) == ()


def step_that_names_twice(state, t, dt, p, acceleration):
    u, v = state
    a = acceleration(u, v, t, p)
    v = v + dt * a
    b = acceleration(u, v, t, p)
    return (u + dt * v, v + dt * b), v


def step_with_a_hidden_force(state, t, dt, p, acceleration):
    u, v = state
    a = acceleration(u, v, t, p)
    b = 0.5 * acceleration(u + dt * v, v, t, p)
    return (u + dt * v, v + dt * (a + b)), v


def step_with_a_branch(state, t, dt, p, acceleration):
    u, v = state
    a = acceleration(u, v, t, p)
    if a > 0.0:
        return (u, v), v
    b = acceleration(u, v + dt * a, t, p)
    return (u, v + dt * b), v


@pytest.mark.parametrize(
    "step", [step_that_names_twice, step_with_a_hidden_force, step_with_a_branch]
)
def test_a_step_that_cannot_be_cut_stays_whole(step):
    assert stages(step) == ()
    assert kept_names(step) == ()
