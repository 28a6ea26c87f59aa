"""The order over a grid of two swept parameters, as a map."""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.record import Record
from vibsim.report import style, words
from vibsim.report.data import pick, swept, swept_label
from vibsim.report.style import Picture
from vibsim.vocabulary import TYPICAL_NORM

RANGE = 0.5
"""Distance from the promised order at which the colours end."""
BORDERED = 2500
"""Most cells that get a border; of more, the borders would hide the colours."""
MISSING = "#d4d4d4"


def grid(record: Record, quantity: str) -> Picture | None:
    """Draw the order over a grid of two swept parameters as a map; None where the sweep is no such grid."""
    from matplotlib.patches import Patch

    found = swept(record)
    numeric = all(np.issubdtype(record[name].dtype, np.number) for name in found)
    if len(found) != 2 or not numeric:
        return None
    first, second = np.unique(record[found[0]]), np.unique(record[found[1]])
    if first.size * second.size != len(record["case"]) or min(first.size, second.size) < 2:
        return None
    norm, schemes = record.words("norm").index(TYPICAL_NORM), record.words("scheme")
    promised = record[f"{quantity}_formal_order"]
    figure = style.canvas(3.4)
    width = 0.8 / len(schemes)
    cells = np.searchsorted(first, record[found[0]]), np.searchsorted(second, record[found[1]])
    image: Any = None
    is_empty = False
    for s, scheme in enumerate(schemes):
        ax = figure.add_axes((0.088 + s * width, 0.15, width - 0.03, 0.73))
        table = np.full((second.size, first.size), np.nan)
        order = pick(record, f"{quantity}_order", scheme=s, norm=norm)
        table[cells[1], cells[0]] = order - promised[s]
        image = ax.pcolormesh(
            first,
            second,
            table,
            cmap="PuOr",
            vmin=-RANGE,
            vmax=RANGE,
            shading="nearest",
            edgecolors="#8c8c8c" if table.size <= BORDERED else "none",
            linewidth=0.4,
            rasterized=table.size > BORDERED,
        )
        ax.set_title(f"{scheme}: {promised[s]:g} promised")
        ax.set_xlabel(style.label(*swept_label(record, found[0])))
        ax.set_ylabel(style.label(*swept_label(record, found[1])) if s == 0 else "")
        ax.grid(visible=False)
        ax.patch.set(facecolor=MISSING, hatch="////", edgecolor="#6e6e6e", linewidth=0.0)
        is_empty |= bool(np.isnan(table).any())
    if is_empty:
        blank = Patch(facecolor=MISSING, hatch="////", edgecolor="#6e6e6e", label="no stated order")
        figure.legend(handles=[blank], loc="upper right", bbox_to_anchor=(0.99, 1.0))
    bar = figure.colorbar(image, cax=figure.add_axes((0.9, 0.15, 0.02, 0.73)), extend="both")
    bar.set_label(f"order of {words.symbol(quantity)} − promised order")
    return Picture(
        name=f"sweep_grid_{quantity}",
        title=f"Order over both swept parameters: {words.symbol(quantity)}",
        caption=f"White is the order that the scheme promises; the shades reach to {RANGE:g} on either side."
        + (" Hatched cells have no stated order." if is_empty else ""),
        alt=f"Map of the stated order of {words.name(quantity)} over two swept parameters",
        figure=figure,
    )
