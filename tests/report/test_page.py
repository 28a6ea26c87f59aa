"""The page: self-contained, valid, harmless, the same bytes every time, and saying what was found."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import samples
from thinned import thinned

from vibsim import experiment as spec
from vibsim import report
from vibsim.analysis import verdicts
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record, Variable
from vibsim.core.vocabulary import REASONS
from vibsim.report import choice, style
from vibsim.report.data import Ladder, Member
from vibsim.report.figures import order as figures_order
from vibsim.report.figures import time
from vibsim.report.page import cards
from vibsim.report.page.page_tables import cut, headed
from vibsim.report.page.templates import TEMPLATES
from vibsim.report.tables import checks as check_tables
from vibsim.report.tables.table import Column, Table
from vibsim.report.text import reasons, setting

PROVENANCE = {"versions": {"vibsim": "1.2", "python": "3.99", "numpy": "9.9"}, "digest": "d1"}
PLOTS, MEMBERS = (
    (TEMPLATES / f"{name}.js").read_text(encoding="utf-8").strip() for name in ("plots", "members")
)
VOID = {"meta", "br", "img", "link", "hr", "input", "col"}


class Reader(HTMLParser):
    """Collects tags and text, and notes what is not closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.faults: list[str] = []
        self.addresses: list[tuple[str, str]] = []
        self.ids: list[str] = []
        self.tags: list[str] = []
        self.text: list[str] = []
        self.hovers: list[str] = []  # of the text, what is said on hover

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        for key, value in attrs:
            if key in {"src", "href", "xlink:href", "srcset", "action", "data"}:
                self.addresses.append((tag, value or ""))
            if key == "id":
                self.ids.append(value or "")
            if key == "title":
                self.text.append(value or "")
                self.hovers.append(value or "")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.faults.append(tag)

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open[-1:]):
            self.text.append(data)


def read(path):
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    reader.close()
    return reader


def make(directory, exp, summary=None, record=None, **options):
    record = record or samples.record(exp)
    summary = summary or samples.summary(exp, record)
    report.write(samples.plan(exp), record, summary, directory, **options)
    return directory


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    directory = tmp_path_factory.mktemp("plain")
    return make(
        directory,
        samples.plain(),
        formats=("svg", "png", "pdf"),
        provenance=PROVENANCE,
    )


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    return make(tmp_path_factory.mktemp("swept"), samples.swept())


@pytest.fixture(scope="module")
def trapped(tmp_path_factory):
    return make(tmp_path_factory.mktemp("trapped"), samples.several())


@pytest.mark.parametrize("which", thinned(["plain", "swept", "trapped"], 3))
def test_the_page_is_well_formed_and_loads_nothing(which, request):
    page = request.getfixturevalue(which) / "report.html"
    text, reader = page.read_text(encoding="utf-8"), read(page)
    assert text.startswith('<!DOCTYPE html>\n<html lang="en">')
    assert 'name="viewport"' in text
    assert "content=\"default-src 'none';" in text
    assert not reader.faults
    assert not reader.open
    assert len(reader.ids) == len(set(reader.ids))
    assert not {"link", "iframe", "object", "embed"} & set(reader.tags)
    assert "<script src" not in text
    assert 'aria-label=""' not in text
    assert PLOTS in text
    assert ("members-data" in reader.ids) == (MEMBERS in text) == (which == "swept")
    inside = {f"#{name}" for name in reader.ids}
    for tag, address in reader.addresses:
        assert address in inside | {"../../index.html"} or address.startswith("data:image/png"), (
            tag,
            address,
        )
    assert "@import" not in text
    assert "url(" not in text.replace("url(#", "")


def test_the_finding_comes_first_then_the_motion_the_checks_and_their_evidence(plain):
    text = (plain / "report.html").read_text(encoding="utf-8")
    order = [
        text.index(f'id="{part}"')
        for part in ("verdict", "motion", "checks", "belief", "numbers", "computed", "provenance")
    ]
    assert order == sorted(order)


def test_the_page_says_what_was_found(plain):
    text = " ".join(read(plain / "report.html").text)
    for part in (
        "PASS", "pendulum lecture, section 2.5", "asymptotic", reasons.REASONS["asymptotic"].needs, "4.026", "6 to 9",
        "The angle θ converges at second order", "1 of 1 check", "Order of θ", "order 2 ± 0.1, promised",
        "Observed order", "the scheme promises 2", "Best value", "0.9958007 rad",
        "(order 2 predicts 4)",
        ".venv/bin/vibsim run pendulum_lab/theta", "vibsim 1.2, Python 3.99, numpy 9.9, matplotlib ", ", jinja2 ",
        "arithmetic: compensated",
    ):  # fmt: skip
        assert part in text, part


