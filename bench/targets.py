"""The figures to reach, beside what was measured; what limits a figure is written here by hand."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bench.page import table


@dataclass(frozen=True)
class Target:
    """A figure to reach: at most, or at least, a limit."""

    what: str
    figure: str
    """Name under which a part hands the figure back."""
    limit: float
    unit: str = ""
    at_least: bool = False
    note: str = ""
    """What limits the figure, or where it comes from."""


TARGETS = (
    Target("one member: time over C, gathering", "one_member.ratio", 1.05),
    Target("the same, stepping alone", "one_member.bare_ratio", 1.05),
    Target(
        "the same, three-term, over C with libm's sine",
        "one_member.three_term_ratio",
        1.0,
    ),
    Target(
        "many members: time over C, gathering",
        "many.ratio_gathering",
        1.2,
    ),
    Target(
        "many members: time over C, stepping alone",
        "many.ratio_stepping",
        1.2,
    ),
    Target(
        "many members, increment: time over C, stepping alone",
        "many.ratio_increment",
        1.2,
        note="each step also gives the velocity and looks for overflow and NaN",
    ),
    Target(
        "many members: times faster than numpy",
        "many.over_numpy",
        10.0,
        at_least=True,
        note="numpy has a vector sine of its own by now",
    ),
    Target(
        "formulas: time over the model built in, the largest",
        "formulas.ratio",
        1.2,
    ),
    Target(
        "systems of one formula: the same",
        "systems.ratio",
        1.2,
    ),
    Target(
        "a chain of 64 coordinates: time over C, stepping alone",
        "systems.chain_ratio",
        1.3,
    ),
    Target("a beam of 1024 degrees of freedom", "systems.beam_wall", 60.0, "s"),
    Target("the same: order of Newmark's scheme", "systems.beam_order", 1.95, at_least=True),
    Target(
        "one trajectory, increment ladder: times faster than DOP853",
        "single.increment_faster_than_dop853",
        100.0,
        at_least=True,
        note="Python around six kernel calls is over half of the time",
    ),
    Target(
        "the same: time over heyoka's",
        "single.increment_over_heyoka",
        2.5,
        note="the same, and Taylor series of high order need fewer operations",
    ),
    Target(
        "one trajectory, compensated ladder: times faster than DOP853",
        "single.compensated_faster_than_dop853",
        80.0,
        at_least=True,
        note="the same",
    ),
    Target(
        "the same: time over heyoka's",
        "single.compensated_over_heyoka",
        5.0,
        note="the same",
    ),
    Target(
        "10^4 trajectories, increment ladder: times faster than solve_ivp",
        "many_error.increment_faster_than_solve_ivp",
        2000.0,
        at_least=True,
    ),
    Target(
        "the same: times faster than numbalsoda",
        "many_error.increment_faster_than_numbalsoda",
        30.0,
        at_least=True,
        note="numbalsoda is timed at its most exact setting: none reaches 1e-10",
    ),
    Target(
        "the same: times faster than heyoka in batches",
        "many_error.increment_faster_than_heyoka",
        1.5,
        at_least=True,
        note="Taylor series of high order need fewer operations",
    ),
    Target("simulate job: CPU beyond its stepping", "jobs.beyond_stepping", 0.6, "s"),
    Target(
        "the same: wall time of a job of 64 steps",
        "jobs.small_wall",
        0.59,
        "s",
        note="what one job per case cost in a prototype",
    ),
    Target(
        "10^5 members x 4 levels: pipeline over the scalar script",
        "pipeline.100000.scalar_ratio",
        1.3,
    ),
    Target(
        "10^6 members x 4 levels: pipeline over the SIMD script on one core",
        "pipeline.1000000.simd_ratio",
        1.5,
        note="the pipeline also has verdicts, bounds and sealed files",
    ),
    Target(
        "the same, the script on all cores",
        "pipeline.1000000.both_ratio",
        1.5,
    ),
    Target("nothing to do: `vibsim run` over Snakemake", "runs.nothing_ratio", 1.2),
    Target("default run after installation, cold", "runs.cold", 120.0, "s"),
    Target("one member at level 30, compensated", "deep.wall", 45.0, "s"),
    Target("the same: peak memory", "deep.peak_mib", 300.0, "MiB"),
    Target("10^6 members x 4 levels", "pipeline.1000000.wall", 60.0, "s"),
    Target(
        "the same: peak memory of the largest process", "pipeline.1000000.peak_mib", 2048.0, "MiB"
    ),
    Target(
        "contiguous writing, times faster than the best compression",
        "storage.contiguous_over_compressed",
        1.0,
        at_least=True,
        note="why only files of a moderate size are compressed",
    ),
    *(
        Target(
            f"explicit schemes, lane {lane}, {words}: cost over force evaluations",
            f"lanes.{lane}.{figure}",
            1.3,
        )
        for lane in ("plain", "scalar", "blocks")
        for figure, words in (("bare", "stepping alone"), ("gathering", "gathering"))
    ),
    Target("round-off at level 24: increment over three-term", "round_off.ratio", 1e-4),
    Target(
        "10^5 members: time on two nodes of SLURM over a local run",
        "cluster.ratio",
        1.5,
    ),
)


def lines(figures: Mapping[str, float]) -> list[str]:
    """Return the table of targets."""
    rows = [_row(one, figures) for one in TARGETS]
    reached = sum(row[3] == "yes" for row in rows)
    caption = (
        f"{reached} of {len(rows)} targets are reached. C, written by hand and built with -O3, has the same "
        "arithmetic and sine unless the row says otherwise."
    )
    header = ["what", "to reach", "measured", "reached", "what limits it"]
    return ["## Targets", "", *table(caption, header, rows)]


def _row(target: Target, figures: Mapping[str, float]) -> list[object]:
    unit = f" {target.unit}" if target.unit else ""
    words = "at least" if target.at_least else "at most"
    wanted = f"{words} {target.limit:g}{unit}"
    value = figures.get(target.figure)
    if value is None:
        return [target.what, wanted, "not measured", "", target.note]
    compare: Callable[[float, float], bool] = operator.ge if target.at_least else operator.le
    reached = "yes" if compare(value, target.limit) else "**no**"
    return [target.what, wanted, f"{value:.3g}{unit}", reached, target.note]
