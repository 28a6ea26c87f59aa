from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import vibsim
from vibsim.plan import build, code, shards


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a copy of the package whose sources may be changed, read but never executed."""
    copy = tmp_path / "vibsim"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(vibsim.__file__).parent, copy, ignore=ignored)
    monkeypatch.setattr(code, "PACKAGE", copy)
    forget()
    yield copy
    forget()


def forget() -> None:
    for cached in (
        code.everything,
        code._imports,
        shards.code_of,
        build._analysis_code,
        build.report_code,
    ):
        cached.cache_clear()


def digests() -> dict[str, str]:
    forget()
    return {
        "pendulum": shards.code_of("pendulum", ("central",)),
        "linear": shards.code_of("linear_pendulum", ("central",)),
        "analysis": build._analysis_code(),
        "report": build.report_code(),
        "everything": code.everything(),
    }


def python_files(package: Path, part: str) -> list[Path]:
    path = package / part
    return sorted(path.rglob("*.py")) if path.is_dir() else [path]


SPEC = Path(vibsim.__file__).parent / "spec"
SPEC_ALONE = sorted(path.stem for path in SPEC.glob("*.py"))
"""What makes an experiment, its members and its samples: the numbers that come out are themselves part of a digest."""


@pytest.mark.parametrize(
    ("part", "touched"),
    [
        ("engine", {"pendulum", "linear"}),
        ("elementary", {"pendulum", "linear"}),
        ("simulation", {"pendulum", "linear"}),
        ("schemes/base.py", {"pendulum", "linear"}),
        ("models/base.py", {"pendulum", "linear"}),
        ("schemes/central.py", {"pendulum", "linear"}),
        # The linear pendulum takes its parameters from the other one.
        ("models/pendulum.py", {"pendulum", "linear"}),
        ("models/linear_pendulum.py", {"linear"}),
        ("record.py", {"pendulum", "linear", "analysis"}),
        ("store/writing.py", {"pendulum", "linear", "analysis"}),
        ("store/reading.py", {"analysis"}),
        ("store/seal.py", {"pendulum", "linear", "analysis"}),
        ("plan", set()),
        ("analysis", {"analysis"}),
        ("report", {"report"}),
        ("cli", set()),
        *((f"spec/{name}.py", set()) for name in SPEC_ALONE),
        ("errors.py", set()),
    ],
)
def test_a_changed_module_changes_what_uses_it(package: Path, part: str, touched: set[str]) -> None:
    before = digests()
    for file in python_files(package, part):
        content = file.read_bytes()
        file.write_bytes(content + b"\n# changed\n")
        after = digests()
        file.write_bytes(content)
        changed = {name for name in before if before[name] != after[name]} - {"everything"}
        # The analysis may use more of the core than it must: it is quick, and right to run again.
        assert changed - {"analysis"} == touched - {"analysis"}, file
        assert changed >= touched, file
        assert before["everything"] != after["everything"]
    assert digests() == before


def test_templates_belong_to_the_report(package: Path) -> None:
    before = digests()
    template = next((package / "report/templates").rglob("*.html"))
    template.write_text(template.read_text() + "<!-- changed -->")
    after = digests()
    assert {n for n in before if before[n] != after[n]} == {"report", "everything"}


def test_imports_for_types_alone_are_not_followed(package: Path) -> None:
    (package / "record.py").write_text(
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from vibsim.report import write\n"
        "def f():\n    import vibsim.variables\n    from vibsim.models import base\n"
    )
    (package / "variables.py").write_text("")
    forget()
    assert code._imports("vibsim.record") == {"vibsim.variables", "vibsim.models.base"}