@pytest.mark.slow
def test_a_trap_is_named_with_both_orders(trapped):
    page = trapped / "report.html"
    text = " ".join(read(page).text)
    assert "FAIL" in text
    assert "order_low" in text
    assert "The likely cause is the first step" in text
    assert (
        "<strong>What to do:</strong> Set <code>start: centred</code> for scheme trap."
        in page.read_text()
    )


def test_figures_and_tables_are_files_too(plain):
    figures = {path.name for path in (plain / "figures").iterdir()}
    stems = {name.rsplit(".", 1)[0] for name in figures} - {"thumbnail"}
    assert len(stems) >= 4
    assert figures == {f"{s}.{form}" for s in stems for form in ("svg", "png", "pdf")} | {
        "thumbnail.svg"
    }
    names = {path.name for path in (plain / "tables").iterdir()}
    assert {
        "orders_theta_l2.csv",
        "orders_theta_l2.tex",
        "checks.csv",
        "energy_maxima.csv",
        "scalars.csv",
    } <= names
    first = (plain / "tables/orders_theta_l2.csv").read_text().splitlines()
    exact = samples.record(samples.plain())["theta_difference_norm"][0, 0, 0, 1]
    assert repr(float(exact)) in first[1]


@pytest.mark.slow
def test_writing_again_gives_the_same_bytes_and_clears_what_is_left(plain, tmp_path):
    formats, provenance = ("svg", "png", "pdf"), PROVENANCE
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures/of_another_time.svg").write_text("old")
    make(tmp_path, samples.plain(), formats=formats, provenance=provenance)
    for path in sorted(p for p in plain.rglob("*") if p.is_file()):
        assert (tmp_path / path.relative_to(plain)).read_bytes() == path.read_bytes(), path.name
    assert {p.name for p in (tmp_path / "figures").iterdir()} == {
        p.name for p in (plain / "figures").iterdir()
    }


def test_markup_in_a_title_is_harmless(plain, tmp_path):
    evil = '<script>alert("1")</script>'
    exp = samples.experiment(
        schemes=[{"kind": "central", "label": "<b>s</b>"}], title=evil, source=evil + "&"
    )
    record = samples.record(exp)
    summary = samples.summary(exp, record)
    summary["checks"][0]["text"] = summary["checks"][0]["advice"] = evil
    make(tmp_path, exp, summary, record, provenance={"<i>": evil})
    reader = read(tmp_path / "report.html")
    assert not {"b", "i"} & set(reader.tags)
    assert reader.tags.count("script") == read(plain / "report.html").tags.count("script")
    assert not reader.faults
    assert evil in " ".join(reader.text)
    assert "<script" not in "".join(p.read_text() for p in (tmp_path / "figures").glob("*.svg"))


@pytest.mark.parametrize("count", [1, 2])
def test_few_levels_make_a_page(tmp_path, count):
    exp = samples.experiment(levels=list(range(6, 6 + count)))
    make(tmp_path, exp)
    assert "too_few_levels" in (tmp_path / "report.html").read_text()


def test_nan_everywhere_makes_a_page_with_its_failures(tmp_path):
    exp = samples.plain()
    whole = samples.record(exp)
    blank = {
        name: Variable(v.dims, np.full_like(v.values, np.nan), v.attrs)
        if v.values.dtype.kind == "f" and not name.endswith("formal_order")
        else v
        for name, v in whole.variables.items()
    }  # fmt: skip
    failure = {
        "scheme": "central",
        "level": 6,
        "case": 0,
        "t": 3.125,
        "step": 10,
        "error": "non-finite theta",
    }
    summary = samples.summary(exp, whole, status="FAIL", failures=[failure])
    make(tmp_path, exp, summary, Record(whole.coords, blank, whole.attrs))
    reader = read(tmp_path / "report.html")
    text = " ".join(reader.text)
    assert "failures" in reader.ids
    assert "non-finite theta" in text
    assert "3.125" in text
    assert not re.search(r"\bnan\b", text.lower())


