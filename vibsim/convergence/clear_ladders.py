"""Ladders so clear that hypotheses with up to a thousandth of all evidence cannot change the verdict.

This saves time and decides nothing: `assessment.decide` judges all other ladders in full.
"""

from __future__ import annotations

import numpy as np

from vibsim.convergence.best_value import norm
from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.error_model.posterior import Posterior, posterior
from vibsim.convergence.evaluation import Evaluation
from vibsim.convergence.likely_powers import OUTSIDE, most_near_a_power, tails, windows_of_three
from vibsim.convergence.question import Question
from vibsim.convergence.thresholds import DEFINITE, RISK, THREE_DECIDE
from vibsim.core.array_types import Flags
from vibsim.elementary import on_arrays

ROUGH_LEFT_OUT = 1e-3
"""Largest part of all evidence that is skipped."""
MEETS_WITHIN = 0.1
"""An extrapolation this near the exact solution, relative to the error of the finest level, surely does not miss it."""


def is_sure(ladder: Ladder, evaluation: Evaluation, question: Question) -> Flags:
    """Say where the skipped hypotheses cannot change the verdict.

    Then no probability is within `ROUGH_LEFT_OUT` of its threshold. Also, either the extrapolation by the order of the
    finest levels is so near the exact solution that no other one misses it, or the levels show no order.
    """
    p, (lower, right, higher) = evaluation.posterior, evaluation.sides
    remaining, fails = 1.0 - p.noise - p.alternating, lower + higher > 0.5
    definite = np.zeros_like(right)
    definite[fails] = most_near_a_power(p)[fails]
    margins = [
        right - (1.0 - RISK),
        lower + higher - (1.0 - RISK),
        np.where(fails, lower - higher, 1.0),
        definite - DEFINITE,
        p.noise - np.maximum(remaining, p.alternating),
        p.alternating - remaining,
        *(np.min(np.abs(tail - OUTSIDE), axis=-1) * p.expansion for tail in tails(p)),
    ]
    window = np.sort(p.window, axis=-1)
    if window.shape[1] > 1:
        margins += [window[:, -1] - window[:, -2], windows_of_three(p) - THREE_DECIDE]
    sure: Flags = np.all(np.abs(margins) > ROUGH_LEFT_OUT, axis=0) & ~evaluation.cut_short
    sure &= ~(evaluation.rests_on_three & (fails | (not evaluation.exact_known)))
    if ladder.exact_known:
        unclear = np.flatnonzero(sure & ~_meets(ladder, p))
        if len(unclear):
            levels = ladder.some(unclear).without_exact()
            levels_only = posterior(levels, question.expected_order, left_out=ROUGH_LEFT_OUT)
            sure[unclear] = levels_only.expansion < 1.0 - RISK - ROUGH_LEFT_OUT
    return sure


def _meets(ladder: Ladder, p: Posterior) -> Flags:
    """Say where the extrapolation by the order of the finest levels almost equals the exact solution."""
    order, ratio = p.orders[:, -1], ladder.h[-2] / ladder.h[-1]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        gain = 1.0 / (on_arrays.power(ratio, order) - 1.0)
        distance = norm(np.stack([-gain, np.ones_like(gain)], axis=-1), ladder.gram[:, -2:, -2:])
        near = distance <= MEETS_WITHIN * gain * np.sqrt(ladder.gram[:, -2, -2])
    ends = np.array(p.windows)[np.argmax(p.window, axis=-1), 1]
    return np.asarray((order > 0.0) & near & (ends == len(ladder.h) - 1))
