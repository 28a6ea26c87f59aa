"""Rules for `follow`, with which each member starts from the final state of the previous one.

Every member starts at t = 0. So the next member continues the motion only if the equation is the same at t = 0 and at
the end: the end is a whole number of periods of the force, or the equation does not depend on t.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.errors import nearest
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.members import MemberNumbers
from vibsim.experiment.schema.sweep import Axis
from vibsim.formula import Expression, values
from vibsim.models import Model, tree
from vibsim.models.shared.free import why_not_free

MOMENTS = np.linspace(0.0, 1.0, 16, endpoint=False)
"""Times at which the equation is compared with itself one end time later, as fractions of the end."""
STATES = np.cos(np.arange(1.0, 17.0))  # positions and velocities at these times; arbitrary
SAME_FORCE = 1e-6  # tolerance of the accelerations there, relative to the largest one
KEY = ("sweep", "follow")


def check_follow(follow: str, axes: Sequence[Axis], report: Report) -> None:
    """Check that the key belongs to the fastest axis, and that this axis sweeps no initial value."""
    known = [key for axis in axes for key in axis.keys]
    last = axes[-1].keys
    if follow not in known:
        report.add(KEY, "is not a swept key", nearest(follow, known), follow)
    elif follow not in last:
        rule = "must vary fastest, so that members which follow each other are neighbours"
        report.add(KEY, rule, f"write {follow} last in sweep", follow)
    elif starts := [key for key in last if key.startswith("initial.")]:
        rule = f"{starts[0]} is the start of the first member alone; the others start from the one before"
        report.add(KEY, rule, "follow a parameter of the model", follow)


def check_equation(model: Model, numbers: MemberNumbers, report: Report) -> None:
    """Refuse models that cannot be continued, free linear motions, and forces that do not repeat after the end."""
    if model.loaded is not None or model.lookup is not None:
        report.add(KEY, f"needs an equation of formulas, and {model.kind} has tables or matrices")
        return
    if model.start is not None:
        rule = "needs members that may start anywhere"
        report.add(KEY, f"{rule}, and the exact solution says where these start")
        return
    if not why_not_free(model):
        report.add(KEY, "needs a steady state to start from, which no free linear motion has")
        return
    forces = [tree(model, formula) for formula in model.accelerations]
    if not any("t" in force.names for force in forces):
        return
    for parameters, end in numbers.sampled(numbers.count):
        if not np.isfinite(end):
            return
        if not all(_repeats(model, force, parameters, end) for force in forces):
            rule = f"the force does not repeat after the end of a member, {end:.10g} s"
            hint = "give time as `periods`, `steps_per_period` and `frequency`, the parameter of the force"
            report.add(KEY, rule, hint)
            return


def _repeats(model: Model, force: Expression, numbers: dict[str, float], end: float) -> bool:
    states = {state.name: STATES for state in model.states}

    def at(t: Floats) -> Floats:
        with np.errstate(all="ignore"):
            acceleration = values(force, {**numbers, **states, "t": t})
            return np.asarray(np.broadcast_to(acceleration, t.shape))

    now, later = at(MOMENTS * end), at((1.0 + MOMENTS) * end)
    is_finite = np.isfinite(now) & np.isfinite(later)
    scale = np.max(np.abs(now[is_finite]), initial=0.0)
    return bool(np.all(np.abs(later - now)[is_finite] <= SAME_FORCE * scale))
