"""The words that every part agrees on, and the page that explains them."""

from __future__ import annotations

import re
from itertools import permutations
from pathlib import Path

import pytest

from vibsim.core.vocabulary import NORMS, ORDER_TOLERANCE, REASONS, STATUSES, TYPICAL_NORM, worst

PAGE = Path(__file__).parents[2] / "docs" / "verdicts.md"


def test_the_page_explains_every_status_and_every_reason_as_they_are() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert tuple(re.findall(r"^\| \*\*(\w+)\*\* \|", text, re.MULTILINE)) == STATUSES
    listed = re.findall(r"^\| `(\w+)` \| (\w+) \| (.+?) \| (.+?) \|$", text, re.MULTILINE)
    assert {name: status for name, status, *_ in listed} == dict(REASONS)
    assert len(listed) == len(REASONS)


@pytest.mark.parametrize("order", list(permutations(STATUSES)))
def test_a_failure_outweighs_an_open_question_and_that_a_pass(order: tuple[str, ...]) -> None:
    assert worst(order) == "FAIL"
    assert worst(name for name in order if name != "FAIL") == "INCONCLUSIVE"
    assert worst(["PASS", "PASS"]) == "PASS"


def test_nothing_at_all_does_not_pass() -> None:
    assert worst([]) == "INCONCLUSIVE"


def test_a_word_that_is_no_status_does_not_pass() -> None:
    with pytest.raises(KeyError):
        worst(["PASS", "DAMAGED"])


def test_a_check_that_names_neither_norm_nor_tolerance_has_the_common_ones() -> None:
    from vibsim.experiment.schema.checks import ConvergesCheck

    check = ConvergesCheck(converges="theta")
    assert (check.norm, check.tolerance) == (TYPICAL_NORM, ORDER_TOLERANCE)
    for norm in NORMS:
        assert ConvergesCheck(converges="theta", norm=norm).norm == norm
