"""Edits of an experiment, with exactly the files that they make anew."""

from __future__ import annotations

import os
import random
from contextlib import ExitStack
from dataclasses import dataclass

from workflow.conftest import Place

from torture.laboratory import Laboratory, require

DRAWN = "report", "index"
JUDGED = "analyse", *DRAWN
ALL = "level_06", "level_07", "level_08", "level_09", *JUDGED
SHARDS = *(f"level_0{n}/shard_0000" for n in (6, 7, 8, 9)), *JUDGED
ROAD = "level_00", "level_01", "level_02", *JUDGED


@dataclass(frozen=True)
class Edit:
    """A text that is replaced, and the jobs that run for it."""

    old: str
    new: str
    jobs: tuple[str, ...]
    experiment: str = "tiny"
    file: str = "tiny.yaml"


EDITS = {
    "a comment": Edit("title:", "# a word\ntitle:", ()),
    "another spelling of numbers": Edit("theta: 1.0", "theta: 1.00e0", ()),
    "another order of keys": Edit("pendulum, g: 1.0, L: 1.0", "pendulum, L: 1.0, g: 1", ()),
    "the title": Edit("A tiny", "Another", DRAWN),
    "the source": Edit("nowhere", "somewhere", DRAWN),
    "the tolerance of a check": Edit("tolerance: 0.5", "tolerance: 0.4", JUDGED),
    "the name of a check": Edit("id: order", "id: rate", JUDGED),
    "one more check": Edit("checks:", "checks:\n  - {converges: omega, order: 2}", JUDGED),
    "a finer level": Edit("8, 9]", "8, 9, 10]", ("level_10", *JUDGED)),
    "two finer levels": Edit("8, 9]", "8, 9, 10, 11]", ("level_10", "level_11", *JUDGED)),
    "a coarser level": Edit("[6, 7", "[5, 6, 7", ("level_05", *JUDGED)),
    "without the finest level": Edit("8, 9]", "8]", JUDGED),
    "without the coarsest level": Edit("[6, 7", "[7", JUDGED),
    "the extrapolated solution": Edit(
        "schemes:", "output: best\nschemes:", ("extrapolate", *DRAWN)
    ),
    "a parameter": Edit("g: 1.0", "g: 1.5", ALL),
    "an initial value": Edit("theta: 1.0", "theta: 1.1", ALL),
    "the end": Edit("end: 20.0", "end: 21.0", ALL),
    "another scheme": Edit("[central]", "[central, rk4]", ALL),
    "an option of a scheme": Edit("central]", "{kind: central, arithmetic: increment}]", ALL),
    "which samples are stored": Edit("schemes:", "samples: {every: 2}\nschemes:", ALL),
    "another model": Edit("kind: pendulum", "kind: linear_pendulum", ALL),
    "the writing of a sweep": Edit("[0.5, 1.0]", "{linspace: [0.5, 1, 2]}", JUDGED, "sweep"),
    "a value of a sweep": Edit("[0.5, 1.0]", "[0.5, 1.1]", SHARDS, "sweep"),
    "one more member": Edit("[0.5, 1.0]", "[0.5, 1.0, 1.5]", SHARDS, "sweep"),
    "no sweep": Edit("sweep: {initial.theta: [0.5, 1.0]}", "", ALL, "sweep"),
    "a number of a table": Edit("\n5,", "\n5,1", ROAD, "road", "road.csv"),
    "a comment in a table": Edit("x,h", "# measured\nx,h", (), "road", "road.csv"),
}


def check(place: Place, edit: Edit) -> None:
    """Make an edit, and require that exactly its jobs would run."""
    file = place.file.with_name(edit.file)
    text = file.read_text()
    require(edit.old in text, edit)
    file.write_text(text.replace(edit.old, edit.new))
    found = place.jobs()
    require(sorted(found) == sorted(edit.jobs), edit, found)


def edited(lab: Laboratory, choose: random.Random) -> str:
    """Edit a file whose clock, and that of all results, is wrong; run; compare with a run from nothing."""
    name = choose.choice(list(EDITS))
    edit = EDITS[name]
    place = lab.copy(edit.experiment)
    files = [path for path in place.folder.rglob("*") if path.is_file()]
    is_late = choose.random() < 0.5
    for path in files if is_late else ():
        second = choose.randrange(2**32)
        os.utime(path, (second, second))
    before = _inodes(place)
    with ExitStack() as held:
        for made_before in before:
            # no new file can get the inode of one that is open
            held.enter_context((place.tiny / made_before).open())
        check(place, edit)
        lab.finish(place)
        after = _inodes(place)
    made = {file for file in after if after[file] != before.get(file)}
    wanted = {*map(_file, edit.jobs)} - {""}
    require(made == wanted, name, "made", sorted(made), "not", sorted(wanted))
    found, text = place.content(), {f: f.read_text() for f in place.file.parent.iterdir()}
    fresh = lab.empty(edit.experiment)
    for file, content in text.items():
        file.write_text(content)
    lab.finish(fresh)
    lab.compare(found, fresh.content())
    lab.counts["edits"] += 1
    return f"edit of {name}" + ", with wrong clocks" * is_late


def _file(job: str) -> str:
    """Return the file that tells that a job ran: of a report its page."""
    names = {
        "analyse": "convergence.nc",
        "report": "report.html",
        "index": "",
        "extrapolate": "best.nc",
    }
    return names.get(job, f"{job}.nc")


def _inodes(place: Place) -> dict[str, int]:
    """Return what tells a new file under an old name, for data and page."""
    files = [*place.tiny.rglob("*.nc"), *place.tiny.glob("report.html")]
    return {path.relative_to(place.tiny).as_posix(): path.stat().st_ino for path in files}
