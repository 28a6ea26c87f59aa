"""The index: every experiment has a row, and what cannot be read is not passed over."""

from __future__ import annotations

import csv
import re

import pytest
import samples
from test_page import make, read

from vibsim import report, store
from vibsim.report.page import cards
from vibsim.report.text import words


def put(results, collection, name, exp=None, **changes):
    exp = exp or samples.experiment(collection=collection, name=name)
    record = samples.record(exp)
    summary = samples.summary(exp, record, **changes)
    folder = results / collection / name
    store.write_json(folder / "summary.json", summary, digest="d")
    return folder, exp, record, summary


def lines(results):
    with (results / "summary.csv").open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_an_empty_results_folder_has_an_index(tmp_path):
    report.write_index(tmp_path)
    assert "no experiment" in (tmp_path / "index.html").read_text()
    assert lines(tmp_path) == []


@pytest.mark.usefixtures("without_pictures")
def test_every_experiment_has_a_row_with_a_link_that_exists(tmp_path):
    folder, exp, record, summary = put(tmp_path, "pendulum_lab", "theta")
    make(folder, exp, summary, record)
    put(tmp_path, "showcase", "other", title="<script>x</script>")
    report.write_index(tmp_path)
    reader = read(tmp_path / "index.html")
    assert not reader.faults
    assert not reader.open
    assert "script" not in reader.tags
    addresses = [address for _, address in reader.addresses]
    assert addresses == [
        "pendulum_lab/theta/report.html",
        "pendulum_lab/theta/figures/thumbnail.svg",
    ]
    assert all((tmp_path / address).is_file() for address in addresses)
    assert "2 experiments: 2 PASS." in " ".join(reader.text)
    assert [(r["collection"], r["experiment"], r["status"]) for r in lines(tmp_path)] == [
        ("pendulum_lab", "theta", "PASS"),
        ("showcase", "other", "PASS"),
    ]


def test_one_row_per_check_in_the_csv(tmp_path):
    exp = samples.plain()
    summary = samples.summary(exp, samples.record(exp))
    summary["checks"].append(
        {**summary["checks"][0], "id": "second", "status": "INCONCLUSIVE", "reason": "round_off"}
    )
    summary["status"] = "INCONCLUSIVE"
    store.write_json(tmp_path / "pendulum_lab/theta/summary.json", summary, digest="d")
    report.write_index(tmp_path)
    rows = lines(tmp_path)
    assert [(r["check"], r["status"], r["reason"]) for r in rows] == [
        ("check_1", "PASS", "asymptotic"),
        ("second", "INCONCLUSIVE", "round_off"),
    ]
    assert float(rows[0]["order"]) == summary["checks"][0]["results"][0]["facts"]["order"]
    assert rows[0]["levels"] == "6 to 9"


@pytest.mark.parametrize("damage", [b"", b"not json", b"\xff\xfe", None])
def test_a_damaged_summary_is_shown_as_damaged_and_fails_the_whole(tmp_path, damage):
    put(tmp_path, "a", "good")
    folder, *_ = put(tmp_path, "a", "bad")
    path = folder / "summary.json"
    path.write_bytes(path.read_bytes().replace(b"PASS", b"PASs", 1) if damage is None else damage)
    report.write_index(tmp_path)
    text = " ".join(read(tmp_path / "index.html").text)
    assert "DAMAGED" in text
    assert "2 experiments: 1 DAMAGED, 1 PASS." in text
    assert "✗ FAIL" in text
    assert {r["experiment"]: r["status"] for r in lines(tmp_path)} == {
        "good": "PASS",
        "bad": "DAMAGED",
    }


def test_results_without_a_summary_are_shown_as_missing(tmp_path):
    put(tmp_path, "a", "good")
    (tmp_path / "a/unfinished/logs").mkdir(parents=True)
    (tmp_path / "a/unfinished/level_06.nc").write_bytes(b"")
    report.write_index(tmp_path)
    assert "MISSING" in (tmp_path / "index.html").read_text()
    assert {r["experiment"]: r["status"] for r in lines(tmp_path)} == {
        "good": "PASS",
        "unfinished": "MISSING",
    }


@pytest.mark.parametrize(
    ("status", "whole"), [("FAIL", "FAIL"), ("INCONCLUSIVE", "INCONCLUSIVE"), ("PASS", "PASS")]
)
def test_the_worst_status_is_that_of_the_whole(tmp_path, status, whole):
    put(tmp_path, "a", "one")
    put(tmp_path, "a", "two", status=status)
    report.write_index(tmp_path)
    assert f"<title>{whole}: all experiments</title>" in (tmp_path / "index.html").read_text()


def test_the_index_is_the_same_bytes_every_time(tmp_path):
    put(tmp_path, "a", "one")
    report.write_index(tmp_path)
    before = (tmp_path / "index.html").read_bytes(), (tmp_path / "summary.csv").read_bytes()
    report.write_index(tmp_path)
    assert before == (
        (tmp_path / "index.html").read_bytes(),
        (tmp_path / "summary.csv").read_bytes(),
    )


WRONG = [{"kind": "central", "start": "first_order"}]


@pytest.mark.parametrize(
    "check",
    [
        {"converges": "theta", "order": 2},
        {"converges": "energy_deviation", "order": 4},
        {"value": "end", "quantity": "theta", "above": 9},
        {"equal": ["central", "exact"], "quantity": "theta"},
        {"claim": "It converges.", "that": {"converges": "omega", "order": 3}},
        {"conserves": "energy", "drift": "linear"},
    ],
)
def test_the_index_calls_a_quantity_what_its_page_calls_it(tmp_path, check):
    exp = samples.experiment(schemes=WRONG, checks=[check], initial={"theta": 1.0})
    _, exp, record, summary = put(tmp_path, "pendulum_lab", "theta", exp)
    assert summary["status"] != "PASS"
    report.write_index(tmp_path)
    told = " ".join(read(tmp_path / "index.html").text)
    ours = cards.cards(exp, record, summary)[0]["text"]
    # a page writes its own powers of ten
    labels = re.compile(r"\b(?:θ|ω|dE|theta|omega|energy\w*)\b")
    assert labels.findall(ours)
    assert labels.findall(told)[-len(labels.findall(ours)) :] == labels.findall(ours)


def test_a_name_in_code_or_a_dotted_path_stays_as_it_is():
    text = "theta at initial.theta = 1 (`theta: 2`), theta_0, of theta."
    told = "θ at initial.theta = 1 (`theta: 2`), theta_0, of θ."
    assert words.labelled(text, "theta") == told
