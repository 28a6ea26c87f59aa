"""The loop over ladders and hypotheses, in the subset of Python that `vibsim.native` compiles; see also `matrices`."""

from __future__ import annotations

import ast
import math
from functools import cache
from inspect import getsource
from typing import TYPE_CHECKING

from vibsim.convergence.error_model.priors import DOMINATES, LEAST_SIGNAL

if TYPE_CHECKING:
    from vibsim.core.array_types import Floats, Integers
    from vibsim.native.kernel_cache import Kernel

NEGLIGIBLE = 1e-9
"""Hypotheses with less than this fraction of the largest weight are skipped.

On 413 random ladders, 1e-6 makes the same verdicts, and bounds hold or miss alike.
"""
FIRST_LEFT, SECOND_LEFT, LIMIT_LEFT, LIMIT = 2, 3, 4, 5
"""Columns of `Table.columns` after the roots: posterior variances of powers and limit, and the weights of the limit."""
RATIO, WEIGHT, SQUARE, MEAN = 0, 1, 2, 3
"""Columns of `result`; those of the pairs of powers follow the w columns from `MEAN` on."""
_CONSTANTS = (
    *("DOMINATES", "LEAST_SIGNAL", "NEGLIGIBLE"),
    *("FIRST_LEFT", "SECOND_LEFT", "LIMIT_LEFT", "LIMIT"),
    *("RATIO", "WEIGHT", "SQUARE", "MEAN"),
)
KINDS = "f2 f2 i1 i2 f1 f2 f2 f3 f2 f2 f2 i1 i1 f2 i i1 f1 f1 f1 f2"
"""Argument types of `kernel`, in the notation of `vibsim.native.machine.machine_code`."""


@cache
def compiled_kernel() -> Kernel:
    """Return `kernel`, compiled."""
    from vibsim.native.kernel_cache import load

    parts = ["import math"]
    parts += [f"{name} = {globals()[name]}" for name in _CONSTANTS]
    for mark, function in (("called", largest), ("called", times_half_power), ("entry", kernel)):
        tree = ast.parse(getsource(function)).body[0]
        assert isinstance(tree, ast.FunctionDef)
        del tree.body[0]  # the docstring
        parts.append(f"@{mark}\n{ast.unparse(tree)}")
    return load("\n\n".join(parts) + "\n", KINDS)


def largest(values: Floats, count: int) -> float:
    """Return the largest of the first `count` values, or 0 if all are negative."""
    result = 0.0
    for i in range(count):
        result = max(result, values[i])
    return result


def times_half_power(values: Floats, base: Floats, power: int, count: int) -> None:
    """Multiply the first `count` values by ``base**(power/2)`` in place, for whole powers; this overwrites `base`."""
    if power % 2 == 1:
        for i in range(count):
            values[i] *= math.sqrt(base[i])
    remaining = power // 2
    while remaining > 0:
        if remaining % 2 == 1:
            for i in range(count):
                values[i] *= base[i]
        remaining = remaining // 2
        if remaining > 0:
            for i in range(count):
                base[i] *= base[i]


