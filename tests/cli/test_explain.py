"""``vibsim explain``: the words of the pages for every reason."""

from __future__ import annotations

import pytest

from vibsim.cli import main
from vibsim.core.vocabulary import REASONS
from vibsim.report.text import reasons

Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize("word", REASONS)
def test_every_reason_is_explained_in_the_words_of_the_pages(word: str, capsys: Capture) -> None:
    assert main(["explain", word]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{word}: {REASONS[word]}"
    text = " ".join(" ".join(lines).split())
    assert reasons.REASONS[word].meaning in text
    assert reasons.REASONS[word].needs in text


def test_a_word_that_means_something_else_for_a_kind_of_check_says_so(capsys: Capture) -> None:
    assert main(["explain", "match"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert f"For `stable`: {reasons.reason('match', 'stable').meaning}" in text
    assert main(["explain", "order_low"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    promised = reasons.reason("order_low", "converges", is_promised=True)
    assert f"Where the scheme promises that order: {promised.meaning}" in text


def test_without_a_reason_all_are_listed_and_an_unknown_one_comes_with_the_nearest(
    capsys: Capture,
) -> None:
    assert main(["explain"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert dict(rows) == dict(REASONS)
    assert main(["explain", "order_lo"]) == 2
    assert "did you mean 'order_low'?" in capsys.readouterr().err


def test_a_narrow_terminal_has_no_long_lines(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vibsim.cli.terminal.columns", lambda: 40)
    assert main(["explain", "pre_asymptotic"]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 45
