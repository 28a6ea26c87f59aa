"""The first screen: it names the check that decides, says the finding in words, and what to change in the file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import samples
import yaml
from thinned import thinned

from vibsim import report
from vibsim.convergence import judge
from vibsim.core.record import Variable
from vibsim.core.vocabulary import REASONS
from vibsim.experiment import Experiment
from vibsim.experiment.experiment import canonical
from vibsim.experiment.schema.checks import MEASURED
from vibsim.report import choice, style, words
from vibsim.report.data import Ladder, Results
from vibsim.report.figures import gallery
from vibsim.report.figures import hero as drawn
from vibsim.report.page import cards, hero, page_tables
from vibsim.report.tables import theory
from vibsim.report.text import assertions, equation, experiment_file, findings, glossary

CONFIGS = Path(__file__).parents[2] / "configs"
WRONG_AS_TRAP = [{"kind": "central", "label": "wrong", "start": "first_order"}]
WRONG = [{"kind": "central", "start": "first_order"}]


def found(exp):
    record = samples.record(exp)
    summary = samples.summary(exp, record)
    return record, summary, choice.find_lead(record, summary)


def first(exp):
    _, summary, decisive = found(exp)
    return hero.context(summary, decisive)


def test_every_reason_and_every_kind_of_check_has_a_title():
    assert set(findings.ON_ORDER) == set(REASONS)
    for table in (findings.MATCHED, findings.MISSED, findings.OPEN):
        assert set(table) == set(MEASURED) - {"converges"} | {"tolerance"}


@pytest.mark.parametrize(
    ("changes", "title"),
    [
        ({}, "The angle θ converges at second order"),
        ({"schemes": WRONG, "checks": [{"converges": "theta", "order": 2}]},
         "The angle θ converges at first order, not at second"),
        ({"levels": [6, 7]}, "There are too few levels to judge the angle θ"),
        ({"sweep": {"initial.theta": [0.5, 1.0]}}, "The angle θ converges at second order in both members"),
        ({"schemes": ["central", "rk4"]},
         "The angle θ converges at the order that both schemes promise"),
        ({"checks": [{"value": "period", "below": 1.0}]}, "Period is not as expected"),
        ({"checks": [{"claim": "so", "that": {"value": "period", "above": 1.0}}]}, "So"),
        ({"checks": [{"claim": "dt = 1 is large", "that": {"value": "period", "above": 1.0}}]}, "dt = 1 is large"),
        ({"checks": [{"equal": ["central", "exact"], "quantity": "theta", "atol": 1.0}, {"stable": True}]},
         "Scheme central is stable, as expected"),
        ({"schemes": ["central", "rk4"], "checks": [{"stable": False, "schemes": ["central"]}]},
         "The amplitude by central does not grow, against what is asked"),
        ({"checks": [{"claim": "so", "that": {"value": "period", "above": 1.0}, "holds": False}]},
         "Not shown to be false: So"),
        ({"checks": [{"claim": "so", "that": {"value": "period", "below": 1.0}}]}, "Not confirmed: So"),
        ({"checks": [{"claim": "s" * 150, "that": {"stable": False}, "holds": False}]},
         f"Shown to be false: S{'s' * 138}…"),
        ({"checks": [{"accurate": "theta", "relative": 1e-9, "expect": {"status": "FAIL"}}]},
         "The angle θ is not as accurate as asked: the trap is caught"),
        ({"checks": [{"accurate": "theta", "relative": 0.5, "expect": {"status": "FAIL"}}]},
         "The angle θ is as accurate as asked, against what the check expects"),
        ({"checks": [{"claim": "so", "that": {"value": "period", "below": 1.0}, "holds": False}]},
         "Shown to be false: So"),
        ({"schemes": [*WRONG, {"kind": "central", "label": "sound"}],
          "checks": [{"converges": "theta", "order": 2, "schemes": ["sound"]},
                     {"converges": "theta", "order": 2, "schemes": ["central"], "expect": {"status": "FAIL"}}]},
         "The angle θ by sound converges at second order, and the trap is caught"),
        ({"schemes": ["central", {"kind": "euler_cromer", "label": "ec"}],
          "checks": [{"value": "relative_energy_error", "below": 1e-3}]},
         "Relative energy error by ec is not as expected"),
    ],
)  # fmt: skip
def test_the_title_says_the_finding(changes, title):
    assert first(samples.experiment(**changes))["finding"] == title


@pytest.mark.parametrize(
    ("check", "told"),
    [
        ({"value": "period", "below": 1.0}, r"It is 6\.7\d* s, not below 1 s\."),
        ({"value": "period", "equals": 1, "atol": 0.5}, r"It is 6\.7\d* s, not equal to 1 within 0\.5 s\."),
        ({"equal": ["central", "exact"], "quantity": "theta", "atol": 1e-9},
         r"They are at most 0\.0\d+ rad apart; 10⁻⁹ rad is allowed\."),
        ({"accurate": "theta", "relative": 1e-9},
         r"The error is [\d·⁻.]+ of its size at level 9.*; 10⁻⁹ is asked for\."),
    ],
)  # fmt: skip
def test_under_a_title_that_says_what_failed_are_its_numbers_with_units(check, told):
    shown = first(samples.experiment(levels=[6, 7, 8, 9], checks=[check]))
    assert re.fullmatch(told, shown["meaning"]), shown["meaning"]


@pytest.mark.parametrize(
    ("theta", "where"),
    [
        (1.5, "in the member with initial θ = 1.5 rad, of 3 in all"),
        (1.0, "in both members with initial θ = 1 rad, of 3 in all"),
    ],
)
def test_an_order_of_some_members_alone_says_of_how_many(theta, where):
    """A title on 2 of 21 members read like one on all of them, and tables showed others than those that decide."""
    exp = samples.experiment(
        sweep={"initial.theta": [1.0, 1.0, 1.5]},
        checks=[{"converges": "theta", "at": {"initial.theta": theta}}],
    )
    record, summary, decisive = found(exp)
    shown = hero.context(summary, decisive)
    assert shown["finding"] == f"The angle θ converges at second order {where}"
    asked = 2 if theta == 1.0 else 1
    assert f"The check asks about {asked} of the 3 members" in shown["meaning"]
    assert (f"of {asked} of the 3 members" in shown["numbers"][0]["note"]) == (asked > 1)
    assert assertions.about(exp.checks[0], record) == f"Order of θ (initial θ = {theta:g} rad)"
    drawn_of = {member.case for member in gallery.choose(record, decisive.member)[0]}
    assert decisive.member.case in drawn_of
    _, tables = page_tables.collect(summary, decisive, [])
    (_, table, _), *_ = tables["numbers_shown"]
    assert table.rows[0][1].startswith(f"initial.theta = {theta:g} rad")


def test_the_worst_check_leads_and_a_trap_never_does_where_another_passed():
    trap = {"id": "trap", "converges": "theta", "order": 3, "expect": {"status": "FAIL"}}
    number = {"id": "number", "value": "period", "above": 1.0}
    order = {"id": "order", "converges": "omega"}
    wrong = {"id": "wrong", "value": "period", "below": 1.0}
    leads = [
        found(samples.experiment(checks=checks))[2].entry["id"]
        for checks in ([trap, number, order], [trap, number], [trap, order, wrong])
    ]
    assert leads == ["order", "number", "wrong"]


def test_the_large_numbers_are_those_of_the_facts():
    exp = samples.experiment()
    _, summary, decisive = found(exp)
    order, error, best = list(hero.numbers(decisive))[:3]
    facts = summary["checks"][0]["results"][0]["facts"]
    assert order["value"] == f"{facts['order']:.3f}"
    # the L2 norm over 20 s as a root of the mean of squares
    assert error["label"] == "Error of θ at 512 steps"
    assert error["value"] == f"{facts['error'] / 20.0**0.5 * 1e4:.1f}·10⁻⁴ rad"
    assert float(best["value"].split()[0]) == pytest.approx(0.9958006771, abs=1e-6)


def test_a_single_level_says_what_is_known():
    shown = first(samples.experiment(levels=[7], checks=[{"value": "period", "above": 1.0}]))
    assert [number["label"] for number in shown["numbers"]][:2] == [
        "Period",
        "Error of θ at 128 steps",
    ]
    assert all(number["value"] for number in shown["numbers"])


@pytest.mark.parametrize(
    ("options", "checks", "line"),
    [
        ({"schemes": WRONG}, [{"converges": "theta", "order": 2}], "schemes: [{kind: central, start: centred}]"),
        ({"schemes": [{"kind": "central", "label": "bad", "start": "first_order", "arithmetic": "three_term"}, "rk4"]},
         [{"converges": "theta"}],
         "schemes: [{kind: central, label: bad, start: centred, arithmetic: three_term}, rk4]"),
        ({"levels": [6, 7, 8]}, [{"accurate": "theta", "relative": 1e-4}], "levels: {from: 6, to: 11}"),
        ({"levels": [4, 6, 8]}, [{"accurate": "theta", "relative": 1e-4}], ""),
        ({}, [{"value": "period", "above": 6.7006, "at": {"level": 9}}], ""),
        ({}, [{"converges": "theta", "order": 2}], ""),
    ],
)  # fmt: skip
def test_a_change_of_the_file_mends_what_did_not_pass(options, checks, line):
    exp = samples.experiment(checks=checks, **options)
    _, summary, _ = found(exp)
    (entry,) = summary["checks"]
    told = experiment_file.change(exp, exp.checks[0].measured, entry)
    assert told == line
    if told:
        mended = samples.experiment(**{"checks": checks} | options | yaml.safe_load(told))
        assert samples.summary(mended, samples.record(mended))["status"] == "PASS"


def test_badges_tell_a_claim_and_a_trap_from_a_check_that_passed():
    period = {"value": "period", "above": 1.0}
    checks = [
        period,
        {"claim": "so", "that": period},
        {"claim": "not so", "that": {"value": "period", "below": 1.0}, "holds": False},
        {"converges": "theta", "order": 3, "expect": {"status": "FAIL"}},
        {"converges": "theta", "order": 3},
    ]
    exp = samples.experiment(checks=checks)
    record, summary, _ = found(exp)
    assert [card["badge"] for card in cards.cards(record, summary)] == [
        "passed", "as claimed", "shown to be false", "trap caught", "failed",
    ]  # fmt: skip
    # the index says the same words of the same checks
    assert words.marks(summary["checks"]) == [("trap caught", 1), ("shown to be false", 1)]


@pytest.mark.parametrize("norm", ["l1", "l2", "linf", "linf_interior"])
def test_the_error_over_the_step_is_in_the_norm_of_the_check(norm):
    checks = [{"converges": "theta", "order": 2, "norm": norm}]
    exp = samples.experiment(checks=checks)
    record, _, decisive = found(exp)
    with style.applied():
        ax = drawn.against_step(decisive).figure.axes[0]
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in ax.lines}
    here = {"scheme": 0, "case": 0, "norm": norm}
    true = record.pick("theta_error_norm", **here)
    mean = {"l1": 20.0, "l2": 20.0**0.5}.get(norm, 1.0)
    np.testing.assert_allclose(lines["true"], true / mean, rtol=1e-12)
    gap = record.pick("theta_difference_norm", **here) / mean
    # the difference of two levels is 1 - 1/4 of the error of the coarser one
    np.testing.assert_allclose(lines["estimated"][:-1], gap / 0.75, rtol=0.01)
    assert ("root-mean-square" in ax.get_title(loc="left")) == (norm == "l2")


def test_a_caption_names_the_exact_solution_only_where_it_is_drawn(monkeypatch):
    for references, drag in ((1, 0.0), (0, 0.1)):
        monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", references)
        exp = samples.experiment(model={"kind": "pendulum", "drag": drag}, levels=[6])
        record, _, decisive = found(exp)
        with style.applied():
            picture = drawn.solution(Ladder(record, "theta", decisive.member), is_left=True)
            text = samples.svg(picture)
        assert ("exact" in picture.caption) == ("exact" in text) == (drag == 0.0)


# a table and a matrix are files of their own
WITHOUT_TABLES = [
    path
    for path in sorted(CONFIGS.glob("*/*.yaml"))
    if not re.search(r"\.(csv|mtx|npy)\b", path.read_text("utf-8"))
]


@pytest.mark.parametrize("path", thinned(WITHOUT_TABLES, 5), ids=lambda path: path.stem)
def test_the_file_that_a_page_shows_means_the_same_experiment(path):
    exp = Experiment.from_yaml(path)
    assert not exp.model.tables
    content = yaml.safe_load(experiment_file.text(exp))
    again = Experiment.from_dict(content, name=exp.name, collection=exp.collection)
    told, ours = canonical(again), canonical(exp)
    # numbers stand in the units of the run, and printed numbers in their tables
    left_out = {"units", "published"}
    assert {k: v for k, v in told.items() if k not in left_out} == {
        k: v for k, v in ours.items() if k not in left_out
    }


def test_the_title_of_a_ladder_with_a_least_order_names_the_measured_one():
    h = 0.4 * 0.5 ** np.arange(5)
    verdict = judge(h, 3.0 + h**2, at_least=1)
    assert findings.of_ladder(verdict) == "u converges at second order"
    verdict = judge(h, 3.0 + h, at_least=2)
    assert findings.of_ladder(verdict) == "u converges at first order, not at second order or above"


def test_an_estimate_is_no_observed_order():
    shown = first(samples.experiment(levels=[2, 3, 4], time={"end": 20.0}))
    orders = [n for n in shown["numbers"] if n["label"].startswith("Observed order")]
    assert [n["value"] for n in orders] == ["not measurable"]


def test_an_equation_becomes_markup():
    made = str(equation.mathml("m u'' + w_0^2 u = F(t)"))
    assert "<mrow><mi>u</mi><mo" in made
    assert "″" in made
    assert "<msup><msub><mi>w</mi><mi>0</mi></msub><mn>2</mn></msup>" in made
    assert re.sub(r"<[^>]*>", "", made) == "mu″+w02u=F(t)"
    assert "&lt;" in equation.mathml("a < b")


@pytest.mark.parametrize(
    ("exponent", "shown"),
    [
        ("-2", "<mo>−</mo><mn>2</mn>"),
        ("(1/3)", "<mn>1</mn><mo>/</mo><mn>3</mn>"),
        ("(2*(n+1))", "<mn>2</mn><mo>·</mo><mo>(</mo><mi>n</mi><mo>+</mo><mn>1</mn><mo>)</mo>"),
        ("sin(t)", "<mi>sin</mi><mo>(</mo><mi>t</mi><mo>)</mo>"),
    ],
)
def test_an_exponent_is_raised_as_a_whole(exponent, shown):
    made = str(equation.mathml(f"x**{exponent} + y")).replace(' stretchy="false"', "")
    assert f"<msup><mi>x</mi><mrow>{shown}</mrow></msup><mspace" in made


def test_a_long_equation_has_powers_of_python_and_may_be_broken_between_its_terms():
    text = "a'' = (-3*g*sin(a) - 2*sin(a - b)*(b'**2 + a'**2*cos(a - b)))/(3 - cos(b)), b'' = -b + (a - b)"
    made = str(equation.mathml(text))
    assert made.count("<msup>") == 2
    lines = [re.sub(r"<[^>]*>", "", part) for part in made.split("</math>")]
    assert [line.strip()[:4] for line in lines[:5]] == ["a″=(", "−2·s", "−cos", "b″=−", "+(a"]
    assert "".join(lines).replace(" ", "") == (
        "a″=(−3·g·sin(a)−2·sin(a−b)·(b′2+a′2·cos(a−b)))/(3−cos(b)),b″=−b+(a−b)"
    )
    assert str(equation.mathml("u'' + u = 0, v -> -e*v")).count("<math>") == 2


def test_a_trap_has_its_mark_and_its_order_beside_the_finding():
    trap = {"converges": "theta", "order": 2, "schemes": ["wrong"], "expect": {"status": "FAIL"}}
    plain = {"converges": "theta", "order": 2, "schemes": ["central"]}
    shown = first(samples.experiment(schemes=["central", *WRONG_AS_TRAP], checks=[plain, trap]))
    assert shown["marks"] == [(words.TRAP, 1)]
    assert re.search(r"As the trap expects, θ by wrong has order [01]\.\d{3}", shown["meaning"])


def test_statements_stand_beside_the_finding_but_not_the_one_that_is_the_finding():
    claim = {"claim": "it takes longer", "that": {"value": "period", "above": 6.0}}
    order = {"converges": "theta", "order": 2}
    wrong = claim | {"claim": "it takes a minute", "that": {"value": "period", "above": 60.0}}
    shown = first(samples.experiment(checks=[order, claim, wrong | {"holds": False}]))
    assert shown["statements"] == [
        {"status": "PASS", "badge": words.CLAIMED, "claim": "it takes longer"},
        {"status": "PASS", "badge": words.REFUTED, "claim": "it takes a minute"},
    ]
    assert shown["more_statements"] == 0
    assert first(samples.experiment(checks=[claim]))["statements"] == []
    several = [claim | {"id": f"claim_{k}"} for k in range(5)]
    assert first(samples.experiment(checks=[order, *several]))["more_statements"] == 2


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"above": 6.0}, "6.7 s"),
        ({"above": 6.699}, "6.699603 s"),
        ({"equals": 6.7, "atol": 1e-2}, "6.6996 s"),
    ],
)
def test_a_number_has_the_digits_that_tell_it_from_what_is_asked(asked, told):
    exp = samples.experiment(levels=[9], checks=[{"value": "period", "at": {"level": 9}} | asked])
    record, summary, _ = found(exp)
    assert cards.card(record, summary["checks"][0])["got"] == told


def test_a_number_whose_bound_is_wider_than_what_is_asked_has_a_sentence_on_its_page():
    period = {"value": "period", "at": {"level": "best"}, "equals": 6.699975}
    for atol, is_told in ((5e-7, True), (1e-3, False)):
        exp = samples.experiment(checks=[period | {"atol": atol}])
        record, summary, _ = found(exp)
        assert summary["checks"][0]["status"] == "PASS"
        card = cards.card(record, summary["checks"][0])
        assert ("do not prove it" in card["text"]) is is_told


def test_a_large_number_is_not_rounded_before_its_point():
    exp = samples.experiment(
        model={"kind": "pendulum", "g": 1e-8}, time={"end": 2e5}, levels=[9],
        checks=[{"value": "period", "at": {"level": 9}, "above": 6e4}],
    )  # fmt: skip
    record, summary, _ = found(exp)
    assert cards.card(record, summary["checks"][0])["got"] == "66996 s"


def test_an_order_beside_the_band_whose_interval_reaches_it_is_told_as_such(monkeypatch):
    exp = samples.experiment(sweep={"initial.theta": [0.5, 1.0]}, checks=[{"converges": "theta"}])
    _, _, decisive = found(exp)
    for order, low, title in (
        (2.05, 2.0, "All members keep"),
        (2.3, 2.05, "1 of 2 orders is outside the band, but its interval overlaps it"),
        (2.3, 2.15, "1 of 2 members has"),
    ):
        ends = (np.array([row]) for row in ([2.0, order], [2.0, low], [2.0, order]))
        monkeypatch.setattr(Results, "orders", lambda *_, ends=tuple(ends): ends)
        with style.applied():
            assert drawn.orders(decisive).title.startswith(title)


def test_a_row_of_checks_says_of_how_many_results_it_shows_one():
    """It hid that there are others."""
    checks = [{"converges": "theta", "order": order} for order in (2, 3)]
    exp = samples.experiment(sweep={"initial.theta": [0.5, 1.0]}, checks=checks)
    record, summary, _ = found(exp)
    passed, failed = (card["got"] for card in cards.cards(record, summary))
    assert passed.endswith(", the hardest of 2")
    assert failed.endswith("; 2 of 2 failed")


@pytest.mark.parametrize(
    ("check", "pictures"),
    [
        ({"converges": "theta"}, ["hero_differences", "hero_orders"]),
        (
            {"value": "end", "quantity": "theta", "at": {"level": 7, "case": 1}, "below": 9},
            ["hero_evidence", "hero_error"],
        ),
    ],
)
def test_few_members_are_no_response_and_a_check_on_one_is_shown_on_that(check, pictures):
    """The first screen showed two dots, of an amplitude that nobody had asked for."""
    exp = samples.experiment(sweep={"initial.theta": [0.5, 1.0]}, checks=[check])
    _, _, decisive = found(exp)
    with style.applied():
        shown = hero.pictures(decisive)
        assert [picture.name for picture in shown] == pictures


def test_the_number_that_decides_is_the_one_that_is_drawn_over_the_members():
    """The first screen showed the period beside a check on another number."""
    asked = {"value": "end", "quantity": "theta", "at": {"level": 7, "initial.theta": 1.0}}
    exp = samples.experiment(
        sweep={"initial.theta": {"linspace": [0.5, 1.5, 9]}}, checks=[asked | {"below": 9}]
    )
    _, summary, decisive = found(exp)
    with style.applied():
        shown = hero.pictures(decisive)[0]
    assert (shown.name, shown.title) == (
        "hero_response",
        "Value of θ at the end at level 7 in 9 members",
    )
    drawn_values = shown.figure.axes[0].lines[0].get_ydata()
    number = summary["checks"][0]["results"][0]["facts"]["value"]
    np.testing.assert_allclose(drawn_values[4], number, rtol=1e-12)


def test_members_have_the_level_and_the_unit_of_their_numbers_where_all_are_reduced_to_one():
    """A swept value has another unit; the reading said that all pictures are of the finest level."""
    asked = {"value": "max_abs", "quantity": "theta", "at": {"level": 7}, "equals": 1, "atol": 9}
    asked |= {"over": "initial.theta", "take": "where_largest"}
    sweep = {"initial.theta": {"linspace": [0.5, 1.5, 9]}}
    exp = samples.experiment(sweep=sweep, checks=[asked])
    record, summary, decisive = found(exp)
    with style.applied():
        shown = hero.pictures(decisive)[0]
    assert shown.title == "Largest absolute value of θ at level 7 in 9 members"
    assert "[rad]" in shown.figure.axes[0].get_title(loc="left")
    assert "finest" not in shown.caption
    card = cards.card(record, summary["checks"][0])
    assert card["what"] == "Place of the largest absolute value of θ over initial θ at level 7"


def test_every_scheme_with_an_error_has_its_entry():
    """Schemes whose levels give no estimate were squares that no legend named."""
    exp = samples.experiment(schemes=["central", "rk4"], levels=[6, 7, 8])
    record, _, decisive = found(exp)
    other = 1 - decisive.member.scheme
    norms = np.array(record["theta_difference_norm"])
    norms[other] = np.nan
    variable = record.variables["theta_difference_norm"]
    record.variables["theta_difference_norm"] = Variable(variable.dims, norms, variable.attrs)
    with style.applied():
        shown = drawn.against_step(decisive).figure.axes[0]
    assert {"central", "rk4"} <= {text.get_text() for text in shown.get_legend().get_texts()}


def test_a_row_names_its_number_and_its_member_in_words_with_units():
    """Rows had names of the file: `Max abs of ΔE`, `below 9` without a unit, members without theirs."""
    asked = {"value": "max_abs", "quantity": "energy_deviation", "at": {"model.g": 1.0}, "below": 9}
    exp = samples.experiment(sweep={"model.g": [1.0, 2.0]}, checks=[asked])
    record, summary, _ = found(exp)
    card = cards.card(record, summary["checks"][0])
    assert card["what"] == "Largest absolute value of ΔE at g = 1 m s⁻²"
    assert card["wanted"] == "below 9 J"
    names = ("wire_force", "x_3", "u_left", "theta", "theta_left")
    symbols = ["wire force", "x_3", "u_left", "θ", "theta_left"]
    assert [words.symbol(name) for name in names] == symbols


def test_an_order_that_misses_its_promise_says_that_nothing_asks_for_it():
    """The number stood beside the promise that it misses, without a remark."""
    scheme = {"kind": "central", "start": "first_order"}
    value = {"value": "end", "quantity": "theta", "below": 9}
    for check, is_told in ((value, True), ({"converges": "theta", "order": "scheme"}, False)):
        exp = samples.experiment(schemes=[scheme], checks=[check])
        record, _, decisive = found(exp)
        notes = [number["note"] for number in hero.numbers(decisive)]
        assert any("promises 2, which no check asks for" in note for note in notes) is is_told
    # a check of an order passes where the interval reaches it
    exp = samples.experiment(schemes=[scheme], checks=[value])
    record, _, decisive = found(exp)
    high = record.variables["theta_order_high"]
    values = np.full(np.shape(high.values), 2.0)
    record.variables["theta_order_high"] = Variable(high.dims, values, high.attrs)
    assert not any("no check" in number["note"] for number in hero.numbers(decisive))


def test_of_a_long_run_the_last_periods_are_shown():
    """All periods were a block of colour."""
    exp = samples.experiment(
        model={"kind": "linear_pendulum"}, time={"end": 400.0}, levels=[11, 12], checks=[]
    )
    record, _, decisive = found(exp)
    with style.applied():
        shown = drawn.solution(Ladder(record, "theta", decisive.member), is_left=True)
    assert shown.title.endswith("last 6 periods")
    low, high = shown.figure.axes[0].dataLim.intervalx
    assert high - low == pytest.approx(12 * np.pi, rel=0.02)


def test_the_interval_of_an_order_says_what_it_is():
    exp = samples.experiment()
    record, summary, decisive = found(exp)
    order = next(hero.numbers(decisive))
    facts = summary["checks"][0]["results"][0]["facts"]
    interval = words.interval((facts["order_low"], facts["order_high"]))
    assert order["note"] == f"95 % interval {interval}; the scheme promises 2"
    assert "a probability of 95 %" in glossary.explained(order["note"])
    card = cards.card(record, summary["checks"][0])
    assert interval in card["got"]
    assert "in brackets above: the stated order with its 95 % interval" in card["picture"].caption
    several = samples.experiment(schemes=["central", "rk4"])
    table = theory.schemes(samples.record(several))
    place = [column.header for column in table.columns].index("measured (95 % interval)")
    for row in table.text_rows():
        assert re.fullmatch(r"\d\.\d{3} \(\d\.\d+ to \d\.\d+\)", row[place])


def test_members_that_the_check_does_not_ask_about_are_not_counted_and_are_grey():
    exp = samples.experiment(
        sweep={"initial.theta": [0.5, 1.0, 1.5]},
        checks=[{"converges": "theta", "at": {"initial.theta": 1.0}}],
    )
    _, _, decisive = found(exp)
    with style.applied():
        picture = drawn.orders(decisive)
    assert picture.title == "1 of 1 members asked about are in the band; grey: the 2 others"
    assert "does not ask about the grey members" in picture.caption
    colours = {
        line.get_color(): line.get_xdata().size for line in picture.figure.axes[0].get_lines()
    }
    assert (colours[style.PALE], colours[style.COLOURS[0]]) == (2, 1)


def test_the_best_value_has_as_many_digits_as_its_bound():
    """A bound of 1e-13 beside twelve digits would say more than the value."""
    exp = samples.experiment(levels=[9, 10, 11, 12], schemes=["rk4"])
    record, _, decisive = found(exp)
    best = next(row for row in hero.numbers(decisive) if row["label"].startswith("Best"))
    bound = float(record["theta_end_richardson_error"][0, 0])
    digits = best["value"].split()[0].partition(".")[2]
    assert len(digits) == 1 - np.floor(np.log10(bound))
    assert len(digits) > 12


@pytest.mark.slow
def test_a_curve_over_the_sweep_counts_the_members_that_have_the_number():
    exp = samples.swept(16)
    _, _, decisive = found(exp)
    with style.applied():
        shown = drawn.response(decisive)
    assert shown.title == "Period in 15 of 16 members"
    assert "The others have no period." in shown.caption


def test_an_order_that_its_scheme_promises_is_not_said_to_be_less_than_that():
    checks = [{"converges": "theta", "order": 3}]
    exp = samples.experiment(checks=checks)
    shown, (check,) = first(exp), cards.cards(*found(exp)[:2])
    assert shown["meaning"] == check["meaning"]
    assert "promises here, which is lower than the expected one" in shown["meaning"]


def test_the_promised_slope_goes_no_further_than_the_errors_and_needs_two_levels():
    dt, errors = 0.5 ** np.arange(5), np.array([8e-9, 4e-9, 1e-9, 3e-9, 1e-9])
    with style.applied():
        ax = style.canvas(2.0).add_subplot()
        drawn._slope(ax, dt, errors, 2.0, "promised")
        (line,) = ax.lines
        assert np.nanmax(line.get_ydata()) <= 2.0 * errors.max()
        line.remove()
        drawn._slope(ax, dt, errors[::-1], 2.0, "promised")
        assert not ax.lines


def test_a_quantity_with_a_long_name_is_told_in_words_and_leaves_the_legend_small():
    exp = Experiment.from_yaml(CONFIGS / "vibration_text/bumpy_road.yaml")
    assert findings.short(exp.model.definition, "absolute_position") == "the height of the body"
    assert findings.short(exp.model.definition, "u") == "u"


def test_a_term_is_explained_once_and_text_stays_text():
    made = str(glossary.explained("Round-off <b> and round-off"))
    assert made.count("<abbr") == 1
    assert "&lt;b&gt; and round-off" in made


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {
            "schemes": ["central", "rk4", "velocity_verlet", *WRONG_AS_TRAP],
            "levels": [6, 7, 8, 9, 10],
        },
        {
            "sweep": {
                "initial.theta": {"linspace": [0.1, 3.1, 20]},
                "model.g": {"linspace": [1.0, 9.0, 20]},
            }
        },
    ],
    ids=["schemes", "sweep"],
)
def test_a_page_stays_short(options, tmp_path):
    exp = samples.experiment(**options)
    record, summary, _ = found(exp)
    report.write(samples.plan(exp), record, summary, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert len(page.encode()) <= 1_500_000
    body = re.sub(r"<(style|script).*?</\1>", "", page, flags=re.DOTALL)
    assert len(re.sub(r"<[^>]*>", " ", body).split()) <= 3000


def test_of_several_schemes_the_one_that_decides_is_named():
    wrong = {"kind": "central", "label": "wrong", "start": "first_order"}
    exp = samples.experiment(
        schemes=["central", wrong], checks=[{"converges": "theta", "order": 2}]
    )
    shown = first(exp)
    title = "The angle θ by wrong converges at first order, not at second"
    assert shown["finding"] == title
    assert all(number["label"].endswith(", wrong") for number in shown["numbers"])


def test_curves_of_the_first_screen_are_told_apart_without_colours_and_the_ring_is_named():
    exp = samples.experiment(
        sweep={"initial.theta": [0.5, 1.0, 2.0], "model.g": {"linspace": [1.0, 4.0, 5]}}
    )
    _, _, decisive = found(exp)
    with style.applied():
        ax = drawn.response(decisive).figure.axes[0]
    curves = [line for line in ax.lines if not line.get_label().startswith("_")]
    looks = {(line.get_marker(), str(line._unscaled_dash_pattern)) for line in curves}
    assert len(looks) == len(curves) == 3
    assert [line.get_label() for line in curves] == [f"initial θ = {x}" for x in ("0.5", "1", "2")]
    assert ax.get_title(loc="left").endswith("ring: hardest member")


@pytest.mark.slow
def test_the_schemes_of_the_first_screen_have_markers_of_their_own_and_legends_hide_no_point():
    exp = samples.experiment(
        levels={"from": 5, "to": 10}, schemes=["central", "rk4", "euler_cromer"]
    )
    record, _, decisive = found(exp)
    with style.applied():
        steps = drawn.against_step(decisive).figure.axes[0]
        curves = drawn.differences(decisive).figure.axes[0]
    named = [line for line in steps.lines if line.get_label() in record.words("scheme")]
    assert len({line.get_marker() for line in named}) == len(named) == 3
    assert len(curves.lines) == 5
    for ax in (steps, curves):
        ax.get_figure().canvas.draw()
        hidden = ax.get_legend().get_window_extent()
        for line in ax.lines:
            points = ax.transData.transform(line.get_xydata())
            assert not any(hidden.contains(*point) for point in points), line.get_label()


@pytest.mark.parametrize(
    ("part", "told"), [(6e-4, "0.060 %"), (1e-5, "0.0010 %"), (9.4e-6, "9.4·10⁻⁶"), (0.0, "0")]
)
def test_a_very_small_part_is_no_power_of_ten_of_a_per_cent(part, told):
    assert words.share(part) == told


def test_a_sentence_of_a_terminal_is_told_with_powers_of_ten():
    told = words.PAGE.powers("The error is 3.4e-5 (0.0075 %), at most 1e-04; rk4 and 2e3x stay.")
    assert told == "The error is 3.4·10⁻⁵ (0.0075 %), at most 10⁻⁴; rk4 and 2e3x stay."


def test_one_exact_scheme_of_several_does_not_give_the_title():
    exp = samples.experiment(
        model={"kind": "spring", "w": 1.0}, initial={"u": 1.0, "v": 0.0}, time={"end": 2.0},
        levels={"from": 4, "to": 8}, schemes=["crank_nicolson", "central"],
        checks=[{"converges": "energy_deviation", "order": "scheme"}],
    )  # fmt: skip
    title = (
        "The energy deviation ΔE = E(t) − E(0) tends to zero at the order that both schemes promise"
    )
    assert first(exp)["finding"] == title


def test_schemes_of_several_orders_that_are_all_exact_are_called_exact():
    exp = samples.experiment(
        model={"kind": "bouncing_ball"}, initial={"h": 1.0, "v": 0.0}, time={"end": 0.4},
        levels={"from": 4, "to": 6}, schemes=["rk4", "velocity_verlet"],
    )  # fmt: skip
    assert first(exp)["finding"].endswith("is exact: the levels differ by round-off only")


def test_a_letter_with_an_index_is_named_and_a_name_of_words_is_said_in_words() -> None:
    chain = {"x_i": {"acceleration": "-x_i"}}
    model = {"kind": "system", "repeat": {"n": 3, "i": chain}, "outputs": {"far_end": "x_3"}}
    run = {"title": "t", "model": model, "initial": {"x_1": 1}, "time": {"end": 1}}
    exp = Experiment.from_dict({**run, "levels": [4, 5, 6], "schemes": ["rk4"]})
    assert findings.short(exp.model.definition, "x_3") == "x_3"
    assert findings.short(exp.model.definition, "far_end").startswith("the ")


@pytest.mark.usefixtures("unrendered")
@pytest.mark.parametrize(
    ("sweep", "names"),
    [
        (None, ["hero_error", "hero_solution"]),
        ({"initial.x": {"linspace": [0.5, 1.5, 9]}}, ["hero_orders", "hero_response"]),
    ],
)
def test_coordinates_together_have_numbers_and_no_picture_over_time(sweep, names, tmp_path):
    exp = samples.experiment(
        model={
            "kind": "system",
            "coordinates": ["x", "y"],
            "acceleration": {"x": "y - 2*x", "y": "x - 2*y"},
        },
        initial={"x": 1.0},
        schemes=["central", "rk4"],
        checks=[{"converges": "position_vector"}],
        **({"sweep": sweep} if sweep else {}),
    )
    record, summary, decisive = found(exp)
    with style.applied():
        assert sorted(picture.name for picture in hero.pictures(decisive)) == names
    report.write(samples.plan(exp), record, summary, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "position vector converges at the order that both schemes promise" in page
    assert "position vector: L2 norm of its difference from the next level" in page
