"""The step sizes of a study: one for each level, or several that are refined together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.convergence.study.refusal import finite_number, refused
from vibsim.core.array_types import Floats

PROPORTIONAL = 1e-3
"""Largest relative variation of the quotient of proportional sizes, which a user may have rounded."""


@dataclass(frozen=True)
class Refinement:
    """Step sizes from the coarsest level to the finest."""

    h: Floats
    """Strictly decreasing, shape (n,)."""
    positions: tuple[int, ...]
    """Index of each of these levels in the input."""
    names: tuple[str, ...] = ("h",)
    """Names of the sizes; the first one is that of `h`."""
    is_proportional: bool = True
    """Whether all sizes are proportional to the first."""


def refinement(h: Any, count: int) -> Refinement:
    """Return the step sizes of `count` levels, sorted.

    Parameters
    ----------
    h
        A size for each level, in any order; or a mapping from names to such lists, for sizes that are refined together.
        The order of convergence then refers to the first one. Sizes need not be proportional (dt may follow dx^2), but
        all of them must decrease from level to level.

    Raises
    ------
    InputError
        If sizes are not positive, finite and different, or if one size does not decrease where the first one does.
    """
    if not isinstance(h, Mapping):
        sizes = _sizes("h", h, count)
        return _sorted(sizes)
    if not h:
        raise refused("h", "{}", "must name at least one size")
    table = {str(name): _sizes(f"h[{name!r}]", sizes, count) for name, sizes in h.items()}
    names = tuple(table)
    first = _sorted(table[names[0]])
    order = list(first.positions)
    is_proportional = True
    for name in names[1:]:
        sizes = table[name][order]
        if np.any(np.diff(sizes) >= 0.0):
            k = int(np.flatnonzero(np.diff(sizes) >= 0.0)[0])
            change = f"{sizes[k]:g} and then {sizes[k + 1]:g}"
            rule = f"must decrease from level to level, as {names[0]} does: it is {change}"
            raise refused(f"h[{name!r}]", table[name].tolist(), rule, "refine all sizes together")
        quotient = sizes / first.h
        is_proportional &= bool(np.ptp(quotient) <= PROPORTIONAL * np.max(quotient))
    return Refinement(first.h, first.positions, names, is_proportional)


def _sizes(key: str, h: Any, count: int) -> Floats:
    """Return the sizes of all levels in the order of the input."""
    try:
        entries = list(h)
    except TypeError:
        raise refused(key, h, "must be a list with the step size of every level") from None
    if len(entries) != count:
        rule = f"has {len(entries)} step sizes for {count} levels"
        raise refused(key, h, rule, "give one for each level")
    sizes = np.array([finite_number(f"{key}[{i}]", x, above=0.0) for i, x in enumerate(entries)])
    for i, size in enumerate(sizes.tolist()):
        if size in sizes[:i]:
            twin = int(np.flatnonzero(sizes[:i] == size)[0])
            raise refused(
                f"{key}[{i}]", size, f"is the step size of level {twin}, too; all must differ"
            )
    return sizes


def _sorted(sizes: Floats) -> Refinement:
    order = np.argsort(-sizes)
    return Refinement(sizes[order], tuple(order.tolist()))
