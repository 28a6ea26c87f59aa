"""Verdicts on thousands of ladders with known truth, of which no number was used to set the verdict.

Its numbers were set on other seeds (`TUNED`). The table of the whole held-out half stands in ``docs/method.md``; the
command ``python tests/analysis/test_calibration.py`` prints it, in two minutes.
"""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from judged import ORDERS, Finding, datasets_of, experiment_of, findings
from synthetic import COUNTS, FAMILIES, TOLERANCE, groups

from vibsim import VibsimError, analyse

HELD_OUT = 2
TUNED = (1, 3, 4)
SAMPLE, REST = range(14), range(14, 42)
"""Groups of ladders: one of each number of levels (`synthetic.COUNTS`), and the others of a seed."""
MANY_LEVELS = 8
"""Groups of more levels take two thirds of the time; one of each number is judged, in `SAMPLE`."""
HIDDEN_MOST = {(HELD_OUT, SAMPLE): 6, (HELD_OUT, REST): 3, (TUNED[0], SAMPLE): 1}
"""Ladders in which a second power of more than a tenth may go unseen: the data do not show it, or, of more than eight
levels, noise is predicted so large that levels which do are not read."""
OPEN_BESIDE = 0.034
"""Of the orders that are excluded by one that passes, so many may be left open.

A second power of the same shape covers a lower order than the true one.
"""
PREDICTED = "noise is predicted so large that the finest of 13 or 16 levels, where a lower power emerges, are not read"
KNOWN = {
    "2.13.8": PREDICTED,
    "2.23.22": "seven levels with errors that swing",
    "1.1.8": "three levels, of which the first two have blown up",
    "1.16.3": "three levels with errors that swing",
    "1.16.9": "three levels, of which the first has blown up",
    "1.20.4": "five levels, of which the first three have blown up",
    "1.31.47": "the last three levels happen to have the ratio of one power",
}
"""The false verdicts: ladders by seed, group and place in it, and why they are judged wrongly."""
NEEDLESS = 0.04
"""Part of the decidable ladders that may be left open: noise that is no round-off, and what hides a lower power."""
COVERS = 0.95
WIDTH = 0.1


def judged(
    seed: int,
    numbers: range,
    folder: Path,
    orders: tuple[float, ...] = ORDERS,
    most_levels: int = max(COUNTS),
) -> list[Finding]:
    found = []
    for number, group in enumerate(groups(seed)):
        if number in numbers and len(group.levels) <= most_levels:
            found += findings(group, folder, orders)
            names = {id(ladder): f"{seed}.{number}.{i}" for i, ladder in enumerate(group.ladders)}
            NAMES.update(names)
    return found


NAMES: dict[int, str] = {}
"""Names of the ladders that were judged, as in `KNOWN`."""


def surprises(found: list[Finding]) -> set[tuple[str, float, str]]:
    """Return ladders with a false verdict that are not known for it, the order that is asked for, and the status."""
    return {
        (NAMES[id(one.ladder)], one.formal, one.status)
        for one in (*false_pass(found), *false_fail(found))
        if NAMES[id(one.ladder)] not in KNOWN
    }


@pytest.fixture(scope="module")
def held_out(tmp_path_factory: pytest.TempPathFactory) -> list[Finding]:
    return judged(HELD_OUT, SAMPLE, tmp_path_factory.mktemp("held_out"))


def expects_truth(one: Finding) -> bool:
    return abs(one.formal - one.ladder.order) <= TOLERANCE


def mixed(one: Finding) -> bool:
    return math.isnan(one.ladder.order)


def holds_both(one: Finding) -> bool:
    return one.low <= min(one.ladder.orders) and one.high >= max(one.ladder.orders)


def stated(found: list[Finding]) -> list[Finding]:
    """Return those whose interval is that of the true order, once for each ladder."""
    return [one for one in found if expects_truth(one) and math.isfinite(one.low)]


def covered(one: Finding) -> bool:
    return one.low <= one.ladder.order <= one.high


def margin(count: int) -> float:
    """Return the binomial margin of a share of `COVERS` among so many, of two standard deviations."""
    return 2.0 * math.sqrt(COVERS * (1.0 - COVERS) / count)


def table(found: list[Finding]) -> str:
    """Return what was found of every family, and of all."""
    head = "| family | ladders | right | PASS | false PASS | false FAIL | open | coverage | width |"
    rows = [head, "|---|---|---|---|---|---|---|---|---|"]
    for name in [*FAMILIES, "all"]:
        part = [one for one in found if name in ("all", one.ladder.family)]
        right = [one for one in part if expects_truth(one)]
        passed = sum(one.status == "PASS" for one in right)
        open_ = sum(one.status == "INCONCLUSIVE" and one.ladder.decidable for one in right)
        intervals = stated(part)
        share = np.mean([covered(one) for one in intervals])
        width = np.median([one.high - one.low for one in intervals])
        ladders = len({id(one.ladder) for one in part})
        counts = [ladders, len(right), passed, len(false_pass(part)), len(false_fail(part)), open_]
        rows.append(f"| {name} | {' | '.join(map(str, counts))} | {share:.3f} | {width:.4f} |")
    return "\n".join(rows)


