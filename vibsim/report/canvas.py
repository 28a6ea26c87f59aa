"""Figures for pages: their axes make no artists for ticks until somebody draws these.

Matplotlib makes five artists for the first tick of each axis as soon as there is an axis, which took a tenth of the
time of a page. `vibsim.report.figures.svg` writes ticks as text and never asks for them; what writes PNG and PDF does.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis, YAxis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator


class _NoTicksYet:
    """An empty list of ticks, one for each axis, that is filled by who draws them."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, axis: Any, owner: type) -> list[Any]:
        found: list[Any] = vars(axis).setdefault(self._name, [])
        return found


class _Quiet(Axis):  # type: ignore[misc, unused-ignore]
    """What an axis of either direction has in place of ticks that are made at once."""

    majorTicks = _NoTicksYet()  # noqa: N815
    minorTicks = _NoTicksYet()  # noqa: N815

    def _get_tick(self, major: bool) -> Any:
        tick = super()._get_tick(major)  # type: ignore[misc, unused-ignore]
        # else lines of the grid would leave the frame
        tick.set_clip_path(self.axes.patch)
        return tick

    def set_ticks(self, ticks: Any, labels: Any = None, **look: Any) -> Any:
        """Put ticks at some places, with labels; for labels with a look of their own matplotlib makes artists."""
        if look:
            return super().set_ticks(ticks, labels, **look)
        places = np.asarray(ticks, dtype=np.float64)
        if places.size:
            self.set_view_interval(float(places.min()), float(places.max()))
        self.set_major_locator(FixedLocator(places.tolist()))
        if labels is not None:
            self.set_major_formatter(FixedFormatter(list(labels)))
        return []


class _XAxis(_Quiet, XAxis):  # type: ignore[misc, unused-ignore]
    pass


class _YAxis(_Quiet, YAxis):  # type: ignore[misc, unused-ignore]
    pass


class Panel(Axes):  # type: ignore[misc, unused-ignore]
    """Axes without artists for ticks."""

    def _init_axis(self) -> None:
        for name, made, sides in (("xaxis", _XAxis, "bottom top"), ("yaxis", _YAxis, "left right")):
            axis = made(self, clear=False)
            setattr(self, name, axis)
            for side in sides.split():
                self.spines[side].register_axis(axis)

    def clear(self) -> None:
        """Begin anew; to ask for the place of a spine, as its ticks else do, puts the spine there."""
        super().clear()
        for spine in self.spines.values():
            spine.get_position()


class Canvas(Figure):  # type: ignore[misc, unused-ignore]
    """A figure, free of pyplot's global state, whose axes are `Panel`s."""

    def add_axes(self, *box: Any, **options: Any) -> Any:
        """Return new axes in a box: left, bottom, width and height as parts of the figure."""
        return super().add_axes(*box, **{"axes_class": Panel, **options})
