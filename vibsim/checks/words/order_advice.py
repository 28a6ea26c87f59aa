"""What to change in the YAML where an order is not what a check asks for: one sentence, with what it costs."""

from __future__ import annotations

import math
from collections.abc import Sequence

from vibsim.checks.words.order_context import (
    Corner,
    Story,
    ends_low,
    first_sound,
    first_stable,
    is_adaptive,
    promises_less,
    promises_more,
    shows_promise,
    starts_low,
)
from vibsim.schemes.base import is_on_the_mesh

BACKWARD_DAMPING = "central_backward_damping"
"""The scheme whose order is lost by its treatment of damping alone."""


def advise(s: Story) -> str:
    """Say what to change in the YAML; empty for a PASS."""
    match s.reason:
        case "asymptotic" | "exact" | "match":
            return ""
        case "order_low" | "non_smooth" if is_on_the_mesh(s.options):
            return f"Set `events: located` for scheme {s.scheme}."
        case "order_low" | "non_smooth" if s.has_corners:
            return (
                "Choose steps in `time:` that end at every point of the table: at the coarsest level, dt is its "
                "spacing over the speed, or a whole part of that."
            )
        case "non_smooth" | "pre_asymptotic" if s.cause == "pulse":
            return _on_pulse(s)
        case "pre_asymptotic" if s.cause == "decay":
            return _on_decay(s)
        case "non_smooth" if s.corner:
            lower = promises_less(s)
            order = s.promised if lower else s.expected
            return (
                f"{'Set `order: scheme`, and end' if lower else 'End'} the time interval (`time: end`) before t = "
                f"{s.number(s.corner.time, 4)}, where order {s.number(order)} can be seen{_or_lower(s, s.corner)}."
            )
        case "order_low":
            return _on_low_order(s)
        case "order_high":
            return _on_high_order(s)
        case "wrong_limit":
            return (
                "Check `model:` and `initial:` against the equation that you mean: finer levels will "
                "not help."
            )
        case "unstable":
            level = first_stable(s)
            return (
                f"Start `levels:` at {level} or finer{_priced(s, [level])}, or shorten `time: end`."
            )
        case "non_finite" if s.singular == 0.0:
            return (
                "Check the formulas of `model:` at t = 0, and `initial:`: something has no finite value there (a "
                "quotient of two zeros takes its limit by a condition, sin(t)/t if t > 0 else 1)."
            )
        case "non_finite" if not math.isnan(s.singular):
            return (
                f"End the time interval (`time: end`) before t = {s.number(s.singular, 4)}, or check the formulas of "
                "`model:`: finer levels will not help where the motion escapes, or a formula has no finite value."
            )
        case "non_finite":
            level = first_sound(s)
            return (
                f"Start `levels:` at {level} or finer{_priced(s, [level])}, or shorten `time: end`."
            )
        case "round_off":
            return _on_round_off(s)
        case "oscillating":
            return f"{_add(s, 2)}, or measure in another `norm:`."
        case "non_smooth":
            return "Set `order:` to what the kink allows, or end the time interval (`time: end`) before it."
        case "too_few_levels":
            return f"{_add(s, min(max(4 - len(s.levels), 1), 2))}."
        case "not_applicable" if is_adaptive(s):
            return "Name schemes with a fixed step (`schemes:`), or ask for its error with a `value:` check."
        case "not_applicable" if s.cause == "still":
            return (
                f"Choose `initial:` values, a force or a `time: end` with which {s.what} moves from one common "
                "time to the next."
            )
        case "not_applicable":
            return "Choose a quantity (`converges:`) that this model and scheme have."
    return _on_coarse_levels(s)


def _or_lower(s: Story, corner: Corner) -> str:
    """Ask for a scheme of an order that the corner leaves regular; for none where the scheme is one."""
    most = max(corner.power - 1.0, 1.0)
    if s.promised <= most:
        return ""
    at_most = " at most" if corner.power > 1.0 else ""
    return f", or take a scheme (`schemes:`) of order {s.number(most)}{at_most}"


def _on_pulse(s: Story) -> str:
    """Name the first level whose step is shorter than a pulse that no level sees."""
    time, width = s.pulse
    more = max(math.ceil(math.log2(s.shortest / width)), 0) + 1
    return (
        f"Use steps that are shorter than the pulse, from level {s.levels[-1] + more} on, write a wider pulse of the "
        f"same impulse, or end the time interval (`time: end`) before t = {s.number(time, 6)}."
    )


def _on_decay(s: Story) -> str:
    """Name the first level whose step is shorter than the time in which damping takes a velocity away."""
    more = max(math.ceil(math.log2(s.shortest * s.decay)), 1)
    return (
        f"Use steps that are shorter than that, from level {s.levels[-1] + more} on, or a weaker damping; `initial:` "
        "velocities that the damping leaves as they are may do as well."
    )


