"""Where a motion may begin: outside of its stop, and with masses that are positive there, for every member."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.members import MemberNumbers, named
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import values, values_of
from vibsim.models import tree
from vibsim.models.base import rate
from vibsim.models.events import Crossings
from vibsim.models.shared.crossings import STOP
from vibsim.models.shared.inertia import MASS, inertia


def check_starts(members: MemberNumbers, formulas: Mapping[str, str], report: Report) -> None:
    """Refuse a stop that holds at t = 0 already, and a matrix of masses that is not positive definite there."""
    model = members.model

    def refuse(
        is_wrong: Callable[[Mapping[str, Any]], Flags], path: Path_, rule: str, hint: str
    ) -> None:
        """Refuse the first member of which something is wrong; `rule` has a place for its name."""
        for count, numbers, swept in members.starts():
            wrong = np.broadcast_to(is_wrong(numbers), (count,))
            if wrong.any():
                who = named(swept, int(np.argmax(wrong)))
                report.add(path, rule.format(f" (where {who})" if who else ""), hint)
                return

    rows = model.events.rows if isinstance(model.events, Crossings) else ()
    for guard in (tree(model, row.guard) for row in rows if row.ends):
        slope = rate(model, guard)

        def holds(numbers: Mapping[str, Any], guard: Any = guard, slope: Any = slope) -> Flags:
            # at the border the motion may go in
            now, ahead = values(guard, numbers), values(slope, numbers)
            return np.asarray((now < 0.0) | ((now == 0.0) & (ahead < 0.0)))

        rule = "holds at the start already{}: nothing would move"
        refuse(holds, ("model", STOP), rule, "begin outside of it")
    if any(key.split(".")[0] == MASS for key in formulas) and model.formulas:
        known = tuple(row.name for row in model.parameters)
        masses = inertia(formulas, model.positions, model.velocities, known)

        def is_light(numbers: Mapping[str, Any]) -> Flags:
            pivots = np.broadcast_arrays(*values_of(masses.pivots, numbers))
            return np.asarray(~np.all(np.stack(pivots) > 0.0, axis=0))

        rule = "must be positive definite, and is not at the start{}"
        hint = "every motion must have a positive kinetic energy"
        refuse(is_light, ("model", MASS), rule, hint)
