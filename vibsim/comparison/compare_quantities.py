"""The quantities of a block of members, compared between its levels."""

from __future__ import annotations

import numpy as np

from vibsim.apriori.formal_orders import formal_orders
from vibsim.apriori.roundoff_floor import solution_size
from vibsim.comparison.phase_amplitude_error import error_parts_to_compare, parts_of_errors
from vibsim.comparison.quantity_comparison import (
    Compared,
    Comparison,
    interleaved,
    root_mean_square,
)
from vibsim.core.vocabulary import VECTORS
from vibsim.models.base import components
from vibsim.observe.member_block import MemberBlock, energy_at_start


def comparisons(block: MemberBlock, names: tuple[str, ...]) -> Compared:
    """Compare quantities between the levels of a part."""
    positions = block.model.positions
    error_parts = error_parts_to_compare(block, names)
    vectors = [name for name in names if name in VECTORS]
    names = tuple(name for name in names if name not in (*error_parts, *vectors))
    values = {name: block.series(name) for name in dict.fromkeys((*positions, *names))}
    # the size of an energy is its initial value plus its change
    change = solution_size(block.series("energy_deviation"))
    sizes = {"energy": np.abs(energy_at_start(block.finest)) + change}
    # rounding of one coordinate affects the others
    position_sizes = [block.size(name, values[name], sizes) for name in positions]
    sizes |= {name: np.asarray(np.maximum.reduce(position_sizes)) for name in positions}
    compared: dict[str, Comparison] = {}
    for name in names:
        scale = block.size(name, values[name], sizes)
        floor = block.floor_of(name, scale)
        attrs = block.finest.variables[name].attrs if name in block.finest else {}
        compared[name] = Comparison(
            block=block,
            name=name,
            long_name=str(attrs.get("long_name", name)),
            units=str(attrs.get("units", "1")),
            values=values[name],
            exact=block.exact_of(name),
            order=formal_orders(block.experiment, name, block.columns, block.eventless),
            floor=floor,
            scale=scale,
            blur=np.zeros_like(floor),
        )
    for name in vectors:
        parts = [compared[component] for component in components(block.model, name)]
        compared[name] = _vector(name, parts)
    return compared | parts_of_errors(block, compared, error_parts)


def _vector(name: str, parts: list[Comparison]) -> Comparison:
    """Compare all coordinates together: norms, and so orders and errors, are sums over them."""
    exact = [q.exact for q in parts if q.exact is not None]
    return Comparison(
        block=parts[0].block,
        name=name,
        long_name=f"{name.replace('_', ' ')}, of {len(parts)} coordinates",
        units=parts[0].units,
        values=[interleaved(series) for series in zip(*(q.values for q in parts), strict=True)],
        exact=interleaved(exact) if len(exact) == len(parts) else None,
        order=parts[0].order,
        floor=root_mean_square([q.floor for q in parts]),
        scale=root_mean_square([q.scale for q in parts]),
        blur=np.zeros_like(parts[0].floor),
        parts=tuple(parts),
    )
