r"""A bouncing ball: ``h'' = -g`` above the ground, ``v -> -restitution*v`` at impacts, where h = 0.

Without air, the speed after impact number k = 1, 2, ... is ``restitution^k v_1``, with v_1 the speed of the first
impact, and the next bounce takes ``2 restitution^k v_1/g``: the durations form a geometric series. The ball is at rest
from the first impact after which its speed would be at most eps_v. With eps_v = 0 there are infinitely many impacts,
all before ``t_1 + (2 v_1/g) restitution/(1 - restitution)``, when it comes to rest. A ball that is on the ground at
t = 0 with a speed of at most eps_v is at rest from the beginning.

Source: vibration text (B), section 10.9, equations (115)-(117), and exercise 20. Units: g [m s-2], eps_h [m],
eps_v [m s-1], h [m], v [m s-1]; the energy is that of a unit mass, ``v^2/2 + g h`` [m2 s-2].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.elementary import on_arrays
from vibsim.models.base import Model, Numbers, Parameter, State
from vibsim.models.events import Impact
from vibsim.models.shared.scales import Scales


def first_impact(initial: Numbers, parameters: Numbers) -> tuple[Any, Any]:
    """Return time [s] and speed [m s-1] of the first impact."""
    h, v, g = initial["h"], initial["v"], parameters["g"]
    speed = np.sqrt(v * v + 2.0 * g * h)
    # two forms of the same root, each without cancellation for one sign of v
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.where(v >= 0, (v + speed) / g, 2.0 * h / (speed - v))
    return time, speed


def last_impact(initial: Numbers, parameters: Numbers) -> Any:
    """Return the number of the impact after which the ball is at rest: 0 for the beginning, infinite for never."""
    _, speed = first_impact(initial, parameters)
    e, slow = parameters["restitution"], parameters["eps_v"]
    with np.errstate(divide="ignore", invalid="ignore"):
        number = np.ceil(on_arrays.log(slow / speed) / on_arrays.log(e))
        # rounding of the logarithms may miss a speed that is exactly eps_v
        number = np.where(on_arrays.power(e, number - 1.0) * speed <= slow, number - 1.0, number)
    number = np.where(e == 0, 1.0, np.where(e == 1, np.inf, np.where(slow == 0, np.inf, number)))
    number = np.where(e * speed <= slow, 1.0, number)
    lies = (initial["h"] <= 0) & (np.abs(initial["v"]) <= slow)
    return np.where(lies, 0.0, np.maximum(number, 1.0))


def impact_time(number: Any, initial: Numbers, parameters: Numbers) -> Any:
    """Return the time [s] of impact `number` = 1, 2, ...; their limit for an infinite number, 0 for number 0."""
    time, speed = first_impact(initial, parameters)
    e, flight = parameters["restitution"], 2.0 * speed / parameters["g"]
    with np.errstate(divide="ignore", invalid="ignore"):
        bounces = number - 1.0
        # e + e^2 + ... + e^(number - 1)
        total = np.where(
            e < 1, e * -on_arrays.expm1(bounces * on_arrays.log(e)) / (1.0 - e), bounces
        )
    total = np.where((e == 0) | (number <= 1), 0.0, total)
    return np.where(number == 0, 0.0, time + flight * total)


def exact(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return h and v at times `t`, shape (..., n_t); at the time of an impact, the values after it."""
    g, e = parameters["g"], parameters["restitution"]
    time, speed = first_impact(initial, parameters)
    last = last_impact(initial, parameters)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        # time since the first impact, in units of the first bounce over e
        passed = (t - time) * g / (2.0 * speed)
        left = np.where(e < 1, 1.0 - passed * (1.0 - e) / e, 1.0)
        number = (
            np.where(e < 1, np.floor(on_arrays.log(left) / on_arrays.log(e)), np.floor(passed))
            + 1.0
        )
        number = np.where(left <= 0, np.inf, np.maximum(number, 1.0))
        # rounding of the logarithms may miss the last impact up to t by one
        sooner = impact_time(np.maximum(number, 1.0), initial, parameters) > t
        number = np.where(sooner & (number > 1.0), number - 1.0, number)
        later = impact_time(number + 1.0, initial, parameters) <= t
        number = np.where(later, number + 1.0, number)
        since = t - impact_time(number, initial, parameters)
        rise = on_arrays.power(e, number) * speed
        h, v = since * (rise - 0.5 * g * since), rise - g * since
    first = (t < time) & (last > 0)
    rests = ~first & ((number >= last) | ~np.isfinite(number))
    h = np.where(rests, 0.0, np.maximum(h, 0.0))
    v = np.where(rests, 0.0, v)
    # at t = 0 the initial values, even if the ball hits the ground then
    first = first | (t == 0)
    fall = initial["h"] + t * (initial["v"] - 0.5 * g * t)
    return {"h": np.where(first, fall, h), "v": np.where(first, initial["v"] - g * t, v)}


BOUNCING_BALL = Model(
    kind="bouncing_ball",
    title="Bouncing ball",
    source="vibration text, section 10.9 and exercise 20",
    equation="h'' = -g, v -> -restitution v at h = 0",
    states=(State("h", "m", "height", minimum=0.0), State("v", "m s-1", "velocity")),
    parameters=(
        Parameter("g", 1.0, "m s-2", "acceleration of gravity", minimum=0.0, exclusive=True),
        Parameter("restitution", 0.8, "1", "coefficient of restitution", minimum=0.0, maximum=1.0),
        Parameter("eps_h", 0.0, "m", "height of the ground where events are left to the mesh", 0.0),
        Parameter("eps_v", 1e-3, "m s-1", "speed after an impact at which the ball rests", 0.0),
    ),
    acceleration="-g",
    kinetic_energy="0.5*v**2",
    potential_energy="g*h",
    energy_unit="m2 s-2",
    linear=False,
    conservative=False,
    # there are no small oscillations
    natural_frequency=lambda parameters: parameters["g"] * np.nan,
    exact=exact,
    scales=Scales(
        time="where(h != 0, sqrt(h/g), abs(v)/g)",
        position="where(h != 0, h, v**2/g)",
        energy="g*h_c",
        numbers=(("restitution", "restitution"),),
        parameters=(
            ("g", "1"),
            ("restitution", "restitution"),
            ("eps_h", "eps_h/h_c"),
            ("eps_v", "eps_v*t_c/h_c"),
        ),
    ),
    events=Impact(restitution="restitution", near="eps_h", slow="eps_v", cost="1"),
)
