"""A matplotlib figure as SVG, written in one pass without a layout for ticks and letters.

The SVG writer of matplotlib creates five artists for each tick and lays out every text twice, which took half the time
of a report. This one writes ticks itself and draws all other artists through matplotlib's renderer interface. Its ids
come from the name of the figure, its colours are attributes that the style sheet of a page can replace, and its groups
carry the data from which a script reads values:

``<g data-axis="time" data-box="left top width height" data-x="low high" data-y="low high" data-log="xy">``
    a panel whose axes have a group id (``ax.set_gid("time")``), with limits in the units of its labels; the page itself
    holds the positions of members (`vibsim.report.page.explorer`)
``<g data-axis="long" data-window="width" ...>``, ``<g data-axis="overview" ...>``
    a panel of a long series (``ax.set_gid("long width")``), of which a page shows a window, and the strip of all time
``<g data-curve="label" data-key="key">``
    a curve or another artist on the axes; the key is its group id, else its label, even if this begins with an
    underscore, which leaves it out of the legend
``<g data-entry="key">``
    the handle or the text of a legend entry
"""

from __future__ import annotations

import base64
import io
from functools import cache
from html import escape
from typing import Any, cast

import matplotlib
import numpy as np
from matplotlib import _path
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager, get_font
from matplotlib.ft2font import LoadFlags
from matplotlib.legend import Legend
from matplotlib.spines import Spine
from matplotlib.text import Text
from matplotlib.ticker import NullLocator
from matplotlib.transforms import Affine2D

FAMILY = "'DejaVu Sans', Verdana, Arial, Helvetica, sans-serif"
POINT = 72.0  # dots per inch: lengths of an SVG drawing are points
RASTER = 160.0  # dots per inch of embedded images
MARGIN = 3.6  # between text and the border of a figure [point]
BOLD = 1.11  # width of bold letters over that of plain ones
ASCENT, DESCENT = 0.928, 0.236  # of the font, over its size
RC: Any = matplotlib.rcParams
COMMANDS = [b"M", b"L", b"Q", b"C", b"z"]
ANCHORS = {"center": (' text-anchor="middle"', 0.5), "right": (' text-anchor="end"', 1.0)}


def document(figure: Figure, name: str) -> str:
    """Return the SVG document of a figure; its ids begin with `name`."""
    figure.set_dpi(POINT)
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
    writer = Writer(*figure.bbox.size, name, has_paper=to_rgba(figure.get_facecolor())[3] > 0.0)
    for artist in _in_order([*figure.axes, *figure.legends, *figure.texts]):
        writer.add(artist)
    return writer.document()


def _in_order(artists: list[Any]) -> list[Any]:
    return sorted((a for a in artists if a.get_visible()), key=lambda a: a.get_zorder())


@cache
def _letter(letter: str) -> float:
    """Return the width of a letter over the size of the font."""
    font = get_font(fontManager.findfont("DejaVu Sans"))
    font.set_size(100.0, POINT)
    glyph = font.load_char(ord(letter), flags=LoadFlags.NO_HINTING)
    return float(glyph.linearHoriAdvance) / 65536.0 / 100.0


