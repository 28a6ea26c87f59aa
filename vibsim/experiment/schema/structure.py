"""The section ``model`` of a linear structure: matrices, damping, loads, initial values, observed displacements."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from vibsim.experiment.schema.fields import (
    FormulaText,
    Index,
    NonNegative,
    Number,
    Section,
    Text,
    by_form,
    short,
)
from vibsim.models.structure import MOST_OBSERVED

MOST_ROWS = 128  # largest number of rows of a matrix in the file; larger ones come from files
Row = Annotated[tuple[Number, ...], Field(min_length=1), short(MOST_ROWS)]


_Rows = Annotated[tuple[Row, ...], Field(min_length=1), short(MOST_ROWS)]
MatrixText: Any = by_form(
    {"text": Text, "rows": _Rows, "row": Row},
    "must be the name of a file, rows such as [[2, -1], [-1, 1]], or a diagonal such as [2, 1]",
)
"""A file, rows of numbers, or the diagonal alone."""
Entries = Annotated[dict[str, Number], Field(min_length=1)]
"""Values by degree of freedom, counted from 1."""


class Mode(Section):
    """The shape of a natural mode."""

    mode: Annotated[Index, Field(ge=1)]
    """number of the mode, from 1"""
    size: Number = 1.0
    """value of the first observed displacement in this shape"""


_VECTOR = "must be the name of a file, a list such as [0, 1], or numbers by degree of freedom such as {2: 1}"
VectorText: Any = by_form({"text": Text, "row": Row, "mapping": Entries}, _VECTOR)
"""A file, a list of numbers, or numbers by degree of freedom."""
StartText: Any = by_form(
    {"text": Text, "row": Row, "mapping": Entries, "mode": Mode},
    f"{_VECTOR}, or {{mode: 1, size: 1}}",
)


class Start(Section):
    """Initial displacement and velocity."""

    displacement: StartText | None = None
    """u(0); 0 when left out"""
    velocity: StartText | None = None
    """u'(0); 0 when left out"""


class Rayleigh(Section):
    """Rayleigh damping, ``alpha M + beta K``."""

    alpha: NonNegative = 0.0
    """factor of the mass matrix"""
    beta: NonNegative = 0.0
    """factor of the stiffness matrix"""


class LoadTable(Section):
    """A load over time from a table, interpolated linearly."""

    table: Text
    """path of a .csv or .nc file, relative to this file"""
    t: Text = "t"
    """name of the column of times in the table, or of the variable"""
    p: Text = "p"
    """name of the column of loads in the table, or of the variable"""


Factor: Any = by_form(
    {"mapping": LoadTable, "other": FormulaText}, "must be a formula, or {table: quake.csv}"
)


class ShapedLoad(Section):
    """A load with a fixed shape."""

    shape: VectorText
    """the load of every degree of freedom"""
    times: Factor
    """its factor, a formula in t and parameters, or a table"""


Load: Any = by_form(
    {"mapping": Annotated[dict[str, Factor], Field(min_length=1)], "shape": ShapedLoad},
    "must be formulas by degree of freedom such as {2: cos(t)}, or {shape: ..., times: ...}",
)
_Ratios = Annotated[tuple[NonNegative, ...], Field(min_length=1), short(MOST_ROWS)]
RatiosText: Any = by_form(
    {"other": NonNegative, "row": _Ratios}, "must be a number, or a list such as [0.02, 0.05]"
)
Observed: Any = by_form(
    {"other": Annotated[Index, Field(ge=1)], "mapping": Entries},
    "must be a degree of freedom, or factors of several such as {1: -1, 2: 1}",
)


class StructureSection(Section):
    """Linear structure: M u'' + C u' + K u = p(t), with matrices M, C and K."""

    kind: Literal["structure"]
    """Linear structure"""
    mass: MatrixText | None = None
    """M: a .mtx, .npy or .csv file, rows, or its diagonal; the identity when left out"""
    stiffness: MatrixText | None = None
    """K: a .mtx, .npy or .csv file, rows, or its diagonal"""
    damping: MatrixText | None = None
    """C: a .mtx, .npy or .csv file, rows, or its diagonal; 0 when left out"""
    rayleigh: Rayleigh | None = None
    """damping alpha M + beta K in addition to C"""
    damping_ratios: RatiosText | None = None
    """damping ratio of every mode, or those of the lowest modes, in addition to C"""
    load: Load | None = None
    """p(t): formulas in t and parameters or tables by degree of freedom, or a shape times one of them"""
    start: Start | None = None
    """displacement and velocity at t = 0, in place of initial"""
    observe: Annotated[dict[str, Observed], Field(min_length=1)] | None = Field(
        None,
        description="names of displacements that are stored: the number of a degree of freedom, or factors by "
        f"number; all degrees of freedom when left out, up to {MOST_OBSERVED}",
    )
    parameters: dict[str, Number] = Field({})
    """names that the formulas use, with their values"""
