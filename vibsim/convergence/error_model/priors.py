"""The numbers of the error model: value, meaning, and where they come from.

[expansion] follows from expansions of errors, [arithmetic] from double precision. [chosen] is a prior that was written
down before anything was judged. [calibrated] was set on seeds 1 and 3 of the random ladders with known truth
(``tests/analysis/synthetic.py``); but for `POINTS` and `MISFIT` the counts there hardly change where one is doubled or
halved.
"""

from __future__ import annotations

import numpy as np

POINTS = 2.0  # independent points of a series or field; a single number has one [calibrated]
POWERS = (*(0.5 * k for k in range(1, 11)), 6.0, 7.0, 8.0)  # that expansions have [expansion]
HIGHEST = 8.0  # power that is looked for [chosen]
BIN = 0.05  # distance of the powers among which such a power is counted [chosen]
OTHER_PRIOR = 0.1  # of a single power of any other value up to `HIGHEST` [chosen]
# It is looked for at these distances from the measured order. [chosen]
_BESIDE = 3e-4 * 2.0 ** np.arange(9)
AROUND = np.concatenate([-_BESIDE[::-1], [0.0], _BESIDE])
# Standard deviation, on the way to the limit, of a power that is not in the bin of one of an expansion: it stands for
# two powers side by side. Three are half of a bin, as a power that moves by a bin is half-way in the mean. [chosen]
DRIFT = BIN / 6.0
EXPECTED = 0.5  # prior of the whole order that a user expects, beside that of every power [chosen]
THEORY = 0.9  # the same of the order that the theory of a scheme promises [chosen]
# Prior of a power that is not a whole number away from that of theory, beside 1. [chosen]
BETWEEN = 0.01
DISTANCES = (0.5, 1.0, 2.0)  # from the first power to the second [expansion]
PURE_PRIOR = 0.3  # that there is no second power in sight [chosen]
# Size of the second power over the first, at the finest level of a window. [chosen]
SHARES = tuple(10.0 ** (-4.25 + 0.5 * k) for k in range(15))
MISFIT = 3e-4  # of a level from its expansion, over its error [calibrated]
LEAST = 0.1  # square of the size that both powers together have at least, over that expected of them [chosen]
TAIL = 40.0  # degrees of freedom of the misfit of shapes that are one: nearly normal [chosen]
ONE_SHAPE = 0.1  # of two powers of one shape, beside that of two shapes [calibrated, on seed 501]
JITTER_PRIOR = 0.15  # of levels that are off by a factor each [calibrated]
JITTERS, JITTER_PRIORS = (5e-3, 2.5e-2, 0.1), (0.5, 0.3, 0.2)  # size of factors less 1 [calibrated]
# That the second power has a shape beside a multiple of the first, too, and the size of factors less 1 then: with more,
# a third power looks like factors. [calibrated]
OWN_SHAPE, JITTER_OF_SHAPES = 0.4, 5e-3
FINEST_NOISE = (0.0, 0.1)  # noise of the finest level of a window, over its error [chosen]
UNEXPECTED = 0.03  # prior of noise that nothing predicts [chosen]
PREDICTION = 10.0  # noise is predicted within this factor [arithmetic]
GROWTHS = (0.0, 0.5, 1.0, 1.5)  # of round-off: N to this power [arithmetic]
COHERENCES = (3e-4, 3e-3, 3e-2, 0.3, 1.0)  # of a row that nothing is known of [chosen]
PRICE = 2.0  # of a row with a size of its own: log of the range that sizes may have [calibrated]
ALTERNATING = 0.02  # prior of errors that change their sign at every level [chosen]
LONGEST_WINDOW = 11  # rows: halving from one step to round-off takes as many; more cost more than they say [chosen]
DOMINATES = 0.1  # a power dominates where no other one has more than this part of it [chosen]
ROUNDING = 0.1  # square of the noise that a level has at least, over its prediction [chosen]
# The least noise of a level, over the largest difference from there on. [arithmetic]
EPSILON = 2.0**-53
