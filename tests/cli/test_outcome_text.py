"""What a run says: a line for each experiment, colours where they are wanted, and nothing a terminal would obey."""

from __future__ import annotations

import io
from typing import Any

import pytest

from vibsim.cli import outcome_text, terminal

FACTS = {"order": 2.002, "order_low": 2.0, "order_high": 2.0023, "relative_error": 6.0e-4}


def check(name: str = "order", status: str = "PASS", **more: Any) -> dict[str, Any]:
    return {
        "id": name,
        "kind": "converges",
        "status": status,
        "reason": "asymptotic" if status == "PASS" else "order_low",
        "quantity": "theta",
        "expected": "PASS",
        "text": "theta does something.",
        "advice": "" if status == "PASS" else "Use another start.",
        "results": [{"facts": FACTS}],
        "counts": {"PASS": 1, "FAIL": 0, "INCONCLUSIVE": 0},
    } | more


def entry(*checks: dict[str, Any], name: str = "tiny", **more: Any) -> dict[str, Any]:
    status = "PASS" if all(row["status"] == "PASS" for row in checks) else "FAIL"
    return {"collection": "adhoc", "experiment": name, "status": status, "checks": checks} | more


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_an_experiment_that_passes_is_one_line_with_its_order_and_error() -> None:
    (line,) = outcome_text.in_lines([entry(check())], 200)
    assert line == "PASS  adhoc/tiny  theta: order 2.002 (2.000 to 2.002), relative error 0.0006"


def test_of_a_sweep_the_hardest_member_is_told_as_such() -> None:
    row = check(counts={"PASS": 31, "FAIL": 0, "INCONCLUSIVE": 0})
    assert outcome_text.headline(entry(row), 99).endswith("error 0.0006, the hardest of 31")
    assert outcome_text.headline(entry(row), 60).endswith("(2.000 to 2.002), relative error 0.0006")


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        (60, "theta: order 2.002, relative error 0.0006"),
        (56, "theta: order 2.002"),
        (10, "theta: order 2.002"),
    ],
)
def test_a_narrow_terminal_leaves_numbers_out_and_cuts_none(columns: int, told: str) -> None:
    (line,) = outcome_text.in_lines([entry(check())], columns)
    assert line == f"PASS  adhoc/tiny  {told}"


def test_what_did_not_pass_stands_below_with_its_advice_and_nothing_else_does() -> None:
    rows = (check("one"), check("two", "INCONCLUSIVE"), check("three", "FAIL", reason="mismatch"))
    lines = list(outcome_text.in_lines([entry(*rows)], 200))
    assert lines == [
        "FAIL  adhoc/tiny  mismatch (2 of 3 checks did not pass)",
        "  INCONCLUSIVE  order_low  two",
        "      theta does something.",
        "      Use another start.",
        "  FAIL          mismatch   three",
        "      theta does something.",
        "      Use another start.",
    ]
    full = list(outcome_text.in_full([entry(*rows)], 200))
    assert full[0] == "adhoc/tiny  FAIL"
    assert full[1].split() == [*["PASS", "asymptotic", "one", "theta", "does", "something."]]


def test_a_trap_gives_the_headline_only_where_nothing_else_does() -> None:
    trap = check("trap", expected="FAIL (order_low)", quantity="omega")
    assert "theta: " in outcome_text.headline(entry(trap, check()), 99)
    assert "omega: " in outcome_text.headline(entry(trap), 99)
    # a claim that is true is expected to be "true"
    number = check(
        "claim", kind="claim", expected="true", results=[{"facts": {}}], text="It is 28."
    )
    assert outcome_text.headline(entry(trap, number), 99) == "It is 28."


@pytest.mark.parametrize(
    "facts",
    [{}, {"order": None}, {"value": 1.0}],
    ids=["none", "no order", "value"],
)
def test_a_check_without_an_order_gives_its_sentence(facts: dict[str, Any]) -> None:
    row = check(results=[{"facts": facts}])
    assert outcome_text.headline(entry(row), 99) == "theta does something."


def test_an_experiment_without_a_summary_says_why() -> None:
    lost = entry(error="did not finish: it has no summary", status="FAIL")
    assert list(outcome_text.in_lines([lost], 200)) == [
        "FAIL  adhoc/tiny  did not finish: it has no summary"
    ]
    assert "did not finish: it has no summary" in "\n".join(outcome_text.in_full([lost], 200))


def test_text_from_a_results_folder_gives_a_terminal_no_orders() -> None:
    row = check(status="FAIL", text="\033[2Jgone\r\nand\x07", advice="\033]0;title\x07")
    for tell in (outcome_text.in_lines, outcome_text.in_full):
        text = "\n".join(tell([entry(row, check(text="\033[2J"))], 200))
        assert "\033" not in text
        assert "\x07" not in text
        assert "\r" not in text


def test_text_of_a_solver_gives_a_terminal_no_orders() -> None:
    lost = entry(error="\033[2Jgone\x07", status="FAIL")
    failure = {"job": "adhoc/tiny", "log": "log", "tail": ["\033]0;title\x07", "broken\r"]}
    text = "".join([*outcome_text.in_full([lost], 200), *outcome_text.of_failures([failure])])
    assert "gone" in text
    assert "broken" in text
    assert not {"\033", "\x07", "\r"} & set(text)


def test_colours_are_for_terminals_that_want_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("sys.stdout", io.StringIO())
    assert terminal.painted("FAIL", "FAIL") == "FAIL"
    monkeypatch.setattr("sys.stdout", Terminal())
    assert terminal.painted("FAIL", "FAIL") == "\033[31mFAIL\033[0m"
    monkeypatch.setenv("NO_COLOR", "1")
    assert terminal.painted("FAIL", "FAIL") == "FAIL"
    # https://no-color.org: only a value that is not empty counts
    monkeypatch.setenv("NO_COLOR", "")
    assert terminal.painted("FAIL", "FAIL") != "FAIL"
    monkeypatch.setenv("TERM", "dumb")
    assert terminal.painted("FAIL", "FAIL") == "FAIL"


def test_colours_do_not_shift_the_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [entry(check()), entry(check("two", "FAIL"), check("long name"), name="longer")]
    plain = [*outcome_text.in_lines(rows, 90), *outcome_text.in_full(rows, 90)]
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("sys.stdout", Terminal())
    coloured = [*outcome_text.in_lines(rows, 90), *outcome_text.in_full(rows, 90)]
    assert coloured != plain
    bare = [line.replace("\033[0m", "") for line in coloured]
    for colour in terminal._COLOURS.values():
        bare = [line.replace(f"\033[{colour}m", "") for line in bare]
    assert bare == plain


def test_jobs_that_fail_in_the_same_way_are_told_once() -> None:
    rows = [
        ("a", ["no dt"]),
        ("b", ["no dt"]),
        ("c", []),
        ("d", []),
        ("e", ["no dt"]),
        ("f", ["no h"]),
    ]
    failures = [{"job": job, "log": f"{job}.log", "tail": tail} for job, tail in rows]
    told = "\n".join(outcome_text.of_failures(failures))
    assert [job for job, _ in rows if f"failed: {job} " in told] == ["a", "c", "d", "f"]
    assert told.count("2 more jobs failed with the same message") == 1
    assert told.count("more job") == 1


def test_a_run_without_a_verdict_counts_no_checks() -> None:
    line = outcome_text.count([entry()], "FAIL")
    assert line.startswith("1 experiment, no check was judged: ")
