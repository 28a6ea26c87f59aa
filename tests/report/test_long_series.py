"""A long series in panels below each other: which runs have it, what a page can move along, and how large it is."""

from __future__ import annotations

import re

import numpy as np
import pytest
import samples

from vibsim.report import choice, style
from vibsim.report.data import Ladder, Member
from vibsim.report.figures import drawing, moments, solution
from vibsim.report.figures.long_series import MOST_PANELS, PERIODS, long_series


def made(periods=40, schemes=("central",), levels=(0, 1, 2), steps=20, **changes):
    exp = samples.experiment(
        **{"model": {"kind": "spring"}, "initial": {"u": 1.0}, "levels": list(levels), "checks": []}
        | {"time": {"periods": periods, "steps_per_period": steps}, "schemes": list(schemes)}
        | changes
    )  # fmt: skip
    record = samples.record(exp)
    return exp, record, record.words("scheme")


def drawn(name="u", **changes):
    _, record, schemes = made(**changes)
    with style.applied():
        picture = long_series(Ladder(record, name, Member(0, 0, schemes[0])))
        return picture, "" if picture is None else drawing.svg(picture.figure, picture.name)


@pytest.mark.parametrize("periods", [9, 11])
def test_a_run_of_more_than_ten_periods_is_long(periods):
    picture, _ = drawn(periods=periods)
    assert (picture is not None) == (periods > 10)


@pytest.mark.parametrize(
    ("changes", "labels"),
    [
        ({}, ["800 steps", "1 600 steps", "3 200 steps"]),
        ({"schemes": ["central", "rk4"]}, ["central, level 0", "rk4, level 0"]),
    ],
)
def test_levels_or_schemes_have_a_panel_each_beside_the_exact_solution(changes, labels):
    picture, text = drawn(**changes)
    axes = picture.figure.axes
    told = [[line.get_label() for line in ax.get_lines()] for ax in axes[:-1]]
    assert [row[0] for row in told] == ["exact"] * len(labels)
    assert [row[1].replace("\u202f", " ").replace("\u2009", " ") for row in told] == labels
    assert text.count('data-axis="long"') == len(labels)
    assert text.count('data-axis="overview"') == 1
    widths = [float(width) for width in re.findall(r'data-window="([\d.]+)"', text)]
    assert widths == pytest.approx([PERIODS * 2 * np.pi] * len(labels), rel=0.02)


def test_what_grows_without_bound_leaves_its_panel_and_hides_nothing():
    picture, text = drawn(schemes=["central", "forward_euler"], levels=(0, 1))
    low, high = picture.figure.axes[0].get_ylim()
    assert (low, high) == pytest.approx((-1.25, 1.25))
    assert "nan" not in text


@pytest.mark.slow
def test_a_very_long_run_keeps_its_extremes_and_a_small_figure():
    picture, text = drawn(periods=1000)
    assert len(text) < 400_000
    for ax in picture.figure.axes[:-1]:
        for line in ax.get_lines():
            t, u = line.get_xdata(), line.get_ydata()
            # each tenth of the run reaches both ends of the swing
            for part in np.array_split(u, 10):
                assert part.max() == pytest.approx(1.0, abs=0.02)
                assert part.min() == pytest.approx(-1.0, abs=0.02)
            assert t[-1] == pytest.approx(2000 * np.pi)


def test_every_point_of_a_curve_is_in_the_page():
    """A line that matplotlib simplified would lose its shape where the page shows a small part of it."""
    picture, text = drawn()
    line = picture.figure.axes[0].get_lines()[1]
    path = re.search(
        r'data-curve="800 steps".*?<path d="([^"]*)"', text.replace("\u202f", " "), re.DOTALL
    )
    assert path is not None
    assert len(re.findall(r"[ML]", path[1])) == line.get_xdata().size == 801


@pytest.mark.slow
def test_there_are_at_most_so_many_panels():
    picture, _ = drawn(periods=12, levels=tuple(range(8)), steps=8)
    assert len(picture.figure.axes) == MOST_PANELS + 1


def test_few_samples_a_period_are_dots_on_a_smooth_exact_solution():
    picture, text = drawn(periods=20, steps=5)
    exact, own = picture.figure.axes[0].get_lines()
    assert np.allclose(exact.get_ydata(), np.cos(exact.get_xdata()), atol=0.05)
    assert text.count("<use") >= 3 * own.get_xdata().size == 3 * 101
    assert "Dots" in picture.caption
    picture, text = drawn(periods=20, steps=20)
    assert "<use" not in text
    assert "Dots" not in picture.caption


@pytest.mark.parametrize(("every", "is_dotted"), [(2, False), (16, True), (32, True), (64, True)])
def test_a_motion_of_few_samples_has_no_line_between_them(every, is_dotted):
    """Lines between three samples a period would be a motion of another frequency, of other extremes."""
    exp = samples.experiment(
        time={"end": 40.0}, levels=[8, 9, 10], samples={"every": every}, schemes=["rk4"]
    )
    record = samples.record(exp)
    (member,) = choice.members(record, "theta")
    with style.applied():
        picture = solution.motion(Ladder(record, "theta", member))
    above, below = picture.figure.axes
    exact, *levels = above.get_lines()
    dashes = {line.get_linestyle() for line in [*levels, *below.get_lines()]}
    assert (dashes == {"None"}) is is_dotted
    # the exact solution is known between the samples, too
    assert exact.get_linestyle() == "-"
    assert exact.get_xdata().size > 100
    assert ("stored times" in above.get_title(loc="left")) is is_dotted
    assert ("stored samples" in picture.caption) is is_dotted


def test_finer_levels_have_no_lines_between_the_few_points_of_the_coarsest():
    """A level of 64 steps, drawn at nine of them, looked like a motion a third as fast."""
    exp = samples.experiment(model={"kind": "pendulum", "g": 9.81}, levels=[3, 4, 5, 6])
    with style.applied():
        picture = solution.motion(Ladder(samples.record(exp), "theta", Member(0, 0, "central")))
    _, coarsest, *finer = picture.figure.axes[0].get_lines()
    assert coarsest.get_linestyle() != "None"
    assert {line.get_linestyle() for line in finer} == {"None"}


def test_the_points_of_the_steps_themselves_keep_their_line():
    """Where every step is drawn, as at the limit of stability, nothing is hidden between."""
    steps = 64
    t = np.linspace(0.0, 20.0, steps + 1)
    fast = np.cos(0.8 * np.pi * np.arange(t.size))
    assert not moments.is_undersampled(steps, t, (t, fast))
    assert moments.is_undersampled(steps, t[::2], (t[::2], fast[::2]))
