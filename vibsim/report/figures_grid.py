"""The order over a grid of two swept parameters, as a map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.record import Record
from vibsim.report import style, words
from vibsim.report.data import TYPICAL_NORM, formal_order, names, pick, swept, swept_label
from vibsim.report.style import Picture

if TYPE_CHECKING:
    from vibsim.spec import Experiment


def grid(experiment: Experiment, record: Record, quantity: str) -> Picture | None:
    """Draw the order over a grid of two swept parameters as a map; None where the sweep is no such grid."""
    found = swept(record)
    numeric = all(np.issubdtype(record[name].dtype, np.number) for name in found)
    if len(found) != 2 or not numeric:
        return None
    first, second = np.unique(record[found[0]]), np.unique(record[found[1]])
    if first.size * second.size != len(record["case"]) or min(first.size, second.size) < 2:
        return None
    norm, schemes = names(record, "norm").index(TYPICAL_NORM), names(record, "scheme")
    promised = formal_order(experiment, 0, quantity)
    figure = style.canvas(3.4)
    width = 0.8 / len(schemes)
    cells = np.searchsorted(first, record[found[0]]), np.searchsorted(second, record[found[1]])
    image: Any = None
    for s, scheme in enumerate(schemes):
        ax = figure.add_axes((0.088 + s * width, 0.15, width - 0.03, 0.73))
        table = np.full((second.size, first.size), np.nan)
        table[cells[1], cells[0]] = pick(record, f"{quantity}_order", scheme=s, norm=norm)
        image = ax.pcolormesh(
            first,
            second,
            table,
            cmap="PuOr",
            vmin=promised - 0.5,
            vmax=promised + 0.5,
            shading="nearest",
            rasterized=table.size > 2500,
        )
        ax.set_title(scheme)
        ax.set_xlabel(style.label(*swept_label(record, found[0])))
        ax.set_ylabel(style.label(*swept_label(record, found[1])) if s == 0 else "")
        ax.grid(visible=False)
    bar = figure.colorbar(image, cax=figure.add_axes((0.9, 0.15, 0.02, 0.73)), extend="both")
    bar.set_label(f"order of {words.symbol(quantity)}; {promised:g} promised")
    return Picture(
        name=f"sweep_grid_{quantity}",
        title=f"Order over both swept parameters: {words.symbol(quantity)}",
        caption=f"White is the promised order {promised:g}; a shade to either side is half an order at most. Empty "
        "cells have no stated order.",
        alt=f"Map of the stated order of {words.name(quantity)} over two swept parameters",
        figure=figure,
    )
