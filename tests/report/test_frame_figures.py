"""Frames of figures: no word leaves one, what diverges gives none its range, and legends say what became of runs."""

from __future__ import annotations

import math
from unittest.mock import patch

import numpy as np
import pytest
import samples
from matplotlib.text import Text
from thinned import thinned

from vibsim.report import choice, frame, style
from vibsim.report.data import Ladder, Member
from vibsim.report.figures import (
    drawing,
    energy,
    extrema,
    gallery,
    order,
    solution,
    theory,
    time,
    work,
)
from vibsim.report.figures import hero as first_screen
from vibsim.report.figures.panels import Curve
from vibsim.report.figures.work import lines
from vibsim.report.page import hero

TEXT = ["forward_euler", "backward_euler", "crank_nicolson", "euler_cromer", "central"]
MANY = [
    "central",
    "forward_euler",
    "backward_euler",
    "crank_nicolson",
    "rk2",
    "rk4",
    "ab3",
    "bdf2",
    "euler_cromer_u_first",
    "velocity_verlet",
    "generalized_alpha",
    {"kind": "dop853", "label": "dop853_6"},
]


def spring(**changes):
    content = {
        "model": {"kind": "spring", "w": 2.0 * math.pi},
        "initial": {"u": 1.0, "v": 0.0},
        "time": {"end": 6.0, "base_steps": 120},
        "levels": [0, 1, 2],
        "schemes": TEXT,
    }
    return samples.experiment(**(content | changes))


@pytest.fixture(scope="module")
def overflowing():
    exp = spring(
        schemes=["forward_euler", "ab2"],
        levels=[0, 1, 2, 3],
        time={"end": 2000.0, "base_dt": 0.4},
    )
    return exp, samples.record(exp)


@pytest.fixture(scope="module")
def few():
    exp = spring()
    return exp, samples.record(exp)


@pytest.fixture(scope="module")
def diverging():
    """Return a sweep over w, of schemes that are stable and others that are not."""
    exp = spring(
        model={"kind": "spring"},
        sweep={"model.w": {"linspace": [0.5, 3.0, 9]}},
        schemes=["central", "crank_nicolson", "backward_euler"],
        time={"end": 100.0, "base_dt": 2.0},
        levels=[0, 1],
    )
    return exp, samples.record(exp)


def words_of(figure):
    return " ".join(text.get_text() for text in figure.findobj(Text))


def drawn_outside(figure):
    """Return the words that a figure draws beyond what is saved of it."""
    seen = []
    plain = Text.draw

    def draw(self, renderer, *args, **kwargs):
        if self.get_visible() and self.get_text().strip():
            seen.append((self.get_text(), self.get_window_extent(renderer)))
        return plain(self, renderer, *args, **kwargs)

    with patch.object(Text, "draw", draw):
        figure.canvas.draw()
    box = drawing.box(figure).transformed(figure.dpi_scale_trans)
    return [
        text
        for text, at in seen
        if at.width and min(at.x0 - box.x0, box.x1 - at.x1, at.y0 - box.y0, box.y1 - at.y1) < -1.0
    ]


