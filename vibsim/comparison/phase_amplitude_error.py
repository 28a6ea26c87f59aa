r"""Phase and amplitude parts of the error of a position, as quantities that are compared between levels.

``<position>_phase_error`` is the time by which the computed motion is early, ``<position>_amplitude_error`` the
relative excess of its amplitude. The reference is the same at each level (`vibsim.observe.waveform_fit`): the exact
motion if it is known, otherwise the extrapolated one. Both parts vanish for the exact solution. If a part cannot be
determined at some time or level, it does not exist for that scheme and member.
"""

from __future__ import annotations

import math

import numpy as np

from vibsim.apriori.formal_orders import formal_orders, is_promised
from vibsim.comparison.quantity_comparison import Compared, Comparison
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF, MEASUREMENT_FACTOR
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.vocabulary import AMPLITUDE, PHASE, is_error_part, whole_of
from vibsim.experiment.storage import checked_quantities
from vibsim.formula import values
from vibsim.models import tree
from vibsim.models.base import has_error_parts
from vibsim.observe.member_block import MemberBlock
from vibsim.observe.oscillation import period_scale
from vibsim.observe.thresholds import MOST_UNASKED, WINDOW_POINTS
from vibsim.observe.waveform_fit import SAMPLES_AT_A_TIME, fit_shift, quintic_interpolant, strides

PARTS = (
    (PHASE, "time by which {} is early", "s"),
    (AMPLITUDE, "part by which the amplitude of {} is too large", "1"),
)


