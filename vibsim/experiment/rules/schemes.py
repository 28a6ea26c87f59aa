"""The schemes of an experiment: each exists, has a name of its own, and can treat the forces of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.data import SchemeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.checks import SOLUTIONS
from vibsim.experiment.schema.model_and_schemes import TOLERANCE
from vibsim.experiment.schema.sweep import tolerance_name
from vibsim.models import MODELS, Model
from vibsim.schemes import FIXED_STEP, SCHEMES
from vibsim.schemes.base import EVENTS, VECTOR


def finish_schemes(
    sections: Sequence[Any], model: Model | None, report: Report
) -> list[SchemeSpec]:
    """Return the schemes of a list (None stands for a malformed entry), and note every fault of it."""
    found: list[SchemeSpec] = []
    first: dict[str, int] = {}
    for i, section in enumerate(sections):
        if isinstance(section, str) and section not in SCHEMES:
            hint = nearest(section, sorted(SCHEMES))
            report.add(("schemes", i), "unknown scheme", hint, section)
        elif section is not None:
            several = _specs(section, model)
            _check_events(section, i, model, report)
            found.extend(several)
            _check_forces(several[0], i, model, report)
            _check_names(several, i, first, report)
    if are_known(sections) and all(spec.adaptive for spec in found):
        rule = "at least one scheme must take equal steps, on the levels that are compared"
        report.add(("schemes",), rule, "choose from " + ", ".join(FIXED_STEP), at_key=True)
    return found


def _specs(section: Any, model: Model | None) -> list[SchemeSpec]:
    """Return the schemes that a sound entry stands for on a model."""
    if isinstance(section, str):
        rows = SCHEMES[section].options_on(model)
        defaults = {row.name: row.default for row in rows}
        return [SchemeSpec(name=section, kind=section, options=defaults)]
    kind, name = section.kind, section.label or section.kind
    rows = SCHEMES[kind].options_on(model)
    given = {row.name: getattr(section, row.name) for row in rows}
    options = {
        row.name: row.default if given[row.name] is None else given[row.name] for row in rows
    }
    several = options.get(TOLERANCE)
    if not isinstance(several, tuple):
        return [SchemeSpec(name=name, kind=kind, options=options)]
    return [
        SchemeSpec(name=tolerance_name(name, one), kind=kind, options={**options, TOLERANCE: one})
        for one in several
    ]


def _check_names(several: list[SchemeSpec], i: int, first: dict[str, int], report: Report) -> None:
    """Check the names of the schemes of entry number `i`; `first` holds where each name came first."""
    for j, spec in enumerate(several):
        if spec.name in SOLUTIONS:
            rule = f"'{spec.name}' is what checks compare a scheme with, and names none"
            report.add(("schemes", i, "label"), rule, value=spec.name)
        elif spec.name in [other.name for other in several[:j]]:
            report.add(("schemes", i, TOLERANCE, j), "a tolerance must not be repeated")
        elif first.setdefault(spec.name, i) != i:
            rule = f"two schemes are named '{spec.name}'"
            report.add(("schemes", i), rule, "give one of them a label")


def _check_forces(spec: SchemeSpec, i: int, model: Model | None, report: Report) -> None:
    """Refuse a scheme that cannot treat the forces of the model."""
    if model is None or SCHEMES[spec.kind].treats(model):
        return
    able = [kind for kind, scheme in SCHEMES.items() if scheme.treats(model)]
    if model.events is not None and SCHEMES[spec.kind].adaptive:
        rule = f"cannot treat {model.kind}: it takes its own steps across events, where the motion is not smooth"
        report.add(("schemes", i), rule, "choose from " + ", ".join(able), spec.kind)
        return
    rule = f"cannot treat {model.kind}, whose acceleration depends on {model.velocity}"
    damped = [kind for kind, _ in SCHEMES[spec.kind].damped if not kind.startswith(VECTOR)]
    if damped:
        rule += f" otherwise than by {' or '.join(damped)} damping"
    hint = "choose from " + ", ".join(able) if able else "no scheme can"
    report.add(("schemes", i), rule, hint, spec.kind)


def _check_events(section: Any, i: int, model: Model | None, report: Report) -> None:
    """Refuse a treatment of events where there are none."""
    given = None if isinstance(section, str) else getattr(section, EVENTS.name, None)
    is_known = model is not None and not any(f.key.split(".")[0] == "model" for f in report.faults)
    if given is None or model is None or not is_known or model.events is not None:
        return
    able = [kind for kind, other in MODELS.items() if other.events is not None]
    hint = f"models with events are {', '.join(able)}, and oscillator with damping: {{coulomb: c}}"
    rule = f"{model.kind} has no events here: its motion is smooth"
    report.add(("schemes", i, EVENTS.name), rule, hint, given)


def are_known(sections: Sequence[Any]) -> bool:
    """Tell whether nothing is wrong with any scheme."""
    known = (s is not None and (not isinstance(s, str) or s in SCHEMES) for s in sections)
    return bool(sections) and all(known)
