"""The statements of the texts on the index: each under its section, with what was measured and a badge that fits."""

from __future__ import annotations

import re

import pytest
import samples

from vibsim import report, store
from vibsim.experiment import citation
from vibsim.report.page.sources import statements


def check(source: str | None, expected: str = "true", status: str = "PASS", **changes):
    told = {"kind": "claim", "text": "Claim: it falls. The statement is true.", "note": None}
    return told | {
        "source": citation.fields(source),
        "expected": expected,
        "status": status,
        **changes,
    }


def headings(*sources: str | None) -> list[str]:
    return [heading for heading, _ in statements([("one", "", [check(s) for s in sources])])]


def test_statements_stand_under_their_sections_in_order() -> None:
    sections = ("b, section 10.10", "b, sections 2.3 and 10.1", "b, section 9.2 and exercise 1")
    found = headings("b, exercise 2", *sections, "b, equation (7)", "a, section 3")
    numbers = [f"b, section {number}" for number in ("2.3", "9.2", "10.1", "10.10")]
    assert found == ["a, section 3", *numbers, "b, equation (7)", "b, exercise 2"]


def test_what_names_no_place_or_is_no_claim_is_left_out() -> None:
    assert headings(None, "beside the text") == []
    assert statements([("one", "", [check("b, section 2", kind="value")])]) == []


@pytest.mark.parametrize(
    ("source", "expected", "status", "badge"),
    [
        ("b, section 2", "true", "PASS", "CONFIRMED"),
        ("b, section 2", "false", "PASS", "CORRECTED"),
        ("correction of the b, section 2", "true", "PASS", "CORRECTED"),
        ("b, section 2", "true", "FAIL", "OPEN"),
        ("b, section 2", "false", "INCONCLUSIVE", "OPEN"),
    ],
)
def test_a_refuted_statement_is_never_confirmed(
    source: str, expected: str, status: str, badge: str
) -> None:
    ((heading, [row]),) = statements(
        [("one", "one/report.html", [check(source, expected, status)])]
    )
    assert (heading, row.badge) == ("b, section 2", badge)
    before = "What is right: " if source.startswith("correction") else ""
    assert row.text == f"{before}it falls. The statement is true."
    assert row.link == "one/report.html"


def test_the_index_has_what_was_measured(tmp_path) -> None:
    claim = {
        "claim": "theta converges with order 3", "source": "a text, section 2.5, equation (7)", "holds": False,
        "that": {"converges": "theta", "order": 3}, "note": "the order is 2",
    }  # fmt: skip
    exp = samples.experiment(checks=[claim], collection="a", name="one")
    store.write_json(
        tmp_path / "a/one/summary.json", samples.summary(exp, samples.record(exp)), digest="d"
    )
    report.write_index(tmp_path)
    page = (tmp_path / "index.html").read_text()
    told = page.partition('<details id="statements">')[2].partition("</details>")[0]
    assert "<h3>a text, section 2.5</h3>" in told
    assert '<span class="badge CLAIM">CORRECTED</span> (equation (7)) theta converges' in told
    assert re.search(r"The statement is false\. .* 2\.00", told)
    assert "Note: the order is 2." in told
