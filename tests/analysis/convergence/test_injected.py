"""Ladders made by hand, through the public way in: what two ratios, a floor that begins and a sign may be taken for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from judged import Finding, findings
from numpy.typing import NDArray
from synthetic import POINTS, Group, Ladder
from thinned import thinned

from vibsim.convergence.differences import cosines
from vibsim.core.vocabulary import NORMS

Floats = NDArray[np.float64]
T = np.linspace(0.0, 1.0, POINTS + 1)
WAVE, OTHER = T * np.sin(7.0 * T), T * np.cos(11.0 * T)


def judged(
    error: Callable[[float, int], Floats], levels: tuple[int, ...], folder: Path, known: bool
) -> dict[float, Finding]:
    """Judge one ladder of errors ``error(h, index)``, h = 1 at the coarsest level, by every expectation."""
    rows = np.stack([error(2.0 ** (levels[0] - level), i) for i, level in enumerate(levels)])
    ladder = Ladder("by hand", rows, np.nan, (np.nan, np.nan), (0, len(levels)), True)
    group = Group(levels, POINTS, known, "compensated", (ladder, ladder))
    return {found.formal: found for found in findings(group, folder)}


@pytest.mark.parametrize("norm", NORMS)
def test_proportional_series_have_the_sign_of_their_inner_product(norm: str) -> None:
    first, second = np.sin(T)[None], 0.25 * np.sin(T)[None]
    _, alike, opposite = cosines([first, second, -second], norm)[0, 0]
    assert alike == pytest.approx(1.0, abs=1e-15)
    assert opposite == -alike


@pytest.mark.slow
@pytest.mark.parametrize("known", [False, True])
def test_a_change_of_sign_is_no_half_order(known: bool, tmp_path: Path) -> None:
    """At the finest level of h - 0.83 h^3 there is h; the last two ratios are those of h^(1/2) by accident."""
    found = judged(lambda h, i: 6e-3 * (h - 0.8345 * h**3) * WAVE, (6, 7, 8, 9), tmp_path, known)
    assert found[0.5].status != "PASS"
    found = judged(lambda h, i: 2e-2 * (h**2 - 1.154 * h**4) * WAVE, (6, 7, 8, 9), tmp_path, known)
    assert found[1.5].status != "PASS"


@pytest.mark.parametrize(("power", "size"), [(4, 1e-5), (2, 1e-4), (2, 2e-4)])
def test_a_floor_that_begins_is_no_lower_power(power: int, size: float, tmp_path: Path) -> None:
    """Its part rises from level to level by 2^p and more, that of a lower power by less."""
    noise = np.random.default_rng(power).normal(size=(4, len(T))) * (T > 0)

    def error(h: float, i: int) -> Floats:
        return np.asarray(1e-3 * (h**power * WAVE + size * noise[i]))

    found = judged(error, (6, 7, 8, 9), tmp_path, False)
    assert found[float(power)].status == "PASS"


@pytest.mark.parametrize(
    ("power", "more", "further", "count", "known"),
    [
        (2, 0.015, 3, 3, True),
        (2, -0.0104, 4, 4, True),
        (2, -0.0104, 4, 4, False),
        (4, 0.083, 5, 4, True),
        (4, 0.083, 5, 4, False),
    ],
)
def test_an_order_that_passes_fails_where_another_one_is_asked_for(
    power: int, more: float, further: int, count: int, known: bool, tmp_path: Path
) -> None:
    """What is believed is no other order, nor is it a lower one that a second power of the same shape covers.

    Of a lower order the levels alone may say nothing, down to half of the true one; with the errors they always do.
    """
    found = judged(
        lambda h, i: 1e-3 * (h**power + more * h**further) * WAVE,
        tuple(range(6, 6 + count)),
        tmp_path,
        known,
    )
    one = found[float(power)]
    assert one.status == "PASS"
    told = {p: f.reason for p, f in found.items() if p < one.low - 0.1 or p > one.high + 0.1}
    assert {p for p in found if p > power} <= set(told)
    assert [p for p, f in found.items() if f.status == "PASS"] == [power]
    may_be_open = set() if known else {p for p in told if power / 2 <= p < power}
    for p, reason in told.items():
        if p in may_be_open and reason == "pre_asymptotic":
            continue
        assert reason == ("order_high" if p < power else "order_low"), p


def test_differences_that_change_their_sign_oscillate(tmp_path: Path) -> None:
    """Errors of one shape that alternate from level to level are no round-off, for which they fall too well."""
    found = judged(lambda h, i: (-1) ** i * 1e-3 * h**2 * WAVE, (6, 7, 8, 9), tmp_path, True)
    assert {one.reason for one in found.values()} == {"oscillating"}


@pytest.mark.parametrize(
    ("part", "reason"),
    [(0.01, "asymptotic"), (0.03, "asymptotic"), (0.5, "wrong_limit"), (3.0, "wrong_limit")],
)
def test_one_power_to_another_limit_is_seen_in_the_errors(
    part: float, reason: str, tmp_path: Path
) -> None:
    """The limit is off by a part of the finest error, which no power makes where the differences are h^2 alone."""

    def error(h: float, i: int) -> Floats:
        return np.asarray(1e-2 * (h**2 * WAVE + part / 64 * OTHER))

    found = judged(error, (6, 7, 8, 9), tmp_path, True)
    assert found[2.0].reason == reason
    assert found[4.0].status == "FAIL"


@pytest.mark.parametrize("part", [3.0, 10.0])
def test_a_wrong_order_to_a_wrong_limit_fails(part: float, tmp_path: Path) -> None:
    def error(h: float, i: int) -> Floats:
        return np.asarray(1e-3 * (h * WAVE + part / 8 * OTHER))

    found = judged(error, (6, 7, 8, 9), tmp_path, True)
    assert found[2.0].status == "FAIL"
    assert found[1.0].reason == "wrong_limit"


@pytest.mark.slow
@pytest.mark.parametrize("more", thinned([-0.12, -0.08, 0.08, 0.12], 3))
def test_a_level_more_takes_no_verdict_away(more: float, tmp_path: Path) -> None:
    """The finest three levels pass with their errors; so do they with coarser ones before them."""
    for count in (3, 4, 5, 6):
        coarsest = 2.0 ** (count - 4)

        def error(h: float, i: int, coarsest: float = coarsest) -> Floats:
            return np.asarray(1e-3 * ((coarsest * h) ** 2 + more * (coarsest * h) ** 4) * WAVE)

        found = judged(error, tuple(range(12 - count, 12)), tmp_path, True)
        assert found[2.0].status == "PASS", count
