"""Verdicts in sentences that a student understands; what to change in the YAML is in `vibsim.analysis.advice`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from vibsim.schemes import Options
from vibsim.schemes.base import is_on_the_mesh


@dataclass(frozen=True)
class Corner:
    """The first corner of the force that steps feel."""

    words: str
    """What happens there."""
    time: float
    power: float
    """The highest power of dt that it leaves regular."""
    on_a_point: bool = False
    """Whether it is a jump at a grid point, not within a step."""


HIGHEST = 12.0
"""An estimate above is the order of no scheme."""
ALIKE = 0.15
"""Two levels fail at one time that fail within this part of it: the finer one sees it at most a step earlier."""


@dataclass(frozen=True)
class Story:
    """What a sentence on a convergence verdict needs to know about the member that decided it."""

    quantity: str
    reason: str
    order: float
    low: float
    high: float
    first: int
    last: int
    expected: float
    """The order that was expected; infinite where the quantity was to be exact."""
    tolerance: float
    norm: str
    levels: tuple[int, ...]
    culprit: int
    """Level that failed or is beyond the stability limit; -1 for none."""
    omega_dt: float
    """w dt at the culprit; NaN for none."""
    growth: tuple[float, float]
    """Growth factor per period at the culprit, predicted and measured; NaN where it is not known."""
    limit: float
    """Stability limit of the scheme; infinite for none."""
    options: Options
    """Options of the scheme."""
    is_position: bool
    scheme: str
    has_corners: bool = False
    """Whether steps have corners of a force from a table inside."""
    corner: Corner | None = None
    """The first other corner of the force within a step."""
    parts: str = ""
    """What phase and amplitude of the error say of it (`vibsim.analysis.parts_told`)."""
    kind: str = ""
    """Kind of the scheme."""
    promised: float = math.nan
    """The order that the scheme promises, ..."""
    centred: float = math.nan
    """... and would promise with `start: centred`; NaN where it has that start, or no such option."""
    has_promise: bool = True
    """Whether that is a promise for the quantity; of a part of an error it may be the one for its position."""
    cause: str = "none"
    """Why the order is another one, one of `vibsim.analysis.causes.CAUSES`."""
    more: int = -1
    """Finer levels that are probably needed; -1 where that is not known, here and below."""
    readable: int = -1
    """Finest level at which an order can be read, ..."""
    compensated: int = -1
    """... and the same in compensated arithmetic."""
    cost: Callable[[Sequence[int]], str] = lambda levels: ""
    """What levels cost, in words."""
    has_exact: bool = True
    """Whether an exact solution or a reference is known, which alone shows a wrong limit."""
    failures: tuple[float, ...] = ()
    """When each level met a number that is not finite, in its first step at 0; NaN where it did not."""

    @property
    def singular(self) -> float:
        """Time at which the two finest levels failed alike, so that finer ones will, too; NaN where they did not."""
        if len(self.failures) < 2:
            return math.nan
        before, last = self.failures[-2:]
        return last if abs(before - last) <= ALIKE * before else math.nan


def number(value: float) -> str:
    """Write a number with up to 6 significant digits."""
    return f"{value:.6g}"


FAR_DOWN = 1.0
"""An interval that reaches further below its order holds a lower power of the expansion as well."""
NEAR_ONE, ROUND_OFF = 1e-2, 1e-13
"""A factor that is nearer to 1 is written as 1 and the rest; nearer still, the rest is rounding."""


def factor_in_words(value: float) -> str:
    """Write a growth factor: near 1 as ``1 + 3.5e-06``, so that its growth can be read."""
    rest = value - 1.0
    if abs(rest) <= ROUND_OFF:
        return "1"
    if abs(rest) < NEAR_ONE:
        return f"1 {'+' if rest > 0 else '-'} {abs(rest):.3g}"
    return number(value)


def vanishing_in_words(predicted: float, measured: float) -> str:
    """Say by how much a scheme grows that grows at every step; empty where it does not, or nothing is known."""
    known = [value for value in (predicted, measured) if not math.isnan(value)]
    if not known or min(known) - 1.0 <= ROUND_OFF:
        return ""
    rest = known[0] - 1.0
    much = f"by {rest:.3g}" if rest < 1.0 else f"by the factor {number(known[0])}"
    return f"; it grows {much} per period, which vanishes with dt"


def growth_in_words(
    predicted: float, measured: float, is_simple: bool = True, is_linear: bool = True
) -> str:
    """Say what growth theory predicts and what was measured; empty where neither is known.

    The theory is of free linear oscillations without damping: of a model with damping or a force in time (not
    `is_simple`), and of a nonlinear one, that is said.
    """
    small = "predicted" if is_linear else "predicted of small oscillations"
    theory = small if is_simple else "predicted of free oscillations without damping"
    told = [
        f"{factor_in_words(value)} {word}"
        for value, word in ((predicted, theory), (measured, "measured"))
        if not math.isnan(value)
    ]
    return f": growth factor per period {', '.join(told)}" if told else ""


def _measured(s: Story) -> str:
    """Return the stated order with its interval and levels; empty where there is none."""
    if math.isnan(s.order):
        return ""
    known = math.isfinite(s.low) and math.isfinite(s.high)
    between = f" (between {s.low:.3f} and {s.high:.3f})" if known else ""
    return f"order {s.order:.3f}{between} on levels {s.first} to {s.last}"


def _due(s: Story) -> str:
    """Say whose the order is: the scheme's, or that of the check alone, where theory has none or another one."""
    if not s.has_promise or promises_less(s) or promises_more(s):
        return "expected"
    return "promised"


