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

# Expansions

HALF_SPACING = 0.25
"""Orders no further apart are the same one: half the distance between two orders of expansions. [derived]"""
LEAST_CANDIDATE = 0.5
"""The least order that an expansion has: a solution that stays away from its limit has none. [derived]"""
NEXT = 2.0
"""The powers of an expansion are at most so far apart: an order that has not settled may become one so far away.
[derived]"""
FARTHEST = 3.0
"""A lower power is lower by no more. [convention]"""
MOST_ABOVE = 2.0
"""A superconvergent quantity gains at most the next even power. [derived]"""
ORDINARY_ORDER = 2.0
"""Order of an ordinary error, where a scheme promises none, or exactness. [convention]"""
STEEPEST = 64.0
"""Orders are sought between -STEEPEST and STEEPEST. [convention]"""

# Round-off

ABOVE_ROUND_OFF = 100.0
"""A difference must exceed its predicted round-off by this factor to be no round-off for certain. [convention]"""
ROUND_OFF_SAFETY = 10.0
"""Round-off may be so many times its prediction, which is an order of magnitude. [convention]"""
MEASUREMENT_FACTOR = 2.0
"""A difference may be laid to the measurement of a quantity up to so many times what that is known to be off by.
[derived]"""
EXACT_DIFFERENCE = 1e-10
"""Differences of a scheme that is exact are no larger part of the solution. [convention]"""
EXACT_ACCURACY = 1e-12
"""An exact solution is trusted to this part of its size. [convention]"""
VISIBLE_ERROR = 1e4
"""An ordinary error, (w dt)^p at the coarsest level, that exceeds `ABOVE_ROUND_OFF` by this factor is seen.
[calibrated]"""
QUIET = 0.01
"""Scatter or change of the order too small to read a trend from. [calibrated]"""
AUDIBLE = 0.003
"""Scatter above which noise is looked for. [calibrated]"""
SHOWS = 3.0
"""Noise changes an order by no more than so many times its scatter (over log 2). [calibrated]"""
UNRELATED_FIRST = 0.1
"""A first triple with more scatter has no trend before it that could vouch for it: suspect differences spoil it.
[calibrated]"""
STEEP = 1.1
"""Scatter that rises by more than so many times 2^(p - 1/2) per level is no power h^(1/2) or higher under h^p.
[derived]"""
INCOHERENT = 0.5
"""Differences with more scatter, or opposite to each other, are not those of one error. [calibrated]"""
PLATEAU = 3
"""So many triples, of five levels, show a floor that nothing explains. [calibrated]"""
TRIPLES_BEFORE = 2
"""So many triples before such a floor must be those of an error. [calibrated]"""
HEARD = 0.05
"""A floor that is a larger part of a difference spoils its order: by 0.07 and more. [derived]"""
HEARD_IN_ERROR = 0.3
"""The same of an error: what is left of the bounds within which it must agree with the differences. [derived]"""
STAYS = 0.5
"""A floor does not fall below this part of itself. [calibrated]"""
SINGLE_NUMBER = 1e-9
"""Series with less scatter are multiples of one another, such as a single number, and cannot show noise by it.
[convention]"""

# The window of a ladder

COINCIDENT = 0.2
"""Largest scatter (see `differences.scatters`) of curves that count as proportional. [calibrated]"""
PROPORTIONAL_ALONE = 0.05
"""The same where one triple is the only evidence. [calibrated]"""
UNRELATED = 0.7
"""Series with so much scatter have nothing to do with each other, and a change from there says nothing. [calibrated]"""
JUMP = 0.3
"""Change of the order from one triple to the next that a scatter of `HIDDEN` at most cannot come from. [calibrated]"""
TRIPLES_AGREE = 0.01
"""Two triples agree that have no larger mismatch. [calibrated]"""
FADING = 0.75
"""The scatter fades when it falls at least to this part of itself per level (1/2 and 1/4 are usual). [derived]"""
QUICK, SLOW = 0.62, 0.05
"""What fades no faster is a power h^(p+1/2), of which more than a tenth makes the mismatch 0.06. [derived]"""
GROWS = 1.3
"""The scatter drifts when it grows by more per level; a power lower by 1/2 makes it grow by 2^0.5. [derived]"""
READABLE, PARALLEL = 1e-5, 0.05
"""Less scatter, or a smaller part of the change of the order, is that of series of one shape, and no trend.
[calibrated]"""
SLOWEST, FASTEST = 0.8, 0.1
"""Factors per level between which changes of the order fade when they come from a power of the expansion. [derived]"""
ALIKE = 0.15
"""Scatter and order tell of the same power where their factors differ by no more. [calibrated]"""
SETTLED_MISMATCH = 0.15
"""Largest mismatch of a settled order: a second term of a tenth of the first makes 0.2 for neighbouring powers.
[derived]"""
HIDDEN = 0.015
"""A tenth of h^(p-1), or of h^(p-2), beside h^p makes at least this mismatch: 0.0167 for p = 2, 0.015 for p = 4. With
more, a ladder of which no trend is known may be on the way to a lower order. [derived]"""
EMERGING = 0.1
"""A lower power that is seen to grow may be so large a part of h^p at the finest level. [convention]"""
SUSPECT = 1.0 / 3.0
"""From this part of what would be too much on, what grows is told as a lower power that may be hiding. [calibrated]"""
PASSING = 0.05
"""Orders that change by more and do not settle may be on the way from one power to another. [calibrated]"""

