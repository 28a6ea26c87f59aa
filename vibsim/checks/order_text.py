"""What was measured of a convergence, and what to change in the YAML: a sentence and an advice for every diagnosis.

A diagnosis is the reason of a verdict, made finer by the cause where one is known. Templates are filled from the
`OrderContext` (``s``) and from phrases on it (``p``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

from vibsim.checks.order_context import OrderContext
from vibsim.checks.sentences import Description, Found, Template, growth_in_words
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

START_FINER = "Start `levels:` at {} or finer ({{p.cost_of_start}}), or shorten `time: end`."
TOO_COARSE = "The step is still too coarse to tell"
NOTHING_SHOWN = "differences between levels do not show the error of {s.what}"
CANNOT_SHOW = "{s.subject} cannot show order {s.expected}, because "
ON_MESH = "Set `events: located` for scheme {s.scheme}."
ON_TABLE = (
    "Choose steps in `time:` that end at every point of the table: at the coarsest level, dt is its spacing over the "
    "speed, or a whole part of that."
)

DIAGNOSES: Words = {
    "asymptotic": (
        "{s.subject} converges with {p.measured}, as {p.due} (order {s.expected}). The rescaled differences "
        "coincide.{p.doubt}{p.unseen}",
        "",
    ),
    "exact": (
        "{s.subject} is exact: the levels differ by round-off only, and there is no order to measure.{p.unseen}",
        "",
    ),
    "wrong_limit": (
        "The levels of {s.what} approach each other, but not the exact solution. The error that remains is larger than "
        "their differences allow.",
        "Check `model:` and `initial:` against the equation that you mean: finer levels will not help.",
    ),
    "unstable, beyond the limit": (
        "The run is unstable: at level {s.culprit}, w dt = {s.omega_dt:4} is beyond the limit {s.limit} of scheme "
        "{s.scheme}{p.growth}; level {s.first_stable} is the first within it.",
        START_FINER.format("{s.first_stable}"),
    ),
    "unstable": (
        "{s.subject} is unstable: the solution grows where the exact one does not, and finer levels do not remove "
        "that.",
        START_FINER.format("{s.first_stable}"),
    ),
    "non_finite, from the start": (
        "The calculation of {s.what} met a number that is not finite{p.place}.",
        "Check the formulas of `model:` at t = 0, and `initial:`: something has no finite value there (a quotient of "
        "two zeros takes its limit by a condition, sin(t)/t if t > 0 else 1).",
    ),
    "non_finite, always": (
        "The calculation of {s.what} met a number that is not finite{p.place}.",
        "End the time interval (`time: end`) before t = {s.singular:4}, or check the formulas of `model:`: finer "
        "levels will not help where the motion escapes, or a formula has no finite value.",
    ),
    "non_finite": (
        "The calculation of {s.what} met a number that is not finite{p.place}.",
        START_FINER.format("{s.first_sound}"),
    ),
    "round_off": (
        "The differences of {s.what} have reached the floor of round-off, where they say nothing about the "
        "scheme{p.before_round_off}.",
        "{p.other_arithmetic}.",
    ),
    "round_off, noise": (
        "The finest differences of {s.what} look like noise, but are larger than the predicted round-off. They say "
        "nothing about the scheme{p.before_round_off}.",
        "{p.other_arithmetic}.",
    ),
    "round_off, stored": (
        "The differences of {s.what} have reached the floor of round-off of the single precision that it is stored in, "
        "where they say nothing about the scheme{p.before_round_off}.",
        "Store the states in double precision (float64), or u{p.coarser}.",
    ),
    "oscillating": (
        "The differences of {s.what} oscillate from level to level, so no order can be read from them.",
        "{p.add_two}, or measure in another `norm:`.",
    ),
    "too_few_levels": (
        "{p.count} too few to judge the convergence of {s.what}: three are needed, four are better.",
        "{p.add_missing}.",
    ),
    "not_applicable, adaptive": (
        "Scheme {s.scheme} is adaptive: it chooses its own steps, whatever the level, so an order of {s.what} does not "
        "exist.",
        "Name schemes with a fixed step (`schemes:`), or ask for its error with a `value:` check.",
    ),
    "not_applicable, still": (
        "{s.subject} does not change after the start, or too little for an error to show: the levels agree whatever "
        "the scheme does, and there is nothing to judge.",
        "Choose `initial:` values, a force or a `time: end` with which {s.what} moves from one common time to the "
        "next.",
    ),
    "not_applicable": (
        "{s.subject} does not exist here, so there is nothing to judge.",
        "Choose a quantity (`converges:`) that this model and scheme have.",
    ),
    "pulse": (
        "Near t = {s.pulse[0]} the force has a pulse of length {s.pulse[1]:1} or so{p.within_pulse}, which lies "
        "between two points of every level (the shortest step is {s.shortest:2}). No level sees it, so the "
        + NOTHING_SHOWN
        + ".",
        "Use steps that are shorter than the pulse, from level {p.level_of_pulse} on, write a wider pulse of the same "
        "impulse, or end the time interval (`time: end`) before t = {s.pulse[0]}.",
    ),
    "decay": (
        "The damping takes a velocity away at a rate of up to {s.decay:2}, within a time of {p.decay_time:2}. That is "
        "less than the shortest step, {s.shortest:2}: no level sees how the motion decays there, so the "
        + NOTHING_SHOWN
        + ".",
        "Use steps that are shorter than that, from level {p.level_of_decay} on, or a weaker damping; `initial:` "
        "velocities that the damping leaves as they are may do as well.",
    ),
    "non_smooth, mesh": (
        "Scheme {s.scheme} leaves events to the mesh, which notices them up to a step late, wherever they lie between "
        "two points: the error of {s.what} has no regular expansion in powers of dt.",
        ON_MESH,
    ),
    "non_smooth, table": (
        "Between the points of its table the force is a straight line, and its corners lie within steps, at each level "
        "elsewhere: the error of {s.what} has no regular expansion in powers of dt.",
        ON_TABLE,
    ),
    "non_smooth, jump at a point": (
        CANNOT_SHOW
        + "the force jumps at a grid point: {s.corner.words} at t = {s.corner.time:4}, and the steps on both "
        "sides use the same value there. Expect order 1{p.beside_corner}.",
        "{p.end_before_corner}",
    ),
    "non_smooth, corner": (
        CANNOT_SHOW
        + "{p.corner} within a step: {s.corner.words} at t = {s.corner.time:4}. Expect order "
        "{s.corner.power}{p.beside_corner}.",
        "{p.end_before_corner}",
    ),
    "non_smooth": (
        "{s.subject} is not smooth, so its error has no regular expansion in powers of dt.",
        "Set `order:` to what the kink allows, or end the time interval (`time: end`) before it.",
    ),
    "pre_asymptotic, still": (
        "{s.subject} lies still at every common time, while the exact solution moves: the step is still too coarse to "
        "see that.",
        "{p.more_levels}",
    ),
    "pre_asymptotic, growing": (
        "The differences of {s.what} grow from level to level ({p.measured}): the step is still too coarse to tell an "
        "order, or level {s.last} is not of one kind with those before it.{s.parts}",
        "{p.more_levels}",
    ),
    "pre_asymptotic, steep": (
        TOO_COARSE
        + " the order of {s.what}: its differences fall faster on levels {s.first} to {s.last} than those of "
        "any power of dt, as where the coarser ones have nothing to do with the solution.{s.parts}",
        "{p.more_levels}",
    ),
    "pre_asymptotic": (
        TOO_COARSE + " the order of {s.what}{p.so_far}.{p.hidden}{s.parts}",
        "{p.more_levels}",
    ),
}

LOW = "{s.subject} converges slower than order {s.expected}, with {p.measured}."
LOW_OF_EXACT = "{s.subject} is promised to be exact, but the levels differ by more than round-off{p.with_order}."
PROMISED_LESS = " Scheme {s.scheme} promises no more than order {s.promised} here"
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
        "Set `kind: central` for scheme {s.scheme}, which centres the damping, or `order: scheme`.",
    ),
    "promise, start": (
        PROMISED_LESS + ".",
        "Set `start: centred` for scheme {s.scheme}, or `order: scheme`.",
    ),
    "promise": (
        PROMISED_LESS + ".",
        "Set `order: scheme`, or another `kind:` than that of scheme {s.scheme}.",
    ),
    "start": (
        " The likely cause is the first step: `start: first_order` leaves its dt^2 term out.",
        "Set `start: centred` for scheme {s.scheme}.",
    ),
    "end": (
        " The likely cause is the last point: `end_velocity: {s.options[end_velocity]}` is a one-sided formula of "
        "lower order.",
        "Set `end_velocity: kick` for scheme {s.scheme}, or measure with `norm: linf_interior`.",
    ),
    "last_point": (
        " Without the last point the order is the expected one: what is of lower order is a formula at the end.",
        "Measure with `norm: linf_interior`{p.or_kick}.",
    ),
    "one_quantity": (
        " Another state has the expected order: what is of lower order is how {s.what} is made, not the step.",
        "Look for a formula of lower order that {s.what} alone is made with{p.or_expect}.",
    ),
    "everything": (
        " It is so in every state and at every time, so that it is a term of the step of scheme {s.scheme}, of its "
        "start, or of the force that it evaluates.",
        "Look for a term of lower order in scheme {s.scheme}{p.or_expect}.",
    ),
    "none": ("", "Look for a term of lower order in scheme {s.scheme}{p.or_expect}."),
}

HIGH = "{s.subject} converges faster than order {s.expected}, with {p.measured}."
NO_SYMMETRY = "Try other `initial:` values or another `time: end`, where nothing cancels by symmetry{p.or_expect}."
HIGH_CAUSES: Words = {
    "promise": (" Scheme {s.scheme} promises order {s.promised} here.", "Set `order: scheme`."),
    "promise, exact": (" Scheme {s.scheme} promises to be exact here.", "Set `order: scheme`."),
    "special_times": (
        " All common times are turning points of {s.what}: most of an error is a shift in time, which does not show "
        "there. This is no higher order.",
        "Choose another `time: end`, or start `levels:` at a finer level, so that the common times are not turning "
        "points alone.",
    ),
    "theory": (
        " The theory of scheme {s.scheme} has that order on this linear model, too.",
        "Set `order: {p.likely}`, which the theory of scheme {s.scheme} has here.",
    ),
    "one_norm": (
        " In another norm than {s.norm} the order is the expected one: errors cancel in this one.",
        "Measure in another `norm:`{p.or_expect}.",
    ),
    "one_quantity": (
        " Another state has the expected order: the leading error vanishes in {s.what}, not in every state.",
        "Check another state (`converges:`){p.or_expect}.",
    ),
    "everything": (" It is so in every state and every norm.", NO_SYMMETRY),
    "none": ("", NO_SYMMETRY),
}


def describe(f: Found, check: ConvergesCheck) -> Description:
    """Say what was measured of a convergence, and what to change where it is not what the check asks for."""
    return in_words(OrderContext(f, check))


def in_words(s: OrderContext) -> Description:
    """Fill the templates of the diagnosis."""
    if s.reason == "order_low":
        why, advice = LOW_CAUSES[_cause_of_low(s)]
        sentence = LOW_OF_EXACT if math.isinf(s.expected) else f"{LOW}{why}{{s.parts}}"
    elif s.reason == "order_high":
        why, advice = HIGH_CAUSES[_cause_of_high(s)]
        sentence = f"{HIGH}{why}{{s.parts}}"
    else:
        sentence, advice = DIAGNOSES[_diagnosis(s)]
    write, phrases = Template(s.notation), _Phrases(s)
    return Description(write.format(sentence, s=s, p=phrases), write.format(advice, s=s, p=phrases))


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


class _Phrases:
    """Parts of sentences that depend on numbers."""

    def __init__(self, context: OrderContext) -> None:
        self.s = context

    def measured(self) -> str:
        """The stated order with its interval and levels; empty where there is none."""
        s = self.s
        if math.isnan(s.order):
            return ""
        known = math.isfinite(s.low) and math.isfinite(s.high)
        between = f" (between {s.low:.3f} and {s.high:.3f})" if known else ""
        return f"order {s.order:.3f}{between} on levels {s.first} to {s.last}"

    def with_order(self) -> str:
        return f": with {self.measured()}" if self.measured() else ""

    def due(self) -> str:
        """Whose the order is: the scheme's, or that of the check alone, where theory has none or another one."""
        s = self.s
        return (
            "promised" if s.has_promise and not (s.promises_less or s.promises_more) else "expected"
        )

    def doubt(self) -> str:
        """Of an order that passes, why its interval reaches far down; empty where it does not."""
        if not self.s.order - self.s.low > FAR_DOWN:
            return ""
        return (
            " A small error of lower order cannot be ruled out, so the interval extends down to order "
            f"{self.s.low:.1f}. Add a level to settle it."
        )

    def unseen(self) -> str:
        """What levels that approach each other do not tell."""
        if self.s.has_exact:
            return ""
        return " There is no exact solution, so convergence to a wrong answer would go unnoticed."

    def growth(self) -> str:
        return growth_in_words(*self.s.growth, self.s.growth_of, self.s.notation)

    def cost_of_start(self) -> str:
        s = self.s
        return s.cost([s.first_stable if s.reason == "unstable" else s.first_sound])

    def place(self) -> str:
        """Where a calculation broke down, as far as it is known."""
        s, number = self.s, self.s.notation.number
        if s.culprit < 0:
            return ""
        where = f" at level {s.culprit}"
        if s.singular == 0.0:
            return f"{where}, in its first step, and so does every finer level"
        if not math.isnan(s.singular):
            again = f"level {s.levels[-1]} met one at t = {number(s.singular, 4)}"
            return f"{where}, and finer ones do not avoid it: {again}"
        at = dict(zip(s.levels, s.failures, strict=False)).get(s.culprit, math.nan)
        return where if math.isnan(at) else f"{where}, at t = {number(at, 4)}"

    def before_round_off(self) -> str:
        return f"; before it, {self.measured()} is all that is left" if self.s.order > 0.0 else ""

    def coarser(self) -> str:
        """Which levels show an order, from the second letter on."""
        s = self.s
        if s.readable < 2:
            last = s.levels[0] if s.last < 0 else s.last
            return f"se coarser `levels:`, below {max(last, 1)}, or a longer `time: end`"
        if s.readable >= s.levels[-1]:
            last = s.levels[-1] if s.last < 0 else s.last
            return (
                f"se coarser `levels:`, below {max(last, 1)}, and look for what is rougher than rounding in `model:` "
                f"and `schemes:`: that alone would leave an order up to level {s.readable}"
            )
        return f"se coarser `levels:`, such as {max(s.readable - 3, 0)} to {s.readable}: finer ones are round-off"

    def other_arithmetic(self) -> str:
        """The arithmetic and the levels with which an order can be read, as far as they are predicted."""
        s, coarser = self.s, self.coarser()
        if not s.order > 0.0:
            coarser += "; where those are round-off, too, the scheme is exact here, and another `model:` shows its "
            coarser += "order"
        if s.options.get("arithmetic", "compensated") == "compensated":
            return f"U{coarser}"
        reach = (
            f" (it can be read up to level {s.compensated})" if s.compensated > s.readable else ""
        )
        return f"Set `arithmetic: compensated` for scheme {s.scheme}{reach}, or u{coarser}"

    def _add(self, count: int) -> str:
        """Ask for so many finer levels, with what they cost."""
        levels = [self.s.levels[-1] + 1 + i for i in range(count)]
        names = {1: f"level {levels[0]}", 2: f"levels {levels[0]} and {levels[-1]}"}
        which = names.get(count, f"levels {levels[0]} to {levels[-1]}")
        return f"Add {which} to `levels:` ({self.s.cost(levels)})"

    def add_two(self) -> str:
        return self._add(2)

    def count(self) -> str:
        count = len(self.s.levels)
        return f"{count} level{'s are' if count > 1 else ' is'}"

    def add_missing(self) -> str:
        return self._add(min(max(4 - len(self.s.levels), 1), 2))

    def more_levels(self) -> str:
        s = self.s
        kick = f", or set `end_velocity: kick` for scheme {s.scheme}" if s.ends_low else ""
        if s.more < 1:
            return f"{self._add(2)}{kick}; how many are needed cannot be told yet."
        needed = "is probably what is" if s.more == 1 else "are probably what is"
        return f"{self._add(s.more)}{kick}; {s.more} more {needed} needed."

    def within_pulse(self) -> str:
        return ", between two jumps or corners" if self.s.reason == "non_smooth" else ""

    def level_of_pulse(self) -> int:
        steps = math.ceil(math.log2(self.s.shortest / self.s.pulse[1]))
        return self.s.levels[-1] + max(steps, 0) + 1

    def decay_time(self) -> float:
        return 1.0 / self.s.decay

    def level_of_decay(self) -> int:
        return self.s.levels[-1] + max(math.ceil(math.log2(self.s.shortest * self.s.decay)), 1)

    def corner(self) -> str:
        power = self.s.corner.power if self.s.corner else math.nan
        return {1.0: "the force jumps", 2.0: "the force has a corner"}.get(
            power, "a derivative of the force jumps"
        )

    def beside_corner(self) -> str:
        """What was measured beside the order that a corner leaves, and what a scheme promises without it."""
        s = self.s
        found = f"; the last estimate is {self.measured()}" if s.order > 0.0 else ""
        if s.promises_less:
            order = s.notation.number(s.promised)
            found += f". Scheme {s.scheme} promises no more than order {order} without it"
        return found

    def end_before_corner(self) -> str:
        """Advice to stop before a corner, or to take a scheme of an order that it leaves regular."""
        s, number = self.s, self.s.notation.number
        assert s.corner is not None
        most = max(s.corner.power - 1.0, 1.0)
        at_most = " at most" if s.corner.power > 1.0 else ""
        lower = (
            ""
            if s.promised <= most
            else f", or take a scheme (`schemes:`) of order {number(most)}{at_most}"
        )
        return (
            f"{'Set `order: scheme`, and end' if s.promises_less else 'End'} the time interval (`time: end`) before t "
            f"= {number(s.corner.time, 4)}, where order {number(s.promised if s.promises_less else s.expected)} can be "
            f"seen{lower}."
        )

    def so_far(self) -> str:
        return (
            f": the last estimate is {self.measured()}{self._trend(self.s.due)}"
            if self.measured()
            else ""
        )

    def _trend(self, due: float) -> str:
        """Say where orders go; empty where it is not known, or they are near the one that levels should approach."""
        known = [order for order in self.s.orders if math.isfinite(order)][-LAST_ORDERS:]
        if not known or not math.isfinite(due) or abs(known[-1] - due) <= NEAR_DUE:
            return ""
        goal, is_above = f"order {self.s.notation.number(due)}", known[-1] > due
        why = ": a higher power of dt still outweighs that one" if is_above else ""
        if len(known) == 1:
            return f", which is above {goal}{why}" if is_above else ""
        told = ", ".join(f"{order:.2f}" for order in known)
        steps = {math.copysign(1.0, b - a) for a, b in pairwise(known)}
        same_side = all((order > due) == is_above for order in known)
        if len(steps) > 1 or not same_side:
            return f"; from level to level the estimates are {told}, which do not settle"
        if (steps == {-1.0}) != is_above:
            return f"; from level to level the estimates move away from {goal} ({told})"
        return f"; from level to level the estimates {'fall' if is_above else 'rise'} towards {goal} ({told}){why}"

    def hidden(self) -> str:
        """Which power may take over on finer levels; empty where none is known to."""
        if not self.s.may_hide:
            return ""
        return (
            f" Scheme {self.s.scheme} has an error of order {self.s.notation.number(self.s.promised)} here, which may "
            "still be too small to be seen: finer levels decide."
        )

    def likely(self) -> float:
        return round(2 * self.s.order) / 2 if math.isfinite(self.s.order) else math.nan

    def or_expect(self) -> str:
        if not self.likely() > 0:
            return " (`schemes:`)"
        return f", or set `order: {self.s.notation.number(self.likely())}` if you expect it"

    def or_kick(self) -> str:
        has_option = "end_velocity" in self.s.options
        return f", or set `end_velocity: kick` for scheme {self.s.scheme}" if has_option else ""