def tell(s: Story) -> str:
    """Say what was measured of a convergence, in one sentence."""
    measured, promised = _measured(s), f"order {number(s.expected)}"
    if s.reason == "order_low" and math.isinf(s.expected):
        so_far = f": with {measured}" if measured else ""
        return f"{s.quantity} is promised to be exact, but the levels differ by more than round-off{so_far}."
    match s.reason:
        case "asymptotic":
            return (
                f"{s.quantity} converges with {measured}, as {_due(s)} ({promised}): the rescaled "
                f"differences coincide.{_doubt(s)}{_unseen(s)}"
            )
        case "exact":
            return (
                f"{s.quantity} is exact: the levels differ by round-off only, so there is no order "
                f"to measure.{_unseen(s)}"
            )
        case "order_low" | "order_high":
            word = "slower" if s.reason == "order_low" else "faster"
            return f"{s.quantity} converges {word} than {promised}: with {measured}.{_cause(s)}{s.parts}"
        case "wrong_limit":
            return (
                f"The levels of {s.quantity} approach each other, but not the exact solution: the "
                "remaining error is larger than their differences allow."
            )
        case "unstable":
            return _unstable(s)
        case "non_finite":
            return f"The calculation of {s.quantity} met a number that is not finite{_place_of_failure(s)}."
        case "round_off":
            kept = f"; before it, {measured} is all that is left" if s.order > 0.0 else ""
            return (
                f"The differences of {s.quantity} have reached the floor of round-off, where they say "
                f"nothing about the scheme{kept}."
            )
        case "oscillating":
            return (
                f"The differences of {s.quantity} change their sign or swing from level to level, so "
                "no order can be read from them."
            )
        case "non_smooth" if is_on_the_mesh(s.options):
            return (
                f"Scheme {s.scheme} leaves events to the mesh, which notices them up to a step late, wherever they lie "
                f"between two points: the error of {s.quantity} has no regular expansion in powers of dt."
            )
        case "non_smooth" if s.has_corners:
            return (
                "Between the points of its table the force is a straight line, and its corners lie within steps, at "
                f"each level elsewhere: the error of {s.quantity} has no regular expansion in powers of dt."
            )
        case "non_smooth" if s.corner:
            return _cornered(s, s.corner)
        case "non_smooth":
            return f"{s.quantity} is not smooth, so its error has no regular expansion in powers of dt."
        case "too_few_levels":
            count = len(s.levels)
            return (
                f"{count} level{'s are' if count > 1 else ' is'} too few to judge the convergence of "
                f"{s.quantity}: three are needed, four are better."
            )
        case "not_applicable" if is_adaptive(s):
            return (
                f"Scheme {s.scheme} is adaptive: it chooses its own steps, whatever the level, so an order of "
                f"{s.quantity} does not exist."
            )
        case "not_applicable":
            return f"{s.quantity} does not exist here, so there is nothing to judge."
    return f"{_too_coarse(s, measured)}{s.parts}"


def _unseen(s: Story) -> str:
    """Say what levels that approach each other do not tell."""
    if s.has_exact:
        return ""
    return (
        " No exact solution is known to compare with, so that a wrong limit would not be noticed."
    )


def _too_coarse(s: Story, measured: str) -> str:
    """Say that levels show no order yet; where it is none that an expansion has, what they show instead."""
    if s.order <= 0.0:
        return (
            f"The differences of {s.quantity} grow from level to level ({measured}): the step is still too coarse to "
            f"tell an order, or level {s.last} is not of one kind with those before it."
        )
    if s.order > HIGHEST:
        return (
            f"The step is still too coarse to tell the order of {s.quantity}: its differences fall faster on levels "
            f"{s.first} to {s.last} than those of any power of dt, as where the coarser ones have nothing to do with "
            "the solution."
        )
    so_far = f": the last estimate is {measured}" if measured else ""
    return f"The step is still too coarse to tell the order of {s.quantity}{so_far}."


def _doubt(s: Story) -> str:
    """Say of an order that passes why its interval reaches far down; empty where it does not."""
    if not s.order - s.low > FAR_DOWN:
        return ""
    return (
        " What is left besides that order may be a small part of a lower one, which these levels do not exclude: the "
        "interval reaches down to it."
    )


def _place_of_failure(s: Story) -> str:
    """Say where a calculation broke down, as far as it is known."""
    if s.culprit < 0:
        return ""
    where = f" at level {s.culprit}"
    if s.singular == 0.0:
        return f"{where}, in its first step, and so does every finer level"
    if not math.isnan(s.singular):
        return f"{where}, and finer ones do not avoid it: level {s.levels[-1]} met one at t = {s.singular:.4g}"
    at = s.failures[s.levels.index(s.culprit)] if s.culprit in s.levels and s.failures else math.nan
    return where if math.isnan(at) else f"{where}, at t = {at:.4g}"


