"""Convergence verdicts in words: the diagnosis of a result, and its template (`order_sentences`) filled with phrases.

A diagnosis is the reason of a verdict, refined by its cause if that is known.
"""

from __future__ import annotations

import math
from itertools import pairwise

from vibsim.checks.order_context import COINCIDE, OrderContext
from vibsim.checks.order_sentences import DIAGNOSES, UNSEEN
from vibsim.checks.sentences import Description, MemberFacts, Template, add_levels
from vibsim.comparison.parting import levels_to_the_end
from vibsim.convergence.study.sentences import higher_part, opposite_part
from vibsim.convergence.thresholds import HALF_SPACING, UNEVEN_SPEEDS
from vibsim.core.decimals import order_interval
from vibsim.core.vocabulary import is_error_part
from vibsim.experiment.schema.checks import ConvergesCheck
from vibsim.experiment.schema.fields import MAX_LEVEL
from vibsim.schemes.base import is_on_the_mesh

HIGHEST = 12.0
"""No scheme has an order above this."""
FAR_DOWN = 1.0
"""An interval that extends further below its order contains a lower power of the expansion."""
LAST_ORDERS = 4
"""Number of the last orders that are reported."""
HARDLY = 0.1
"""Share of the distance to the order where estimates should go; if they move by less, they do not go there."""
NEAR_DUE = 0.3
"""The trend of orders this near to their goal is not reported."""
BACKWARD_DAMPING = "central_backward_damping"
"""The scheme that loses an order only by its treatment of damping."""


def describe(f: MemberFacts, check: ConvergesCheck) -> Description:
    """Describe the convergence, and what to change if it is not as expected."""
    return in_words(_Phrases(f, check))


def in_words(s: _Phrases) -> Description:
    """Fill the templates of the diagnosis."""
    sentence, advice = DIAGNOSES[_diagnosis(s)]
    if s.reason in ("order_low", "order_high"):
        sentence = f"{{other_order}}{sentence}{{largest_share}}{{parts}}{{error}}"
    template = Template(s, s.notation)
    return Description(template.format(sentence), template.format(advice))


def _diagnosis(s: OrderContext) -> str:
    """Return the first diagnosis that applies: from the options of the scheme or the force, then from the cause."""
    by_cause, corner = f"{s.reason}, {s.cause}", s.corner
    has_promise, less = s.shows_promise, s.promises_less
    may_grow = s.reason in ("unstable", "non_finite") and s.singular != 0.0
    always_grows = may_grow and not s.is_zero_stable
    finer = {
        "unstable": {"at every step": always_grows, "beyond the limit": s.is_beyond_limit},
        "non_finite": {
            "from the start": s.singular == 0.0,
            "at every step": always_grows,
            "always": not math.isnan(s.singular),
        },
        "not_applicable": {
            "adaptive": "tolerance" in s.options,
            "part": is_error_part(s.quantity),
        },
        "non_smooth": {
            "pulse": s.cause == "pulse",
            "mesh": is_on_the_mesh(s.options),
            "table": not math.isnan(s.table_corner),
            "jump at a point": corner is not None and corner.on_a_point and corner.power == 1.0,
            "irregular": corner is not None
            and not corner.on_a_point
            and not less
            and s.expected <= corner.power,
            "corner": corner is not None,
        },
        "pre_asymptotic": {
            s.cause: by_cause in DIAGNOSES,
            "pole": not math.isnan(s.parts_at) and s.speeds_differ > UNEVEN_SPEEDS,
            "parting": not math.isnan(s.parts_at),
            "growing": s.order <= 0.0,
            "steep": s.order > HIGHEST,
        },
        "order_low": {
            "mesh": is_on_the_mesh(s.options),
            "table": not math.isnan(s.table_corner),
            "promise, damping": has_promise and less and s.kind == BACKWARD_DAMPING,
            "promise, start": has_promise and less and s.centred >= s.expected - s.tolerance,
            "promise": has_promise and less,
            "start": s.starts_low,
            "end": s.ends_low,
        },
        "order_high": {
            "promise, exact": has_promise and math.isinf(s.promised),
            "promise": has_promise and s.promises_more,
        },
    }
    for name, applies in finer.get(s.reason, {}).items():
        if applies:
            return f"{s.reason}, {name}"
    return by_cause if by_cause in DIAGNOSES else s.reason


