"""Orders of schemes where the motion is not smooth: kept by located events, and no more than 1 on the mesh."""

from functools import cache
from itertools import product

import event_runs as runs_of
import mpmath
import numpy as np
import pytest
from thinned import thinned

from vibsim.models import MODELS, quantities
from vibsim.schemes import FIXED_STEP

BOX, BALL, DRIVEN = runs_of.BOX, runs_of.BALL, runs_of.DRIVEN
SAMPLES = 64
BOX_START = (1.0, 0.3)
HELD = {"b": 0.6, "k": 1.0, "A": 1.0, "w": 0.5}


def box(alpha):
    return {"mu": 0.07, "alpha": alpha}


@cache
def driven_reference(end):
    """Return position and velocity of the held and driven body at the samples, and the number of events.

    While it slides, ``u = -s b + D cos(w t)`` and a free oscillation; each event is a root in 30 digits.
    """
    b, w = mpmath.mpf("0.6"), mpmath.mpf("0.5")
    large = 1 / (1 - w * w)
    step = mpmath.mpf("0.01")

    def root(of, first):
        """Return the first root behind `first`, where `of` is negative."""
        while first < end and of(first + step) < 0:
            first += step
        if first >= end:
            return None
        return mpmath.findroot(of, (first, first + step), solver="anderson", tol=1e-27)

    def slide(t, u, side):
        a = u + side * b - large * mpmath.cos(w * t)
        c = large * w * mpmath.sin(w * t)

        def position(x):
            free = a * mpmath.cos(x - t) + c * mpmath.sin(x - t)
            return -side * b + large * mpmath.cos(w * x) + free

        def velocity(x):
            free = -a * mpmath.sin(x - t) + c * mpmath.cos(x - t)
            return -large * w * mpmath.sin(w * x) + free

        return position, velocity

    with mpmath.workdps(30):
        t, u, pieces = mpmath.mpf(0), mpmath.mpf("0.1"), []
        while True:
            drive = mpmath.cos(w * t) - u
            if abs(drive) < b * (1 - mpmath.mpf(10) ** -25):
                leaves = root(lambda x, u=u: abs(mpmath.cos(w * x) - u) - b, t)
                pieces.append((t, leaves, lambda x, u=u: u, lambda x: mpmath.mpf(0)))
                if leaves is None:
                    break
                t = leaves
                drive = mpmath.cos(w * t) - u
            side = 1 if drive > 0 else -1
            position, velocity = slide(t, u, side)
            stops = root(lambda x, v=velocity, s=side: -s * v(x), t + step)
            pieces.append((t, stops, position, velocity))
            if stops is None:
                break
            t, u = stops, position(stops)
        found = []
        for k in range(SAMPLES + 1):
            x = mpmath.mpf(end) * k / SAMPLES
            _, _, position, velocity = [piece for piece in pieces if piece[0] <= x][-1]
            found.append((float(position(x)), float(velocity(x))))
    return np.array(found).T, len(pieces) - 1


