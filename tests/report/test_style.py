"""Figures: thinning, axes, and the same bytes every time."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
import samples
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.colors import to_rgb

from vibsim import report
from vibsim.report import style
from vibsim.report.data import Ladder, Member
from vibsim.report.evidence import frame
from vibsim.report.figures import drawing, panels, time
from vibsim.report.page.templates import TEMPLATES

VALUES = st.lists(
    st.floats(allow_infinity=False, width=32) | st.just(float("nan")), min_size=1, max_size=400
)


@given(VALUES, st.integers(1, 40))
def test_thinning_keeps_extremes_ends_and_order(values, width):
    y = np.array(values)
    t = np.arange(y.size, dtype=float)
    x, z = style.thin(t, y, width)
    assert x.size <= max(2 * width + 2, 2)
    assert x.size == y.size or x.size <= 2 * width + 2
    assert np.all(np.diff(x) > 0)
    np.testing.assert_array_equal(z, y[x.astype(int)])
    assert (x[0], x[-1]) == (t[0], t[-1])
    if np.isfinite(y).any():
        assert np.nanmin(z) == np.nanmin(y)
        assert np.nanmax(z) == np.nanmax(y)


def test_thinning_keeps_a_lone_spike_and_a_long_gap():
    t = np.linspace(0, 1, 100_001)
    y = np.sin(t)
    y[54_321] = 9.0
    y[70_000:80_000] = np.nan
    x, z = style.thin(t, y, 100)
    assert np.nanmax(z) == 9.0
    assert np.isnan(z[(x > 0.71) & (x < 0.79)]).all()
    assert x.size <= 202


def test_thinning_leaves_short_series_alone():
    t = np.arange(10.0)
    assert style.thin(t, t, 4)[0] is t


def test_a_thinned_band_is_nowhere_narrower_and_keeps_long_gaps():
    t = np.linspace(0, 1, 100_001)
    low, high = np.sin(40 * t) - 0.1, np.sin(40 * t) + 0.1
    low[54_321], high[70_000] = -9.0, 9.0
    low[80_000:90_000] = high[80_000:90_000] = np.nan
    x, least, most = style.thin_band(t, low, high)
    assert x.size <= 2 * style.THINNED_POINTS
    assert np.all(np.diff(x) > 0)
    there = np.isfinite(low) & np.isfinite(np.interp(t, x, least))
    assert there.sum() > 89_000
    assert np.all(np.interp(t, x, least)[there] <= low[there])
    assert np.all(np.interp(t, x, most)[there] >= high[there])
    assert np.isnan(least[(x > 0.81) & (x < 0.89)]).all()


def test_a_log_tick_is_written_as_a_power():
    assert style.log_tick(1e-12) == "10⁻¹²"
    assert style.log_tick(2e-3) == "2·10⁻³"
    assert style.log_tick(1.0) == "10⁰"


def test_an_axis_label_has_power_and_unit():
    assert style.label("dE", "J", -5) == "dE [10⁻⁵ J]"
    assert style.label("ratio", "1") == "ratio"
    assert style.scale(np.array([3e-5, np.nan])) == -5
    assert style.scale(np.array([0.5])) == 0
    assert style.scale(np.array([np.nan])) == 0


def test_limits_hold_every_value_and_are_never_empty():
    low, high = style.limits(np.array([2.0, np.nan, 3.0]))
    assert low < 2.0 < 3.0 < high
    for constant in (np.array([5.0]), np.array([0.0]), np.array([np.nan])):
        low, high = style.limits(constant)
        assert low < high


def test_more_lines_than_colours_still_look_different():
    looks = [style.look(i) for i in range(3 * len(style.COLOURS))]
    assert len({(x["color"], str(x["linestyle"])) for x in looks}) == len(looks)
    assert len({(x["color"], x["marker"]) for x in looks}) == len(looks)


@pytest.fixture(scope="module")
def documents():
    exp = samples.plain()
    record = samples.record(exp)
    with style.applied():
        return [
            samples.svg(time.overlay(Ladder(record, "theta", Member(0, 0, "central"))))
            for _ in range(2)
        ]


def test_a_figure_is_the_same_bytes_every_time(documents):
    assert documents[0] == documents[1]


def test_a_figure_carries_no_date_and_no_metadata(documents):
    assert "metadata" not in documents[0]
    assert not re.search(r"20\d\d-\d\d-\d\d", documents[0])


@pytest.mark.parametrize("height", [0.5, 1.3])
def test_a_legend_has_its_lines_above_a_figure_too(height):
    with style.applied():
        figure = style.canvas(2.0)
        figure.add_axes((0.1, 0.1, 0.8, 0.8)).plot([0, 1], [0, 1], color="#123456", label="one")
        figure.legend(loc="lower left", bbox_to_anchor=(0.1, height))
        assert drawing.svg(figure, "legend").count('stroke="#123456"') == 2


def test_a_label_with_a_place_of_its_own_stays_clear_of_wide_numbers():
    numbers = [3.00000001, 3.00000002, 3.00000003]
    lefts = []
    for texts in (["3"] * 3, [f"{number:.8f}" for number in numbers]):
        with style.applied():
            figure = style.canvas(2.0)
            axes = figure.add_axes((0.1, 0.1, 0.8, 0.8))
            axes.plot([0, 1, 2], numbers)
            axes.set_yticks(numbers, texts)
            axes.set_ylabel("amplitude")
            axes.yaxis.set_label_coords(-0.05, 0.5)
            (label,) = re.findall(r"<text[^>]*>amplitude", drawing.svg(figure, "label"))
        lefts.append(float(re.search(r"(?:translate\(| x=\")(-?[\d.]+)", label)[1]))
    # a digit is 5.4 points wide
    assert lefts[1] < lefts[0] - 9 * 5.0 + 0.05 * 0.8 * style.WIDTH * 72.0


def test_ids_of_a_figure_are_unique_and_references_resolve(documents):
    ids = re.findall(r'\bid="([^"]*)"', documents[0])
    used = set(re.findall(r'(?:url\(#|href="#)([^")]+)', documents[0]))
    assert used
    assert len(ids) == len(set(ids))
    assert used == set(ids)
    ElementTree.fromstring(documents[0])


def test_an_inline_figure_has_an_escaped_name_and_scales(documents):
    element = drawing.inline(documents[0], 'a "quoted" <name>')
    assert element.startswith("<svg ")
    assert 'aria-label="a &#34;quoted&#34; &lt;name&gt;"' in element
    assert "xmlns" not in element
    opening = element[: element.index(">")]
    assert " width=" not in opening
    assert "viewBox" in opening


def test_a_name_with_markup_stays_text_in_a_figure():
    exp = samples.experiment(schemes=[{"kind": "central", "label": "<script>x</script>"}])
    record = samples.record(exp)
    with style.applied():
        from vibsim.report.figures import order

        text = samples.svg(order.against_step(record, "theta", 0))
    assert "<script" not in text
    ElementTree.fromstring(text)


SHEET = (TEMPLATES / "plots.css").read_text(encoding="utf-8")
PAPERS = {"light": "#ffffff", "dark": "#15161a"}


def shades(which):
    """Return the colours that the style sheet of a page gives to figures on light or on dark paper."""
    light, dark = (block for block in re.findall(r":root \{(.*?)\}", SHEET, flags=re.DOTALL))
    found = re.findall(r"--(\w+): (#\w+)", {"light": light, "dark": dark}[which])
    return {name: to_rgb(colour) for name, colour in found}


def contrast(one, other):
    """Return the ratio of contrast of two colours (Web Content Accessibility Guidelines 2.2)."""
    weights = np.array([0.2126, 0.7152, 0.0722])
    parts = (np.asarray(to_rgb(colour)) for colour in (one, other))
    linear = (np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4) for x in parts)
    low, high = sorted(float(weights @ x) for x in linear)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("which", PAPERS)
def test_lines_stand_out_from_light_and_dark_paper(which):
    colours = shades(which)
    assert len([name for name in colours if re.fullmatch(r"c\d", name)]) == len(style.COLOURS)
    for name, colour in colours.items():
        least = {"grid": 1.0, "band": 1.0, "pale": 1.0, "mute": 4.5}.get(name, 3.0)
        assert contrast(colour, PAPERS[which]) >= least, name


@pytest.mark.slow
def test_a_page_replaces_the_colour_of_every_line_of_its_figures(documents, tmp_path):
    exp = samples.several()
    record = samples.record(exp)
    report.write(samples.plan(exp), record, samples.summary(exp, record), tmp_path)
    # the small picture has a sheet of its own
    files = [path for path in (tmp_path / "figures").glob("*.svg") if path.stem != "thumbnail"]
    drawn = [path.read_text() for path in files]
    used = set(re.findall(r' stroke="(#\w+)"', "".join([*documents, *drawn])))
    assert len(used) > len(style.COLOURS)
    assert {colour for colour in used if f'[stroke="{colour}"]' not in SHEET} == set()


def test_axes_make_no_artists_for_ticks_until_somebody_draws_them():
    with style.applied():
        figure = style.canvas(2.0)
        ax = figure.add_axes((0.1, 0.1, 0.8, 0.8))
        ax.plot([0.0, 1.0], [0.0, 2.0])
        ax.set_xticks([0.0, 1.0], ["least", "most"])
        document = drawing.svg(figure, "plain")
        assert ">least<" in document
        assert ax.xaxis.majorTicks == ax.yaxis.majorTicks == []
        assert [label.get_text() for label in ax.get_xticklabels()] == ["least", "most"]
    lines = [tick.gridline for tick in ax.xaxis.majorTicks]
    # a frame that is a rectangle clips as a box
    assert [line.get_clip_box() is None for line in lines] == [False, False]


@pytest.mark.slow
@settings(deadline=None)
@given(st.floats(1e-12, 1e12), st.floats(1e-7, 3.0), st.sampled_from([3, 5, 7]))
def test_no_two_ticks_of_an_axis_read_alike(low, wide, most):
    high = low * (1.0 + wide)
    with style.applied():
        ax = style.canvas(2.0).add_subplot()
        style.log_axis(ax, "y", low, high, most)
        formatter, places = ax.yaxis.get_major_formatter(), ax.get_yticks()
        assert len(set(formatter.format_ticks(places))) == len(places)
        frame.scale(ax, np.array([low, high]))
        formatter, places = ax.yaxis.get_major_formatter(), ax.get_yticks()
        assert len(set(formatter.format_ticks(places))) == len(places)


def test_what_rises_from_nothing_and_fades_has_no_axis_over_sixty_decades():
    t = np.linspace(0.0, 20.0, 401)
    bump = np.exp(-20.0 * (t - 3.0) ** 2) + 1e-9
    bump[:10] = 1e-68
    low, high = panels.decades([bump])
    assert low > 1e-13 * high
    # what grows without bound begins at its initial size
    low, high = panels.decades([np.exp(20.0 * t)])
    assert (low, high) == pytest.approx((np.exp(20.0 * t[1]) / 2, 2 * np.exp(400.0)))
