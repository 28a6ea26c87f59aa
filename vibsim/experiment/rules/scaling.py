"""A run in the characteristic units of its model: its dimensionless numbers, and the scales to convert back.

Source: vibration text (B), section 10.1; pendulum lecture (A), section 1.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from vibsim.experiment.data import Scaling, TimeSpec
from vibsim.experiment.faults import Report
from vibsim.models import MODELS, Model
from vibsim.models.shared.scales import scaled_parameters, scales


@dataclass(frozen=True)
class Numbers:
    """The numbers that define a run."""

    parameters: Mapping[str, float]
    initial: Mapping[str, float]
    time: TimeSpec | None
    scaling: Scaling | None = None


def characteristic(
    given: Numbers, model: Model | None, swept: Iterable[str], report: Report
) -> Numbers:
    """Return the dimensionless numbers of a run with their scales; report a fault and return `given` if there are none.

    `swept` holds the dotted keys of the sweep.
    """
    key = next((key for key in swept if not key.startswith("schemes.")), "")
    if key:
        rule = f"must not be given where {key} is swept: every member would have scales of its own"
        report.add(("scaled",), rule, at_key=True)
    if key or model is None or given.time is None or not given.parameters:
        return given
    result = _scaled(given, given.time, model)
    if isinstance(result, Numbers):
        return result
    report.add(("scaled",), *result, at_key=True)
    return given


def _scaled(given: Numbers, time: TimeSpec, model: Model) -> Numbers | tuple[str, str]:
    """Return the scaled numbers, or the rule that they break and a hint."""
    if model.scales is None or model.scales.parameters is None:
        return _refusal(model)
    sizes = {row.name: float(row.value) for row in scales(model, given.parameters, given.initial)}
    if not all(math.isfinite(value) and value > 0.0 for value in sizes.values()):
        return "the scales have no finite values with these parameters and initial values", ""
    scaled = scaled_parameters(model, given.parameters, given.initial)
    parameters = {name: float(value) for name, value in scaled.items()}
    initial = {name: value / sizes[name] for name, value in given.initial.items()}
    end = float(time.end_of(model, parameters)) if time.is_of_model else time.end / sizes["t"]
    if not (0.0 < end < math.inf and all(map(math.isfinite, initial.values()))):
        return "the scaled end or initial values are not finite", ""
    scaling = Scaling(
        scales=sizes, parameters=dict(given.parameters), initial=dict(given.initial), end=time.end
    )
    return Numbers(parameters, initial, time.model_copy(update={"end": end}), scaling)


def _refusal(model: Model) -> tuple[str, str]:
    """Return the reason why a model has no scaled equation, and a hint."""
    rule = f"the model {model.kind} has no scaled equation"
    if model.dimensionless:
        return f"{rule}: it is dimensionless already", "leave it out"
    if model.scales is not None and model.scales.refusal:
        return f"{rule}: {model.scales.refusal}", "write k*u, say, with k under parameters"
    if model.lookup is not None:
        what = f"{rule} here: the numbers of its table have units, and stay what they are"
        return what, "leave it out, or write the table's curve as a formula"
    if model.events and model.events.rows:
        return f"{rule} here: its events are formulas in the units of the file", "leave it out"
    if model.formulas:
        why = "its spring has no stiffness at u = 0, by which time would be measured"
        return f"{rule}: {why}", "leave it out"
    able = [row.kind for row in MODELS.built_in.values() if row.scales and row.scales.parameters]
    return rule, "choose from " + ", ".join(able)
