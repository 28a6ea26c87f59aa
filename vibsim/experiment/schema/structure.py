"""The section ``model`` of a linear structure as written: matrices, damping, loads, the start, what is observed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field

from vibsim.experiment.schema.fields import (
    FormulaText,
    Index,
    NonNegative,
    Number,
    Section,
    Text,
    short,
    tag,
    tagged,
)
from vibsim.models.structure import MOST_OBSERVED

MOST_ROWS = 128
"""Rows of a matrix that is written in the experiment file, at most: larger ones come from files."""
FILES = "a .mtx, .npy or .csv file"
Row = Annotated[tuple[Number, ...], Field(min_length=1), short(MOST_ROWS)]


def _shape(value: Any) -> str:
    """Return what is written: a number, a text, a mapping, a list of rows, or a list of numbers."""
    if isinstance(value, Mapping | Section):
        return tag("mapping")
    if isinstance(value, list | tuple):
        return tag("rows" if value and isinstance(value[0], list | tuple) else "row")
    return tag("file" if isinstance(value, str) else "number")


_Rows = Annotated[tuple[Row, ...], Field(min_length=1), short(MOST_ROWS)]
MatrixText: Any = tagged({"file": Text, "rows": _Rows, "row": Row}, Discriminator(_shape))
"""A file, rows of numbers, or the diagonal alone."""
Entries = Annotated[dict[str, Number], Field(min_length=1)]
"""Values by degree of freedom, counted from 1."""


class Mode(Section):
    """The shape of a natural mode."""

    mode: Annotated[Index, Field(ge=1, description="number of the mode, from 1")]
    size: Annotated[Number, Field(default=1.0, description="largest entry of its shape")]


def _vector_shape(value: Any) -> str:
    is_mode = isinstance(value, Mode) or (isinstance(value, Mapping) and "mode" in value)
    return tag("mode") if is_mode else _shape(value)


VectorText: Any = tagged({"file": Text, "row": Row, "mapping": Entries}, Discriminator(_shape))
"""A file, a list of numbers, or numbers by degree of freedom."""
StartText: Any = tagged(
    {"file": Text, "row": Row, "mapping": Entries, "mode": Mode}, Discriminator(_vector_shape)
)


class Start(Section):
    """How the motion begins."""

    displacement: Annotated[
        StartText | None, Field(default=None, description="u(0); 0 when left out")
    ]
    velocity: Annotated[StartText | None, Field(default=None, description="u'(0); 0 when left out")]


class Rayleigh(Section):
    """Rayleigh damping, ``alpha M + beta K``."""

    alpha: Annotated[NonNegative, Field(default=0.0, description="factor of the mass matrix")]
    beta: Annotated[NonNegative, Field(default=0.0, description="factor of the stiffness matrix")]


class ShapedLoad(Section):
    """A load of one shape."""

    shape: Annotated[VectorText, Field(description="the load of every degree of freedom")]
    times: Annotated[FormulaText, Field(description="its factor, a formula in t and parameters")]


def _load_shape(value: Any) -> str:
    is_shaped = isinstance(value, ShapedLoad) or (isinstance(value, Mapping) and "shape" in value)
    return tag("shaped" if is_shaped else "each")


Load: Any = tagged(
    {
        "each": Annotated[dict[str, FormulaText], Field(min_length=1)],
        "shaped": ShapedLoad,
    },
    Discriminator(_load_shape),
)
_Ratios = Annotated[tuple[NonNegative, ...], Field(min_length=1), short(MOST_ROWS)]


RatiosText: Any = tagged({"number": NonNegative, "row": _Ratios}, Discriminator(_shape))


def _sum_shape(value: Any) -> str:
    return tag("sum" if isinstance(value, Mapping) else "one")


Observed: Any = tagged(
    {"one": Annotated[Index, Field(ge=1)], "sum": Entries}, Discriminator(_sum_shape)
)


class StructureSection(Section):
    """Linear structure: M u'' + C u' + K u = p(t), with matrices M, C and K."""

    kind: Annotated[Literal["structure"], Field(description="Linear structure")]
    mass: Annotated[
        MatrixText | None,
        Field(
            default=None,
            description=f"M: {FILES}, rows, or its diagonal; the identity when left out",
        ),
    ]
    stiffness: Annotated[
        MatrixText | None, Field(default=None, description=f"K: {FILES}, rows, or its diagonal")
    ]
    damping: Annotated[
        MatrixText | None,
        Field(default=None, description=f"C: {FILES}, rows, or its diagonal; 0 when left out"),
    ]
    rayleigh: Annotated[
        Rayleigh | None, Field(default=None, description="damping alpha M + beta K beside C")
    ]
    damping_ratios: Annotated[
        RatiosText | None,
        Field(
            default=None,
            description="damping ratio of every mode, or those of the lowest modes, beside C",
        ),
    ]
    load: Annotated[
        Load | None,
        Field(
            default=None,
            description="p(t): formulas in t and parameters by degree of freedom, or a shape times one formula",
        ),
    ]
    start: Annotated[
        Start | None,
        Field(default=None, description="displacement and velocity at t = 0, in place of initial"),
    ]
    observe: Annotated[
        dict[str, Observed] | None,
        Field(
            default=None,
            min_length=1,
            description="names of displacements that are stored: the number of a degree of freedom, or factors by "
            f"number; all of them when left out, up to {MOST_OBSERVED}",
        ),
    ]
    parameters: Annotated[
        dict[str, Number],
        Field(default={}, description="names that the formulas use, with their values"),
    ]
