"""Theory beside measurement, printed numbers beside ours, two energies: what the page says is what the record holds."""

from __future__ import annotations

import csv
import math
import re

import numpy as np
import pytest
import samples

from vibsim import report
from vibsim.models import MODELS
from vibsim.report import choice, style, words
from vibsim.report.data import Ladder
from vibsim.report.figures import energy as figures_energy
from vibsim.report.figures import extrema, gallery
from vibsim.report.figures import plane as figures_plane
from vibsim.report.figures import theory as figures_theory
from vibsim.report.figures import work as figures_work
from vibsim.report.tables import levels as contents_levels
from vibsim.report.tables import published
from vibsim.report.tables import theory as contents_theory
from vibsim.report.tables.table import Column, Table, Written, to_csv
from vibsim.schemes import FIXED_STEP

W = 2.0 * math.pi
TEXT = ["forward_euler", "crank_nicolson", "rk4", "euler_cromer"]
PRINTED = {
    "title": "Relative error in total energy",
    "source": "vibration text, section 6.2",
    "value": "relative_running_max",
    "quantity": "energy_deviation_d2t",
    "beside": ["relative_energy_error"],
    "rows": [
        {"scheme": "forward_euler", "level": 0, "printed": "1.120e8"},
        {
            "scheme": "crank_nicolson",
            "level": 1,
            "printed": "1.221e-2",
            "holds": False,
            "note": "loose <solver>",
        },
        {"scheme": "rk4", "level": 1, "at": {"t": 1.0}, "printed": "8.214e-3"},
        {"scheme": "euler_cromer", "level": 0, "printed": "9.999e-1"},
    ],
}


def spring(**changes):
    content = {
        "model": {"kind": "spring", "w": W},
        "initial": {"u": 1.0, "v": 0.0},
        "time": {"end": 10.0, "base_steps": 200},
        "levels": [0, 1, 2],
        "schemes": TEXT,
    }
    return samples.experiment(**(content | changes))


@pytest.fixture(scope="module")
def text():
    exp = spring(published=[PRINTED])
    rec = samples.record(exp)
    return exp, rec, samples.summary(exp, rec)


@pytest.fixture(scope="module")
def everything():
    exp = spring(schemes=list(FIXED_STEP), levels=[0, 1])
    return exp, samples.record(exp)


def column(table, header):
    return [row[[c.header for c in table.columns].index(header)] for row in table.rows]


