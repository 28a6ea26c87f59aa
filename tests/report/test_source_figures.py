"""Figures of the source texts: each one of the list has its page, and what it shows is what the text shows."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import samples
import yaml
from markupsafe import Markup

from vibsim import report
from vibsim.experiment import Experiment
from vibsim.experiment.schema.figures import KINDS
from vibsim.report import choice, style
from vibsim.report.figures import accuracy, of_source
from vibsim.report.page import page_figures, player, sources

ROOT = Path(__file__).parents[2]
CONFIGS = ROOT / "configs"
ROW = re.compile(r"\| ([^|`]+) \| `(\w+)` \| \[([\w/]+)\]\(\.\./configs/([\w/]+)\.yaml\) \|")
LISTED = ROW.findall((ROOT / "docs/figures.md").read_text(encoding="utf-8"))
TEXTS = [
    *(f"vibration text, figure {i}" for i in range(1, 18)),
    *(f"vibration text, section {part}" for part in ("3.3", "10.6")),
    *(f"vibration text, exercise {part}" for part in ("7", "18 b", "19 a", "20", "21 b", "22 a")),
    *(f"pendulum lecture, section{part}" for part in ("s 2.1 and 2.5", " 1.1", " 2.5", " 2.6")),
]
"""The figures of the two texts that show data or sketch a system, and what exercises ask to draw."""


def test_the_list_says_what_the_experiments_ask_for() -> None:
    in_files = {
        (figure["source"], figure["shows"], f"{path.parent.name}/{path.stem}")
        for path in CONFIGS.glob("*/*.yaml")
        for figure in yaml.safe_load(path.read_text(encoding="utf-8")).get("figures", [])
    }
    assert {row[:3] for row in LISTED} == in_files
    assert all(name == target for _, _, name, target in LISTED)
    assert len(LISTED) == len(in_files)


def test_every_figure_of_the_texts_is_on_a_page() -> None:
    assert {*TEXTS} <= {row[0] for row in LISTED}


def drawn(exp: Experiment) -> tuple[list, list[str]]:
    record = samples.record(exp)
    decisive = choice.find_lead(record, samples.summary(exp, record))
    with style.applied():
        found = of_source.pictures(decisive)
    has_player = bool(player.element(record))
    return found, of_source.undrawn(found, has_player=has_player)


SPRING = {"model": {"kind": "spring", "w": 2.0}, "initial": {"u": 1.0}, "time": {"end": 10.0}}


def spring(*figures: dict, **changes) -> Experiment:
    asked = [{"source": "a text, figure 1", **figure} for figure in figures]
    return samples.experiment(**(SPRING | {"figures": asked, "checks": []} | changes))


def lines(picture) -> list[list[tuple[str, np.ndarray, np.ndarray]]]:
    """Return the named curves of every panel."""
    return [
        [(line.get_label(), *(np.asarray(part, float) for part in line.get_data())) for line in ax.lines]
        for ax in picture.figure.axes
    ]  # fmt: skip


def test_every_kind_draws_or_says_that_it_cannot() -> None:
    kinds = [{"shows": kind} for kind in KINDS]
    time = {"periods": 3, "steps_per_period": 1, "frequency": "model.w"}
    found, undrawn = drawn(spring(*kinds, levels=[6, 7, 8], time=time))
    cannot = {asked.shows for asked, pictures in found if not pictures} - {"player"}
    assert cannot == {"path", "growth"}
    assert undrawn == ["A text, figure 1"] * 2
    for asked, pictures in found:
        for picture in pictures:
            assert picture.title.startswith("A text, figure 1: "), asked.shows


def test_levels_schemes_and_the_exact_solution_share_panels() -> None:
    exp = spring(
        {"shows": "over_time", "panels": "level", "until": 5.0},
        levels=[4, 5],
        schemes=["central", "rk4"],
    )
    ((_, [picture]),), _ = drawn(exp)
    panels = lines(picture)
    assert [[text for text, *_ in panel] for panel in panels] == [["exact", "central", "rk4"]] * 2
    for panel in panels:
        _, t, exact = panel[0]
        # also where a scheme has few points in a period
        assert t.size > 300
        assert exact == pytest.approx(np.cos(2.0 * t), abs=1e-12)
        assert t[-1] == panel[1][1][-1] == pytest.approx(5.0)
    coarse, fine = (np.max(np.abs(panel[1][2] - np.cos(2.0 * panel[1][1]))) for panel in panels)
    assert coarse > 3.0 * fine


def test_small_numbers_have_their_power_of_ten_beside_the_unit() -> None:
    figure = {"source": "x", "shows": "over_time", "quantities": ["theta", "energy_deviation"]}
    ((_, (picture,)),), _ = drawn(
        samples.experiment(levels=[10, 11], schemes=["central"], figures=[figure])
    )
    angle, energy = picture.figure.axes
    assert angle.get_ylabel() == "θ [rad]"
    assert energy.get_ylabel() == "ΔE [10⁻⁵ J]"
    ticks = energy.yaxis.get_major_formatter()
    assert not ticks.get_offset()
    assert max(abs(float(text.replace("−", "-"))) for text in map(ticks, energy.get_yticks())) >= 1


def test_the_energy_of_a_structure_is_drawn_without_an_exact_one() -> None:
    """It is that of all degrees of freedom, and an exact solution has those that are observed."""
    model = {"kind": "structure", "stiffness": [[2, -1], [-1, 1]], "load": {"2": "cos(t)"}}
    changes = {"model": model, "initial": {"u1": 1.0}, "schemes": ["newmark"], "levels": [6, 7]}
    figure = {"shows": "over_time", "quantities": ["u2", "energy"]}
    ((_, [picture]),), _ = drawn(spring(figure, **changes))
    position, energy = lines(picture)
    assert len(position) == len(energy) + 1


def test_what_is_not_stored_follows_from_the_states() -> None:
    names = ["u", "kinetic_energy", "potential_energy", "energy"]
    ((_, [picture]),), _ = drawn(spring({"shows": "over_time", "quantities": names}, levels=[7, 8]))
    (_, kinetic, potential, energy) = (panel[-1][2] for panel in lines(picture))
    assert kinetic + potential == pytest.approx(energy, rel=1e-12)
    assert lines(picture)[1][0][2][0] == 0.0
    assert picture.figure.axes[0].get_ylabel() == "u [m]"


def test_members_are_divided_into_figures_and_panels() -> None:
    sweep = {"model.w": [1.0, 2.0, 3.0], "initial.u": [1.0, 2.0]}
    figure = {
        "shows": "over_time",
        "each": "initial.u",
        "panels": "model.w",
        "beside": {"one": "w*t"},
    }
    ((_, pictures),), _ = drawn(spring(figure, sweep=sweep, levels=[5, 6]))
    assert [picture.title.rpartition(", ")[2] for picture in pictures] == [
        "initial u = 1 m",
        "initial u = 2 m",
    ]
    titles = [ax.get_title(loc="left") for ax in pictures[0].figure.axes]
    assert titles == [f"w = {w} rad s⁻¹" for w in (1, 2, 3)]
    _, t, line = lines(pictures[1])[2][-1]
    assert line == pytest.approx(3.0 * t)


def test_what_is_left_out_is_said() -> None:
    figure = {"shows": "over_time", "quantities": ["energy_deviation"]}
    ((_, [picture]),), _ = drawn(spring(figure, levels=[5, 6]))
    assert "are drawn" not in picture.caption
    # its exact value is zero, which is no measure for what leaves the frame
    assert np.isfinite(lines(picture)[0][-1][2]).all()
    ((_, [picture]),), _ = drawn(
        spring({"shows": "over_time"}, sweep={"model.w": {"linspace": [1, 2, 9]}}, levels=[5, 6])
    )
    assert "7 runs in a panel" in picture.caption
    names = [name for name, *_ in lines(picture)[0]]
    assert len(names) == 7
    assert names[-1] == "w = 2 rad s⁻¹"


def test_a_velocity_that_jumps_has_gaps_and_the_position_none() -> None:
    exp = samples.experiment(
        model={"kind": "bouncing_ball"}, initial={"h": 1.0}, time={"end": 8.0}, levels=[5, 6], schemes=["rk4"],
        checks=[], figures=[{"source": "a", "shows": "over_time", "quantities": ["h", "v"]}],
    )  # fmt: skip
    ((_, [picture]),), _ = drawn(exp)
    height, velocity = (panel[0][2] for panel in lines(picture))
    assert np.isfinite(height).all()
    gaps = np.flatnonzero(np.isnan(velocity))
    assert gaps.size >= 2
    assert (velocity[gaps - 1] < 0.0).all()
    assert (velocity[gaps + 1] >= 0.0).all()
    # between grid points lies an impact, which no line crosses
    assert all(line.get_linestyle() == "None" for line in picture.figure.axes[0].lines[1:])


def test_the_frequency_found_in_a_solution_is_that_of_the_scheme() -> None:
    exp = spring({"shows": "local_frequency"}, levels=[6, 7], time={"end": 20.0})
    ((_, [picture]),), _ = drawn(exp)
    frequency, amplitude = lines(picture)
    for k, steps in enumerate((64, 128)):
        name, number, found = frequency[k]
        dt = 20.0 / steps
        assert name == f"dt = {dt:g} s"
        assert number[0] == 1.0
        assert found == pytest.approx(2.0 / dt * np.arcsin(dt), rel=3e-3)
    assert frequency[-1][2] == pytest.approx(2.0)
    assert amplitude[-1][2] == pytest.approx(1.0)
    assert picture.figure.axes[0].get_ylabel() == "angular frequency [rad s⁻¹]"


def test_no_exact_amplitude_is_drawn_where_damping_makes_it_fall() -> None:
    model = {"kind": "oscillator", "spring": "u", "damping": {"linear": 0.2}}
    exp = spring({"shows": "local_frequency"}, model=model, levels=[6, 7], time={"end": 20.0})
    ((_, [picture]),), _ = drawn(exp)
    names = [name for name, *_ in lines(picture)[1]]
    assert len(names) == 2
    assert "exact" not in names


def test_the_frequency_lies_on_its_formula_and_the_series_touches_it() -> None:
    exp = spring(
        {"shows": "frequency"},
        model={"kind": "spring", "w": 1.0},
        time={"end": 64.0},
        levels=[6, 7, 8],
    )
    ((_, [picture]),), _ = drawn(exp)
    ((_, *_), (name, p, curve), (series, _, approximation), (_, places, measured)) = lines(picture)[
        0
    ]
    assert (name, series) == ("central", "1 + (w dt)²/24")
    assert curve == pytest.approx(2.0 * np.arcsin(p / 2.0) / p, rel=1e-9)
    assert approximation == pytest.approx(1.0 + p**2 / 24.0, rel=1e-6)
    assert measured == pytest.approx(2.0 * np.arcsin(places / 2.0) / places, rel=1e-3)


def test_the_first_term_of_a_series_is_written_as_a_fraction() -> None:
    start = np.array([0.5, 1.0]) * accuracy.SMALL
    assert accuracy._leading_term(-(start**4) / 120.0)[1] == "1 − (w dt)⁴/120"
    assert accuracy._leading_term(5.0 * start**2 / 12.0)[1] == "1 + 5 (w dt)²/12"
    assert accuracy._leading_term(np.zeros(2)) is None


def test_the_second_difference_is_measured_on_its_formula() -> None:
    sweep = {"model.w": [0.5, 2.0, 3.0]}
    exp = spring(
        {"shows": "second_difference"},
        sweep=sweep,
        time={"end": 32.0, "base_dt": 1.0},
        levels=[0, 1],
    )
    ((_, [picture]),), _ = drawn(exp)
    _, p, measured = lines(picture)[0][-1]
    assert p == pytest.approx([0.5, 2.0, 3.0])
    assert measured == pytest.approx((2.0 / p * np.sin(p / 2.0)) ** 2, rel=1e-9)


def test_parameters_of_the_users_own_go_by_their_names_in_formulas() -> None:
    model = {
        "kind": "oscillator",
        "m": 2.0,
        "damping": {"linear": 0.2},
        "spring": "k*u",
        "parameters": {"k": 8.0},
    }
    exp = spring(
        {"shows": "over_time", "quantities": ["potential_energy"]},
        {"shows": "over_time", "beside": {"decay": "exp(-b*t/(2*m))"}},
        {"shows": "spring"},
        model=model, levels=[6, 7],
    )  # fmt: skip
    ((_, [energy]), (_, [motion]), (_, [force])), _ = drawn(exp)
    ((*_, (_, _, stored)),) = lines(energy)
    assert stored.max() == pytest.approx(4.0)
    ((*_, (_, t, decay)),) = lines(motion)
    np.testing.assert_allclose(decay, np.exp(-0.05 * t))
    (((_, u, pull),),) = lines(force)
    np.testing.assert_allclose(pull, 8.0 * u)


def test_springs_of_members_are_their_own() -> None:
    exp = samples.experiment(
        model={"kind": "sliding_box", "mu": 0.01}, initial={"u": 1.0}, time={"end": 8.0}, levels=[6, 7],
        schemes=["rk4"], sweep={"model.alpha": [0.0, 2.0]}, checks=[], figures=[{"source": "a", "shows": "spring"}],
    )  # fmt: skip
    ((_, [picture]),), _ = drawn(exp)
    (_, u, linear), (_, _, yielding) = lines(picture)[0]
    assert linear == pytest.approx(u)
    assert yielding == pytest.approx(np.tanh(2.0 * u) / 2.0)
    assert u[-1] == pytest.approx(1.0)


@pytest.mark.usefixtures("unrendered")
def test_the_page_the_table_and_the_index_name_the_figures(tmp_path) -> None:
    exp = spring(
        {"shows": "phase_plane"},
        {"shows": "player", "source": "a text, figure 12"},
        levels=[5, 6, 7],
    )
    record, folder = samples.record(exp), tmp_path / "pendulum_lab/theta"
    summary = samples.summary(exp, record)
    report.write(samples.plan(exp), record, summary, folder)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert re.search(r'<figure id="phase_plane_0">\s*<h3>A text, figure 1: Phase plane', page)
    # it is not drawn a second time below
    assert page.count('id="phase_plane_0"') == 1
    assert "A text, figure 12: in motion" in page
    (folder / "summary.json").write_text("{}")
    found = sources.figures(tmp_path, [folder, tmp_path / "a/missing"])
    assert [(figure, [(p.name, p.link) for p in places]) for figure, places in found] == [
        ("a text, figure 1", [("theta", "pendulum_lab/theta/report.html#phase_plane_0")]),
        ("a text, figure 12", [("theta", "pendulum_lab/theta/report.html#player")]),
    ]
    rows = "figure,shows,place\nfigure 10,path,a\nfigure 2,path,b\nfigure 2,path,c\n,path,d\nfigure 3,path,\n"
    (folder / sources.FIGURES).write_text(rows)
    found = sources.figures(tmp_path, [folder])
    assert [(figure, [p.link[-2:] for p in places]) for figure, places in found] == [
        ("figure 2", ["#b"]),
        ("figure 10", ["#a"]),
    ]
    (folder / sources.FIGURES).write_bytes(b"\xff\x00")
    assert sources.figures(tmp_path, [folder]) == []


def test_a_spectrum_shows_the_frequency_that_theory_knows() -> None:
    exp = spring({"shows": "spectrum"}, time={"end": 100.0, "base_dt": 0.25}, levels=[0, 1])
    ((_, [picture]),), _ = drawn(exp)
    curves = lines(picture)[0]
    places = {name: x for name, x, _ in curves if len(x) == 2}
    assert places["natural"][0] == pytest.approx(2.0)
    for level, dt in enumerate((0.25, 0.125)):
        assert places[f"theory, level {level}"][0] == pytest.approx(2.0 / dt * np.arcsin(dt))
    _, w, amplitudes = curves[0]
    assert w[np.argmax(amplitudes)] == pytest.approx(2.02, abs=2.0 * np.pi / 100.0)


@pytest.mark.slow
def test_a_poincare_section_has_a_point_a_period() -> None:
    exp = samples.experiment(
        model={"kind": "duffing", "delta": 0.3, "gamma": 0.2, "omega": 1.2}, initial={"u": 1.0},
        time={"periods": 20, "steps_per_period": 16, "frequency": "model.omega"}, levels=[0, 1], schemes=["rk4"],
        sweep={"model.gamma": [0.2, 0.3]}, checks=[], figures=[{"source": "a", "shows": "poincare"}],
    )  # fmt: skip
    ((_, [picture]),), _ = drawn(exp)
    for panel in lines(picture)[:2]:
        ((_, u, v),) = panel
        assert u.size == v.size == 10, (
            "the beginnings of the last ten periods, without the end of the run"
        )
        assert np.ptp(u[-3:]) < 0.1 * np.max(np.abs(u))


@pytest.mark.parametrize("every", [32, 20])
def test_a_poincare_section_is_left_out_without_samples_of_every_period(every: int) -> None:
    """Of 10 or 16 samples in 20 periods it had no step, or one that is no period."""
    exp = samples.experiment(
        model={"kind": "duffing", "delta": 0.3, "gamma": 0.2, "omega": 1.2}, initial={"u": 1.0},
        time={"periods": 20, "steps_per_period": 16, "frequency": "model.omega"}, levels=[0, 1], schemes=["rk4"],
        samples={"every": every}, checks=[], figures=[{"source": "a", "shows": "poincare"}],
    )  # fmt: skip
    ((_, pictures),), _ = drawn(exp)
    assert not pictures


def test_a_picture_that_the_source_explains_is_not_explained_again() -> None:
    def shown(title: str, caption: str) -> page_figures.Shown:
        return style.Picture(title, title, caption, "", None), Markup("")

    above = [shown("lecture, section 2.5: Do the levels agree? u", "long")]
    below = [
        shown("Do the levels agree? v", "as long"),
        shown("Phase plane", "other"),
        shown("Steps", ""),
    ]
    assert page_figures._captions(below, above) == [
        ("Do the levels agree?", page_figures.SEEN),
        ("Phase plane", "other"),
    ]