def _on_low_order(s: Story) -> str:
    if promises_less(s) and shows_promise(s):
        return _on_promise(s)
    if starts_low(s):
        return f"Set `start: centred` for scheme {s.scheme}."
    if ends_low(s):
        return f"Set `end_velocity: kick` for scheme {s.scheme}, or measure with `norm: linf_interior`."
    if s.cause == "last_point":
        kick = f", or set `end_velocity: kick` for scheme {s.scheme}"
        return f"Measure with `norm: linf_interior`{kick if 'end_velocity' in s.options else ''}."
    if s.cause == "one_quantity":
        return f"Look for a formula of lower order that {s.what} alone is made with{_or_expect(s)}."
    return f"Look for a term of lower order in scheme {s.scheme}{_or_expect(s)}."


def _on_promise(s: Story) -> str:
    if s.kind == BACKWARD_DAMPING:
        return f"Set `kind: central` for scheme {s.scheme}, which centres the damping, or `order: scheme`."
    if s.centred >= s.expected - s.tolerance:
        return f"Set `start: centred` for scheme {s.scheme}, or `order: scheme`."
    return f"Set `order: scheme`, or another `kind:` than that of scheme {s.scheme}."


def _on_high_order(s: Story) -> str:
    if promises_more(s) and shows_promise(s):
        return "Set `order: scheme`."
    match s.cause:
        case "special_times":
            return (
                "Choose another `time: end`, or start `levels:` at a finer level, so that the common times are not "
                "turning points alone."
            )
        case "theory" if math.isfinite(s.order):
            return f"Set `order: {s.number(_likely(s))}`, which the theory of scheme {s.scheme} has here."
        case "one_norm":
            return f"Measure in another `norm:`{_or_expect(s)}."
        case "one_quantity":
            return f"Check another state (`converges:`){_or_expect(s)}."
    return (
        "Try other `initial:` values or another `time: end`, where nothing cancels by "
        f"symmetry{_or_expect(s)}."
    )


def _on_round_off(s: Story) -> str:
    """Name the arithmetic and the levels with which an order can be read, as far as they are predicted."""
    if s.cause == "stored":
        coarser = _readable(s)
        return (
            f"Store the states in double precision (float64), or {coarser[0].lower()}{coarser[1:]}."
        )
    arithmetic = s.options.get("arithmetic", "compensated")
    coarser = _readable(s)
    if not s.order > 0.0:
        coarser += "; where those are round-off, too, the scheme is exact here, and another `model:` shows its order"
    if arithmetic == "compensated":
        return f"{coarser}."
    reach = f" (it can be read up to level {s.compensated})" if s.compensated > s.readable else ""
    return f"Set `arithmetic: compensated` for scheme {s.scheme}{reach}, or {coarser[0].lower()}{coarser[1:]}."


def _readable(s: Story) -> str:
    if s.readable < 2:
        last = s.levels[0] if s.last < 0 else s.last
        return f"Use coarser `levels:`, below {max(last, 1)}, or a longer `time: end`"
    if s.readable >= s.levels[-1]:
        last = s.levels[-1] if s.last < 0 else s.last
        return (
            f"Use coarser `levels:`, below {max(last, 1)}, and look for what is rougher than rounding in `model:` and "
            f"`schemes:`: that alone would leave an order up to level {s.readable}"
        )
    first = max(s.readable - 3, 0)
    return f"Use coarser `levels:`, such as {first} to {s.readable}: finer ones are round-off"


def _on_coarse_levels(s: Story) -> str:
    """Say how many levels are probably missing."""
    kick = f", or set `end_velocity: kick` for scheme {s.scheme}" if ends_low(s) else ""
    if s.more < 1:
        return f"{_add(s, 2)}{kick}; how many are needed cannot be told yet."
    told = "is probably what is" if s.more == 1 else "are probably what is"
    return f"{_add(s, s.more)}{kick}; {s.more} more {told} needed."


def _add(s: Story, count: int) -> str:
    """Ask for so many finer levels, with what they cost."""
    levels = [s.levels[-1] + 1 + i for i in range(count)]
    names = {1: f"level {levels[0]}", 2: f"levels {levels[0]} and {levels[-1]}"}
    which = names.get(count, f"levels {levels[0]} to {levels[-1]}")
    return f"Add {which} to `levels:`{_priced(s, levels)}"


def _priced(s: Story, levels: Sequence[int]) -> str:
    cost = s.cost(levels)
    return f" ({cost})" if cost else ""


def _likely(s: Story) -> float:
    return round(2 * s.order) / 2


def _or_expect(s: Story) -> str:
    if math.isfinite(s.order) and _likely(s) > 0:
        return f", or set `order: {s.number(_likely(s))}` if you expect it"
    return " (`schemes:`)"
