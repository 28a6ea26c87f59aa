"""The tolerance of an experiment in words: whether a member reached it, and what to change where it did not."""

from __future__ import annotations

import math

from vibsim.checks.tolerance_check import largest_bound
from vibsim.checks.words.found import Found
from vibsim.checks.words.notation import Notation


def rule(tolerance: float, notation: Notation) -> str:
    """Say what the bound of the error should be."""
    return f"at most {notation.number(tolerance)}"


def tell(f: Found, tolerance: float) -> str:
    """Say how large the error of the extrapolated solution may be."""
    largest, which = largest_bound(f.experiment, f.record)
    bound = float(largest[f.scheme, f.case])
    state = f.experiment.model.definition.states[which[f.scheme, f.case]].name
    if not math.isfinite(bound):
        return (
            "nothing is known of the error of the extrapolated solution: its levels do not agree."
        )
    verb = "is" if bound <= tolerance else "is not"
    return (
        f"the error of the extrapolated solution is bounded by {f.notation.number(bound, 3)} (of "
        f"{f.notation.quantity(state)}, the largest over time); that {verb} {rule(tolerance, f.notation)}."
    )


def advise(f: Found) -> str:
    """Say what to change in the YAML: the pilot did not try this member, and the ladder is too coarse for it."""
    experiment, name = f.experiment, f.scheme_name
    levels, model = experiment.levels, experiment.model.definition
    state = model.states[largest_bound(experiment, f.record)[1][f.scheme, f.case]].name
    swept = experiment.sweep.keys if experiment.sweep else ()
    fixed = experiment.schemes[f.scheme].options.items()
    options = {key: word for key, word in fixed if f"schemes.{name}.{key}" not in swept}
    ways = [
        "take such members into an experiment of their own, whose pilot tries them",
        f"give finer `levels:` than {levels[0]} to {levels[-1]} in place of `tolerance:`",
    ]
    if state in model.velocities and options.get("end_velocity", "kick") != "kick":
        ways.insert(0, f"set `end_velocity: kick` for scheme {name}")
    if options.get("arithmetic", "compensated") != "compensated":
        ways.append(f"set `arithmetic: compensated` for scheme {name}")
    text = ", or ".join(ways)
    return f"{text[0].upper()}{text[1:]}."
