"""References on disk: the same bits, one computation for all jobs, and nothing that is not as it was written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from thinned import thinned

from vibsim.core import private_cache
from vibsim.models import MODELS, Model
from vibsim.simulation.reference import solve

FRACTION = np.arange(33) / 32


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path))
    solve.choose.cache_clear()
    return tmp_path / "references"


def numbers(*columns: list[float]) -> tuple[bytes, ...]:
    return tuple(np.array(column, dtype=float).tobytes() for column in columns)


def model(**formulas: str) -> Model:
    return MODELS["oscillator"].written(formulas, ())


MODELS_ = {
    "smooth": model(spring="sinh(u)", damping="0.1*v**3"),
    "corners": model(spring="sinh(u)", damping="0.3*abs(v)*v"),
    "none": model(damping="0.5*sign(v)"),
}
OWN = numbers([1.0, 0.2, 2.0], [0.0, 1.0, -1.0], [6.0, 3.0, 9.0], [1.0, 1.0, 2.0])


def bits(chosen: solve.Chosen) -> list[bytes]:
    found = [chosen.bounds.tobytes()]
    for members, solved in chosen.parts:
        found += [members.tobytes(), solved.at(FRACTION).tobytes()]
    return found


def again(which: Model) -> solve.Chosen:
    solve.choose.cache_clear()
    return solve.choose(which, OWN)


def entries(home: Path) -> list[Path]:
    return sorted(path for path in home.iterdir() if not path.name.startswith("lock_"))


@pytest.mark.parametrize("name", MODELS_)
def test_the_bits_are_those_that_were_computed(
    home: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = bits(solve.computed(MODELS_[name], OWN))
    assert bits(again(MODELS_[name])) == alone
    assert len(entries(home)) == 1
    monkeypatch.setattr(solve, "computed", None)
    assert bits(again(MODELS_[name])) == alone


@pytest.mark.parametrize("damage", thinned(["flipped", "cut", "empty", "swapped"], 4))
def test_an_entry_that_is_not_as_it_was_written_is_computed_again(home: Path, damage: str) -> None:
    which = MODELS_["corners"]
    alone = bits(again(which))
    (path,) = entries(home)
    content = path.read_bytes()
    if damage == "swapped":
        again(MODELS_["smooth"])
        (other,) = (p for p in entries(home) if p != path)
        path.write_bytes(other.read_bytes())
    else:
        middle = len(content) // 2
        flipped = content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]
        path.write_bytes({"flipped": flipped, "cut": content[:middle], "empty": b""}[damage])
    assert bits(again(which)) == alone
    assert path.stat().st_size == len(content)


def test_the_digest_knows_all_that_the_numbers_depend_on(monkeypatch: pytest.MonkeyPatch) -> None:
    first = solve.digest_of(MODELS_["corners"], OWN)
    assert first == solve.digest_of(model(damping="0.3*abs(v)*v", spring="sinh(u)"), OWN)
    others = [
        solve.digest_of(MODELS_["smooth"], OWN),
        solve.digest_of(MODELS_["corners"], (*OWN[:2], numbers([6.0, 3.0, 9.1])[0], OWN[3])),
        solve.digest_of(MODELS_["corners"], OWN[:3]),
    ]
    monkeypatch.setattr(solve, "_surroundings", lambda: (b"other code",))
    others.append(solve.digest_of(MODELS_["corners"], OWN))
    assert len({first, *others}) == 5


def test_the_digest_knows_the_table() -> None:
    from vibsim.models.table import Table

    heights = np.array([0.0, 0.1, 0.0, 0.2])
    tables = [Table(0.0, 1.0, heights), Table(0.0, 1.0, heights * 2), Table(0.5, 1.0, heights)]
    roads = [MODELS["vehicle"].written({"spring": "u"}, (), table) for table in tables]
    assert len({solve.digest_of(road, OWN) for road in roads}) == 3


def test_a_large_entry_is_not_kept(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solve.cached("a" * 64, lambda: {"x": np.zeros(1000)})
    monkeypatch.setattr(private_cache, "MOST_OF_ENTRY", 7999)
    solve.cached("e" * 64, lambda: {"x": np.zeros(1000)})
    assert [path.name[0] for path in entries(home)] == ["a"]


@pytest.mark.slow
def test_a_folder_that_cannot_be_written_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path / "file"))
    which = MODELS_["corners"]
    assert bits(again(which)) == bits(solve.computed(which, OWN))


JOB = """
import sys, numpy as np
from pathlib import Path
from vibsim.simulation.reference import solve
def compute():
    with Path(sys.argv[1]).open("a") as file:
        file.write("x")
    return {"x": np.arange(100000.0)}
print(float(solve.cached("ab" * 8, compute)["x"].sum()))
"""


@pytest.mark.slow
def test_jobs_that_want_the_same_one_compute_it_once(home: Path, tmp_path: Path) -> None:
    count = tmp_path / "count"
    jobs = [
        subprocess.Popen([sys.executable, "-c", JOB, str(count)], stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    said = {job.communicate()[0] for job in jobs}
    assert said == {f"{np.arange(100000.0).sum()}\n"}
    assert count.read_text() == "x"
    assert len(entries(home)) == 1
    assert not list(home.glob("*.tmp"))
