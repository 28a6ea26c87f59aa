"""The energy error of one run as a ``conserves`` check found it: what its picture draws and its caption tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibsim.checks.fields import name_of
from vibsim.core.record import Record
from vibsim.core.vocabulary import DRIFTS
from vibsim.report.data import Floats, Member, at, pick, times, whole
from vibsim.report.evidence.frame import measured

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConservesCheck

NAMES = ("m₃", "m₂", "m₁")
"""Of the three means, the earliest first."""
POWERS = {"linear": 1, "quadratic": 2}
"""Of t, in proportion to which a drift grows."""


@dataclass(frozen=True)
class EnergyError:
    """The energy error of one run, over the energy at the start where that is not 0."""

    kind: str
    """Of `vocabulary.DRIFTS`."""
    asked: str
    """Kind of drift that the check asks for."""
    t: Floats
    running: Floats
    """The largest error so far, shape (t,)."""
    means: Floats
    """m3, m2, m1."""
    round_off: float
    """Largest error that is taken for round-off."""
    power: float
    """k, NaN where it cannot be told."""
    rate: float
    """Of the kind of drift, see `vibsim.observe.energy_drift.Drift`."""

    @property
    def is_round_off(self) -> bool:
        """Whether the error is so small that nothing but the border tells anything."""
        return self.kind == "none"

    @property
    def has_border(self) -> bool:
        """Whether the error has to be compared with round-off."""
        return self.is_round_off or self.asked == "none"

    @property
    def is_log(self) -> bool:
        """Whether the scale has to be logarithmic."""
        return self.has_border or self.kind == "exponential" or self.is_broken

    @property
    def is_broken(self) -> bool:
        """Whether the run broke down, so that it has no means."""
        return not np.isfinite(self.means).all()

    @property
    def has_bars(self) -> bool:
        """Whether the means are shown."""
        return not (self.is_round_off or self.is_broken)

    @property
    def most(self) -> float:
        """The largest error."""
        return float(np.nanmax(self.running))


def energy_error(
    record: Record,
    check: ConservesCheck,
    name: str,
    member: Member,
    first: float,
    level: int,
) -> EnergyError:
    """Return what was found of a member at a level.

    Parameters
    ----------
    record
        Convergence Record.
    name
        Name of the check.
    first
        By what errors are divided: the energy at the start, 1 where that is 0.
    """
    index = whole(record, "level").index(level)
    running = at(record, f"{check.about}_running_max", member, level=index)
    kind, rate, power = (
        measured(record, name, field, member.scheme, member.case)
        for field in ("drift", "drift_rate", "drift_power")
    )
    own = {"scheme": member.scheme, "case": member.case}
    return EnergyError(
        kind=DRIFTS[int(kind)],
        asked=check.drift,
        t=times(record, member.case),
        # the last velocity may be a one-sided one, which the verdict does not look at
        running=np.append(running[:-1], np.nan) / first,
        means=np.asarray(pick(record, name_of(name, "window_means"), **own), dtype=np.float64)
        / first,
        round_off=float(pick(record, name_of(name, "round_off"), **own)) / first,
        rate=rate,
        power=power,
    )
