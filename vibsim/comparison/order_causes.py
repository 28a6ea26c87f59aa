"""Why an order is another one than expected, as far as the data and the theory of schemes tell.

Too low: is it one time (the last point, which has a formula of its own), one quantity, or everything? Too high: is
it the whole solution, or is the leading error hidden: at times where it vanishes by symmetry, in one quantity, in one
norm? An error that is cancelled there is no mistake, and no higher order either.

Most of an error of an oscillation is a shift in time, ``e(t) = -s(t) u'(t)``: it vanishes wherever u' does. Common
times that all lie at turning points (Dt = pi/w after a release from rest) therefore show the next power only.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vibsim.comparison.order_evidence import evidence, judgement
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.comparison.thresholds import THEORY_ROUNDING, VANISHING_RATE
from vibsim.convergence.differences import largest, safe_ratio
from vibsim.convergence.ladder_statistics import at_rest, floor_of_pairs, unresolved
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF, HALF_SPACING
from vibsim.convergence.verdict import Judgement
from vibsim.core.array_types import Codes, Flags, Floats
from vibsim.core.vocabulary import NORMS, REASON_NAMES
from vibsim.observe import predicted_oscillation
from vibsim.observe.member_block import MemberBlock

CAUSES = (
    "none",
    "last_point",
    "one_quantity",
    "everything",
    "special_times",
    "one_norm",
    "theory",
    "stored",
    "still",
    "pulse",
    "noise",
    "decay",
)
"""What was found; files hold a position here."""

NONE, LAST_POINT, ONE_QUANTITY, EVERYTHING, SPECIAL_TIMES, ONE_NORM, THEORY = range(7)
STORED, STILL, PULSE, NOISE, DECAY = range(7, len(CAUSES))

UNSEEN = ("pre_asymptotic", "not_applicable")
"""What is said of a motion that lies still wherever levels are compared."""
ROUGH = ("pre_asymptotic", "non_smooth")
"""What is said where the force has a pulse that no level sees."""


def causes(
    q: Comparison,
    others: Mapping[str, Comparison],
    judged: Judgement,
    norm: str,
    order: Floats,
    tolerance: float,
) -> Codes:
    """Return why orders are too low, too high, or not seen, as positions in `CAUSES`, shape (scheme, case).

    Parameters
    ----------
    q
        The quantity, compared between levels.
    others
        The quantities beside it.
    judged
        The verdict on it.
    norm, order, tolerance
        The norm, the expected order (which broadcasts against (scheme, case)) and its tolerance.
    """
    shape = judged.reason.shape
    found = np.full(shape, NONE, dtype=np.int8)
    low, high = (judged.reason == REASON_NAMES.index(word) for word in ("order_low", "order_high"))
    wanted = np.broadcast_to(order, shape)
    lost = judged.reason == REASON_NAMES.index("round_off")
    if np.any(lost):
        e = evidence(q, norm, order, tolerance)
        found[lost & (e.difference[..., -1] > ABOVE_ROUND_OFF * floor_of_pairs(e)[..., -1])] = NOISE
    if q.block.stored_floor[-1] > 0.0:
        found[lost] = STORED
    unseen = np.isin(judged.reason, [REASON_NAMES.index(word) for word in UNSEEN])
    if np.any(unseen):
        found[unseen & at_rest(evidence(q, norm, order, tolerance))] = STILL
    coarse = judged.reason == REASON_NAMES.index("pre_asymptotic")
    if np.any(coarse):
        coarse &= unresolved(evidence(q, norm, order, tolerance))
        found[coarse & (found == NONE)] = DECAY
    rough = np.isin(judged.reason, [REASON_NAMES.index(word) for word in ROUGH])
    found[rough & np.isfinite(q.block.missed.time)] = PULSE
    if not np.any(low | high):
        return found
    beside = _other_states(q, others, norm, tolerance, wanted)
    positions = {name: others[name] for name in q.block.model.positions if name in others}
    of_positions = q, positions, norm, tolerance, wanted
    if np.any(low):
        inside = _near(judgement(q, "linf_interior"), wanted, tolerance)
        same = _alike(q, others, judged, norm, tolerance)
        kinds = [(inside & (norm != "linf_interior"), LAST_POINT), (beside, ONE_QUANTITY)]
        found = np.where(low, _first([*kinds, (same, EVERYTHING)], shape), found)
    if np.any(high):
        kinds = [
            (_at_rest(q, others), SPECIAL_TIMES),
            # frequency and growth are those of the position: one of the expected order says that they are not the cause
            (_in_theory(q, judged) & ~_other_states(*of_positions), THEORY),
            (_other_norms(q, norm, wanted, tolerance), ONE_NORM),
            (beside, ONE_QUANTITY),
            (
                _alike(q, others, judged, norm, tolerance) & _same_norms(q, judged, tolerance),
                EVERYTHING,
            ),
        ]
        found = np.where(high, _first(kinds, shape), found)
    return found.astype(np.int8)


def _first(kinds: list[tuple[Flags, int]], shape: tuple[int, ...]) -> Codes:
    """Return the first cause that applies, `NONE` where none is seen."""
    masks = [np.broadcast_to(mask, shape) for mask, _ in kinds]
    return np.asarray(np.select(masks, [code for _, code in kinds], NONE), dtype=np.int8)


def _near(judged: Judgement, order: Floats, tolerance: float) -> Flags:
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(judged.order - order) <= tolerance)


def _other_states(
    q: Comparison, others: Mapping[str, Comparison], norm: str, tolerance: float, order: Floats
) -> Flags:
    """Say where a state other than the quantity has the expected order."""
    names = [state.name for state in q.block.model.states if state.name != q.name]
    found = np.zeros(q.block.shape, dtype=bool)
    for name in names:
        if name in others:
            found |= _near(judgement(others[name], norm), order, tolerance)
    return found


def _other_norms(q: Comparison, norm: str, order: Floats, tolerance: float) -> Flags:
    """Say where the quantity has the expected order in another norm."""
    found = np.zeros(q.block.shape, dtype=bool)
    for other in NORMS:
        if other != norm:
            found |= _near(judgement(q, other), order, tolerance)
    return found


def _alike(
    q: Comparison, others: Mapping[str, Comparison], judged: Judgement, norm: str, tolerance: float
) -> Flags:
    """Say where every state has the order of the quantity: one of which nothing is known need not."""
    found = np.ones(q.block.shape, dtype=bool)
    for state in q.block.model.states:
        if state.name != q.name and state.name in others:
            found &= _near(judgement(others[state.name], norm), judged.order, tolerance)
    return found


def _same_norms(q: Comparison, judged: Judgement, tolerance: float) -> Flags:
    """Say where the quantity has the same order in every norm."""
    found = np.ones(q.block.shape, dtype=bool)
    for other in NORMS:
        found &= _near(judgement(q, other), judged.order, tolerance)
    return found


def _at_rest(q: Comparison, others: Mapping[str, Comparison]) -> Flags:
    """Say where the rate of change of a state vanishes at every common time, but not between them."""
    block, model = q.block, q.block.model
    name = ""
    if q.name in model.positions:
        name = model.velocities[model.positions.index(q.name)]
    elif q.name in model.velocities and model.linear and model.conservative:
        # u'' = -w^2 u
        name = model.positions[model.velocities.index(q.name)]
    if name not in others:
        return np.zeros(block.shape, dtype=bool)
    rate = others[name].exact
    if rate is None:
        rate = others[name].extrapolation[0]
    most = _largest(block, name)
    with np.errstate(invalid="ignore"):
        return np.asarray((most > 0) & (largest(rate) <= VANISHING_RATE * most))


def _largest(block: MemberBlock, name: str) -> Floats:
    """Return the largest absolute value of a state over every step; NaN where data of other programs do not tell."""
    if f"{name}_min" not in block.finest or f"{name}_max" not in block.finest:
        return np.full(block.shape, np.nan)
    low, high = (np.abs(np.asarray(block.finest[f"{name}_{which}"])) for which in ("min", "max"))
    return np.asarray(np.maximum(low, high))


def _in_theory(q: Comparison, judged: Judgement) -> Flags:
    """Say where the theory of the scheme has the measured order too: of its frequency and its growth."""
    block = q.block
    if not predicted_oscillation.is_simple(block) or len(block.grid.levels) < 2:
        return np.zeros(block.shape, dtype=bool)
    coarse, fine = block.grid.levels[-2:]
    orders = []
    for of in (_phase, _growth):
        errors = [np.abs(of(block, level)) for level in (coarse, fine)]
        with np.errstate(divide="ignore", invalid="ignore"):
            fall = np.log2(safe_ratio(errors[0], errors[1])) / (fine - coarse)
        exact = (errors[0] <= THEORY_ROUNDING) & (errors[1] <= THEORY_ROUNDING)
        orders.append(np.where(exact, np.inf, fall))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(np.minimum(*orders) - judged.order) <= HALF_SPACING)


def _phase(block: MemberBlock, level: int) -> Floats:
    """Return the phase error in units of 1/w: a time would be small in small units alone."""
    return predicted_oscillation.phase_error(
        block, level
    ) * predicted_oscillation.natural_frequency(block)


def _growth(block: MemberBlock, level: int) -> Floats:
    return np.asarray(predicted_oscillation.growth_per_period(block, level) - 1.0)
