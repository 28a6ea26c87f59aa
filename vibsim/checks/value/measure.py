"""What a ``value`` check measures: the number, the bound of its error, and what finer levels do to it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import Field
from vibsim.checks.value import by_level
from vibsim.checks.value.criteria import compare
from vibsim.comparison import best_values, value_numbers
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.observe.member_block import MemberBlock

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ValueCheck

FIELDS = {
    "value": Field("the number, in its own unit"),
    "error_bound": Field("bound of its error where it is extrapolated"),
    "levels_needed": Field(
        "finer levels that are probably needed, 0 where none mends it, -1 unknown", np.int8, none=-1
    ),
    "level_as_asked": Field("finer level at which it is as asked, -1 for none", np.int16, none=-1),
    "value_by_level": Field(
        "the number at every level; that of a step at the same time of every level",
        dims=("scheme", "case", "level"),
        of_figure=True,
    ),
}


def measure(
    block: MemberBlock, compared: Mapping[str, Comparison], check: ValueCheck
) -> Mapping[str, Any]:
    """Return what a check measures."""
    at = check.at
    place = value_numbers.Place(block, compared, check.quantity or "", at.level, at.t, at.step)
    value, bound = (
        np.broadcast_to(found, block.shape) for found in best_values.value(check.value, place)
    )
    return {"value": value, "error_bound": bound, **_along_levels(check, place, value)}


def _along_levels(
    check: ValueCheck, place: value_numbers.Place, found: NDArray[np.float64]
) -> Mapping[str, Any]:
    """Return what finer levels do to the number, which of them has it as asked, and the number at every level."""
    levels = place.levels
    fulfilled = compare(check, found)[0]
    is_needed = not (place.block.lean and np.all(fulfilled))
    if is_needed and by_level.has_levels(check.value):
        numbers = by_level.by_level(check.value, place)
    else:
        numbers = np.full((*found.shape, len(levels)), np.nan)
    own = by_level.own_levels(check.value, levels)
    level = place.level if place.level in own else (own or levels)[-1]
    found_at = numbers[..., : len(own)] if own else numbers
    needed, first = by_level.prospects(check, found_at, own or levels, int(level), fulfilled)
    return {"levels_needed": needed, "level_as_asked": first, "value_by_level": numbers}
