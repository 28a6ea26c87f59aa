"""The frames of a movie as reproducible pixels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.report import style
from vibsim.report.figures import scenes
from vibsim.report.figures.scenes import Part, Scene
from vibsim.report.movie.film import Film
from vibsim.report.types import Axes

Pixels = NDArray[np.uint8]  # a frame, shape (height, width, 3)
WIDTH, HEIGHT, STAGE, NAMES = 8.0, 2.4, 3.0, 0.8
"""Width of a frame; heights of the series over time, and of the drawn systems or the names above it [inch]."""
INK, DIM, BLUE, RED, GREEN, GOLD = "#16181d", "#69707d", "#1f3a93", "#d1495b", "#0b6e4f", "#a86a12"
GRID, PALE = "#e6e6e6", "#c4c8ce"
COLOURS = (INK, DIM, BLUE, RED, GREEN, GOLD, GRID, PALE, "#000000", "#404040")
"""All colours of frames, before antialiasing mixes them with the background."""
CURVES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "linewidth": 1.6, "zorder": 4},
    {"color": RED, "linewidth": 1.6, "linestyle": (0, (5, 3)), "zorder": 5},
)
LINE: dict[str, Any] = {"facecolor": "none", "edgecolor": INK, "linewidth": 1.6}
LOOKS: dict[str, dict[str, Any]] = {
    "guide": {"edgecolor": DIM, "linewidth": 0.8, "linestyle": (0, (3, 4))},
    "angle": {"edgecolor": DIM, "linewidth": 1.0},
    "ground": {"edgecolor": DIM, "linewidth": 2.0},
    "pivot": {"facecolor": INK},
    "mark": {"facecolor": INK},
    "body": {"facecolor": BLUE, "edgecolor": BLUE},
    "wheel": {"facecolor": "white"},
    "gravity": {"edgecolor": GREEN, "linewidth": 2.2},
    "pull": {"edgecolor": RED, "linewidth": 2.2},
    "drag": {"edgecolor": GOLD, "linewidth": 2.2},
}
"""Look of a part to its differences from `LINE`, as in ``player.css`` for the light scheme."""


def frames(film: Film, dots_per_inch: float) -> Iterator[Pixels]:
    """Yield the frames of a film, all of one size with an even number of rows and columns."""
    with style.applied():
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        height = HEIGHT + (STAGE if film.scenes else NAMES)
        figure = Figure(figsize=(WIDTH, height), dpi=dots_per_inch)
        canvas: Any = FigureCanvasAgg(figure)
        movers = [_trace(figure, film, HEIGHT / height)]
        for i, scene in enumerate(film.scenes):
            movers.append(_stage(figure, film, i, scene, HEIGHT / height))
        if film.scenes:
            _legend(figure, film.scenes[0])
        for k in range(film.t.size):
            for move in movers:
                move(k)
            canvas.draw()
            pixels = np.asarray(canvas.buffer_rgba())
            rows, columns = (size // 2 * 2 for size in pixels.shape[:2])
            yield np.ascontiguousarray(pixels[:rows, :columns, :3])


def _trace(figure: Any, film: Film, share: float) -> Callable[[int], None]:
    """Draw the series in the lower `share` of the figure; return a function that moves the window to a frame."""
    ax = figure.add_axes((0.09, 0.2 * share, 0.88, 0.62 * share))
    reference = next((run for run in film.runs if run.exact is not None), None)
    if reference is not None and reference.exact is not None:
        pale: dict[str, Any] = {"color": PALE, "linewidth": 5.0, "zorder": 1}
        ax.plot(reference.t, reference.exact, label=film.name_of_exact, **pale)
    for run, look in zip(film.runs, CURVES, strict=False):
        # with two drawings, the titles are below them
        label = "_" if len(film.scenes) > 1 else style.entry(run.title)
        ax.plot(run.t, run.series, label=label, **look)
    shown = [
        y[(run.t >= film.start) & (run.t <= film.stop)]
        for run in film.runs
        for y in (run.series, run.exact)
        if y is not None
    ]
    ax.set_ylim(*style.limits(*shown))
    ax.set_xlabel(style.label("t", film.time_unit))
    ax.set_ylabel(film.label)
    if ax.get_legend_handles_labels()[0]:
        columns = 2 if film.scenes else 1
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2)
    clock = figure.text(0.97, 0.03 * share, "", ha="right", va="bottom")
    cursor = ax.axvline(film.start, color=DIM, linewidth=1.2, zorder=3)
    points = [
        ax.plot([], [], "o", color=look["color"], markersize=5, zorder=6)[0]
        for _, look in zip(film.runs, CURVES, strict=False)
    ]
    begin, end = film.start, film.stop
    digits = _digits(end - begin)

    def move(k: int) -> None:
        t = float(film.t[k])
        first = min(max(begin, t - 0.6 * film.window), end - film.window)
        ax.set_xlim(first, first + film.window)
        cursor.set_xdata([t, t])
        for run, point in zip(film.runs, points, strict=True):
            point.set_data([t], [float(np.interp(t, run.t, run.series))])
        clock.set_text(f"t = {t:.{digits}f} {film.time_unit}".rstrip())

    return move


def _digits(span: float) -> int:
    return min(8, max(0, 2 - int(np.floor(np.log10(span / 20.0)))))


def _stage(figure: Any, film: Film, i: int, scene: Scene, below: float) -> Callable[[int], None]:
    """Draw the i-th system above the series; return a function that moves its parts to a frame."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    count = len(film.scenes)
    room = 1.0 - below
    ax = figure.add_axes((i / count, below + 0.13 * room, 1.0 / count, 0.79 * room))
    ax.set(xlim=(0.0, scenes.WIDTH), ylim=(scenes.HEIGHT, 0.0), aspect="equal")
    ax.set_axis_off()
    if count > 1:
        look = {"color": CURVES[i]["color"], "fontsize": 9.0, "ha": "center", "va": "bottom"}
        figure.text((i + 0.5) / count, below + 0.05 * room, film.runs[i].title, **look)
    drawn = []
    for part in scene.parts:
        patch = PathPatch(Path.make_compound_path(), **(LINE | LOOKS.get(part.look, {})))
        patch.set(capstyle="round", joinstyle="round", clip_on=True)
        ax.add_patch(patch)
        label = _label(ax, part) if part.label else None
        drawn.append((part, patch, label, _outline(part) if part.shape == "track" else None))

    def move(k: int) -> None:
        for part, patch, label, outline in drawn:
            values = scenes.values_of(part, k)
            if outline is not None:
                lines = [outline - (values[0], 0.0)]
            else:
                lines = [np.array(line) for line in scenes.strokes(part.shape, values)]
            patch.set_path(Path.make_compound_path(*map(Path, lines)))
            if label is not None:
                place = scenes.place_of_label(part.shape, values)
                label.set_visible(place is not None)
                label.set_position(place or (0.0, 0.0))

    return move


def _label(ax: Axes, part: Part) -> Any:
    colour = LOOKS[part.look]["edgecolor"]
    return ax.text(
        0.0, 0.0, part.label, color=colour, fontsize=9.5, fontstyle="italic", ha="center", va="center"
    )  # fmt: skip


def _outline(part: Part) -> Floats:
    """Return the points of a fixed outline, shape (point, 2)."""
    return np.array([point.split(" ") for point in part.outline[1:].split("L")], dtype=np.float64)


def _legend(figure: Any, scene: Scene) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=LOOKS[look].get("edgecolor", INK), linewidth=2.2)
        for look, _ in scene.legend
    ]
    words = [text for _, text in scene.legend]
    if handles:
        place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, 1.0)}
        figure.legend(handles, words, ncols=len(words), handlelength=1.5, **place)
