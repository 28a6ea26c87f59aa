"""What was measured of a convergence, and what to change in the YAML: a sentence and an advice for every diagnosis.

A diagnosis is the reason of a verdict, made finer by the cause where one is known. Templates are filled from the
attributes and phrases of an `OrderText`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

from vibsim.checks.order_context import OrderContext
from vibsim.checks.sentences import Description, Found, Template, growth_in_words
from vibsim.convergence.thresholds import HALF_SPACING
from vibsim.schemes.base import is_on_the_mesh

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConvergesCheck

HIGHEST = 12.0
"""An estimate above is the order of no scheme."""
FAR_DOWN = 1.0
"""An interval that reaches further below its order holds a lower power of the expansion as well."""
LAST_ORDERS = 4
"""So many of the last orders are looked at, and told."""
NEAR_DUE = 0.3
"""Orders this near to the one that is due need no word on where they go."""
BACKWARD_DAMPING = "central_backward_damping"
"""The scheme whose order is lost by its treatment of damping alone."""

Words = Mapping[str, tuple[str, str]]
"""Diagnosis to the templates of sentence and advice."""

START_FINER = "Start `levels:` at {first_good} or finer ({cost_of_first}), or shorten `time: end`."
TOO_COARSE = "The step is still too coarse to tell"
NOTHING_SHOWN = "differences between levels do not show the error of {what}"
CANNOT_SHOW = "{subject} cannot show order {expected}, because "
ON_MESH = "Set `events: located` for scheme {scheme}."
ON_TABLE = (
    "Choose steps in `time:` that end at every point of the table: at the coarsest level, dt is its spacing over the "
    "speed, or a whole part of that."
)

NOT_FINITE = "The calculation of {what} met a number that is not finite{place}."
DIAGNOSES: Words = {
    "asymptotic": (
        "{subject} converges with {measured}, as {whose} (order {expected}). The rescaled differences "
        "coincide.{doubt}{unseen}",
        "",
    ),
    "exact": (
        "{subject} is exact: the levels differ by round-off only, and there is no order to measure.{unseen}",
        "",
    ),
    "wrong_limit": (
        "The levels of {what} approach each other, but not the exact solution. The error that remains is larger than "
        "their differences allow.",
        "Check `model:` and `initial:` against the equation that you mean: finer levels will not help.",
    ),
    "unstable, beyond the limit": (
        "The run is unstable: at level {culprit}, w dt = {omega_dt:4} is beyond the limit {limit} of scheme "
        "{scheme}{growth_in_words}; level {first_stable} is the first within it.",
        START_FINER,
    ),
    "unstable": (
        "{subject} is unstable: the solution grows where the exact one does not, and finer levels do not remove that.",
        START_FINER,
    ),
    "non_finite, from the start": (
        NOT_FINITE,
        "Check the formulas of `model:` at t = 0, and `initial:`: something has no finite value there (a quotient of "
        "two zeros takes its limit by a condition, sin(t)/t if t > 0 else 1).",
    ),
    "non_finite, always": (
        NOT_FINITE,
        "End the time interval (`time: end`) before t = {singular:4}, or check the formulas of `model:`: finer "
        "levels will not help where the motion escapes, or a formula has no finite value.",
    ),
    "non_finite": (
        NOT_FINITE,
        START_FINER,
    ),
    "round_off": (
        "The differences of {what} have reached the floor of round-off, where they say nothing about the "
        "scheme{before_round_off}.",
        "{other_arithmetic}.",
    ),
    "round_off, noise": (
        "The finest differences of {what} look like noise, but are larger than the predicted round-off. They say "
        "nothing about the scheme{before_round_off}.",
        "{other_arithmetic}.",
    ),
    "round_off, stored": (
        "The differences of {what} have reached the floor of round-off of the single precision that it is stored in, "
        "where they say nothing about the scheme{before_round_off}.",
        "Store the states in double precision (float64), or u{coarser}.",
    ),
    "oscillating": (
        "The differences of {what} oscillate from level to level, so no order can be read from them.",
        "{add}, or measure in another `norm:`.",
    ),
    "too_few_levels": (
        "{count} too few to judge the convergence of {what}: three are needed, four are better.",
        "{add_missing}.",
    ),
    "not_applicable, adaptive": (
        "Scheme {scheme} is adaptive: it chooses its own steps, whatever the level, so an order of {what} does not "
        "exist.",
        "Name schemes with a fixed step (`schemes:`), or ask for its error with a `value:` check.",
    ),
    "not_applicable, still": (
        "{subject} does not change after the start, or too little for an error to show: the levels agree whatever "
        "the scheme does, and there is nothing to judge.",
        "Choose `initial:` values, a force or a `time: end` with which {what} moves from one common time to the next.",
    ),
    "not_applicable": (
        "{subject} does not exist here, so there is nothing to judge.",
        "Choose a quantity (`converges:`) that this model and scheme have.",
    ),
    "pulse": (
        "Near t = {pulse[0]} the force has a pulse of length {pulse[1]:1} or so{within_pulse}, which lies "
        "between two points of every level (the shortest step is {shortest:2}). No level sees it, so the "
        + NOTHING_SHOWN
        + ".",
        "Use steps that are shorter than the pulse, from level {level_of_pulse} on, write a wider pulse of the same "
        "impulse, or end the time interval (`time: end`) before t = {pulse[0]}.",
    ),
    "decay": (
        "The damping takes a velocity away at a rate of up to {decay:2}, within a time of {decay_time:2}. That is "
        "less than the shortest step, {shortest:2}: no level sees how the motion decays there, so the "
        + NOTHING_SHOWN
        + ".",
        "Use steps that are shorter than that, from level {level_of_decay} on, or a weaker damping; `initial:` "
        "velocities that the damping leaves as they are may do as well.",
    ),
    "non_smooth, mesh": (
        "Scheme {scheme} leaves events to the mesh, which notices them up to a step late, wherever they lie between "
        "two points: the error of {what} has no regular expansion in powers of dt.",
        ON_MESH,
    ),
    "non_smooth, table": (
        "Between the points of its table the force is a straight line, and its corners lie within steps, at each level "
        "elsewhere: the error of {what} has no regular expansion in powers of dt.",
        ON_TABLE,
    ),
    "non_smooth, jump at a point": (
        CANNOT_SHOW
        + "the force jumps at a grid point: {corner.words} at t = {corner.time:4}, and the steps on both "
        "sides use the same value there. Expect order 1{beside_corner}.",
        "{end_before_corner}",
    ),
    "non_smooth, corner": (
        CANNOT_SHOW + "{jump} within a step: {corner.words} at t = {corner.time:4}. Expect order "
        "{corner.power}{beside_corner}.",
        "{end_before_corner}",
    ),
    "non_smooth": (
        "{subject} is not smooth, so its error has no regular expansion in powers of dt.",
        "Set `order:` to what the kink allows, or end the time interval (`time: end`) before it.",
    ),
    "pre_asymptotic, still": (
        "{subject} lies still at every common time, while the exact solution moves: the step is still too coarse to "
        "see that.",
        "{more_levels}",
    ),
    "pre_asymptotic, growing": (
        "The differences of {what} grow from level to level ({measured}): the step is still too coarse to tell an "
        "order, or level {last} is not of one kind with those before it.{parts}",
        "{more_levels}",
    ),
    "pre_asymptotic, steep": (
        TOO_COARSE
        + " the order of {what}: its differences fall faster on levels {first} to {last} than those of "
        "any power of dt, as where the coarser ones have nothing to do with the solution.{parts}",
        "{more_levels}",
    ),
    "pre_asymptotic": (
        TOO_COARSE + " the order of {what}{so_far}.{hidden}{parts}",
        "{more_levels}",
    ),
}

LOW = "{subject} converges slower than order {expected}, with {measured}."
LOW_OF_EXACT = (
    "{subject} is promised to be exact, but the levels differ by more than round-off{with_order}."
)
PROMISED_LESS = " Scheme {scheme} promises no more than order {promised} here"
LOW_CAUSES: Words = {
    "mesh": (
        " The likely cause is `events: mesh`: an event is noticed up to a step late.",
        ON_MESH,
    ),
    "table": (
        " The likely cause is the table: the force has corners at its points, which lie within steps.",
        ON_TABLE,
    ),
    "promise, damping": (
        PROMISED_LESS + ": it takes the damping backward.",
        "Set `kind: central` for scheme {scheme}, which centres the damping, or `order: scheme`.",
    ),
    "promise, start": (
        PROMISED_LESS + ".",
        "Set `start: centred` for scheme {scheme}, or `order: scheme`.",
    ),
    "promise": (
        PROMISED_LESS + ".",
        "Set `order: scheme`, or another `kind:` than that of scheme {scheme}.",
    ),
    "start": (
        " The likely cause is the first step: `start: first_order` leaves its dt^2 term out.",
        "Set `start: centred` for scheme {scheme}.",
    ),
    "end": (
        " The likely cause is the last point: `end_velocity: {options[end_velocity]}` is a one-sided formula of "
        "lower order.",
        "Set `end_velocity: kick` for scheme {scheme}, or measure with `norm: linf_interior`.",
    ),
    "last_point": (
        " Without the last point the order is the expected one: what is of lower order is a formula at the end.",
        "Measure with `norm: linf_interior`{or_kick}.",
    ),
    "one_quantity": (
        " Another state has the expected order: what is of lower order is how {what} is made, not the step.",
        "Look for a formula of lower order that {what} alone is made with{or_expect}.",
    ),
    "everything": (
        " It is so in every state and at every time, so that it is a term of the step of scheme {scheme}, of its "
        "start, or of the force that it evaluates.",
        "Look for a term of lower order in scheme {scheme}{or_expect}.",
    ),
    "none": ("", "Look for a term of lower order in scheme {scheme}{or_expect}."),
}

HIGH = "{subject} converges faster than order {expected}, with {measured}."
NO_SYMMETRY = "Try other `initial:` values or another `time: end`, where nothing cancels by symmetry{or_expect}."
HIGH_CAUSES: Words = {
    "promise": (" Scheme {scheme} promises order {promised} here.", "Set `order: scheme`."),
    "promise, exact": (" Scheme {scheme} promises to be exact here.", "Set `order: scheme`."),
    "special_times": (
        " All common times are turning points of {what}: most of an error is a shift in time, which does not show "
        "there. This is no higher order.",
        "Choose another `time: end`, or start `levels:` at a finer level, so that the common times are not turning "
        "points alone.",
    ),
    "theory": (
        " The theory of scheme {scheme} has that order on this linear model, too.",
        "Set `order: {likely}`, which the theory of scheme {scheme} has here.",
    ),
    "one_norm": (
        " In another norm than {norm} the order is the expected one: errors cancel in this one.",
        "Measure in another `norm:`{or_expect}.",
    ),
    "one_quantity": (
        " Another state has the expected order: the leading error vanishes in {what}, not in every state.",
        "Check another state (`converges:`){or_expect}.",
    ),
    "everything": (" It is so in every state and every norm.", NO_SYMMETRY),
    "none": ("", NO_SYMMETRY),
}


def describe(f: Found, check: ConvergesCheck) -> Description:
    """Say what was measured of a convergence, and what to change where it is not what the check asks for."""
    return in_words(OrderText(f, check))


def in_words(s: OrderText) -> Description:
    """Fill the templates of the diagnosis."""
    if s.reason == "order_low":
        why, advice = LOW_CAUSES[_cause_of_low(s)]
        sentence = LOW_OF_EXACT if math.isinf(s.expected) else f"{LOW}{why}{{parts}}"
    elif s.reason == "order_high":
        why, advice = HIGH_CAUSES[_cause_of_high(s)]
        sentence = f"{HIGH}{why}{{parts}}"
    else:
        sentence, advice = DIAGNOSES[_diagnosis(s)]
    template = Template(s, s.notation)
    return Description(template.format(sentence), template.format(advice))


def _diagnosis(s: OrderContext) -> str:
    """Return the diagnosis of a reason but for orders that are too low or too high."""
    if s.reason in ("non_smooth", "pre_asymptotic") and s.cause == "pulse":
        return "pulse"
    if s.reason == "pre_asymptotic" and s.cause == "decay":
        return "decay"
    finer = {
        "unstable": [("beyond the limit", s.is_beyond_limit)],
        "non_finite": [
            ("from the start", s.singular == 0.0),
            ("always", not math.isnan(s.singular)),
        ],
        "round_off": [("noise", s.cause == "noise"), ("stored", s.cause == "stored")],
        "not_applicable": [("adaptive", "tolerance" in s.options), ("still", s.cause == "still")],
        "non_smooth": [
            ("mesh", is_on_the_mesh(s.options)),
            ("table", s.has_corners),
            ("jump at a point", s.corner is not None and s.corner.on_a_point),
            ("corner", s.corner is not None),
        ],
        "pre_asymptotic": [
            ("still", s.cause == "still"),
            ("growing", s.order <= 0.0),
            ("steep", s.order > HIGHEST),
        ],
    }
    for name, applies in finer.get(s.reason, []):
        if applies:
            return f"{s.reason}, {name}"
    return s.reason


def _cause_of_low(s: OrderContext) -> str:
    """Return why an order is lower than expected, by the options of the scheme, else by the data."""
    if is_on_the_mesh(s.options):
        return "mesh"
    if s.has_corners:
        return "table"
    if s.promises_less and s.shows_promise:
        if s.kind == BACKWARD_DAMPING:
            return "promise, damping"
        return "promise, start" if s.centred >= s.expected - s.tolerance else "promise"
    if s.starts_low:
        return "start"
    if s.ends_low:
        return "end"
    return s.cause if s.cause in LOW_CAUSES else "none"


def _cause_of_high(s: OrderContext) -> str:
    if s.promises_more and s.shows_promise:
        return "promise" if math.isfinite(s.promised) else "promise, exact"
    return s.cause if s.cause in HIGH_CAUSES and math.isfinite(s.order) else "none"


class OrderText(OrderContext):
    """The context with phrases that depend on numbers."""

    def measured(self) -> str:
        """Return the stated order with its interval and levels; empty where there is none."""
        if math.isnan(self.order):
            return ""
        known = math.isfinite(self.low) and math.isfinite(self.high)
        between = f" (between {self.low:.3f} and {self.high:.3f})" if known else ""
        return f"order {self.order:.3f}{between} on levels {self.first} to {self.last}"

    def with_order(self) -> str:
        """Return the same at the end of a sentence."""
        return f": with {self.measured()}" if self.measured() else ""

    def whose(self) -> str:
        """Say whose the order is: the scheme's, or that of the check alone, where theory has none or another one."""
        differs = self.promises_less or self.promises_more
        return "promised" if self.has_promise and not differs else "expected"

    def doubt(self) -> str:
        """Say of an order that passes why its interval reaches far down; empty where it does not."""
        if not self.order - self.low > FAR_DOWN:
            return ""
        return (
            " A small error of lower order cannot be ruled out, so the interval extends down to order "
            f"{self.low:.1f}. Add a level to settle it."
        )

    def unseen(self) -> str:
        """Say what levels that approach each other do not tell."""
        if self.has_exact:
            return ""
        return " There is no exact solution, so convergence to a wrong answer would go unnoticed."

    def growth_in_words(self) -> str:
        """Say how the solution grows at the level that is unstable."""
        return growth_in_words(*self.growth, self.growth_of, self.notation)

    def first_good(self) -> int:
        """Return the coarsest level that is stable, or from which on none met a number that is not finite."""
        if self.reason == "unstable":
            return self.first_stable
        times = zip(self.levels, self.failures, strict=False)
        failed = [level for level, t in times if not math.isnan(t)]
        return max([self.culprit, self.levels[0], *failed]) + 1

    def cost_of_first(self) -> str:
        """Return what that level costs."""
        return self.cost([self.first_good()])

    def place(self) -> str:
        """Say where a calculation broke down, as far as it is known."""
        if self.culprit < 0:
            return ""
        where, number = f" at level {self.culprit}", self.notation.number
        if self.singular == 0.0:
            return f"{where}, in its first step, and so does every finer level"
        if not math.isnan(self.singular):
            again = f"level {self.levels[-1]} met one at t = {number(self.singular, 4)}"
            return f"{where}, and finer ones do not avoid it: {again}"
        at = dict(zip(self.levels, self.failures, strict=False)).get(self.culprit, math.nan)
        return where if math.isnan(at) else f"{where}, at t = {number(at, 4)}"

    def before_round_off(self) -> str:
        """Tell the order of the levels before round-off."""
        return f"; before it, {self.measured()} is all that is left" if self.order > 0.0 else ""

    def coarser(self) -> str:
        """Say which levels show an order, from the second letter on."""
        is_fine = self.readable >= max(self.levels[-1], 2)
        if self.readable >= 2 and not is_fine:
            first = max(self.readable - 3, 0)
            return f"se coarser `levels:`, such as {first} to {self.readable}: finer ones are round-off"
        last = self.last if self.last >= 0 else self.levels[-1 if is_fine else 0]
        below = f"se coarser `levels:`, below {max(last, 1)},"
        if not is_fine:
            return f"{below} or a longer `time: end`"
        return (
            f"{below} and look for what is rougher than rounding in `model:` and `schemes:`: that alone would leave an "
            f"order up to level {self.readable}"
        )

    def other_arithmetic(self) -> str:
        """Say in which arithmetic and on which levels an order can be read, as far as they are predicted."""
        coarser = self.coarser()
        if not self.order > 0.0:
            coarser += "; where those are round-off, too, the scheme is exact here, and another `model:` shows its "
            coarser += "order"
        if self.options.get("arithmetic", "compensated") == "compensated":
            return f"U{coarser}"
        reach = f" (it can be read up to level {self.compensated})"
        reach = reach if self.compensated > self.readable else ""
        return f"Set `arithmetic: compensated` for scheme {self.scheme}{reach}, or u{coarser}"

    def add(self, count: int = 2) -> str:
        """Ask for so many finer levels, with what they cost."""
        levels = [self.levels[-1] + 1 + i for i in range(count)]
        names = {1: f"level {levels[0]}", 2: f"levels {levels[0]} and {levels[-1]}"}
        which = names.get(count, f"levels {levels[0]} to {levels[-1]}")
        return f"Add {which} to `levels:` ({self.cost(levels)})"

    def add_missing(self) -> str:
        """Ask for the levels that are missing to four, two at most."""
        return self.add(min(max(4 - len(self.levels), 1), 2))

    def count(self) -> str:
        """Say how many levels there are."""
        count = len(self.levels)
        return f"{count} level{'s are' if count > 1 else ' is'}"

    def more_levels(self) -> str:
        """Ask for the levels that are probably missing."""
        kick = f", or set `end_velocity: kick` for scheme {self.scheme}" if self.ends_low else ""
        if self.more < 1:
            return f"{self.add()}{kick}; how many are needed cannot be told yet."
        needed = "is probably what is" if self.more == 1 else "are probably what is"
        return f"{self.add(self.more)}{kick}; {self.more} more {needed} needed."

    def within_pulse(self) -> str:
        """Say what a force has at the ends of a pulse, where the verdict is that it is not smooth."""
        return ", between two jumps or corners" if self.reason == "non_smooth" else ""

    def level_of_pulse(self) -> int:
        """Return the first level whose step is shorter than the pulse."""
        steps = math.ceil(math.log2(self.shortest / self.pulse[1]))
        return self.levels[-1] + max(steps, 0) + 1

    def decay_time(self) -> float:
        """Return the time in which damping takes a velocity away."""
        return 1.0 / self.decay

    def level_of_decay(self) -> int:
        """Return the first level whose step is shorter than that."""
        return self.levels[-1] + max(math.ceil(math.log2(self.shortest * self.decay)), 1)

    def jump(self) -> str:
        """Say what the force does at its corner."""
        power = self.corner.power if self.corner else math.nan
        known = {1.0: "the force jumps", 2.0: "the force has a corner"}
        return known.get(power, "a derivative of the force jumps")

    def beside_corner(self) -> str:
        """Say what was measured beside the order that a corner leaves, and what a scheme promises without it."""
        found = f"; the last estimate is {self.measured()}" if self.order > 0.0 else ""
        if self.promises_less:
            order = self.notation.number(self.promised)
            found += f". Scheme {self.scheme} promises no more than order {order} without it"
        return found

    def end_before_corner(self) -> str:
        """Ask to stop before a corner, or for a scheme of an order that it leaves regular, where this is none."""
        assert self.corner is not None
        number, power = self.notation.number, self.corner.power
        most, order = max(power - 1.0, 1.0), self.promised if self.promises_less else self.expected
        start = "Set `order: scheme`, and end" if self.promises_less else "End"
        lower = (
            f", or take a scheme (`schemes:`) of order {number(most)}{' at most' * (power > 1.0)}"
        )
        return (
            f"{start} the time interval (`time: end`) before t = {number(self.corner.time, 4)}, where order "
            f"{number(order)} can be seen{'' if self.promised <= most else lower}."
        )

    def so_far(self) -> str:
        """Tell the last estimate of an order, and where orders go."""
        if not self.measured():
            return ""
        return f": the last estimate is {self.measured()}{self._trend()}"

    def _trend(self) -> str:
        """Say where orders go; empty where it is not known, or they are near the one that levels should approach."""
        known, due = [order for order in self.orders if math.isfinite(order)], self.expected
        if known and math.isfinite(self.promised):
            # levels approach the order that the scheme has, where the last order is nearer to that
            due = min(self.expected, self.promised, key=lambda order: abs(known[-1] - order))
        if not known or not math.isfinite(due) or abs(known[-1] - due) <= NEAR_DUE:
            return ""
        known = known[-LAST_ORDERS:]
        goal, is_above = f"order {self.notation.number(due)}", known[-1] > due
        why = ": a higher power of dt still outweighs that one" if is_above else ""
        if len(known) == 1:
            return f", which is above {goal}{why}" if is_above else ""
        told = ", ".join(f"{order:.2f}" for order in known)
        start = "; from level to level the estimates"
        steps = {math.copysign(1.0, b - a) for a, b in pairwise(known)}
        same_side = all((order > due) == is_above for order in known)
        if len(steps) > 1 or not same_side:
            return f"{start} are {told}, which do not settle"
        if (steps == {-1.0}) != is_above:
            return f"{start} move away from {goal} ({told})"
        return f"{start} {'fall' if is_above else 'rise'} towards {goal} ({told}){why}"

    def hidden(self) -> str:
        """Say which power may take over on finer levels, as near a special case; empty where none is known to."""
        if not self.promised + HALF_SPACING < min(self.order, self.special):
            return ""
        return (
            f" Scheme {self.scheme} has an error of order {self.notation.number(self.promised)} here, which may still "
            "be too small to be seen: finer levels decide."
        )

    def likely(self) -> float:
        """Return the order, rounded to a half."""
        return round(2 * self.order) / 2 if math.isfinite(self.order) else math.nan

    def or_expect(self) -> str:
        """Advise to expect the order that was found."""
        if not self.likely() > 0:
            return " (`schemes:`)"
        return f", or set `order: {self.notation.number(self.likely())}` if you expect it"

    def or_kick(self) -> str:
        """Give advice on the last velocity, of a scheme that has the option."""
        has_option = "end_velocity" in self.options
        return f", or set `end_velocity: kick` for scheme {self.scheme}" if has_option else ""
