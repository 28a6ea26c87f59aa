"""The loop over ladders and hypotheses, in the part of Python that `vibsim.native` compiles.

A symmetric matrix is *packed*: its entries (i, j) with i <= j, row by row. A *form* is a packed matrix with the entries
off the diagonal twice, so that ``tr(M G)`` is the sum of products of the form of M and the packed G.
"""

from __future__ import annotations

import ast
import math
from functools import cache
from inspect import getsource
from typing import TYPE_CHECKING

from vibsim.convergence.error_model.priors import DOMINATES, LEAST

if TYPE_CHECKING:
    from vibsim.core.array_types import Floats, Integers
    from vibsim.native.kernel_cache import Kernel

NEGLIGIBLE = 1e-9
"""Weights that are a smaller part of the largest one are left out."""
KINDS = "f2 f2 i1 i2 f1 f2 f2 f3 f2 f2 f2 i1 i1 f2 i i1 f1 f1 f1 f2"
"""Types of the arguments of `kernel`, as `vibsim.native.machine.machine_code` has them."""


@cache
def weigh() -> Kernel:
    """Return `kernel`, compiled."""
    from vibsim.native.kernel_cache import load

    parts = ["import math"]
    parts += [f"{name} = {globals()[name]}" for name in ("DOMINATES", "LEAST", "NEGLIGIBLE")]
    for mark, function in (("called", largest), ("called", to_half_power), ("entry", kernel)):
        tree = ast.parse(getsource(function)).body[0]
        assert isinstance(tree, ast.FunctionDef)
        del tree.body[0]  # the docstring
        parts.append(f"@{mark}\n{ast.unparse(tree)}")
    return load("\n\n".join(parts) + "\n", KINDS)


def largest(values: Floats, count: int) -> float:
    """Return the largest of the first ones, none of which is negative."""
    found = 0.0
    for i in range(count):
        found = max(found, values[i])
    return found


def to_half_power(found: Floats, base: Floats, power: int, count: int) -> None:
    """Multiply with the base to the power of half a whole number; the base is lost."""
    if power % 2 == 1:
        for i in range(count):
            found[i] *= math.sqrt(base[i])
    left = power // 2
    while left > 0:
        if left % 2 == 1:
            for i in range(count):
                found[i] *= base[i]
        left = left // 2
        if left > 0:
            for i in range(count):
                base[i] *= base[i]


def kernel(
    gram: Floats,
    read: Floats,
    points: Integers,
    powers: Integers,
    least: Floats,
    across: Floats,
    behind: Floats,
    forms: Floats,
    beside: Floats,
    beside_bounds: Floats,
    columns: Floats,
    pair: Integers,
    groups: Integers,
    bounds: Floats,
    pairs: int,
    chosen: Integers,
    traces: Floats,
    base: Floats,
    weights: Floats,
    found: Floats,
) -> None:
    """Weigh the hypotheses on a window of w rows, and sum up over them what they say of the error.

    The evidence of a hypothesis is ``(root/tr(K^-1 G))^(a/2) (1 + tr(B X))^(-b/2)``, with its matrices K and B.

    Parameters
    ----------
    gram
        Packed Gram matrices of the rows, over the square of the last row, shape (ladder, packed).
    read
        What the evidence reads of them as G: all, or the part along the last row.
    points
        N of each ladder, 1 or 2.
    powers
        a and b of each ladder, shape (ladder, 2).
    least
        Of each ladder: what has a smaller root over trace does not matter.
    across
        Packed X, what the rows have across the last one, shape (ladder, packed X), or none: (ladder, 0).
    behind
        Of the limit: the product of each row with the sum of all finer differences, and the square of that sum, shape
        (ladder, w + 1), or none: (ladder, 0).
    forms, beside, beside_bounds, columns, pair, groups, bounds
        See `vibsim.convergence.error_model.hypotheses.Table`.
    pairs
        The number of pairs of powers.
    chosen, traces, base, weights
        Room for a number for every hypothesis.
    found
        The result, shape (ladder, 3 + w + 3 pairs): the largest root over trace; the sum of weights over its power;
        and with these weights the square of the distance to the limit, the expression of the limit in the rows, and
        of every pair of powers the weight, and the part of it where the first power dominates, and the second.
    """
    packed = forms.shape[2]
    w = columns.shape[1] - 5
    for ladder in range(gram.shape[0]):
        n = points[ladder]
        for g in range(bounds.shape[1]):
            base[g] = read[ladder, 0] * bounds[2, g]
        for k in range(1, packed):
            for g in range(bounds.shape[1]):
                base[g] += read[ladder, k] * bounds[2 + k, g]
        count = 0
        for g in range(bounds.shape[1]):
            bound = bounds[n - 1, g]
            if powers[ladder, 1] > 0 and bound > least[ladder] * base[g]:
                sum_of_all = 1.0
                place = 0
                for i in range(beside_bounds.shape[1]):
                    sum_of_all += max(across[ladder, place], 0.0) * beside_bounds[g, i]
                    place += beside_bounds.shape[1] - i
                for _ in range(powers[ladder, 1] // powers[ladder, 0]):
                    bound = bound / sum_of_all
            # rounding may leave less than nothing, here and below
            if bound > least[ladder] * base[g]:
                for h in range(groups[g], groups[g + 1]):
                    trace = read[ladder, 0] * forms[h, 0, 0]
                    for k in range(1, packed):
                        trace += read[ladder, k] * forms[h, 0, k]
                    ratio = columns[h, n - 1] / max(trace, 1e-280)
                    if ratio > least[ladder]:
                        chosen[count] = h
                        traces[count] = trace
                        weights[count] = ratio
                        count += 1
        top = largest(weights, count)
        for i in range(count):
            base[i] = weights[i] / top
            weights[i] = 1.0
        to_half_power(weights, base, powers[ladder, 0], count)
        if powers[ladder, 1] > 0:
            for i in range(count):
                h = chosen[i]
                sum_of_all = 1.0
                for k in range(across.shape[1]):
                    sum_of_all += across[ladder, k] * beside[h, k]
                base[i] = 1.0 / max(sum_of_all, 1.0)
            to_half_power(weights, base, powers[ladder, 1], count)
        most = largest(weights, count)
        found[ladder, 0] = top
        for i in range(1, found.shape[1]):
            found[ladder, i] = 0.0
        for chosen_one in range(count):
            weight = weights[chosen_one]
            if weight > NEGLIGIBLE * most:
                h = chosen[chosen_one]
                trace = traces[chosen_one]
                # what the rows leave open of a power, beside the square of what they say
                one = trace / w * columns[h, 2]
                other = trace / w * columns[h, 3]
                for k in range(packed):
                    one += gram[ladder, k] * forms[h, 1, k]
                    other += gram[ladder, k] * forms[h, 2, k]
                if one + other > LEAST * trace / w:
                    place = 3 + w + pair[h]
                    found[ladder, place] += weight
                    if other < DOMINATES * DOMINATES * one:
                        found[ladder, place + pairs] += weight
                    if other * DOMINATES * DOMINATES > one:
                        found[ladder, place + 2 * pairs] += weight
                    found[ladder, 1] += weight
                    if behind.shape[1] > 0:
                        square = trace / w * columns[h, 4] + behind[ladder, w]
                        for k in range(packed):
                            square += gram[ladder, k] * forms[h, 3, k]
                        for i in range(w):
                            square += 2.0 * columns[h, 5 + i] * behind[ladder, i]
                            found[ladder, 3 + i] += weight * columns[h, 5 + i]
                        found[ladder, 2] += weight * square