CASES = {
    "few": {},
    "many": {"schemes": MANY, "levels": [0, 1]},
    "long names": {"schemes": [{"kind": kind, "label": f"{kind}_of_a_long_name"} for kind in TEXT]},
    "sweep": {
        "model": {"kind": "spring"},
        "sweep": {"model.w": {"linspace": [0.5, 3.0, 5]}},
        "schemes": ["forward_euler", "generalized_alpha"],
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_no_word_leaves_a_figure(case):
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    exp = spring(**CASES[case])
    record = samples.record(exp)
    shown, _ = gallery.choose(record)
    with style.applied():
        decisive = choice.find_lead(record, samples.summary(exp, record))
        below = gallery.pictures(shown, decisive, [])
        behind = [picture for _, tab in below.belief for picture in tab]
        behind += [view.picture for view in below.members]
        for picture in [*hero.pictures(decisive), *below.motion, *behind]:
            FigureCanvasAgg(picture.figure)
            assert not drawn_outside(picture.figure), picture.name


@pytest.mark.slow
def test_few_common_times_are_not_told_to_be_round_off():
    circuit = {"kind": "circuit", "L": 0.02, "R": 5.0, "C": 3e-5, "voltage": "12*cos(314.159*t)"}
    exp = spring(
        model=circuit,
        initial={"di_dt": 600.0},
        time={"end": 0.02},
        levels=[3, 4, 5, 6],
        schemes=["rk4"],
        checks=[],
    )
    record = samples.record(exp)
    assert np.isnan(np.asarray(record["i_ratio"])).all()
    with style.applied():
        figure = time.overlay(Ladder(record, "i", Member(0, 0, "rk4"))).figure
    assert "too few common times for ratios" in words_of(figure)


@pytest.mark.slow
def test_runs_that_broke_down_are_not_told_to_be_round_off(overflowing):
    _, record = overflowing
    assert (record["status"] != 0).any()
    for s, name in enumerate(record.words("scheme")):
        with style.applied():
            figure = time.overlay(Ladder(record, "u", Member(s, 0, name))).figure
        assert "round-off" not in words_of(figure)
        if (record["status"][s, 0] != 0).all():
            assert "(broke down)" in words_of(figure)
            assert "no ratio means anything" in words_of(figure)
    with style.applied():
        running = energy.running(record, 0)
    assert "forward_euler: broke down" in words_of(running.figure)
    assert "unclear" not in words_of(running.figure)


def test_a_centred_formula_that_has_no_value_at_the_ends_did_not_break_down():
    values = np.array([np.nan, 1.0, 2.0, np.nan])
    assert Curve("a", values).fate == ""
    assert Curve("a", values, sound=False).fate == "lost in round-off"
    assert Curve("a", values, lost="broke down").fate == "broke down"
    assert Curve("a", np.array([1.0, np.inf, np.nan, np.nan])).fate == "broke down"


def test_frames_are_those_of_the_members_that_stay(diverging):
    exp, record = diverging
    views, _ = samples.views(exp, record, "u")
    with style.applied():
        running = energy.running(record, 8)
    assert np.nanmax(record["u_max"]) > 1e40
    drawn = [views[name].picture for name in ("sweep_error_u", "amplitude")]
    for picture in (*drawn, running):
        ax = picture.figure.axes[0]
        low, high = ax.get_ylim()
        assert high < 1e8
        assert low > (1e-20 if ax.get_yscale() == "log" else -1e8)
        assert frame.LEAVING in picture.caption


def test_the_local_amplitude_is_shown_or_said_to_be_cut():
    for steps, cut in ((0.3184, False), (0.33, True)):
        exp = spring(schemes=["central"], levels=[0], time={"end": steps * 50, "base_dt": steps})
        record = samples.record(exp)
        shown, _ = gallery.choose(record)
        with style.applied():
            picture = extrema.local(record, shown)
        peaks = record["peak"][np.isfinite(record["peak"])]
        top = picture.figure.axes[1].get_ylim()[1]
        assert bool(peaks.max() > extrema.CUT_OFF) == cut
        assert cut or peaks.max() < top
        said = words_of(picture.figure)
        assert ("cut off" in said or "logarithmic" in said) is cut


def test_a_mark_stands_where_a_curve_leaves():
    figure = style.canvas(2.0)
    ax = figure.add_axes((0.1, 0.1, 0.8, 0.8))
    ax.set(xlim=(0.0, 4.0), ylim=(0.0, 1.0))
    x = np.arange(5.0)
    assert frame.mark_leaving(ax, x, np.array([0.5, 0.5, 1.5, 3.0, np.nan]), color="black")
    assert [line.get_xdata().tolist() for line in ax.lines] == [[1.5]]
    assert not frame.mark_leaving(ax, x, np.full(5, 0.5), color="black")


@pytest.mark.slow
def test_the_legend_of_work_and_precision_has_a_name_for_every_symbol():
    exp = spring(schemes=MANY, levels=[0, 1])
    record = samples.record(exp)
    with style.applied():
        figure = work.precision(record, 0).figure
        figure.draw_without_rendering()
    (legend,) = figure.legends
    names = {line.name for line in lines(record, 0)}
    assert {text.get_text() for text in legend.get_texts()} >= names
    for text in legend.get_texts():
        box = text.get_window_extent()
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, text.get_text()


@pytest.mark.slow
def test_coinciding_curves_are_told(few):
    _, record = few
    with style.applied():
        picture = theory.order_and_stability(record)
    assert "backward_euler:\n  same as forward_euler" in words_of(picture.figure)
    assert "central:\n  same as euler_cromer" in words_of(picture.figure)
    assert "phase error of backward_euler as of forward_euler" in picture.caption
    x = np.linspace(0.0, 1.0, 9)
    assert frame.same_as([x, x + 1e-5, x + 0.1, x], 1.0) == [None, 0, None, 0]


def test_a_colour_of_the_local_periods_is_a_scheme(few):
    _, record = few
    shown = [Member(s, 0, name) for s, name in enumerate(TEXT[:3])]
    with style.applied():
        axes = extrema.local(record, shown).figure.axes[2]
    colours = [line.get_color() for line in axes.lines if line.get_marker() not in {"", "None"}]
    assert len(colours) == 6
    assert set(colours) == {style.look(s)["color"] for s in range(3)}


def test_several_promised_slopes_are_told_apart(few):
    _, record = few
    with style.applied():
        figure = order.against_step(record, "u", 0).figure
    lines = [line for line in figure.axes[0].lines if str(line.get_label()).startswith("slope")]
    assert len(lines) > 1
    assert len({str(line._unscaled_dash_pattern) for line in lines}) == len(lines)
    assert {"1", "2"} <= {text.get_text() for text in figure.axes[0].texts}


@pytest.mark.slow
def test_what_is_left_out_is_named():
    exp = spring(schemes=MANY, levels=[0, 1])
    _, told = gallery.choose(samples.record(exp))
    assert "more schemes have no figures over time" in told


@pytest.mark.parametrize("levels", thinned([[7], [7, 8, 9]], 2))
def test_the_grey_line_of_a_motion_is_named_where_it_is_drawn(levels):
    model = {"kind": "elastic_pendulum", "beta": 0.9, "Theta": 40, "gamma": 0.05}
    exp = samples.experiment(model=model, initial={}, levels=levels)
    with style.applied():
        picture = solution.motion(Ladder(samples.record(exp), "x", Member(0, 0, "central", "")))
    lines = picture.figure.axes[0].lines
    assert ("grey" in picture.caption) == any(line.get_color() == style.PALE for line in lines)
    assert ("grey" in picture.caption) == (len(levels) > 1)


def test_the_exact_solution_is_smooth_where_levels_have_few_points_in_a_period():
    """Three points in a period made the grey curve beat, and look as wrong as the run beside it."""
    time_of = {"end": 40.0, "base_steps": 30}
    exp = spring(model={"kind": "spring"}, time=time_of, levels=[0, 1], schemes=["central"])
    record, member = samples.record(exp), Member(0, 0, "central", "")
    with style.applied():
        pictures = [
            solution.motion(Ladder(record, "u", member)),
            first_screen.solution(Ladder(record, "u", member), is_left=True),
        ]
    for picture in pictures:
        t, u = picture.figure.axes[0].lines[0].get_data()
        assert picture.figure.axes[0].lines[0].get_color() == style.PALE
        np.testing.assert_allclose(u, np.cos(t), atol=1e-12)
        assert t.size > 150


@pytest.mark.parametrize(("end", "is_drawn"), [(15.0, False), (22.0, True)])
def test_a_page_shows_periods_from_three_peaks_on(end, is_drawn):
    exp = samples.experiment(time={"end": end}, levels=[8, 9, 10], checks=[{"converges": "theta"}])
    record = samples.record(exp)
    decisive = choice.find_lead(record, samples.summary(exp, record))
    shown = gallery.choose(record)[0]
    with style.applied():
        tabs = gallery.pictures(shown, decisive, []).belief
        assert extrema.local(record, shown) is not None
    names = [picture.name for _, tab in tabs for picture in tab]
    assert ("extrema_0" in names) == is_drawn
