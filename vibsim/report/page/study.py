"""The page on ladders of any solver: a self-contained file, and the verdicts as JSON beside it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

from vibsim import store
from vibsim.convergence import LadderVerdict
from vibsim.convergence.study.figure import convergence_figure, shows_curves
from vibsim.convergence.study.notation import digits_of_values, number
from vibsim.core.vocabulary import worst
from vibsim.report import style, words
from vibsim.report.page.templates import environment, sealed
from vibsim.report.style import Picture
from vibsim.report.tables.best import rounded
from vibsim.report.tables.table import Column, Filled, Table, Written, filled
from vibsim.report.text import findings

UNSEEN = (
    "Levels can agree with each other and still approach a wrong answer. Only an exact solution shows that, and none "
    "was given."
)
NO_BEST = "the levels do not tell it"
CAPTION = (
    "Both axes are logarithmic: an error of order p is a line of slope p. The dashed line has the "
    "{word} slope {order}."
)
CURVES = (
    "On the right, each difference of two levels is rescaled to the error that it predicts for the finest level. The "
    "curves coincide where the error has order {order}."
)


@style.applied()
def write(
    verdicts: Sequence[LadderVerdict],
    sources: Sequence[Sequence[str]],
    directory: Path,
    content: Mapping[str, Any],
) -> None:
    """Write ``report.html``, and ``verdict.json`` with the `content` that the command prints.

    There is one verdict for each quantity; `sources` are the names of the files that each was read from.
    """
    cards = [
        card(str(i), verdict, _expectation(verdict), files)
        for i, (verdict, files) in enumerate(zip(verdicts, sources, strict=True))
    ]
    context = {
        "status": worst(verdict.status for verdict in verdicts),
        "counts": words.passed([verdict.status for verdict in verdicts], "quantity", "quantities"),
        "path": "vibsim judge",
        "title": "Convergence study",
        "finding": finding(verdicts),
        "cards": cards,
        "facts": "verdict.json",
    }
    page = environment().get_template("study.html").render(context)
    store.write_text(directory / "report.html", sealed(page))
    text = json.dumps(content, indent=1, ensure_ascii=False)
    store.write_text(directory / "verdict.json", text + "\n")


def finding(verdicts: Sequence[LadderVerdict]) -> str:
    """Return the finding on the decisive quantity: the first of the worst."""
    status = worst(verdict.status for verdict in verdicts)
    return findings.of_ladder(next(verdict for verdict in verdicts if verdict.status == status))


def numbers(verdict: LadderVerdict) -> list[dict[str, str]]:
    """Return the large numbers of a ladder: the order, the error of the finest level, the best value of a number."""
    span = words.likely((verdict.order_low, verdict.order_high))
    expected, wanted = verdict.expected or verdict.at_least, ""
    if expected is not None:
        wanted = f"expected{'' if verdict.expected else ' at least'}: {expected:g}"
    share, bound = verdict.relative_error, verdict.best_bound
    size = None if verdict.error is None else abs(verdict.error)
    of_size = f"{words.share(share)} of its size" if share is not None else ""
    best = NO_BEST if bound is None else f"± {words.number(bound, 'brief')}, extrapolated"
    of_order = "; ".join(filter(None, [span, wanted]))
    rows = [
        ("Observed order", words.number(verdict.order, "order"), of_order),
        ("Error of the finest level", words.number(size, "brief"), of_size),
    ]
    if verdict.is_number:
        rows.append(("Best value", _best(verdict), best))
    return [
        {"label": label, "value": value if value != "–" else "not known", "note": note}
        for label, value, note in rows
    ]


def _best(verdict: LadderVerdict) -> str:
    """Write the best value with the digits that its bound supports."""
    if verdict.best is None or verdict.best_bound is None:
        return words.number(verdict.best, "value")
    return rounded(verdict.best, verdict.best_bound).text


def _expectation(verdict: LadderVerdict) -> str:
    if verdict.expected is not None:
        return f"order {verdict.expected:g}"
    if verdict.at_least is not None:
        return f"order {verdict.at_least:g} at least"
    return "no order, so any that may be believed passes"


def card(name: str, verdict: LadderVerdict, expected: str, files: Sequence[str]) -> dict[str, Any]:
    """Return the card of a quantity; `name` is unique on the page."""
    rows = [
        ("Expected", expected),
        ("Order", words.with_interval(verdict.order, (verdict.order_low, verdict.order_high))),
        ("Levels used", ", ".join(words.number(h, "step") for h in verdict.h_used) or "–"),
        ("Error of the finest level", words.number(verdict.error, "small")),
        ("Its bound (95 %)", words.number(verdict.error_bound, "small")),
        ("Relative error", words.number(verdict.relative_error, "small")),
        ("Extrapolated value", words.number(verdict.best, "full")),
        ("Its bound", words.number(verdict.best_bound, "small")),
        ("Grid convergence index", words.number(verdict.gci, "small")),
        ("Reason", verdict.reason),
        *([("Files" if len(files) > 1 else "File", ", ".join(files))] if files else []),
    ]
    return {
        "heading": verdict.quantity,
        "verdict": verdict,
        "sentence": words.PAGE.powers(verdict.sentence),
        "facts": rows,
        "numbers": numbers(verdict),
        "table": _table(verdict),
        "picture": _picture(name, verdict),
        # the heading of the card that shows the same ladder
        "above": "",
        "doubt": UNSEEN if verdict.status == "PASS" and not verdict.is_exact_known else "",
    }


def _table(verdict: LadderVerdict) -> Table:
    value = "value" if verdict.is_number else "norm"
    digits = digits_of_values(row.value for row in verdict.levels) if verdict.is_number else 4
    error = "error" if verdict.is_exact_known else "estimated error"
    columns: list[Filled] = [
        (Column(verdict.size_name, form="step"), attrgetter("h")),
        (Column(value, form="full"), lambda row: _value(row.value, digits)),
        (Column(error, form="small"), attrgetter("error")),
        (Column("difference", form="small"), attrgetter("difference")),
        (Column("ratio", form="norm"), attrgetter("ratio")),
        (Column("order", form="order"), attrgetter("order")),
    ]
    caption = (
        "Levels, the coarsest first. The difference is that to the next finer level, the ratio is this difference over "
        "the next one, and the order follows from the ratio and the step sizes."
    )
    if not verdict.is_number:
        caption += " Norms are root mean squares over the common points."
    return filled("levels", caption, columns, verdict.levels)


def _value(value: float | None, digits: int) -> Written | None:
    return None if value is None else Written(value, words.printed(number(value, digits)))


def _picture(name: str, verdict: LadderVerdict) -> Picture:
    expected = verdict.expected or verdict.at_least
    order = expected or verdict.order
    caption = ""
    if order is not None and order > 0.0:
        word = "expected" if expected else "observed"
        caption = CAPTION.format(word=word, order=f"{order:.3g}")
        if shows_curves(verdict):
            caption += " " + CURVES.format(order=f"{order:.3g}")
    alt = f"Error and difference of {verdict.quantity} against {verdict.size_name}. {verdict.sentence}"
    return Picture(f"study-{name}", "", caption, alt, convergence_figure(verdict))
