"""Sweeps: where members lie, what a cell of a map shows, where the separatrix is, how large a page may become."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
import samples
from hypothesis import given
from hypothesis import strategies as st

from vibsim import report
from vibsim.core.record import Variable
from vibsim.core.vocabulary import REASONS
from vibsim.models import MODELS
from vibsim.report import choice, data, finest_level, style, sweep_layout
from vibsim.report.figures import hero
from vibsim.report.figures import order as figures_order
from vibsim.report.figures.sweeps import maps, members, separatrix
from vibsim.report.page import explorer
from vibsim.report.sweep_layout import Key

ACROSS = {
    "initial.theta": {"linspace": [-2.9, 2.9, 12]},
    "initial.omega": {"linspace": [0.1, 2.9, 9]},
}
SAMPLE = {
    "sample": {
        "method": "random",
        "n": 80,
        "seed": 1,
        "over": {"initial.theta": [0.2, 2.9], "model.g": [0.5, 60.0], "model.L": [0.5, 2.0]},
    }
}


def key(values, name="model.g"):
    array = np.asarray(values, dtype=float)
    return Key(name, "", array, np.unique(array))


@given(st.floats(0.001, 100), st.floats(40, 1e8), st.integers(3, 60))
def test_geometric_values_are_told_from_even_ones(low, span, count):
    assert sweep_layout.is_geometric(np.geomspace(low, low * span, count))
    assert not sweep_layout.is_geometric(np.linspace(low, low * span, count))
    assert not sweep_layout.is_geometric(np.linspace(-low, low * span, count))


@given(st.lists(st.floats(0.01, 1e6), min_size=2, max_size=50, unique=True), st.booleans())
def test_every_value_lies_in_its_own_cell(values, logarithmic):
    distinct = np.unique(values)
    if np.min(np.diff(distinct) / distinct[1:]) < 1e-9:
        return  # cells that are thinner than a rounding error
    borders = sweep_layout.edges(distinct, logarithmic)
    assert np.all(np.diff(borders) > 0)
    np.testing.assert_array_equal(np.searchsorted(borders, distinct), np.arange(1, borders.size))
    mean = (
        np.sqrt(distinct[1:] * distinct[:-1])
        if logarithmic
        else 0.5 * (distinct[1:] + distinct[:-1])
    )
    np.testing.assert_allclose(borders[1:-1], mean, rtol=1e-12)


@pytest.fixture(scope="module")
def across():
    exp = samples.experiment(sweep=ACROSS, levels=[8, 9, 10, 11], time={"end": 30.0})
    return exp, samples.record(exp)


@pytest.mark.slow
def test_a_grid_has_every_member_in_its_cell(across):
    _, record = across
    grid = sweep_layout.grid_of(sweep_layout.keys(record))
    assert (grid.x.key, grid.y.key) == ("initial.theta", "initial.omega")
    for name, rows in (("initial_theta", grid.x.distinct), ("initial_omega", grid.y.distinct)):
        table = grid.worst(record[name])
        expected = np.broadcast_to(rows if name == "initial_theta" else rows[:, None], (9, 12))
        np.testing.assert_array_equal(table, expected)
    assert sweep_layout.along_of(sweep_layout.keys(record)) is None


def test_a_large_grid_shows_the_worst_member_of_every_block(monkeypatch, across):
    monkeypatch.setattr(sweep_layout, "CELLS", 4)
    _, record = across
    grid = sweep_layout.grid_of(sweep_layout.keys(record))
    values = np.zeros(108)
    values[[5, 40]] = [7.0, -3.0]
    values[77] = np.nan
    table = grid.worst(values, np.abs(values))
    assert table.shape == (3, 4)
    assert sorted(table[table != 0.0]) == [-3.0, 7.0]
    assert np.isfinite(table).all()
    assert "3 × 3 members" in grid.note
    assert [border.size for border in grid.borders] == [5, 4]


@pytest.mark.slow
def test_members_anywhere_in_a_plane_are_gathered_in_cells():
    over = {"initial.theta": [0.2, 2.9], "model.g": [0.5, 60.0]}
    exp = samples.experiment(sweep={"sample": {**SAMPLE["sample"], "over": over}})
    record = samples.record(exp)
    grid = sweep_layout.grid_of(sweep_layout.keys(record))
    values = record["model_g"]
    table = grid.worst(values)
    assert np.nanmax(table) == values.max()
    column = data.bin_of(grid.borders[0], grid.x.values)
    for i in range(table.shape[1]):
        assert np.isnan(table[:, i]).all() or np.nanmax(table[:, i]) == values[column == i].max()
    assert "within it" in grid.note


def test_the_separatrix_is_found_where_the_energy_says(across):
    exp, record = across
    grid = sweep_layout.grid_of(sweep_layout.keys(record))
    x, y = separatrix.with_separatrix(exp, grid).separatrix
    assert x.size >= 12
    # from w = 1: omega = 2 cos(theta/2); golden sections end within rounding errors of a bracket
    np.testing.assert_allclose(y, 2.0 * np.cos(x / 2.0), atol=1e-9)


def test_the_separatrix_is_searched_once_for_all_maps(across, monkeypatch):
    exp, record = across
    searches = []
    peaks = separatrix._peaks
    monkeypatch.setattr(separatrix, "_peaks", lambda *a: searches.append(1) or peaks(*a))
    views, _ = samples.views(exp, record, "theta", "omega")
    marked = [view for view in views.values() if "separatrix" in view.picture.caption]
    assert len(marked) >= 3
    # down and across
    assert len(searches) == 2


@pytest.mark.slow
def test_no_separatrix_is_drawn_where_there_is_none():
    sweep = {"initial.theta": {"linspace": [0.1, 2.0, 9]}, "model.g": {"linspace": [1.0, 3.0, 8]}}
    for model in ("pendulum", "linear_pendulum"):
        exp = samples.experiment(sweep=sweep, model={"kind": model}, levels=[6])
        grid = sweep_layout.grid_of(sweep_layout.keys(samples.record(exp)))
        assert not separatrix.with_separatrix(exp, grid).separatrix[0].size
        assert not separatrix.on_line(exp, grid.x).size


def test_the_separatrix_crosses_a_line_once_and_is_searched_once_for_all_curves(monkeypatch):
    exp = samples.experiment(
        initial={"theta": 0.5},
        sweep={"initial.omega": {"linspace": [0.1, 3.0, 20]}},
        levels=[6, 7],
    )
    (found,) = separatrix.on_line(exp, sweep_layout.keys(samples.record(exp))[0])
    assert abs(found - 2.0 * np.cos(0.25)) < 1e-9
    searches, on_line = [], separatrix.on_line
    monkeypatch.setattr(separatrix, "on_line", lambda *a: searches.append(1) or on_line(*a))
    views, _ = samples.views(exp, samples.record(exp), "theta", "omega")
    marked = [view for view in views.values() if "separatrix" in view.picture.caption]
    assert len(marked) >= 3
    assert len(searches) == 1


def test_the_estimated_error_of_the_finest_level_is_the_true_one(across):
    _, record = across
    error = finest_level.error(record, "theta")
    passed = record["theta_status"] == 0
    ratio = (error.estimate / error.true)[passed]
    # the next term of the expansion is smaller by the distance of the order from 2, at most 0.1, times log 2 * 4/3
    assert np.all(np.abs(ratio - 1.0) < 0.1)
    period = finest_level.measured(record, "period")
    true = np.abs(period.value - record["exact_period"])[passed]
    assert np.median(np.abs(period.error[passed] / true - 1.0)) < 0.1


def test_maps_show_verdict_order_error_and_the_separatrix(across):
    exp, record = across
    views, told = samples.views(exp, record, "theta")
    assert "verdict on θ PASS (asymptotic)" in told
    names = {view.name: view.picture for view in views.values()}
    for name in (
        "order of θ", "error bar of the order of θ", "error of θ",
        "estimated over true error of θ", "period", "exact period", "error of the period", "error bar of the period",
        "amplitude", "error bar of the amplitude",
    ):  # fmt: skip
        assert name in names, name
        # one map each, beside its scale
        assert (
            next(ax.get_gid() for ax in names[name].figure.axes if ax.collections) == style.MEMBER
        )
    with style.applied():
        text = samples.svg(names["order of θ"])
    for part in ("initial θ [rad]", "initial ω [rad s⁻¹]"):
        assert part in text, part
    assert "separatrix" in names["order of θ"].caption
    # members that go over the top have no amplitude
    assert "Grey hatched" in names["amplitude"].caption


def test_the_scale_jumps_where_the_tolerance_ends():
    colours = maps.pale_within(0.1)
    shade = {x: np.sum(np.abs(np.subtract(colours(x + 0.5), colours(0.5)))) for x in
             (-0.11, -0.09, 0.09, 0.11)}  # fmt: skip
    assert shade[0.09] < 0.4 < 0.6 < shade[0.11]
    assert shade[-0.09] < 0.4 < 0.6 < shade[-0.11]


def test_a_scale_is_logarithmic_only_over_decades():
    assert maps.limits(np.geomspace(1e-9, 1.0, 50))[2]
    assert not maps.limits(np.linspace(1.0, 10.0, 50))[2]
    assert not maps.limits(np.linspace(-1.0, 1e5, 50))[2]
    low, high, _ = maps.limits(np.zeros(3))
    assert low < 0.0 < high


def test_every_reason_has_a_colour_of_its_own():
    assert set(style.REASON_COLOURS) == set(REASONS)
    assert len(set(style.REASON_COLOURS.values())) == len(REASONS)


@pytest.mark.slow
@pytest.mark.parametrize(("values", "scale"), [([0.1, 300.0], "log"), ([1.0, 1.5], "linear")])
def test_a_sweep_over_decades_has_a_logarithmic_axis(values, scale):
    exp = samples.experiment(sweep={"model.g": {"logspace": [*values, 7]}})
    record = samples.record(exp)
    views, _ = samples.views(exp, record, "theta")
    for view in views.values():
        assert view.picture.figure.axes[0].get_xscale() == scale
        assert view.picture.figure.axes[0].get_xlabel() == "g [m s⁻²]"


def test_keys_that_move_together_are_one_line():
    rows = {"initial.theta": [0.5, 1.0, 1.5, 2.0], "model.g": [8.0, 4.0, 2.0, 1.0]}
    record = samples.record(samples.experiment(sweep={"zip": rows}))
    along = sweep_layout.along_of(sweep_layout.keys(record))
    assert along.key.key == "initial.theta"
    assert [members.tolist() for _, members in along.lines] == [[0, 1, 2, 3]]
    assert sweep_layout.grid_of(sweep_layout.keys(record)) is None


@pytest.fixture(scope="module")
def cloud():
    exp = samples.experiment(sweep=SAMPLE)
    return exp, samples.record(exp)


@pytest.mark.slow
def test_a_sample_of_three_keys_is_shown_against_each(cloud):
    exp, record = cloud
    assert sweep_layout.along_of(sweep_layout.keys(record)) is None
    assert sweep_layout.grid_of(sweep_layout.keys(record)) is None
    views, _ = samples.views(exp, record, "theta")
    assert list(views) == [f"projections_theta_{kind}_0" for kind in ("order", "error")]
    for view in views.values():
        labels = [ax.get_xlabel() for ax in view.picture.figure.axes]
        assert labels == ["initial θ [rad]", "g [m s⁻²]", "L [m]"]


def test_many_members_are_counted_in_cells(cloud, monkeypatch):
    exp, record = cloud
    monkeypatch.setattr(members, "MOST_POINTS", 10)
    views, _ = samples.views(exp, record, "theta")
    drawn = [views[f"projections_theta_{kind}_0"].picture for kind in ("order", "error")]
    for ax in (ax for picture in drawn for ax in picture.figure.axes):
        counts = [np.ma.filled(image.get_array(), 0.0).sum() for image in ax.collections]
        assert sum(counts) == 80
    away = np.nan_to_num(finest_level.deviation(record, "theta")[0], nan=-members.ORDER_FRAME)
    inside = np.clip(away, -members.ORDER_FRAME, members.ORDER_FRAME)
    images = drawn[0].figure.axes[0].collections
    found = sum(np.ma.filled(image.get_array(), 0.0).sum(axis=1) for image in images)
    up = images[0].get_coordinates()[:, 0, 1]
    np.testing.assert_array_equal(found, np.histogram(inside, up)[0])
    assert "Darker cells" in drawn[0].caption


def test_words_that_are_swept_are_written_on_their_axis():
    sweep = {"schemes.central.start": ["centred", "first_order"], "initial.theta": [0.5, 1.0, 2.0]}
    exp = samples.experiment(sweep=sweep)
    record = samples.record(exp)
    along = sweep_layout.along_of(sweep_layout.keys(record))
    assert [name for name, _ in along.lines] == [
        "start of central = centred",
        "start of central = first_order",
    ]
    views, _ = samples.views(exp, record, "theta")
    with style.applied():
        assert "first_order" in samples.svg(views["sweep_order_theta"].picture)


def bare(monkeypatch):
    """Take the exact solution and period of the pendulum away."""
    known = MappingProxyType(
        {
            **MODELS,
            "pendulum": replace(
                MODELS["pendulum"],
                exact=None,
                exact_period=None,
                variant=None,
            ),
        }
    )
    # what was found with them says nothing here
    monkeypatch.setattr(samples, "RECORDS", {})
    monkeypatch.setattr(samples, "SHARED", {})
    for module in [m for n, m in list(sys.modules.items()) if n.startswith("vibsim")]:
        if getattr(module, "MODELS", None) is MODELS:
            monkeypatch.setattr(module, "MODELS", known)


@pytest.mark.slow
def test_without_an_exact_solution_maps_show_the_estimate_and_its_error_bar(monkeypatch):
    bare(monkeypatch)
    monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", 0)
    exp = samples.experiment(sweep=ACROSS, levels=[8, 9, 10, 11], time={"end": 30.0})
    record = samples.record(exp)
    views, _ = samples.views(exp, record, "theta")
    names = {view.name: view.picture for view in views.values()}
    assert "error bar of the error of θ" in names
    assert "estimated over true error of θ" not in names
    title = names["error of θ"].figure.axes[0].get_title(loc="left")
    assert title == "Estimated error of θ (L2 norm) [rad √s]"
    assert not [name for name, picture in names.items() if "separatrix" in picture.caption]
    assert "exact period" not in names
    error = finest_level.error(record, "theta")
    # an interval is stated where something is decided
    stated = np.isfinite(record["theta_order_low"][..., 1])
    assert stated.any()
    assert np.all(error.low[stated] <= error.estimate[stated])
    assert np.all(error.estimate[stated] <= error.high[stated])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sweep", "levels"),
    [
        (ACROSS, [6]),
        (ACROSS, [6, 7]),
        (SAMPLE, [6]),
        ({"model.g": {"logspace": [1.0, 1e4, 9]}}, [6, 7]),
    ],
)
def test_few_levels_make_the_pages_of_a_sweep(tmp_path, sweep, levels):
    exp = samples.experiment(sweep=sweep, levels=levels)
    record = samples.record(exp)
    summary = samples.summary(exp, record)
    report.write(samples.plan(exp), record, summary, tmp_path)
    assert "too_few_levels" in (tmp_path / "tables/members.csv").read_text(encoding="utf-8")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert all(check["reason"] in page for check in summary["checks"])


@pytest.mark.slow
def test_numbers_of_checks_have_maps_unless_they_are_shown_already():
    checks = [
        {"id": "kept", "value": "relative_energy_error", "at": {"level": 9}, "below": 1.0},
        {"value": "period_error", "at": {"level": 9}, "below": 1.0},
        {"value": "max", "quantity": "theta", "at": {"level": 9, "case": 3}, "below": 10.0},
    ]
    exp = samples.experiment(sweep=ACROSS, checks=checks)
    record = samples.record(exp)
    views, _ = samples.views(exp, record, "theta")
    assert [name for name in views if "check" in name] == ["map_check_kept_0"]
    panel = views["map_check_kept_0"].picture.figure.axes[0]
    assert panel.get_title(loc="left") == "Relative energy error at level 9"
    shown = panel.collections[0].get_array().ravel()
    np.testing.assert_array_equal(np.sort(shown), np.sort(record["check_kept_value"][0]))


@pytest.mark.parametrize(
    ("model", "order", "word"),
    [
        ("linear_pendulum", "scheme", "promised"),
        ("linear_pendulum", 2, "promised"),
        ("pendulum", 3, "expected"),
    ],
)
def test_an_order_of_a_part_is_promised_where_theory_has_one(model, order, word):
    """And where it has none, the line stands at the order that the check expects."""
    part = "theta_phase_error"
    checks = [{"converges": part, "order": order}]
    sweep = {"model.g": [1.0, 4.0, 9.0]}
    exp = samples.swept(model={"kind": model}, checks=checks, levels=[8, 9, 10], sweep=sweep)
    record = samples.record(exp)
    views, _ = samples.views(exp, record, part)
    swept = views[f"sweep_order_{part}"].picture
    entries = swept.figure.axes[0].get_legend_handles_labels()[1]
    assert f"{word}, {3 if order == 3 else 2} ± 0.1" in entries
    other = {"promised": "expected", "expected": "promised"}[word]
    for picture in (swept, figures_order.against_step(record, part, 0)):
        assert word in picture.caption
        assert other not in picture.caption


def test_what_is_the_same_for_all_members_is_not_drawn():
    sweep = {"model.g": {"linspace": [1.0, 9.0, 7]}}
    exp = samples.experiment(model={"kind": "linear_pendulum"}, sweep=sweep, levels=[8, 9, 10])
    record = samples.record(exp)
    # the period depends on g, the amplitude of a linear pendulum does not
    record = replace(record, variables=record.variables | {"amplitude": constant(record)})
    views, told = samples.views(exp, record, "theta")
    assert [view.name for view in views.values()] == [
        "period", "error of the period", "order of θ", "error of θ",
    ]  # fmt: skip
    assert told == [
        "amplitude 1 rad",
        "verdict on θ PASS (asymptotic)",
    ]


def constant(record):
    amplitude = record.variables["amplitude"]
    return Variable(amplitude.dims, np.full_like(amplitude.values, 1.0), amplitude.attrs)


def test_a_sweep_of_few_values_is_curves_and_of_more_a_map():
    few = {"initial.theta": [0.5, 1.0, 2.0], "model.g": {"linspace": [1.0, 4.0, 5]}}
    for sweep, is_map in ((few, False), (ACROSS, True)):
        exp = samples.experiment(sweep=sweep)
        views, _ = samples.views(exp, samples.record(exp), "theta")
        assert {name.startswith("map_") for name in views} == {is_map}
        # one panel each; a map has a scale beside it
        for view in views.values():
            assert sum(ax.get_gid() == style.MEMBER for ax in view.picture.figure.axes) == 1


def test_curves_of_a_family_are_told_apart():
    exp = samples.experiment(sweep={"initial.theta": [0.5, 1.0, 2.0], "model.g": [1.0, 4.0]})
    views, _ = samples.views(exp, samples.record(exp), "theta")
    for name in ("sweep_order_theta", "sweep_error_theta", "period", "amplitude"):
        legend = views[name].picture.figure.axes[0].get_legend()
        assert [text.get_text() for text in legend.get_texts()][-2:] == ["1", "4"], name
        assert legend.get_title().get_text() == "g"


def drawn_at(ax, point):
    """Say whether a line of some axes, or the ring on a map, is at a point."""
    points = [np.column_stack(line.get_data()) for line in ax.lines]
    return any(np.isclose(part.astype(float), point).all(axis=1).any() for part in points)


@pytest.mark.parametrize("sweep", [ACROSS, {"initial.theta": {"linspace": [0.1, 3.1, 9]}}, SAMPLE])
def test_what_a_page_holds_of_a_member_is_where_it_is_drawn(sweep):
    exp = samples.experiment(sweep=sweep)
    record = samples.record(exp)
    views, _ = samples.views(exp, record, "theta")
    found = explorer.content(record, list(views.values()))
    json.dumps(found, allow_nan=False)
    start, end = found["command"]
    assert (start, end) == (".venv/bin/vibsim run pendulum_lab/theta@", "")
    assert found["cases"] == record["case"].tolist()
    for name, told in found["views"].items():
        view = views[name]
        axes = [ax for ax in view.picture.figure.axes if ax.get_gid() == style.MEMBER]
        if told["worst"] is None:
            continue
        case = view.worst
        assert found["cases"][told["worst"]] == case
        for ax, (across, up) in zip(axes, told["panels"], strict=True):
            high = (
                (told["places"] or told["values"])[0][case]
                if up is None
                else found["keys"][up]["values"][case]
            )
            # the ring is where the page says that the member is
            assert drawn_at(ax, (found["keys"][across]["values"][case], high)), name
    verdicts = found["verdicts"]["theta"]
    words = [verdicts["texts"][i] for i in verdicts["of"][0]]
    assert words == [f"{REASONS[reason]} ({reason})" for reason in record.flags("theta_reason")[0]]


def test_of_many_members_an_even_part_can_be_pointed_at_and_the_worst():
    x, y = (part.ravel() for part in np.meshgrid(np.linspace(1, 2, 1000), np.linspace(1, 2, 100)))
    keys = [key(x), key(y, "model.L")]
    found = explorer.listed(keys, x.size, 2000, [77_777])
    assert 77_777 in found
    assert 1000 <= found.size <= 2001
    for one in keys:
        # the members of a coarser grid reach from end to end, without a gap
        shown = np.unique(one.values[found])
        assert shown[0] == 1.0
        assert shown[-1] == 2.0
        assert np.diff(shown).max() < 0.04
    cloud = np.random.default_rng(1).uniform(size=(3, 5000))
    few = explorer.listed([key(row, str(i)) for i, row in enumerate(cloud)], 5000, 2000, [])
    assert 1500 <= few.size <= 2000
    assert explorer.listed(keys, 2000, 2000, []).size == 2000


@pytest.mark.slow
def test_curves_of_many_schemes_differ_in_their_dashes_too():
    schemes = ["central", "rk4", "heun", "euler_cromer"]
    sweep = {"initial.theta": {"linspace": [0.1, 2.0, 90]}}
    exp = samples.experiment(sweep=sweep, schemes=schemes, levels=[5, 6, 7])
    views, _ = samples.views(exp, samples.record(exp), "theta")
    for name in ("sweep_order_theta", "sweep_error_theta", "period"):
        lines = views[name].picture.figure.axes[0].lines
        named = [line for line in lines if line.get_label() in schemes]
        assert len({str(line._unscaled_dash_pattern) for line in named}) == len(named) == 4, name


def test_a_curve_that_goes_up_and_down_is_drawn_in_its_order():
    """Members that follow each other make one line with both branches; a list out of order is sorted as before."""
    up_and_down = key([1.0, 2.0, 3.0, 2.0, 1.0], "model.omega")
    assert sweep_layout.along_of([up_and_down]).lines[0][1].tolist() == [0, 1, 2, 3, 4]
    assert sweep_layout.along_of([key([2.0, 3.0, 1.0])]).lines[0][1].tolist() == [2, 0, 1]
    both = [key([0.5] * 5 + [1.0] * 5, "model.gamma"), key([1, 2, 3, 2, 1] * 2, "model.omega")]
    lines = sweep_layout.along_of(both).lines
    assert [row[1].tolist() for row in lines] == [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9]]


def test_a_path_that_is_followed_is_a_line_up_and_a_line_down_with_their_directions():
    """Without a name for each way a reader cannot see the hysteresis; the values need not repeat."""
    up, down = sweep_layout.UP, sweep_layout.DOWN
    for values in ([1.0, 2.0, 3.0, 2.0, 1.0], [1.0, 2.0, 3.0, 2.5, 1.5]):
        lines = sweep_layout.along_of([key(values)], "model.g").lines
        found = [(name, members.tolist()) for name, members in lines]
        assert found == [(up, [0, 1, 2]), (down, [2, 3, 4])]
    (line,) = sweep_layout.along_of([key([3.0, 2.0, 1.0])], "model.g").lines
    assert (line[0], line[1].tolist()) == ("", [0, 1, 2])
    # the key that is followed runs along the axis, also where another has more values
    both = [key([1, 1, 1, 2, 2, 2, 3, 3, 3], "model.b"), key([1, 2, 1] * 3, "model.g")]
    along = sweep_layout.along_of(both, "model.g")
    assert along.key.key == "model.g"
    assert [name for name, _ in along.lines] == [
        f"b = {b}, {way}" for b in (1, 2, 3) for way in (up, down)
    ]


def test_both_ways_of_a_followed_path_are_in_the_legends():
    exp = samples.experiment(
        model={"kind": "duffing", "delta": 0.1, "alpha": 1.0, "beta": 0.04, "gamma": 1.0, "omega": 1.0},
        initial={"u": 0.0, "v": 0.0}, levels=[1, 2, 3], schemes=["rk4"],
        time={"periods": 4, "steps_per_period": 16, "frequency": "model.omega"},
        sweep={"follow": "model.omega", "model.omega": [1.0, 1.1, 1.2, 1.1, 1.0]},
    )  # fmt: skip
    record = samples.record(exp)
    lead = choice.find_lead(record, {"checks": []})
    ways = [record.case_name(case).partition(" on the ")[2] for case in range(5)]
    assert ways == ["way up", "way up", "", "way down", "way down"]
    with style.applied():
        drawn = [
            hero.response(lead),
            *(v.picture for v in samples.views(exp, record, "u")[0].values()),
        ]
        for picture in drawn:
            if "verdict" not in picture.name:
                legend = picture.figure.axes[0].get_legend()
                texts = [text.get_text() for text in legend.get_texts()]
                assert {sweep_layout.UP, sweep_layout.DOWN} <= set(texts), picture.name


@pytest.mark.parametrize("other", [2e-9, 1.00001e-9])
def test_a_tiny_number_has_its_power_of_ten_in_the_label(other):
    """It stood over the title. Labels of ticks differ, however near the values are."""
    exp = samples.experiment(sweep={"initial.theta": [1e-9, other]})
    views, _ = samples.views(exp, samples.record(exp), "theta")
    ax = views["amplitude"].picture.figure.axes[0]
    ax.figure.draw_without_rendering()
    assert ax.get_ylabel() == "amplitude [10⁻⁹ rad]"
    assert ax.yaxis.get_major_formatter().get_offset() == ""
    ticks = [text.get_text() for text in ax.get_yticklabels()]
    assert len(set(ticks)) == len(ticks)


def test_the_power_of_ten_is_that_of_the_values_within_the_frame():
    """One member blows up to 10^26, and leaves the frame."""
    exp = samples.experiment(
        name="u",
        **{"model": {"kind": "spring"}, "initial": {"u": 1.0}, "sweep": {"model.w": [1.0, 1.1, 1.2, 1.3, 8.0]}},
        **{"schemes": ["forward_euler"], "levels": [4, 5, 6]},
    )  # fmt: skip
    views, _ = samples.views(exp, samples.record(exp), "u")
    assert views["amplitude"].picture.figure.axes[0].get_ylabel() == "amplitude [m]"
