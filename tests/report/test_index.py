"""The index: every experiment has a card, what cannot be read is not passed over, and no clock time is in the page."""

from __future__ import annotations

import base64
import csv
import hashlib
import os
import re

import pytest
import samples
from test_page import make, read

from vibsim import report, store
from vibsim.experiment import citation
from vibsim.report import words
from vibsim.report.page import cards, history, sources
from vibsim.report.page.index import Headline, headline


def put(results, collection, name, exp=None, **changes):
    exp = exp or samples.experiment(collection=collection, name=name)
    record = samples.record(exp)
    summary = samples.summary(exp, record, **changes)
    folder = results / collection / name
    store.write_json(folder / "summary.json", summary, digest="d")
    return folder, exp, record, summary


def filters(results):
    """Return the number of experiments under each filter that stands on the page."""
    page = (results / "index.html").read_text()
    found = re.findall(r'<button type="button" data-tag="([^"]*)"[^>]*><b>(\d+)</b>', page)
    return {tag: int(count) for tag, count in found}


def tags(results):
    """Return what every card can be filtered by."""
    page = (results / "index.html").read_text()
    found = re.findall(r'data-key="([^"]*)" data-tags="([^"]*)"', page)
    return {key: set(text.split("|")) for key, text in found}


def lines(results):
    with (results / "summary.csv").open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_an_empty_results_folder_has_an_index(tmp_path):
    report.write_index(tmp_path)
    reader = read(tmp_path / "index.html")
    assert "no experiment" in " ".join(reader.text)
    assert not reader.faults
    assert not reader.open
    assert filters(tmp_path) == {}
    assert lines(tmp_path) == []


def test_the_index_links_to_the_documentation_where_it_has_been_built(tmp_path):
    report.write_index(tmp_path)
    assert "docs/index.html" not in (tmp_path / "index.html").read_text()
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/index.html").write_text("a page")
    report.write_index(tmp_path)
    assert 'href="docs/index.html"' in (tmp_path / "index.html").read_text()


def test_sections_of_the_texts_lead_to_pages_that_are_there_and_name_the_other_experiments():
    (lecture, sections), (text, others) = sources.sections(
        {"pendulum_lab/theta_convergence": "page.html"}
    )
    assert (lecture, text) == ("pendulum lecture", "vibration text")
    (found,) = (one for one in sections if one.heading.startswith("Section 2.4 "))
    assert dict(found.experiments) == {"theta_convergence": "page.html", "three_arithmetics": ""}
    (found,) = (one for one in others if one.heading == "Exercise 12")
    assert found.experiments == [("amplitude_errors", "")]
    (found,) = (one for one in others if one.heading.startswith("Section 5.4 "))
    assert "figure 7" in found.search


@pytest.mark.usefixtures("without_pictures")
def test_every_experiment_has_a_card_with_links_that_exist(tmp_path):
    folder, exp, record, summary = put(tmp_path, "pendulum_lab", "theta")
    make(folder, exp, summary, record)
    put(tmp_path, "showcase", "other", title="<script>x</script>")
    report.write_index(tmp_path)
    reader = read(tmp_path / "index.html")
    assert not reader.faults
    assert not reader.open
    assert len(reader.ids) == len(set(reader.ids))
    addresses = [address for tag, address in reader.addresses if tag != "script"]
    assert set(addresses) == {
        "pendulum_lab/theta/report.html",
        "pendulum_lab/theta/figures/thumbnail.svg",
    }
    assert all((tmp_path / address).is_file() for address in addresses)
    assert "<script>x</script>" in reader.text
    assert filters(tmp_path) == {"PASS": 2, "INCONCLUSIVE": 0, "FAIL": 0, "UNREADABLE": 0}
    assert [(r["collection"], r["experiment"], r["status"]) for r in lines(tmp_path)] == [
        ("pendulum_lab", "theta", "PASS"),
        ("showcase", "other", "PASS"),
    ]


