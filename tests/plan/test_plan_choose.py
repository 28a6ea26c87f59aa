from __future__ import annotations

from pathlib import Path

import pytest

from vibsim.errors import InputError
from vibsim.plan import choose


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name in ("pendulum_lab/one", "pendulum_lab/two", "showcase/two", "scale/big"):
        path = tmp_path / "configs" / f"{name}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return tmp_path


def keys(words: list[str], root: Path) -> list[str]:
    return [choice.key for choice in choose(words, root)]


def test_nothing_named_means_the_default_collections(root: Path) -> None:
    assert keys([], root) == ["pendulum_lab/one", "pendulum_lab/two", "showcase/two"]


def test_names_collections_and_files(root: Path, tmp_path: Path) -> None:
    file = tmp_path / "x.yaml"
    assert keys(["one", "scale", str(file)], root) == ["pendulum_lab/one", "scale/big", "adhoc/x"]
    assert keys(["showcase/two"], root) == ["showcase/two"]
    shipped = root / "configs/scale/big.yaml"
    assert keys([str(shipped), "scale/big", "scale"], root) == ["scale/big"]


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("two", "choose from pendulum_lab/two, showcase/two"),
        ("onne", "did you mean 'one'"),
        ("pendulum_labs", "did you mean 'pendulum_lab'"),
        ("scale/bigg", "did you mean 'scale/big'"),
    ],
)
def test_a_name_that_names_nothing_comes_with_the_nearest(root: Path, word: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        choose([word], root)


def test_two_files_with_one_name_are_refused(root: Path, tmp_path: Path) -> None:
    files = [str(tmp_path / folder / "x.yaml") for folder in ("a", "b")]
    with pytest.raises(InputError, match="cannot share a name"):
        choose(files, root)
    assert keys([files[0], files[0]], root) == ["adhoc/x"]


def test_all_wrong_words_are_told_at_once(root: Path) -> None:
    with pytest.raises(InputError) as caught:
        choose(["nothing_1", "nothing_2", "one"], root)
    assert len(caught.value.faults) == 2


def test_a_file_within_a_folder_named_configs_elsewhere_is_ad_hoc(
    root: Path, tmp_path: Path
) -> None:
    assert keys([str(tmp_path / "elsewhere/configs/lab/x.yaml")], root) == ["adhoc/x"]
