"""What a page must not do: claim an order that is not known, hide a cell, a column or a curve, name what is absent."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import samples

from vibsim import report
from vibsim.report import choice, finest_level, style, words
from vibsim.report.data import Ladder, Member
from vibsim.report.figures import order, scenes, solution, time
from vibsim.report.page import hero
from vibsim.report.tables import levels as contents
from vibsim.report.text import findings, setting

STIFF = {
    "model": {"kind": "linear_pendulum"},
    "time": {"end": 1000.0},
    "levels": [9, 10, 11, 12],
    "sweep": {"model.g": [1.0, 1000.0, 1e6]},
    "checks": [{"converges": "theta", "order": "scheme"}],
}
GRID = {"initial.theta": [0.5, 1.0, 2.0], "model.g": [1.0, 4.0, 400.0]}
SIX = [0.5, 0.7, 1.0, 1.3, 1.6, 2.0]
REST = {"initial": {"theta": 0.0, "omega": 0.0}}


def factors(exp):
    record = samples.record(exp)
    summary = samples.summary(exp, record)
    for check in summary["checks"]:
        found = choice.find_lead(record, {**summary, "checks": [check]})
        yield check, findings.factor(found)


@pytest.mark.parametrize(
    "changes",
    [
        STIFF,
        {
            "initial": {"theta": 0.0, "omega": 2.0},
            "levels": [7, 8, 9, 10, 11],
            "checks": [{"converges": "theta"}, {"converges": "omega"}],
        },
        {"levels": [6, 7]},
        REST,
    ],
)
def test_no_factor_is_told_where_no_order_is_settled(changes):
    for check, factor in factors(samples.experiment(**changes)):
        assert check["results"][0]["reason"] not in findings.WITH_AN_ORDER
        assert factor is None


def test_the_factor_is_that_of_the_result_that_decides():
    ((check, factor),) = factors(samples.several())
    assert [r["reason"] for r in check["results"]] == ["order_low", "asymptotic"]
    assert abs(factor - 2.0) < 0.1
    ((check, factor),) = factors(samples.experiment(checks=[{"converges": "theta", "order": 1}]))
    assert check["reason"] == "order_high"
    assert abs(factor - 4.0) < 0.1


@pytest.mark.usefixtures("unrendered")
def test_svg_is_written_whatever_else_is_asked_for(tmp_path):
    exp = samples.plain()
    record = samples.record(exp)
    summary = samples.summary(exp, record)
    report.write(samples.plan(exp), record, summary, tmp_path, formats=("png",))
    names = {path.name for path in (tmp_path / "figures").iterdir()}
    stems = {name.rsplit(".", 1)[0] for name in names} - {"thumbnail"}
    assert names == {f"{s}.{form}" for s in stems for form in ("svg", "png")} | {"thumbnail.svg"}


@pytest.mark.parametrize(
    ("changes", "notes", "absent"),
    [
        ({"levels": [6, 7]}, ["it takes three levels"], ["from three levels", "bar", "dotted"]),
        (REST, ["nothing to draw", "no ratio of differences"], ["dotted", "hollow", "bar", "band"]),
        ({}, [], ["dotted", "Nothing"]),
    ],
)
def test_an_empty_panel_says_why_and_a_caption_names_only_what_is_drawn(changes, notes, absent):
    exp = samples.experiment(**changes)
    with style.applied():
        picture = order.against_step(samples.record(exp), "theta", 0)
        text = samples.svg(picture)
    assert all(note in text for note in notes)
    assert not [word for word in absent if word in picture.caption]


@pytest.mark.slow
def test_a_caption_names_the_dotted_line_where_it_is_drawn():
    scheme = {"kind": "central", "arithmetic": "three_term"}
    exp = samples.experiment(schemes=[scheme], levels=[10, 12, 14, 16], samples="common")
    with style.applied():
        picture = order.against_step(samples.record(exp), "theta", 0)
        text = samples.svg(picture)
    assert ("dotted" in picture.caption) == ("predicted round-off" in text)
    assert "dotted" in picture.caption


@pytest.mark.slow
def test_missing_cells_of_a_map_are_hatched_and_cells_have_borders():
    def draw(last):
        exp = samples.experiment(
            levels=[6, 7, 8, 9], sweep={"initial.theta": SIX, "model.g": [*SIX[:5], last]}
        )
        views, _ = samples.views(exp, samples.record(exp), "theta")
        return views["map_theta_order_0"].picture, views

    (picture, views), (full, _) = draw(400.0), draw(3.0)
    with style.applied():
        text = samples.svg(views["map_theta_verdict_0"].picture)
    assert "PASS: asymptotic (" in text
    orders = picture.figure.axes[0]
    assert orders.get_title(loc="left") == "Order of θ − 2"
    assert np.ma.getmaskarray(orders.collections[0].get_array()).sum() == 6
    assert len(orders.collections[0].get_edgecolor())
    assert orders.patch.get_hatch()
    assert "Grey hatched" in picture.caption
    assert "Grey" not in full.caption


def test_a_page_leads_with_the_member_and_scheme_of_the_decisive_result():
    check = {"converges": "theta", "order": "scheme", "at": {"model.g": 4.0}}
    schemes = ["rk4", "central"]
    exp = samples.experiment(
        levels=[6, 7, 8, 9], sweep={"model.g": [1.0, 4.0]}, schemes=schemes, checks=[check]
    )
    record, summary = samples.record(exp), samples.summary(exp, samples.record(exp))
    for entry in summary["checks"]:
        for result in entry["results"]:
            led = choice.find_lead(record, {"checks": [entry | {"results": [result]}]}).member
            assert (led.case, led.scheme_name) == (result["case"], result["scheme"])
    assert {row["scheme"] for row in summary["checks"][0]["results"]} == set(schemes)
    assert {row["case"] for row in summary["checks"][0]["results"]} == {1}


@pytest.mark.usefixtures("without_pictures")
def test_a_sweep_names_a_member_once_per_block_of_a_page_and_in_every_row_of_a_file(tmp_path):
    exp = samples.experiment(levels=[6, 7, 8, 9], sweep=GRID)
    record = samples.record(exp)
    summary = samples.summary(exp, record)
    report.write(samples.plan(exp), record, summary, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    start = page.index('<section id="numbers"')
    table = page[start : page.index("</table>", start)]
    decisive = choice.find_lead(record, summary).member
    assert re.findall(r'rowgroup" colspan="9">([^<]*)<', table) == [
        f"central, {words.swept(record.case_name(m.case))}"
        for m in choice.members(record, "theta", decisive)
    ]
    assert table.count('<th scope="col"') == 9
    rows = re.findall(r"<tr><td.*?</tr>", table, flags=re.DOTALL)
    assert [row.count("<td") for row in rows] == [9] * 8
    file = (tmp_path / "tables/orders_theta_l2.csv").read_text().splitlines()
    assert file[0].startswith("scheme,member,level")
    assert all(line.startswith('central,"initial.theta = ') for line in file[1:])


@pytest.mark.parametrize("values", [[1.0, 4.0, 400.0, 500.0, 600.0], [1.0, 1000.0], [1000.0, 1.0]])
def test_the_typical_member_passes_where_one_does(values):
    exp = samples.experiment(sweep={"model.g": values}, levels=[6, 7, 8, 9])
    record = samples.record(exp)
    roles = {m.role: record.flags("theta_status")[0, m.case] for m in
             choice.members(record, "theta")}  # fmt: skip
    assert roles == {"typical": "PASS", "worst": "FAIL"}


def test_a_run_that_grows_is_cut_off_or_drawn_by_its_size():
    exp = samples.experiment(
        model={"kind": "linear_pendulum"}, time={"end": 100.0}, levels=[4, 5, 6, 7, 8],
        schemes=["central"],
    )  # fmt: skip
    record = samples.record(exp)
    wild = samples.experiment(**(STIFF | {"levels": [4, 5], "time": {"end": 50.0}, "sweep": GRID}))
    grown = samples.record(wild)
    for rec, case in [(record, 0), (grown, 2), (grown, 8)]:
        member = Member(0, case, "central", role="worst")
        with style.applied():
            top = solution.solution(Ladder(rec, "theta", member)).figure.axes[0]
            curves = time.overlay(Ladder(rec, "theta", member)).figure.axes[0]
        size = np.abs(rec["theta_exact"][case]).max()
        assert max(np.abs(top.get_ylim())) <= 3.0 * size * (1 + 1e-12)
        assert curves.get_yscale() == "log" or max(np.abs(curves.get_ylim())) < 1e6
    assert any("cut off" in text.get_text() for text in top.texts)
    assert curves.get_yscale() == "log"


def test_time_ends_with_the_breakdown_and_the_panel_says_so():
    exp = samples.experiment(**STIFF)
    record = samples.record(exp)
    t, member = record.times(2), Member(0, 2, "central", role="worst")
    with style.applied():
        pages = [
            solution.solution(Ladder(record, "theta", member)),
            time.overlay(Ladder(record, "theta", member)),
        ]
    for page in pages:
        top = page.figure.axes[0]
        assert t[0] < top.get_xlim()[1] < t[-1] / 2
        assert any("ends with the breakdown" in text.get_text() for text in top.texts)


def test_without_a_member_that_passes_the_typical_one_is_the_least_bad():
    record = samples.record(samples.experiment(**STIFF))
    roles = {m.role: record.flags("theta_status")[0, m.case] for m in
             choice.members(record, "theta")}  # fmt: skip
    assert roles == {"typical": "INCONCLUSIVE", "worst": "FAIL"}


def test_an_amplitude_is_never_negative():
    exp = samples.experiment()
    record = samples.record(exp)
    amplitude = record.variables["amplitude"]
    record.variables["amplitude"] = replace(amplitude, values=0 * amplitude.values - 8.7e88)
    table = contents.scalars(record, [Member(0, 0, "central")])
    assert [row[-1] for row in table.rows] == [8.7e88] * 4


def test_the_set_up_names_parameters_as_the_equation_does():
    exp = samples.experiment(
        model={
            "kind": "oscillator",
            "spring": "k*u",
            "damping": {"linear": 0.1},
            "parameters": {"k": 2.0},
        },
        initial={"u": 1.0},
        levels=[6, 7, 8],
    )
    rows = dict(setting.setup(samples.record(exp)))
    assert rows["Parameters"] == "m = 1 kg, b = 0.1 kg s⁻¹ (damping.linear), k = 2"


def test_an_undecided_verdict_states_no_order_anywhere():
    box = {"kind": "sliding_box", "m": 1.0, "k": 1.0, "mu": 0.1, "alpha": 0.5, "g": 1.0}
    exp = samples.experiment(
        model=box, initial={"u": 1.0}, time={"end": 6.0}, levels=[6, 7, 8, 9, 10],
        schemes=[{"kind": "rk2", "events": "mesh"}],
        checks=[{"value": "event_count", "above": 0}],
    )  # fmt: skip
    record = samples.record(exp)
    (member,) = record.all_members
    assert record.flags("u_status").item() == "INCONCLUSIVE"
    assert np.isfinite(record["u_order"]).any()
    lead = choice.find_lead(record, samples.summary(exp, record))
    assert not [n for n in hero.numbers(lead) if "order" in n["label"]]
    counts = [row[-1] for row in contents.orders(record, "u", [member]).rows]
    assert "yes" not in counts
    # nothing can be extrapolated either
    with style.applied():
        assert "the finest solution" in solution.motion(Ladder(record, "u", member)).caption


def test_an_amplitude_of_a_motion_that_still_changes_is_not_settled():
    oscillator = {"kind": "oscillator", "m": 1.0, "spring": "u"}
    found = [
        finest_level.unsettled(
            samples.record(
                samples.experiment(
                    model=oscillator | damping, initial={"u": 1.0, "v": 0.0}, levels=[8, 9],
                    time={"end": 60.0}, checks=[], sweep={"initial.u": [1.0, 2.0]},
                )
            )
        ).tolist()
        for damping in ({}, {"damping": {"linear": 0.1}})
    ]  # fmt: skip
    assert found == [[[False, False]], [[True, True]]]


def test_an_empty_panel_has_one_remark():
    with style.applied():
        ax = style.canvas(1.0).add_subplot()
        style.remark(ax, "nothing to divide")
        style.beside(ax)
    assert [text.get_text() for text in ax.texts] == ["nothing to divide"]


@pytest.mark.parametrize(
    "model",
    [
        {"kind": "system", "coordinates": ["theta"], "acceleration": {"theta": "-sin(theta)"}},
        {"kind": "oscillator", "spring": "u", "stop": "u < -3"},
    ],
)
def test_no_body_on_a_spring_is_drawn_for_an_angle_or_before_a_stop(model):
    position = "theta" if model["kind"] == "system" else "u"
    exp = samples.experiment(model=model, initial={position: 1.0}, checks=[])
    assert scenes.scene_of(exp.model.definition) is None
