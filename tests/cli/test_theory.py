"""``vibsim theory``: the formulas that are printed, worked out, are the numbers of the theory."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from thinned import thinned

from vibsim import theory
from vibsim.cli import main
from vibsim.cli.commands.theory import theory_rows
from vibsim.core.home import home
from vibsim.schemes import FIXED_STEP, SCHEMES, Stepper

Capture = pytest.CaptureFixture[str]
P = 0.1


def rows(words: Sequence[str], capsys: Capture) -> dict[str, str]:
    """Return what is printed, by its labels; lines that go on are joined."""
    assert main(["theory", *words]) == 0
    found: dict[str, str] = {}
    label = ""
    for line in capsys.readouterr().out.splitlines():
        head, text = line[:17].strip(), line[17:]
        label = head or label
        found[label] = f"{found.get(label, '')} {text}".strip()
    return found


def value(formula: str, **names: complex) -> Any:
    """Work out a printed formula, in which a space between two factors is a product."""
    text = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", formula).replace("^", "**")
    return eval(text, {"sqrt": np.sqrt, **names})


def series(row: str) -> str:
    return row.partition(" = ")[2].partition(" + O(")[0]


@pytest.mark.parametrize("kind", thinned(FIXED_STEP, 6))
def test_what_is_printed_is_the_theory_of_the_scheme(kind: str, capsys: Capture) -> None:
    found = rows([kind, "--terms", "5"], capsys)
    stepper = SCHEMES[kind].stepper(SCHEMES[kind].defaults())
    numbers = theory.roots(stepper, P)
    assert value(series(found["amplitude"]), p=P) == pytest.approx(
        np.exp(float(numbers.log_growth)), abs=1e-8
    )
    assert value(series(found["frequency"]), p=P) == pytest.approx(
        float(numbers.angle) / P, abs=1e-8
    )
    assert value(series(found["phase"]), p=P) == pytest.approx(
        float(theory.phase_error_per_period(stepper, P)), abs=1e-8
    )
    step = theory.amplification(stepper, P).matrix.rounded
    polynomial = found["roots"].removesuffix(" = 0")
    # roots that are 0 are not written
    for root in (root for root in np.linalg.eigvals(step) if abs(root) > 1e-6):
        assert abs(value(polynomial, p=P, x=complex(root))) < 1e-7


def test_an_option_that_is_a_fraction_leaves_no_rest_where_terms_cancel(capsys: Capture) -> None:
    found = rows(["newmark", "beta=1/12"], capsys)
    assert found["frequency"].startswith("w~/w = 1 + p^4/480 + ")
    assert found["error"].startswith("u(t) - u_n = I (p^4 t w sin(t w)/480 + ")


@pytest.mark.parametrize("words", [["rk4"], ["newmark", "beta=1/6"], ["central"]], ids=" ".join)
def test_the_solution_that_is_printed_is_the_discrete_one(
    words: list[str], capsys: Capture
) -> None:
    text = rows(words, capsys)["solution"]
    parts = re.search(r"with r = (.*) cos\(th\) = (.*) u_1 = (.*)", text)
    assert parts is not None
    r, cosine, first = parts.groups()
    begin, push, n = 1.1, -0.6, np.arange(200)
    th = np.arccos(value(cosine, p=P))
    growth, one = value(r, p=P), value(first, p=P, I=begin, V=push, dt=P)
    swing = (one / growth - begin * np.cos(th)) * np.sin(n * th) / np.sin(th)
    options = {"beta": 1 / 6} if "newmark" in words else {}
    scheme = SCHEMES[words[0]]
    stepper = scheme.stepper({**scheme.defaults(), **options})
    wanted, _ = theory.discrete(stepper, 1.0, P, begin, push, n)
    np.testing.assert_allclose(growth**n * (begin * np.cos(n * th) + swing), wanted, atol=1e-7)


@pytest.mark.parametrize("kind", thinned(FIXED_STEP, 5))
def test_the_printed_recurrence_is_that_of_the_scheme(kind: str, capsys: Capture) -> None:
    found = rows([kind], capsys)
    formula = re.split(r" (?:\(\d/\d\) )?\[", found["without v"])[0]
    scheme = SCHEMES[kind]
    u, _ = theory.discrete(scheme.stepper(scheme.defaults()), 1.0, P, 1.1, -0.6, np.arange(30))
    left, right = (
        value(
            re.sub(r"u\^(?:n|\(n([+-]\d+)\))", lambda x: f"u[{20 + int(x[1] or 0)}]", side),
            p=P,
            u=u,
        )
        for side in formula.split(" = ")
    )
    assert left == pytest.approx(right, abs=1e-7)


@pytest.mark.parametrize(
    ("kind", "without", "system"),
    [
        (
            "central",
            "[D_t D_t u = -w^2 u]^n",
            "[D_t+ u = -(1/2) w^2 dt u + v]^n, [D_t v = -w^2 mean u]^(n+1/2)",
        ),
        (
            "forward_euler",
            "[D_t D_t u]^n = -w^2 u^(n-1)",
            "[D_t+ u = v]^n, [D_t+ v = -w^2 u]^n",
        ),
        (
            "backward_euler",
            "[D_t D_t u]^n = -w^2 u^(n+1)",
            "[D_t- u = v]^(n+1), [D_t- v = -w^2 u]^(n+1)",
        ),
        (
            "crank_nicolson",
            "[D_t D_t u = -w^2 mean mean u]^n",
            "[D_t u = mean v]^(n+1/2), [D_t v = -w^2 mean u]^(n+1/2)",
        ),
    ],
)
def test_the_equations_of_the_text_are_printed_in_its_operators(
    kind: str, without: str, system: str, capsys: Capture
) -> None:
    found = rows([kind], capsys)
    assert without in found["without v"]
    assert found["with v"] == system
    means = found["operators"].split("; ")
    assert "[D_t u]^n = (u^(n+1/2) - u^(n-1/2))/dt" in means
    assert ("[mean u]^n = (u^(n+1/2) + u^(n-1/2))/2" in means) == ("mean" in without + system)


@pytest.mark.slow
def test_the_limits_of_the_frequency_are_printed(capsys: Capture) -> None:
    """B, section 4.3, and pi/dt at w dt = 2 of section 4.6."""
    wanted = f"w~/w -> 1 as p -> 0; w~ dt -> pi and w~/w -> {np.pi / 2:.6g} as p -> 2"
    assert rows(["central"], capsys)["limits"] == wanted
    assert "; w~ dt -> 0 and" in rows(["yoshida4"], capsys)["limits"]
    # cos(w~ dt) = -1/3 at p = sqrt(8), by hand
    assert f"w~ dt -> {np.arccos(-1 / 3):.6g}" in rows(["rk4"], capsys)["limits"]
    assert rows(["gauss4"], capsys)["limits"] == "w~/w -> 1 as p -> 0"


@pytest.mark.parametrize(("kind", "least"), [("central", 5.5), ("rk4", 5.5), ("ab2", 3.5)])
def test_the_printed_error_is_that_of_the_scheme(kind: str, least: float, capsys: Capture) -> None:
    """What it leaves falls with the next power of p: B, section 4.4."""
    formula, _, rest = (
        rows([kind], capsys)["error"].removeprefix("u(t) - u_n = I ").rpartition(" + O(")
    )
    assert rest.endswith("died out") == (kind == "ab2")
    scheme, w, t = SCHEMES[kind], 1.3, 2.0
    left = []
    for n in (80, 160):
        u, _ = theory.discrete(scheme.stepper(scheme.defaults()), w, t / n, 1.0, 0.0, n)
        told = value(formula, p=w * t / n, w=w, t=t, sin=np.sin, cos=np.cos)
        left.append(abs(np.cos(w * t) - float(u) - told))
    assert np.log2(left[0] / left[1]) > least


def test_a_scheme_of_another_equation_is_told_by_its_samples() -> None:
    """A kick that is too strong by a half; there is no series of w~ about w."""

    def start(variant: int, u: float, v: float, dt: float, p: Any, acceleration: Any) -> Any:
        return step((u, v), 0.0, dt, p, acceleration)[0]

    def step(state: Any, t: float, dt: float, p: Any, acceleration: Any) -> Any:
        u, v = state
        ahead = v + 1.5 * dt * acceleration(u, v, t, p)
        return (u + dt * ahead, ahead), v

    wrong = replace(SCHEMES["forward_euler"], stepper=lambda options: Stepper(start, step))
    found = dict(theory_rows(wrong, {}, 3))
    assert found["series"].startswith("not written: the numerical frequency does not tend to w")
    assert found["without v"] == "u^(n+1) = (2 - 3 p^2/2) u^n - u^(n-1)"
    assert found["with v"] == "[D_t- u = v]^(n+1), [D_t+ v = -(3/2) w^2 u]^n"
    assert "frequency" not in found


@pytest.mark.slow
def test_the_documents_have_the_series_of_every_scheme(capsys: Capture) -> None:
    """Schemes with the same series share a row."""
    kinds: dict[tuple[str, str], list[str]] = {}
    for kind in FIXED_STEP:
        found = rows([kind, "--terms", "3"], capsys)
        row = (series(found["amplitude"]), series(found["frequency"]))
        kinds.setdefault(row, []).append(f"`{kind}`")
    table = [f"| {', '.join(names)} | {' | '.join(row)} |" for row, names in kinds.items()]
    assert "\n".join(table) in (home() / "docs/schemes.md").read_text()


@pytest.mark.parametrize(
    "kind", ["central", "euler_cromer", "forward_euler", "backward_euler", "crank_nicolson"]
)
def test_the_documents_have_the_equations_of_the_schemes_of_the_text(
    kind: str, capsys: Capture
) -> None:
    found = rows([kind], capsys)
    without, _, at_one = found["without v"].partition(" with all at one time: ")
    row = f"| `{kind}` | {found['with v']} | {without[without.index('[') :]} | {at_one} |"
    assert row in (home() / "docs/schemes.md").read_text()


def test_a_scheme_with_parasitic_roots_has_no_written_solution(capsys: Capture) -> None:
    assert rows(["ab2"], capsys)["solution"].startswith(
        "not written: the scheme has parasitic roots"
    )


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["rk5"], "rk5: is not a scheme"),
        (["dop853"], "dop853: chooses its own steps"),
        (["newmark", "bet=1"], "bet: is not an option of newmark: did you mean 'beta'?"),
        (["newmark", "beta"], "beta: needs a value: such as beta=0.25"),
        (["newmark", "beta=7"], "7: is not a valid value: 0 to 1"),
        (["newmark", "beta=a"], "a: is not a valid value: 0 to 1"),
        (["central", "start=late"], "late: is not a valid value: centred |"),
        (["central", "frequency_correction=1"], "is not a valid value: true | false"),
        (["rk4", "rk2"], "rk2: is not an option of rk4: it has none"),
        (["rk4", "a=1"], "is not an option of rk4: it has none"),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, list) else "",
)
def test_what_is_no_scheme_or_option_is_refused(
    words: list[str], told: str, capsys: Capture
) -> None:
    assert main(["theory", *words]) == 2
    assert told in capsys.readouterr().err
