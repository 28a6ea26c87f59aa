"""What is known of the member that decided a convergence verdict, for the sentence and the advice on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from vibsim.convergence.thresholds import HALF_SPACING
from vibsim.schemes import Options

ALIKE = 0.15
"""Two levels fail at one time that fail within this part of it: the finer one sees it at most a step earlier."""


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
    growth_of: tuple[bool, bool, int] = (True, True, 1)
    """What a growth is told of: whether the model is conservative, whether it is linear, its number of coordinates."""
    has_corners: bool = False
    """Whether steps have corners of a force from a table inside."""
    corner: Corner | None = None
    """The first other corner of the force within a step."""
    pulse: tuple[float, float] = (math.nan, math.nan)
    """Time and length of a pulse of the force that no level sees; NaN where there is none."""
    decay: float = math.nan
    """The largest rate at which damping takes a velocity away; NaN for none."""
    shortest: float = math.nan
    """The step of the finest level."""
    parts: str = ""
    """What phase and amplitude of the error say of it (`vibsim.checks.order.phase_amplitude_text`)."""
    kind: str = ""
    """Kind of the scheme."""
    promised: float = math.nan
    """The order that the scheme promises, ..."""
    special: float = math.nan
    """... and has at most, in a special case of motion, model or options, ..."""
    centred: float = math.nan
    """... and would promise with `start: centred`; NaN where it has that start, or no such option."""
    has_promise: bool = True
    """Whether that is a promise for the quantity; of a part of an error it may be the one for its position."""
    cause: str = "none"
    """Why the order is another one, one of `vibsim.comparison.order_causes.CAUSES`."""
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
    orders: tuple[float, ...] = ()
    """The orders of successive levels in the norm of the check, the coarsest first; NaN where there is none."""
    failures: tuple[float, ...] = ()
    """When each level met a number that is not finite, in its first step at 0; NaN where it did not."""

    @property
    def singular(self) -> float:
        """Time at which the two finest levels failed alike, so that finer ones will, too; NaN where they did not."""
        if len(self.failures) < 2:
            return math.nan
        before, last = self.failures[-2:]
        return last if abs(before - last) <= ALIKE * before else math.nan


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


def shows_promise(s: Story) -> bool:
    """Tell whether the order that was found may be the one that the scheme promises, and not what was expected."""
    if not (promises_less(s) or promises_more(s)):
        return False
    # what has no interval may be any order
    return not (s.promised < s.low - s.tolerance or s.promised > s.high + s.tolerance)


def may_hide(s: Story) -> bool:
    """Tell whether the order that the scheme promises may be behind a higher one, as near a special case."""
    return s.promised + HALF_SPACING < min(s.order, s.special)


def due(s: Story) -> float:
    """Return the order that levels approach: the one that the scheme has, where the last order is nearer to that."""
    known = [order for order in s.orders if math.isfinite(order)]
    if not known or not math.isfinite(s.promised):
        return s.expected
    return min(s.expected, s.promised, key=lambda order: abs(known[-1] - order))


def first_sound(s: Story) -> int:
    """Return the coarsest level from which on none met a number that is not finite, as far as they tell."""
    failed = [level for level, t in zip(s.levels, s.failures, strict=False) if not math.isnan(t)]
    return max([s.culprit, s.levels[0], *failed]) + 1


def first_stable(s: Story) -> int:
    """Return the coarsest level whose w dt is within the limit."""
    if not (math.isfinite(s.omega_dt) and s.omega_dt > s.limit):
        return s.levels[-1] + 1
    return s.culprit + math.ceil(math.log2(s.omega_dt / s.limit) - 1e-9)