def test_a_page_runs_its_own_script_and_the_history_and_no_other(tmp_path):
    put(tmp_path, "showcase", "other", title="<script>x</script>")
    report.write_index(tmp_path)
    page = (tmp_path / "index.html").read_text()
    assert page.startswith("<!DOCTYPE html>")
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    loaded, own = re.findall(r"<script([^>]*)>(.*?)</script>", page, re.DOTALL)
    assert loaded == (f' src="{history.FILE}"', "")
    digest = base64.b64encode(hashlib.sha256(own[1].encode()).digest()).decode()
    assert policy is not None
    rules = dict(rule.strip().split(" ", 1) for rule in policy.group(1).split(";"))
    assert rules["default-src"] == "'none'"
    assert f"'sha256-{digest}'" in rules["script-src"].split()
    assert "'unsafe-inline'" not in rules["script-src"]
    assert not re.search(r"\son\w+=", page.partition("<body>")[2].partition("<script")[0])


def test_own_experiments_stand_before_the_shipped_ones(tmp_path):
    for collection in ("a", "adhoc", "z"):
        put(tmp_path, collection, f"in_{collection}")
    report.write_index(tmp_path)
    page = (tmp_path / "index.html").read_text()
    places = [page.index(f'data-key="{key}"') for key in ("adhoc/in_adhoc", "a/in_a", "z/in_z")]
    assert places == sorted(places)
    assert page.index('class="own"') < places[0] < page.index("</section>") < places[1]


def test_a_trap_and_a_refuted_claim_are_marked(tmp_path):
    fails = {"status": "FAIL", "reason": "order_low"}
    trap = {"converges": "theta", "order": 2, "expect": fails}
    claim = {"claim": "It converges.", "that": {"converges": "theta", "order": 2}, "holds": False}
    good = {"converges": "energy_deviation", "order": 2}
    for name, checks in (("caught", [good, trap]), ("claimed", [good, claim]), ("plain", [good])):
        start = {"theta": 1.0}
        exp = samples.experiment(
            schemes=WRONG, checks=checks, initial=start, name=name, collection="a"
        )
        put(tmp_path, "a", name, exp)
    report.write_index(tmp_path)
    assert tags(tmp_path) == {
        "a/caught": {"PASS", words.TRAP},
        "a/claimed": {"PASS", words.REFUTED},
        "a/plain": {"PASS"},
    }
    assert filters(tmp_path)[words.TRAP] == filters(tmp_path)[words.REFUTED] == 1


def test_a_card_has_the_order_with_its_interval_and_the_error(tmp_path):
    _, _, _, summary = put(tmp_path, "a", "one")
    report.write_index(tmp_path)
    facts = summary["checks"][0]["results"][0]["facts"]
    told = " ".join(read(tmp_path / "index.html").text)
    interval = words.interval((facts["order_low"], facts["order_high"]))
    for part in (f"{facts['order']:.3f}", interval, words.number(facts["relative_error"], "brief")):
        assert part in told


def test_the_finding_of_a_trap_is_no_headline():
    def check(expected, sentence, **facts):
        result = {"status": "PASS", "facts": facts, "sentence": sentence}
        row = {"kind": "stable", "status": "PASS", "quantity": "u", "results": [result]}
        return row | {"expected": expected}

    trap = check("FAIL (unstable)", "It is unstable.", order=9.0)
    good = check("PASS", "It grows by 1.5e-07; that is below 1.")
    assert headline([trap, good]).text == "It grows by 1.5·10⁻⁷"
    assert headline([trap]).text == "It is unstable"
    assert headline([trap, good | {"status": "FAIL"}]) == Headline()
    assert headline([]) == Headline()
    named = check("PASS", "error_linf of u is 0.25 m; it is below 1.")
    assert headline([named]).text == "largest error of u is 0.25 m"


@pytest.mark.parametrize("broken", [0, 1, 3])
def test_members_that_broke_down_are_told_where_there_are_any(tmp_path, broken):
    put(tmp_path, "a", "one", failure_count=broken)
    report.write_index(tmp_path)
    told = " ".join(read(tmp_path / "index.html").text)
    assert ("broke down" in told) == (broken > 0)
    assert (f"{broken} member" in told) == (broken > 0)


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
    assert tags(tmp_path) == {"a/good": {"PASS"}, "a/bad": {"UNREADABLE"}}
    assert filters(tmp_path) == {"PASS": 1, "INCONCLUSIVE": 0, "FAIL": 0, "UNREADABLE": 1}
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
    assert tags(tmp_path) == {"a/one": {"PASS"}, "a/two": {status}}