def is_adaptive(s: Story) -> bool:
    """Tell whether the scheme chooses its own steps."""
    return "tolerance" in s.options


def starts_low(s: Story) -> bool:
    """Tell whether the first step explains the order."""
    return s.options.get("start") == "first_order" and 0.5 < s.order < 1.5


def ends_low(s: Story) -> bool:
    """Tell whether the formula for the last velocity explains the order, or may."""
    one_sided = s.options.get("end_velocity") in {"backward", "extrapolate"}
    sees_end = s.norm != "linf_interior" and not s.is_position
    backward = s.options.get("end_velocity") == "backward"
    return one_sided and sees_end and (backward or s.reason == "pre_asymptotic")


def promises_less(s: Story) -> bool:
    """Tell whether the scheme itself promises a lower order than the check expects."""
    return math.isfinite(s.promised) and s.promised < s.expected - s.tolerance


def promises_more(s: Story) -> bool:
    """Tell whether the scheme itself promises a higher order than the check expects."""
    return s.promised > s.expected + s.tolerance


def _cause(s: Story) -> str:
    if s.reason == "order_high" and promises_more(s):
        promised = f"order {number(s.promised)}" if math.isfinite(s.promised) else "to be exact"
        return f" Scheme {s.scheme} promises {promised} here."
    if s.reason == "order_high":
        return _WHY_HIGH.get(s.cause, "").format(s.quantity, s.scheme, s.norm)
    if is_on_the_mesh(s.options):
        return " The likely cause is `events: mesh`: an event is noticed up to a step late."
    if s.has_corners:
        return " The likely cause is the table: the force has corners at its points, which lie within steps."
    if promises_less(s):
        damping = ": it takes the damping backward" if "backward_damping" in s.kind else ""
        return f" Scheme {s.scheme} promises no more than order {number(s.promised)} here{damping}."
    if starts_low(s):
        return " The likely cause is the first step: `start: first_order` leaves its dt^2 term out."
    if ends_low(s):
        return (
            f" The likely cause is the last point: `end_velocity: {s.options['end_velocity']}` is a one-sided "
            "formula of lower order."
        )
    return _WHY_LOW.get(s.cause, "").format(s.quantity, s.scheme)


_WHY_LOW = {
    "last_point": (
        " Without the last point the order is the expected one: what is of lower order is a formula at the end."
    ),
    "one_quantity": " Another state has the expected order: what is of lower order is how {0} is made, not the step.",
    "everything": (
        " It is so in every state and at every time, so that it is a term of the step of scheme {1}, of its start, or "
        "of the force that it evaluates."
    ),
}
_WHY_HIGH = {
    "special_times": (
        " All common times are turning points of {0}: most of an error is a shift in time, which does not show there. "
        "This is no higher order."
    ),
    "theory": " The theory of scheme {1} has that order on this linear model, too.",
    "one_norm": " In another norm than {2} the order is the expected one: errors cancel in this one.",
    "one_quantity": " Another state has the expected order: the leading error vanishes in {0}, not in every state.",
    "everything": " It is so in every state and every norm.",
}


def _cornered(s: Story, corner: Corner) -> str:
    measured = _measured(s)
    so_far = f"; the last estimate is {measured}" if measured else ""
    if corner.on_a_point:
        return (
            f"At t = {corner.time:.4g}, at a grid point, {corner.words}, where the force jumps: the steps on both "
            f"sides take the same one value there, which leaves an error of order 1, so that {s.quantity} does not "
            f"show order {number(s.expected)}{so_far}."
        )
    jump = {1.0: "the force jumps", 2.0: "the force has a corner"}
    what = jump.get(corner.power, "a derivative of the force jumps")
    return (
        f"At t = {corner.time:.4g}, within a step, {corner.words}, where {what}: an error of order "
        f"{number(corner.power)} is left that depends on where in the step that lies, so that {s.quantity} does not "
        f"show order {number(s.expected)}{so_far}."
    )


def _unstable(s: Story) -> str:
    if math.isfinite(s.omega_dt) and s.omega_dt > s.limit:
        return (
            f"The run is unstable: at level {s.culprit}, w dt = {s.omega_dt:.4g} is beyond the limit "
            f"{number(s.limit)} of scheme {s.scheme}{growth_in_words(*s.growth)}; level {first_stable(s)} is the first "
            "within it."
        )
    return (
        f"{s.quantity} is unstable: the solution grows where the exact one does not, and finer levels "
        "do not remove that."
    )


def first_stable(s: Story) -> int:
    """Return the coarsest level whose w dt is within the limit."""
    if not (math.isfinite(s.omega_dt) and s.omega_dt > s.limit):
        return s.levels[-1] + 1
    return s.culprit + math.ceil(math.log2(s.omega_dt / s.limit) - 1e-9)