# Orders that swing from level to level

JITTER_ORDERS = 3, 6
"""So many orders at least and at most, the last ones, are looked at. [calibrated]"""
SURE_TURNS = 2
"""So many changes of direction are no power that takes over from another one, which makes one of them. [derived]"""

# Half the widths of intervals

LEAST_WIDTH = 1e-6
"""At least: the digits that reports show. [convention]"""
OF_CHANGE = 2.1
"""Over the last changes of the order: 95 % of ladders whose trend is not known. [calibrated]"""
OF_SETTLED = 7.5
"""Where scatter and three orders tell of one next power, which is then taken off: over the last change times what the
correction leaves out, which is the distance of the two factors and the scatter itself. [calibrated]"""
MOST_SETTLED = 0.6
"""Such an interval is no wider than this part of the last change. [calibrated]"""
OF_STEADY = 0.5
"""Over the larger of two changes, where three orders of series of one shape tell of the next power. [calibrated]"""
OF_FADING = 1.3
"""Over the same where the scatter alone tells that the next power fades. [calibrated]"""
OF_SCATTER = 3.0
"""Of a single order over its scatter / log 2: shapes at an angle of 18 degrees. [derived]"""
OF_ERRORS = 2.0
"""Of a single order over its distance from the order of the last true errors. [calibrated]"""
OF_SWINGS = 2.0
"""Of the mean of orders that swing, over the largest distance from it. [calibrated]"""
SINGLE_WIDTH = 2e-4
"""Of a single order at least. [calibrated]"""
NEAREST = 0.1
"""An order so near a multiple of 1/2 may be that one: expansions have no other, and the distance is an error seen.
[derived]"""

# The rules

STEADY = 1.0 / 3.0
"""Orders are steady that change by less than this part of the tolerance: three more changes do not leave it.
[derived]"""
NARROW = 0.2
"""Half the width of the interval of an order that is called too high, at most. [calibrated]"""
PURE = 1e-3
"""Scatter, or change of the order, below which a ladder is one pure power, whatever the power. [calibrated]"""
MOVES = QUIET / 2
"""A smaller last change of the order is no movement away: half of what is too small to read a trend from.
[calibrated]"""
DEPARTED = 0.012
"""An order no further from p has not left it: a little more than `QUIET`, so that p + QUIET still counts as p.
[derived]"""
REACH = 0.05
"""An order this near a multiple of 1/2 may be that multiple: a tenth of the distance between two of them. [derived]"""
REACH_SETTLED = 0.1
"""The same for a whole number that several triples support: a tenth of the distance between whole numbers. [derived]"""
OF_SINGLE = 2.0
"""A single order may be so many times its scatter (over log 2) from the whole number that it stands for.
[calibrated]"""
SUNK = 0.9
"""Orders that are lower than p by more and fall leave p behind: of h^(p-1), too little h^p is left to be counted.
[derived]"""
BLOWN_UP = 10.0
"""A solution so many times larger than the exact one has grown. [convention]"""
RESOLVED_DECAY = 1.0
"""A step no longer than so many times that in which damping takes a velocity away sees how it goes. [derived]"""

# True errors

EXCESS = 1.5
"""An error so many times the one that the differences allow, or so many times smaller, contradicts them.
[calibrated]"""
LEAVES = 0.03
"""Orders of true errors may be so far from p: a tenth of h^(p-1) beside h^p makes 0.07. [derived]"""
ERRORS_VOUCH = 0.04
"""Mismatch of errors that leaves no room for a tenth of a lower power, which makes 0.05. [derived]"""
ERRORS_FADE = 0.6
"""What the errors show besides h^p falls at least to this part of itself per level when it is a higher power.
[derived]"""
SEEN_SHARE = 0.3
"""Differences see a power that shows less than this part of what the errors tell of it, and so see none.
[calibrated]"""
STAYED = 0.5
"""Errors of four levels have stayed that are a larger part of the coarsest. [derived]"""

