"""A driven motion at whole periods of its force: amplitude, phase, whether it is steady, and its Poincare section.

**The harmonic of the force in the last period.**

With n + 1 samples ``u_j`` of the period, at ``t_j = T - P + j P/n``, and half the weight at both ends,

    c = (2/n) sum u_j exp(-i w t_j),    u = A cos(w t - phase) + other harmonics,    A = |c|, phase = -arg c,

where the end T is a whole number of periods P = 2 pi/w, so that ``w t_j = 2 pi j/n`` modulo 2 pi. For a periodic motion
the sum is exact apart from the harmonics n - 1, n + 1, ..., which are smaller than any power of the sampling step.
Every level uses all its samples, but no more than a finer level has: with the few common ones these harmonics would not
be negligible, and what is left of the start adds an error of second order in the sampling step, which must fall from
level to level. Where the velocity at the end has a formula of its own, u_n there is that of the period before, and the
change since then of the samples before, on a straight line.

Source: A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (Wiley, 1979), section 4.1, for the response of driven
oscillators; L. N. Trefethen, J. A. C. Weideman, The exponentially convergent trapezoidal rule, SIAM Review 56 (2014)
385-458, for the sum.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from vibsim.convergence.differences import safe_ratio
from vibsim.core.array_types import Complexes, Flags, Floats
from vibsim.elementary import on_arrays
from vibsim.formula import values_of
from vibsim.models import Model, tree
from vibsim.observe.common_grid import take, take_all
from vibsim.observe.member_block import MemberBlock
from vibsim.simulation.members import Members

SAME_STATE = 1e-3
"""Distance at which a state counts as repeated, relative to its largest value."""
TURN = 2.0 * np.pi
TESTS, SAME_AFTER_A_TURN = 16, 1e-9
"""Number of random states at which accelerations are compared after a turn, and the tolerance of the comparison."""
LEAST_PERIODS = 4
"""Number of periods whose changes give the remaining transient."""
REST_SAFETY = 2.0
"""Safety factor of that estimate, which two modes or a conjugate pair make too small: covers 98 of 100. [calibrated]"""
ROUNDINGS = 8.0
"""Changes of at most so many times the predicted round-off are noise, of which no factor can be told."""


def samples_a_period(block: MemberBlock) -> int:
    """Return the number of intervals of the common grid in a period of the force.

    0 if no force is named, or the common times do not divide its periods.
    """
    time = block.experiment.time
    if time.frequency is None or time.periods is None:
        return 0
    count, rest = divmod(len(block.grid.t) - 1, round(time.periods))
    return 0 if rest else count


def harmonic(block: MemberBlock, level: int, quantity: str, back: int = 0) -> Complexes:
    """Return ``A exp(-i phase)`` of the period `back` before the last, shape (scheme, case); NaN if there is none."""
    record, n = block.records[level], samples_a_period(block)
    if quantity not in record or n == 0 or len(block.grid.t) - back * n <= n:
        return np.full(block.shape, np.nan, dtype=np.complex128)
    strides = block.grid.strides[block.grid.levels.index(level) :]
    n *= min(strides)
    series = take_all(block.grid, record, quantity)[..., :: strides[0] // min(strides)]
    if quantity not in block.model.positions and series.shape[-1] > 2 * n:
        change = series[..., -3:-1] - series[..., -3 - n : -1 - n]
        repeated = series[..., -1 - n] + (2.0 * change[..., 1] - change[..., 0])
        series = np.array(series)
        series[..., -1] = np.where(block.has_own_end(), series[..., -1], repeated)
    stop = series.shape[-1] - back * n
    samples = series[..., stop - n - 1 : stop]
    angle = 2.0 * np.pi / n * np.arange(n + 1)
    weight = np.where((angle == 0.0) | (angle == angle[-1]), 1.0 / n, 2.0 / n)
    real, imaginary = (
        np.sum(samples * weight * f(angle), axis=-1) for f in (on_arrays.cos, on_arrays.sin)
    )
    return np.asarray(real - 1j * imaginary)


def section(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return a quantity at the beginning of every period of the force (Poincare), shape (scheme, case, period).

    The end of the run begins no period: a scheme may find its velocity by another formula, with a larger error.
    """
    n = samples_a_period(block)
    if quantity not in block.records[level] or n == 0:
        return np.full((*block.shape, 0), np.nan)
    return take(block.grid, block.records[level], quantity)[..., :-1:n]