@cache
def box_reference(alpha, end):
    """Return the exact box, or for a spring that yields what `gauss4` makes of it with steps 30 times as fine."""
    if alpha == 0.0:
        parameters = {row.name: row.default for row in BOX.parameters} | box(alpha)
        t = np.linspace(0.0, end, SAMPLES + 1)
        found = BOX.exact(t, dict(zip(("u", "v"), BOX_START, strict=True)), parameters)
        return np.array([found["u"], found["v"]])
    run = runs_of.run(BOX, "gauss4", box(alpha), BOX_START, end, 2**14, with_gathered=False)
    return np.array([run.position[0], run.velocity[0]])[:, :: 2**14 // SAMPLES]


def errors(model, kind, parameters, initial, end, reference, levels, **more):
    """Return the largest error at the samples of position and velocity, shape (level, 2)."""
    found = []
    for level in levels:
        run = runs_of.run(model, kind, parameters, initial, end, 2**level, **more)
        every = 2**level // SAMPLES
        states = np.array([run.position[0, ::every], run.velocity[0, ::every]])
        found.append(np.max(np.abs(states - reference), axis=1))
    return np.array(found)


CASES = thinned(product(FIXED_STEP, ("linear", "yielding", "driven")), 4)


def located(kind, name, levels, **more):
    if name == "driven":
        reference, _ = driven_reference(20.0)
        return errors(DRIVEN, kind, HELD, (0.1, 0.0), 20.0, reference, levels, **more)
    alpha = {"linear": 0.0, "yielding": 1.5}[name]
    reference = box_reference(alpha, 16.0)
    return errors(BOX, kind, box(alpha), BOX_START, 16.0, reference, levels, **more)


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_located_events_leave_a_scheme_its_order(kind, name):
    scheme = FIXED_STEP[kind]
    model = DRIVEN if name == "driven" else BOX
    order = scheme.formal_order(model.position, model, scheme.defaults())
    levels = (8, 9, 10) if order < 3 else (7, 8, 9)
    found = located(kind, name, levels, with_gathered=False)
    rates = np.log2(found[:-1] / found[1:])
    # what is left of the next power, which is not regular behind events
    assert np.all(np.abs(rates[-1] - order) < (0.35 if order == 1 else 0.25)), rates
    assert np.all(found[-1] < (0.3 if order == 1 else 4e-3))


def test_the_driven_body_sticks_and_slips():
    _, events = driven_reference(20.0)
    run = runs_of.run(DRIVEN, "gauss4", HELD, (0.1, 0.0), 20.0, 2**9)
    assert events == run.events.event_count[0] == 7


@pytest.mark.parametrize("kind", thinned(FIXED_STEP, 3))
def test_on_the_mesh_no_order_above_one_is_left(kind):
    """Over seven halvings, as the error of a single one is the accident of where events lie."""
    scheme = FIXED_STEP[kind]
    for model in (BOX, DRIVEN):
        options = {**scheme.defaults(), "events": "mesh"}
        for quantity in quantities(model):
            assert scheme.formal_order(quantity, model, options) == 1.0
    found = located(kind, "linear", (6, 13), events="mesh", with_gathered=False)
    rate = np.log2(found[0] / found[1]) / 7
    assert np.all(rate > 0.7), rate
    assert np.all(rate < 1.45), rate


@pytest.mark.parametrize("kind", FIXED_STEP)
def test_every_piece_of_a_parabola_is_exact_from_order_two_on(kind):
    parameters = {"g": 9.81, "eps_v": 0.02}
    given = {row.name: row.default for row in BALL.parameters} | parameters
    run = runs_of.run(BALL, kind, parameters, (1.0, 0.5), 5.0, 512)
    t = np.linspace(0.0, 5.0, 513)
    exact = BALL.exact(t, {"h": 1.0, "v": 0.5}, given)
    scheme = FIXED_STEP[kind]
    away = np.max(np.abs(run.position[0] - exact["h"]))
    if scheme.formal_order("h", BALL, scheme.defaults()) > 1:
        assert away < 1e-12
        assert np.max(np.abs(run.velocity[0] - exact["v"])) < 1e-11
    else:
        assert 1e-4 < away < 0.4


def changed(scheme):
    for option in scheme.words:
        yield from ({**scheme.defaults(), option.name: word} for word in option.choices[1:])


def test_promises_where_events_are():
    for scheme in FIXED_STEP.values():
        for options in (scheme.defaults(), *changed(scheme)):
            promised = scheme.orders(options)
            for quantity in quantities(BOX):
                order = scheme.formal_order(quantity, BOX, options)
                assert order == min(promised.position, promised.velocity)
                assert not scheme.has_even_powers(quantity, BOX, options)
    smooth = MODELS["pendulum"]
    central = FIXED_STEP["central"]
    assert central.has_even_powers("theta", smooth, central.defaults())
