r"""Phase and amplitude of a position's error as quantities of their own, compared between levels like any other.

``<position>_phase_error`` is the time by which the computed motion is early, ``<position>_amplitude_error`` the part by
which its amplitude is too large, both against one and the same motion at every level (`vibsim.observe.waveform_fit`):
the exact one, where it is known, else the extrapolated one. Both vanish for the exact solution. A part that is not
found at some time, or at some level, does not exist for that scheme and member.
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
    """Return those of `names` that are parts, and of a small experiment the parts of every position.

    They are made of the states, and let a verdict on the position say which of the two is wrong.
    """
    named = [name for name in names if is_error_part(name)]
    schemes, cases = block.shape
    size = schemes * cases * len(block.grid.t) * len(block.grid.levels)
    small = not block.lean and len(block.grid.levels) > 2 and size <= MOST_UNASKED
    small &= {*block.model.positions, *block.model.velocities} <= {*names}
    more = block.model.positions if small and has_error_parts(block.model) else ()
    return tuple(
        dict.fromkeys([*named, *(name + end for name in more for end in (PHASE, AMPLITUDE))])
    )


def parts_of_errors(
    block: MemberBlock, found: Compared, names: tuple[str, ...]
) -> dict[str, Comparison]:
    """Compare the parts of errors with these names between levels; `found` are the states, compared."""
    parts: dict[str, Comparison] = {}
    for position in dict.fromkeys(map(whole_of, names)):
        levels, scales, known = _phase_and_amplitude(block, found, position)
        blurs = _blur(block, [time for time, _ in levels])
        # the true value of a part, where that of the motion is known
        exact = np.where(known, 0.0, np.nan)[None, :, None] if known.any() else None
        for k, (end, words, units) in enumerate(PARTS):
            name = position + end
            if name not in names:
                continue
            noise = MEASUREMENT_FACTOR / ABOVE_ROUND_OFF * blurs[k]
            parts[name] = Comparison(
                block=block,
                name=name,
                long_name=words.format(found[position].long_name),
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
    """Return the order by which a part is rescaled: the promised one where some check asks for the part.

    Where theory promises none it is that of the first check which expects one, else the position's. A claim that is
    known to be false, and a check that is to fail, expect none.
    """
    if is_promised(block.experiment, name) and name in checked_quantities(block.experiment):
        return formal_orders(block.experiment, name, block.columns)
    order = formal_orders(block.experiment, whole_of(name), block.columns).copy()
    for check in reversed(block.experiment.checks):
        inner = check.measured
        if inner.kind != "converges" or inner.converges != name or inner.order == "scheme":
            continue
        if inner.expect.status != "PASS" or (check.kind == "claim" and not check.holds):
            continue
        for s, scheme in enumerate(block.experiment.schemes):
            if inner.schemes is None or scheme.name in inner.schemes:
                order[s] = float(inner.order)
    order[block.adaptive] = np.nan
    return order


def _phase_and_amplitude(
    block: MemberBlock, found: Compared, position: str
) -> tuple[list[Floats], tuple[Floats, Floats], Flags]:
    """Return phase and amplitude at every level, the sizes their round-off is relative to, and if the truth is known.

    Shapes (2, scheme, case, t), (scheme, case) and (case,).
    """
    model, grid = block.model, block.grid
    place = model.positions.index(position)
    speed = model.velocities[place]
    shape = (*block.shape, len(grid.t))
    states = [found[name] for name in (*model.positions, *model.velocities)]
    known = np.ones(shape[1], dtype=bool)
    for q in states:
        known &= q.exact is not None and np.isfinite(np.broadcast_to(q.exact, shape)).all((0, 2))
    truth = {q.name: _truth(q, known, shape) for q in states}
    numbers = {**block.group.by_name(model), **truth, "t": grid.times(block.group.end)}
    push = values(tree(model, model.accelerations[place]), numbers)
    u, v, a = (_rows(x) for x in (truth[position], truth[speed], np.broadcast_to(push, shape)))
    period = np.broadcast_to(period_scale(block), block.shape).ravel()
    spacing = np.broadcast_to(grid.spacing, block.shape).ravel()
    of, stride = quintic_interpolant(u, v, a, spacing), strides(period, spacing, shape[-1])
    levels = []
    # a level of a few members costs as much as all of them together
    together = max(SAMPLES_AT_A_TIME // math.prod(shape), 1)
    for start in range(0, len(grid.levels), together):
        series = [found[name].values[start : start + together] for name in (position, speed)]
        moved, moving = (_rows(np.stack(rows)) for rows in series)
        count = len(series[0])
        scales = np.tile(period, count), np.tile(stride, count)
        parts = fit_shift(moved, moving, of.repeated(count), *scales)
        levels += list(np.moveaxis(parts.reshape(2, count, *shape), 1, 0))
    # what is missing at one level is taken out of all
    every = np.all([np.isfinite(time).all(axis=-1) for time, _ in levels], axis=0)
    for parts in levels:
        parts[:, ~every] = np.nan
    rest, fastest = (_least(x, stride).reshape(block.shape) for x in (u, v))
    scale = found[position].scale
    return levels, (scale / fastest, scale / rest), known


def _truth(q: Comparison, known: Flags, shape: tuple[int, ...]) -> Floats:
    """Return what a state should be, shape (scheme, case, t): the true values, or what the levels extrapolate to."""
    if q.exact is not None and known.all():
        return np.broadcast_to(q.exact, shape)
    best = np.broadcast_to(q.extrapolation[0], shape)
    return best if q.exact is None else np.where(known[:, None], q.exact, best)


def _blur(block: MemberBlock, times: list[Floats]) -> tuple[Floats, Floats]:
    """Return what phase and amplitude are off by between samples of the true motion, shape (scheme, case, level).

    The quintic between two samples is off by ``(s (h - s))^3/720`` times the sixth derivative, s behind the one of them
    (`vibsim.observe.waveform_fit`). That is known, and no order of magnitude as round-off is.
    """
    w = (2.0 * np.pi / np.broadcast_to(period_scale(block), block.shape))[..., None]
    h = np.broadcast_to(block.grid.spacing, block.shape)[..., None]
    rows = []
    for time in times:
        behind = np.mod(np.where(np.isfinite(time), time, 0.0), h)
        rows.append(np.max((w * behind) * (w * (h - behind)), axis=-1))
    largest = np.stack(rows, axis=-1)
    amplitude = largest * largest * largest / 720.0
    return amplitude / w, amplitude


def _rows(series: Floats) -> Floats:
    return np.ascontiguousarray(series.reshape(-1, series.shape[-1]))


def _least(series: Floats, stride: Integers) -> Floats:
    """Return the smallest of the largest values within pieces as long as a window, shape (r,)."""
    found = np.full(len(series), np.nan)
    points = series.shape[-1]
    for row in np.flatnonzero(stride > 0).tolist():
        length = min(int(stride[row]) * (WINDOW_POINTS - 1), points)
        pieces = points // length
        size = np.abs(series[row, : pieces * length]).reshape(pieces, length)
        found[row] = np.min(np.max(size, axis=-1))
    return np.where(found > 0, found, np.nan)
