"""Shift and factor of an oscillation: manufactured motions whose shift and factor are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vibsim.models import MODELS
from vibsim.observe.thresholds import LEAST_PER_SHIFT
from vibsim.observe.waveform_fit import fit_shift, quintic_interpolant, strides

W = 2 * np.pi
T = np.linspace(0.0, 10.0, 321)
H = np.full(1, T[1])


def cosine(t: Any, w: float = W) -> Any:
    return quintic_interpolant(
        *(x[None] for x in (np.cos(w * t), -w * np.sin(w * t), -(w**2) * np.cos(w * t))), spacing=H
    )


def told(u: Any, v: Any = None, of: Any = None, period: float = 1.0) -> Any:
    """Return time and factor of one computed motion."""
    of = cosine(T) if of is None else of
    v = np.gradient(u, T) if v is None else v
    p = np.full(1, period)
    found = fit_shift(u[None], v[None], of, p, strides(p, H, len(T)))
    return found[0, 0], found[1, 0]


@pytest.mark.parametrize("w", [W * 1.001, W * 0.97, W * 1.05])
@pytest.mark.parametrize("growth", [0.0, -0.05, 0.3])
@pytest.mark.parametrize("angle", [0.0, 0.2, -0.3])
def test_every_oscillation_of_a_linear_scheme_is_met_exactly(
    w: float, growth: float, angle: float
) -> None:
    u = 1.1 * np.exp(growth * T) * np.cos(w * T + angle)
    time, factor = told(u)
    np.testing.assert_allclose(time, ((w - W) * T + angle) / W, rtol=0, atol=2e-6)
    np.testing.assert_allclose(factor, 1.1 * np.exp(growth * T) - 1, rtol=2e-5, atol=2e-5)


@pytest.mark.parametrize("size", [1e-3, 1e-5, 1e-8])
def test_small_parts_are_found_to_rounding(size: float) -> None:
    w = W * (1 + size)
    u = (1 + size) * np.exp(0.1 * size * T) * np.cos(w * T + size)
    time, factor = told(u)
    np.testing.assert_allclose(time, ((w - W) * T + size) / W, rtol=1e-6, atol=1e-14)
    expected = np.expm1(np.log1p(size) + 0.1 * size * T)
    np.testing.assert_allclose(factor, expected, rtol=1e-6, atol=1e-13)


def test_a_shift_is_no_amplitude_to_any_order() -> None:
    # linearised, the shift by 0.05 would be an amplitude of (w 0.05)^2/2 = 5 percent
    _, factor = told(np.cos(W * (T + 0.05)))
    assert np.abs(factor).max() < 1e-8


def test_an_offset_is_neither() -> None:
    time, factor = told(np.cos(W * T) + 0.03)
    assert np.abs(time).max() < 1e-13
    assert np.abs(factor).max() < 1e-13


def test_the_same_motion_has_neither() -> None:
    time, factor = told(np.cos(W * T))
    assert np.abs(time).max() == 0.0
    assert np.abs(factor).max() == 0.0


def test_a_pendulum_of_another_amplitude_is_late_by_what_its_period_says() -> None:
    model = MODELS["pendulum"]
    parameters = {p.key: p.default for p in model.parameters}
    t = np.linspace(0.0, 40.0, 641)
    h = np.full(1, t[1])

    def motion(theta: float) -> Any:
        assert model.exact is not None
        start = {"theta": np.full(1, theta), "omega": np.zeros(1)}
        found = model.exact(t[None], {k: x[:, None] for k, x in start.items()}, parameters)
        return found["theta"], found["omega"]

    def period(theta: float) -> float:
        assert model.exact_period is not None
        return float(model.exact_period({"theta": theta, "omega": 0.0}, parameters))

    theta, omega = motion(2.0)
    of = quintic_interpolant(theta, omega, -np.sin(theta), h)
    p = np.full(1, period(2.0))
    for change in (1e-2, 1e-3):
        other = motion(2.0 * (1 + change))
        found = fit_shift(*other, of=of, period=p, stride=strides(p, h, len(t)))
        late = t * (period(2.0) / period(2.0 * (1 + change)) - 1)
        # peaks are where the shift is known: at whole half-periods
        np.testing.assert_allclose(found[0, 0], late, rtol=0.02, atol=0.3 * change)
        np.testing.assert_allclose(found[1, 0], change, rtol=0.35)


def test_a_shift_of_more_than_a_period_is_followed() -> None:
    w = 1.15 * W
    time, factor = told(np.cos(w * T), -w * np.sin(w * T))
    np.testing.assert_allclose(time, 0.15 * T, atol=1e-4)
    assert np.abs(factor).max() < 1e-3


def test_what_does_not_oscillate_has_no_parts() -> None:
    turning = quintic_interpolant(
        *(x[None] for x in (T + 0.1 * np.sin(T), 1 + 0.1 * np.cos(T), -0.1 * np.sin(T))), spacing=H
    )
    time, factor = told(T, np.ones_like(T), turning)
    assert np.isnan(time).all()
    assert np.isnan(factor).all()


def test_a_motion_that_is_not_finite_has_no_parts() -> None:
    u = np.cos(W * T)
    u[200:] = np.nan
    assert np.isnan(told(u, u)[0]).all()


def test_too_few_samples_or_too_short_a_run() -> None:
    one = np.ones(1)
    assert strides(one, one / (LEAST_PER_SHIFT - 1), 1000) == 0
    assert strides(one, one / LEAST_PER_SHIFT, 1000) == 1
    assert strides(one, one / 64, 17) == 0
    assert strides(one, one / 64, 65) == 4
    assert strides(one, one / 16, 16) == 0


def test_a_row_has_the_same_bits_alone_and_among_others() -> None:
    rng = np.random.default_rng(3)
    u = np.cos(W * T) * (1 + 0.01 * rng.standard_normal((4, 1))) + 1e-3 * np.cos(3 * W * T)
    v = np.gradient(u, T, axis=-1)
    period = np.array([1.0, 1.0, 0.9, 1.1])
    h = np.repeat(H, 4)
    of = quintic_interpolant(
        *(np.tile(x, (4, 1)) for x in (np.cos(W * T), -W * np.sin(W * T), -(W**2) * np.cos(W * T))),
        spacing=h,
    )
    stride = strides(period, h, len(T))
    together = fit_shift(u, v, of, period, stride)
    for i in range(4):
        one = slice(i, i + 1)
        part = quintic_interpolant(
            of.position[one], of.velocity[one], -(W**2) * of.position[one], h[one]
        )
        alone = fit_shift(u[one], v[one], part, period[one], stride[one])
        np.testing.assert_array_equal(alone[0, 0], together[0, i])
        np.testing.assert_array_equal(alone[1, 0], together[1, i])
