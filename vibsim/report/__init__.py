"""From numbers to a page: figures, tables, one self-contained report, and an index over all of them.

The only input is what the analysis stored: the convergence Record and the summary. Matplotlib and jinja2 are imported
where they are used, so that importing this package is fast.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.report.page.index import write_index
    from vibsim.report.page.page import write

__all__ = ["write", "write_index"]

__getattr__, __dir__ = lazy(__name__, {".page.page": ("write",), ".page.index": ("write_index",)})
