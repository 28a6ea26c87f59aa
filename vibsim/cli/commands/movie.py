"""``vibsim movie``: write the movie of an experiment that has been run."""

from __future__ import annotations

import re
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vibsim.cli import level_member
from vibsim.cli.chosen_plans import one_plan_of
from vibsim.cli.jobs.common import check_to_write, chosen_results, refusal
from vibsim.cli.level_member import chosen
from vibsim.core.errors import VibsimError
from vibsim.core.home import typed
from vibsim.core.set_option import command_to_run
from vibsim.plan import Plan
from vibsim.store import write_bytes

if TYPE_CHECKING:
    from vibsim.report.movie.drawing import Pixels
    from vibsim.report.movie.film import Film, Run

FPS = {"gif": 10.0}
DEFAULT_FPS, MOST_FPS = 25.0, 100.0
MOST_GIF_FRAMES = 600  # most frames of a GIF, all of which are in memory before it is written
DOTS = {"gif": 80.0}
DEFAULT_DOTS = 120.0  # per inch


def movie(options: Namespace) -> int:
    """Write a movie, its frames, or both.

    Raises VibsimError where there are no results, they have no time series, or the encoder of the format is not
    installed.
    """
    from vibsim.report.movie import drawing, encoding

    plan = one_plan_of(options.experiment, options.settings)
    output = options.output
    if output is None and options.frames_to is None:
        output = Path(f"{re.sub(r'[^A-Za-z0-9_]', '_', plan.name)}.mp4")
    form = "" if output is None else _form(output)
    _check_numbers(options, form)
    film = _film(plan, options, form)
    frames = drawing.frames(film, DOTS.get(form, DEFAULT_DOTS))
    count, words = film.t.size, "1 frame" if film.t.size == 1 else f"{film.t.size} frames"
    if options.frames_to is not None:
        _check_folder(options.frames_to, count)
    frames = _counted(_saved(frames, options.frames_to), count)
    if output is None:
        for _ in frames:
            pass
    else:
        write_bytes(output, encoding.movie(frames, _fps(options, form), form))
        print(f"{output}: {words}, {count / _fps(options, form):.1f} s")
    if options.frames_to is not None:
        print(f"{options.frames_to}: {words}")
    if film.is_cut:
        last, hint = f"{film.stop:.5g}", "or see all of it with --frames N"
        print(f"to t = {last} of {film.end:.5g}; go on with --from {last}, {hint}")
    return 0


def _form(output: Path) -> str:
    """Return the format of a movie, from the suffix of its file."""
    from vibsim.report.movie import encoding

    form = output.suffix.removeprefix(".").lower()
    if form not in encoding.FORMATS:
        known = [f".{name}" for name in encoding.FORMATS]
        raise refusal("--output", output, f"must end in {', '.join(known[:-1])} or {known[-1]}")
    if not output.absolute().parent.is_dir():
        raise refusal("--output", output, "its folder does not exist")
    try:
        encoding.check(form)
    except VibsimError as error:
        raise refusal("--output", output, str(error)) from None
    return form


def _check_numbers(options: Namespace, form: str) -> None:
    if options.fps is not None and options.fps > MOST_FPS:
        raise refusal("--fps", f"{options.fps:g}", f"must be at most {MOST_FPS:g}")
    if form == "gif" and (options.frames or 0) > MOST_GIF_FRAMES:
        rule = f"must be at most {MOST_GIF_FRAMES} of a GIF; MP4 and WebM have no limit"
        raise refusal("--frames", options.frames, rule)
    for key in ("scheme", "level"):
        values = getattr(options, key) or ()
        if len(values) > 2:
            raise refusal(f"--{key}", " ".join(map(str, values)), "must be one or two")


def _fps(options: Namespace, form: str) -> float:
    return float(options.fps or FPS.get(form, DEFAULT_FPS))


