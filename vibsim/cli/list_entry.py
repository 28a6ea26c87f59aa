"""One entry of ``vibsim list`` in full: what a user needs to know to use it in an experiment file."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from vibsim.cli import terminal
from vibsim.cli.jobs.common import refusal
from vibsim.core.errors import nearest

if TYPE_CHECKING:
    from vibsim.models import Model
    from vibsim.models.base import FormulaField, Output, Parameter, State
    from vibsim.schemes import AnyOption, Options, Scheme

COORDINATES = "1 to 64 names; the velocity of x is vx, that of u alone v"
_WIDEST = 100
Row = tuple[str, str]  # a label, empty for a further row of the same label, and a text


def in_full(what: str, name: str) -> list[str]:
    """Return the lines that describe a model or a scheme; raise InputError if there is none of this name."""
    rows = scheme_rows(scheme_named(name)) if what == "schemes" else model_rows(model_named(name))
    return laid_out(rows)


def scheme_named(name: str) -> Scheme:
    """Return the scheme that the user named on the command line; raise InputError if there is none."""
    from vibsim.schemes import SCHEMES

    if name not in SCHEMES:
        raise refusal("NAME", name, "is not a scheme", nearest(name, sorted(SCHEMES)))
    return SCHEMES[name]


def model_named(name: str, option: str = "NAME") -> Model:
    """Return the model that the user named with `option`; raise InputError if there is none."""
    from vibsim.models import MODELS

    if name not in MODELS:
        raise refusal(option, name, "is not a model", nearest(name, sorted(MODELS)))
    return MODELS[name]


def laid_out(entries: Iterable[Row]) -> list[str]:
    """Format rows as lines with aligned texts, no wider than the terminal."""
    rows = list(entries)
    width = max(len(label) for label, _ in rows)
    columns = min(terminal.columns(), _WIDEST)
    lines = []
    for label, text in rows:
        head = f"{label.ljust(width)}  "
        indent = " " * len(head)
        filled = textwrap.fill(
            text, max(columns, len(head) + 20), subsequent_indent=indent, initial_indent=head
        )
        lines.append(filled)
    return lines


def scheme_rows(scheme: Scheme) -> Iterator[Row]:
    """Yield the properties of a scheme."""
    order, step, symplectic, forces, stable = facts(scheme)
    yield "scheme", f"{scheme.kind}: {scheme.title}"
    yield "source", scheme.source
    yield "family", scheme.family
    if not scheme.adaptive:
        orders = scheme.orders(scheme.defaults())
        numbers = (order, f"{orders.velocity:g}", f"{orders.energy:g}")
        named = zip(numbers, ("position", "velocity", "energy"), strict=True)
        listed = ", ".join(f"{number} of the {name}" for number, name in named)
        if orders.energy_linear != orders.energy:
            exact = math.isinf(orders.energy_linear)
            linear = "none, it is exact" if exact else f"{orders.energy_linear:g}"
            listed += f" (on a linear, conservative model: {linear})"
        yield "orders", listed
        if orders.velocity_dependent is not None:
            damped = orders.velocity_dependent.position
            yield "", f"{damped:g} of the position where a force depends on the velocity"
    yield "step", step
    yield "first step", scheme.start
    yield "symplectic", symplectic
    yield "symmetric", "yes" if scheme.symmetric else "no"
    yield "forces per step", forces
    yield "stability limit", stable
    if not scheme.velocity_forces:
        kinds = ", ".join(kind for kind, _ in scheme.damped if " " not in kind) or "none"
        yield "damping", f"of its own treatment: {kinds}; any other is refused"
    texts = (f"{row.name}: {choices(row)}: {row.description}" for row in scheme.options)
    yield from _under("options", texts)
    yield "write", f"schemes: [{scheme.kind}]"


def facts(scheme: Scheme) -> tuple[str, ...]:
    """Return order, kind of step, symplecticity, forces per step and stability limit, for default options."""
    forces = str(scheme.evaluations)
    symplectic = "yes" if scheme.symplectic else "no"
    if scheme.adaptive:
        return "-", "adaptive", symplectic, forces, "chooses its own steps"
    options = scheme.defaults()
    kind = "explicit" if scheme.explicit else "implicit"
    per_step = forces if scheme.explicit else f"{forces} x iterations"
    order = f"{scheme.orders(options).position:g}"
    return order, kind, symplectic, per_step, stable_until(scheme, options)


def stable_until(scheme: Scheme, options: Options) -> str:
    """Return the stability limit of a scheme with a constant step, as text."""
    from vibsim.theory import stability_limit

    limit = stability_limit(scheme, options)
    return {math.inf: "none", 0.0: "grows at every step"}.get(limit, f"w dt < {limit:.6g}")


def choices(option: AnyOption) -> str:
    """Return the valid values and the default of an option, as text."""
    from vibsim.schemes import Flag, Option

    if isinstance(option, Option):
        return f"{' | '.join(option.choices)} (default {option.default})"
    if isinstance(option, Flag):
        return f"true | false (default {str(option.default).lower()})"
    return f"{option.least:g} to {option.most:g} (default {option.default:g})"


def shape(model: Model) -> str:
    """Return in a word or two what kind of equation a model is."""
    if model.coordinates > 1:
        return f"of {model.coordinates} coordinates"
    return "linear" if model.linear else "nonlinear"


def model_rows(model: Model) -> Iterator[Row]:
    """Yield the properties of a model."""
    yield "model", f"{model.kind}: {model.title}"
    yield "equation", model.equation
    yield "source", model.source
    if model.written is None:
        kept = "conservative" if model.conservative else "not conservative"
        yield "is", f"{shape(model)}, {kept}"
    if model.named is not None:
        yield "coordinates", COORDINATES
    yield from _under("initial", map(_quantity, model.states))
    yield from _under(
        "parameters", (f"{row.key}: {parameter_text(row)}" for row in model.parameters)
    )
    formulas = (
        f"{row.name}: {row.description}" + f" (default {row.default})" * bool(row.default)
        for row in model.formulas
    )
    yield from _under("formulas", formulas)
    if model.takes_events:
        text = (
            "events: states get new values where a formula crosses 0; stop: the motion ends there"
        )
        yield "events", text
    yield from _under("also stored", map(_quantity, model.outputs))
    if model.written is None:
        yield "exact solution", "known" if model.exact is not None else "not known"
    required = "".join(f", {field.name}: {field.default}" for field in needed(model))
    yield "write", f"model: {{kind: {model.kind}{required}}}"


def _under(label: str, texts: Iterable[str]) -> Iterator[Row]:
    """Yield a row for each text, the first with a label."""
    for number, text in enumerate(texts):
        yield "" if number else label, text


def _quantity(row: State | Output) -> str:
    return f"{row.name}: {row.long_name}{unit_text(row.unit)}"


def needed(model: Model) -> tuple[FormulaField, ...]:
    """Return the formulas that an experiment file must contain, or an alternative to them."""
    replaced = {field.instead_of for field in model.formulas}
    return tuple(field for field in model.formulas if field.name in replaced)


def unit_text(unit: str) -> str:
    """Return a unit in brackets; empty for a dimensionless quantity."""
    return "" if unit == "1" else f" [{unit}]"


def parameter_text(row: Parameter) -> str:
    """Return the description of a parameter, with unit, default and bounds."""
    bounds = []
    if row.minimum is not None:
        bounds.append(f"{'above' if row.exclusive else 'from'} {row.minimum:g}")
    if row.maximum is not None:
        bounds.append(f"to {row.maximum:g}")
    bound = f", {' '.join(bounds)}" if bounds else ""
    return f"{row.description}{unit_text(row.unit)} (default {row.default:g}{bound})"
