"""One result of a check, with all that its sentences are made from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.checks.fields import measured, name_of
from vibsim.checks.words.notation import PLAIN, Notation
from vibsim.core.record import Record

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import Measurement


@dataclass(frozen=True)
class Found:
    """What a check measured of one scheme and one member."""

    experiment: Experiment
    record: Record
    """Convergence Record."""
    check: Measurement | None
    """What was measured; None for the tolerance of the experiment."""
    id: str
    scheme: int
    case: int
    """Their positions in the Record."""
    reason: str
    """The measured one."""
    notation: Notation = PLAIN

    def fact(self, name: str) -> Any:
        """Return a field of the check: that of the scheme and the member, or the one for all."""
        values = np.asarray(measured(self.record, self.id, name))
        return (values[self.scheme, self.case] if values.ndim else values).tolist()

    def word(self, name: str) -> str:
        """Return a field that is a position in a list of words as its word."""
        return self.record.meanings(name_of(self.id, name))[self.fact(name)]

    @property
    def scheme_name(self) -> str:
        """Name of the scheme."""
        return self.experiment.schemes[self.scheme].name

    @cached_property
    def failed_at(self) -> float:
        """Time at which the level of the check met a number that is not finite; NaN where it did not."""
        place = self.scheme, self.case, self.record.place("level", self.fact("level"))
        failed = self.record["status"][place]
        return float(self.record["failure_time"][place]) if failed else float("nan")