def false_pass(found: list[Finding]) -> list[Finding]:
    """Return what passes with another order than the true one."""
    passes = [one for one in found if one.status == "PASS" and one.reason != "exact"]
    return [one for one in passes if not expects_truth(one) and not mixed(one)]


def false_fail(found: list[Finding]) -> list[Finding]:
    return [one for one in found if one.status == "FAIL" and expects_truth(one)]


def check(found: list[Finding], seed: int, numbers: range) -> None:
    assert surprises(found) == set()
    hidden = {id(o.ladder) for o in found if o.status == "PASS" and mixed(o) and not holds_both(o)}
    assert len(hidden) <= HIDDEN_MOST[seed, numbers]
    right = [one for one in found if expects_truth(one)]
    decidable = [one for one in right if one.ladder.decidable]
    left = [one for one in decidable if one.status == "INCONCLUSIVE"]
    assert len(left) <= NEEDLESS * len(decidable), Counter(one.reason for one in left)
    assert np.mean([covered(one) for one in stated(found)]) >= COVERS


@pytest.mark.slow
def test_a_third_of_the_held_out_half_is_judged_rightly(held_out: list[Finding]) -> None:
    check(held_out, HELD_OUT, SAMPLE)


@pytest.mark.slow
def test_an_order_that_passes_fails_wherever_its_interval_excludes_what_is_asked_for(
    held_out: list[Finding],
) -> None:
    """What is enough to believe an order is enough to say that it is no other one."""
    ladders: dict[int, list[Finding]] = {}
    for one in held_out:
        ladders.setdefault(id(one.ladder), []).append(one)
    told: Counter[str] = Counter()
    for group in ladders.values():
        for passed in (one for one in group if one.status == "PASS" and one.reason != "exact"):
            low, high = passed.low - TOLERANCE, passed.high + TOLERANCE
            told.update(one.status for one in group if not low <= one.formal <= high)
    assert told["PASS"] == 0
    assert told["INCONCLUSIVE"] <= OPEN_BESIDE * told["FAIL"]


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_intervals_are_calibrated_family_by_family(held_out: list[Finding], family: str) -> None:
    intervals = [one for one in stated(held_out) if one.ladder.family == family]
    assert np.mean([covered(one) for one in intervals]) >= COVERS - margin(len(intervals))


@pytest.mark.slow
def test_intervals_of_clean_ladders_of_four_levels_are_narrow(held_out: list[Finding]) -> None:
    clean = ("pure", "clean_two_term", "two_term", "even", "three_terms")
    widths = [
        one.high - one.low
        for one in stated(held_out)
        if len(one.group.levels) == 4 and one.ladder.family in clean
    ]
    assert len(widths) > 20
    assert np.median(widths) <= WIDTH


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_both_with_and_without_an_exact_solution(held_out: list[Finding], known: bool) -> None:
    part = [one for one in held_out if one.group.known == known]
    intervals = stated(part)
    assert np.mean([covered(one) for one in intervals]) >= COVERS - margin(len(intervals))
    assert surprises(part) == set()


@pytest.mark.slow
def test_two_levels_are_left_open(held_out: list[Finding]) -> None:
    assert {o.reason for o in held_out if len(o.group.levels) == 2} == {"too_few_levels"}


def test_a_ladder_is_made_of_its_seed_alone() -> None:
    one, other = (next(groups(7, 1, 5)) for _ in range(2))
    for a, b in zip(one.ladders, other.ladders, strict=True):
        np.testing.assert_array_equal(a.errors, b.errors)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "numbers"), [(HELD_OUT, REST), (TUNED[0], SAMPLE)])
def test_the_rest_and_a_tuned_seed_are_judged_rightly(
    seed: int, numbers: range, tmp_path: Path
) -> None:
    """By the orders that nine of ten ladders have; the other five, and many levels, are asked for above."""
    check(judged(seed, numbers, tmp_path, (1.0, 2.0, 3.0, 4.0), MANY_LEVELS), seed, numbers)


@pytest.mark.parametrize("name", ["v", "u_max", "omega_dt", "first_peak"])
def test_data_without_what_is_needed_are_refused(name: str, tmp_path: Path) -> None:
    group = next(groups(7, 1, 2))
    data = [level.drop_vars(name) for level in datasets_of(group)]
    with pytest.raises(VibsimError, match=f"level {group.levels[0]}: {name} is missing"):
        analyse(experiment_of(group, tmp_path, (2.0,)), data)


if __name__ == "__main__":
    with TemporaryDirectory() as place:
        print(table(judged(HELD_OUT, range(REST.stop), Path(place))))
