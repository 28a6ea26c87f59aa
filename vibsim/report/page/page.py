"""The report of one experiment: a self-contained page, with its figures and tables as files beside it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from vibsim import store
from vibsim.core.errors import VibsimError, nearest
from vibsim.core.home import called, home, is_installed
from vibsim.core.record import Record
from vibsim.core.set_option import command_to_run
from vibsim.core.vocabulary import FIGURE_FORMATS
from vibsim.experiment.collection import ADHOC, ENDINGS
from vibsim.report import choice, style
from vibsim.report.choice import CheckedLadder
from vibsim.report.data import Results
from vibsim.report.figures import of_source
from vibsim.report.page import cards, hero, page_figures, page_tables, player
from vibsim.report.page.templates import environment, markup, sealed
from vibsim.report.tables import members
from vibsim.report.text import equation, experiment_file, setting
from vibsim.report.types import Experiment, Plan

NOTHING: Mapping[str, Any] = {}
PYTHON = """\
from vibsim import Experiment, analyse, simulate, verdicts

experiment = Experiment.from_yaml("{file}"{given}){alone}
convergence = analyse(experiment, {{level: simulate(experiment, level) for level in experiment.levels}})
for verdict in verdicts(experiment, convergence):
    print(verdict.id, verdict.status, verdict.reason)"""


@style.applied()
def write(
    plan: Plan,
    convergence: Record,
    summary: Mapping[str, Any],
    directory: Path,
    formats: Sequence[str] = ("svg",),
    provenance: Mapping[str, Any] = NOTHING,
) -> None:
    """Write ``report.html``, ``figures/`` and ``tables/`` of one experiment.

    Parameters
    ----------
    plan
        The plan of the experiment; its ``experiment`` is read.
    convergence
        The results of the analysis, as stored in ``convergence.nc``.
    summary
        The verdicts, as stored in ``summary.json``.
    directory
        Folder of the experiment's results.
    formats
        Of ``svg``, ``png``, ``pdf``; SVG is always written, the others are written beside it.
    provenance
        The origin of the results: digests, versions, the part of the experiment that the job used.

    Raises
    ------
    VibsimError
        For a format that does not exist.
    """
    unknown = [form for form in formats if form not in FIGURE_FORMATS]
    if unknown:
        raise VibsimError(f"figure format '{unknown[0]}': {nearest(unknown[0], FIGURE_FORMATS)}")
    record = Results.of(plan.experiment, convergence)
    lead = choice.find_lead(record, summary)
    files, sources, figures = page_figures.draw(lead, formats)
    replace_files(directory / "figures", files)
    texts, tables = page_tables.collect(summary, lead, sources)
    _write_tables(directory / "tables", texts, record)
    played = player.element(record)
    page = environment().get_template("report.html").render(
        hero.context(summary, lead)
        | figures
        | tables
        | _checks(summary, lead, has_picture="hero_evidence.svg" in files)
        | _setup(record)
        | {
            "collection": plan.experiment.collection,
            "name": plan.experiment.name,
            "title": plan.experiment.title,
            "status": summary["status"],
            "undrawn": of_source.undrawn(sources, has_player=bool(played)),
            "player_source": of_source.of_player(plan.experiment),
            "player": markup(played),
            "provenance": list(cards.provenance_rows(provenance)),
        }
    )  # fmt: skip
    store.write_text(directory / "report.html", sealed(page))


def _write_tables(directory: Path, texts: Mapping[str, Mapping[str, str]], record: Results) -> None:
    """Write the files of tables; the file of members always holds all members of a sweep."""
    files, streamed = page_tables.files_of(texts), list[str]()
    if record.swept:
        streamed = ["members.csv"]
        members.write_csv(directory / streamed[0], record)
        files.pop(streamed[0], None)
    replace_files(directory, files, streamed)


def _checks(
    summary: Mapping[str, Any], lead: CheckedLadder, *, has_picture: bool
) -> dict[str, Any]:
    """Return the section of checks; with `has_picture`, the first screen has the picture of the decisive check."""
    made = cards.cards(lead.record, summary)
    decides = lead.entry.get("id")
    if has_picture:
        made = [card | {"picture": None} if card["id"] == decides else card for card in made]
    alone, alike = cards.gathered(made, decides)
    return {
        "lead": next((card for card in made if card["id"] == decides), None),
        "checks": alone,
        "alike": alike,
        "reading_of_checks": _reading_of_checks(alone),
    }


def _reading_of_checks(made: Iterable[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Return one caption for the pictures of each kind of check that passed."""
    found: dict[str, str] = {}
    for check in made:
        if check["picture"] and check["status"] == "PASS":
            found.setdefault(check["measures"], check["picture"].caption)
    return list(found.items())


def _setup(record: Results) -> dict[str, Any]:
    """Return the section on the setup of the run and how to reproduce it."""
    experiment = record.experiment
    return {
        "equation": equation.mathml(record.model.equation),
        "setup": list(setting.setup(record)),
        "experiment_file": experiment_file.text(experiment),
        "experiment_shown": experiment_file.shown(experiment),
        "command": called(command_to_run(experiment.word, experiment.settings)),
        "python": _python(experiment),
    }


def _python(experiment: Experiment) -> str:
    """Return Python code equivalent to the command."""
    word, is_ours = experiment.word, experiment.collection != ADHOC
    file, at, case = word.rpartition("@")
    if not at or word.endswith(ENDINGS):
        file, case = word, ""
    named = f"configs/{file}.yaml" if is_ours else file
    if is_ours and is_installed():
        named = str(home() / named)
    settings = experiment.settings
    given = f", settings={json.dumps(settings, ensure_ascii=False)}" if settings else ""
    return PYTHON.format(file=named, given=given, alone=f".alone({case})" if case else "")


def replace_files(directory: Path, files: Mapping[str, bytes], others: Sequence[str] = ()) -> None:
    """Write files, and remove all others of an earlier report except the `others`."""
    for name, content in files.items():
        store.write_bytes(directory / name, content)
    for path in directory.iterdir() if directory.is_dir() else ():
        if path.is_file() and path.name not in {*files, *others}:
            path.unlink()
