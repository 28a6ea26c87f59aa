"""The YAML that is read, and the YAML that is refused."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest
from experiment_files import GOOD, file_faults, write

from vibsim.core.errors import InputError
from vibsim.experiment import Experiment
from vibsim.experiment.yaml.file_content import MAX_BYTES
from vibsim.experiment.yaml.parse import dotted, parse, resolve


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),
        ("1.", 1.0),
        (".5", 0.5),
        ("1E5", 1e5),
        ("+.5e+2", 50.0),
        ("-3", -3),
        ("010", 10),
        ("0o17", 15),
        ("0x1F", 31),
        ("yes", "yes"),
        ("No", "No"),
        ("on", "on"),
        ("OFF", "OFF"),
        ("y", "y"),
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("2001-01-01", "2001-01-01"),
        ("true", True),
        ("false", False),
        ("null", None),
        ("~", None),
        ("", None),
        (".inf", math.inf),
        ("-.INF", -math.inf),
        ("1e", "1e"),
        (".", "."),
        ("\u0661", "\u0661"),
        ("9" * 5000, math.inf),
    ],
)
def test_core_schema(text: str, value: object) -> None:
    found = resolve(text)
    assert found == value
    assert type(found) is type(value)


def test_nan_is_a_float() -> None:
    assert math.isnan(resolve(".nan"))  # type: ignore[arg-type]


def test_quoted_is_text() -> None:
    assert parse(b"a: '1'\nb: \"true\"\nc: |\n  1\nd: 1", "f").data == {
        "a": "1",
        "b": "true",
        "c": "1\n",
        "d": 1,
    }


def test_aliases_and_byte_order_mark() -> None:
    assert parse(b"\xef\xbb\xbfa: &x [1, 2]\nb: *x\n", "f").data == {"a": [1, 2], "b": [1, 2]}


def test_places() -> None:
    source = parse(b"a: 1\nb:\n  - x\n  -\n    c:\n      7\n", "f")
    place = source.place(("b", 1, "c"))
    assert place is not None
    assert (place.key_line, place.line, place.text) == (5, 6, "7")
    assert source.place(("b", 2)) is None
    assert source.place(("a", "deeper")) is None
    assert dotted(("b", 1, "c")) == "b[1].c"


LAUGHS = "a: &a [1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"{new}: &{new} [*{old},*{old},*{old},*{old},*{old}]\n"
    for old, new in zip("abcdefghi", "bcdefghij", strict=True)
)


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        ("a: 1\nb: [1, 2\n", 3, "not valid YAML"),
        ("a: 1\n\tb: 2\n", 2, "not valid YAML"),
        ("a: 'x\n", 2, "not valid YAML"),
        ("title: 1\nb: 2\ntitle: 3\n", 3, "duplicate key, first on line 1"),
        ("time:\n  x: 1\n  'x': 2\n", 3, "duplicate key, first on line 2"),
        ("title: 1\nb: !!float 2\n", 2, "tags are not allowed"),
        ("title: 1\nb: !!python/object/apply:os.getcwd []\n", 2, "tags are not allowed"),
        ("title: ! b\n", 1, "tags are not allowed"),
        ("a: 1\n---\nb: 2\n", 2, "one YAML document"),
        ("a: 1\nb: *x\n", 2, "alias"),
        ("a: &x [*x]\n", 1, "alias"),
        ("a: &x 1\nb: [" + "*x, " * 51 + "]\n", 2, "more than 50 aliases"),
        (LAUGHS, 7, "more than 200000 values"),
        ("<<: &x {a: 1}\ntime: {<<: *x}\n", 1, "unknown key"),
        ("? [1, 2]\n: 3\n", 1, "key must be plain text"),
        ("? {a: 1}\n: 3\n", 1, "key must be plain text"),
        ("- 1\n- 2\n", 1, "must be a mapping"),
        ("\n\njust text\n", 3, "must be a mapping"),
        ("", 0, "must be a mapping"),
        ("# nothing\n", 0, "must be a mapping"),
        ("a: " + "[" * 40 + "]" * 40, 1, "nest deeper than 32"),
        ("[" * 100_000, 1, "nest deeper than 32"),
        ("{a: " * 100_000, 1, "nest deeper than 32"),
        ("- " * 50_000, 1, "nest deeper than 32"),
        ("b: 1\na: \x07\n", 2, "plain text"),
        ("a: \x00\n", 1, "plain text"),
        (b"a: 1\nb: \xff\n", 2, "UTF-8"),
        ("a: 1\n".encode("utf-16"), 1, "UTF-8"),
        (b"#" * (MAX_BYTES + 1), 0, "larger than 1048576 bytes"),
    ],
)
def test_refused(tmp_path: Path, text: str | bytes, line: int, word: str) -> None:
    faults = file_faults(tmp_path, text)
    assert any(word in fault.rule for fault in faults), faults
    hit = next(fault for fault in faults if word in fault.rule)
    assert hit.line == line


def test_every_duplicate_is_named(tmp_path: Path) -> None:
    faults = file_faults(tmp_path, GOOD + "title: again\nmodel: {kind: pendulum, g: 1, g: 2}\n")
    assert [(f.line, f.key) for f in faults] == [(7, "title"), (8, "model"), (8, "model.g")]


def test_missing_file_folder_and_odd_names(tmp_path: Path) -> None:
    for path in (tmp_path / "none.yaml", tmp_path, tmp_path / ("x" * 300), Path("a\0b")):
        with pytest.raises(InputError, match="cannot be read"):
            Experiment.from_yaml(path)


def test_unreadable_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = write(tmp_path, GOOD)
    monkeypatch.setattr("os.open", refuse)
    with pytest.raises(InputError, match="Permission denied"):
        Experiment.from_yaml(path)


def test_a_file_that_is_not_there_has_the_nearest_name_beside_it(tmp_path: Path) -> None:
    for name in ("pendulum.yaml", "pendulun.csv", "x.yaml"):
        (tmp_path / name).touch()
    for name, hint in (("pendulm", "did you mean 'pendulum.yaml'?"), ("road", ""), ("no/x", "")):
        with pytest.raises(InputError) as caught:
            Experiment.from_yaml(tmp_path / f"{name}.yaml")
        (fault,) = caught.value.faults
        assert (fault.rule, fault.hint) == ("cannot be read (No such file or directory)", hint)


def test_what_is_no_file_is_refused_without_reading_it(tmp_path: Path) -> None:
    (tmp_path / "endless.yaml").symlink_to("/dev/zero")
    (tmp_path / "circle.yaml").symlink_to("circle.yaml")
    os.mkfifo(tmp_path / "pipe.yaml")
    for name in ("endless", "pipe", "circle"):
        with pytest.raises(InputError, match="cannot be read"):
            Experiment.from_yaml(tmp_path / f"{name}.yaml")


def test_duplicate_keys_and_tags_hide_no_other_fault(tmp_path: Path) -> None:
    text = GOOD.replace("1.0}", "x}").replace("[central]", "[!!str central]")
    faults = file_faults(tmp_path, text + "time: {end: -1}\nextra: 1\n")
    assert [(f.line, f.key) for f in faults] == [
        (3, "initial.theta"),
        (6, "schemes[0]"),
        (7, "time"),
        (8, "extra"),
    ]
    faults = file_faults(tmp_path, GOOD + "title: again\nb: [1\n")
    assert [f.rule for f in faults] == ["duplicate key, first on line 1", "is not valid YAML"]


def test_endless_duplicates_are_not_listed_without_end(tmp_path: Path) -> None:
    faults = file_faults(tmp_path, GOOD + "title: again\n" * 5000)
    assert len(faults) == 1001
    assert any("more faults" in fault.rule for fault in faults)


def test_a_tab_is_named(tmp_path: Path) -> None:
    (fault,) = file_faults(tmp_path, "a:\n\tb: 1\n")
    assert (fault.line, fault.hint) == (2, "use spaces")
    assert "tabs are not allowed for indentation" in fault.rule


@pytest.mark.parametrize(
    ("text", "line", "hint"),
    [
        ("model:\n  kind:spring\n  w: 1\n", 3, "a colon needs a blank behind it, on line 2"),
        ("model:\n  kind: spring\n    w: 1\n", 3, "it is indented further than line 2"),
        ("model:\n  kind: spring\n title: a\n", 3, "line 3 begins in another column"),
        ("checks:\n  - {a: 1}\n  b: 1\n", 3, "line 3 is in a list: begin it with `- `"),
        ("title: Sheet 1: a start\n", 1, "a text with a colon and a blank in it needs quotation"),
        ("initial: {u: 1\ntime: {end: 2}\n", 2, "the bracket that opens on line 1 is not closed"),
        ("title: 'a\ntime: {end: 2}\n", 3, "the quotation mark that opens on line 1 is not"),
    ],
)
def test_a_slip_of_syntax_is_said_in_plain_words(
    tmp_path: Path, text: str, line: int, hint: str
) -> None:
    (fault,) = file_faults(tmp_path, text)
    assert (fault.line, fault.rule) == (line, "is not valid YAML")
    assert fault.hint.startswith(hint)


@pytest.mark.parametrize("name", ["[q{i}]", "{q{i+1}: 1}", "[a, x{row-2}]"])
def test_an_index_inside_brackets_is_sent_into_quotation_marks(tmp_path: Path, name: str) -> None:
    (fault,) = file_faults(tmp_path, f"model:\n  names: {name}\n")
    assert (fault.line, fault.rule) == (2, "is not valid YAML")
    assert 'write "q{i}" there' in fault.hint


@pytest.mark.parametrize("number", ["010", "00", "-07", "+012", "01.5", "00e1", "0777", "09"])
@pytest.mark.parametrize(
    "text", ["levels: [6, N]", "levels: {from: 6, to: N}", "initial: {theta: N}"]
)
def test_a_number_with_a_needless_0_is_refused(tmp_path: Path, text: str, number: str) -> None:
    section = text.partition(":")[0]
    kept = [line for line in GOOD.splitlines() if not line.startswith(section)]
    kept.append(text.replace("N", number))
    (fault,) = file_faults(tmp_path, "\n".join(kept) + "\n")
    assert (fault.line, fault.value) == (6, number)
    assert fault.key.startswith(section)
    assert fault.rule == "a number must not begin with 0, which some read as octal"


def test_numbers_are_read_as_yaml_has_them(tmp_path: Path) -> None:
    levels = Experiment.from_yaml(
        write(tmp_path, GOOD.replace("{from: 6, to: 9}", "[0o1, 0o7, 0x8, 9.0, 0.1e2]"))
    ).levels
    assert levels == (1, 7, 8, 9, 10)


@pytest.mark.parametrize(
    "number", ["1_0", "1:30", "yes", "true", "~", "0b11", "1e1_0", "1,5", "'7'"]
)
def test_what_is_no_number_of_yaml_is_no_level(tmp_path: Path, number: str) -> None:
    text = GOOD.replace("{from: 6, to: 9}", f"{{from: 2, to: {number}}}")
    faults = file_faults(tmp_path, text)
    assert {(fault.line, fault.key) for fault in faults} <= {(5, "levels.to"), (5, "levels.5")}


@pytest.mark.parametrize(
    "text",
    [
        "root:x:0:0:Secret:/root\nbin:x:1:1:Secret:/bin\n",
        "password: Secret\nuser: Secret\n",
        "password: 007\npassword: Secret\nusers:\n  - Secret: [1\n",
        "a: &Secret 1\nb: *Secret2\n",
        "a: !Secret 1\n: :\n",
        "Secret: {a: 1, a: 2}\nx: 'y\n",
        "- Secret\n- Secret\n",
        "Secret\n",
        "-----BEGIN KEY-----\nSecret\n-----END KEY-----\n",
        "[Secret]\nkey = Secret\n",
    ],
)
def test_no_message_shows_a_file_that_is_no_experiment(tmp_path: Path, text: str) -> None:
    (tmp_path / "case.yaml").symlink_to(write(tmp_path, text, "foreign"))
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(tmp_path / "case.yaml")
    told = str(caught.value)
    assert "case.yaml" in told
    for word in ("Secret", "password", "root", "users", "BEGIN"):
        assert word not in told.replace(str(tmp_path), "")