def _film(plan: Plan, options: Namespace, form: str) -> Film:
    """Return the film of the chosen runs; by default the finest level, and a coarse run if it differs visibly."""
    from vibsim.report.data import Results
    from vibsim.report.movie import film

    if plan.has_solver:
        rule = "must have a model: a movie cannot show what your own solver does"
        raise refusal("EXPERIMENT", options.experiment, rule)
    results, case = chosen_results(options), options.case
    if case is None:
        case, _ = level_member.decisive(plan, level_member.summary_of(plan, results))
    levels, made = level_member.made(plan, results, case, options.experiment)
    for level in options.level or ():
        level_member.check_level(level, levels)
        if level not in made:
            problem = f"level {level} is not made yet: {typed(command_to_run(options.experiment))}"
            raise VibsimError(f"{plan.key}: {problem}")
    wanted_levels = options.level or [made[-1]]

    def read(level: int) -> Results:
        found = level_member.of_level(plan, results, level, case)
        return Results.of(plan.experiment, found)

    records = {level: read(level) for level in wanted_levels}
    record = records[wanted_levels[0]]
    names = level_member.series(record)
    if not names:
        hint = f"run one member alone: {typed(command_to_run(f'{options.experiment}@{case}'))}"
        raise VibsimError(f"{plan.key}: there are no series over time to be shown; {hint}")
    schemes = [chosen("--scheme", s, record.schemes) for s in options.scheme or [None]]
    position = plan.experiment.model.definition.position
    wanted = options.quantity or (position if position in names else None)
    quantity = chosen("--quantity", wanted, names)

    def run(level: int, scheme: str) -> Run:
        return film.run(records[level], scheme, quantity)

    runs = [run(*pair) for pair in _pairs(wanted_levels, schemes)]
    if not (options.level or options.scheme) and len(made) > 1:
        records[made[0]] = read(made[0])
        coarse = [run(made[0], scheme) for scheme in record.schemes]
        other = max(coarse, key=lambda candidate: film.differs_visibly(candidate, runs[0]))
        runs += [other] if film.differs_visibly(other, runs[0]) else []
    _check_times(options, runs)
    if any(level_member.is_outdated(plan, row, level, case) for level, row in records.items()):
        print(level_member.OUTDATED, file=sys.stderr)
    most = min(film.MOST_FRAMES, MOST_GIF_FRAMES // 2) if form == "gif" else film.MOST_FRAMES
    return film.film(
        record, runs, quantity, fps=_fps(options, form), frames=options.frames, start=options.start,
        end=options.end, periods=options.window, most=most,
    )  # fmt: skip


def _pairs(levels: Sequence[int], schemes: Sequence[str]) -> list[tuple[int, str]]:
    """Return level and scheme of each run; a single level or scheme applies to both runs."""
    count = max(len(levels), len(schemes))
    return [
        (levels[min(i, len(levels) - 1)], schemes[min(i, len(schemes) - 1)]) for i in range(count)
    ]


def _check_times(options: Namespace, runs: Sequence[Run]) -> None:
    begin, end = float(runs[0].t[0]), min(float(run.t[-1]) for run in runs)
    start = begin if options.start is None else options.start
    for key, value, low in (("--from", options.start, begin), ("--to", options.end, start)):
        if value is not None and not low <= value <= end:
            raise refusal(key, f"{value:g}", f"must be from {low:g} to {end:g}")
    if start >= (end if options.end is None else options.end):
        raise refusal("--from", f"{start:g}", "leaves no time to be shown")


def _check_folder(folder: Path, count: int) -> None:
    """Refuse a folder with old frames that the new ones would not overwrite."""
    check_to_write("--frames-to", folder)
    frame = re.compile(r"frame_(\d{4,})\.png")
    numbers = (frame.fullmatch(path.name) for path in folder.glob("frame_*.png"))
    if any(number is not None and int(number[1]) >= count for number in numbers):
        rule = "has more frames than this movie: choose an empty folder"
        raise refusal("--frames-to", folder, rule)


def _saved(frames: Iterator[Pixels], folder: Path | None) -> Iterator[Pixels]:
    """Yield the frames, and write each to a folder if there is one."""
    from vibsim.report.movie import encoding

    if folder is None:
        yield from frames
        return
    folder.mkdir(parents=True, exist_ok=True)
    for k, frame in enumerate(frames):
        write_bytes(folder / f"frame_{k:04d}.png", encoding.png(frame))
        yield frame


def _counted(frames: Iterator[Pixels], count: int) -> Iterator[Pixels]:
    """Yield the frames, and show their number on a terminal."""
    is_shown = sys.stderr.isatty()
    for k, frame in enumerate(frames, 1):
        if is_shown:
            print(f"\rframe {k} of {count}", end="", file=sys.stderr, flush=True)
        yield frame
    if is_shown:
        print("\r\033[K", end="", file=sys.stderr, flush=True)