@pytest.mark.slow
def test_a_sweep_shows_period_orders_and_the_worst_member(swept):
    names = {path.stem for path in (swept / "figures").iterdir()}
    assert {"period", "sweep_order_theta", "sweep_error_energy_deviation"} <= names
    assert any(name.endswith("_worst") for name in names)
    assert any(name.endswith("_typical") for name in names)
    rows = (swept / "tables/members.csv").read_text().splitlines()
    assert len(rows) == 17
    assert rows[0].startswith("case,initial.theta [rad],scheme,status,reason,order of θ,")


@pytest.mark.slow
def test_a_large_sweep_stays_a_small_page(tmp_path):
    exp = samples.swept(3000, levels=[5, 6, 7])
    make(tmp_path, exp)
    assert (tmp_path / "report.html").stat().st_size < 2_000_000
    assert len((tmp_path / "tables/members.csv").read_text().splitlines()) == 3001


@pytest.mark.slow
def test_a_dense_grid_stays_a_small_page(tmp_path):
    make(tmp_path, samples.experiment(levels=[12, 13, 14]))
    assert (tmp_path / "report.html").stat().st_size < 1_000_000
    assert all(path.stat().st_size < 300_000 for path in (tmp_path / "figures").iterdir())


@pytest.mark.slow
def test_a_ladder_lost_in_round_off_shows_what_is_there(tmp_path):
    scheme = {"kind": "central", "arithmetic": "three_term"}
    make(
        tmp_path,
        samples.experiment(
            schemes=[scheme], levels=[17, 18, 19, 20], samples="common", time={"end": 0.5}
        ),
    )
    text = " ".join(read(tmp_path / "report.html").text)
    assert "round_off" in text
    assert "lost in round-off" in text


@pytest.mark.slow
def test_uneven_levels_are_rescaled_so_that_they_coincide():
    exp = samples.experiment(levels=[8, 9, 11, 12])
    curves = time.differences(Ladder(samples.record(exp), "theta", Member(0, 0, "central")))
    largest = [np.abs(curve.values).max() for curve in curves]
    np.testing.assert_allclose(largest, largest[-1], rtol=0.01)
    assert [curve.label for curve in curves] == ["θ₈ − θ₉", "3.2 (θ₉ − θ₁₁)", "64 (θ₁₁ − θ₁₂)"]


@pytest.mark.parametrize(
    ("changes", "parts"),
    thinned([
        ({"time": {"periods": 3, "steps_per_period": 16}, "levels": [3, 4, 5],
          "sweep": {"initial.theta": [0.5, 1.0, 2.0], "model.g": [1.0, 9.81]}},
         ["differs between members", "model.g = 1 m s⁻²", "theta swept", "g swept"]),
        ({"model": {"kind": "linear_pendulum"}, "time": {"end": 4000.0}, "levels": [8, 9, 10, 11, 12]},
         ["unstable", "runs broke down", "non_finite", "broke down"]),
        ({"initial": {"theta": 0.0, "omega": 2.5}, "levels": [8, 9, 10]}, ["asymptotic", "omega = 2.5 rad s⁻¹"]),
        ({"initial": {"theta": 0.0, "omega": 0.0}}, ["Order of θ"]),
        ({"schemes": [{"kind": "central", "label": "_a $x$ \\frac{"}, "central"]}, ["_a $x$ \\frac{"]),
    ], 3),
)  # fmt: skip
def test_all_kinds_of_experiments_make_a_page(tmp_path, changes, parts):
    make(tmp_path, samples.experiment(**changes))
    reader = read(tmp_path / "report.html")
    text = " ".join(reader.text)
    assert not reader.faults
    assert not re.search(r"\b(nan|None)\b", text)
    for part in parts:
        assert part in text, part


@pytest.mark.slow
@pytest.mark.usefixtures("unrendered")
def test_a_claim_has_its_source_and_its_measure(tmp_path):
    claim = {
        "claim": "it is round",
        "source": "a book",
        "holds": False,
        "that": {"value": "period", "above": 100.0},
    }
    order = {"converges": "omega", "order": 3, "schemes": ["central"]}
    make(tmp_path, samples.experiment(checks=[claim, order]))
    text = " ".join(read(tmp_path / "report.html").text)
    for part in (
        "“it is round”",
        "a book. Measured by: period is above 100.",
        "false (the statement: above 100 s)",
        "shown to be false",
        "Order of ω (scheme central)",
        "order 3 ± 0.1",
        "order_low",
    ):
        assert part in text, part


