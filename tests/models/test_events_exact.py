"""Exact solutions of models with events against 40-digit arithmetic that goes from event to event."""

import math

import mpmath
import numpy as np
import pytest

from vibsim.formula import values
from vibsim.models import MODELS, tree
from vibsim.models import bouncing_ball as ball
from vibsim.models.oscillator import written
from vibsim.models.shared.linear_motion import swings

BOX, BALL = MODELS["sliding_box"], MODELS["bouncing_ball"]
RNG = np.random.default_rng(19)
DIGITS = 40


def sliding(m, k, mu, g, u, v, times):
    """Return position and velocity at increasing times, and when the box sticks (None: after them)."""
    with mpmath.workdps(DIGITS):
        m, k, mu, g, u, v = map(mpmath.mpf, (m, k, mu, g, u, v))
        w, push, t, found = mpmath.sqrt(k / m), mu * g, mpmath.mpf(0), []
        times = [mpmath.mpf(float(x)) for x in times]
        while True:
            side = mpmath.sign(v) if v else (-mpmath.sign(u) if abs(k / m * u) > push else 0)
            if side == 0:
                found += [(u, mpmath.mpf(0))] * (len(times) - len(found))
                return found, t
            # u'' = -w^2 u - side push: about the centre, with phase zero now
            centre = -side * push / w**2
            a, b = u - centre, v / w
            # v = w (b cos x - a sin x) vanishes first at
            x = mpmath.atan2(b, a) % mpmath.pi if b else mpmath.pi
            for time in times[len(found) :]:
                y = w * (time - t)
                if y > x:
                    break
                c, s = mpmath.cos(y), mpmath.sin(y)
                found.append((centre + a * c + b * s, w * (b * c - a * s)))
            if len(found) == len(times):
                return found, None
            u, v, t = centre + a * mpmath.cos(x) + b * mpmath.sin(x), mpmath.mpf(0), t + x / w


def bouncing(g, e, slow, h, v, times):
    """Return height and velocity at increasing times, when the ball lies, and the times of its impacts."""
    with mpmath.workdps(DIGITS):
        g, e, slow, h, v = map(mpmath.mpf, (g, e, slow, h, v))
        t, found, impacts = mpmath.mpf(0), [], []
        times = [mpmath.mpf(float(x)) for x in times]
        rests = h == 0 and abs(v) <= slow
        while not rests and len(found) < len(times):
            fall = (v + mpmath.sqrt(v * v + 2 * g * h)) / g
            for time in times[len(found) :]:
                y = time - t
                if y >= fall and y > 0:
                    break
                found.append((h + v * y - g * y * y / 2, v - g * y))
            v, h, t = -e * (v - g * fall), mpmath.mpf(0), t + fall
            impacts.append(t)
            rests = v <= slow
        found += [(mpmath.mpf(0), mpmath.mpf(0))] * (len(times) - len(found))
        return found, t if rests else None, impacts


def random_boxes(count):
    for _ in range(count):
        m, k, g = RNG.uniform(0.3, 3.0, 3)
        mu = float(RNG.choice([0.0, 0.01, 0.1, 0.5]))
        u, v = RNG.uniform(-2.0, 2.0, 2) * RNG.integers(0, 2, 2)
        yield {"m": m, "k": k, "alpha": 0.0, "mu": mu, "g": g}, {"u": float(u), "v": float(v)}


def test_the_sliding_box_from_event_to_event():
    t = np.linspace(0.0, 40.0, 161)
    stuck = 0
    for p, initial in random_boxes(40):
        wanted, rest = sliding(p["m"], p["k"], p["mu"], p["g"], initial["u"], initial["v"], t)
        found = BOX.exact(t, initial, p)
        w = math.sqrt(p["k"] / p["m"])
        size = 4.0 + 4.0 / w
        accuracy = 1e-14 * size * (1.0 + w * t[-1])
        np.testing.assert_allclose(found["u"], [float(u) for u, _ in wanted], atol=accuracy)
        np.testing.assert_allclose(found["v"], [float(v) for _, v in wanted], atol=accuracy * w)
        pieces = swings(w, p["mu"] * p["m"] * p["g"] / p["k"], initial["u"], initial["v"])
        moves = pieces.direction != 0
        given = float((pieces.angle + np.pi * pieces.count) / w) if moves else 0.0
        if rest is not None:
            stuck += 1
            assert given == pytest.approx(float(rest), rel=1e-13, abs=1e-15)
            later = found["u"][t > float(rest)]
            assert len(set(later.tolist())) <= 1
            assert (found["v"][t > float(rest)] == 0.0).all()
        else:
            assert given > t[-1]
    assert 10 < stuck < 40


def test_the_oscillator_with_coulomb_friction_is_the_box():
    model = written({"damping": "b*sign(v)", "spring": "k*u"}, ("k",))
    t = np.linspace(0.0, 20.0, 41)
    for p, initial in random_boxes(10):
        numbers = {"m": p["m"], "damping.coulomb": p["mu"] * p["m"] * p["g"]}
        found = model.exact(t, initial, {**numbers, "parameters.k": p["k"]})
        wanted = BOX.exact(t, initial, p)
        for name in ("u", "v"):
            np.testing.assert_allclose(found[name], wanted[name], atol=1e-12)


def test_the_exact_box_is_unknown_with_another_spring():
    p = {row.name: row.default for row in BOX.parameters} | {"alpha": np.array([[0.0], [0.5]])}
    found = BOX.exact(np.linspace(0.0, 3.0, 5), {"u": 1.0, "v": 0.0}, p)
    assert np.isfinite(found["u"][0]).all()
    assert np.isnan(found["u"][1]).all()


