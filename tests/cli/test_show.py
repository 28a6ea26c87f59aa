"""``vibsim show``: what was found, and a plot that a terminal of any width can show."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from vibsim import store
from vibsim.cli import main
from vibsim.cli.line_plot import Series, draw
from vibsim.core.record import Record, Variable, attributes

from .conftest import Made

Capture = pytest.CaptureFixture[str]


def series(count: int = 401, period: float = 1.0, end: float = 4.0, exact: bool = True) -> Series:
    t = np.linspace(0.0, end, count)
    values = np.cos(2 * np.pi * t)
    return Series("u", "m", t, 0.5 * values, values if exact else None, period)


def test_time_runs_down_with_a_symbol_each_and_a_counter_of_periods() -> None:
    lines = draw(series(), 24 + 41, 21).lines
    assert len(lines) == 22
    first, half, whole = lines[1], lines[11], lines[21]
    # 41 columns from -1 to 1: the axis is in the middle
    assert first[12:] == " " * 20 + "|" + " " * 9 + "+" + " " * 9 + "o  0.00"
    assert half[12:] == "o" + " " * 9 + "+" + " " * 9 + "|" + " " * 20 + "  0.50"
    assert whole.endswith("1.00")
    assert whole[12:-4] == first[12:-4]


def test_both_solutions_in_one_column_have_a_symbol_of_their_own() -> None:
    one = series()
    lines = draw(one._replace(values=one.exact), 80, 20).lines[1:]
    assert all("*" in line and "+" not in line and "o" not in line for line in lines)
    lines = draw(one._replace(exact=None), 80, 20).lines[1:]
    assert all("+" in line and "o" not in line for line in lines)


@pytest.mark.parametrize("columns", [1, 20, 80, 10_000])
def test_no_width_breaks_a_line(columns: int) -> None:
    drawing = draw(series(), columns, 50)
    assert max(map(len, drawing.lines)) <= max(columns, 40)
    assert len({line[12:].find("|") for line in drawing.lines[1:] if "|" in line}) == 1


def test_a_long_run_keeps_its_lines_a_period() -> None:
    """Lines that are spread over 1000 periods would show an oscillation that there is not."""
    drawing = draw(series(200_001, end=1000.0), 80, 100)
    assert drawing.shown.step == 10
    assert drawing.shown == range(0, 1000, 10)
    later = draw(series(200_001, end=1000.0), 80, 20, start=990.0)
    assert later.lines[1].split()[0] == "990"
    assert later.lines[1].endswith("990.00")


def test_without_a_period_the_lines_are_spread_over_the_whole_run() -> None:
    drawing = draw(series(period=math.nan), 80, 40)
    assert drawing.shown == range(0, 401, 11)
    assert "periods" not in drawing.lines[0]


def test_what_broke_down_is_told_and_the_rest_is_drawn() -> None:
    one = series()
    values = one.values.copy()
    values[20:] = np.inf
    lines = draw(one._replace(values=values, exact=None), 80, 10).lines[1:]
    assert [("not finite" in line) for line in lines] == [False] * 4 + [True] * 6
    nothing = draw(one._replace(values=np.full_like(values, np.nan), exact=None), 80, 10)
    assert all(line.endswith("not finite") for line in nothing.lines[1:])


def test_a_constant_and_a_start_behind_the_end_are_drawn() -> None:
    one = series()
    assert draw(one._replace(values=np.zeros(401), exact=None), 80, 10).lines[1].count("+") == 1
    assert len(draw(one, 80, 10, start=5.0).lines) == 1


def test_the_plot_is_followed_by_the_verdicts(made: Made, capsys: Capture) -> None:
    assert made.vibsim("show", made.file, "--rows", 5) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "adhoc/small, level 8, scheme rk4: + theta, o exact, * both"
    assert lines[1].split()[-1] == "periods"
    assert lines[2].endswith("0.00")
    assert lines[7].startswith("  to t = 1.25 of 20; see more with --from 1.25")
    assert lines[9] == "adhoc/small  FAIL"
    assert lines[10].startswith("  PASS  asymptotic  order  Both results passed.")


def test_of_a_sweep_the_member_that_decides_is_drawn_on_what_the_screen_has_room_for(
    made: Made, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    made.change("linear_pendulum", "pendulum")
    made.change("checks:", "sweep: {model.drag: [0.3, 0.0]}\nchecks:")
    made.make()
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("LINES", "30")
    capsys.readouterr()
    assert made.vibsim("show", made.file) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("adhoc/small, level 8, member 1 (model.drag = 0), scheme rk4: ")
    # a computed solution is not called exact
    assert lines[0].endswith("o reference, * both")
    assert len(lines) < 30
    assert "case 1 (model.drag = 0)" in " ".join(map(str.strip, lines[-8:]))


def test_what_is_drawn_can_be_chosen(made: Made, capsys: Capture) -> None:
    chosen = ("--quantity", "omega", "--scheme", "rk4", "--level", 6)
    assert made.vibsim("show", made.file, *chosen) == 0
    assert "adhoc/small, level 6, scheme rk4: + omega" in capsys.readouterr().out
    assert made.vibsim("show", made.file, "--no-plot") == 0
    assert "level 8" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("option", "told"),
    [
        (
            ("--quantity", "thet"),
            "--quantity: thet: is not in this experiment: did you mean 'theta'?",
        ),
        (("--scheme", "rk5"), "did you mean 'rk4'?"),
        (("--level", 9), "--level: 9: must be one of 6, 7, 8"),
        (("--case", 1), "--case: 1: must be from 0 to 0"),
    ],
)
def test_what_there_is_not_is_refused(
    made: Made, capsys: Capture, option: tuple[str, object], told: str
) -> None:
    assert made.vibsim("show", made.file, *option) == 2
    assert told in capsys.readouterr().err


def test_a_member_with_an_end_of_its_own_has_its_own_times(made: Made, capsys: Capture) -> None:
    made.change("checks:", "sweep: {time.end: [10.0, 40.0]}\nchecks:")
    assert made.vibsim("simulate", made.file, "--level", 6) == 0
    # of 64 steps every second one, or each, for at most 20 lines in a period of 6.3 s
    for case, end, step in ((0, 10, 10 / 32), (1, 40, 40 / 64)):
        capsys.readouterr()
        assert made.vibsim("show", made.file, "--case", case, "--rows", 3) == 0
        shown = capsys.readouterr().out
        assert f" of {end}; see more" in shown
        assert shown.startswith(f"adhoc/small, level 6, member {case} (time.end = {end}), scheme ")
        times = [float(line.split()[0]) for line in shown.splitlines()[2:5]]
        assert times == pytest.approx([0.0, step, 2 * step], rel=1e-4)


def test_a_run_in_progress_shows_what_there_is(made: Made, capsys: Capture) -> None:
    for name in ("level_08.nc", "convergence.nc", "summary.json"):
        (made.small / name).unlink()
    assert made.vibsim("show", made.file) == 0
    shown = capsys.readouterr().out
    assert "adhoc/small, level 7, scheme central" in shown
    assert "levels 6 to 7 are there, of levels 6 to 8; the others are not made yet" in shown
    assert "there are no verdicts yet" in shown


def test_no_results_yet_a_collection_and_an_unknown_name(made: Made, capsys: Capture) -> None:
    other = made.file.with_name("my other.d") / "other.yaml"
    other.parent.mkdir()
    other.write_text(made.file.read_text())
    assert made.vibsim("show", other) == 1
    assert f"there are no results yet: .venv/bin/vibsim run '{other}'" in capsys.readouterr().err
    assert made.vibsim("show", "pendulum_lab") == 2
    assert made.vibsim("show", "theta_convergense") == 2
    assert "did you mean 'theta_convergence'?" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["level_08.nc", "summary.json"])
def test_a_damaged_result_is_named_and_not_shown(made: Made, capsys: Capture, name: str) -> None:
    content = bytearray((made.small / name).read_bytes())
    content[len(content) // 2] ^= 1
    (made.small / name).write_bytes(content)
    assert made.vibsim("show", made.file) == 1
    captured = capsys.readouterr()
    assert f"{name}: " in captured.err
    assert "Traceback" not in captured.err


def test_results_of_an_earlier_version_are_shown_as_such(made: Made, capsys: Capture) -> None:
    made.change("theta: 1.0", "theta: 1.1")
    assert made.vibsim("show", made.file) == 0
    assert "made before the experiment or vibsim changed" in capsys.readouterr().out


def test_a_file_of_a_level_is_drawn_alone(made: Made, capsys: Capture) -> None:
    assert main(["show", str(made.small / "level_07.nc")]) == 0
    shown = capsys.readouterr().out
    assert "level_07.nc, scheme central: + theta, o exact" in shown
    assert "PASS" not in shown
    assert main(["show", str(made.small / "level_07.nc"), "--case", "1"]) == 2
    assert main(["show", str(made.small / "level_09.nc")]) == 1
    # it has numbers of every level where a level has one
    assert main(["show", str(made.small / "convergence.nc")]) == 0


@pytest.mark.parametrize("dim", ["case", "x"])
def test_a_file_without_series_says_so(tmp_path: Path, capsys: Capture, dim: str) -> None:
    path = tmp_path / "level_01.nc"
    places = Variable((dim,), np.arange(2), attributes(dim, "1"))
    end = Variable((dim,), np.ones(2), attributes("end", "m"))
    record = Record({dim: places}, {"end": end}, {"title": "ends alone"})
    store.write(path, record, digest="0" * 64, provenance={})
    assert main(["show", str(path)]) == 0
    assert "it has no series over time that could be drawn" in capsys.readouterr().out
