"""The thresholds of verdicts: value, meaning and origin.

The origin stands in brackets:

- *derived*: it follows from the expansion of the error, or from floating-point arithmetic;
- *calibrated*: set on random ladders with known truth (``tests/analysis/synthetic.py``), of the seeds that
  ``docs/method.md``, Calibration, names. The tables there are for other seeds, which set none;
- *convention*: a usual value of the field, or a chosen one.

The priors of the error model are in ``error_model/priors.py``, the thresholds of error bars in
``extrapolation/thresholds.py``. A *floor* is a predicted round-off error.
"""

from __future__ import annotations

import math

# ---- Expansions

HALF_SPACING = 0.25  # orders closer than this are equal: half the spacing of the orders of expansions [derived]
LOWEST_ORDER = 0.5  # lowest order of an expansion [derived]
LEAST_WITH_LIMIT = LOWEST_ORDER - HALF_SPACING  # slower decay does not indicate a limit [derived]
SUPERCONVERGENCE = 2.0  # a superconvergent quantity gains at most the next even power [derived]
ORDINARY_ORDER = 2.0  # order assumed if a scheme promises none, or exactness [convention]
STEEPEST = 64.0  # measured orders lie between -STEEPEST and STEEPEST [convention]
# Smallest ratio of the step sizes that a verdict of `judge` rests on; levels closer together are left out. The two
# powers of the error model leave a smooth remainder. At close levels it is not the independent misfit that the model
# assumes, so their many differences would make any order seem certain. [calibrated]
LEAST_RATIO = 1.4
PEAKS = 4  # in cosines of the largest norm a point has the weight of its relative size to this power [convention]

# ---- Round-off

ABOVE_ROUND_OFF = 100.0  # a difference this factor above its floor is not round-off [convention]
ROUND_OFF_SAFETY = 10.0  # actual round-off is at most this factor times its floor [convention]
# A difference below this multiple of the known measurement error is attributed to the measurement. [derived]
MEASUREMENT_FACTOR = 2.0
EXACT_DIFFERENCE = 1e-10  # largest difference of an exact scheme, over the solution [convention]
EXACT_ACCURACY = 1e-12  # assumed accuracy of an exact solution, relative to its size [convention]
# An ordinary error, (w dt)^p at the coarsest level, is visible if it exceeds `ABOVE_ROUND_OFF` floors by this factor.
# [calibrated]
VISIBLE_ERROR = 1e4
# A solution that changes by more than this part of its size is not at rest. [convention]
STILL = 0.1
# All finer levels together change a number by at most this multiple of its last change (2.4 for an order of 1/2).
# [derived]
STILL_TO_CHANGE = 3.0
FLOOR_DECLINE = 0.5  # round-off differences stay above this part of the previous one [calibrated]

# ---- Decisions by the error model

RISK = 0.01  # accepted probability that a verdict is wrong [convention]
RISK_OF_THREE = 0.1 * RISK  # the same for three levels that coarser ones do not fit [calibrated]
THREE_DECIDE = 0.5  # probability of windows of such three levels, above which they decide [derived]
# An order fails only if one power, dominating or mixed, has at least this probability. [calibrated]
DEFINITE = 0.9
ORDER_INTERVAL = 0.95  # probability of the interval of an order [convention]
# Standard deviations in the bound of a best value; given the tails of the posterior, they cover 95 %. [calibrated]
BEST_BOUND = 3.0
# The exact solution is missed if its distance from the best value exceeds this number of bounds, and this part of the
# estimated error of the finest level. [calibrated]
MISSED, MISSED_SHARE = 3.0, 0.5
# With at least this number of levels, whose differences fall, an exact solution is missed at any order if it is this
# factor further away than the levels have moved and can still move. [convention]
MISSED_FAR, MISSED_FAR_LEVELS = 5.0, 4
# Largest ratio of actual to predicted noise for which levels count as equal; the same for noise that a user states:
# differences of normal noise exceed it in one of 200 cases. [convention]
NOISE_FACTOR, STATED_NOISE_FACTOR = 10.0, 2.0
# Extra factor for pairs of non-adjacent levels: there are more of them, so the largest difference is larger. Of ten
# normal numbers two are more than 5 standard deviations apart in one of 70 cases. [derived]
NON_ADJACENT_FACTOR = 1.25
# `STATED_NOISE_FACTOR` for the distance of one level from an exact solution: the noise of a level is smaller than that
# of a difference by the root of 2. [derived]
STATED_LIMIT_FACTOR = 2.0 * STATED_NOISE_FACTOR / math.sqrt(2.0)

# ---- Facts from outside a ladder

LIMIT_ROUNDING = 1e-9  # relative distance within which w dt is at a stability limit [convention]
BLOWN_UP = 10.0  # a solution has grown if it is this factor larger than the exact one [convention]
# Refinement removes growth if one level more leaves less than this part of it, as of an error of order 1. [derived]
GROWTH_REMOVED = 0.5
# Factor between the largest speeds of levels above which the force may be infinite somewhere: those of a chaotic motion
# are alike. [convention]
UNEVEN_SPEEDS = 2.0
RESOLVED_DECAY = 1.0  # longest resolved step, over the time constant of a decay [derived]
ERROR_STAYED = 0.5  # part of the coarsest error above which the finest one stays [derived]

# ---- A promised order behind a higher one

HIDDEN_SHARE = 1e-6  # a smaller part like h^(p-1) needs 20 levels to dominate [derived]
HIGHER_POWERS = 4  # largest number of higher powers that are eliminated [convention]
