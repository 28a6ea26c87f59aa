"""Every number of this room that decides something: its value, its meaning, and where it comes from.

The origin stands in brackets at the end:

- *derived*: it follows from the expansion of the error, or from the arithmetic;
- *calibrated*: set on seeds 1, 3 and 4 of the random ladders with known truth (``tests/analysis/synthetic.py``), those
  of numbers on seeds 1 and 3. The tables of ``docs/method.md`` are for other seeds, which set none;
- *pendulums*: set on random ladders of pendulums and springs (``tests/analysis/test_extrapolation.py``);
- *convention*: a usual value of the field, or a size that was chosen.

The priors of the error model are in ``error_model/priors.py``.
"""

from __future__ import annotations

import math

# ---- Expansions

# Orders no further apart are the same one: half the distance between two orders of expansions. [derived]
HALF_SPACING = 0.25
LEAST_CANDIDATE = 0.5  # least order of an expansion: a solution that stays away has none [derived]
LEAST_WITH_LIMIT = LEAST_CANDIDATE - HALF_SPACING  # what falls more slowly shows no limit [derived]
MOST_ABOVE = 2.0  # a superconvergent quantity gains at most the next even power [derived]
ORDINARY_ORDER = 2.0  # of an error, where a scheme promises none, or exactness [convention]
STEEPEST = 64.0  # orders are sought between -STEEPEST and STEEPEST [convention]
# Power of the relative size of a point by which it counts where largest values are compared. [convention]
PEAKS = 4

# ---- Round-off

ABOVE_ROUND_OFF = 100.0  # a difference above its round-off by this factor is none [convention]
ROUND_OFF_SAFETY = 10.0  # round-off may be so many times its prediction [convention]
# A difference may be laid to the measurement up to so many times what that is known to be off by. [derived]
MEASUREMENT_FACTOR = 2.0
EXACT_DIFFERENCE = 1e-10  # largest difference of an exact scheme, over the solution [convention]
EXACT_ACCURACY = 1e-12  # an exact solution is trusted to this part of its size [convention]
# An ordinary error, (w dt)^p at the coarsest level, that exceeds `ABOVE_ROUND_OFF` by this factor is seen. [calibrated]
VISIBLE_ERROR = 1e4
FLOOR_STAYS = 0.5  # a floor does not fall below this part of itself [calibrated]

# ---- Decisions by the error model

RISK = 0.01  # accepted probability that a verdict is wrong [convention]
# The same where three levels decide behind others that do not fit. [calibrated]
RISK_OF_THREE = 0.1 * RISK
# An order fails only where one power has so much of the probability, alone or as one of two of a size. [calibrated]
DEFINITE = 0.9
ORDER_INTERVAL = 0.95  # probability of the interval of an order [convention]
# Standard deviations in the bound of a best value: of the tails that the posterior has, these are 95 %. [calibrated]
BEST_BOUND = 3.0
# A limit is missed that is so many bounds of the best value away from it, and at least so large a part of the estimated
# error of the finest level. [calibrated]
MISSED, MISSED_SHARE = 3.0, 0.5
# Whatever the order, an exact solution is missed that is so many times further away than all that so many levels or
# more have moved, and have to move, by differences that fall. [convention]
MISSED_FAR, LEVELS_OF_A_FALL = 5.0, 4
# Noise may be so many times its prediction where levels are said to differ by nothing else; the same of noise that a
# user states, which differences of normal noise exceed in one of 200. [convention]
NOISE_FACTOR, STATED_NOISE_FACTOR = 10.0, 2.0
# Levels that are no neighbours may differ by so many times more, since there are more of them: of ten normal numbers
# two are more than 5 standard deviations apart in one of 70 cases. [derived]
FURTHER_APART = 1.25
# So many times the stated noise a level is away from an exact solution that it misses: the noise of one level is less
# than that of a difference by the root of 2, so that the risk is the same. [derived]
STATED_LIMIT_FACTOR = 2.0 * STATED_NOISE_FACTOR / math.sqrt(2.0)

# ---- Facts from outside a ladder

LIMIT_ROUNDING = 1e-9  # w dt within this part of a stability limit is at the limit [convention]
BLOWN_UP = 10.0  # a solution so many times larger than the exact one has grown [convention]
# A step no longer than so many times that in which damping takes a velocity away sees how it goes. [derived]
RESOLVED_DECAY = 1.0
ERROR_STAYED = 0.5  # an error has stayed that is a larger part of the coarsest level's [derived]

