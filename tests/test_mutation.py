"""The seeded faults of the mutation test: each can be seeded, and what catches the simplest of them."""

import ast
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "mutation"))

import seeding
from faults import FAULTS

ROOT = Path(__file__).parents[1]
NAMES = [fault.name for fault in FAULTS]


def test_there_are_faults_of_every_kind():
    assert len(FAULTS) >= 40
    assert len(set(NAMES)) == len(NAMES)
    kinds = {fault.place for fault in FAULTS}
    assert kinds == {
        "model", "damping", "scheme", "start", "end", "events", "engine", "exact", "analysis",
    }  # fmt: skip


def test_a_fault_stands_once_in_its_file_and_leaves_a_program():
    for fault in FAULTS:
        text = (ROOT / "vibsim" / fault.file).read_text()
        assert text.count(fault.right) == 1, fault.name
        assert fault.wrong != fault.right, fault.name
        ast.parse(text.replace(fault.right, fault.wrong), fault.name)


def test_the_page_tells_of_every_fault():
    page = (ROOT / "docs" / "mutation.md").read_text()
    assert [name for name in NAMES if f"| {name} |" not in page] == []


def test_what_notices_a_fault_is_what_passes_no_longer():
    before = {
        "a": {
            "verdicts": {"check_1 converges": ["x: PASS asymptotic", "y: FAIL order_low"]},
            "plain": {"u, x": True},
        }
    }
    after = {
        "a": {
            "verdicts": {"check_1 converges": ["x: FAIL wrong_limit", "y: FAIL order_low"]},
            "plain": {"u, x": False},
        }
    }
    assert seeding.noticed(before, after) == ("converges: wrong_limit",)
    assert seeding.seen_plainly(before, after)
    assert seeding.noticed(before, before) == ()
    assert not seeding.seen_plainly(before, before)
    assert seeding.noticed(before, {"all": {"error": "ValueError: no"}}) == ("stops: ValueError",)


def test_a_text_that_does_not_stand_once_is_no_fault(tmp_path):
    from dataclasses import replace

    with pytest.raises(ValueError, match="does not stand once"):
        seeding.seeded(replace(FAULTS[0], right="no such text"), tmp_path)


@pytest.mark.slow
def test_the_battery_passes_without_a_fault_and_catches_one_of_every_kind():
    before = seeding.battery(ROOT)
    results = [r for report in before.values() for rs in report["verdicts"].values() for r in rs]
    assert all(" PASS " in result for result in results)
    for name, experiment in (
        ("weight with the wrong sign", "pendulum"),
        ("sign in AB3", "linear"),
        ("common grid off by one", "samples"),
    ):
        (fault,) = (fault for fault in FAULTS if fault.name == name)
        assert seeding.outcome(fault, before, experiment).caught
