"""Find the experiments that a user names: by file, by name, or by collection; with ``@CASE``, one member alone."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from vibsim.core.errors import MOST_CHOICES, Fault, InputError, likely, listed, nearest
from vibsim.experiment.collection import ADHOC, ENDINGS, collection_of

DEFAULT = ("pendulum_lab", "showcase")
MAX_DIGITS = 18
"""Most digits of the number of a member."""


@dataclass(frozen=True)
class Choice:
    """An experiment file and the collection it belongs to."""

    collection: str
    file: Path
    case: int | None = None
    """The only member of the sweep that is chosen; None for all members."""
    settings: tuple[str, ...] = ()
    """Values that replace those of the file, as ``KEY=VALUE`` (`vibsim.experiment.settings`)."""

    @property
    def name(self) -> str:
        """Name of the experiment; for one member the name that `vibsim.experiment.Experiment.alone` gives."""
        return self.file.stem if self.case is None else f"{self.file.stem}_case_{self.case}"

    @property
    def key(self) -> str:
        """Name of the experiment, unique among all collections: ``collection/name``."""
        return f"{self.collection}/{self.name}"

    @property
    def word(self) -> str:
        """The command-line argument that chooses this experiment."""
        return str(self.file) if self.case is None else f"{self.file}@{self.case}"


def experiments(root: Path) -> list[Choice]:
    """Return every experiment in the collections of the folder `root` (`vibsim.core.home.home`), sorted by path."""
    return [_choice(file, root) for file in sorted((root / "configs").glob("*/*.yaml"))]


def choose(words: Sequence[str], root: Path, settings: Sequence[str] = ()) -> list[Choice]:
    """Find the experiments that `words` name, each once, in the order of the words.

    A word is a file, the name of an experiment (``name`` or ``collection/name``) or a collection. Without words the
    default collections are chosen. A file or a name followed by ``@`` and a number means one member of the sweep. Names
    are those of the experiments in `root`. The `settings` apply to every experiment.

    Raises
    ------
    InputError
        Lists every word that names nothing, and every pair of files that would share a name.
    """
    known = experiments(root)
    if not words:
        words = [c for c in DEFAULT if any(k.collection == c for k in known)]
    chosen: dict[tuple[Path, int | None], Choice] = {}
    faults: list[Fault] = []
    for word in words:
        choices, rule = _find_member(word, known, root)
        if rule:
            faults.append(Fault(word, 0, "", "", *rule))
        chosen.update(((choice.file, choice.case), choice) for choice in choices)
    faults.extend(_clashes(list(chosen.values())))
    if faults:
        raise InputError(faults)
    return [replace(choice, settings=tuple(settings)) for choice in chosen.values()]


Match = tuple[list[Choice], tuple[str, str] | None]
"""The experiments that a word names, or the rule that the word breaks and a hint."""


def _find_member(word: str, known: list[Choice], root: Path) -> Match:
    """Find what `word` names, which may be one member of a sweep."""
    name, at, case = word.rpartition("@")
    if not at or word.endswith(ENDINGS):
        return _find(word, known, root)
    if not (case.isascii() and case.isdigit() and len(case) <= MAX_DIGITS):
        return [], ("a member is named by @ and its number, from 0", f"e.g. {name}@0")
    if collection := [choice for choice in known if choice.collection == name]:
        return [], ("a collection has no members", _list(collection))
    choices, rule = _find(name, known, root)
    return [replace(choice, case=int(case)) for choice in choices], rule


def _find(word: str, known: list[Choice], root: Path) -> Match:
    if word.endswith(ENDINGS):
        return [_choice(Path(word), root)], None
    collection = [choice for choice in known if choice.collection == word]
    choices = collection or [choice for choice in known if word in (choice.key, choice.name)]
    if len(choices) > 1 and not collection:
        return [], ("is the name of several experiments", _list(choices))
    if choices:
        return choices, None
    if os.path.lexists(word):
        return [], ("a file of an experiment must end in .yaml or .yml", "")
    names = [*dict.fromkeys(c.collection for c in known), *(c.key for c in known)]
    names += [c.name for c in known]
    rule = "is not an experiment, a collection or a YAML file"
    hint = nearest(word, names) if known else ""
    if len(names) > MOST_CHOICES and not likely(word, names):
        hint = "`vibsim list experiments` shows all"
    file = f"{word.removeprefix(f'{ADHOC}/')}{ENDINGS[0]}"
    if word.startswith(f"{ADHOC}/") or Path(file).is_file():
        hint = f"an experiment of your own is named by its file, such as {file}"
    return [], (rule, hint)


def _choice(file: Path, root: Path) -> Choice:
    return Choice(collection_of(file, root / "configs"), file.absolute())


def _clashes(choices: list[Choice]) -> Iterator[Fault]:
    first: dict[str, Choice] = {}
    for choice in choices:
        other = first.setdefault(choice.key, choice)
        if os.path.realpath(other.file) != os.path.realpath(choice.file):
            rule = "two experiments of one collection cannot share a name"
            yield Fault(str(choice.file), 0, "", choice.name, rule, f"the other is {other.file}")


def _list(choices: list[Choice]) -> str:
    return listed([choice.key for choice in choices])