def test_the_index_is_the_same_bytes_every_time(tmp_path):
    put(tmp_path, "a", "one")
    report.write_index(tmp_path)
    before = (tmp_path / "index.html").read_bytes(), (tmp_path / "summary.csv").read_bytes()
    report.write_index(tmp_path)
    assert before == (
        (tmp_path / "index.html").read_bytes(),
        (tmp_path / "summary.csv").read_bytes(),
    )


def test_the_history_tells_what_changed_and_the_page_does_not_depend_on_it(tmp_path):
    folder, *_ = put(tmp_path, "a", "one")
    report.write_index(tmp_path)
    page = (tmp_path / "index.html").read_bytes()
    assert not (tmp_path / history.FILE).exists()
    (tmp_path / ".vibsim").mkdir()
    (folder / "benchmarks").mkdir()
    (folder / "benchmarks/report.tsv").write_text("s\th:m:s\n1.5\t0:00:01\n")
    (folder / "benchmarks/bad.tsv").write_text("s\nno number\n")
    report.write_index(tmp_path)
    assert (tmp_path / "index.html").read_bytes() == page
    (first,) = history.load(tmp_path).values()
    assert first["new"]
    assert first["seconds"] == 1.5
    assert first["made"] == int((folder / "summary.json").stat().st_mtime * 1000)
    # written again from the same results it stays
    before = (tmp_path / history.FILE).read_bytes()
    report.write_index(tmp_path)
    assert (tmp_path / history.FILE).read_bytes() == before
    put(tmp_path, "a", "one", status="FAIL")
    os.utime(folder / "summary.json", (2e9, 2e9))
    put(tmp_path, "a", "two")
    report.write_index(tmp_path)
    found = history.load(tmp_path)
    assert found["a/one"]["was"] == {"status": "PASS"}
    assert found["a/two"]["new"]
    assert "new" not in found["a/one"]


@pytest.mark.parametrize(
    "content",
    [
        b"alert(1)",
        b'vibsimHistory = {"a/one":{"made":1}};\n',
        b'vibsimHistory = {"a/one":{"made":"1","status":"","number":""}};\n',
        b"vibsimHistory = [1];\n",
        b"\xff",
        b"[" * 100_000,
    ],
)
def test_a_history_that_is_none_counts_as_not_there(tmp_path, content):
    put(tmp_path, "a", "one")
    path = tmp_path / history.FILE
    path.parent.mkdir()
    path.write_bytes(content)
    report.write_index(tmp_path)
    assert path.read_bytes() != content
    assert [entry["status"] for entry in history.load(tmp_path).values()] == ["PASS"]


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
    ours = cards.cards(record, summary)[0]["text"]
    # a page writes its own powers of ten
    labels = re.compile(r"\b(?:θ|ω|ΔE|theta|omega|energy\w*)\b")
    assert labels.findall(ours)
    assert labels.findall(told)[-len(labels.findall(ours)) :] == labels.findall(ours)


def test_a_name_in_code_or_a_dotted_path_stays_as_it_is():
    text = "theta at initial.theta = 1 (`theta: 2`), theta_0, of theta."
    told = "θ at initial.theta = 1 (`theta: 2`), theta_0, of θ."
    assert words.labelled(text, "theta") == told


def test_a_card_and_the_table_say_where_an_experiment_and_its_claims_stand(tmp_path):
    order = {"converges": "theta", "order": 2}
    claim = {"claim": "it falls", "source": "a text, exercise 18 b", "that": order}
    places = "a text, sections 2.3 and 10.10"
    exp = samples.experiment(source=places, checks=[order, claim], collection="a", name="named")
    put(tmp_path, "a", "named", exp)
    put(tmp_path, "b", "unnamed", samples.experiment(source=None, collection="b", name="unnamed"))
    report.write_index(tmp_path)
    page = (tmp_path / "index.html").read_text()
    assert page.count(f"{places}</p>") == 1
    assert page.count("None") == page.count("None yet")
    found = [tuple(row[name] for name in ("source", *citation.PLACES)) for row in lines(tmp_path)]
    assert found == [
        ("a text", "2.3 and 10.10", "", "", ""),
        ("a text", "", "", "", "18 b"),
        ("", "", "", "", ""),
    ]
