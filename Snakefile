# From experiment files to results/index.html. The rules name files and call vibsim; nothing is decided here.
import sys
from pathlib import Path
from shlex import quote

from vibsim.cli.run.lock import hold
from vibsim.cli.workflow import names_of
from vibsim.cli.supervise import children_end_with_this

# What allows programs of users to run is read from the command line alone, never from a file.
names = names_of(config, workflow.config_settings.config)


# Jobs run the vibsim that stands beside this Python, whatever else is installed.
# They take the place of their shell (`exec`), which makes them children of Snakemake, and end with it.
children_end_with_this()
shell.prefix(f"export PATH={quote(str(Path(sys.executable).parent))}:$PATH; ")


# Every path below is relative to the results folder, and so are Snakemake's own records. Jobs work elsewhere: what
# libraries read from the folder that they are in must not come with results.
workdir: str(names.results)


report: "workflow/report/workflow.rst"


wildcard_constraints:
    experiment=names.experiment_pattern,
    shard=r"\d\d\d\d+",


rule all:
    input:
        "index.html",
        "summary.csv",
        names.files,
        # Of what a job writes, Snakemake misses only what is asked for.
        expand("{name}/{part}", name=list(names.plans), part=["figures", "tables"]),


onstart:
    hold(names.results)


include: "workflow/rules/report.smk"
include: "workflow/rules/analyse.smk"
include: "workflow/rules/extrapolate.smk"
include: "workflow/rules/simulate.smk"