def kernel(
    gram: Floats,
    evidence_gram: Floats,
    points: Integers,
    exponents: Integers,
    threshold: Floats,
    orthogonal: Floats,
    finer: Floats,
    forms: Floats,
    orthogonal_forms: Floats,
    orthogonal_bounds: Floats,
    columns: Floats,
    pair: Integers,
    groups: Integers,
    bounds: Floats,
    pair_count: int,
    selected: Integers,
    traces: Floats,
    base: Floats,
    weights: Floats,
    result: Floats,
) -> None:
    """Weigh the hypotheses on a window of w rows, and sum their estimates with these weights.

    The evidence of a hypothesis is ``(root/tr(K^-1 G))^(a/2) (1 + tr(B X))^(-b/2)``, with its own root, K and B.

    Parameters
    ----------
    gram
        Packed Gram matrices of the rows, divided by the square of the last row, shape (ladder, packed).
    evidence_gram
        The G of the evidence: `gram`, or only its component along the last row.
    points
        N of each ladder, 1 or 2.
    exponents
        a and b of each ladder, shape (ladder, 2).
    threshold
        Hypotheses with a smaller ``root/tr(K^-1 G)`` are skipped, shape (ladder,).
    orthogonal
        Packed X: Gram matrix of the components orthogonal to the last row, shape (ladder, packed X); (ladder, 0) if
        unused.
    finer
        Inner products of each row with the sum of all finer differences, and the square of that sum, shape (ladder,
        w + 1); (ladder, 0) if the limit is not needed.
    forms, orthogonal_forms, orthogonal_bounds, columns, pair, groups, bounds
        See `vibsim.convergence.error_model.hypotheses.Table`.
    pair_count
        Number of pairs of powers.
    selected, traces, base, weights
        Work space, one entry for each hypothesis.
    result
        Output, shape (ladder, `MEAN` + w + 3 pair_count): the largest ``root/tr(K^-1 G)``; the sum of the weights,
        relative to that of this ratio; the weighted sums of the squared distance from the finest level to the limit and
        of the limit as weights of the rows; and for each pair of powers its weight, its weight where the first power
        dominates, and its weight where the second one does.
    """
    packed = forms.shape[2]
    w = columns.shape[1] - LIMIT
    for ladder in range(gram.shape[0]):
        n = points[ladder]
        for g in range(bounds.shape[1]):
            base[g] = evidence_gram[ladder, 0] * bounds[2, g]
        for k in range(1, packed):
            for g in range(bounds.shape[1]):
                base[g] += evidence_gram[ladder, k] * bounds[2 + k, g]
        count = 0
        for g in range(bounds.shape[1]):
            bound = bounds[n - 1, g]
            if exponents[ladder, 1] > 0 and bound > threshold[ladder] * base[g]:
                student = 1.0
                position = 0
                for i in range(orthogonal_bounds.shape[1]):
                    student += max(orthogonal[ladder, position], 0.0) * orthogonal_bounds[g, i]
                    position += orthogonal_bounds.shape[1] - i
                for _ in range(exponents[ladder, 1] // exponents[ladder, 0]):
                    bound = bound / student
            # rounding may make this negative, here and below
            if bound > threshold[ladder] * base[g]:
                for h in range(groups[g], groups[g + 1]):
                    trace = evidence_gram[ladder, 0] * forms[h, 0, 0]
                    for k in range(1, packed):
                        trace += evidence_gram[ladder, k] * forms[h, 0, k]
                    ratio = columns[h, n - 1] / max(trace, 1e-280)
                    if ratio > threshold[ladder]:
                        selected[count] = h
                        traces[count] = trace
                        weights[count] = ratio
                        count += 1
        largest_ratio = largest(weights, count)
        for i in range(count):
            base[i] = weights[i] / largest_ratio
            weights[i] = 1.0
        times_half_power(weights, base, exponents[ladder, 0], count)
        if exponents[ladder, 1] > 0:
            for i in range(count):
                h = selected[i]
                student = 1.0
                for k in range(orthogonal.shape[1]):
                    student += orthogonal[ladder, k] * orthogonal_forms[h, k]
                base[i] = 1.0 / max(student, 1.0)
            times_half_power(weights, base, exponents[ladder, 1], count)
        largest_weight = largest(weights, count)
        result[ladder, RATIO] = largest_ratio
        for i in range(1, result.shape[1]):
            result[ladder, i] = 0.0
        for entry in range(count):
            weight = weights[entry]
            if weight > NEGLIGIBLE * largest_weight:
                h = selected[entry]
                trace = traces[entry]
                # posterior mean square of each power: its variance plus the square of its mean
                first = trace / w * columns[h, FIRST_LEFT]
                second = trace / w * columns[h, SECOND_LEFT]
                for k in range(packed):
                    first += gram[ladder, k] * forms[h, 1, k]
                    second += gram[ladder, k] * forms[h, 2, k]
                if first + second > LEAST_SIGNAL * trace / w:
                    position = MEAN + w + pair[h]
                    result[ladder, position] += weight
                    if second < DOMINATES * DOMINATES * first:
                        result[ladder, position + pair_count] += weight
                    if second * DOMINATES * DOMINATES > first:
                        result[ladder, position + 2 * pair_count] += weight
                    result[ladder, WEIGHT] += weight
                    if finer.shape[1] > 0:
                        square = trace / w * columns[h, LIMIT_LEFT] + finer[ladder, w]
                        for k in range(packed):
                            square += gram[ladder, k] * forms[h, 3, k]
                        for i in range(w):
                            square += 2.0 * columns[h, LIMIT + i] * finer[ladder, i]
                            result[ladder, MEAN + i] += weight * columns[h, LIMIT + i]
                        result[ladder, SQUARE] += weight * square
