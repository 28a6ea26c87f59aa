"""Convergence verdicts: a sentence, and advice on what to change in the YAML, for each diagnosis.

The words in braces are attributes and phrases of `vibsim.checks.order_text._Phrases`.
"""

from __future__ import annotations

from collections.abc import Mapping

from vibsim.checks.phase_amplitude_text import NO_PART, PART_ADVICE
from vibsim.checks.sentences import NOT_ZERO_STABLE, WRONG_LIMIT_ADVICE

Words = Mapping[str, tuple[str, str]]
"""Diagnosis to the templates of sentence and advice."""

START_FINER = "Start `levels:` at {first_good} or finer ({cost_of_first}), or shorten `time: end`."
CANNOT_SHOW = "{subject} cannot show order {expected}, because "
ON_MESH = "Set `events: located` for scheme {scheme}."
ON_TABLE = (
    "Choose steps in `time:` that end at every point of the table. The time of each point (on a road, its place over "
    "the speed) must be a whole multiple of the coarsest dt. At t = {table_corner:4} it is not."
)

UNSEEN = " Without an exact solution, convergence to a wrong answer would go unnoticed."
NOT_FINITE = "The calculation of {what} produced a number that is not finite{place}."
PROMISED_LESS = " Scheme {scheme} promises no more than order {promised} here"
NO_SYMMETRY = "Try other `initial:` values or another `time: end`, where nothing cancels by symmetry{or_expect}."
PULSE = (
    "The force has a pulse about {pulse[1]:1} long near t = {pulse[0]}, between two points of every level (the "
    "shortest step is {shortest:2}). No level sees it, so differences do not show the error.",
    "Use steps shorter than the pulse (from level {level_of_pulse} on), write a wider pulse of the same impulse, or "
    "end the time interval (`time: end`) before t = {pulse[0]}.",
)
DIAGNOSES: Words = {
    "asymptotic": (
        "{subject} converges with {measured}, as {whose} (order {expected}).{coincidence}{error}"
        "{doubt}{unseen}",
        "",
    ),
    "exact": (
        "{subject} is exact. The levels differ only by round-off, so there is no order to measure.{unseen}",
        "",
    ),
    "wrong_limit": (
        "The levels of {what} approach each other, but not the exact solution. The remaining error is too large."
        "{error}",
        WRONG_LIMIT_ADVICE,
    ),
    "unstable, beyond the limit": (
        "The run is unstable at level {culprit}, where w dt = {omega_dt:4} is beyond the limit {limit} of scheme "
        "{scheme}{of_limit}. Level {first_stable} is the first within it.{growth_in_words}",
        START_FINER,
    ),
    "unstable, at every step": (
        "{subject} is unstable. The solution grows where the exact one does not.",
        NOT_ZERO_STABLE,
    ),
    "unstable": (
        "{subject} is unstable. The solution grows where the exact one does not, and finer levels do not cure this.",
        START_FINER,
    ),
    "non_finite, from the start": (
        NOT_FINITE,
        "Check the formulas of `model:` at t = 0, and `initial:`. Something has no finite value there. A quotient of "
        "two zeros needs a condition, such as sin(t)/t if t > 0 else 1.",
    ),
    "non_finite, at every step": (NOT_FINITE, NOT_ZERO_STABLE),
    "non_finite, always": (
        NOT_FINITE,
        "End the time interval (`time: end`) before t = {singular:4}, or check the formulas of `model:`. Finer levels "
        "will not help if the motion escapes, a formula has no finite value, or events follow each other without end.",
    ),
    "non_finite": (
        NOT_FINITE,
        START_FINER
        + " If a formula of `model:` has no finite value on the way, such as a force over a mass that "
        "vanishes, finer levels will not help.",
    ),
    "round_off": (
        "The differences of {what} have reached round-off, so they say nothing about the scheme{before_round_off}.",
        "{other_arithmetic}.",
    ),
    "round_off, zero": (
        "{subject} is 0 up to round-off, so it has no order.",
        "Check another quantity (`converges:`), or choose an `initial:` that moves this one.",
    ),
    "round_off, parted": (
        "The levels of {what} have parted: the finest two differ by more than 1 % of its size, and finer levels do not "
        "come closer. A motion that magnifies small errors does that.{error}",
        "End the time interval (`time: end`) before the levels part, or choose another `initial:`.",
    ),
    "round_off, noise": (
        "The finest differences of {what} look like noise, but are larger than the predicted round-off. They say "
        "nothing about the scheme{before_round_off}.",
        "{other_arithmetic}.",
    ),
    "round_off, stored": (
        "{subject} is stored in single precision, and its differences have reached that round-off, so they say "
        "nothing about the scheme{before_round_off}.",
        "Store the states in double precision (float64), or u{coarser}.",
    ),
    "oscillating": (
        "The differences of {what} oscillate from level to level, so no order can be read from them.",
        "{add}, or measure in another `norm:`.",
    ),
    "too_few_levels": (
        "{count} too few to judge the convergence of {what}. Three are needed, and four are better.",
        "{add_missing}.",
    ),
    "not_applicable, adaptive": (
        "Scheme {scheme} is adaptive and chooses its own steps at every level, so {what} has no order.",
        "Name schemes with a fixed step (`schemes:`), or check the error with `value:`.",
    ),
    "not_applicable, still": (
        "{subject} does not change after the start, or too little for an error to show. There is nothing to judge.",
        "Choose `initial:` values, a force or a `time: end` so that {what} changes from one common time to the next.",
    ),
    "not_applicable, part": (
        f"{{subject}} {NO_PART}.",
        PART_ADVICE,
    ),
    "not_applicable": (
        "{subject} does not exist here, so there is nothing to judge.",
        "Choose a quantity (`converges:`) that this model and scheme have.",
    ),
    "pre_asymptotic, decay": (
        "The damping makes a velocity decay at a rate of up to {decay:2}, within a time of {decay_time:2}. The "
        "shortest step, {shortest:2}, is longer. No level sees the decay, so differences do not show the error.",
        "Use shorter steps (from level {level_of_decay} on), weaker damping, or `initial:` velocities that do not "
        "decay.",
    ),
    "non_smooth, pulse": PULSE,
    "pre_asymptotic, pulse": PULSE,
    "non_smooth, mesh": (
        "Scheme {scheme} notices events only at grid points (`events: mesh`), up to a step late, so the error of "
        "{what} has no regular expansion in powers of dt.",
        ON_MESH,
    ),
    "non_smooth, table": (
        "The force is linear between the points of its table and has corners within steps, so the error of "
        "{what} has no regular expansion in powers of dt.",
        ON_TABLE,
    ),
    "non_smooth, jump at a point": (
        CANNOT_SHOW
        + "the force jumps at a grid point ({corner.words} at t = {corner.time:4}), and "
        "the steps on both sides use the same value there. Expect order 1{beside_corner}.",
        "{end_before_corner}",
    ),
    "non_smooth, irregular": (
        "The error of {what} has no regular expansion, because {jump} within a step ({corner.words} at t = "
        "{corner.time:4}), in another part of it on each level. Order {expected} is what it allows, and the levels "
        "do not show it.",
        "End the time interval (`time: end`) before t = {corner.time:4}, or choose steps that have a grid point there.",
    ),
    "non_smooth, corner": (
        CANNOT_SHOW + "{jump} {corner_place} ({corner.words} at t = {corner.time:4}). Expect order "
        "{corner.power}{beside_corner}.",
        "{end_before_corner}",
    ),
    "non_smooth": (
        "{subject} is not smooth, so its error has no regular expansion in powers of dt.",
        "Set `order:` to what the kink allows, or end the time interval (`time: end`) before it.",
    ),
    "pre_asymptotic, still": (
        "{subject} is at rest at every common time, while the exact solution moves. The step is still too coarse.",
        "{more_levels}",
    ),
    "pre_asymptotic, pole": (
        "The finest two levels of {what} agree to 1 % of its size up to t = {parts_at:3} only, of {end:4}. The largest "
        "speeds of the finest levels differ by a factor of {speeds_differ:2}, as where a force becomes infinite.",
        "End the time interval (`time: end`) before t = {parts_at:3}, or check the formulas of `model:`. No level "
        "follows a motion through a point where the force is infinite.",
    ),
    "pre_asymptotic, parting": (
        "The finest two levels of {what} agree to 1 % of its size up to t = {parts_at:3} only, of {end:4}. "
        "This motion makes every error ten times larger in a time of about {tenfold:2}, so the levels part.",
        "End the time interval (`time: end`) before t = {parts_at:3}{or_finer}.",
    ),
    "pre_asymptotic, growing": (
        "The differences of {what} grow from level to level ({measured}). The step is still too coarse to show an "
        "order, or level {last} differs in kind from those before it.{parts}",
        "{more_levels}",
    ),
    "pre_asymptotic, steep": (
        "The step is still too coarse to show the order of {what}. The differences fall faster than any power of dt on "
        "levels {first} to {last}, so the coarser levels may be unrelated to the solution.{parts}",
        "{more_levels}",
    ),
    "pre_asymptotic": (
        "The step is still too coarse to show the order of {what}{so_far}.{hidden}{parts}",
        "{more_levels}",
    ),
    "order_low, mesh": (
        " The likely cause is `events: mesh`, which notices an event up to a step late.",
        ON_MESH,
    ),
    "order_low, table": (
        " The likely cause is the table. The force has corners at its points, which lie within steps.",
        ON_TABLE,
    ),
    "order_low, promise, damping": (
        PROMISED_LESS + ", because it uses the backward difference for the damping.",
        "Set `kind: central` for scheme {scheme}, which centres the damping, or `order: scheme`.",
    ),
    "order_low, promise, start": (
        PROMISED_LESS + ".",
        "Set `start: centred` for scheme {scheme}, or `order: scheme`.",
    ),
    "order_low, promise": (
        PROMISED_LESS + ".",
        "Set `order: scheme`, or give scheme {scheme} another `kind:`.",
    ),
    "order_low, start": (
        " The likely cause is the first step, because `start: {options[start]}` {start_fault}.",
        "Set `start: centred` for scheme {scheme}.",
    ),
    "order_low, end": (
        " The likely cause is the last point, because `end_velocity: {options[end_velocity]}` is one-sided and of "
        "lower order.",
        "Set `end_velocity: kick` for scheme {scheme}, or measure with `norm: linf_interior`.",
    ),
    "order_low, last_point": (
        " The order is as expected without the last point, so a formula at the end is of lower order.",
        "Measure with `norm: linf_interior`{or_kick}.",
    ),
    "order_low, one_quantity": (
        " Another state has the expected order, so the cause is how {what} is computed, not the step."
        "{in_theory}",
        "Look for a formula of lower order that only {what} uses{or_expect}.",
    ),
    "order_low, everything": (
        " Every state shows this at every time, so the cause is the step of scheme {scheme}, its start or the "
        "force.{in_theory}",
        "Look for a term of lower order in scheme {scheme}{or_expect}.",
    ),
    "order_low": ("{in_theory}", "Look for a term of lower order in scheme {scheme}{or_expect}."),
    "order_high, promise": (
        " Scheme {scheme} promises order {promised} here.",
        "Set `order: scheme`.",
    ),
    "order_high, promise, exact": (
        " Scheme {scheme} promises to be exact here.",
        "Set `order: scheme`.",
    ),
    "order_high, special_times": (
        " All common times are turning points of {what}, where a shift in time does not show. The order is not really "
        "higher.",
        "Choose another `time: end`, or start `levels:` at a finer level, to compare at other times, too.",
    ),
    "order_high, theory": (
        " Theory predicts that order for scheme {scheme} on this linear model.",
        "Set `order: {likely}`, as theory predicts for scheme {scheme} here.",
    ),
    "order_high, one_norm": (
        " The order is as expected in another norm, so errors cancel in {norm}.",
        "Measure in another `norm:`{or_expect}.",
    ),
    "order_high, one_quantity": (
        " Another state has the expected order. The leading error vanishes in {what}, but not in every state.",
        "Check another state (`converges:`){or_expect}.",
    ),
    "order_high, everything": (" Every state shows this in every norm.", NO_SYMMETRY),
    "order_high": ("", NO_SYMMETRY),
}
