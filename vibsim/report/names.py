"""Names of quantities and of swept keys as pages write them."""

from __future__ import annotations

import re

NAMES = {
    "theta": ("θ", "the angle θ"),
    "omega": ("ω", "the angular velocity ω"),
    "energy": ("E", "the energy E"),
    "kinetic_energy": ("T", "the kinetic energy T"),
    "potential_energy": ("V", "the potential energy V"),
    "energy_deviation": ("dE", "the energy deviation dE = E(t) − E(0)"),
}
"""Letter and words of quantities; others go by their name."""

_KEY = re.compile(r"\b(initial|model(?:\.parameters)?|schemes|time)\.(\w+)(?:\.(\w+))?")
"""A swept key: its section, and one or two names."""


def swept(text: str) -> str:
    """Return a text with swept keys in the words of a page, such as `linear damping` for `model.damping.linear`.

    Dotted keys belong to experiment files, tables and commands.
    """

    def key(found: re.Match[str]) -> str:
        section, outer, inner = found.groups()
        if section == "initial":
            return f"initial {NAMES.get(outer, (outer,))[0]}"
        between = " of " if section == "schemes" else " "
        return f"{inner}{between}{outer}" if inner else outer

    return _KEY.sub(key, text).replace(" = -", " = −")
