"""Rules for schemes: each exists, has a unique name, and can treat the forces of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.data import SchemeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.kinds import Kinds
from vibsim.experiment.rules.formulas import shortlist
from vibsim.experiment.schema.checks import SOLUTIONS
from vibsim.experiment.schema.model_and_schemes import TOLERANCE
from vibsim.experiment.schema.sweep import tolerance_name
from vibsim.models import MODELS, Model, tree
from vibsim.schemes import FIXED_STEP, Scheme
from vibsim.schemes.base import EVENTS, MOST_UNKNOWNS, VECTOR


def finish_schemes(
    sections: Sequence[Any], model: Model | None, report: Report
) -> list[SchemeSpec]:
    """Return the schemes of a list (None stands for a malformed entry), and report all faults."""
    finished: list[SchemeSpec] = []
    first: dict[str, int] = {}
    for i, section in enumerate(sections):
        if section is None:
            continue
        kind = section if isinstance(section, str) else section.kind
        scheme = report.kinds.scheme(kind)
        if scheme is None:
            hint = nearest(kind, sorted(report.kinds.names("schemes")))
            report.add(("schemes", i), "unknown scheme", hint, kind)
            continue
        specs = _specs(section, scheme, model, report.kinds)
        finished.extend(specs)
        if model is not None:
            _check_options(section, i, scheme, model, report)
            _check_forces(scheme, i, model, report)
        _check_names(specs, i, first, report)
    if are_known(sections, report.kinds) and all(spec.adaptive for spec in finished):
        rule = "at least one scheme must take equal steps, on the levels that are compared"
        report.add(("schemes",), rule, "choose from " + ", ".join(FIXED_STEP), at_key=True)
    return finished


def _specs(section: Any, scheme: Scheme, model: Model | None, kinds: Kinds) -> list[SchemeSpec]:
    kind = scheme.kind
    options: dict[str, Any] = {
        **scheme.defaults(),
        **{row.name: row.default for row in scheme.options_on(model)},
    }
    name = kind
    if not isinstance(section, str):
        name = section.label or kind
        given = {key: getattr(section, key) for key in options}
        options |= {key: value for key, value in given.items() if value is not None}
    variants = [(name, options)]
    if isinstance(tolerances := options.get(TOLERANCE), tuple):
        variants = [(tolerance_name(name, x), {**options, TOLERANCE: x}) for x in tolerances]
    specs = [SchemeSpec(name=label, kind=kind, options=values) for label, values in variants]
    for spec in specs if kind in kinds.own_schemes else ():
        spec.hold(scheme)
    return specs


def _check_names(specs: list[SchemeSpec], i: int, first: dict[str, int], report: Report) -> None:
    """Check the names of the schemes of entry number `i`; `first` holds the first entry with each name."""
    for j, spec in enumerate(specs):
        if spec.name in SOLUTIONS:
            rule = f"'{spec.name}' is a word of checks, and cannot name a scheme"
            report.add(("schemes", i, "label"), rule, value=spec.name)
        elif spec.name in [other.name for other in specs[:j]]:
            report.add(("schemes", i, TOLERANCE, j), "a tolerance must not be repeated")
        elif first.setdefault(spec.name, i) != i:
            rule = f"two schemes are named '{spec.name}'"
            report.add(("schemes", i), rule, "give one of them a label")


def _check_forces(method: Scheme, i: int, model: Model, report: Report) -> None:
    """Refuse a scheme that cannot treat the forces of the model."""
    if method.treats(model):
        return
    rows = map(report.kinds.scheme, report.kinds.names("schemes"))
    able = [row.kind for row in rows if row is not None and row.treats(model)]
    hint = "choose from " + ", ".join(able) if able else "no scheme can"
    rule = f"cannot treat {model.kind}, whose acceleration depends on {_velocities(model)}"
    unknowns = method.unknowns(model)
    if model.loaded is not None:
        rule = f"cannot treat {model.kind}, whose degrees of freedom are stepped together"
        report.add(("schemes", i), rule, hint, method.kind)
        return
    damped = [other for other, _ in method.damped if not other.startswith(VECTOR)]
    if unknowns > MOST_UNKNOWNS:
        rule = (
            f"cannot treat {model.coordinates} coordinates: it solves for {unknowns} unknowns in each step, "
            f"and can for {MOST_UNKNOWNS} at most"
        )
    elif model.events is not None and method.adaptive:
        rule = f"cannot treat {model.kind}: it takes its own steps across events, where the motion is not smooth"
    elif damped and model.kind in MODELS.built_in and model.coordinates > 1:
        rule += " in a way that it does not know"
    elif damped and model.kind in MODELS.built_in:
        rule += f" by more than {' or '.join(damped)} damping"
    elif damped:
        kinds = " or ".join(damped)
        rule += f" and which declares no {kinds} damping"
        hint += f"; if it is {kinds} damping, write damping=Damping(kind, rate) in the model"
    report.add(("schemes", i), rule, hint, method.kind)


def _velocities(model: Model) -> str:
    """List the velocities that the acceleration depends on."""
    named = {name for row in model.accelerations for name in tree(model, row).names}
    used = [name for name in model.velocities if name in named] or [model.velocity]
    return shortlist(used)


def _check_options(section: Any, i: int, scheme: Scheme, model: Model, report: Report) -> None:
    """Refuse options that have no meaning for this model, and a treatment of events for models without events."""
    if isinstance(section, str):
        return
    known = scheme.options_on(model)
    for option in scheme.options:
        if option not in known and option.name in section.model_fields_set:
            rule = f"has no meaning for {model.kind}, on which the scheme has one form"
            report.add(("schemes", i, option.name), rule, "leave it out", at_key=True)
    given = getattr(section, EVENTS.name, None)
    if given is None or report.has_faulty_model or model.events is not None:
        return
    rows = map(report.kinds.model, report.kinds.names("model"))
    able = [row.kind for row in rows if row is not None and row.events is not None]
    hint = f"models with events are {', '.join(able)}, and oscillator with damping: {{coulomb: c}}, events or stop"
    rule = f"{model.kind} has no events here: its motion is smooth"
    report.add(("schemes", i, EVENTS.name), rule, hint, given)


def are_known(sections: Sequence[Any], kinds: Kinds) -> bool:
    """Tell whether every scheme of the list is well-formed and of a known kind."""
    known = (kinds.scheme(s) if isinstance(s, str) else s for s in sections)
    return bool(sections) and all(section is not None for section in known)
