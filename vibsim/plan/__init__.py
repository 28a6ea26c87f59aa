"""What there is to do: members, levels, shards, names, digests and costs; no arrays, no netCDF.

Loading a plan that is cached imports neither numpy nor the validation library: Snakemake asks for the plans of all
experiments each time it starts.
"""

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy
from vibsim.plan.cache import load, load_all
from vibsim.plan.choose import Choice, choose, experiments
from vibsim.plan.jobs import Batch, LevelJob, Plan, ShardJob
from vibsim.plan.workflow_names import Names

if TYPE_CHECKING:
    from vibsim.experiment.storage import sampling
    from vibsim.experiment.sweep_columns import columns, option_groups

__all__ = [
    "Batch",
    "Choice",
    "LevelJob",
    "Names",
    "Plan",
    "ShardJob",
    "choose",
    "columns",
    "experiments",
    "load",
    "load_all",
    "option_groups",
    "sampling",
]

__getattr__, __dir__ = lazy(
    __name__,
    {
        "vibsim.experiment.sweep_columns": ("columns", "option_groups"),
        "vibsim.experiment.storage": ("sampling",),
    },
)