def write(directory, exp, rec, summary):
    report.write(samples.plan(exp), rec, summary, directory)
    return (directory / "report.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("without_pictures")
def test_printed_digits_stand_beside_ours(text, tmp_path):
    exp, rec, summary = text
    (table,) = published.tables(rec, summary)
    assert column(table, "printed") == [row["printed"] for row in PRINTED["rows"]]
    agrees = [abs(ours - row.meaning.number) <= row.meaning.half_unit for ours, row in
              zip(column(table, "ours"), exp.published[0].rows, strict=True)]  # fmt: skip
    assert agrees == [True, False, True, False]
    printed = [row.meaning.number for row in exp.published[0].rows]
    expected = [a - b for a, b in zip(column(table, "ours"), printed, strict=True)]
    assert column(table, "difference") == expected
    assert column(table, "agrees?") == ["yes", "no", "yes", "no (not as expected)"]
    assert (
        column(table, "beside: relative energy error by own velocity")[1]
        < 1e-12
        < column(table, "ours")[1]
    )
    page = write(tmp_path, exp, rec, summary)
    assert "1.221·10⁻²" in page
    assert "1.22237·10⁻²" in page
    assert "loose &lt;solver&gt;" in page
    assert "2 of 4 printed numbers agree" in page
    rows = list(csv.reader((tmp_path / "tables/published_1.csv").read_text().splitlines()))
    assert rows[1][rows[0].index("printed")] == "1.120e8"
    assert float(rows[2][rows[0].index("ours")]) == column(table, "ours")[1]


@pytest.mark.usefixtures("without_pictures")
def test_only_printed_numbers_that_surprise_have_a_card(text, tmp_path):
    page = write(tmp_path, *text)
    cards = set(re.findall(r'id="check-(published_\d_\d)"', page))
    assert cards == {"published_1_4"}


@pytest.mark.usefixtures("without_pictures")
def test_a_note_of_a_claim_is_shown_and_harmless(tmp_path):
    claim = {
        "claim": "it lags",
        "holds": True,
        "note": "a <b>note</b>",
        "that": {"value": "period", "above": 1.0},
    }
    exp = spring(schemes=["crank_nicolson"], checks=[claim])
    rec = samples.record(exp)
    assert "a &lt;b&gt;note&lt;/b&gt;" in write(tmp_path, exp, rec, samples.summary(exp, rec))


def test_theory_stands_beside_every_measured_number(text):
    _, rec, _ = text
    growth, phase = contents_theory.predictions(rec)
    assert len(growth.rows) == len(phase.rows) == 4 * 3
    predicted, measured = (
        column(growth, name) for name in ("growth per period − 1: predicted", "measured")
    )
    np.testing.assert_allclose(measured, predicted, atol=1e-13)
    # all agree to round-off, and there is no difference to show
    for table in (growth, phase):
        assert "difference" not in [c.header for c in table.columns]
        assert "the two agree to round-off" in table.caption
    # Crank-Nicolson neither grows nor decays, forward Euler grows by (1 + p^2)^(1/2) in each step
    p = W * 0.05
    assert predicted[0] == pytest.approx((1 + p * p) ** (0.5 * W / p) - 1, rel=1e-12)
    assert predicted[3] == pytest.approx(0.0, abs=1e-14)
    assert column(growth, "stable")[0] == "never"
    assert column(growth, "stable")[3] == "yes"


@pytest.mark.parametrize(
    ("p", "limit", "word"),
    [(1.0, 2.0, "yes"), (2.0, 2.0, "at the limit"), (2.1, 2.0, "no"), (0.1, 0.0, "never"),
     (9.0, math.inf, "yes"), (math.nan, 2.0, "–"), (1.0, math.nan, "–")],
)  # fmt: skip
def test_stability_is_a_word(p, limit, word):
    assert contents_theory.is_stable(p, limit) == word


def test_a_scheme_conserves_with_its_own_velocity_what_the_centred_difference_seems_to_lose(text):
    _, rec, _ = text
    table = contents_levels.velocities(rec)
    own, centred = (column(table, f"max |ΔE|/E(0), {v}") for v in ("own velocity", "[D₂ₜu]"))
    implicit = [i for i, name in enumerate(column(table, "scheme")) if name == "crank_nicolson"]
    assert all(own[i] < 1e-12 < 1e-3 < centred[i] for i in implicit)
    # nothing is compared with round-off, and what is compared is written plainly
    quotients = column(table, "second over first")
    assert all(quotients[i] is None for i in implicit)
    shown = [row[-2] for row in table.text_rows()]
    assert shown[0] == "0.748"
    assert not any("10" in text and "·" in text for text in shown)
    picture = figures_energy.running(rec, 0)
    texts = [t.get_text() for t in picture.figure.axes[0].get_legend().get_texts()]
    assert {"own velocity", "[D₂ₜu]"} <= set(texts)


@pytest.mark.slow
def test_an_energy_that_damping_takes_away_is_no_error(tmp_path):
    model = {"kind": "oscillator", "spring": "39.5*u"}
    for more, is_error in (({}, True), ({"damping": {"linear": 0.5}}, False)):
        exp = spring(model=model | more, schemes=["rk4"])
        rec = samples.record(exp)
        report.write(samples.plan(exp), rec, samples.summary(exp, rec), tmp_path)
        page = (tmp_path / "report.html").read_text()
        assert ("Energy error by velocity" in page) == is_error
        assert ("How does the energy error grow" in page) == is_error


def test_an_energy_that_decays_does_not_grow():
    rec = samples.record(spring(schemes=["forward_euler", "backward_euler"]))
    table = contents_levels.velocities(rec)
    drifts = column(table, "drift of the energy, own velocity")
    assert drifts == ["exponential growth"] * 3 + ["exponential decay"] * 3


def test_a_difference_above_round_off_is_shown():
    # peaks interpolated by a parabola are not exact
    exp = spring(schemes=["rk4", "central"], samples="common")
    growth, phase = contents_theory.predictions(samples.record(exp))
    assert any(isinstance(x, float) and abs(x) > 1e-9 for x in column(phase, "difference"))
    differences = column(growth, "difference")
    predicted, measured = (
        column(growth, name) for name in ("growth per period − 1: predicted", "measured")
    )
    for a, b, difference in zip(predicted, measured, differences, strict=True):
        assert difference is None or difference == pytest.approx(b - a, abs=1e-15)


def test_a_further_number_by_the_own_velocity_says_so(tmp_path):
    rows = [{"scheme": "rk4", "level": 0, "printed": "3.510e-2"}]
    table = {
        "title": "Relative error",
        "value": "relative_energy_error_d2t",
        "beside": ["relative_energy_error", "period"],
        "rows": rows,
    }
    exp = spring(published=[table])
    rec = samples.record(exp)
    (found,) = published.tables(rec, samples.summary(exp, rec))
    assert [c.header for c in found.columns][-2:] == ["by own velocity", "beside: period"]


def test_the_centred_scheme_alone_has_no_second_energy():
    rec = samples.record(spring(schemes=["central"]))
    assert contents_levels.velocities(rec) is None
    assert figures_energy.running(rec, 0) is None


@pytest.mark.slow
def test_every_scheme_has_a_look_of_its_own_and_one_legend_entry(everything):
    _, rec = everything
    looks = [str(style.look(i)) for i in range(len(rec["scheme"]))]
    assert len(set(looks)) == len(looks)
    picture = figures_theory.order_and_stability(rec)
    texts = [t.get_text() for t in picture.figure.axes[0].get_legend().get_texts()]
    assert texts == rec.words("scheme")
    assert len(contents_theory.schemes(rec).rows) == len(texts)


@pytest.mark.slow
def test_a_page_of_all_schemes_is_small_and_folds_long_tables(everything, tmp_path):
    exp, rec = everything
    page = write(tmp_path, exp, rec, samples.summary(exp, rec))
    assert len(page) < 2_000_000
    shown = re.sub(r"<details.*?</details>", "", page, flags=re.DOTALL)
    assert shown.count("<tr") < 80
    drawn, _ = gallery.choose(rec)
    assert len(drawn) == gallery.MOST_SHOWN // 2


@pytest.mark.slow
@pytest.mark.usefixtures("unrendered")
def test_adaptive_schemes_have_their_place_in_work_alone(tmp_path):
    adaptive = {"kind": "dop853", "tolerance": [1e-8, 1e-4]}
    exp = spring(schemes=["central", "rk4", adaptive])
    rec = samples.record(exp)
    lines = {line.name: line for line in figures_work.lines(rec, 0)}
    assert lines["dop853"].labels == ("tolerance 0.0001", "tolerance 1e-08")
    assert lines["dop853"].error[0] > lines["dop853"].error[1]
    np.testing.assert_array_equal(lines["rk4"].work[1], 4 * lines["rk4"].work[0])
    assert figures_work.precision(rec, 0) is not None
    theory = figures_theory.order_and_stability(rec)
    texts = [t.get_text() for t in theory.figure.axes[0].get_legend().get_texts()]
    assert texts == ["central", "rk4"]
    assert {m.scheme_name for m in gallery.choose(rec)[0]} == {"central", "rk4"}
    write(tmp_path, exp, rec, samples.summary(exp, rec))


def test_runs_beyond_the_limit_show_predicted_and_measured_growth():
    exp = spring(
        schemes=["central", "crank_nicolson"], time={"end": 10.0, "base_steps": 31}, levels=[0, 1]
    )
    rec = samples.record(exp)
    picture = figures_theory.growing(rec)
    (entry,) = [t.get_text() for t in picture.figure.axes[0].get_legend().get_texts()]
    assert words.number(float(rec["theory_growth"][0, 0, 0])) in entry
    assert words.number(float(rec["measured_growth"][0, 0, 0])) in entry
    assert figures_theory.growing(samples.record(spring(schemes=["central"]))) is None


@pytest.mark.parametrize(("u", "v"), [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (1.0, -3.0)])
def test_the_first_peak_is_that_of_the_exact_solution(u, v):
    exp = spring(initial={"u": u, "v": v}, schemes=["gauss4"], levels=[2, 3])
    rec = samples.record(exp)
    expected = extrema.first_peak(rec, 0, 1.0)
    assert float(rec["peak_time"][0, 0, -1, 0]) == pytest.approx(expected, abs=1e-4)


def test_local_amplitudes_are_half_the_height_to_the_next_trough():
    time, trough = np.array([0.0, 1.0, 2.0]), np.array([0.5, 1.5])
    found = extrema.heights(time, np.array([1.0, 2.0, 3.0]), trough, np.array([-1.0, -4.0]))
    np.testing.assert_array_equal(found, [1.0, 3.0, 3.5])


def test_levels_of_the_phase_plane_are_those_that_were_computed(text):
    _, rec, _ = text
    member = choice.members(rec, "u")[2]
    model = MODELS["spring"]
    values = Ladder(rec, model.position, member).on_level(0)
    error = rec["u_exact"][0] - values
    np.testing.assert_allclose(error, rec["u_error"][2, 0, 0], atol=1e-13)
    picture = figures_plane.phase(rec, choice.members(rec, "u"))
    assert len(picture.figure.axes) == 3
    assert all(ax.get_aspect() == 1.0 for ax in picture.figure.axes)


@pytest.mark.parametrize(
    ("model", "end", "closes"),
    [
        ({"kind": "pendulum"}, 20.0, True),
        ({"kind": "system", "acceleration": "(1 - u**2)*v - u"}, 20.0, False),
        pytest.param(
            {"kind": "system", "acceleration": "(1 - u**2)*v - u"},
            60.0,
            False,
            marks=pytest.mark.slow,
        ),
    ],
)
def test_an_exact_orbit_that_does_not_close_is_drawn_as_far_as_the_levels(model, end, closes):
    u = "theta" if closes else "u"
    exp = samples.experiment(
        model=model,
        initial={u: 1.0},
        time={"end": end, "base_steps": 400},
        levels=[0, 1],
        schemes=["rk4"],
    )
    rec = samples.record(exp)
    picture = figures_plane.phase(rec, choice.members(rec, u))
    exact, *levels = picture.figure.axes[0].get_lines()
    ends = [line.get_xdata()[-1] for line in (exact, levels[-1])]
    assert (abs(ends[0] - ends[1]) < 0.01) == (not closes)


@pytest.mark.parametrize(
    ("printed", "shown"),
    [
        ("1.120e8", "1.120·10⁸"),
        ("1.221 10^-2", "1.221·10⁻²"),
        ("4.93", "4.93"),
        ("-2.5E-3", "−2.5·10⁻³"),
    ],
)
def test_a_printed_number_keeps_its_digits(printed, shown):
    assert words.printed(printed) == shown
    assert words.in_style_of(0.012345678, "1.221e-2") == "1.23457·10⁻²"
    assert words.in_style_of(4.934802, "4.93") == "4.9348"
    # one that blew up has not hundreds of digits
    assert words.in_style_of(1.5e300, "4.93") == "1.500·10³⁰⁰"
    assert words.in_style_of(1.5e300, "4.93e2") == "1.5000·10³⁰⁰"
    assert words.in_style_of(123456789012345.0, "1234567890123456") == "123456789012345.00"


def test_a_file_holds_the_number_and_a_page_the_text():
    table = Table("t", "c", (Column("a", form="close"),), ((Written(1.23456789012345, "1.2"),),))
    assert next(iter(table.text_rows())) == ["1.2"]
    assert to_csv(table) == "a\n1.23456789012345\n"
