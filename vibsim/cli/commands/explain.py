"""``vibsim explain``: what the reason of a verdict means, and what would settle the question.

The texts are those of the reports (`vibsim.report.text.reasons`).
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from typing import TYPE_CHECKING

from vibsim.cli import terminal
from vibsim.cli.jobs.common import refusal
from vibsim.cli.list_entry import laid_out
from vibsim.core.errors import nearest
from vibsim.core.vocabulary import DECISIVE, REASONS, STATUSES

if TYPE_CHECKING:
    from vibsim.report.text.reasons import Reason


def explain(options: Namespace) -> int:
    """Explain one reason; without one, list all of them with their statuses."""
    if options.reason is None:
        width = max(map(len, REASONS))
        for status in STATUSES:
            for word in (word for word, own in REASONS.items() if own == status):
                print(f"{word.ljust(width)}  {terminal.painted(status, status)}")
        return 0
    if options.reason not in REASONS:
        hint = nearest(options.reason, list(REASONS))
        raise refusal("REASON", options.reason, "is not a reason of a verdict", hint)
    print(*_lines(options.reason), sep="\n")
    return 0


def _lines(word: str) -> Iterator[str]:
    status = REASONS[word]
    yield f"{terminal.painted(word, 'bold')}: {terminal.painted(status, status)}"
    for head, (meaning, needs) in meanings(word):
        yield ""
        yield from laid_out([("meaning", f"{head}{meaning}"), ("needed", needs)])
    yield "\nMore: docs/verdicts.md, section Reasons"


def meanings(word: str) -> Iterator[tuple[str, Reason]]:
    """Yield an introduction and the meaning of a reason: the general one, then those for some kinds of checks."""
    from vibsim.report.text.reasons import REASONS as EXPLAINED
    from vibsim.report.text.reasons import reason

    general = EXPLAINED[word]
    yield "", general
    kinds_by_reason: dict[Reason, list[str]] = {}
    for kind in DECISIVE:
        kinds_by_reason.setdefault(reason(word, kind), []).append(f"`{kind}`")
    for special, kinds in kinds_by_reason.items():
        if special != general:
            yield f"For {', '.join(kinds)}: ", special
    promised = reason(word, "converges", is_promised=True)
    if promised != general:
        yield "Where the scheme promises that order: ", promised
