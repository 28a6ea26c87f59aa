"""The plan of an experiment: its members, levels, shards, file names, digests and costs; no arrays, no netCDF.

Loading a cached plan imports neither numpy nor the validation library, because Snakemake asks for the plans of all
experiments each time it starts.
"""

from vibsim.plan.cache import load, load_all
from vibsim.plan.choose import Choice, choose, experiments
from vibsim.plan.jobs import Batch, LevelJob, Plan, ShardJob
from vibsim.plan.workflow_names import Names

__all__ = [
    "Batch",
    "Choice",
    "LevelJob",
    "Names",
    "Plan",
    "ShardJob",
    "choose",
    "experiments",
    "load",
    "load_all",
]