# ---- A promised order behind a higher one

EXCLUDED = 1e-6  # a smaller part of the error takes h^(p-1) twenty levels to decide [derived]
HIGHER_POWERS = 4  # higher powers that are taken away, at most [convention]

# ---- Series over time

ZERO_CROSSING = 0.1  # a denominator below this part of its surroundings crosses zero [convention]
LEAST_WINDOW = 3  # points of the shortest window of a local order [convention]
# The last point counts for itself where its differences are at least this part of those before it. [convention]
OWN_END = 0.5

# ---- Extrapolation of series

# Factor on a bound that rests on a fall seen once: that of grid convergence indices (P. J. Roache, 1994). [convention]
SERIES_SAFETY = 1.25

# ---- Extrapolation of numbers

MOST_COLUMNS = 5  # so many powers are taken away at most [convention]
# Relative distance of a ratio of changes from that of the power: of the last, of the one before, of a single one.
# [calibrated]
RATIO_AGREES, RATIO_BEFORE_AGREES, RATIO_ALONE_AGREES = 0.3, 0.6, 0.2
# Factor on the change of an entry: where two ratios agree, and where there is one only. [calibrated]
NUMBER_SAFETY, NUMBER_SAFETY_ALONE = 2.0, 4.0
# The least part of what was taken away that is left, where one change supports the extrapolation. [calibrated]
LEAST_SHARE = 0.01
# The same as `RATIO_ALONE_AGREES`, `NUMBER_SAFETY_ALONE` and `LEAST_SHARE` of three levels: their only ratio may be an
# accident. [calibrated]
RATIO_OF_THREE, SAFETY_OF_THREE, LEAST_SHARE_OF_THREE = 0.05, 6.0, 0.03
# Factor on what the last three levels differ by (L. Eca and M. Hoekstra, 2014), three levels that are all there are,
# and two. [calibrated]
SPREAD, SPREAD_OF_THREE, SPREAD_OF_TWO = 3.0, 3.5, 4.0
# Least order at which that covers all that is left of changes that fall geometrically. [derived]
SLOWEST_ORDER = 0.5 * math.log2(1.0 + 1.0 / SPREAD)
# Of so many levels, changes may fall raggedly: the last two to this part of those before. [calibrated]
RAGGED, DECLINE = 5, 0.5
ORDER_ABOVE_ROUND_OFF = 30.0  # a difference has an order above so many times its floor [calibrated]
FALL_ABOVE_ROUND_OFF = 200.0  # and must fall above so many times its floor [calibrated]
# An order further than the first from the promised one is another one, where those of two triples are as near as the
# second to one multiple of 1/2. [calibrated]
OTHER_ORDER, NEAR_HALF = 0.3, 0.15
HIGHEST_ORDER = 12.0  # no higher order is looked for [convention]

# ---- Extrapolation of states

STATE_SAFETY = 2.0  # factor on the estimated error of truncation [pendulums]
# Factor on what one more extrapolation leaves of an error, and where three levels are all there is, so that no gain
# was seen before. [pendulums]
GAIN_SAFETY, FIRST_GAIN_SAFETY = 5.0, 100.0
LARGEST_GAIN = 1e-3  # one more extrapolation leaves no less of an error [pendulums]
# A change that falls by less counts as one that falls by this factor: four times itself is then left. [convention]
LEAST_FALL = 1.25
KNOWN_DIGIT = 0.1  # of an error beyond this part of the size nothing is known [convention]

# ---- The grid convergence index

GCI_TRUSTED, GCI_CAUTIOUS = 1.25, 3.0  # the factor F (P. J. Roache, 1994) [convention]
# Part of the promised order that the observed one may be off (W. L. Oberkampf and C. J. Roy, 2010). [convention]
GCI_AGREES = 0.1
GCI_LEAST_ORDER = 0.5  # the least order that is used (the same) [convention]
# So many of the finest levels are fitted at most, by so many exponents up to the promised order. [convention]
GCI_FITTED, GCI_EXPONENTS = 5, 16
GCI_NEAR_ZERO = 0.05  # a number below this part of its scale has no relative index [convention]
