"""Limits on the size of an experiment, checked by counts alone: nothing is expanded or allocated."""

from __future__ import annotations

from vibsim.experiment.cost import level_cost
from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.setting import Setting

MAX_MEMBERS = 10**7
MAX_MEMBER_STEPS = 2**40  # total steps of all schemes, members and levels: about a day of one core
MAX_MEMORY = 8 * 2**30
"""Memory of a job [bytes], which holds at least all samples of one member and all schemes at one level."""
MAX_DISK = 2**40  # bytes of the files of all levels
MAX_FILES = 10_000
"""Files of all levels. With more of them the overhead of the workflow dominates."""
MIN_DT = 1e-100  # smallest time step: its square, and quotients by that, must be floats


def check(setting: Setting, report: Report) -> None:
    """Report every limit on counts that is exceeded."""
    members = setting.members or 1
    if members > MAX_MEMBERS:
        rule = f"must not have more than {MAX_MEMBERS} members, has {members}"
        report.add(("sweep",), rule, at_key=True)
    if setting.time is None or not setting.levels:
        return
    coarsest, finest = setting.steps(setting.levels[0]), setting.steps(setting.levels[-1])
    if coarsest < 2:
        rule = f"the coarsest level must have at least 2 steps, has {coarsest}"
        report.add(("levels",), rule, "begin at a higher level, or give more base_steps")
    if isinstance(setting.samples, int) and coarsest % setting.samples:
        rule = f"must divide the {coarsest} steps of the coarsest level"
        report.add(("samples", "every"), rule, value=setting.samples)
    if setting.sweep.least_end(setting.time) / min(finest, MAX_MEMBER_STEPS) < MIN_DT:
        report.add(("time",), f"the time step must not be less than {MIN_DT:g}", at_key=True)
    total = sum(map(setting.steps, setting.levels)) * setting.trajectories
    if total > MAX_MEMBER_STEPS:
        rule = f"the experiment must not take more than {MAX_MEMBER_STEPS} steps, it takes {total}"
        report.add(("levels",), rule, "steps of every level, scheme and member together")


def check_costs(experiment: ExperimentSpec, report: Report) -> None:
    """Report if a job takes too much memory, or the levels too much disk or too many files."""
    costs = [level_cost(experiment, level) for level in experiment.levels]
    hint = "store fewer samples, or begin at a lower level"
    smallest = experiment.chain  # the smallest job makes one member, or one chain of members
    memory = max((cost.memory(smallest) for cost in costs), default=0)
    disk = sum(cost.disk(experiment.members) for cost in costs)
    files = [cost.shards(experiment.members) for cost in costs]
    if memory > MAX_MEMORY:
        what = "one member" if smallest == 1 else f"the {smallest} members that follow each other"
        rule = f"{what} at one level must not take more than {MAX_MEMORY} bytes of memory, it takes {memory}"
        report.add(("levels",), rule, hint, at_key=True)
    if disk > MAX_DISK:
        rule = f"the files must not take more than {MAX_DISK} bytes, they take {disk}"
        report.add(("levels",), rule, hint, at_key=True)
    if sum(files) > MAX_FILES:
        rule = f"the levels must not have more than {MAX_FILES} files, they have {sum(files)}"
        finest = f"{files[-1]} of them are of level {experiment.levels[-1]}"
        hint = f"{finest}: leave levels out, or take fewer members"
        report.add(("levels",), rule, hint, at_key=True)