def promising(record, *orders, quantity="theta"):
    """Return the record of schemes that promise other orders."""
    name = f"{quantity}_formal_order"
    promise = replace(record.variables[name], values=np.array(orders, dtype=float))
    return replace(record, variables={**record.variables, name: promise})


TOLERANT = [
    {"converges": "theta", "tolerance": 0.3, "schemes": ["central"]},
    {"converges": "theta", "schemes": ["trap"], "expect": {"status": "FAIL"}},
]


def test_every_promised_order_has_its_reference_and_its_tolerance():
    exp = samples.several(checks=TOLERANT)
    record = promising(samples.record(exp), 2, 1)
    assert choice.promises(record, "theta") == [(1.0, 0.1), (2.0, 0.3)]
    with style.applied():
        text = samples.svg(figures_order.against_step(record, "theta", 0))
    assert "slope 1 (promised)" in text
    assert "slope 2 (promised)" in text


def test_one_promise_of_several_schemes_is_drawn_once():
    exp = samples.several()
    record = samples.record(exp)
    assert choice.promises(record, "theta") == [(2.0, 0.1)]
    with style.applied():
        text = samples.svg(figures_order.against_step(record, "theta", 0))
    assert text.count(">slope 2 (promised)</text>") == 1


@pytest.mark.slow
def test_a_sweep_shows_every_promise_and_the_map_is_relative_to_it():
    def drawn(sweep):
        exp = samples.several(checks=TOLERANT, sweep=sweep)
        views, _ = samples.views(exp, promising(samples.record(exp), 2, 1), "theta")
        return views

    curves = drawn({"initial.theta": [0.5, 1.0], "model.g": [1.0, 2.0]})
    with style.applied():
        text = samples.svg(curves["sweep_order_theta"].picture)
    assert "promised, 1 ± 0.1" in text
    assert "promised, 2 ± 0.3" in text
    sweep = {"initial.theta": {"linspace": [0.5, 1.0, 6]}, "model.g": {"linspace": [1.0, 2.0, 6]}}
    maps = drawn(sweep)
    for s, label in enumerate(("Order of θ − 2", "Order of θ − 1")):
        panel = maps[f"map_theta_order_{s}"].picture.figure.axes[0]
        assert panel.get_title(loc="left") == label
        assert np.abs(panel.collections[0].get_array()).max() < 0.2


def test_the_rescaled_curves_are_those_that_are_stored():
    exp = samples.experiment(levels=[8, 9, 11, 12])
    record = samples.record(exp)
    curves = time.differences(Ladder(record, "theta", Member(0, 0, "central")))
    np.testing.assert_array_equal([c.values for c in curves], record["theta_rescaled"][0, 0])


@pytest.mark.slow
def test_a_promise_of_order_zero_makes_a_page(tmp_path):
    exp = samples.plain()
    record = samples.record(exp)
    for quantity in ("theta", "energy_deviation"):
        record = promising(record, 0, quantity=quantity)
    make(tmp_path, exp, record=record)
    assert not read(tmp_path / "report.html").faults


@pytest.mark.slow
@pytest.mark.parametrize("changes", [{}, {"sweep": {"initial.u": [0.5, 1.0, 2.0]}}])
def test_a_model_without_exact_solution_and_period_makes_a_page(tmp_path, changes):
    rubbed = {"kind": "oscillator", "spring": "sin(u)", "damping": {"coulomb": 0.01}}
    exp = samples.experiment(model=rubbed, initial={"u": 1.0}, **changes)
    record = samples.record(exp)
    assert "u_exact" not in record
    assert "exact_period" not in record
    (verdict,) = verdicts(exp, record)
    assert (verdict.status, verdict.reason) == ("PASS", "asymptotic")
    make(tmp_path, exp, record=record)
    text = " ".join(read(tmp_path / "report.html").text)
    assert "Estimated error" in text
    assert "true error (dots)" not in text
    assert not re.search(r"\bnan\b", text)