# A promised order behind a higher one

EXCLUDED = 1e-6
"""A part of the error that is no larger takes h^(p-1) twenty levels to decide: more than any ladder has. [derived]"""
HIGHER_POWERS = 4
"""Higher powers that are taken away, at most. [convention]"""

# Series over time

ZERO_CROSSING = 0.1
"""A denominator below this part of its surroundings is taken for a zero crossing. [convention]"""
LEAST_WINDOW = 3
"""Points of the shortest window of a local order. [convention]"""
OWN_END = 0.5
"""The last point counts for itself where its differences are at least this part of those before it. [convention]"""

# Extrapolation of series

SERIES_SAFETY = 1.25
"""Factor on a bound that rests on a fall seen once: that of grid convergence indices (P. J. Roache, 1994).
[convention]"""

# Extrapolation of numbers

COLUMNS = 5
"""So many powers are taken away at most. [convention]"""
RATIO_AGREES, RATIO_BEFORE_AGREES, RATIO_ALONE_AGREES = 0.3, 0.6, 0.2
"""Relative distance of a ratio of changes from that of the power: of the last, of the one before, of a single one.
[calibrated]"""
NUMBER_SAFETY, NUMBER_SAFETY_ALONE = 2.0, 4.0
"""Factor on the change of an entry: where two ratios agree, and where there is one only. [calibrated]"""
LEAST_SHARE = 0.01
"""The least part of what was taken away that is left, where one change supports the extrapolation. [calibrated]"""
RATIO_OF_THREE, SAFETY_OF_THREE, LEAST_SHARE_OF_THREE = 0.05, 6.0, 0.03
"""The same as `RATIO_ALONE_AGREES`, `NUMBER_SAFETY_ALONE` and `LEAST_SHARE` of three levels: their only ratio may be an
accident. [calibrated]"""
SPREAD, SPREAD_OF_THREE, SPREAD_OF_TWO = 3.0, 3.5, 4.0
"""Factor on what the last three levels differ by (L. Eca and M. Hoekstra, 2014), three levels that are all there are,
and two. [calibrated]"""
RAGGED, DECLINE = 5, 0.5
"""Of so many levels and more, changes may fall raggedly, where the last two are at most this part of those before.
[calibrated]"""
ORDER_ABOVE_ROUND_OFF = 30.0
"""A difference must exceed its predicted round-off by this factor to have an order. [calibrated]"""
FALL_ABOVE_ROUND_OFF = 200.0
"""Differences of numbers must fall where they exceed their predicted round-off by this factor. [calibrated]"""
OTHER_ORDER, NEAR_HALF = 0.3, 0.15
"""An order further than the first from the promised one is another one, where it is as near as the second to a multiple
of 1/2. [calibrated]"""
HIGHEST_ORDER = 12.0
"""No higher order is looked for. [convention]"""

# Extrapolation of states

STATE_SAFETY = 2.0
"""Factor on the estimated error of truncation. [pendulums]"""
GAIN_SAFETY, FIRST_GAIN_SAFETY = 5.0, 100.0
"""Factor on what one more extrapolation leaves of an error, and where three levels are all there is, so that no gain
was seen before. [pendulums]"""
LARGEST_GAIN = 1e-3
"""One more extrapolation is never believed to leave less of an error. [pendulums]"""
LEAST_FALL = 1.25
"""A change that falls by less counts as one that falls by this factor: four times itself is then left. [convention]"""
KNOWN_DIGIT = 0.1
"""An error beyond this part of the solution's size is no longer small; then nothing is known of it. [convention]"""

# The grid convergence index

GCI_TRUSTED, GCI_CAUTIOUS = 1.25, 3.0
"""The factor F (P. J. Roache, 1994). [convention]"""
GCI_AGREES = 0.1
"""Part of the promised order that the observed one may be off (W. L. Oberkampf and C. J. Roy, 2010). [convention]"""
GCI_LEAST_ORDER = 0.5
"""The least order that is used (the same). [convention]"""
GCI_FITTED, GCI_EXPONENTS = 5, 16
"""So many of the finest levels are fitted at most, by so many exponents up to the promised order. [convention]"""
GCI_NEAR_ZERO = 0.05
"""A number below this part of its scale is near zero and has no relative index. [convention]"""
