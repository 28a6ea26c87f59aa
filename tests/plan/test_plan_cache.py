from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from vibsim.core.errors import InputError, VibsimError
from vibsim.experiment import Experiment
from vibsim.plan import Choice, code_digest, load, load_all

from .conftest import TEXT


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.yaml"
    path.write_text(TEXT)
    return path


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


def entries(home: Path) -> list[Path]:
    return [path for path in (home / "plans").iterdir() if not path.name.startswith("lock_")]


def refuse_to_build(*_: object, **__: object) -> None:
    raise AssertionError("built again")


def test_a_cached_plan_is_the_plan(
    tmp_path: Path, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built = load(Choice("adhoc", file), cached=True)
    monkeypatch.setattr("vibsim.plan.build.build", refuse_to_build)
    assert load(Choice("adhoc", file), cached=True) == built
    for other in (Choice("other", file), Choice("adhoc", file, settings=("time.end=21",))):
        with pytest.raises(AssertionError, match="built again"):
            load(other, cached=True)


@pytest.mark.parametrize("fault", ["flip", "cut", "empty", "foreign"])
def test_a_damaged_entry_is_built_again(home: Path, file: Path, fault: str) -> None:
    built = load(Choice("adhoc", file), cached=True)
    (path,) = entries(home)
    content = path.read_bytes()
    places = range(0, len(content), 37) if fault == "flip" else [0]
    for place in places:
        damaged = bytearray(content)
        damaged[place] ^= 1
        kinds = {"flip": damaged, "cut": content[:-9], "empty": b"", "foreign": b"{}"}
        path.write_bytes(kinds[fault])
        assert load(Choice("adhoc", file), cached=True) == built
        assert path.read_bytes() == content


def test_a_changed_file_and_changed_code_are_planned_again(
    tmp_path: Path, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    load(Choice("adhoc", file), cached=True)
    file.write_text(TEXT.replace("A tiny", "Another"))
    assert load(Choice("adhoc", file), cached=True).title == "Another pendulum"
    monkeypatch.setattr(code_digest, "everything", lambda: "other code")
    monkeypatch.setattr("vibsim.plan.build.build", refuse_to_build)
    with pytest.raises(AssertionError, match="built again"):
        load(Choice("adhoc", file), cached=True)


def test_faults_of_all_files_are_told_at_once(tmp_path: Path, home: Path, file: Path) -> None:
    bad = [tmp_path / "a.yaml", tmp_path / "b.yaml"]
    for path in bad:
        path.write_text(TEXT.replace("end: 20.0", "end: -1"))
    missing = tmp_path / "none.yaml"
    with pytest.raises(InputError) as caught:
        load_all([Choice("adhoc", p) for p in (*bad, missing, file)], cached=True)
    told = str(caught.value)
    assert all(str(path) in told for path in (*bad, missing))
    assert len(entries(home)) == 1


def test_a_member_alone_has_the_ladder_of_the_whole_sweep(tmp_path: Path, file: Path) -> None:
    sweep = "sweep: {initial.theta: [0.5, 1.0, 3.0]}\nschemes:"
    text = TEXT.replace("levels: [5, 6, 7]", "tolerance: 1e-5").replace("schemes:", sweep)
    file.write_text(text)
    seen = []

    def resolve(experiment: Experiment) -> Experiment:
        seen.append(experiment.members)
        return experiment.with_levels((6, 7, 8))

    plan = load(Choice("adhoc", file, 1), resolve, cached=True)
    assert plan.experiment.levels == (6, 7, 8)
    assert plan.experiment.initial["theta"] == 1.0
    assert seen == [3]
    with pytest.raises(InputError, match="from 0 to 2"):
        load(Choice("adhoc", file, 3), resolve, cached=True)
    assert seen == [3], "no pilot for a member that does not exist"
    with pytest.raises(VibsimError, match="nothing is there to choose levels"):
        load(Choice("adhoc", file, 2), cached=True)


def test_plans_are_made_without_a_cache(
    tmp_path: Path, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where the folder should be")
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(blocked))
    assert load(Choice("adhoc", file), cached=True).name == "tiny"


MANY = """
import sys
from pathlib import Path
from vibsim.plan import Choice, load_all
folder = Path(sys.argv[1])
choices = [Choice("adhoc", p) for p in sorted(folder.glob("*.yaml"))]
print(len(load_all(choices, cached=True)))
heavy = {"numpy", "pydantic", "yaml", "netCDF4", "xarray", "llvmlite"} & set(sys.modules)
assert not heavy, heavy
"""


@pytest.mark.slow
def test_cached_plans_load_without_reading_a_file_again(tmp_path: Path) -> None:
    for number in range(20):
        (tmp_path / f"e{number}.yaml").write_text(TEXT + f"# {number}\n")
    load_all([Choice("adhoc", path) for path in tmp_path.glob("*.yaml")], cached=True)
    command = [sys.executable, "-c", MANY, str(tmp_path)]
    ended = subprocess.run(command, check=True, capture_output=True, text=True)
    assert ended.stdout.split() == ["20"]
