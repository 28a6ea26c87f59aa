"""Why an order is another one than expected, as far as the data and the theory of schemes tell.

Too low: is it one time (the last point, which has a formula of its own), one quantity, or everything? Too high: is
it the whole solution, or is the leading error hidden: at times where it vanishes by symmetry, in one quantity, in one
norm? An error that is cancelled there is no mistake, and no higher order either.

Most of an error of an oscillation is a shift in time, ``e(t) = -s(t) u'(t)``: it vanishes wherever u' does. Common
times that all lie at turning points (Dt = pi/w after a release from rest) therefore show the next power only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

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
from vibsim.observe.member_block import stored

CAUSES = (
    *("none", "last_point", "one_quantity", "everything", "special_times", "one_norm", "theory"),
    *("stored", "still", "pulse", "noise", "decay"),
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
    q, others
        The quantity, compared between levels, and the quantities beside it.
    judged
        The verdict on it.
    norm, order, tolerance
        The norm, the expected order (which broadcasts against (scheme, case)) and its tolerance.
    """
    shape = judged.reason.shape
    found = np.full(shape, NONE, dtype=np.int8)

    def has(*reasons: str) -> Flags:
        return np.isin(judged.reason, [REASON_NAMES.index(word) for word in reasons])

    low, high, lost, unseen = has("order_low"), has("order_high"), has("round_off"), has(*UNSEEN)
    coarse = has("pre_asymptotic")
    if np.any(lost | unseen | coarse):
        e = evidence(q, norm, order, tolerance)
        found[lost & (e.difference[..., -1] > ABOVE_ROUND_OFF * floor_of_pairs(e)[..., -1])] = NOISE
        if q.block.stored_floor[-1] > 0.0:
            found[lost] = STORED
        found[unseen & at_rest(e)] = STILL
        found[coarse & unresolved(e) & (found == NONE)] = DECAY
    found[has(*ROUGH) & np.isfinite(q.block.missed.time)] = PULSE
    if not np.any(low | high):
        return found
    wanted, model = np.broadcast_to(order, shape), q.block.model
    beside = [state.name for state in model.states if state.name != q.name and state.name in others]

    def near(of: Comparison, kind: str, order: Floats) -> Flags:
        with np.errstate(invalid="ignore"):
            return np.asarray(np.abs(judgement(of, kind).order - order) <= tolerance)

    def is_usual(names: Iterable[str]) -> Flags:
        """Say where one of other states has the expected order."""
        return np.asarray(np.any([near(others[name], norm, wanted) for name in names], axis=0))

    def is_alike() -> Flags:
        """Say where every state has the order of the quantity: one of which nothing is known need not."""
        return np.asarray(
            np.all([near(others[name], norm, judged.order) for name in beside], axis=0)
        )

    if np.any(low):
        inside = near(q, "linf_interior", wanted) & (norm != "linf_interior")
        kinds = [(inside, LAST_POINT), (is_usual(beside), ONE_QUANTITY), (is_alike(), EVERYTHING)]
        found = np.where(low, _first(kinds, shape), found)
    if np.any(high):
        # frequency and growth are those of the position: one of the expected order says that they are not the cause
        positions = [name for name in beside if name in model.positions]
        in_other_norm = [near(q, other, wanted) for other in NORMS if other != norm]
        same = np.all([near(q, other, judged.order) for other in NORMS], axis=0)
        kinds = [
            (_at_rest(q, others), SPECIAL_TIMES),
            (_in_theory(q, judged) & ~is_usual(positions), THEORY),
            (np.any(in_other_norm, axis=0), ONE_NORM),
            (is_usual(beside), ONE_QUANTITY),
            (is_alike() & same, EVERYTHING),
        ]
        found = np.where(high, _first(kinds, shape), found)
    return found.astype(np.int8)


def _first(kinds: list[tuple[Flags, int]], shape: tuple[int, ...]) -> Codes:
    """Return the first cause that applies, `NONE` where none is seen."""
    masks = [np.broadcast_to(mask, shape) for mask, _ in kinds]
    return np.asarray(np.select(masks, [code for _, code in kinds], NONE), dtype=np.int8)


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
    # over every step; data of other programs do not tell
    low, high = (stored(block.finest, f"{name}_{end}", block.shape) for end in ("min", "max"))
    most = np.maximum(np.abs(low), np.abs(high))
    with np.errstate(invalid="ignore"):
        return np.asarray((most > 0) & (largest(rate) <= VANISHING_RATE * most))


def _in_theory(q: Comparison, judged: Judgement) -> Flags:
    """Say where the theory of the scheme has the measured order too: of its frequency and its growth."""
    block, theory = q.block, predicted_oscillation
    if not theory.is_simple(block) or len(block.grid.levels) < 2:
        return np.zeros(block.shape, dtype=bool)
    coarse, fine = block.grid.levels[-2:]
    # a phase error in units of 1/w: a time would be small in small units alone
    w = theory.natural_frequency(block)
    phases = [theory.phase_error(block, level) * w for level in (coarse, fine)]
    growths = [theory.growth_per_period(block, level) - 1.0 for level in (coarse, fine)]
    orders = []
    for found in (phases, growths):
        errors = np.abs(found)
        with np.errstate(divide="ignore", invalid="ignore"):
            fall = np.log2(safe_ratio(errors[0], errors[1])) / (fine - coarse)
        exact = np.all(errors <= THEORY_ROUNDING, axis=0)
        orders.append(np.where(exact, np.inf, fall))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(np.minimum(*orders) - judged.order) <= HALF_SPACING)
