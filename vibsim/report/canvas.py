"""Figures for pages, whose axes create artists for ticks only when ticks are drawn.

Matplotlib creates five artists for the first tick of every new axis, which took a tenth of the time of a page.
`vibsim.report.figures.svg` writes ticks as text and never needs them; the writers of PNG and PDF do.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis, YAxis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator

MOST_STEPS = 6  # largest number of steps between the numbers of an axis; matplotlib has up to 9


class _NoTicksYet:
    """Descriptor: a list of ticks for each axis, empty until the ticks are drawn."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, axis: Any, owner: type) -> list[Any]:
        ticks: list[Any] = vars(axis).setdefault(self._name, [])
        return ticks


class _Quiet(Axis):  # type: ignore[misc, unused-ignore]
    """An axis, horizontal or vertical, without artists for ticks and with few numbers."""

    majorTicks = _NoTicksYet()  # noqa: N815
    minorTicks = _NoTicksYet()  # noqa: N815

    def _get_tick(self, major: bool) -> Any:
        tick = super()._get_tick(major)  # type: ignore[misc, unused-ignore]
        tick.set_clip_path(self.axes.patch)  # keeps grid lines within the frame
        return tick

    def get_tick_space(self) -> int:
        """Return the number of steps for which there is room, up to `MOST_STEPS`."""
        return min(super().get_tick_space(), MOST_STEPS)  # type: ignore[misc, unused-ignore]

    def set_ticks(self, ticks: Any, labels: Any = None, **look: Any) -> Any:
        """Set positions and labels of ticks; styled labels need the artists of matplotlib."""
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
        """Clear the axes; asking for the position of a spine, as its ticks would, puts the spine there."""
        super().clear()
        for spine in self.spines.values():
            spine.get_position()


class Canvas(Figure):  # type: ignore[misc, unused-ignore]
    """A figure without pyplot's global state, whose axes are `Panel`s."""

    def add_axes(self, *box: Any, **options: Any) -> Any:
        """Return new axes in a box: left, bottom, width and height as fractions of the figure."""
        return super().add_axes(*box, **{"axes_class": Panel, **options})