def error_parts_to_compare(block: MemberBlock, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the parts of errors among `names`, and in a small experiment also the parts of all positions.

    The latter let a verdict on the position say which of the two parts is wrong.
    """
    named = [name for name in names if is_error_part(name)]
    schemes, cases = block.shape
    size = schemes * cases * len(block.grid.t) * len(block.grid.levels)
    is_small = not block.lean and len(block.grid.levels) > 2 and size <= MOST_UNASKED
    is_small &= {*block.model.positions, *block.model.velocities} <= {*names}
    unnamed = block.model.positions if is_small and has_error_parts(block.model) else ()
    return tuple(
        dict.fromkeys([*named, *(name + end for name in unnamed for end in (PHASE, AMPLITUDE))])
    )


def parts_of_errors(
    block: MemberBlock, compared: Compared, names: tuple[str, ...]
) -> dict[str, Comparison]:
    """Compare the parts of errors with these names between levels; `compared` are the states, compared."""
    parts: dict[str, Comparison] = {}
    for position in dict.fromkeys(map(whole_of, names)):
        levels, scales, known = _phase_and_amplitude(block, compared, position)
        blurs = _blur(block, [time for time, _ in levels])
        # a part is 0 for the exact motion, if that is known
        exact = np.where(known, 0.0, np.nan)[None, :, None] if known.any() else None
        for k, (end, words, units) in enumerate(PARTS):
            name = position + end
            if name not in names:
                continue
            noise = MEASUREMENT_FACTOR / ABOVE_ROUND_OFF * blurs[k]
            parts[name] = Comparison(
                block=block,
                name=name,
                long_name=words.format(compared[position].long_name),
                units=units,
                values=[level[k] for level in levels],
                exact=None
                if exact is None
                else np.broadcast_to(exact, (1, *levels[0][k].shape[1:])),
                order=_order(block, name),
                floor=block.floor_of(name, scales[k]) + noise,
                scale=scales[k],
                blur=blurs[k],
            )
    return parts


def _order(block: MemberBlock, name: str) -> Floats:
    """Return the order by which a part is rescaled: the promised one if a check uses the part.

    If theory promises none, it is that of the first check that expects one, or else that of the position. False claims
    and checks that must fail do not count.
    """
    if is_promised(block.experiment, name) and name in checked_quantities(block.experiment):
        return formal_orders(block.experiment, name, block.columns)
    order = formal_orders(block.experiment, whole_of(name), block.columns).copy()
    for check in reversed(block.experiment.checks):
        measured = check.measured
        if measured.kind != "converges" or measured.converges != name or measured.order == "scheme":
            continue
        if measured.expect.status != "PASS" or (check.kind == "claim" and not check.holds):
            continue
        for s, scheme in enumerate(block.experiment.schemes):
            if measured.schemes is None or scheme.name in measured.schemes:
                order[s] = float(measured.order)
    order[block.adaptive] = np.nan
    return order


def _phase_and_amplitude(
    block: MemberBlock, compared: Compared, position: str
) -> tuple[list[Floats], tuple[Floats, Floats], Flags]:
    """Return phase and amplitude at each level, the scales of their round-off, and where the exact motion is known.

    Shapes (2, scheme, case, t), (scheme, case) and (case,).
    """
    model, grid = block.model, block.grid
    index = model.positions.index(position)
    speed = model.velocities[index]
    shape = (*block.shape, len(grid.t))
    states = [compared[name] for name in (*model.positions, *model.velocities)]
    known = np.ones(shape[1], dtype=bool)
    for q in states:
        known &= q.exact is not None and np.isfinite(np.broadcast_to(q.exact, shape)).all((0, 2))
    truth = {q.name: _truth(q, known, shape) for q in states}
    numbers = {**block.group.by_name(model), **truth, "t": grid.times(block.group.end)}
    force = values(tree(model, model.accelerations[index]), numbers)
    u, v, a = (_rows(x) for x in (truth[position], truth[speed], np.broadcast_to(force, shape)))
    period = np.broadcast_to(period_scale(block), block.shape).ravel()
    spacing = np.broadcast_to(grid.spacing, block.shape).ravel()
    interpolant, stride = quintic_interpolant(u, v, a, spacing), strides(period, spacing, shape[-1])
    levels = []
    # for a few members one level costs as much as all levels at once
    chunk = max(SAMPLES_AT_A_TIME // math.prod(shape), 1)
    for start in range(0, len(grid.levels), chunk):
        series = [compared[name].values[start : start + chunk] for name in (position, speed)]
        positions, velocities = (_rows(np.stack(rows)) for rows in series)
        count = len(series[0])
        scales = np.tile(period, count), np.tile(stride, count)
        parts = fit_shift(positions, velocities, interpolant.repeated(count), *scales)
        levels += list(np.moveaxis(parts.reshape(2, count, *shape), 1, 0))
    # parts that are missing at one level are removed from all
    complete = np.all([np.isfinite(time).all(axis=-1) for time, _ in levels], axis=0)
    for parts in levels:
        parts[:, ~complete] = np.nan
    least_position, least_speed = (_least(x, stride).reshape(block.shape) for x in (u, v))
    scale = compared[position].scale
    return levels, (scale / least_speed, scale / least_position), known


def _truth(q: Comparison, known: Flags, shape: tuple[int, ...]) -> Floats:
    """Return the reference values of a state, exact or, if unknown, extrapolated; shape (scheme, case, t)."""
    if q.exact is not None and known.all():
        return np.broadcast_to(q.exact, shape)
    best = np.broadcast_to(q.extrapolation[0], shape)
    return best if q.exact is None else np.where(known[:, None], q.exact, best)


def _blur(block: MemberBlock, times: list[Floats]) -> tuple[Floats, Floats]:
    """Return the interpolation errors of phase and amplitude, shape (scheme, case, level).

    The quintic between two samples of the reference has the error ``(s (h - s))^3/720`` times the sixth derivative, at
    the distance s after the first one (`vibsim.observe.waveform_fit`). Unlike round-off this is an accurate value.
    """
    w = (2.0 * np.pi / np.broadcast_to(period_scale(block), block.shape))[..., None]
    h = np.broadcast_to(block.grid.spacing, block.shape)[..., None]
    rows = []
    for time in times:
        offset = np.mod(np.where(np.isfinite(time), time, 0.0), h)
        rows.append(np.max((w * offset) * (w * (h - offset)), axis=-1))
    largest = np.stack(rows, axis=-1)
    amplitude = largest * largest * largest / 720.0
    return amplitude / w, amplitude


def _rows(series: Floats) -> Floats:
    return np.ascontiguousarray(series.reshape(-1, series.shape[-1]))


def _least(series: Floats, stride: Integers) -> Floats:
    """Return the minimum over windows of the maximum within each window, shape (r,)."""
    result = np.full(len(series), np.nan)
    points = series.shape[-1]
    for row in np.flatnonzero(stride > 0).tolist():
        length = min(int(stride[row]) * (WINDOW_POINTS - 1), points)
        pieces = points // length
        size = np.abs(series[row, : pieces * length]).reshape(pieces, length)
        result[row] = np.min(np.max(size, axis=-1))
    return np.where(result > 0, result, np.nan)