@pytest.mark.slow
@pytest.mark.usefixtures("unrendered")
def test_a_quantity_has_one_name_on_the_page(tmp_path):
    checks = [
        {"converges": "theta", "order": 3},
        {"claim": "theta is `theta`", "that": {"converges": "energy_deviation", "order": 3}},
    ]
    make(tmp_path, samples.experiment(checks=checks))
    text = re.sub(r"<[^>]*>", "", (tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "θ converges more slowly than order 3" in text
    assert "ΔE converges more slowly than order 3" in text
    assert "theta converges" not in text
    assert "energy_deviation converges" not in text
    assert "“theta is" in text
    assert "θ is" not in text
    assert "The statement is false. ΔE converges" in text


@pytest.mark.parametrize(
    ("scheme", "order", "meaning"),
    [
        ("euler_cromer", 2, "with the order that the scheme promises here"),
        ({"kind": "central", "start": "first_order"}, 2, "more slowly than the scheme promises"),
        ("central", 1, "faster than expected, as the scheme promises here"),
    ],
)
def test_an_order_that_a_scheme_keeps_is_not_said_to_miss_its_promise(scheme, order, meaning):
    exp = samples.experiment(schemes=[scheme], checks=[{"converges": "theta", "order": order}])
    rec = samples.record(exp)
    (check,) = samples.summary(exp, rec)["checks"]
    assert check["status"] == "FAIL"
    assert meaning in cards.card(rec, check)["meaning"]


def test_every_reason_has_words():
    assert set(reasons.REASONS) == set(REASONS)
    assert all(r.meaning and r.needs for r in reasons.REASONS.values())


def test_a_number_that_is_right_has_the_words_of_its_kind():
    known = [reasons.reason("match", kind) for kind in ("stable", "conserves", "equal", "value")]
    of_levels = "finer levels agree"
    assert [of_levels in r.needs for r in known] == [False, False, False, True]
    assert of_levels not in reasons.reason("match", "value", value="stability_limit").needs
    assert of_levels not in reasons.reason("match", "value", value="accepted_steps").needs
    assert of_levels in reasons.reason("match", "value", value="period", levels=3).needs
    for kind in ("stable", "conserves"):
        assert "order" not in " ".join(reasons.reason("pre_asymptotic", kind))
    alone = reasons.reason("match", "value", value="period", levels=1)
    assert alone.needs.startswith("More levels")


@pytest.mark.parametrize("is_stable", [True, False])
def test_a_check_of_stability_does_not_say_that_a_run_stays_bounded(is_stable, tmp_path):
    asked = {"stable": is_stable}
    exp = samples.experiment(checks=[asked, {"claim": "it is so", "that": asked}], levels=[7])
    record = samples.record(exp)
    first, claim = (cards.card(record, check) for check in samples.summary(exp, record)["checks"])
    assert "an error that vanishes with dt" in first["what"]
    assert "bounded" not in first["what"]
    assert first["what"].startswith("stability" if is_stable else "instability")
    if is_stable:
        assert claim["needs"] == reasons.reason("match", "stable").needs == first["needs"]


@pytest.mark.parametrize("holds", [True, False])
def test_a_refuted_claim_does_not_say_that_the_check_is_right(holds):
    asked = {"stable": holds}
    exp = samples.experiment(checks=[{"claim": "so", "that": asked, "holds": holds}], levels=[7])
    record = samples.record(exp)
    (check,) = samples.summary(exp, record)["checks"]
    assert check["reason"] == "match"
    says = reasons.reason("match", "stable").meaning if holds else reasons.REFUTED
    assert cards.card(record, check)["meaning"] == says


def test_a_number_within_round_off_has_two_digits():
    exp = samples.experiment(
        model={"kind": "spring", "w": 2.0},
        initial={"u": 1.0, "v": 0.0},
        schemes=["crank_nicolson", "central"],
        levels=[5, 6],
        checks=[{"conserves": "energy", "drift": "none", "schemes": ["crank_nicolson"]},
                {"conserves": "energy", "drift": "bounded", "schemes": ["central"]}],
    )  # fmt: skip
    record = samples.record(exp)
    noise, number = (
        next(iter(check_tables.results(record, check, "").text_rows()))[-1]
        for check in samples.summary(exp, record)["checks"]
    )
    assert re.fullmatch(r"\d\.\d·10⁻¹.", noise)
    assert len(number) > 10
    asked = [cards.card(record, c)["wanted"] for c in samples.summary(exp, record)["checks"]]
    assert asked == ["conserved up to round-off", "an error that stays bounded"]


def test_a_member_alone_carries_its_worst_verdict():
    rows = [
        ("FAIL", "order_low", "run a@1"),
        ("PASS", "asymptotic", "run a@1"),
        ("PASS", "match", "run a@0"),
    ]
    results = [dict(zip(("status", "reason", "command"), row, strict=True)) for row in rows]
    told = cards._alone({"status": "FAIL", "results": results}).splitlines()
    assert told == [
        ".venv/bin/run a@1  # FAIL order_low",
        ".venv/bin/run a@0  # PASS match",
    ]


def test_an_unknown_format_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(VibsimError, match=r"'svgz'.*did you mean 'svg'"):
        make(tmp_path, samples.plain(), formats=("svg", "svgz"))
    assert not list(tmp_path.iterdir())


def test_the_two_frequencies_of_a_stiff_model_have_labels_of_their_own():
    exp = samples.experiment(
        model={"kind": "elastic_pendulum", "beta": 0.9},
        initial={},
        time={"end": 6.0},
        levels=[6, 7],
    )
    rows = [row for row in setting.setup(samples.record(exp)) if "w dt" in row[0]]
    assert [term for term, _ in rows] == ["w dt", "Highest w dt"]
    assert "natural frequency" in rows[0][1]
    assert "fastest oscillation" in rows[1][1]


MOST_WORDS = 3000  # of a page, with what is folded and what stands in its pictures, but not what is said on hover
CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["elastic_pendulum_drag", "order_and_stability_map"])
def test_the_longest_pages_are_short_enough_to_be_read(tmp_path, name):
    exp = spec.Experiment.from_yaml(CONFIGS / f"vibration_text/{name}.yaml")
    make(tmp_path, exp)
    page = read(tmp_path / "report.html")
    text, hovers = (len(" ".join(found).split()) for found in (page.text, page.hovers))
    assert text - hovers <= MOST_WORDS
    assert (tmp_path / "report.html").stat().st_size < 1_500_000


def test_many_checks_that_passed_alike_are_a_table_and_the_others_lines():
    checks = [{"id": f"p{i}", "value": "period", "above": 1.0 + 0.1 * i} for i in range(7)]
    others = [{"id": "wrong", "value": "period", "below": 1.0}, {"converges": "theta", "order": 2}]
    exp = samples.experiment(checks=[*checks, *others])
    record = samples.record(exp)
    made = cards.cards(record, samples.summary(exp, record))
    alone, (group,) = cards.gathered(made, "p3")
    # the one that decides stands alone, and so does what failed
    assert [card["id"] for card in alone] == ["p3", "wrong", "check_9"]
    table = group["table"]
    assert [column.header for column in table.columns] == ["check", "wanted", "got"]
    assert [row[1] for row in table.rows] == [
        c["wanted"] for c in made if c["id"] in "p0p1p2p4p5p6"
    ]
    few = [card for card in made if card["id"] in "p0p1p2p3p4"]
    assert cards.gathered(few, None) == (few, [])


def test_a_page_cuts_a_table_between_its_blocks():
    def table(*sizes):
        rows = tuple((f"m{k}", i, math.nan) for k, size in enumerate(sizes) for i in range(size))
        return Table(
            "t",
            "A table",
            (Column("member"), Column("level", form="integer"), Column("none")),
            rows,
            heads=1,
        )

    for sizes, kept in (((5, 3, 4), 8), ((5, 5), 5), ((11,), 8), ((3, 2), 5)):
        _, shown, told = cut(table(*sizes))
        assert len(shown.rows) == kept
        assert [column.header for column in shown.columns] == ["member", "level"]
        more = sum(sizes) - kept
        assert told == (
            f"{more} more {'row is' if more == 1 else 'rows are'} in tables/t.csv." if more else ""
        )


def test_a_scheme_and_a_member_that_all_rows_share_stand_in_the_heading():
    columns = (Column("number"), Column("scheme"), Column("member"), Column("x", form="full"))
    rows = (("a", "central", "g = 1", 1.0), ("b", "central", "g = 2", 2.0))
    heading, shown, note = headed("Values", Table("t", "", columns, rows, 1), "more")
    assert (heading, note) == ("Values, central", "more")
    assert [column.header for column in shown.columns] == ["number", "member", "x"]
    assert shown.rows == (("a", "g = 1", 1.0), ("b", "g = 2", 2.0))
    alone = Table("t", "", columns, (("a", "central", "g = 1", 1.0), ("b", "rk4", "g = 1", 2.0)), 1)
    heading, shown, _ = headed("Values", alone, "")
    assert (heading, shown.columns[1].header) == ("Values, g = 1", "scheme")
