"""Every number of this room that decides something: its value, its meaning, and where it comes from.

The origin stands in brackets at the end:

- *derived*: it follows from the expansion of the error, or from the arithmetic;
- *calibrated*: set on seeds 1, 3 and 4 of the random ladders with known truth (``tests/analysis/synthetic.py``), those
  of numbers on seeds 1 and 3. The tables of ``docs/method.md`` are for seed 2, which set none;
- *pendulums*: set on random ladders of pendulums and springs (``tests/analysis/test_extrapolation.py``);
- *convention*: a usual value of the field, or a size that was chosen.

The *mismatch* of a triple is ``sqrt(scatter^2 + (log 2 distance)^2)``, with the distance of its order from p.
"""

from __future__ import annotations

import math

LOG2 = math.log(2.0)

# ---- Expansions

# Orders no further apart are the same one: half the distance between two orders of expansions. [derived]
HALF_SPACING = 0.25
LEAST_CANDIDATE = 0.5  # least order of an expansion: a solution that stays away has none [derived]
# The powers of an expansion are at most so far apart: an order that is not settled may become the next. [derived]
NEXT = 2.0
LARGEST_POWER_GAP = 3.0  # a lower power is lower by no more [convention]
MOST_ABOVE = 2.0  # a superconvergent quantity gains at most the next even power [derived]
ORDINARY_ORDER = 2.0  # of an error, where a scheme promises none, or exactness [convention]
STEEPEST = 64.0  # orders are sought between -STEEPEST and STEEPEST [convention]

# ---- Round-off

ABOVE_ROUND_OFF = 100.0  # a difference above its round-off by this factor is none [convention]
ROUND_OFF_SAFETY = 10.0  # round-off may be so many times its prediction [convention]
# A difference may be laid to the measurement up to so many times what that is known to be off by. [derived]
MEASUREMENT_FACTOR = 2.0
EXACT_DIFFERENCE = 1e-10  # largest difference of an exact scheme, over the solution [convention]
EXACT_ACCURACY = 1e-12  # an exact solution is trusted to this part of its size [convention]
# An ordinary error, (w dt)^p at the coarsest level, that exceeds `ABOVE_ROUND_OFF` by this factor is seen. [calibrated]
VISIBLE_ERROR = 1e4
QUIET = 0.01  # scatter or change of the order too small to read a trend from [calibrated]
AUDIBLE = 0.003  # scatter above which noise is looked for [calibrated]
SHOWS = 3.0  # noise changes an order by so many times its scatter / log 2 at most [calibrated]
# A first triple with more scatter has no trend that could vouch for it: suspect differences spoil it. [calibrated]
UNRELATED_FIRST = 0.1
# Scatter that rises by more than so many times 2^(p - 1/2) per level is no power h^(1/2) or higher under h^p. [derived]
STEEP = 1.1
INCOHERENT = 0.5  # with more scatter, or opposite, differences are not of one error [calibrated]
PLATEAU = 3  # so many triples, of five levels, show a floor that nothing explains [calibrated]
TRIPLES_BEFORE = 2  # so many triples before such a floor must be those of an error [calibrated]
HEARD = 0.05  # a floor that is a larger part of a difference spoils its order, by 0.07 [derived]
# The same of an error: what is left of the bounds within which it must agree with the differences. [derived]
HEARD_IN_ERROR = 0.3
STAYS = 0.5  # a floor does not fall below this part of itself [calibrated]
# Series with less scatter are multiples of one another, such as a single number: it shows no noise. [convention]
SINGLE_NUMBER = 1e-9

# ---- The window of a ladder

COINCIDENT = 0.2  # largest scatter of curves that count as proportional [calibrated]
PROPORTIONAL_ALONE = 0.05  # the same where one triple is the only evidence [calibrated]
FAILS_ALONE = 0.11  # the same where it is to show another order [calibrated on real ladders]
UNRELATED = 0.7  # with so much scatter, a change from there says nothing [calibrated]
# Change of the order from one triple to the next that a scatter of `HIDDEN` at most cannot come from. [calibrated]
JUMP = 0.3
TRIPLES_AGREE = 0.01  # two triples agree that have no larger mismatch [calibrated]
FADING = 0.75  # fading scatter falls to this part per level (1/2 and 1/4 are usual) [derived]
# What fades no faster is a power h^(p+1/2), of which more than a tenth makes the mismatch 0.06. [derived]
QUICK, SLOW = 0.62, 0.05
GROWS = 1.3  # drifting scatter grows by more; a power lower by 1/2 makes it 2^0.5 [derived]
# Less scatter, or a smaller part of the change of the order, is that of series of one shape, and no trend. [calibrated]
READABLE, PARALLEL = 1e-5, 0.05
# Factors per level between which changes of the order fade when they come from a power of the expansion. [derived]
SLOWEST, FASTEST = 0.8, 0.1
SAME_POWER = 0.15  # largest difference of two such factors that tell of the same power [calibrated]
# Largest mismatch of a settled order: a second term of a tenth makes 0.2 for neighbouring powers. [derived]
SETTLED_MISMATCH = 0.15
# A tenth of h^(p-1), or of h^(p-2), beside h^p makes at least this mismatch: 0.0167 for p = 2, 0.015 for p = 4. With
# more, a ladder of which no trend is known may be on the way to a lower order. [derived]
HIDDEN = 0.015
EMERGING = 0.1  # largest part of h^p at the finest level of a lower power that grows [convention]
SUSPECT = 1.0 / 3.0  # from this part of too much on, what grows may be a lower power [calibrated]
PASSING = 0.05  # orders that change by more may be on the way between powers [calibrated]