def lying_time(initial, p):
    """Return the time from which the ball lies on the ground."""
    return ball.impact_time(ball.last_impact(initial, p), initial, p)


def random_balls(count):
    for _ in range(count):
        e = float(RNG.choice([0.0, 0.3, 0.8, 0.99, 1.0]))
        slow = float(RNG.choice([0.0, 1e-3, 0.3])) if e < 0.95 else 1e-3
        h, v = RNG.uniform(0.0, 3.0) * RNG.integers(0, 2), RNG.uniform(-3.0, 3.0)
        p = {"g": RNG.uniform(0.5, 10.0), "restitution": e, "eps_h": 0.0, "eps_v": slow}
        yield p, {"h": float(h), "v": float(v)}


def test_the_bouncing_ball_from_impact_to_impact():
    for p, initial in random_balls(60):
        time, speed = ball.first_impact(initial, p)
        t = np.linspace(0.0, float(time) + 12.0 * float(speed) / p["g"], 97)
        e, slow = p["restitution"], p["eps_v"]
        if 0.0 < e < 0.5 and slow == 0.0:
            continue  # infinitely many impacts: see below
        if slow == 0.0 and 0.0 < e < 1.0:
            # not up to the accumulation of all impacts
            t = t[t < 0.98 * float(lying_time(initial, p))]
        wanted, rest, impacts = bouncing(p["g"], e, slow, initial["h"], initial["v"], t)
        found = BALL.exact(t, initial, p)
        size = 1.0 + float(speed)
        # next to an impact a rounding of its time decides which side a time is on
        near = np.array([min((abs(float(x) - s) for x in impacts), default=1.0) for s in t])
        far = near > 1e-12 * t[-1]
        # at the start itself the given values
        assert (found["h"][0], found["v"][0]) == (initial["h"], initial["v"])
        far[0] = False
        np.testing.assert_allclose(found["h"], [float(h) for h, _ in wanted], atol=1e-12 * size**2)
        speeds = np.array([float(v) for _, v in wanted])
        np.testing.assert_allclose(found["v"][far], speeds[far], atol=1e-12 * size**2)
        for number, when in enumerate(impacts[:50], 1):
            given = float(ball.impact_time(float(number), initial, p))
            assert given == pytest.approx(float(when), rel=1e-13)
        if rest is not None:
            assert float(lying_time(initial, p)) == pytest.approx(float(rest), rel=1e-13)
            assert float(ball.last_impact(initial, p)) == len(impacts)


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9, 0.999])
def test_the_bounces_of_a_ball_add_up_to_the_geometric_series(e):
    p = {"g": 2.0, "restitution": e, "eps_h": 0.0, "eps_v": 0.0}
    initial = {"h": 4.0, "v": 0.0}
    # 2 s down with 4 m/s, then 4 e (1 + e + ...) s
    whole = 2.0 + 4.0 * e / (1.0 - e)
    assert float(lying_time(initial, p)) == pytest.approx(whole, rel=1e-14)
    assert float(ball.last_impact(initial, p)) == math.inf
    t = np.array([0.999999 * whole, whole * (1 + 1e-12), 2.0 * whole])
    found = BALL.exact(t, initial, p)
    assert found["h"][0] >= 0.0
    assert (found["h"][1:] == 0.0).all()
    assert (found["v"][1:] == 0.0).all()


def test_a_ball_that_loses_nothing_bounces_for_ever():
    p = {"g": 2.0, "restitution": 1.0, "eps_h": 0.0, "eps_v": 1e-3}
    found = BALL.exact(np.array([0.5, 4.5, 400.5, 401.0]), {"h": 4.0, "v": 0.0}, p)
    np.testing.assert_allclose(found["h"], [3.75, 3.75, 3.75, 3.0], rtol=1e-12)
    assert float(lying_time({"h": 4.0, "v": 0.0}, p)) == math.inf


@pytest.mark.parametrize("x", [0.0, 1e-300, 1e-9, 0.0624, 0.0626, 0.3, 1.0, 5.0, 19.9, 20.1, 900.0])
def test_the_energy_of_the_yielding_spring_does_not_cancel(x):
    potential = tree(BOX, BOX.potential_energy)
    u, k = 1.7, 0.6
    alpha = x / u
    found = float(values(potential, {"u": u, "v": 0, "t": 0, "k": k, "alpha": alpha, "m": 1}))
    with mpmath.workdps(700):
        a = mpmath.mpf(alpha)
        own = (
            mpmath.mpf(k) / a**2 * mpmath.log(mpmath.cosh(a * mpmath.mpf(u)))
            if x
            else k * u * u / 2
        )
        assert found == pytest.approx(float(own), rel=8 * 2.0**-53)
    pull = tree(BOX, BOX.events.drive)
    found = float(values(pull, {"u": u, "v": 0, "t": 0, "k": k, "alpha": alpha, "m": 1}))
    own = -k * u if x < 1e-100 else -k / alpha * math.tanh(alpha * u)
    assert found == pytest.approx(own, rel=8 * 2.0**-53)


@pytest.mark.parametrize("spring", ["0", "-0.1*u", "k*u"])
def test_friction_has_no_exact_motion_where_the_spring_does_not_pull_back(spring: str) -> None:
    model = written({"spring": spring, "damping": "b*sign(v)"}, ("k",) if "k" in spring else ())
    parameters = {"m": 1.0, "damping.coulomb": 0.05, "parameters.k": np.array([[0.0], [-1.0]])}
    states = model.exact(np.linspace(0.0, 5.0, 9), {"u": 0.2, "v": 0.3}, parameters)
    assert all(np.isnan(values).all() for values in states.values())
