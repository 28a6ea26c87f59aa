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
KINDS = "f2 f2 i1 i2 f2 f2 f3 f2 f2 i1 i f2 f2"


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


def largest(room: Floats) -> float:
    """Return the largest of the first row, none of which is negative."""
    # four at a time: each comparison waits for the one before
    a = b = c = d = 0.0
    count = room.shape[1]
    for h in range(0, count - 3, 4):
        a = max(a, room[0, h])
        b = max(b, room[0, h + 1])
        c = max(c, room[0, h + 2])
        d = max(d, room[0, h + 3])
    for h in range(count - 3, count):
        a = max(a, room[0, h])
    return max(a, b, c, d)


def to_half_power(room: Floats, power: int) -> None:
    """Multiply the first row with the second to the power of half a whole number; the second is lost."""
    count = room.shape[1]
    if power % 2 == 1:
        for h in range(count):
            room[0, h] *= math.sqrt(room[1, h])
    left = power // 2
    while left > 0:
        if left % 2 == 1:
            for h in range(count):
                room[0, h] *= room[1, h]
        left = left // 2
        if left > 0:
            for h in range(count):
                room[1, h] *= room[1, h]


def kernel(
    gram: Floats,
    read: Floats,
    points: Integers,
    powers: Integers,
    across: Floats,
    behind: Floats,
    forms: Floats,
    beside: Floats,
    columns: Floats,
    pair: Integers,
    pairs: int,
    room: Floats,
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
    across
        Packed X, what the rows have across the last one, shape (ladder, packed X), or none: (ladder, 0).
    behind
        Of the limit: the product of each row with the sum of all finer differences, and the square of that sum, shape
        (ladder, w + 1), or none: (ladder, 0).
    forms, beside, columns, pair
        See `vibsim.convergence.error_model.hypotheses.Table`.
    pairs
        The number of pairs of powers.
    room
        Room for two numbers for every hypothesis.
    found
        The result, shape (ladder, 3 + w + 3 pairs): the largest root over trace; the sum of weights over its power;
        and with these weights the square of the distance to the limit, the expression of the limit in the rows, and
        of every pair of powers the weight, and the part of it where the first power dominates, and the second.
    """
    packed, count = forms.shape[1], forms.shape[2]
    w = columns.shape[0] - 5
    for ladder in range(gram.shape[0]):
        n = points[ladder]
        for h in range(count):
            room[0, h] = read[ladder, 0] * forms[0, 0, h]
        for k in range(1, packed):
            for h in range(count):
                room[0, h] += read[ladder, k] * forms[0, k, h]
        # rounding may leave less than nothing, here and below
        for h in range(count):
            room[0, h] = columns[n - 1, h] / max(room[0, h], 1e-280)
        top = largest(room)
        for h in range(count):
            room[1, h] = room[0, h] / top
            room[0, h] = 1.0
        to_half_power(room, powers[ladder, 0])
        if powers[ladder, 1] > 0:
            for h in range(count):
                room[1, h] = 1.0
            for k in range(across.shape[1]):
                for h in range(count):
                    room[1, h] += across[ladder, k] * beside[k, h]
            for h in range(count):
                room[1, h] = 1.0 / max(room[1, h], 1.0)
            to_half_power(room, powers[ladder, 1])
        most = largest(room)
        found[ladder, 0] = top
        for i in range(1, found.shape[1]):
            found[ladder, i] = 0.0
        for h in range(count):
            weight = room[0, h]
            if weight > NEGLIGIBLE * most:
                trace = read[ladder, 0] * forms[0, 0, h]
                for k in range(1, packed):
                    trace += read[ladder, k] * forms[0, k, h]
                # what the rows leave open of a power, beside the square of what they say
                one = trace / w * columns[2, h]
                other = trace / w * columns[3, h]
                for k in range(packed):
                    one += gram[ladder, k] * forms[1, k, h]
                    other += gram[ladder, k] * forms[2, k, h]
                if one + other > LEAST * trace / w:
                    place = 3 + w + pair[h]
                    found[ladder, place] += weight
                    if other < DOMINATES * DOMINATES * one:
                        found[ladder, place + pairs] += weight
                    if other * DOMINATES * DOMINATES > one:
                        found[ladder, place + 2 * pairs] += weight
                    found[ladder, 1] += weight
                    if behind.shape[1] > 0:
                        square = trace / w * columns[4, h] + behind[ladder, w]
                        for k in range(packed):
                            square += gram[ladder, k] * forms[3, k, h]
                        for i in range(w):
                            square += 2.0 * columns[5 + i, h] * behind[ladder, i]
                            found[ladder, 3 + i] += weight * columns[5 + i, h]
                        found[ladder, 2] += weight * square