# ---- Orders that swing from level to level

JITTER_ORDERS = 3, 6  # so many of the last orders, at least and at most, are looked at [calibrated]
SURE_TURNS = 2  # changes of direction: one power that takes over from another makes one [derived]

# ---- Half the widths of intervals

LEAST_WIDTH = 1e-6  # at least: the digits that reports show [convention]
OF_CHANGE = 2.1  # over the last changes: 95 % of ladders whose trend is not known [calibrated]
# Where scatter and three orders tell of one next power, which is then taken off: over the last change times what the
# correction leaves out, which is the distance of the two factors and the scatter itself. [calibrated]
OF_SETTLED = 7.5
MOST_SETTLED = 0.6  # such an interval is no wider than this part of the last change [calibrated]
# Over the larger of two changes, where three orders of series of one shape tell of the next power. [calibrated]
OF_STEADY = 0.5
OF_FADING = 1.3  # the same where the scatter alone tells that the next power fades [calibrated]
OF_SCATTER = 3.0  # of a single order over its scatter / log 2: shapes at 18 degrees [derived]
OF_ERRORS = 2.0  # of a single order over its distance from that of the last errors [calibrated]
OF_SWINGS = 2.0  # of the mean of orders that swing, over the largest distance from it [calibrated]
SINGLE_WIDTH = 2e-4  # of a single order at least [calibrated]
# An order so near a multiple of 1/2 may be that one: expansions have no other, and the distance is an error. [derived]
NEAREST = 0.1

# ---- The rules

STEADY = 1.0 / 3.0  # part of the tolerance: three more such changes do not leave it [derived]
NARROW = 0.2  # most half width of the interval of an order that is called too high [calibrated]
PURE = 1e-3  # scatter, or change of the order, of one pure power, whatever the power [calibrated]
MOVES = QUIET / 2  # a smaller last change of the order is no movement away [calibrated]
# An order no further from p has not left it: a little more than `QUIET`, so that p + QUIET still counts as p. [derived]
DEPARTED = 0.012
REACH = 0.05  # so near a multiple of 1/2: a tenth of the distance between two of them [derived]
REACH_SETTLED = 0.1  # the same for a whole number that several triples support [derived]
OF_SINGLE = (
    2.0  # distance of a single order from its whole number, over scatter / log 2 [calibrated]
)
# Orders that are lower than p by more and fall leave p behind: of h^(p-1), too little h^p is left to count. [derived]
SUNK = 0.9
BLOWN_UP = 10.0  # a solution so many times larger than the exact one has grown [convention]
# A step no longer than so many times that in which damping takes a velocity away sees how it goes. [derived]
RESOLVED_DECAY = 1.0

# ---- True errors

# An error so many times the one that the differences allow, or so many times smaller, contradicts them. [calibrated]
EXCESS = 1.5
LEAVES = 0.03  # distance of their orders from p: a tenth of h^(p-1) beside h^p makes 0.07 [derived]
ERRORS_VOUCH = 0.04  # a mismatch that leaves no room for a tenth of a lower power: 0.05 [derived]
# What the errors show besides h^p falls at least to this part of itself per level when it is a higher power. [derived]
ERRORS_FADE = 0.6
# Differences see a power that shows less than this part of what the errors tell of it, and so see none. [calibrated]
SEEN_SHARE = 0.3
STAYED = 0.5  # errors of four levels have stayed that are a larger part of the coarsest [derived]

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
# Of so many levels, changes may fall raggedly: the last two to this part of those before. [calibrated]
RAGGED, DECLINE = 5, 0.5
ORDER_ABOVE_ROUND_OFF = 30.0  # a difference has an order above so many times its floor [calibrated]
FALL_ABOVE_ROUND_OFF = 200.0  # and must fall above so many times its floor [calibrated]
# An order further than the first from the promised one is another one, where it is as near as the second to a multiple
# of 1/2. [calibrated]
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
