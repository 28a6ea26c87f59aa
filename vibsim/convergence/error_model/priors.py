"""The constants of the error model: value, meaning and origin.

Origins: [expansion] follows from expansions of the error. [arithmetic] follows from double precision. [chosen] is a
prior that was written down before any ladder was judged. [calibrated] was set on seeds 1 and 3 of the random ladders
with known truth (``tests/analysis/synthetic.py``). Except for `POINTS` and `MISFIT`, doubling or halving one of these
numbers hardly changes the counts there. Rows are differences of successive levels; *free* ones have unrelated sizes.
"""

from __future__ import annotations

import numpy as np

# ---- Powers of an expansion

POINTS = 2.0  # independent points of a series or field, and 1 of a number: `kernel` has no other [calibrated]
POWERS = (*(0.5 * k for k in range(1, 11)), 6.0, 7.0, 8.0)  # powers of expansions [expansion]
MAX_POWER = 8.0  # largest power of the hypothesis of any power [chosen]
ANY_POWER_PRIOR = 0.1  # prior of one power of any value up to `MAX_POWER` [chosen]
SPACING = 0.05  # spacing of the grid on which such powers are counted [chosen]
_POSITIVE = 3e-4 * 2.0 ** np.arange(9)
# Offsets from the measured order at which such a power is sampled. [chosen]
OFFSETS = np.concatenate([-_POSITIVE[::-1], [0.0], _POSITIVE])
# Standard deviation, between the finest level and the limit, of a power that is not within half a `SPACING` of one of
# `POWERS`: it may stand for two close powers. Three of them are half of `SPACING`: a power that moves by all of it is
# half-way in the mean. [chosen]
DRIFT = SPACING / 6.0
EXPECTED_PRIOR = 0.5  # part of the prior reserved for a whole order that a user expects [chosen]
THEORY_PRIOR = 0.9  # the same for the order that the theory of a scheme promises [chosen]
FRACTIONAL_FACTOR = 0.01  # on powers that are not a whole number from the promised one [chosen]
DISTANCES = (0.5, 1.0, 2.0)  # second power minus first power [expansion]
PURE_PRIOR = 0.3  # prior that no second power is visible [chosen]
# Size of the second power relative to the first, at the finest level of a window. [chosen]
SHARES = tuple(10.0 ** (-4.25 + 0.5 * k) for k in range(15))
# Prior that the second term is the first power times a logarithm, as singularities make it, and its sizes relative to
# the first term, if h grows by the factor e from the finest level on. [chosen]
LOGARITHM_PRIOR, LOGARITHM_SHARES = 0.01, SHARES[4:9]
DOMINATES = 0.1  # a power dominates if every other one is less than this part of it [chosen]
LEAST_SIGNAL = 0.1  # least mean square of both powers, over that expected of the first [chosen]
LONGEST_WINDOW = 11  # rows; halving from one step reaches round-off in as many [chosen]

# ---- Deviations from an expansion

MISFIT = 3e-4  # standard deviation of a level from its expansion, over its error [calibrated]
TAIL = 40.0  # degrees of freedom of Student's t for the misfit of one shape: nearly normal [chosen]
ONE_SHAPE_PRIOR = 0.1  # prior of one shape, relative to two shapes [calibrated, on seed 501]
JITTER_PRIOR = 0.15  # prior that each level is off by a factor of its own [calibrated]
# Standard deviations of these factors, and their priors. [calibrated]
JITTERS, JITTER_PRIORS = (5e-3, 2.5e-2, 0.1), (0.5, 0.3, 0.2)
# Prior that the second power then also has a shape of its own, and the standard deviation of the factors in that case:
# with a larger one, a third power looks like factors. [calibrated]
OWN_SHAPE_PRIOR, OWN_SHAPE_JITTER = 0.4, 5e-3
ALTERNATING_PRIOR = 0.02  # prior of errors whose sign alternates from level to level [chosen]
COHERENCES = (3e-4, 3e-3, 3e-2, 0.3, 1.0)  # part of a free row orthogonal to the next row [chosen]
FREE_PENALTY = 2.0  # log of the width of the range of the log size of a free row [calibrated]

# ---- Noise

FINEST_NOISE = (0.0, 0.1)  # noise of the finest level of a window, over its error [chosen]
# Error of the finest level over the last difference of a window: a third for order 2 and halved steps. [expansion]
FINEST_ERROR = 0.3
MOST_NOISY = 0.999  # largest prior of the second entry of `FINEST_NOISE` [chosen]
OTHER_NOISE_PRIOR = 0.03  # prior of noise that differs from its prediction [chosen]
PREDICTION_FACTOR = 10.0  # predicted noise is known to within this factor [arithmetic]
GROWTHS = (0.0, 0.5, 1.0, 1.5)  # noise grows as the number of steps to such a power [arithmetic]
ROUNDING = 0.1  # least noise variance of a level, over the predicted one [chosen]
EPSILON = 2.0**-53  # least noise of a level, over the largest difference from it on [arithmetic]
