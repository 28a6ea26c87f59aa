"""``vibsim movie``: the frames that were asked for, the same every time, and a clear answer where there are none."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image

from vibsim.cli import main
from vibsim.cli.commands.movie import MOST_GIF_FRAMES

from .conftest import Made

Capture = pytest.CaptureFixture[str]


def pixels(path: Path) -> Any:
    """Return a frame, shape (row, column, 3)."""
    with Image.open(path) as image:
        return np.asarray(image, dtype=np.int64)


def counted(path: Path) -> int:
    """Return how many frames a movie has."""
    if path.suffix == ".gif":
        with Image.open(path) as image:
            return int(getattr(image, "n_frames", 1))
    with av.open(str(path)) as container:
        return sum(1 for _ in container.decode(video=0))


@pytest.mark.slow
@pytest.mark.parametrize("form", ["mp4", "webm", "gif"])
def test_a_movie_has_its_frames_and_the_same_bytes_every_time(
    made: Made, tmp_path: Path, form: str
) -> None:
    one, two = (tmp_path / f"{name}.{form}" for name in ("one", "two"))
    for path in (one, two):
        assert made.vibsim("movie", made.file, "--frames", 7, "--fps", 5, "--output", path) == 0
    assert one.read_bytes() == two.read_bytes()
    assert counted(one) == 7
    if form == "gif":
        with Image.open(one) as image:
            assert image.info["duration"] == 200
    else:
        with av.open(str(one)) as container:
            assert container.streams.video[0].average_rate == 5


@pytest.mark.slow
def test_frames_are_numbered_and_those_of_a_longer_movie_stay(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "frames"
    assert made.vibsim("movie", made.file, "--frames", 5, "--frames-to", folder) == 0
    names = [f"frame_{k:04d}.png" for k in range(5)]
    assert sorted(path.name for path in folder.iterdir()) == names
    first = (folder / "frame_0000.png").read_bytes()
    assert made.vibsim("movie", made.file, "--frames", 5, "--frames-to", folder) == 0
    assert (folder / "frame_0000.png").read_bytes() == first
    capsys.readouterr()
    assert made.vibsim("movie", made.file, "--frames", 3, "--frames-to", folder) == 2
    assert "choose an empty folder" in capsys.readouterr().err
    assert sorted(path.name for path in folder.iterdir()) == names


@pytest.mark.slow
def test_of_a_sweep_the_member_that_decides_is_shown(made: Made, tmp_path: Path) -> None:
    """It was the first member, whatever the verdict was on."""
    made.change("linear_pendulum", "pendulum")
    made.change("checks:", "sweep: {model.drag: [0.3, 0.0]}\nchecks:")
    made.make()
    first = {}
    for name, case in {"default": (), "0": ("--case", 0), "1": ("--case", 1)}.items():
        folder = tmp_path / name
        assert made.vibsim("movie", made.file, *case, "--frames", 2, "--frames-to", folder) == 0
        first[name] = (folder / "frame_0001.png").read_bytes()
    assert first["default"] == first["1"] != first["0"]


@pytest.mark.slow
def test_the_drawing_moves_as_the_level_file_says(made: Made, tmp_path: Path) -> None:
    asked = ("--scheme", "rk4", "--level", 8, "--frames", 9, "--frames-to", tmp_path)
    assert made.vibsim("movie", made.file, *asked) == 0
    theta = np.cos(np.linspace(0.0, 20.0, 9))  # g = L = 1
    places = []
    for k in range(9):
        frame = pixels(tmp_path / f"frame_{k:04d}.png")
        # the bob: the only thing in the upper half in this colour
        bob = np.all(np.abs(frame[: frame.shape[0] // 2] - (31, 58, 147)) < 12, axis=2)
        places.append(np.nonzero(bob)[1].mean())
    swing = np.polyfit(np.sin(theta), places, 1)
    assert np.abs(np.polyval(swing, np.sin(theta)) - places).max() < 2.0
    assert swing[0] > 100.0


@pytest.mark.slow
def test_two_runs_stand_side_by_side_and_one_alone_where_one_is_named(
    made: Made, tmp_path: Path
) -> None:
    def columns(*asked: object) -> list[bool]:
        """Say of the left and of the right half of the drawing whether a body is there."""
        assert made.vibsim("movie", made.file, *asked, "--frames", 1, "--frames-to", tmp_path) == 0
        frame = pixels(tmp_path / "frame_0000.png")
        body = np.all(np.abs(frame[: frame.shape[0] // 2] - (31, 58, 147)) < 12, axis=2)
        middle = frame.shape[1] // 2
        return [int(half.sum()) > 200 for half in (body[:, :middle], body[:, middle:])]

    assert columns("--scheme", "central", "rk4") == [True, True]
    assert columns("--level", 6, 8, "--scheme", "rk4") == [True, True]
    # the bob of one pendulum alone hangs to the right at first
    assert columns("--scheme", "rk4") == [False, True]


def test_without_options_a_coarse_level_that_differs_visibly_stands_beside(
    made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert made.vibsim("movie", made.file, "--frames", 2) == 0
    assert counted(tmp_path / "small.mp4") == 2
    assert capsys.readouterr().out == "small.mp4: 2 frames, 0.1 s\n"


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--output", "movie.avi"], "must end in .mp4, .webm or .gif"),
        (["--output", "nowhere/movie.gif"], "its folder does not exist"),
        (["--scheme", "rk5"], "did you mean 'rk4'"),
        (["--scheme", "rk4", "rk4", "rk4"], "must be one or two"),
        (["--level", "9"], "must be one of 6, 7, 8"),
        (["--case", "1"], "--case: 1: must be from 0 to 0"),
        (["--quantity", "thetta"], "did you mean 'theta'"),
        (["--to", "21"], "must be from 0 to 20"),
        (["--from", "20"], "leaves no time to be shown"),
        (["--fps", "1000"], "must be at most 100"),
        (["--output", "movie.gif", "--frames", str(MOST_GIF_FRAMES + 1)], "must be at most"),
        (["--frames-to", "small.yaml"], "must be a folder"),
    ],
)
def test_bad_options_are_refused(
    made: Made, monkeypatch: pytest.MonkeyPatch, capsys: Capture, options: list[str], told: str
) -> None:
    monkeypatch.chdir(made.folder)
    before = sorted(made.folder.iterdir())
    assert made.vibsim("movie", made.file, *options) == 2
    assert told in capsys.readouterr().err
    assert sorted(made.folder.iterdir()) == before


def test_a_format_without_its_package_is_refused_and_a_gif_needs_none(
    made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    assert made.vibsim("movie", made.file, "--output", tmp_path / "movie.mp4") == 2
    told = capsys.readouterr().err
    assert "pip install av" in told
    assert ".gif" in told
    assert made.vibsim("movie", made.file, "--frames", 2, "--output", tmp_path / "movie.gif") == 0


def test_without_results_a_movie_says_what_to_run(made: Made, capsys: Capture) -> None:
    for path in made.small.glob("level_*.nc"):
        path.unlink()
    assert made.vibsim("movie", made.file) == 1
    told = capsys.readouterr().err
    assert "there are no results yet: .venv/bin/vibsim run" in told
    assert "looked in " in told


def test_your_own_solver_has_no_movie(capsys: Capture) -> None:
    file = Path(__file__).parents[2] / "examples/heat/heat.yaml"
    assert main(["movie", str(file)]) == 2
    assert "your own solver" in capsys.readouterr().err


def test_a_terminal_is_told_how_many_frames_there_are(
    made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    assert made.vibsim("movie", made.file, "--frames", 2, "--output", tmp_path / "movie.gif") == 0
    assert "frame 2 of 2" in terminal.getvalue()


@pytest.mark.slow
def test_results_of_another_experiment_are_shown_with_a_note(
    made: Made, tmp_path: Path, capsys: Capture
) -> None:
    asked = ("movie", made.file, "--frames", 1, "--output", tmp_path / "movie.gif")
    assert made.vibsim(*asked) == 0
    assert capsys.readouterr().err == ""
    made.change("theta: 1.0", "theta: 0.5")
    assert made.vibsim(*asked) == 0
    assert "before the experiment or vibsim changed" in capsys.readouterr().err
