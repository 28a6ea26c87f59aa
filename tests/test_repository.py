"""The repository as a whole: what no single room of the code can promise."""

from __future__ import annotations

import json
import os
import pkgutil
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from vibsim.cli.arguments import parsed
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES, Option

ROOT = Path(__file__).resolve().parents[1]
EDITOR_LINE = "# yaml-language-server: $schema=../../workflow/schemas/experiment.schema.json"


def is_ours(path: Path) -> bool:
    """Tell whether a file of an archive comes with it; tools and runs make the others."""
    if path.parts[0].startswith(".") and path.parts[0] not in (".ci", ".gitignore"):
        return False
    if path.parts[0] == "results":
        return path.name == "README.md" and len(path.parts) == 2
    return not any(part == "__pycache__" or part.endswith(".egg-info") for part in path.parts)


def tracked() -> list[Path]:
    """Return the files under version control: what else lies there, such as a log of `make`, is the user's."""
    command = ["git", "ls-files", "-z"]
    if (ROOT / ".git").exists():
        done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
        files = [ROOT / name for name in done.stdout.split("\0") if name]
    else:  # an archive without its history
        files = [path for path in ROOT.rglob("*") if is_ours(path.relative_to(ROOT))]
    return [path for path in files if path.is_file()]


def texts() -> Iterator[tuple[Path, str]]:
    """Return every tracked file that is text."""
    for path in tracked():
        content = path.read_bytes()
        if b"\0" not in content:
            yield path, content.decode("utf-8")


def pages() -> list[Path]:
    return [path for path in tracked() if path.suffix == ".md"]


def test_no_text_cites_a_document_that_is_not_here() -> None:
    cites = re.compile(r"design(\.md)?, section|[Tt]he design['.,]|errata\.md")
    found = [f"{path.name}: {cites.search(text)}" for path, text in texts() if cites.search(text)]
    assert found == []


def exists(name: str) -> bool:
    """Tell whether a module, or what it holds, has this name; fields of classes have no value."""
    owner, _, last = name.rpartition(".")
    try:
        pkgutil.resolve_name(name)
    except (AttributeError, ImportError):
        return (
            owner != ""
            and exists(owner)
            and last in vars(pkgutil.resolve_name(owner)).get("__annotations__", {})
        )
    return True


def test_what_docstrings_name_exists() -> None:
    """Four files named modules by the places where these had been before."""
    named = {
        (path.name, name)
        for path, text in texts()
        if path.suffix == ".py"
        for name in re.findall(r"`(vibsim(?:\.\w+)+)`", text)
    }
    assert len(named) > 50
    assert [one for one in sorted(named) if not exists(one[1])] == []


