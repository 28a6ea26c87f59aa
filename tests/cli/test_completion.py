"""``vibsim completion``: what may stand at a place, and that a shell gets it."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from vibsim.cli import main
from vibsim.cli.arguments import SHELLS, commands
from vibsim.cli.commands.completion import SCRIPTS, WORDS, candidates
from vibsim.core.vocabulary import REASONS
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["ju"], ["judge"]),
        (["fly", ""], []),
        (["run", "theta_c"], ["theta_convergence"]),
        (["run", "theta_convergence", "pendulum_l"], None),
        (["run", "--ver"], ["--verbose", "--verify"]),
        (["run", "--results", ""], []),
        (["run", "--cores", "2", "theta_c"], ["theta_convergence"]),
        (["show", "theta_convergence", "lin"], []),
        (["diff", "vehicle", "theta_c"], ["theta_convergence"]),
        (["list", "mod"], ["models"]),
        (["list", "schemes", "rk"], [kind for kind in sorted(SCHEMES) if kind.startswith("rk")]),
        (["list", "models", ""], sorted(MODELS)),
        (["list", "experiments", ""], []),
        (["list", "schema", ""], []),
        (["explain", ""], sorted(REASONS)),
        (["explain", "exact", ""], []),
        (["theory", "rkn"], ["rkn4"]),
        (["new", "mine.yaml", "--model", "pend"], ["pendulum"]),
        (["new", "mine.yaml", "--like", "theta_c"], ["theta_convergence"]),
        (["judge", "x.csv", "--restrict", "m"], ["mean"]),
        (["completion", "z"], ["zsh"]),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, list) else "",
)
def test_what_may_stand_at_a_place_is_offered(words: list[str], offered: list[str] | None) -> None:
    found = candidates(words)
    if offered is None:
        assert found[0] == "pendulum_lab"
        assert "pendulum_lab/theta_convergence" in found
    else:
        assert found == offered


def test_every_command_and_option_is_offered() -> None:
    assert {name for name, *_ in commands()} <= set(candidates([""]))
    for name, _, _, rows in commands():
        options = {option for names, _ in rows for option in names if option.startswith("-")}
        assert options <= set(candidates([name, "-"])), name


def test_the_shells_are_those_with_a_script() -> None:
    assert {*SCRIPTS, WORDS} == set(SHELLS)


def test_words_are_printed_a_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "words", "--", "run", "--dr"]) == 0
    assert capsys.readouterr().out == "--dry-run\n"
    # an empty line would be offered as a word
    assert main(["completion", "words", "--", "fly", ""]) == 0
    assert capsys.readouterr().out == ""
    assert main(["completion", "words", "--", ""]) == 0
    assert "show\n" in capsys.readouterr().out


@pytest.mark.parametrize("shell", SCRIPTS)
def test_a_shell_that_is_there_accepts_its_script(shell: str, tmp_path: Path) -> None:
    if not shutil.which(shell):
        pytest.skip(f"no {shell} here")
    script = tmp_path / "script"
    script.write_text(SCRIPTS[shell])
    subprocess.run([shell, "-n", str(script)], check=True)


@pytest.mark.slow
def test_bash_gets_the_words(tmp_path: Path) -> None:
    command = tmp_path / "vibsim"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m vibsim "$@"\n')
    command.chmod(0o755)
    program = (
        f"source <(vibsim completion bash); COMP_WORDS=({command} list schemes rk); COMP_CWORD=3; "
        '_vibsim; printf "%s\\n" "${COMPREPLY[@]}"; complete -p vibsim'
    )
    path = f"{tmp_path}:/usr/bin:/bin"
    ended = subprocess.run(
        ["bash", "-c", program], capture_output=True, text=True, check=True, env={"PATH": path}
    )
    *words, registered = ended.stdout.splitlines()
    assert words == [kind for kind in sorted(SCHEMES) if kind.startswith("rk")]
    assert registered == "complete -o default -F _vibsim vibsim"