def is_angle(model: Model, group: Members, position: str, sizes: Mapping[str, Floats]) -> Flags:
    """Tell where a position matters, and accelerations are the same a turn further, shape (case,).

    They are compared at random states of the sizes of the motion, shape (case,) each.
    """
    accelerations = [tree(model, formula) for formula in model.accelerations]
    matters = any(position in formula.names for formula in accelerations)
    if position not in model.positions or not matters or model.lookup is not None:
        return np.zeros(len(group.end), dtype=bool)
    rng, shape = np.random.default_rng(21), (len(group.end), TESTS)
    states = (*model.positions, *model.velocities)
    numbers = {name: sizes[name][:, None] * rng.uniform(-1.0, 1.0, TESTS) for name in states}
    numbers |= {"t": rng.uniform(-1.0, 1.0, TESTS), **group.by_name(model)}
    found, moved = (
        np.stack([np.broadcast_to(x, shape) for x in values_of(accelerations, changed)])
        for changed in (numbers, {**numbers, position: numbers[position] + TURN})
    )
    same = np.abs(moved - found) <= SAME_AFTER_A_TURN * (1.0 + np.abs(found))
    return np.asarray(np.all(same, axis=(0, -1)))


def section_period(block: MemberBlock, level: int) -> Floats:
    """Return the period of the Poincare section in periods of the force, shape (scheme, case).

    It is taken from the second half of the run, in which every state must repeat to `SAME_STATE`, an angle up to whole
    turns. 0 if there is no period of at most half that time: the motion is chaotic, or not yet steady.
    """
    states = [state.name for state in block.model.states]
    rows = np.stack([section(block, level, name) for name in states])
    rows = rows[..., rows.shape[-1] // 2 :]
    period = np.zeros(block.shape)
    size = np.max(np.abs(rows), axis=-1, initial=0.0)
    sizes = dict(zip(states, np.max(size, axis=1), strict=True))
    is_turned = np.stack([is_angle(block.model, block.group, name, sizes) for name in states])
    turn = np.where(is_turned, TURN, np.inf)[:, None, :, None]
    size = np.minimum(size, 0.5 * turn[..., 0])
    for k in range(rows.shape[-1] // 2, 0, -1):
        change = rows[..., k:] - rows[..., :-k]
        with np.errstate(invalid="ignore"):
            whole = np.where(np.isinf(turn), 0.0, turn * np.round(change / turn))
        distance = np.max(np.abs(change - whole), axis=-1)
        period = np.where((distance <= SAME_STATE * size).all(axis=0), float(k), period)
    return np.where(np.isfinite(rows).all(axis=(0, -1)) & (rows.shape[-1] >= 2), period, np.nan)


def amplitude(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return the amplitude of the harmonic, in the unit of the quantity."""
    return np.asarray(np.abs(harmonic(block, level, quantity)))


def phase(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return the angle by which the harmonic lags behind ``cos(w t)`` [rad]."""
    c = harmonic(block, level, quantity)
    return wrapped(-on_arrays.atan2(c.imag, c.real))


def wrapped(angle: Floats) -> Floats:
    """Return angles in (-pi, pi]."""
    return np.asarray(angle - TURN * np.ceil((angle - np.pi) / TURN))


def continued(angle: Floats, to: Floats | float) -> Floats:
    """Return angles, by whole turns, within half a turn of others."""
    return np.asarray(angle - TURN * np.round((angle - to) / TURN))


def change(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return the change of the harmonic in the last period, relative to its amplitude."""
    now, before = (harmonic(block, level, quantity, back) for back in (0, 1))
    return safe_ratio(np.abs(now - before), np.abs(now))


def rounding(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return the size of changes of the harmonic that round-off explains, shape (scheme, case)."""
    series = take(block.grid, block.records[level], quantity)
    floor = block.floor_of(quantity, np.max(np.abs(series), axis=-1))
    return ROUNDINGS * floor[..., block.grid.levels.index(level)]


def distance(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return a bound of the distance of the harmonic from that of the steady motion, shape (scheme, case).

    The transient is multiplied by a complex factor z in each period, so that its last change c leaves ``c z/(z - 1)``.
    The larger of the last two such estimates is multiplied by `REST_SAFETY`. Infinite with fewer than `LEAST_PERIODS`.
    A change that `rounding` explains tells no factor. A transient that decays within the periods of the run then leaves
    at most this rounding times their number: its size over its change is the number of periods in which it decays.
    """
    noise, periods = rounding(block, level, quantity), block.experiment.time.periods or 0.0
    rows = [harmonic(block, level, quantity, back) for back in range(LEAST_PERIODS)]
    changes = [now - before for now, before in itertools.pairwise(rows)]
    with np.errstate(divide="ignore", invalid="ignore"):
        transients = [
            np.where(np.abs(last) <= noise, noise * periods, np.abs(last / (1.0 - before / last)))
            for last, before in itertools.pairwise(changes)
        ]
    bound = REST_SAFETY * np.maximum(*transients)
    return np.where(np.isfinite(bound), bound, np.inf)