class _Phrases(OrderContext):
    """The context with phrases that depend on numbers."""

    def measured(self) -> str:
        """Return the measured order with its interval and levels; empty if there is none."""
        if math.isnan(self.order):
            return ""
        ends = order_interval(self.low, self.high)
        between = f" (between {ends[0]} and {ends[1]})" if len(ends) > 1 else ""
        return f"order {self.order:.3f}{between} on levels {self.first} to {self.last}"

    def other_order(self) -> str:
        """Say that an order is lower or higher than the expected one."""
        with_order = f", with {self.measured()}" if self.measured() else ""
        if math.isinf(self.expected) and self.reason == "order_low":
            return f"{self.subject} should be exact here, but levels differ by more than round-off{with_order}."
        word = "more slowly" if self.reason == "order_low" else "faster"
        expected = self.notation.number(self.expected)
        hidden = opposite_part(self.reason, self.order, self.expected)
        sentence = f"{self.subject} converges {word} than order {expected}{with_order}."
        return f"{sentence} {hidden}".rstrip()

    def largest_share(self) -> str:
        """Name the coordinate that has the largest share of the error of a vector; empty for other quantities."""
        if not 0.0 < sum(self.squares.values()) < math.inf:
            return ""
        name = max(self.squares, key=self.squares.__getitem__)
        share = self.notation.number(100.0 * self.squares[name] / sum(self.squares.values()), 2)
        subject = self.notation.opening(self.notation.quantity(name))
        return f" {subject} has the largest share of the error: {share} % of its square."

    def whose(self) -> str:
        """Say whether the order is promised by the scheme or expected by the check alone."""
        differs = self.promises_less or self.promises_more
        return "promised" if self.has_promise and not differs else "expected"

    def coincidence(self) -> str:
        """Say whether the rescaled differences coincide, or why the measured order is not yet the dominating one."""
        if moved := higher_part(self.order, self.expected, self.tolerance):
            return f" {moved}"
        if self.rescaled_distance <= COINCIDE:
            return " The rescaled differences coincide."
        # the differences include the last point, which `linf_interior` excludes
        if self.rescaled_distance > COINCIDE and self.norm != "linf_interior":
            return " The rescaled differences do not coincide yet."
        return ""

    def doubt(self) -> str:
        """Say why the interval of an order that passes extends far down; empty if it does not."""
        if not self.order - self.low > FAR_DOWN:
            return ""
        return (
            " A small error of lower order cannot be ruled out, so the interval extends down to order "
            f"{self.low:.1f}. Add a level to settle it."
        )

    def unseen(self) -> str:
        return "" if self.has_exact else UNSEEN

    def first_good(self) -> int:
        """Return the coarsest level within the limit of stability from which on no level failed."""
        times = zip(self.levels, self.failures, strict=False)
        failed = [level for level, t in times if not math.isnan(t)]
        # levels within the limit fail, too, if damping is beyond what the scheme bears
        is_unstable = self.reason == "unstable"
        least = self.first_stable - 1 if is_unstable else max(self.culprit, self.levels[0])
        return max([least, *failed]) + 1

    def cost_of_first(self) -> str:
        return self.cost([self.first_good()])

    def place(self) -> str:
        """Say where the calculation broke down, as far as that is known."""
        if self.culprit < 0:
            return ""
        where, number = f" at level {self.culprit}", self.notation.number
        if self.singular == 0.0:
            return f" in the first step at level {self.culprit} and at every finer one"
        if not math.isnan(self.singular):
            again = f"level {self.levels[-1]} produced one at t = {number(self.singular, 4)}"
            return f"{where}. Finer levels do not avoid it; {again}"
        at = dict(zip(self.levels, self.failures, strict=False)).get(self.culprit, math.nan)
        return where if math.isnan(at) else f"{where}, at t = {number(at, 4)}"

    def before_round_off(self) -> str:
        return f". The only estimate before that is {self.measured()}" if self.order > 0.0 else ""

    def coarser(self) -> str:
        """Say which levels show an order; the text starts with the second letter."""
        is_fine = self.readable >= max(self.levels[-1], 2)
        if self.readable >= 2 and not is_fine:
            first = max(self.readable - 3, 0)
            return f"se coarser `levels:`, such as {first} to {self.readable}, because finer ones are round-off"
        last = self.last if self.last >= 0 else self.levels[-1 if is_fine else 0]
        below = f"se coarser `levels:`, below {max(last, 1)},"
        if not is_fine:
            return f"{below} or a longer `time: end`"
        return (
            f"{below} and look for noise above round-off in `model:` and `schemes:`. Round-off alone would leave an "
            f"order readable up to level {self.readable}"
        )

    def other_arithmetic(self) -> str:
        """Say in which arithmetic and on which levels an order can be read, as far as that is predicted."""
        coarser = self.coarser()
        if not self.order > 0.0:
            coarser += ". If the coarser ones are round-off, too, the scheme is exact here, and another `model:` "
            coarser += "shows its order"
        if self.options.get("arithmetic", "compensated") == "compensated":
            return f"U{coarser}"
        reach = f" (the order can be read up to level {self.compensated})"
        reach = reach if self.compensated > self.readable else ""
        return f"Set `arithmetic: compensated` for scheme {self.scheme}{reach}, or u{coarser}"

    def add(self, count: int = 2) -> str:
        """Ask for `count` finer levels, with their cost."""
        return f"A{add_levels(self.levels[-1], count, self.cost)}"

    def add_missing(self) -> str:
        return self.add(min(max(4 - len(self.levels), 1), 2))

    def count(self) -> str:
        count = len(self.levels)
        return f"{count} level{'s are' if count > 1 else ' is'}"

    def more_levels(self) -> str:
        kick = f", or set `end_velocity: kick` for scheme {self.scheme}" if self.ends_low else ""
        if self.more < 1:
            return f"{self.add()}{kick}; the number needed is not known yet."
        verb = "is" if self.more == 1 else "are"
        return f"{self.add(self.more)}{kick}; {self.more} more {verb} probably needed."

    def tenfold(self) -> float:
        return math.log(10.0) / self.parting_rate

    def or_finer(self) -> str:
        """Say what finer levels do for a motion that amplifies errors."""
        order = self.expected if math.isfinite(self.expected) else self.promised
        count = levels_to_the_end(self.parts_at, self.parting_rate, self.end, order) + 1
        if self.levels[-1] + count > MAX_LEVEL:
            return ". Finer levels part later, but none reaches the end, because rounding errors grow alike"
        return f", or a{add_levels(self.levels[-1], int(count), self.cost)}"

    def level_of_pulse(self) -> int:
        steps = math.ceil(math.log2(self.shortest / self.pulse[1]))
        return self.levels[-1] + max(steps, 0) + 1

    def decay_time(self) -> float:
        return 1.0 / self.decay

    def level_of_decay(self) -> int:
        return self.levels[-1] + max(math.ceil(math.log2(self.shortest * self.decay)), 1)

    def jump(self) -> str:
        power = self.corner.power if self.corner else math.nan
        if power % 1.0:
            least = self.notation.number(power - 1.0)
            return f"the force changes like the power {least} of the distance"
        known = {1.0: "the force jumps", 2.0: "the force has a corner"}
        return known.get(power, "a derivative of the force jumps")

    def corner_place(self) -> str:
        return "at a grid point" if self.corner and self.corner.on_a_point else "within a step"

    def beside_corner(self) -> str:
        """Add the last estimate, and the order that the scheme promises without the corner if that is too low."""
        text = f"; the last estimate is {self.measured()}" if self.order > 0.0 else ""
        if self.promises_less:
            order = self.notation.number(self.promised)
            text += f". Scheme {self.scheme} promises no more than order {order} without it"
        return text

    def end_before_corner(self) -> str:
        """Ask to end before the corner, or for a scheme of an order that the corner leaves regular."""
        assert self.corner is not None
        number, power = self.notation.number, self.corner.power
        if self.corner.on_a_point and power > 1.0:
            # a broken power leaves this order regular there
            before = f" before t = {number(self.corner.time, 4)}"
            end = f", or end the time interval (`time: end`){before}" * (self.corner.time > 0.0)
            return f"Set `order: {number(power)}`{end}."
        most, order = max(power - 1.0, 1.0), self.promised if self.promises_less else self.expected
        start = "Set `order: scheme`, and end" if self.promises_less else "End"
        lower = (
            f", or take a scheme (`schemes:`) of order {number(most)}{' at most' * (power > 1.0)}"
        )
        return (
            f"{start} the time interval (`time: end`) before t = {number(self.corner.time, 4)} to see "
            f"order {number(order)}{'' if self.promised <= most else lower}."
        )

    def so_far(self) -> str:
        if not self.measured():
            return ""
        return f". The last estimate is {self.measured()}{self._trend()}"

    def _trend(self) -> str:
        """Describe the trend of the orders; empty if it is unknown or they are near their goal."""
        known, due = [order for order in self.orders if math.isfinite(order)], self.expected
        if known and math.isfinite(self.promised):
            # the goal is the promised order if the last order is nearer to that
            due = min(self.expected, self.promised, key=lambda order: abs(known[-1] - order))
        if not known or not math.isfinite(due) or abs(known[-1] - due) <= NEAR_DUE:
            return ""
        known = known[-LAST_ORDERS:]
        goal, is_above = f"order {self.notation.number(due)}", known[-1] > due
        why = ", because a higher power of dt still dominates" if is_above else ""
        if len(known) == 1:
            return f", which is above {goal}{why}" if is_above else ""
        listed = ", ".join(f"{order:.2f}" for order in known)
        start = ". From level to level the estimates"
        if abs(known[-1] - known[-2]) < HARDLY * abs(known[-1] - due):
            return f"{start} hardly change ({listed})"
        steps = {math.copysign(1.0, b - a) for a, b in pairwise(known)}
        same_side = all((order > due) == is_above for order in known)
        if len(steps) > 1 or not same_side:
            return f"{start} do not settle ({listed})"
        if (steps == {-1.0}) != is_above:
            return f"{start} move away from {goal} ({listed})"
        return f"{start} {'fall' if is_above else 'rise'} towards {goal} ({listed}){why}"

    def hidden(self) -> str:
        """Say which promised power may dominate on finer levels, as near a special case; empty if there is none."""
        if found := self.in_theory():
            return found
        if not self.promised + HALF_SPACING < min(self.order, self.special):
            return ""
        return (
            f" Scheme {self.scheme} has an error of order {self.notation.number(self.promised)} here, which may still "
            "be too small to see. Finer levels decide."
        )

    def in_theory(self) -> str:
        """Say which lower order theory finds than the scheme promises; empty if none."""
        if not self.on_oscillator < self.promised:
            return ""
        found, promised = map(self.notation.number, (self.on_oscillator, self.promised))
        return (
            f" Scheme {self.scheme} promises order {promised}, but without rounding it has order {found} on "
            "u'' + w^2 u = 0."
        )

    def likely(self) -> float:
        return round(2 * self.order) / 2 if math.isfinite(self.order) else math.nan

    def or_expect(self) -> str:
        if not self.likely() > 0:
            return " (`schemes:`)"
        return f", or set `order: {self.notation.number(self.likely())}` if you expect it"

    def or_kick(self) -> str:
        has_option = "end_velocity" in self.options
        return f", or set `end_velocity: kick` for scheme {self.scheme}" if has_option else ""
