"""``vibsim list schemes``: what a user chooses by, for every scheme of the registry."""

import math
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import pytest

from vibsim import theory
from vibsim.cli import main
from vibsim.cli.commands import listing
from vibsim.cli.list_entry import shape
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES


@pytest.fixture(scope="module", autouse=True)
def _experiments_are_read_once() -> Iterator[None]:
    found = cache(lambda read=listing._experiments: list(read()))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(listing, "_experiments", found)
        yield


def listed(capsys: pytest.CaptureFixture[str]) -> list[str]:
    assert main(["list", "schemes"]) == 0
    return capsys.readouterr().out.splitlines()


def test_every_scheme_has_its_facts_in_columns(capsys: pytest.CaptureFixture[str]) -> None:
    lines = listed(capsys)
    head = lines[0]
    columns = [head.index(name) for name in ("order", "step", "symplectic", "forces", "stability")]
    for scheme in SCHEMES.values():
        (k,) = (k for k, line in enumerate(lines) if line.split()[0] == scheme.kind)
        order, step, symplectic, forces, stable = (
            lines[k][start:stop].strip()
            for start, stop in zip(columns, [*columns[1:], None], strict=True)
        )
        assert lines[k + 1].strip() == f"{scheme.title}; {scheme.source}"
        assert symplectic == ("yes" if scheme.symplectic else "no")
        assert forces.split()[0] == str(scheme.evaluations)
        if scheme.adaptive:
            assert (order, step, stable) == ("-", "adaptive", "chooses its own steps")
            continue
        assert float(order) == scheme.orders(scheme.defaults()).position
        assert step == ("explicit" if scheme.explicit else "implicit")
        limit = theory.stability_limit(scheme, scheme.defaults())
        if limit in (0.0, math.inf):
            assert stable == ("none" if limit else "grows at every step")
        else:
            assert float(stable.removeprefix("w dt < ")) == pytest.approx(limit, rel=1e-5)


def test_every_option_has_its_values_and_its_default(capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(listed(capsys))
    for scheme in SCHEMES.values():
        for option in scheme.options:
            assert option.description in text
    assert "compensated | increment | three_term (default compensated)" in text
    assert "0 to 1 (default 0.25)" in text
    assert "true | false (default false)" in text


def test_a_scheme_added_tomorrow_is_listed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    new = replace(SCHEMES["rk4"], kind="new", title="A new one", force_evaluations=7)
    monkeypatch.setattr(SCHEMES, "built_in", {**SCHEMES.built_in, "new": new})
    (line,) = (line for line in listed(capsys) if line.startswith("new "))
    assert line.split() == ["new", "4", "explicit", "no", "7", "w", "dt", "<", "2.82843"]


@pytest.mark.slow
def test_the_list_and_the_numbers_of_theory_do_without_sympy() -> None:
    code = (
        "import sys; from vibsim.cli import main; main(['list', 'schemes']); "
        "assert 'sympy' not in sys.modules and 'scipy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


@pytest.mark.parametrize("kind", SCHEMES)
def test_a_scheme_in_full_has_its_facts_and_every_option(
    kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list", "schemes", kind]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100
    text = " ".join(" ".join(lines).split())
    scheme = SCHEMES[kind]
    for told in (scheme.title, scheme.source, scheme.start, f"schemes: [{kind}]"):
        assert " ".join(told.split()) in text
    for option in scheme.options:
        assert f"{option.name}: " in text
        assert " ".join(option.description.split()) in text


@pytest.mark.parametrize("kind", MODELS)
def test_a_model_in_full_has_every_state_and_every_key(
    kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list", "models", kind]) == 0
    text = " ".join(capsys.readouterr().out.split())
    model = MODELS[kind]
    assert " ".join(model.equation.split()) in text
    for name in (x.name for rows in (model.states, model.formulas, model.outputs) for x in rows):
        assert f"{name}: " in text
    for parameter in model.parameters:
        assert f"{parameter.key}: {parameter.description}" in text
        assert f"default {parameter.default:g}" in text


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["schemes", "rk5"], "rk5: is not a scheme: did you mean 'rk4'?"),
        (["models", "pendulm"], "did you mean 'pendulum'?"),
        (["checks", "period"], "only models and schemes have more to show"),
    ],
)
def test_an_unknown_entry_comes_with_the_nearest(
    words: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list", *words]) == 2
    captured = capsys.readouterr()
    assert told in captured.err
    assert len(captured.err) < 400
    assert captured.out == ""


def test_a_model_of_two_coordinates_is_not_called_nonlinear() -> None:
    spring = MODELS["spring"]
    assert [shape(MODELS[kind]) for kind in ("spring", "pendulum")] == ["linear", "nonlinear"]
    plane = replace(spring, states=spring.states * 2, linear=False)
    assert shape(plane) == "of 2 coordinates"
