"""``vibsim list``: what there is to choose from."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Iterable


def list_(options: Namespace) -> int:
    """Print the names and what they mean."""
    rows = {
        "models": _models,
        "schemes": _schemes,
        "checks": _checks,
        "experiments": _experiments,
    }[options.what]()
    table = [tuple(map(str, row)) for row in rows]
    width = max((len(name) for name, _ in table), default=0)
    for name, text in table:
        print(f"{name.ljust(width)}  {text}".rstrip())
    return 0


def _models() -> Iterable[tuple[str, str]]:
    from vibsim.models import MODELS

    for model in MODELS.values():
        parameters = ", ".join(f"{p.name} = {p.default:g} {p.unit}" for p in model.parameters)
        shape = "linear" if model.linear else "nonlinear"
        yield model.kind, f"{model.title}: {model.equation}; {parameters}; {shape}"


def _schemes() -> Iterable[tuple[str, str]]:
    from vibsim.schemes import SCHEMES, Option
    from vibsim.theory import stability_limit

    for scheme in SCHEMES.values():
        plural = "" if scheme.force_evaluations == 1 else "s"
        work = f"{scheme.force_evaluations} force evaluation{plural} per step"
        limit = stability_limit(scheme, scheme.defaults())
        stable = "stable for every step" if limit == math.inf else f"stable while w dt < {limit:g}"
        yield scheme.kind, f"{scheme.title}; {work}; {stable}"
        for option in scheme.options:
            choices = " | ".join(option.choices) if isinstance(option, Option) else ""
            yield f"  {option.name}", f"{choices}: {option.description}"


def _checks() -> Iterable[tuple[str, str]]:
    from vibsim.spec.values import VALUES

    yield "converges", "a quantity converges with an order: {converges: q, order: scheme | number}"
    yield (
        "claim",
        "a statement of a source, with the check that decides it: {claim:, that:, holds:}",
    )
    yield "value", "a number of the outcome: {value: NAME, quantity:, at:, equals | below | above:}"
    for name, value in VALUES.items():
        yield f"  {name}", value.description


def _experiments() -> Iterable[tuple[str, str]]:
    from vibsim.plan import checkout, experiments, load_all

    for key, plan in load_all(experiments(checkout())).items():
        yield key, plan.title