def _number(value: float) -> str:
    """Write a number with at most two decimals; less than a hundredth of a point is invisible."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _numbers(*values: float) -> str:
    return " ".join(map(_number, values))


def _place(x: float, y: float, width: float, height: float) -> str:
    """Write position and size of an element as attributes."""
    return f'x="{_number(x)}" y="{_number(y)}" width="{_number(width)}" height="{_number(height)}"'


class Writer(RendererBase):  # type: ignore[misc, unused-ignore]
    """Matplotlib renderer that collects SVG elements and the extent of the text among them."""

    def __init__(self, width: float, height: float, name: str, *, has_paper: bool) -> None:
        super().__init__()
        self._has_paper = has_paper
        self._size = (width, height)
        self._name = name
        self._flip = Affine2D().scale(1.0, -1.0).translate(0.0, height)
        self._body: list[str] = []
        self._defs: dict[str, str] = {}
        self._low, self._high = np.zeros(2), np.array([width, height])
        self._tags: dict[str, str] = {}
        self._open: list[str] = []
        self._decimals = 2

    def document(self) -> str:
        """Return everything drawn, in a frame that holds all text."""
        left, top = self._low
        width, height = self._high - self._low
        place = _place(left, top, width, height)
        defs = "".join(text.replace("#", key, 1) for text, key in self._defs.items())
        return (
            '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
            f'width="{_number(width)}pt" height="{_number(height)}pt" '
            f'viewBox="{_numbers(left, top, width, height)}" font-family="{FAMILY}" stroke-linejoin="round">\n'
            + (f'<rect {place} fill="#ffffff"/>\n' if self._has_paper else "")
            + (f"<defs>{defs}</defs>\n" if defs else "")
            + "\n".join(self._body) + "\n</svg>\n"
        )  # fmt: skip

    def add(self, artist: Any) -> None:
        """Draw an artist of any kind."""
        if isinstance(artist, Axes):
            self._axes(artist)
        elif isinstance(artist, Legend):
            self._legend(artist)
        elif artist.get_rasterized():
            self._image(artist)
        else:
            artist.draw(self)

    # axes

    def _axes(self, ax: Any) -> None:
        locator = ax.get_axes_locator()
        ax.apply_aspect(locator(ax, self) if locator else None)
        box = ax.bbox
        if tag := ax.get_gid():
            log = "".join(w for w in "xy" if getattr(ax, f"get_{w}scale")() == "log")
            place = _numbers(box.x0, self._size[1] - box.y1, box.width, box.height)
            x, y = (" ".join(f"{v:.9g}" for v in lim) for lim in (ax.get_xlim(), ax.get_ylim()))
            kind, _, window = tag.partition(" ")
            more = f' data-window="{window}"' if window else ""
            self._decimals = 3 if window else 2  # pages enlarge a panel with a window
            self._body.append(
                f'<g data-axis="{kind}"{more} data-box="{place}" data-x="{x}" data-y="{y}" data-log="{log}">'
            )
        if ax.axison and (ax.patch.get_hatch() or to_hex(ax.get_facecolor()) != "#ffffff"):
            ax.patch.draw(self)
        lines = ax.spines.values() if ax.axison else ()
        excluded = {ax.patch, ax.xaxis, ax.yaxis, *ax.spines.values()}
        artists = [a for a in ax.get_children() if a not in excluded]
        artists += [ax.xaxis, ax.yaxis, *lines] if ax.axison else []
        for artist in _in_order(artists):
            if artist is ax.xaxis or artist is ax.yaxis:
                self._axis(ax, artist, 0 if artist is ax.xaxis else 1)
            elif tag and not isinstance(artist, (Axes, Legend, Spine, Text)):
                self._curve(artist)
            else:
                self.add(artist)
        if tag:
            self._body.append("</g>")
        self._decimals = 2

    def _curve(self, artist: Any) -> None:
        """Draw an artist of a panel that a script can read, in a group with its label and key."""
        label = str(artist.get_label())
        has_label = bool(label) and not label.startswith("_child")
        # matplotlib leaves labels with an underscore out of legends
        label = label.removeprefix("_")
        key = artist.get_gid() or (label if has_label else "")
        before = len(self._body)
        self.add(artist)
        # an empty or invisible artist draws nothing
        if len(self._body) > before:
            name = f' data-curve="{escape(label)}"' if has_label else ""
            self._body.insert(before, f'<g{name} data-key="{escape(key)}">')
            self._body.append("</g>")

    def _axis(self, ax: Any, axis: Any, i: int) -> None:
        """Draw grid, ticks, tick labels and label of an axis: x for `i` = 0, y for `i` = 1."""
        params, which = axis.get_tick_params("major"), "xy"[i]
        size = float(params.get("labelsize", RC[f"{which}tick.labelsize"]))
        plain = RC[f"{which}tick.color"]
        colour, ink = (to_hex(params.get(key, plain)) for key in ("color", "labelcolor"))
        near, opposite = (("bottom", "top"), ("left", "right"))[i]
        length, pad = RC[f"{which}tick.major.size"], RC[f"{which}tick.major.pad"]
        box, height = ax.bbox, self._size[1]
        low, high = (box.x0, box.x1) if i == 0 else (box.y0, box.y1)
        places = np.asarray(axis.get_majorticklocs(), dtype=np.float64)
        texts = axis.get_major_formatter().format_ticks(places)
        at = self._places(ax, places, i)
        visible = [k for k in range(places.size) if low - 0.01 <= at[k] <= high + 0.01]
        self._body.append(f'<g data-ticks="{which}">' if ax.get_gid() else "<g>")
        # start and length of a tick on each side, across the axis
        edges = {
            near: (height - box.y0, length) if i == 0 else (box.x0, -length),
            opposite: (height - box.y1, -length) if i == 0 else (box.x1, length),
        }
        if params.get("gridOn", RC["axes.grid"]):
            look = f'stroke="{to_hex(RC["grid.color"])}" stroke-width="{RC["grid.linewidth"]}"'
            start = edges[near][0]
            ends = (start, box.height * -1.0) if i == 0 else (start, box.width)
            self._strokes([at[k] for k in visible], ends, i, look)
        look = f'stroke="{colour}" stroke-width="0.8"'
        for side in (near, opposite):
            if params.get(side, side == near):
                self._strokes([at[k] for k in visible], edges[side], i, look)
            if side == near and not isinstance(axis.get_minor_locator(), NullLocator):
                minor = self._places(ax, np.asarray(axis.get_minorticklocs(), float), i)
                start, long = edges[near]
                self._strokes([x for x in minor if low <= x <= high], (start, 0.57 * long), i, look)
        widest = 0.0
        for side in (near, opposite):
            if not params.get(f"label{side}", side == near):
                continue
            start, long = edges[side]
            edge = start + long + np.sign(long) * pad
            for k in visible:
                widest = max(widest, self.width(texts[k], size))
                if i == 0:
                    down = edge + ASCENT * size if side == near else edge - DESCENT * size
                    self._write(at[k], down, texts[k], size, "center", ink)
                else:
                    aligned = "right" if side == near else "left"
                    self._write(edge, height - at[k] + 0.36 * size, texts[k], size, aligned, ink)
        self._body.append("</g>")
        self._label(ax, axis, i, (widest, size) if params.get(f"label{near}", True) else (0.0, 0.0))
        if offset := axis.get_major_formatter().get_offset():
            place = (box.x1, height - box.y0 + 2.2 * size), (box.x0, height - box.y1 - 3)
            self._write(*place[i], offset, size, ("right", "left")[i], ink)

    def _places(self, ax: Any, values: Any, i: int) -> Any:
        """Return the positions of values of an axis, in points from the left or from below."""
        both = np.zeros((values.size, 2))
        both[:, i] = values
        transform = ax.get_xaxis_transform() if i == 0 else ax.get_yaxis_transform()
        return transform.transform(both)[:, i]

    def _strokes(self, at: list[float], ends: tuple[float, float], i: int, look: str) -> None:
        """Draw parallel lines across an axis; `ends` are their common start and length."""
        start, length = (_number(x) for x in ends)
        if i == 0:
            path = "".join(f"M{_number(x)} {start}v{length}" for x in at)
        else:
            path = "".join(f"M{start} {_number(self._size[1] - y)}h{length}" for y in at)
        if path:
            self._body.append(f'<path d="{path}" {look}/>')

    def _label(self, ax: Any, axis: Any, i: int, numbers: tuple[float, float]) -> None:
        """Draw the label of an axis beyond its tick labels, or at its fixed position if they leave that free."""
        if not axis.label.get_text():
            return
        which, near = (("x", "bottom"), ("y", "left"))[i]
        room = RC[f"{which}tick.major.size"] if axis.get_tick_params().get(near, True) else 0.0
        widest, size = numbers
        if size:
            room += RC[f"{which}tick.major.pad"]
            room += size * (ASCENT + DESCENT) if i == 0 else widest
        edge = (ax.bbox.y0 if i == 0 else ax.bbox.x0) - room - axis.labelpad
        if axis._autolabelpos:
            axis.label.set(**{"yx"[i]: edge})
        elif i == 1:
            to_figure = axis.label.get_transform()
            x, y = to_figure.transform(axis.label.get_position())
            axis.label.set_position(to_figure.inverted().transform((min(x, edge), y)))
        axis.label.draw(self)

    def _legend(self, legend: Any) -> None:
        """Draw a legend; each entry carries the key of its curve."""
        parent = legend.parent
        panels = parent.axes if isinstance(parent, Figure) else [parent]
        lines = [line for ax in panels if ax.get_gid() for line in ax.get_lines()]
        keys = {
            str(line.get_label()): str(line.get_gid() or line.get_label())
            for line in lines
            if np.size(line.get_xdata())
        }
        entries = zip(legend.legend_handles, legend.get_texts(), strict=True)
        for i, (handle, text) in enumerate(entries):
            if (key := keys.get(text.get_text())) is not None:
                tag = f"entry {i}"
                self._tags[tag] = f' data-entry="{escape(key)}"'
                handle.set_gid(tag)
                text.set_gid(tag)
        legend.draw(self)

    # the interface that artists call

    def open_group(self, s: str, gid: str | None = None) -> None:
        """Begin a group if the artist is tagged."""
        if gid in self._tags:
            self._body.append(f"<g{self._tags[gid]}>")
            self._open.append(s)

    def close_group(self, s: str) -> None:
        """End the group of a tagged artist."""
        if self._open and self._open[-1] == s:
            self._open.pop()
            self._body.append("</g>")

    def get_canvas_width_height(self) -> tuple[float, float]:
        """Return the size of the figure [point]."""
        return self._size

    def width(self, text: str, size: float) -> float:
        """Estimate the width of a text [point]."""
        return size * sum(map(_letter, text))

    def get_text_width_height_descent(
        self, s: str, prop: Any, ismath: Any
    ) -> tuple[float, float, float]:
        """Estimate width, height and descent of a line of text [point]."""
        size = prop.get_size_in_points()
        wide = self.width(s, size) * (BOLD if prop.get_weight() == "bold" else 1.0)
        return wide, size * (ASCENT + DESCENT), size * DESCENT

    def _get_font_height_metrics(self, prop: Any) -> tuple[float, float, float]:
        size = prop.get_size_in_points()
        return size * ASCENT, size * DESCENT, 0.0

    def draw_text(
        self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float, ismath: Any = False, mtext: Any = None
    ) -> None:  # fmt: skip
        """Write a line of text whose baseline begins at `x`, `y`."""
        size = prop.get_size_in_points()
        wide, _, _ = self.get_text_width_height_descent(s, prop, ismath)
        aligned = mtext.get_horizontalalignment() if mtext is not None and not angle else "left"
        if angle and mtext is not None and mtext.get_rotation_mode() != "anchor":
            upright = mtext.get_verticalalignment()
            aligned = {"center": "center", "top": "right"}.get(upright, "left")
        turn = np.deg2rad(angle)
        ahead = ANCHORS.get(aligned, ("", 0.0))[1] * wide
        rgba = gc.get_rgb()
        more = ' font-weight="bold"' if prop.get_weight() == "bold" else ""
        if rgba[3] < 1.0:
            more += f' opacity="{_number(rgba[3])}"'
        x, y = x + ahead * np.cos(turn), y - ahead * np.sin(turn)
        self._write(x, y, s, size, aligned, to_hex(rgba), angle, wide, more)

    def _write(
        self, x: float, y: float, text: str, size: float, aligned: str, colour: str,
        angle: float = 0.0, wide: float | None = None, more: str = "",
    ) -> None:  # fmt: skip
        """Write a line of text, aligned at `x`, `y`, and extend the frame to hold it."""
        if not text.strip():
            return
        wide = self.width(text, size) if wide is None else wide
        anchor, part = ANCHORS.get(aligned, ("", 0.0))
        sine, cosine = np.sin(np.deg2rad(angle)), np.cos(np.deg2rad(angle))
        along, up = wide * np.array([cosine, -sine]), size * np.array([-sine, -cosine])
        start = np.array([x, y]) - part * along
        corners = [start + a * along + b * up for a in (0, 1) for b in (-DESCENT, ASCENT)]
        self._low = np.min([self._low, *(c - MARGIN for c in corners)], axis=0)
        self._high = np.max([self._high, *(c + MARGIN for c in corners)], axis=0)
        if angle:
            more += f' transform="rotate({_number(-angle)} {_numbers(x, y)})"'
        if colour != "#000000":
            more += f' fill="{colour}"'
        place = f'x="{_number(x)}" y="{_number(y)}" font-size="{_number(size)}"'
        self._body.append(f"<text {place}{anchor}{more}>{escape(text, quote=False)}</text>")

    def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
        """Draw a path."""
        hatch = gc.get_hatch()
        look = self._look(gc, rgbFace)
        if data := self._data(path, transform + self._flip, rgbFace is None and not hatch):
            self._body.append(f'<path d="{data}"{look}/>')
            if hatch:
                self._body.append(f'<path d="{data}" fill="url(#{self._hatch(gc)})"/>')

    def draw_markers(
        self, gc: Any, marker_path: Any, marker_trans: Any, path: Any, trans: Any, rgbFace: Any = None
    ) -> None:  # fmt: skip
        """Draw a marker at every point of a path."""
        places = (trans + self._flip).transform(path.vertices)
        width, height = self._size
        # distant markers are clipped anyway, and their numbers may be too large for a browser
        near = np.all((places > -9.0) & (places < (width + 9.0, height + 9.0)), axis=1)
        if not near.any():
            return
        data = self._data(marker_path, marker_trans + Affine2D().scale(1.0, -1.0), False)
        key = self._shared(f'<path id="#" d="{data}"/>')
        uses = "".join(
            f'<use xlink:href="#{key}" x="{_number(x)}" y="{_number(y)}"/>' for x, y in places[near].tolist()
        )  # fmt: skip
        self._body.append(f"<g{self._look(gc, rgbFace)}>{uses}</g>")

    def draw_image(self, gc: Any, x: float, y: float, im: Any, transform: Any = None) -> None:
        """Draw an image: bytes of shape (rows, columns, 4)."""
        from PIL import Image

        stream = io.BytesIO()
        Image.fromarray(im).save(stream, format="png")
        height, width = im.shape[0] * POINT / RASTER, im.shape[1] * POINT / RASTER
        place = _place(x, self._size[1] - y - height, width, height)
        content = base64.b64encode(stream.getvalue()).decode("ascii")
        self._body.append(f'<image {place} xlink:href="data:image/png;base64,{content}"/>')

    def _image(self, artist: Any) -> None:
        """Draw an artist with very many elements as an image."""
        from matplotlib.backends.backend_agg import RendererAgg

        figure = artist.get_figure(root=True)
        figure.set_dpi(RASTER)
        agg: Any = cast(Any, RendererAgg)(*figure.bbox.size, RASTER)
        artist.draw(agg)
        figure.set_dpi(POINT)
        pixels = np.asarray(agg.buffer_rgba())
        opaque = np.nonzero(pixels[..., 3])
        if not opaque[0].size:
            return
        (top, bottom), (left, right) = ((int(p.min()), int(p.max()) + 1) for p in opaque)
        x, y = left * POINT / RASTER, (pixels.shape[0] - bottom) * POINT / RASTER
        self.draw_image(None, x, y, np.ascontiguousarray(pixels[top:bottom, left:right]))

    # elements

    def _data(self, path: Any, transform: Any, is_line: bool) -> str:
        simplify = bool(path.should_simplify and is_line)
        clip = (0.0, -self._size[1], *self._size) if is_line else None  # a legend may stand above
        raw = cast(Any, _path).convert_to_string(
            path, transform, clip, simplify, None, self._decimals, COMMANDS, False
        )
        text = str(raw.decode("ascii")).replace(" \n", "").replace("\n", "")
        return text.replace("L ", "L").replace("M ", "M")

    def _look(self, gc: Any, face: Any) -> str:
        """Return the fill, stroke and clipping of an element as attributes."""
        rgba, forced = gc.get_rgb(), gc.get_forced_alpha()
        attributes = []
        if face is None or (len(face) == 4 and face[3] == 0.0):
            attributes.append('fill="none"')
        else:
            attributes.append(f'fill="{to_hex(face[:3])}"')
            if len(face) == 4 and face[3] != 1.0 and not forced:
                attributes.append(f'fill-opacity="{_number(face[3])}"')
        if forced and gc.get_alpha() != 1.0:
            attributes.append(f'opacity="{_number(gc.get_alpha())}"')
        if (wide := gc.get_linewidth()) and rgba[3] > 0.0:
            attributes += [f'stroke="{to_hex(rgba[:3])}"', f'stroke-width="{_number(wide)}"']
            if rgba[3] != 1.0 and not forced:
                attributes.append(f'stroke-opacity="{_number(rgba[3])}"')
            offset, dashes = gc.get_dashes()
            if dashes is not None:
                attributes.append(f'stroke-dasharray="{_numbers(*dashes)}"')
                attributes += [f'stroke-dashoffset="{_number(offset)}"'] if offset else []
        box = gc.get_clip_rectangle()
        if box is not None:
            place = _place(box.x0, self._size[1] - box.y1, box.width, box.height)
            key = self._shared(f'<clipPath id="#"><rect {place}/></clipPath>')
            attributes.append(f'clip-path="url(#{key})"')
        return " " + " ".join(attributes)

    def _hatch(self, gc: Any) -> str:
        data = self._data(gc.get_hatch_path(), Affine2D().scale(POINT), False)
        line = f'<path d="{data}" stroke="{to_hex(gc.get_hatch_color())}" stroke-width="1"/>'
        box = f'patternUnits="userSpaceOnUse" width="{_number(POINT)}" height="{_number(POINT)}"'
        return self._shared(f'<pattern id="#" {box}>{line}</pattern>')

    def _shared(self, element: str) -> str:
        """Define an element that others refer to, once, and return its id."""
        return self._defs.setdefault(element, f"{self._name}-{len(self._defs)}")
