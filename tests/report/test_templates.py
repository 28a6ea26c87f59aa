"""Compiled templates: kept in the private cache alone, made again where an entry is no good, and no need of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import samples
from jinja2 import environment as jinja

from vibsim.core import private_cache
from vibsim.report import choice, words
from vibsim.report.page import templates
from vibsim.report.tables import levels
from vibsim.report.text import assertions

NAME = "study.html"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path / "cache"))
    private_cache._opened.cache_clear()
    yield tmp_path / "cache/templates"
    private_cache._opened.cache_clear()


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the templates that are compiled from now on."""
    names: list[str] = []
    right = jinja.Environment.compile

    def compile_(self: jinja.Environment, source: str, name: str, *more: object) -> object:
        names.append(name)
        return right(self, source, name, *more)  # type: ignore[call-overload]

    monkeypatch.setattr(jinja.Environment, "compile", compile_)
    return names


def again() -> None:
    """Load a template as another process would."""
    templates.environment.__wrapped__().get_template(NAME)


def test_a_template_is_compiled_once(home: Path, compiled: list[str]) -> None:
    again()
    again()
    assert compiled == [NAME]
    assert len(list(home.iterdir())) == 1


@pytest.mark.parametrize("bad", [b"", b"no seal", None])
def test_an_entry_that_is_no_good_is_made_again(
    home: Path, compiled: list[str], bad: bytes | None
) -> None:
    again()
    (entry,) = home.iterdir()
    whole = entry.read_bytes()
    # without `bad`, whole but for one bit
    entry.write_bytes(bytes([whole[0] ^ 1]) + whole[1:] if bad is None else bad)
    again()
    assert compiled == [NAME] * 2
    assert entry.read_bytes() == whole


def test_another_text_is_another_entry(
    home: Path, compiled: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(templates, "TEMPLATES", tmp_path)
    for text in ("one", "two", "one"):
        (tmp_path / NAME).write_text(text)
        assert templates.environment.__wrapped__().get_template(NAME).render() == text
    assert compiled == [NAME] * 2


def test_no_cache_is_no_fault(compiled: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(private_cache, "opened", lambda kind: None)
    again()
    again()
    assert compiled == [NAME] * 2


@pytest.mark.parametrize(
    ("text", "markup"),
    [
        ("rescaled by 4^k", "rescaled by 4<sup>k</sup>"),
        ("-4/3 (u_l - u_(l+1))", "-4/3 (u<sub>l</sub> - u<sub>l+1</sub>)"),
        ("below 3.9e-4, `1e-3`", "below 3.9·10⁻⁴, <code>1e-3</code>"),
        ("like dt^2 and (w0/w)^-2", "like dt<sup>2</sup> and (w0/w)<sup>-2</sup>"),
        ("2^(k+1) < `a^b` & c", "2<sup>k+1</sup> &lt; <code>a^b</code> &amp; c"),
        ("steps_per_period, level_07, rk4_a, x^ y", "steps_per_period, level_07, rk4_a, x^ y"),
    ],
)
def test_exponents_and_indices_of_a_statement_are_set_and_code_is_not(
    text: str, markup: str
) -> None:
    assert str(templates.environment().filters["code"](text)) == markup


def test_no_page_names_a_norm_by_its_key() -> None:
    assert set(words.NORMS) == {"l1", "l2", "linf", "linf_interior"}
    experiment = samples.experiment(
        checks=[{"converges": "theta", "order": 2, "norm": norm} for norm in words.NORMS]
    )
    record = samples.record(experiment)
    told = [
        assertions.about(check, record) + assertions.measured(check, record)
        for check in experiment.checks
    ]
    told += [
        levels.orders(record, "energy_deviation", choice.members(record, "theta"), norm).caption
        for norm in words.NORMS
    ]
    assert not re.search(r"\bl1|\bl2|linf|dE", " ".join(told))
