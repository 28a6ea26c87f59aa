from __future__ import annotations

from pathlib import Path

import pytest

from vibsim.core.errors import InputError
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


def test_an_experiment_of_ones_own_is_named_by_its_file(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").touch()
    for word in ("mine", "adhoc/mine", "adhoc/elsewhere"):
        with pytest.raises(InputError, match=rf"by its file, such as {Path(word).name}\.yaml"):
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


def cases(words: list[str], root: Path) -> list[tuple[str, int | None]]:
    return [(choice.key, choice.case) for choice in choose(words, root)]


def test_a_member_is_named_after_the_at_sign(root: Path, tmp_path: Path) -> None:
    file = str(tmp_path / "x.yaml")
    words = ["one@3", "scale/big@0", f"{file}@12", "one", "one@3", "one@03"]
    assert cases(words, root) == [
        ("pendulum_lab/one_case_3", 3),
        ("scale/big_case_0", 0),
        ("adhoc/x_case_12", 12),
        ("pendulum_lab/one", None),
    ]
    assert choose([f"{file}@12"], root)[0].file == Path(file)


def test_a_file_may_have_an_at_sign(root: Path, tmp_path: Path) -> None:
    folder = tmp_path / "a@b"
    words = [str(folder / "x.yaml"), str(folder / "x.yaml@2"), str(tmp_path / "y@4.yaml")]
    found = choose(words, root)
    assert [(choice.name, choice.case) for choice in found] == [
        ("x", None),
        ("x_case_2", 2),
        ("y@4", None),
    ]
    assert found[0].file == found[1].file == folder / "x.yaml"


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("one@", "a member is named by @ and its number, from 0: e.g. one@0"),
        ("one@two", "a member is named by @ and its number"),
        ("one@-1", "a member is named by @ and its number"),
        ("one@\u0663", "a member is named by @ and its number"),
        ("one@" + "9" * 5000, "a member is named by @ and its number"),
        ("onne@3", "did you mean 'one'"),
        ("two@3", "choose from pendulum_lab/two, showcase/two"),
        ("pendulum_lab@3", "a collection has no members: choose from pendulum_lab/one"),
        ("scale@3", "a collection has no members: choose from scale/big"),
    ],
)
def test_what_is_no_member_is_refused(root: Path, word: str, told: str) -> None:
    with pytest.raises(InputError) as caught:
        choose([word], root)
    assert told in str(caught.value)


def test_a_member_and_an_experiment_of_its_name_are_refused(root: Path) -> None:
    (root / "configs/scale/big_case_1.yaml").touch()
    with pytest.raises(InputError, match="cannot share a name"):
        choose(["scale/big@1", "scale/big_case_1"], root)
    assert keys(["scale/big@1", "scale/big@2"], root) == ["scale/big_case_1", "scale/big_case_2"]


def test_of_many_names_none_is_listed(root: Path) -> None:
    for number in range(80):
        (root / f"configs/scale/number_{number}.yaml").touch()
    with pytest.raises(InputError) as caught:
        choose(["qqqq", "numbr_17", "scale@3"], root)
    hints = {fault.file: fault.hint for fault in caught.value.faults}
    assert hints["qqqq"] == "`vibsim list experiments` shows all"
    assert hints["numbr_17"] == "did you mean 'number_17'?"
    assert hints["scale@3"].startswith("choose from 81, such as scale/")
    assert len(hints["scale@3"]) < 100