def blocks(path: Path, language: str) -> list[str]:
    """Return the fenced blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", path.read_text(), re.DOTALL | re.MULTILINE)


# --- requirements -----------------------------------------------------------------------------------


def pins(name: str) -> dict[str, tuple[str, list[str]]]:
    """Return version and hashes of every package that requirements/<name>.txt holds."""
    logical = (ROOT / "requirements" / f"{name}.txt").read_text().replace("\\\n", " ")
    found = {}
    for line in logical.splitlines():
        package, *options = line.split()
        match = re.fullmatch(r"([a-z0-9][a-z0-9._-]*)==([^=]+)", package)
        assert match, f"{name}.txt: not a pinned package: {line[:80]}"
        hashes = [
            option for option in options if re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", option)
        ]
        assert hashes == options, f"{name}.txt: {package} has more than hashes"
        found[match[1]] = (match[2], hashes)
    return found


@pytest.mark.parametrize("name", ["build", "run", "dev", "docs", "fuzz", "lowest"])
def test_requirements_are_pinned_and_hashed(name: str) -> None:
    found = pins(name)
    assert found
    assert [package for package, (_, hashes) in found.items() if not hashes] == []


def test_requirements_hold_no_address() -> None:
    for path in (ROOT / "requirements").iterdir():
        text = path.read_text()
        assert not re.search(r"://|--(extra-)?index|--find-links|--trusted-host| @ ", text), (
            path.name
        )


def test_sets_of_requirements_agree() -> None:
    run, dev = pins("run"), pins("dev")
    assert {package: dev.get(package) for package in run} == run
    assert {package: run.get(package) for package in pins("build")} == pins("build")
    docs = pins("docs")
    assert {package: run[package] for package in docs if package in run} == {
        package: pin for package, pin in docs.items() if package in run
    }


def named() -> dict[str, str]:
    """Return the lowest version of every package that pyproject.toml names."""
    text = (ROOT / "pyproject.toml").read_text()
    block = re.search(r"^dependencies = \[(.*?)^\]", text, re.DOTALL | re.MULTILINE)
    assert block
    return dict(re.findall(r'"([^">]+)>=([0-9.]+)', block[1].lower()))


def test_requirements_hold_what_the_package_names() -> None:
    listed = {line.lower() for line in (ROOT / "requirements/run.in").read_text().split()}
    assert named().keys() == listed - {"-r", "build.in"}
    assert named().keys() <= pins("run").keys()


def test_the_oldest_versions_that_are_tried_are_those_that_the_package_names() -> None:
    def padded(version: str) -> list[int]:
        return [*map(int, version.split(".")), 0, 0][:3]

    oldest = pins("lowest")
    assert {name: padded(oldest[name][0]) for name in named()} == {
        name: padded(version) for name, version in named().items()
    }


def test_the_bill_of_materials_has_every_pinned_package(tmp_path: Path) -> None:
    command = [sys.executable, ROOT / "requirements/sbom.py", tmp_path / "bill.json"]
    subprocess.run(command, check=True)
    bill = json.loads((tmp_path / "bill.json").read_text())
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    parts = {part["name"]: part for part in bill["components"]}
    assert {
        name: (part["version"], sorted(entry["value"] for entry in part["properties"]))
        for name, part in parts.items()
    } == {
        name: (version, sorted(option.removeprefix("--hash=sha256:") for option in hashes))
        for name, (version, hashes) in pins("run").items()
    }
    numpy = parts["numpy"]
    assert numpy["purl"] == numpy["bom-ref"] == f"pkg:pypi/numpy@{numpy['version']}"
    assert "BSD-3-Clause" in numpy["licenses"][0]["expression"]
    (root,) = bill["dependencies"]
    assert sorted(root["dependsOn"]) == sorted(part["bom-ref"] for part in parts.values())


# --- experiments ------------------------------------------------------------------------------------


def configs() -> list[Path]:
    return sorted((ROOT / "configs").glob("*/*.yaml"))


def test_there_are_experiments() -> None:
    assert len(configs()) >= 3
    assert list((ROOT / "configs").rglob("*.yml")) == []


def test_every_experiment_begins_with_the_editor_line() -> None:
    schema = EDITOR_LINE.partition("$schema=")[2]
    for path in configs():
        assert path.read_text().splitlines()[0] == EDITOR_LINE, path
        assert (path.parent / schema).is_file(), path


# --- documentation ----------------------------------------------------------------------------------


def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}


def test_relative_links_resolve() -> None:
    missing = []
    links = 0
    for page in pages():
        text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"[a-z]+:", target):
                continue
            links += 1
            path, _, anchor = target.partition("#")
            there = page.parent / path if path else page
            if not there.exists() or (anchor and anchor not in anchors(there)):
                missing.append(f"{page.relative_to(ROOT)}: {target}")
    assert links > 10
    assert missing == []


def commands(name: str) -> list[list[str]]:
    """Return every call of `name` in the pages, as words."""
    found = []
    for page in pages():
        text = page.read_text()
        inline = re.findall(r"(?<!`)`([^`\n]+)`(?!`)", text)
        for line in [*inline, *"\n".join(blocks(page, "sh")).splitlines()]:
            words = line.partition("#")[0].split()
            if words and words[0].removeprefix(".venv/bin/") == name:
                found.append(words[1:])
    return found


def test_documented_targets_are_in_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text()
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    used = {word for words in commands("make") for word in words}
    assert {"test", "lint", "test-slow"} <= used
    variables = {word.partition("=")[0] for word in used if "=" in word}
    assert all(f"$({name})" in makefile for name in variables)
    assert {word for word in used if "=" not in word} <= targets


def test_documented_commands_are_understood() -> None:
    calls = commands("vibsim")
    assert len(calls) > 5
    # a page may name a command without what it needs to run
    alone = ("check", "plan", "list", "judge", "simulate", "analyse", "report")
    alone += ("show", "open", "new", "diff", "explain", "watch", "completion")
    for words in calls:
        if words == [] or words in [[name] for name in alone]:
            continue
        try:
            parsed(words)
        except SystemExit as end:
            if end.code:  # 0 is that of --help
                pytest.fail(f"vibsim {' '.join(words)} is documented and refused")


def test_every_value_name_is_documented() -> None:
    from vibsim.experiment.value_names import VALUES

    text = (ROOT / "docs/experiment-file.md").read_text()
    assert [name for name in VALUES if f"`{name}`" not in text] == []


def section(title: str) -> str:
    """Return one section of the page about the experiment file."""
    text = (ROOT / "docs/experiment-file.md").read_text()
    return re.split(r"^##+ ", text.partition(f"\n## {title}\n")[2], flags=re.MULTILINE)[0]


def table_rows(text: str) -> dict[str, str]:
    """Return the rows of the tables in `text` by the name in their first column."""
    return dict(re.findall(r"^\| `(\w+)` \|(.*)\|$", text, re.MULTILINE))


def test_every_function_is_documented() -> None:
    from vibsim.formula import FUNCTIONS

    text = (
        (ROOT / "docs/experiment-file.md")
        .read_text()
        .partition("### Formulas")[2]
        .partition("### ")[0]
    )
    documented = set(re.findall(r"`(\w+)(?:\([^`]*\))?`", text))
    assert set(FUNCTIONS) - documented == set()


def test_every_model_is_documented_with_its_states_and_parameters() -> None:
    rows = table_rows(section("model"))
    assert list(rows) == list(MODELS)
    for kind, model in MODELS.items():
        equation, states, parameters = rows[kind].split(" | ")
        assert equation.strip().replace("\\|", "|") == model.equation
        assert states == ", ".join(f"`{s.name}` [{s.unit}]" for s in model.states)
        expected = [f"`{p.name}` ({p.default:g}) [{p.unit}]" for p in model.parameters]
        assert parameters.strip() == ", ".join(expected)


def test_every_scheme_is_documented_with_its_options() -> None:
    text = section("schemes")
    schemes = re.findall(r"^\| `(\w+)` \| ([^|`]+) \| (.*) \|$", text, re.MULTILINE)
    assert [(kind, title) for kind, title, _ in schemes] == [
        (k, s.title) for k, s in SCHEMES.items()
    ]
    for kind, _, options in schemes:
        assert re.findall(r"`(\w+)`", options) == [option.name for option in SCHEMES[kind].options]
    rows = re.findall(r"^\| `(\w+)` \| (`.*`) \| (.*) \|$", text, re.MULTILINE)
    told = {(kind, name): row for name, of, row in rows for kind in re.findall(r"`(\w+)`", of)}
    every = {(kind, o.name): o for kind, scheme in SCHEMES.items() for o in scheme.options}
    assert set(told) == set(every)
    for place, option in every.items():
        words = list(option.choices) if isinstance(option, Option) else []
        found = [
            word for word in re.findall(r"`(\w+)`", told[place]) if word not in ("true", "false")
        ]
        assert (place, found) == (place, words)


def test_every_reason_is_documented_with_its_status() -> None:
    from vibsim.core.vocabulary import REASONS

    text = (ROOT / "docs/verdicts.md").read_text()
    rows = dict(re.findall(r"^\| `([a-z_]+)` \| ([A-Z]+) \|", text, re.MULTILINE))
    assert rows == REASONS


# --- every file -------------------------------------------------------------------------------------


def test_no_file_names_a_folder_of_one_machine() -> None:
    pattern = re.compile(r"(?<![\w.$~}/])/(home|root|Users|work)/[\w.-]+")
    found = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path, text in texts()
        for match in pattern.finditer(text)
    ]
    assert found == []


def test_no_file_holds_the_place_of_this_checkout() -> None:
    places = {str(ROOT), str(Path.home())} - {"/"}
    found = [path for path, text in texts() if any(place + os.sep in text for place in places)]
    assert found == []


def test_a_log_in_the_checkout_is_not_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As ``make > make.log`` leaves one."""
    (tmp_path / "ours.md").write_text("ours\n")
    (tmp_path / "make.log").write_text(f"cd {tmp_path}/somewhere\n")
    for words in (["init", "-q"], ["add", "ours.md"]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    assert tracked() == [tmp_path / "ours.md"]
    test_no_file_holds_the_place_of_this_checkout()
    test_no_file_names_a_folder_of_one_machine()


def test_scripts_can_be_executed() -> None:
    for name in (".ci/run", "requirements/install.sh"):
        assert os.access(ROOT / name, os.X_OK), name


# --- set-up -----------------------------------------------------------------------------------------


def install(folder: Path, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run the set-up of a copy of the repository that can install nothing."""
    return subprocess.run(
        ["sh", "requirements/install.sh", *arguments],
        cwd=folder,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a folder with what the set-up reads, and a python3.11 that makes empty environments."""
    folder = tmp_path / "checkout"
    (folder / "requirements").mkdir(parents=True)
    for path in (ROOT / "requirements").iterdir():
        (folder / "requirements" / path.name).write_bytes(path.read_bytes())
    (folder / "pyproject.toml").write_bytes((ROOT / "pyproject.toml").read_bytes())
    tools = tmp_path / "tools"
    tools.mkdir()
    # Stands for Python and pip: notes each call, makes itself the environment's python, fails where told to.
    script = f"""#!/bin/sh
echo "$@" >>{tmp_path}/calls
case "$*" in
    "-m venv "*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
    *"$FAIL"*) [ -z "$FAIL" ] || exit 9 ;;
esac
"""
    (tools / "python3.11").write_text(script)
    (tools / "python3.11").chmod(0o755)
    return folder


def calls(copy: Path) -> list[str]:
    """Return the calls of Python since the last time."""
    log = copy.parent / "calls"
    found = log.read_text().splitlines() if log.exists() else []
    log.unlink(missing_ok=True)
    return found


def set_up(copy: Path, chosen: str, fail: str = "") -> int:
    path = f"{copy.parent / 'tools'}:{os.environ['PATH']}"
    return install(copy, chosen, PATH=path, FAIL=fail).returncode


def test_second_set_up_does_nothing(copy: Path) -> None:
    assert set_up(copy, "run") == 0
    assert any("requirements/run.txt" in call for call in calls(copy))
    assert set_up(copy, "run") == 0
    assert calls(copy) == []


def test_run_installs_no_development_tools(copy: Path) -> None:
    assert set_up(copy, "run") == 0
    assert not any("requirements/dev.txt" in call for call in calls(copy))


def test_dev_adds_to_run(copy: Path) -> None:
    assert set_up(copy, "run") == 0
    calls(copy)
    assert set_up(copy, "dev") == 0
    added = calls(copy)
    assert not any("venv" in call for call in added)
    assert any("requirements/dev.txt" in call for call in added)
    assert set_up(copy, "run") == 0
    assert calls(copy) == []


def test_the_documentation_has_an_environment_of_its_own(copy: Path) -> None:
    assert set_up(copy, "docs") == 0
    made = calls(copy)
    assert any("requirements/docs.txt" in call for call in made)
    assert not any("requirements/run.txt" in call for call in made)
    assert (copy / ".venv-docs/bin/python").exists()
    assert not (copy / ".venv").exists()
    assert set_up(copy, "docs") == 0
    assert calls(copy) == []


@pytest.mark.parametrize("step", ["build.txt", "run.txt", "--editable"])
def test_interrupted_set_up_is_done_again(copy: Path, step: str) -> None:
    assert set_up(copy, "run", fail=step) != 0
    calls(copy)
    assert set_up(copy, "run") == 0
    assert any("-m venv" in call for call in calls(copy))


@pytest.mark.parametrize("name", ["requirements/run.txt", "pyproject.toml"])
def test_changed_requirements_make_a_new_environment(copy: Path, name: str) -> None:
    assert set_up(copy, "dev") == 0
    calls(copy)
    with (copy / name).open("a") as file:
        file.write("\n# changed\n")
    assert set_up(copy, "run") == 0
    assert any("-m venv" in call for call in calls(copy))
    assert set_up(copy, "dev") == 0
    assert any("requirements/dev.txt" in call for call in calls(copy))


def test_moved_checkout_makes_a_new_environment(copy: Path) -> None:
    assert set_up(copy, "run") == 0
    calls(copy)
    moved = copy.rename(copy.with_name("moved"))
    assert set_up(moved, "run") == 0
    assert any("-m venv" in call for call in calls(moved))


def test_broken_environment_is_made_again(copy: Path) -> None:
    assert set_up(copy, "run") == 0
    calls(copy)
    (copy / ".venv/bin/python").unlink()
    assert set_up(copy, "run") == 0
    assert any("-m venv" in call for call in calls(copy))


def test_old_python_is_refused_with_a_reason(copy: Path) -> None:
    tools = copy.parent / "old"
    tools.mkdir()
    for name in ("python3.11", "python3"):
        (tools / name).write_text("#!/bin/sh\nexit 1\n")
        (tools / name).chmod(0o755)
    done = install(copy, "run", PATH=f"{tools}:{os.environ['PATH']}")
    assert done.returncode != 0
    assert "CPython 3.11 or newer" in done.stderr
    assert not (copy / ".venv").exists()
