"""One case of each kind (`make torture`); the edits in `edits.EDITS`, each with exactly the jobs that it needs."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest
from thinned import thinned
from workflow.conftest import Place

from torture import edits, fuzz
from torture.__main__ import CASES
from torture.laboratory import VARIABLES, Laboratory

QUICK = ("a finer level", "a parameter")


HEADER = b"{'descr': '<f8', 'fortran_order': False, 'shape': ((3,), }"
FOUND = [
    # a parenthesis without its partner
    ("matrices", b"\x93NUMPY\x01\x00" + len(HEADER).to_bytes(2, "little") + HEADER),
    # a symmetric matrix that is not square, at which SciPy crashes
    ("matrices", b"%%MatrixMarket matrix array real symmetric\n4 2\n2\n0sssssst"),
    # 2^31 dimensions, for which the library takes all memory
    ("netcdf", b"CDF\x01" + bytes(4) + b"\0\0\0\x0a\x7f\xff\xff\xff" + bytes(200)),
]
"""Inputs at which a reader failed once."""


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    with pytest.MonkeyPatch.context() as patch:
        for name in VARIABLES:
            # the laboratory sets them
            patch.setenv(name, "")
        yield Laboratory(tmp_path_factory.mktemp("torture"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", CASES)
def test_nothing_is_lost_and_nothing_wrong_in_silence(lab: Laboratory, kind: str) -> None:
    case, _ = CASES[kind]
    assert case(lab, random.Random(f"23 {kind}"))


@pytest.mark.slow
@pytest.mark.parametrize("name", thinned(sorted({*edits.EDITS} - {*QUICK}), 2))
def test_an_edit_runs_exactly_what_uses_it(lab: Laboratory, name: str) -> None:
    edit = edits.EDITS[name]
    edits.check(lab.copy(edit.experiment), edit)


@pytest.mark.parametrize("name", QUICK)
def test_an_edit_runs_exactly_what_uses_it_quick(place: Place, name: str) -> None:
    edits.check(place, edits.EDITS[name])


@pytest.mark.slow
def test_a_byte_that_differs_is_told(lab: Laboratory) -> None:
    place = lab.copy()
    lab.finish(place, "tiny")
    page = "adhoc/tiny/report.html"
    other = lab.content("tiny") | {page: lab.content("tiny")[page] + b" "}
    with pytest.raises(AssertionError, match=page):
        lab.compare(place.content(), other)


@pytest.mark.parametrize("times", [5, pytest.param(60, marks=pytest.mark.slow)])
@pytest.mark.parametrize("target", fuzz.TARGETS)
def test_readers_take_or_refuse_what_is_changed_at_random(target: str, times: int) -> None:
    choose = random.Random(f"23 {target}")
    known = sorted(fuzz.seeds(target), key=len)[:8]
    assert known
    for data in known:
        fuzz.TARGETS[target](data)
    for _ in range(times):
        fuzz.TARGETS[target](fuzz.mutated(choose.choice(known), choose))


@pytest.mark.parametrize(("target", "data"), FOUND)
def test_what_the_fuzzer_found_is_refused(target: str, data: bytes) -> None:
    fuzz.timed(fuzz.TARGETS[target])(data)


def test_what_is_run_or_written_is_noticed() -> None:
    for event in (
        ("os.system", (b"true",)),
        ("exec", (compile("1", "<formula>", "eval"),)),
        ("open", ("/etc/x", "w", 1)),
    ):
        with pytest.raises(fuzz.Executed):
            fuzz.watch(*event)
    fuzz.watch("exec", (fuzz.watch.__code__,))
