r"""Phase and amplitude of a position's error as quantities of their own, compared between levels like any other.

``<position>_phase_error`` is the time by which the computed motion is early, ``<position>_amplitude_error`` the part by
which its amplitude is too large, both against one and the same motion at every level (`vibsim.observe.waveform_fit`):
the exact one, where it is known, else the extrapolated one. Both vanish for the exact solution. A part that is not
found at some time, or at some level, does not exist for that scheme and member.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from vibsim.apriori.formal_orders import formal_orders, is_promised
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF, MEASUREMENT_FACTOR
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.experiment.storage import asked
from vibsim.formula import values
from vibsim.models import tree
from vibsim.models.shared.phase_amplitude_names import (
    AMPLITUDE,
    PHASE,
    has_error_parts,
    is_error_part,
    whole_of,
)
from vibsim.observe.member_block import MemberBlock
from vibsim.observe.oscillation import period_scale
from vibsim.observe.quintic_interpolant import template
from vibsim.observe.thresholds import MOST_UNASKED
from vibsim.observe.waveform_fit import shift, strides

if TYPE_CHECKING:
    from vibsim.comparison.quantity_comparison import Comparison


LONG_NAMES = {
    PHASE: "time by which {} is early",
    AMPLITUDE: "part by which the amplitude of {} is too large",
}

Make = Callable[..., "Comparison"]


def wanted(block: MemberBlock, names: tuple[str, ...]) -> tuple[str, ...]:
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
    block: MemberBlock, found: Mapping[str, Comparison], names: tuple[str, ...], make: Make
) -> dict[str, Comparison]:
    """Compare parts of errors between levels.

    Parameters
    ----------
    found
        The states, compared.
    names
        Of the parts.
    make
        Makes a `Comparison` of its fields.
    """
    parts: dict[str, Comparison] = {}
    for position in dict.fromkeys(map(whole_of, names)):
        told, floors, known = _told(block, found, position)
        between = _blur(block, told)
        for k, end in enumerate((PHASE, AMPLITUDE)):
            name = position + end
            if name not in names:
                continue
            scale = floors[k]
            parts[name] = make(
                block=block,
                name=name,
                long_name=LONG_NAMES[end].format(found[position].long_name),
                units="s" if end == PHASE else "1",
                values=[row[k] for row in told],
                exact=_nothing(known, told[0][k].shape) if known.any() else None,
                order=_order(block, name),
                floor=block.floor_of(name, scale)
                + MEASUREMENT_FACTOR / ABOVE_ROUND_OFF * between[k],
                scale=scale,
                blur=between[k],
            )
    return parts


def _order(block: MemberBlock, name: str) -> Floats:
    """Return the order by which a part is rescaled: the promised one where some check asks for the part.

    Where theory promises none it is that of the first check which expects one, else the position's. A claim that is
    known to be false, and a check that is to fail, expect none.
    """
    if is_promised(block.experiment, name) and name in asked(block.experiment):
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


def _told(
    block: MemberBlock, found: Mapping[str, Comparison], position: str
) -> tuple[list[tuple[Floats, Floats]], tuple[Floats, Floats], Flags]:
    """Return phase and amplitude at every level, the sizes their round-off is relative to, and if the truth is known.

    Shapes (scheme, case, t), (scheme, case) and (case,).
    """
    place = block.model.positions.index(position)
    states = [*block.model.positions, *block.model.velocities]
    shape = (*block.shape, len(block.grid.t))
    known = np.all([_is_known(found[name], shape) for name in states], axis=0)
    truth = {name: _truth(found[name], known, shape) for name in states}
    speed = block.model.velocities[place]
    push = _push(block, place, truth)
    period = np.broadcast_to(period_scale(block), block.shape)
    spacing = np.broadcast_to(block.grid.spacing, block.shape)
    u, v, a = (_rows(x) for x in (truth[position], truth[speed], push))
    of = template(u, v, a, spacing.ravel())
    stride = strides(period.ravel(), spacing.ravel(), shape[-1])
    told = []
    for level in range(len(block.grid.levels)):
        moved, moving = (_rows(found[name].values[level]) for name in (position, speed))
        one = shift(moved, moving, of, period.ravel(), stride)
        told.append((one.time.reshape(shape), one.factor.reshape(shape)))
    _all_or_none(told)
    rest, fastest = (_least(x, stride).reshape(block.shape) for x in (u, v))
    scale = found[position].scale
    return told, (scale / fastest, scale / rest), known


def _blur(block: MemberBlock, told: list[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    """Return what phase and amplitude are off by between samples of the true motion, shape (scheme, case, level).

    The quintic between two samples is off by ``(s (h - s))^3/720`` times the sixth derivative, s behind the one of them
    (`vibsim.observe.quintic_interpolant`). That is known, and no order of magnitude as round-off is.
    """
    w = (2.0 * np.pi / np.broadcast_to(period_scale(block), block.shape))[..., None]
    h = np.broadcast_to(block.grid.spacing, block.shape)[..., None]
    off = []
    for time, _ in told:
        behind = np.mod(np.where(np.isfinite(time), time, 0.0), h)
        off.append(np.max((w * behind) * (w * (h - behind)), axis=-1))
    amplitude = np.stack(off, axis=-1) ** 3 / 720.0
    return amplitude / w, amplitude


def _is_known(q: Comparison, shape: tuple[int, ...]) -> Flags:
    """Tell of which members the true values of a state are known, shape (case,)."""
    if q.exact is None:
        return np.zeros(shape[1], dtype=bool)
    return np.asarray(np.isfinite(np.broadcast_to(q.exact, shape)).all(axis=(0, 2)))


def _truth(q: Comparison, known: Flags, shape: tuple[int, ...]) -> Floats:
    """Return what a state should be, shape (scheme, case, t): the true values, or what the levels extrapolate to."""
    if q.exact is not None and known.all():
        return np.broadcast_to(q.exact, shape)
    best = np.broadcast_to(q.extrapolation[0], shape)
    return best if q.exact is None else np.where(known[:, None], q.exact, best)


def _nothing(known: Flags, shape: tuple[int, ...]) -> Floats:
    """Return 0, the true value of a part, of members whose truth is known, and NaN of others; shape (1, case, t)."""
    return np.broadcast_to(np.where(known, 0.0, np.nan)[None, :, None], (1, *shape[1:]))


def _rows(values: Floats) -> Floats:
    return np.ascontiguousarray(values.reshape(-1, values.shape[-1]))


def _push(block: MemberBlock, place: int, truth: Mapping[str, Floats]) -> Floats:
    """Return the acceleration of a coordinate along a motion, shape (scheme, case, t)."""
    model = block.model
    parameters = {row.name: block.group.parameters[row.key][:, None] for row in model.parameters}
    numbers = {**parameters, **truth, "t": block.grid.times(block.group.end)}
    shape = next(iter(truth.values())).shape
    return np.broadcast_to(values(tree(model, model.accelerations[place]), numbers), shape)


def _all_or_none(told: list[tuple[Floats, Floats]]) -> None:
    """Take a scheme and member out of all levels where a part of it is missing at one."""
    every = np.all([np.isfinite(time).all(axis=-1) for time, _ in told], axis=0)
    for pair in told:
        for values_ in pair:
            values_[~every] = np.nan


def _least(values: Floats, stride: Integers) -> Floats:
    """Return the smallest of the largest values within pieces as long as a window, shape (r,)."""
    found = np.full(len(values), np.nan)
    points = values.shape[-1]
    for row in np.flatnonzero(stride > 0).tolist():
        length = min(int(stride[row]) * 16, points)
        pieces = points // length
        size = np.abs(values[row, : pieces * length]).reshape(pieces, length)
        found[row] = np.min(np.max(size, axis=-1))
    return np.where(found > 0, found, np.nan)
