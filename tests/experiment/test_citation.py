"""Sources: one line and five fields say the same, a user's own line stays as it is, and a faulty mapping is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from experiment_files import GOOD, file_faults, write

from vibsim.experiment import Experiment
from vibsim.experiment.citation import FIELDS, PLACES, fields, line

CONFIGS = Path(__file__).parents[2] / "configs"
A, B = "pendulum lecture", "vibration text"


def named(text: str, **places: str) -> dict[str, str | None]:
    return dict.fromkeys(FIELDS) | {"text": text} | places


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("pendulum lecture, section 2.5", named("pendulum lecture", section="2.5")),
        (f"{B}, sections 2.3 and 10.10", named(B, section="2.3 and 10.10")),
        (f"{B}, sections 4 to 7", named(B, section="4 to 7")),
        (
            f"{B}, section 10.2, equation (85), and exercise 18",
            named(B, section="10.2", equation="85", exercise="18"),
        ),
        (f"{B}, equations (91) to (94)", named(B, equation="91 to 94")),
        (f"{B}, section 8.7 and figure 11", named(B, section="8.7", figure="11")),
        (f"{B}, exercise 1 a-c, f and g", named(B, exercise="1 a-c, f and g")),
        (
            "Hairer, Lubich and Wanner, Geometric Numerical Integration, section IX.8",
            named("Hairer, Lubich and Wanner, Geometric Numerical Integration", section="IX.8"),
        ),
        *(
            (own, named(own))
            for own in (
                "my lecture notes",
                "section 3 of my notes",
                "my notes, section three",
                "my notes, exercise 3, section 2",
                "my notes, section 2; other notes, section 3",
                "my notes,\nsection 2",
            )
        ),
    ],
)
def test_a_line_is_read_by_its_fields_or_is_a_text_as_a_whole(
    source: str, found: dict[str, str | None]
) -> None:
    assert fields(source) == found
    # and the line that is written of the fields says the same
    assert fields(line(found)) == found


def test_no_source_has_no_fields() -> None:
    assert fields(None) is None


@pytest.mark.parametrize(
    ("written", "source"),
    [
        ("my lecture notes", "my lecture notes"),
        ("{text: my notes}", "my notes"),
        ('{text: my notes, section: "10.10"}', "my notes, section 10.10"),
        ('{exercise: "18 b", text: my notes, equation: "(85)"}', "my notes, equation (85), exercise 18 b"),
        ('{text: my notes, equation: "91 to 94"}', "my notes, equations (91) to (94)"),
    ],
)  # fmt: skip
def test_a_file_may_have_a_line_or_a_mapping(tmp_path: Path, written: str, source: str) -> None:
    assert Experiment.from_yaml(write(tmp_path, GOOD + f"source: {written}\n")).source == source


@pytest.mark.parametrize(
    ("written", "word"),
    [
        ("{text: my notes, section: 10.10}", 'section that is no text: write "..."'),
        ('{section: "2.5"}', "must name a text"),
        ('{text: "", section: "2.5"}', "must name a text"),
        ('{text: my notes, chapter: "2"}', "no others, has chapter"),
        ("{text: my notes, section: the second one}", "no number such as 10.2"),
        ("[my notes]", "must be text"),
    ],
)
def test_a_faulty_mapping_is_refused_at_its_line(tmp_path: Path, written: str, word: str) -> None:
    (fault,) = file_faults(tmp_path, GOOD + f"source: {written}\n")
    assert (fault.line, fault.key) == (7, "source")
    assert word in fault.rule


def sources(part: Any) -> list[str]:
    """Return every source within a file."""
    if isinstance(part, list):
        return [source for row in part for source in sources(row)]
    if isinstance(part, dict):
        own = [part["source"]] if "source" in part else []
        return own + [source for value in part.values() for source in sources(value)]
    return []


def test_every_shipped_source_of_the_two_texts_names_a_place() -> None:
    files = (path.read_text(encoding="utf-8") for path in CONFIGS.glob("*/*.yaml"))
    # the loader of the C library, where it is built in, reads the same ten times as fast
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    for source in (s for text in files for s in sources(yaml.load(text, loader))):
        found = fields(source)
        assert found is not None
        texts = (A, B, f"correction of the {A}", f"correction of the {B}")
        if any(text in source for text in texts):
            assert found["text"] in texts, source
            assert any(found[name] for name in PLACES), source
