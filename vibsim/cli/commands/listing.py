"""``vibsim list``: list models, schemes, checks or experiments."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from vibsim.cli.jobs.common import refusal
from vibsim.cli.list_entry import choices, facts, in_full, shape
from vibsim.core.errors import Fault, InputError

if TYPE_CHECKING:
    from vibsim.models import Model
    from vibsim.schemes import Scheme


def list_(options: Namespace) -> int:
    """Print the names with a description, also those that installed packages offer.

    Raises InputError after the list, where the offer of a package cannot be loaded.
    """
    if options.name is not None:
        if options.what not in ("models", "schemes"):
            raise refusal("NAME", options.name, "only models and schemes have more to show")
        print(*in_full(options.what, options.name), sep="\n")
        return 0
    if options.what == "schema":
        import json

        from vibsim.experiment.schema.document import installed_schema

        print(json.dumps(installed_schema(), indent=2, ensure_ascii=False))
        return 0
    faults: list[Fault] = []
    if options.what == "models":
        from vibsim.models import MODELS

        models, faults = MODELS.usable()
        rows = _models(models.values())
    elif options.what == "schemes":
        from vibsim.schemes import SCHEMES

        schemes, faults = SCHEMES.usable()
        rows = _schemes(schemes.values())
    else:
        rows = checks() if options.what == "checks" else _experiments()
    table = [tuple(map(str, row)) for row in rows]
    width = max((len(name) for name, _ in table), default=0)
    for name, text in table:
        print(f"{name.ljust(width)}  {text}".rstrip())
    if faults:
        raise InputError(faults)
    return 0


def _models(models: Iterable[Model]) -> Iterable[tuple[str, str]]:
    for model in models:
        parameters = ", ".join(
            f"{p.name} = {p.default:g}" + f" {p.unit}" * (p.unit != "1") for p in model.parameters
        )
        # a model that is written from a file depends on it
        last = "" if model.written is not None else shape(model)
        if model.formulas:
            last = f"formulas {', '.join(row.name for row in model.formulas)}"
        parts = (f"{model.title}: {model.equation}", parameters, last)
        yield model.kind, "; ".join(filter(None, parts))


def _schemes(schemes: Collection[Scheme]) -> Iterable[tuple[str, str]]:
    """Yield for each scheme a line of facts, then its title and source, then its options."""
    head = ("order", "step", "symplectic", "forces/step", "stability limit")
    columns = {scheme.kind: facts(scheme) for scheme in schemes}
    widths = [max(map(len, column)) for column in zip(head, *columns.values(), strict=True)]

    def line(cells: Iterable[str]) -> str:
        return "  ".join(text.ljust(width) for text, width in zip(cells, widths, strict=True))

    yield "kind", line(head)
    for scheme in schemes:
        yield scheme.kind, line(columns[scheme.kind])
        yield "", f"{scheme.title}; {scheme.source}"
        for option in scheme.options:
            yield f"  {option.name}", f"{choices(option)}: {option.description}"


def checks() -> Iterable[tuple[str, str]]:
    """Yield the kinds of checks, and after `value` every number that it accepts."""
    from vibsim.experiment.value_names import VALUES

    drifts = "{conserves: energy | energy_d2t, drift: none | bounded | linear | quadratic}"
    equal = "{equal: [scheme, scheme | exact | discrete], quantity:, atol:}"
    value = "{value: NAME, quantity:, at:, over:, take:, equals | below | above:}"
    text = "a statement of a source, with the check that decides it"
    order = "{converges: q, order: scheme | number}"
    vectors = "position_vector and velocity_vector are all coordinates"
    yield "converges", f"a quantity converges with an order ({vectors}): {order}"
    accurate = "{accurate: q, relative | absolute: number}"
    yield "accurate", f"the error of the finest level is small enough: {accurate}"
    yield "claim", f"{text}: {{claim:, that:, holds:}}"
    yield "stable", "schemes are stable, or not: {stable: true | false, schemes:, level:, case:}"
    yield "conserves", f"how the energy drifts: {drifts}"
    yield "equal", f"two solutions are one: {equal}"
    yield "value", f"a number of the outcome: {value}"
    for name, row in VALUES.items():
        yield f"  {name}", row.description


def _experiments() -> Iterable[tuple[str, str]]:
    from vibsim.core.home import home
    from vibsim.plan import experiments, load_all

    for key, plan in load_all(experiments(home())).items():
        yield key, plan.title
